#!/usr/bin/env bash
# Flights of a plant and a runtime as two processes, or three with a feeder, and what becomes of each when the other one dies.
# usage: two_processes_test.sh ROBORUN ROOT [FLIGHT..]   all of them by default
set -uo pipefail
roborun=$1 root=$2
shift 2
folder=$(mktemp -d)
. "$(dirname "$0")/flight_checks.sh"
name=$(basename "$folder")
plant= run= feeder= bridge=
trap 'kill -9 $plant $run $feeder $bridge 2>/dev/null; rm -rf "$folder" /dev/shm/roborun-$name-*' EXIT

link="port:$name" goal="--goal 60,0,4"
elsewhere=
start() {  # OPTION_OF_PLANT..: both, in a world of 60 m
  rm -f "$folder"/*.json
  $elsewhere "$roborun" plant --world "$root/tests/data/worlds/two_pillars.toml" --port "$name" --seconds 240 --json "$@" \
    >"$folder/plant.json" 2>"$folder/plant.err" &
  plant=$!
  "$roborun" run --vehicle paper --link "$link" $goal --bounds -10,-15,1.5,70,15,8 --profile paper \
    --best-effort --wait 60 --seconds 120 --json >"$folder/run.json" 2>"$folder/run.err" &
  run=$!
}
# Until the vehicle has flown for so many seconds: the runtime's commands are on the bus, and it moves.
flown() {  # SECONDS
  local i
  for i in $(seq 600); do
    [[ -e /dev/shm/roborun-$name-bus-out ]] && break
    sleep 0.1
  done
  sleep "${moment:-$1}"
}
moment=

reaches_the_goal() {
  start
  ends 0 $run && ends 0 $plant && is True run reached_goal && is landed run ended && is True plant reached_goal &&
    is False plant collided && is landed plant reason && is 0 run heap_calls_after_start
}
# The same with everything but cameras and lines on one DroneCAN bus, where an operator proves the kill switch and arms; on the way it
# leaves a package, 1.8 m above the ground by its range finder.
flies_over_the_bus() {
  local link="dronecan:port:$name" goal="--mission $root/tests/data/missions/delivery.waypoints"
  start --bus-sensors
  ends 0 $run && ends 0 $plant && is True run reached_goal && is landed run ended && is True plant reached_goal &&
    is False plant collided && is landed plant reason && is 0 run heap_calls_after_start && is 1 run mission.released &&
    falls plant package
}
falls() {  # FILE PATH: no deeper than 2 m, measured within 0.15 m, and hardly moving
  python3 -c 'import sys; h, v = map(float, sys.argv[1:]); sys.exit(not (0.5 < h < 2.15 and v < 0.6))' \
    "$(value "$1" "$2.height_m")" "$(value "$1" "$2.speed_mps")" || { echo "the package falls wrongly"; return 1; }
}
# Its IMU, receiver, barometer, ESCs and battery die together.
switches_off_without_a_bus() {
  local link="dronecan:port:$name"
  start --bus-sensors
  flown 12
  kill -KILL $plant
  ends 1 $run && is terminated run reason && is "motors off" run ended && is False run reached_goal
}
lands_on_a_signal() {
  start
  flown 9
  kill -TERM $run
  ends 130 $run && ends 0 $plant && is interrupted run reason && is landed run ended && is False plant collided &&
    is landed plant reason
}
# No IMU: nothing can be controlled. Motors off, and the report says so.
switches_off_without_a_plant() {
  start
  flown 9
  kill -KILL $plant
  ends 1 $run && is terminated run reason && is "motors off" run ended && is False run reached_goal
}
# The same for one that stands still: what it says afterwards changes nothing.
switches_off_when_the_plant_stops() {
  start
  flown 9
  kill -STOP $plant
  sleep 2
  kill -CONT $plant
  ends 1 $run && is terminated run reason && ends 1 $plant && is collision plant reason
}
# The motors' controllers stop by themselves when nobody commands, and what was in the air falls.
# All of its threads live with what a flight needs: no capability but five, no new privileges, a filter of system calls.
falls_without_a_runtime() {
  start
  flown 9
  local file kept no_more filter
  for file in /proc/$run/task/*/status; do
    read -r kept no_more filter < <(awk '/^(CapEff|NoNewPrivs|Seccomp):/ { printf "%s ", $2 }' "$file")
    (((0x$kept & ~0x80400b) == 0 && no_more == 1 && filter == 2)) || { echo "not confined: $file: $kept $no_more $filter"; return 1; }
  done
  kill -KILL $run
  ends 1 $plant && is collision plant reason && is True plant collided
}
plant_ends_on_a_signal() {
  start
  flown 4
  kill -INT $plant
  ends 130 $plant && is interrupted plant reason && ends 1 $run
}

