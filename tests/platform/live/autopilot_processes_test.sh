#!/usr/bin/env bash
# Flights of a plant whose vehicle a fake autopilot flies, and a runtime at the other end of a MAVLink link, and what becomes of the
# vehicle when one of them dies, stops, or the pilot takes over. usage: autopilot_processes_test.sh ROBORUN ROOT [FLIGHT:KIND..]
set -uo pipefail
roborun=$1 root=$2
folder=$(mktemp -d)
. "$(dirname "$0")/flight_checks.sh"
name=$(basename "$folder")
plant= run=
trap 'kill -9 $plant $run 2>/dev/null; rm -rf "$folder" /dev/shm/roborun-$name-*' EXIT

start() {  # KIND SECONDS_OF_PLANT OPTION_OF_PLANT..
  local kind=$1 seconds=$2
  shift 2
  local port=$((20000 + RANDOM % 12000))
  rm -f "$folder"/*.json
  "$roborun" plant --world "$root/tests/data/worlds/two_pillars.toml" --port "$name" --seconds "$seconds" --json \
    --autopilot "$kind" --mavlink "udpout://127.0.0.1:$port" ${plant_key:-} "$@" >"$folder/plant.json" 2>"$folder/plant.err" &
  plant=$!
  ground=udpout://127.0.0.1:$((port + 1))
  "$roborun" run --vehicle paper --link "udpin://127.0.0.1:$port" --port "$name" --autopilot "$kind" $arm $goal ${run_key:-} --ground "udpin://127.0.0.1:$((port + 1))" \
    --bounds=-10,-15,1.5,70,15,8 --profile paper --best-effort --wait 60 --seconds "$limit" --json >"$folder/run.json" \
    2>"$folder/run.err" &
  run=$!
}
below() {  # LIMIT FILE PATH
  python3 -c 'import sys; sys.exit(not float(sys.argv[2]) < float(sys.argv[1]))' "$1" "$(value "$2" "$3")" ||
    { echo "$2: $3 is $(value "$2" "$3"), not below $1"; return 1; }
}
above() {  # LIMIT FILE PATH
  python3 -c 'import sys; sys.exit(not float(sys.argv[2]) > float(sys.argv[1]))' "$1" "$(value "$2" "$3")" ||
    { echo "$2: $3 is $(value "$2" "$3"), not above $1"; return 1; }
}
arm=--arm limit=120 goal="--goal 60,0,4"

reaches_the_goal() {
  start "$1" 150
  ends 0 $run && ends 0 $plant && is True run reached_goal && is landed run ended && is True plant reached_goal &&
    is False plant collided && is landed plant reason && is False plant autopilot.armed && is 0 run heap_calls_after_start
}
# Nobody commands: the autopilot stops by itself after half a second, and stands.
stands_without_a_runtime() {
  start "$1" 40
  sleep 22
  kill -KILL $run
  ends 0 $plant && is False plant collided && is time_limit plant reason && is 1 plant autopilot.timeouts &&
    is "$([[ $1 == px4 ]] && echo hold || echo guided)" plant autopilot.mode && is True plant autopilot.armed &&
    below 0.3 plant speed_mps
}
# The autopilot is gone for good: nothing is sent any more, and after ten seconds the flight is given up.
gives_up_without_an_autopilot() {
  start "$1" 150
  sleep 16
  kill -KILL $plant
  ends 1 $run && is lost run reason && is "the autopilot's" run ended && is lost run autopilot.stage
}
# Gone for three seconds, with its vehicle. PX4 and ArduCopter are still in our mode when they come back (no time passed for their
# set-points): the failsafe had no position, and lands.
lands_after_a_pause() {
  start "$1" 150
  sleep 18
  kill -STOP $plant
  sleep 3
  kill -CONT $plant
  ends 1 $run && ends 0 $plant && is landed run reason && is landed run ended && is False plant collided &&
    is landed plant reason
}
# His mode change ends our commands, and is not fought.
is_the_pilots() {
  start "$1" 150 --pilot-after 12
  ends 1 $run && is pilot run reason && is "the pilot's" run ended && ends 0 $plant && is False plant collided &&
    is landed plant reason && is land plant autopilot.mode
}
lands_on_a_signal() {
  start "$1" 150
  sleep 18
  kill -TERM $run
  ends 130 $run && ends 0 $plant && is interrupted run reason && is landed run ended && is False plant collided &&
    is landed plant reason
}
# Take-off, way-points, hold, speed, fence, release, return: reached in the order of the plan.
flies_a_plan() {
  goal="--mission $root/tests/data/missions/two_pillars.plan" limit=300
  start "$1" 300
  goal="--goal 60,0,4" limit=120
  ends 0 $run && ends 0 $plant && is True run reached_goal && is landed run ended && is 6 run mission.done &&
    is 1 run mission.released && is 1 plant autopilot.releases && is True plant reached_goal && is False plant collided &&
    is landed plant reason
}
# Another goal on the way, from who may give it; what is outside is refused, and so is everybody else.
goes_elsewhere() {
  start "$1" 150
  sleep 15
  "$roborun" goto 500,0,4 --link "$ground" >"$folder/out"
  [[ $? -eq 1 ]] && grep -q "refused: .*outside of the bounds" "$folder/out" || { echo "not refused"; return 1; }
  "$roborun" goto 20,0,4 --link "$ground" --ground-id 7 --wait 2 2>/dev/null
  [[ $? -eq 2 ]] || { echo "a stranger was answered"; return 1; }
  sleep 6 # the stranger's link is forgotten
  "$roborun" goto 25,8,4 --link "$ground" || { echo "not accepted"; return 1; }
  ends 0 $run && ends 0 $plant && is True run reached_goal && is landed run ended && is 1 run goals_given &&
    is 1 run goals_refused && is False plant reached_goal && is False plant collided && is landed plant reason
}
# Nothing unsigned is heard, at either end, nor by the ground's link; with another key nobody is heard.
flies_signed() {
  printf '%064d\n' 7 >"$folder/key"
  printf '%064d\n' 8 >"$folder/other"
  plant_key="--signing-key $folder/key" run_key="--signing-key $folder/key"
  start "$1" 150
  sleep 15
  "$roborun" goto 25,8,4 --link "$ground" --signing-key "$folder/other" --wait 2 2>/dev/null
  [[ $? -eq 2 ]] || { echo "another key was answered"; plant_key= run_key=; return 1; }
  sleep 6
  "$roborun" goto 25,8,4 --link "$ground" --signing-key "$folder/key" || { echo "not accepted"; plant_key= run_key=; return 1; }
  plant_key= run_key=
  ends 0 $run && ends 0 $plant && is True run reached_goal && is 1 run goals_given && is False plant collided &&
    is 0 plant autopilot.lost_frames
}
# Ten minutes of hover on the way: the vehicle's side counts the frames of the runtime by their sequence numbers.
loses_no_set_point() {
  python3 - "$root/tests/data/missions/two_pillars.plan" "$folder/long.plan" <<'END'
import json, sys
plan = json.load(open(sys.argv[1]))
next(i for i in plan["mission"]["items"] if i["command"] == 16)["params"][0] = 600
json.dump(plan, open(sys.argv[2], "w"))
END
  goal="--mission $folder/long.plan" limit=900
  start "$1" 900
  goal="--goal 60,0,4" limit=120
  ends 0 $run && ends 0 $plant && is True run reached_goal && is 0 plant autopilot.lost_frames &&
    is 0 plant autopilot.doubled_frames && is "$(value run autopilot.set_points)" plant commands &&
    above 30000 plant commands && echo "$1: $(value plant commands) set-points, s from state to set-point: $(value run autopilot.state_to_set_point_s)"
}
# Without --arm the operator takes mode and arms. Here nobody does.
waits_for_the_operator() {
  arm= limit=6
  start "$1" 12
  arm=--arm limit=120
  ends 1 $run && is time_limit run reason && is "on the ground" run ended && ends 0 $plant &&
    is False plant autopilot.armed
}

failed=0
shift 2
[[ $# -gt 0 ]] || set -- {reaches_the_goal,stands_without_a_runtime,gives_up_without_an_autopilot,lands_after_a_pause}:{px4,arducopter} \
  {is_the_pilots,lands_on_a_signal,flies_a_plan,goes_elsewhere,flies_signed,waits_for_the_operator}:{px4,arducopter}
for flight; do
  tries "$flight" "${flight%:*}" "${flight#*:}" || failed=$((failed + 1))
done
[[ $failed -eq 0 ]]
