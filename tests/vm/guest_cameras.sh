# What vm_test.py runs in the virtual machine.
# shellcheck shell=bash source-path=SCRIPTDIR
. "$(dirname "$0")/guest_common.sh"
modprobe vhci_hcd
modprobe uvcvideo
calibration 672 376 /tmp/vga.yaml
calibration 1280 720 /tmp/hd.yaml
# What a check may take on a host that is busy with other things.
PATIENCE=$((60 + 20 * SECONDS_EACH))
# Programs come over a slow file system: read them before time matters.
cat "$BIN"/{camera_check,pair_check,emulated_camera,loopback_writer} >/dev/null

plug_in() {
  "$BIN/emulated_camera" 0 zed &
  ZED=$!
  wait_for_device ZED
}
# made NODE: when it was made, as /proc/uptime counts.
made() {
  local now
  now=$(cut -d" " -f1 /proc/uptime)
  echo "$now $(date +%s.%N) $(stat -c %.Z "$1")" | awk '{ print $1 - ($2 - $3) }'
}
# unplug PROCESS
unplug() {
  kill -9 "$1"
  wait "$1" 2>/dev/null
}
# start FILE PROGRAM ARGUMENTS...: a check in the background, its output in FILE; waits for a frame.
start() {
  local file=$1 program=$2 tries
  shift 2
  "$BIN/$program" "$@" >"$file" 2>&1 &
  CHECK=$!
  for tries in $(seq 300); do
    grep -q "FIRST FRAME" "$file" && return 0
    sleep 0.1
  done
  echo "no frame after $tries tries"
}

plug_in
begin zed_list
"$BIN/sovo" camera list
begin zed_stream
"$BIN/camera_check" /tmp/vga.yaml $((30 * SECONDS_EACH)) $PATIENCE \
  device=0012345 width=1344 height=376 frame_rate=30 "controls=exposure=42,gain=33"
v4l2-ctl -d "$DEVICE" -C gain,exposure_time_absolute,auto_exposure
begin zed_published
timeout 120 "$BIN/sovo" camera v4l2 --size 1344x376 --rate 15 --calib /tmp/vga.yaml --frames 30 \
  --control gain=22 --control exposure=50 2>&1
begin zed_controls
"$BIN/camera_check" /tmp/vga.yaml 1 10 width=1344 height=376 controls=gain=101
"$BIN/camera_check" /tmp/vga.yaml 1 10 width=1344 height=376 controls=brightnes=1

begin zed_unplug
start /tmp/unplug.txt camera_check /tmp/vga.yaml 10 $((120 * REPEATS)) width=1344 height=376 frame_rate=15 \
  controls=gain=44 reconnects="$REPEATS"
for n in $(seq "$REPEATS"); do
  sleep 1
  unplug "$ZED"
  # In another place than before: the device's number may change, the port stays.
  sleep 0.7
  plug_in
  echo "NODE $n $(made "$DEVICE")"
  for _ in $(seq 100); do
    sleep 0.1
    [ "$(v4l2-ctl -d "$DEVICE" -C gain)" = "gain: 44" ] && break
  done
done
wait "$CHECK"
cat /tmp/unplug.txt
v4l2-ctl -d "$DEVICE" -C gain
unplug "$ZED"

# Two cameras of one side each, exposing at the same instants.
calibration 320 240 /tmp/eyes.yaml
EYES=(left=0000001 right=0000002 width=320 height=240 frame_rate=10 controls=exposure=1)
plug_in_eye() {  # PORT SIDE [LATE_MS]; sets EYE
  "$BIN/emulated_camera" "$@" &
  EYE=$!
  wait_for_device "Eye $2"
}
plug_in_eye 1 left
LEFT=$EYE LEFT_DEVICE=$DEVICE
plug_in_eye 2 right
RIGHT=$EYE
begin two_cameras
"$BIN/pair_check" /tmp/eyes.yaml $PATIENCE "${EYES[@]}" pairs=$((3 * SECONDS_EACH))
"$BIN/pair_check" /tmp/eyes.yaml 60 "${EYES[@]}" "left=$LEFT_DEVICE" right=0000001

begin two_cameras_stalled
start /tmp/stalled.txt pair_check /tmp/eyes.yaml 90 "${EYES[@]}" alone=4 dropped=4 pairs=10
for stalled in "$RIGHT" "$LEFT"; do
  sleep 0.5
  kill -STOP "$stalled"
  sleep 0.8
  kill -CONT "$stalled"
done
wait "$CHECK"
cat /tmp/stalled.txt

begin two_cameras_unplugged
start /tmp/unplug.txt pair_check /tmp/eyes.yaml 90 "${EYES[@]}" reconnects=1 pairs=10
unplug "$RIGHT"
sleep 0.7
plug_in_eye 3 right
RIGHT=$EYE
wait "$CHECK"
cat /tmp/unplug.txt
unplug "$RIGHT"

begin two_cameras_half_a_period_apart
plug_in_eye 2 right 50
"$BIN/pair_check" /tmp/eyes.yaml 60 "${EYES[@]}" alone=10 dropped=10 right_late_ms=50
unplug "$EYE"
unplug "$LEFT"

begin loopback
modprobe v4l2loopback devices=1 video_nr=20 card_label=Loop exclusive_caps=0 max_buffers=8
"$BIN/loopback_writer" /dev/video20 2560 720 10 $((10 * PATIENCE)) &  # until it is killed
WRITER=$!
sleep 0.5
"$BIN/camera_check" /tmp/hd.yaml $((8 * SECONDS_EACH)) $PATIENCE device=/dev/video20 \
  width=2560 height=720 colour=true
kill "$WRITER" 2>/dev/null
wait "$WRITER" 2>/dev/null

begin vivid_errors
modprobe vivid n_devs=1 node_types=0x1 num_inputs=1 input_types=3 vid_cap_nr=30 || echo "no vivid"
VIVID=/dev/video30
v4l2-ctl -d $VIVID --set-dv-bt-timings query >/dev/null 2>&1
v4l2-ctl -d $VIVID -v width=1280,height=360,pixelformat=YUYV >/dev/null
calibration 640 360 /tmp/vivid.yaml
start /tmp/vivid.txt camera_check /tmp/vivid.yaml 400 60 device=$VIVID width=1280 height=360 pattern=false
for _ in $(seq 4); do
  v4l2-ctl -d $VIVID -c inject_v4l2_buf_flag_error=0 2>/dev/null
  sleep 0.2
done
v4l2-ctl -d $VIVID -c percentage_of_dropped_buffers=30 2>&1
wait "$CHECK"
cat /tmp/vivid.txt
v4l2-ctl -d $VIVID -c percentage_of_dropped_buffers=0
v4l2-ctl -d $VIVID -L | grep -i -E 'inject|drop|disconn'

begin vivid_disconnect
start /tmp/vivid.txt camera_check /tmp/vivid.yaml 20 60 device=$VIVID width=1280 height=360 pattern=false \
  reconnects=1
v4l2-ctl -d $VIVID -c disconnect=0
wait "$CHECK"
cat /tmp/vivid.txt
exit 0
