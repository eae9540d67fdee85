#!/usr/bin/env bash
# Scenarios of the library as two processes on real time: a plant with the faults of the file, and a runtime that knows nothing of them. What comes of
# each is what its file says: how the flight ended, what the failsafe did, and no collision but where motors off or a collision is what is written.
# usage: scenarios_over_plant_test.sh ROBORUN FILE|FOLDER..   of a folder those whose faults are the plant's, and whose settings `run` has, too
set -uo pipefail
roborun=$1
shift
folder=$(mktemp -d)
. "$(dirname "$0")/flight_checks.sh"
name=$(basename "$folder")
plant= run=
trap 'kill -9 $plant $run 2>/dev/null; rm -rf "$folder" /dev/shm/roborun-$name-*' EXIT

# Otherwise over a plant than in lockstep:
#   depth_intermittent_mission  there a camera makes an image when one is asked for, and half of them is too few; here images come all the time
#   esc_stuck_mission           what becomes of it hangs on the moment, as the file says
#   gnss_off_ground             its time counts from the start there, and from leaving the ground here
# What `expect` asks of it, line by line; nothing: all holds.
verdict() {  # FILE
  python3 - "$1" "$folder/plant.json" "$folder/run.json" <<'END'
import json, os, sys, tomllib
scenario = tomllib.load(open(sys.argv[1], "rb"))
differs = {"depth_intermittent_mission": {"outcome": "reached_goal"}, "esc_stuck_mission": {"outcome": "collision"},
           "gnss_off_ground": {"outcome": "landed", "action": "land"}}
scenario["expect"] = differs.get(os.path.basename(sys.argv[1])[:-5], scenario["expect"])
plant, run = (json.loads(open(f).read().splitlines()[-1]) for f in sys.argv[2:])
expect, wrong = scenario["expect"], []
def ask(what, got, wanted):
    if got != wanted: wrong.append(f"{what} is {got}, not {wanted}")
ask("faults begun", plant["injected"], len(scenario["fault"]))
outcome = expect["outcome"]
if outcome not in ("collision", "struck", "killed", "terminated"):  # without motors it falls
    ask("collided", plant["collided"], False)
if outcome != "collision":
    ask("reason", run["reason"], outcome)
taken = [e["action"] for e in run["failsafe"] if e["action"] != "go_on"] or ["go_on"]
# At the goal, or at the end of a hold, the runtime lands: that is no answer to a fault.
if "action" in expect and expect["action"] not in taken + ["go_on"]:
    wrong.append(f"action {expect['action']} was not taken: {taken}")
if "condition" in expect and not any(expect["condition"] in e["conditions"] for e in run["failsafe"]):
    wrong.append(f"condition {expect['condition']} did not come: {run['failsafe']}")
print("\n".join(wrong))
END
}
as_written() {  # FILE
  rm -f "$folder"/*.json
  "$roborun" plant --scenario "$1" --port "$name" --seconds 240 --json >"$folder/plant.json" 2>"$folder/plant.err" &
  plant=$!
  local line i
  for i in $(seq 100); do
    line=$(grep -o 'roborun run .*' "$folder/plant.err") && break
    kill -0 $plant 2>/dev/null || break
    sleep 0.1
  done
  [[ -n "$line" ]] || { echo "no plant"; return 1; }
  # shellcheck disable=SC2086  # the line has options without spaces
  "$roborun" ${line#roborun } --profile paper --best-effort --wait 60 --seconds 120 --json \
    >"$folder/run.json" 2>"$folder/run.err" &
  run=$!
  wait $run $plant
  local wrong
  wrong=$(verdict "$1" 2>&1)
  [[ -z "$wrong" ]] || { echo "$wrong"; return 1; }
}

# Scenarios with other settings need a runtime that has them. What becomes of pulses of every other sample of the kill switch hangs on how two clocks
# meet: the newest sample of a port may be read twice, and is a pressed switch then.
of_a_plant() {  # FOLDER
  python3 - "$1" <<'END'
import glob, sys, tomllib
for path in sorted(glob.glob(sys.argv[1] + "/*.toml")):
    s = tomllib.load(open(path, "rb"))
    faults = s.get("fault", [])
    plain = set(s) <= {"scenario", "fault", "expect", "flight"} and set(s.get("flight", {})) <= {"time_limit_s"}
    seen = all(f["component"] not in ("cpu", "planner", "map") and
               f.get("phase", "mission") in ("take_off", "mission") for f in faults)
    if faults and plain and seen and not path.endswith("/kill_pulses_mission.toml"):
        print(path)
END
}

failed=0
files=()
for given in "$@"; do
  if [[ -d $given ]]; then
    mapfile -t -O ${#files[@]} files < <(of_a_plant "$given")
  else
    files+=("$given")
  fi
done
for file in "${files[@]}"; do
  tries "$(basename "$file" .toml)" as_written "$file" || failed=$((failed + 1))
done
[[ $failed -eq 0 ]]
