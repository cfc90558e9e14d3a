# Sourced by the scripts that run in the virtual machine. Each prints lines that its test reads:
# "CASE name", then what its programs print.
export PATH=/usr/sbin:/usr/bin:/sbin:/bin
word() { sed "s/.* $1=\([^ ]*\).*/\1/" /proc/cmdline; }  # the value of KEY=VALUE
BIN=$(word bin)
REPEATS=$(word repeats)
SECONDS_EACH=$(word seconds)
export BIN REPEATS SECONDS_EACH

begin() { printf '\nCASE %s\n' "$1"; }  # on a line of its own, whatever the console said

# calibration WIDTH HEIGHT FILE: cameras of that size, one eye.
calibration() {
  local side
  echo "sovo_calibration: 1" >"$3"
  for side in left right; do
    echo "$side: {width: $1, height: $2, fx: $1, fy: $1, cx: $(($1 / 2)), cy: $(($2 / 2)), distortion: none}"
  done >>"$3"
  echo "T_right_left: [1, 0, 0, -0.12, 0, 1, 0, 0, 0, 0, 1, 0]" >>"$3"
}

# wait_for_device NAME: until a video device of that name is there; sets DEVICE.
wait_for_device() {
  local tries name
  for tries in $(seq 300); do
    for name in /sys/class/video4linux/video*/name; do
      if grep -qs "$1" "$name" && [ "$(cat "${name%name}index")" = 0 ]; then
        DEVICE=/dev/$(basename "$(dirname "$name")")
        [ -e "$DEVICE" ] && return 0
      fi
    done
    sleep 0.1
  done
  echo "no device $1 after $tries tries" && return 1
}
