#!/usr/bin/env bash
# roborun feed dds hears another process on loopback. usage: dds_feed_test.sh ROBORUN PUBLISHER ROOT
set -uo pipefail
. "$(dirname "$0")/../../support/checks.sh"
roborun=$1 publisher=$2 root=$3
name=test-dds-$$
export ROS_DOMAIN_ID=$((1 + $$ % 200))
# Loopback alone, without multicast.
export CYCLONEDDS_URI='<CycloneDDS><Domain><General><Interfaces><NetworkInterface name="lo"/></Interfaces><AllowMulticast>false</AllowMulticast></General><Discovery><ParticipantIndex>auto</ParticipantIndex><Peers><Peer Address="127.0.0.1"/></Peers></Discovery></Domain></CycloneDDS>'
children=()
work=$(mktemp -d)
trap 'kill "${children[@]}" 2>/dev/null; rm -rf "$work" /dev/shm/roborun-"$name"*' EXIT
says() {  # CODE TEXT COMMAND..
  local wanted=$1 text=$2 out code
  shift 2
  out=$("$roborun" "$@" 2>&1)
  code=$?
  check "[$code] roborun $*: '${out:0:300}' does not say '$text' with exit code $wanted" \
    [ "$code" -eq "$wanted" -a "${out/"$text"/}" != "$out" ]
}
lacks() { ! grep -q "$1" "$2"; }
holds() { grep -q "$1" "$2"; }
cat "$root/platform/vehicle/x500.toml" - >"$work/vehicle.toml" <<'TOML'
[[lidar]]
rings = 4
columns = 100
lowest_deg = -5
highest_deg = 5
range_min_m = 0.3
range_m = 70
rate_Hz = 10
latency_s = 0.02
TOML
check "the program that flies does not link it" lacks ddsc <(readelf -d "$roborun")
# Bad input: one line, exit code 2.
feed=(feed dds --vehicle "$work/vehicle.toml" --port "$name")
says 2 "at least one of them must be given" feed dds
says 2 "--port: must be given" feed dds --imu /imu
says 2 "'imu': must be the whole name of a topic" feed dds --imu imu --port "$name"
says 2 "go with --vehicle" feed dds --camera /a --port "$name"
says 2 "given 2 times: the vehicle" "${feed[@]}" --camera /a/b --camera /a/c
says 2 "must be IMAGE or IMAGE,CAMERA_INFO" "${feed[@]}" --camera /a,/b,/c
says 2 "is given twice" "${feed[@]}" --imu /a --odometry /a
says 2 "--prefix: goes with --live" "${feed[@]}" --imu /a --prefix /b
says 2 "--domain: '233'" "${feed[@]}" --imu /a --domain 233
says 2 "--live: '0'" "${feed[@]}" --live 0
cp "$roborun" "$work/roborun"
check "a build without Cyclone DDS says so" holds "roborun-feed-dds is not there: must be built with cyclonedds-dev" \
  <("$work/roborun" "${feed[@]}" --imu /a 2>&1)

"$roborun" "${feed[@]}" --camera /test/depth/image --lidar /test/points --imu /test/imu --odometry /test/odom >"$work/out" 2>"$work/err" &
feeder=$!
"$publisher" "$ROS_DOMAIN_ID" good 60 &
children=("$feeder" $!)
for _ in $(seq 200); do [[ -e /dev/shm/roborun-$name-camera1 ]] && break; sleep 0.05; done
says 0 "16 x 12, 53 x 41 degrees, 100 % of the pixels know something, 0 % see nothing within 10.0 m, nearest 2.50 m" port check "$name-camera1"
says 0 "rates (0.50, 0.00, 0.25) rad/s, force (0.00, 0.50, 9.81) m/s2" port check "$name-imu"
says 0 "at (1.00, 2.00, 3.00) m within 0.20 m, reset 1" port check "$name-odometry"
check "nothing of a good driver is refused, apart from images before their CameraInfo and what a busy machine brings late" lacks "left out: [^ni]" "$work/err"
# Another driver, of the same topics: refused as long as the first one is heard, then heard.
"$publisher" "$ROS_DOMAIN_ID" bad 60 &
bad=$!
children+=($bad)
for _ in $(seq 200); do holds "more than one node" "$work/err" && break; sleep 0.05; done
check "a second publisher is not heard" holds "/test/imu: left out: more than one node publishes it" "$work/err"
kill "${children[1]}"
for _ in $(seq 200); do holds "frame 'camera_imu_optical_frame'" "$work/err" && holds "covariance of its pose" "$work/err" && break; sleep 0.05; done
says 0 "reset 2" port check "$name-odometry"
says 0 "nearest 2.50 m" port check "$name-camera1"
for line in "depth/camera_info: left out: k has fx nan" "depth/camera_info: left out: its images are distorted" \
  "depth/image: left out: encoding 'rgb8': must be 16UC1 or 32FC1" "depth/image: left out: step 31: 16 pixels need 32 bytes" \
  "depth/image: left out: 480 bytes: 12 rows of 4000000000 are 48000000000" "depth/image: left out: its stamp is 1000.0.* s behind" \
  "imu: left out: rates or accelerations are not finite" "imu: left out: its stamp is \(999.9\|1000.0\).* s ahead of" \
  "imu: left out: it is in the frame 'camera_imu_optical_frame'" "odom: left out: position, orientation or speed are not finite" \
  "odom: left out: the covariance of its pose is all zero"; do
  check "it says: $line" holds "/test/$line" "$work/err"
done
check "one line for each kind" [ "$(grep -c "encoding 'rgb8'" "$work/err")" -eq 1 ]
check "it is alive" kill -0 "$feeder"
for _ in $(seq 120); do holds "/test/points: nothing came for 5 s" "$work/err" && break; sleep 0.05; done
check "bytes of another type are no message" holds "/test/points: nothing came for 5 s" "$work/err"
kill "$feeder"
wait "$feeder"
check "exit code 130" [ $? -eq 130 ]
cat "$work/out"
check "totals" holds "/test/imu: [0-9]* taken, [0-9]* left out (frame), [0-9]* left out (sender), [0-9]* left out (stamp), [0-9]* left out (values)" "$work/out"
check "bad sizes are counted" holds "/test/depth/image: .*left out (data), .*left out (encoding), .*left out (stamp), .*left out (step)" "$work/out"

echo "$passed passed, $failed failed"
[[ $failed -eq 0 && $passed -ge 36 ]] || { cat "$work/err"; exit 1; }
