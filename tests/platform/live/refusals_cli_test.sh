#!/usr/bin/env bash
# What roborun plant and roborun run refuse: one clear line, exit code 2, nothing armed. usage: refusals_cli_test.sh ROBORUN ROOT
set -uo pipefail
roborun=$1 root=$2
name=refusal-$$
failed=0 passed=0
trap 'rm -f /dev/shm/roborun-$name-*' EXIT
says() {  # CODE TEXT COMMAND..
  local wanted=$1 text=$2 out code
  shift 2
  out=$(timeout 60 "$roborun" "$@" 2>&1)
  code=$?
  if [[ $code -ne $wanted || "$out" != *"$text"* ]]; then
    echo "FAILED [$code] roborun $*: '${out:0:400}' does not say '$text' with exit code $wanted"
    failed=$((failed + 1))
  else
    passed=$((passed + 1))
  fi
}
one_line() {  # COMMAND..
  local lines
  lines=$(timeout 60 "$roborun" "$@" 2>&1 | wc -l)
  if [[ $lines -ne 1 ]]; then
    echo "FAILED roborun $*: $lines lines"
    failed=$((failed + 1))
  fi
}
fly=(--vehicle paper --goal 9,0,4 --profile paper --best-effort --wait 0)
says 2 "nothing is there: start what writes its ports" run "${fly[@]}" --link "port:$name"
one_line run "${fly[@]}" --link "port:$name"
says 2 "--link: 'nix' is no way to a vehicle" run "${fly[@]}" --link nix
says 2 "--port: must name the ports" run "${fly[@]}" --link dronecan:can0
says 2 "NOT READY bus: nocan7: " run "${fly[@]}" --link dronecan:nocan7 --port "$name"
says 2 "NOT READY bus: /dev/shm/roborun-$name-bus-in: No such file" run "${fly[@]}" --link "dronecan:port:$name"
says 2 "--kill-lines, --arm-line: go with --link dronecan" run "${fly[@]}" --link "port:$name" --kill-lines a,b
says 2 "--kill-lines: not armed: " run "${fly[@]}" --link dronecan:nocan7 --port "$name" --kill-lines nix1,nix2
says 2 "--arm-line: " run "${fly[@]}" --link dronecan:nocan7 --port "$name" --arm-line nix3
says 2 "--can: nocan7: " plant --port "$name-can" --can nocan7
[[ -z $(compgen -G "/dev/shm/roborun-$name-can-*") ]] || { echo "FAILED a refused plant left ports"; failed=$((failed + 1)); }
says 2 "--bus-sensors, --can: go without --autopilot" plant --port "$name" --bus-sensors --autopilot px4
says 2 "is no name of ports" run "${fly[@]}" --link "port:a b"
says 2 "--goal: 'a' is not a point" run --link "port:$name" --goal a
says 2 "--goal" run --link "port:$name"
says 2 "--goal: 9,0,99: must be inside --bounds" run --link "port:$name" --goal 9,0,99 --bounds 0,0,0,10,10,10
says 2 "--bounds: '1,2,3' is not a box" run --link "port:$name" --goal 9,0,4 --bounds 1,2,3
says 2 "--cruise: 50 m: must be above the ground" run --link "port:$name" --goal 9,0,4 --cruise 50 --bounds 0,0,0,10,10,10
says 2 "--origin: '1,2' is no place" run --link "port:$name" --goal 9,0,4 --origin 1,2
says 2 "--origin: '91,2,0' is no place" plant --port "$name" --origin 91,2,0
says 2 "nix: cannot be opened: must be a vehicle file" run --link "port:$name" --goal 9,0,4 --vehicle nix
says 2 "--port" plant
says 2 "is no name of ports" plant --port "a b"
says 2 "--seed" plant --port "$name" --seed x
says 2 "go with --world FILE" plant --port "$name" --goal 1,2,3
says 2 "/nonexistent/x-camera1: No such file or directory" plant --port /nonexistent/x
says 0 "roborun plant --vehicle paper --env 14" plant --help
says 0 "roborun run --vehicle paper --link port:demo" run --help
says 2 "No such file or directory: start roborun plant --port $name --no-pictures first" feed plant --port "$name"
# With an autopilot between.
url=udpin://127.0.0.1:$((20000 + RANDOM % 12000))
says 2 "--port: must name the ports" run "${fly[@]}" --link "$url"
says 2 "--port: goes with a MAVLink or CAN --link" run "${fly[@]}" --link "port:$name" --port x
says 2 "--autopilot: must say who flies" run "${fly[@]}" --link "$url" --port "$name"
says 2 "--autopilot: goes with a MAVLink --link" run "${fly[@]}" --link "port:$name" --autopilot px4
says 2 "--autopilot: unknown autopilot 'nix'" run "${fly[@]}" --link "$url" --port "$name" --autopilot nix
says 2 "must go with --autopilot" run "${fly[@]}" --link "port:$name" --arm
says 2 "--link: udpin://nix: no port" run "${fly[@]}" --link udpin://nix --port "$name"
says 2 "NOT READY autopilot: no autopilot was heard" run "${fly[@]}" --link "$url" --port "$name" --autopilot px4
says 2 "--goal, --mission: must be one of both" run "${fly[@]}" --link "port:$name" --mission x
says 2 "nix: cannot be opened: must be a mission" run --link "port:$name" --mission nix
says 2 "item 4: (60.00," run --link "$url" --port "$name" --autopilot px4 --profile paper \
  --mission "$root/tests/data/missions/two_pillars.plan" --bounds=-10,-15,1.5,50,15,8
