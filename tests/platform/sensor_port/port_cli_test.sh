#!/usr/bin/env bash
# roborun port, with the Python example as the feeder. usage: port_cli_test.sh ROBORUN ROOT
set -uo pipefail
roborun=$1 root=$2
name=test-$$ path=/dev/shm/roborun-test-$$
failed=0 passed=0
feeder=
trap 'kill $feeder 2>/dev/null; rm -f "$path"*' EXIT
says() {  # CODE TEXT COMMAND..
  local wanted=$1 text=$2 out code
  shift 2
  out=$("$roborun" "$@" 2>&1)
  code=$?
  if [[ $code -ne $wanted || "$out" != *"$text"* ]]; then
    echo "FAILED [$code] roborun $*: '${out:0:300}' does not say '$text' with exit code $wanted"
    failed=$((failed + 1))
  else
    passed=$((passed + 1))
  fi
}
says 2 "No such file or directory" port check "$name"
says 2 "is no sensor port" port watch "$root/README.md" --seconds 1
"$root/platform/sensor_port/example/feed_wall.py" "$name" &
feeder=$!
for _ in $(seq 100); do [[ -e $path ]] && break; sleep 0.05; done
says 0 "READY     $name: " port check "$name"
says 0 "160 x 120, 90 x 74 degrees, 100 % of the pixels know something" port check "$path"
says 0 '"ready":true' port check "$name" --json
says 0 "written to" port list
says 0 "nearest 5.00 m; " port watch "$name" --seconds 0.5
kill -9 $feeder
wait $feeder 2>/dev/null
says 1 "NOT READY $name: no process writes to it: start its feeder" port check "$name" --seconds 0.2
says 0 "no writer" port list
says 0 '"written_to":false' port list --json
truncate -s 100 "$path"
says 2 "shorter than its header" port check "$name"
# The header alone is enough for C99.
printf '#include "platform/sensor_port/roborun_port.h"\nint main(void) { struct roborun_port_writer w; struct roborun_port_imu s; memset(&s, 0, sizeof s);\nconst char* e = roborun_port_open(&w, "%s", ROBORUN_PORT_IMU, 0, 8); if (e) { puts(e); return 1; }\nfor (;;) { struct timespec t; clock_gettime(CLOCK_MONOTONIC, &t); s.at.stamp_ns = t.tv_sec * 1000000000LL + t.tv_nsec; s.at.sequence++; roborun_port_write(&w, &s, NULL, 0); usleep(2500); } }\n' "$path" >"$path.c"
if cc -std=c99 -D_DEFAULT_SOURCE -Wall -Wextra -Werror -pedantic -O2 -I"$root" "$path.c" -o "$path.feeder"; then
  "$path.feeder" &
  feeder=$!
  sleep 0.3
  says 0 "READY     $name: " port check "$name"
  says 0 '"device":"imu"' port list --json
else
  echo "FAILED roborun_port.h is no C99"
  failed=$((failed + 1))
fi
# Recorded images.
kill $feeder 2>/dev/null
wait $feeder 2>/dev/null
rm -f "$path"
folder=$(mktemp -d)
trap 'kill $feeder 2>/dev/null; rm -rf "$path"* "$folder"' EXIT
python3 - "$folder" <<'PYTHON'
import struct, sys, zlib
def chunk(kind, data):
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
rows = b"".join(b"\0" + struct.pack(">16H", *([2500] * 16)) for _ in range(12))
png = b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", 16, 12, 16, 0, 0, 0, 0)) + chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b"")
for i in range(3):
    open(f"{sys.argv[1]}/{i}.png", "wb").write(png)
open(f"{sys.argv[1]}/camera.txt", "w").write("16 16 7.5 5.5 1000\n")
open(f"{sys.argv[1]}/poses.txt", "w").write("".join(f"{0.1 * i} {i} 0 2 -0.5 0.5 -0.5 0.5\n" for i in range(3)))
PYTHON
says 0 "" feed files --from "$folder" --port "$name" --rate 50
says 1 "no process writes to it" port check "$name" --seconds 0.2
says 2 "/nonexistent/x: No such file" feed files --from "$folder" --port /nonexistent/x
says 2 "must be a folder" feed files --from "$folder/nope" --port "$name"
"$roborun" feed files --from "$folder" --port "$name" --odometry "$name-vio" --rate 50 --loop 2>/dev/null &
feeder=$!
sleep 0.4
says 2 "another process writes to this port" feed files --from "$folder" --port "$name"
says 0 "16 x 12, 53 x 41 degrees, 100 % of the pixels know something, 0 % see nothing within 10.0 m, nearest 2.50 m" port check "$name"
says 0 '"device":"odometry","ready":true' port check "$name-vio" --json
# A camera of the kernel: what is none is refused, and makes no port (images: tests/platform/feed, and the ARM guest).
camera=(--port "$name-v4l2")
says 2 "--vehicle, --intrinsics: one of them must be given" feed v4l2 /dev/null "${camera[@]}"
says 2 "/dev/null: is no video device" feed v4l2 /dev/null --vehicle x500 "${camera[@]}"
says 2 "/dev/roborun-none: No such file" feed v4l2 /dev/roborun-none --intrinsics 16,16,8,8 "${camera[@]}"
says 2 "--camera: 2: the vehicle 'x500' has 1 cameras" feed v4l2 /dev/null --vehicle x500 --camera 2 "${camera[@]}"
says 2 "--camera: goes with --vehicle" feed v4l2 /dev/null --intrinsics 16,16,8,8 --camera 2 "${camera[@]}"
says 2 "--range: goes with --intrinsics alone" feed v4l2 /dev/null --vehicle x500 --range 5 "${camera[@]}"
says 2 "--intrinsics: '1,2': must be FX,FY,CX,CY" feed v4l2 /dev/null --intrinsics 1,2 "${camera[@]}"
[[ -e $path-v4l2 ]] && { echo "FAILED a refused camera left a port"; failed=$((failed + 1)); }
echo "$passed passed, $failed failed"
[[ $failed -eq 0 && $passed -ge 27 ]]
