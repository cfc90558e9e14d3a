# What vm_network_test.py runs in the virtual machine: a camera on a network.
# shellcheck shell=bash source-path=SCRIPTDIR
. "$(dirname "$0")/guest_common.sh"
IMAGES=$(word images)
RATE=$(word rate)
modprobe virtio_net
modprobe v4l2loopback devices=1 video_nr=20 card_label=Loop exclusive_caps=0 max_buffers=8
busybox ip address add "$(word address)" dev eth0
busybox ip link set eth0 up
# Programs and images come over a slow file system: read them before time matters.
cat "$BIN/sovo" "$BIN/loopback_writer" "$IMAGES" >/dev/null

begin network
exec 3<>"/dev/tcp/$(word control)"
"$BIN/loopback_writer" /dev/video20 "$(word width)" "$(word height)" "$RATE" "$(word frames)" \
  "$IMAGES" <&3 &
WRITER=$!
sleep 1
# A machine that stands still for a while is no camera that is gone.
"$BIN/sovo" camera v4l2 --device /dev/video20 --size "$(word width)x$(word height)" --rate "$RATE" \
  --calib "$(word calibration)" --network eth0 --set camera.live.stall_s=60 2>&1 &
CAMERA=$!
wait "$WRITER"
echo "WRITER ENDED with $?"
sleep 3 # until all of it is on the wire
kill -INT "$CAMERA"
wait "$CAMERA"
echo "CAMERA ENDED with $?"