says 2 "--guard: commands nothing" run "${fly[@]}" --link "$url" --port "$name" --guard
says 2 "must go without --signing-key" run --vehicle paper --link "$url" --port "$name" --guard --signing-key nope
says 2 "--guard: goes with a MAVLink --link" run --vehicle paper --link "port:$name" --guard
says 2 "camera 1: /dev/shm/roborun-$name-camera1: No such file" run --vehicle paper --link "$url" --port "$name" --guard --wait 0
says 2 "--pilot-after: must go with --autopilot" plant --port "$name" --pilot-after 3
says 2 "--physics: unknown autopilot 'nix'" plant --port "$name" --physics nix
says 2 "--physics-port: must go with --physics" plant --port "$name" --physics-port 9002
says 2 "--physics: must go without --autopilot" plant --port "$name" --physics px4 --autopilot px4
says 2 "--signing-key: must go with --autopilot" plant --port "$name" --signing-key nope
says 2 "must be a file of 64 hexadecimal digits" goto 1,2,3 --link udpout://127.0.0.1:9 --signing-key /nope
says 2 "nobody answered within 0.2 s" goto 1,2,3 --link udpout://127.0.0.1:9 --wait 0.2
says 2 "must be X,Y,Z in metres" goto 1,2 --link udpout://127.0.0.1:9
says 2 "GOAL: '' is not a point" goto "" --link udpout://127.0.0.1:9
says 2 "on the earth" goto --earth 91,2,3 --link udpout://127.0.0.1:9
says 2 "nix: no link: must be udpout://" plant --port "$name" --autopilot px4 --mavlink nix
# A plant without a runtime, for its time.
says 0 '"collided":false,"least_clearance_m":null,"reached_goal":false' plant --world "$root/tests/data/worlds/two_pillars.toml" --port "$name" --seconds 1 --json
# Its ports are still there, and nobody writes them.
says 2 "nothing was armed, for want of camera 1" run "${fly[@]}" --link "port:$name"
says 2 "NOT READY imu: /dev/shm/roborun-$name-imu: nothing is written to it: start what writes it" run "${fly[@]}" --link "port:$name"
rm "/dev/shm/roborun-$name-gnss"
says 2 "NOT READY gnss: /dev/shm/roborun-$name-gnss: No such file or directory" run "${fly[@]}" --link "port:$name"
echo "$passed passed, $failed failed"
[[ $failed -eq 0 && $passed -ge 41 ]]
