#!/usr/bin/env bash
# roborun plant as the physics under an autopilot, whose side is scripted: up, all that a link can do to it, down; and a restart in the
# air, where the vehicle falls. usage: physics_test.sh ROBORUN ROOT KIND
set -uo pipefail
roborun=$1 root=$2
folder=$(mktemp -d)
name=$(basename "$folder")
plant=
trap 'kill -9 $plant 2>/dev/null; rm -rf "$folder" /dev/shm/roborun-$name-*' EXIT
failed=0
flies() {  # KIND HOW EXIT_CODE WHAT_THE_REPORT_HAS
  local port=$((20000 + RANDOM % 12000)) code
  "$roborun" plant --world "$root/tests/data/worlds/two_pillars.toml" --port "$name" --physics "$1" --physics-port "$port" \
    --seconds 300 --json >"$folder/plant.json" 2>"$folder/plant.err" &
  plant=$!
  python3 "$root/tests/platform/live/autopilot_double.py" "$1" "$port" "$2" || { echo "$1 $2: the double"; failed=1; }
  wait $plant
  code=$?
  python3 - "$folder/plant.json" "$code" "$3" "$4" <<'PY' || { echo "$1 $2: the plant"; cat "$folder/plant.err"; failed=1; }
import json, sys
report = json.loads(open(sys.argv[1]).read())
print(report)
p = report["physics"]
sys.exit(not (sys.argv[2] == sys.argv[3] and report["frames_sent"] > 0 and eval(sys.argv[4], {"r": report, "p": p})))
PY
}
flight='r["reason"] == "landed" and not r["collided"] and p["restarts"] == 0 and p["resent"] == 1'
if [[ $3 == px4 ]]; then
  flies px4 flight 0 "$flight and p['refused'] >= 1"
else
  flies arducopter flight 0 "$flight and p['lost'] == 5 and p['refused'] >= 5"
fi
flies "$3" restart 1 'r["reason"] == "collision" and p["restarts"] == 1'
exit $failed
