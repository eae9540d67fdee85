#!/usr/bin/env bash
# roborun run --guard against a listening socket: OBSTACLE_DISTANCE at 10 Hz, a heartbeat, and no command; with --limit-speed a speed for what is near. usage: guard_test.sh ROBORUN ROOT
set -uo pipefail
roborun=$1 root=$2
folder=$(mktemp -d)
name=$(basename "$folder")
plant= run= ear=
trap 'kill -9 $plant $run $ear 2>/dev/null; rm -rf "$folder" /dev/shm/roborun-$name-*' EXIT
port=$((20000 + RANDOM % 12000))
link=udpin://127.0.0.1:$((port + 1))
# In hover 10 m ahead of the start; a pillar of 2 m radius has its middle 10 m further on and 1 m to the left: 8.05 m away, 6 degrees.
"$roborun" plant --world "$root/tests/data/worlds/two_pillars.toml" --port "$name" --autopilot px4 --seconds 90 \
  --mavlink "udpout://127.0.0.1:$((port + 1))" --json >"$folder/plant.json" 2>"$folder/plant.err" &
plant=$!
"$roborun" run --vehicle paper --link "$link" --port "$name" --autopilot px4 --arm --profile paper --best-effort --wait 30 \
  --mission "$root/tests/data/missions/hover.waypoints" --bounds=-10,-15,1.5,70,15,8 >/dev/null 2>"$folder/run.err" &
run=$!
for _ in $(seq 300); do
  grep -q ", at (9\.[89], \|, at (10\.[012], " "$folder/plant.err" 2>/dev/null && break
  sleep 0.1
done
sleep 4
listen() {  # FILE [ANSWER]: what is heard; each time that is answered with the bytes of ANSWER
  python3 -c 'import socket, sys
s = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
s.bind(("127.0.0.1", int(sys.argv[1])))
s.settimeout(8)
out = open(sys.argv[2], "wb")
answer = open(sys.argv[3], "rb").read() if len(sys.argv) > 3 else b""
try:
  while True:
    said, sender = s.recvfrom(2048)
    out.write(said)
    if answer: s.sendto(answer, sender)
except TimeoutError: pass' "$port" "$folder/$1" ${2:+"$folder/$2"} &
  ear=$!
  for _ in $(seq 300); do [[ -e "$folder/$1" ]] && break; sleep 0.1; done  # it listens from then on
}
listen heard.bin
"$roborun" run --guard --vehicle paper --link "udpout://127.0.0.1:$port" --port "$name" --wait 30 --seconds 5 --json >"$folder/guard.json"
code=$?
wait $ear
"$roborun" mavlink decode "$folder/heard.bin" --json >"$folder/heard.json"
# It hovers, so that any direction may be the next one: 8.05 m less its radius, half a second, and the stop.
echo '{"name":"HEARTBEAT","compid":1,"fields":{"type":2,"autopilot":12,"system_status":4,"mavlink_version":3}}' |
  "$roborun" mavlink encode --json >"$folder/autopilot.bin"
listen limited.bin autopilot.bin
"$roborun" run --guard --limit-speed --vehicle paper --link "udpout://127.0.0.1:$port" --port "$name" --wait 30 --seconds 5 --json >"$folder/limit.json"
wait $ear
"$roborun" mavlink decode "$folder/limited.bin" --json >"$folder/limited.json"
python3 - "$folder" "$code" <<'PY'
import collections, json, sys
folder, code = sys.argv[1], int(sys.argv[2])
said = [json.loads(l) for l in open(folder + "/heard.json") if '"name"' in l]
guard = json.loads(open(folder + "/guard.json").read())
names = collections.Counter(m["name"] for m in said)
maps = [m["fields"] for m in said if m["name"] == "OBSTACLE_DISTANCE"]
gaps = [(b["time_usec"] - a["time_usec"]) * 1e-6 for a, b in zip(maps, maps[1:])]
last = maps[-1]["distances"]
limited = [json.loads(l) for l in open(folder + "/limited.json") if '"name"' in l]
limits = [m["fields"] for m in limited if m["name"] == "COMMAND_LONG"]
checks = {
  "exit code": code == 0,
  "nothing but map and heartbeat": set(names) == {"OBSTACLE_DISTANCE", "HEARTBEAT"},
  "all arrived": len(maps) == guard["messages"],
  "10 Hz": 45 <= len(maps) <= 51 and sorted(gaps)[len(gaps) // 2] < 0.11,
  "heartbeats": 4 <= names["HEARTBEAT"] <= 6,
  "sender": all(m["sysid"] == 1 and m["compid"] == 196 for m in said),
  "frame": maps[-1]["frame"] == 12 and maps[-1]["increment"] == 5,
  "pillar": abs(min(last) - 805) < 60 and last.index(min(last)) in (69, 70, 71, 0, 1),
  "limits": 4 <= len(limits) <= 8 and all(l["command"] == 178 and l["param1"] == 1 and l["param3"] == -1 for l in limits),
  "who has to": all(l["target_system"] == 1 and l["target_component"] == 1 for l in limits),
  "limit": all(4.5 < l["param2"] < 6.0 for l in limits),
  "nearest": abs(guard["nearest_m"] - 8.05) < 0.6,
}
print(names, last, guard)
wrong = [k for k, v in checks.items() if not v]
print("wrong:", wrong)
sys.exit(bool(wrong))
PY