feed() {
  local i
  for i in $(seq 100); do
    "$roborun" port list | grep -q "^$name-truth .* written to" && break
    sleep 0.1
  done
  "$roborun" feed plant --world "$root/tests/data/worlds/two_pillars.toml" --port "$name" >"$folder/feed.err" 2>&1 &
  feeder=$!
}
# The cameras' process is killed and starts again.
goes_on_with_a_new_feeder() {
  start --no-pictures
  feed
  flown 9
  kill -KILL $feeder
  sleep 0.2
  feed
  ends 0 $run && ends 0 $plant && is True run reached_goal && is False plant collided && ends 0 $feeder
}
# Without images it holds, and then comes down.
lands_without_a_feeder() {
  start --no-pictures
  feed
  flown 9
  kill -KILL $feeder
  ends 1 $run && ends 0 $plant && is holding run reason && is landed run ended && is False plant collided && is landed plant reason
}
# Plant and runtime as on two machines: a network of 2 to 3 ms between them that loses 2 % of all datagrams, and, where the kernel has namespaces of time,
# clocks that are 1,000 s apart.
bridge() {
  local port=$((20000 + $$ % 10000))
  unbridge
  rm -f /dev/shm/roborun-$name-*
  unshare --time --monotonic 1000 --fork true 2>/dev/null && elsewhere="unshare --time --monotonic 1000 --fork --kill-child"
  $elsewhere "$roborun" port share "$name" --link "udpin://127.0.0.1:$port" 2>"$folder/share.log" &
  bridge=$!
  python3 "$root/tests/platform/sensor_port/relay.py" $((port + 1)) $port 2 0.02 &
  relay=$!
  "$roborun" port fetch "$name-far" --link "udpout://127.0.0.1:$((port + 1))" 2>"$folder/fetch.log" &
  bridge="$bridge $relay $!"
}
unbridge() {
  kill -9 $bridge 2>/dev/null
  wait $bridge 2>/dev/null
  bridge=
}
reaches_the_goal_from_another_machine() {
  local link="port:$name-far" elsewhere
  bridge
  start
  ends 0 $run && ends 0 $plant && is True run reached_goal && is landed run ended && is True plant reached_goal &&
    is False plant collided && is landed plant reason && is 0 run heap_calls_after_start && unbridge
}
# The cable is pulled: each side is as if the other one had died.
switches_off_without_the_other_machine() {
  local link="port:$name-far" elsewhere
  bridge
  start
  flown 9
  kill -9 $relay
  ends 1 $run && is terminated run reason && is "motors off" run ended && is False run reached_goal && ends 1 $plant &&
    is collision plant reason && unbridge
}

# One process is killed, 20 times, each time in the air at another moment.
at_random_moments() {  # FLIGHT
  local moments moment
  mapfile -t moments < <(awk 'BEGIN { srand(8); for (i = 0; i < 20; ++i) printf "%.2f\n", 5 + 17 * rand() }')
  for moment in "${moments[@]}"; do
    tries "$1 at $moment s" "$1" || return 1
  done
}
runtimes_killed() { at_random_moments falls_without_a_runtime; }
plants_killed() { at_random_moments switches_off_without_a_plant; }
feeders_killed() { at_random_moments lands_without_a_feeder; }

[[ $# -gt 0 ]] || set -- reaches_the_goal flies_over_the_bus switches_off_without_a_bus lands_on_a_signal switches_off_without_a_plant \
  switches_off_when_the_plant_stops falls_without_a_runtime plant_ends_on_a_signal goes_on_with_a_new_feeder lands_without_a_feeder \
  reaches_the_goal_from_another_machine switches_off_without_the_other_machine runtimes_killed plants_killed feeders_killed
failed=0
for flight in "$@"; do
  tries $flight $flight || failed=$((failed + 1))
done
[[ $failed -eq 0 ]]
