#!/usr/bin/env bash
# Flights with --live: what a viewer sees of them, that viewers cost them nothing, and what a kill leaves of their logs.
# usage: live_view_test.sh ROBORUN ROOT [KILLS|browser]    with KILLS: so many flights that are killed at random moments, and nothing else;
# browser: one flight with its page in Chromium. Exit code 77: no Chromium.
set -uo pipefail
roborun=$1 root=$2 kills=${3:-0}
folder=$(mktemp -d)
here=$(cd "$(dirname "$0")" && pwd)
. "$here/../live/flight_checks.sh"
name=$(basename "$folder")
plant= run= viewer= stopped=
trap 'kill -9 $plant $run $viewer $stopped 2>/dev/null; rm -rf "$folder" /dev/shm/roborun-$name-*' EXIT

start() {
  rm -f "$folder"/*.json "$folder"/flight.mcap "$folder"/seen* /dev/shm/roborun-$name-*
  "$roborun" plant --world "$root/tests/data/worlds/two_pillars.toml" --port "$name" --seconds 240 --json \
    >"$folder/plant.json" 2>"$folder/plant.err" &
  plant=$!
  "$roborun" run --vehicle paper --link "port:$name" --goal 60,0,4 --bounds -10,-15,1.5,70,15,8 --profile paper \
    --best-effort --wait 60 --seconds 120 --json --log "$folder/flight.mcap" --live 0 >"$folder/run.json" 2>"$folder/run.err" &
  run=$!
  local i
  for i in $(seq 600); do
    port=$(sed -n 's|.*http://127.0.0.1:\([0-9]*\)/.*|\1|p' "$folder/run.err")
    [[ -n $port ]] && break
    sleep 0.1
  done
  [[ -n $port ]] || { echo "no port"; return 1; }
  python3 "$here/viewer.py" "$port" /state /decision /map /events >"$folder/seen" 2>"$folder/viewer.err" &
  viewer=$!
}
shows_a_flight() {
  start || return 1
  python3 "$here/viewer.py" "$port" /state /decision /map >/dev/null 2>&1 &
  stopped=$!
  local i
  for i in $(seq 900); do [[ $(grep -c '^/decision' "$folder/seen") -ge 3 ]] && break; sleep 0.1; done
  kill -STOP $stopped  # a viewer that reads nothing from here on
  python3 - "$port" <<'PY' || return 1
import sys, urllib.request
page = urllib.request.urlopen(f"http://127.0.0.1:{sys.argv[1]}/", timeout=120).read().decode()
assert "connect-src 'self'" in page and 'id="story"' in page, page[:500]
PY
  ends 0 $run && is True run reached_goal && is 0 run heap_calls_after_start || return 1
  ends 0 $viewer || return 1
  kill -9 $stopped
  python3 - "$folder/seen" <<'PY'
import json, sys
seen = [line.split(" ", 2) for line in open(sys.argv[1])]
times = {topic: [float(t) for name, t, _ in seen if name == topic] for topic in ("/state", "/decision", "/map", "/events")}
print({topic: len(t) for topic, t in times.items()})
last = times["/state"][-1]
numbers = [json.loads(text)["number"] for name, _, text in seen if name == "/decision"]
assert last > 10 and len(times["/map"]) > 5, times
assert 2 < len(times["/state"]) / last < 11, "states: at most ten times a second"
assert numbers == list(range(numbers[0], numbers[-1] + 1)) and len(numbers) > 10, f"each decision once: {numbers}"
PY
}
# The page in a browser, beside a viewer that reads nothing.
shows_it_in_a_browser() {
  start || return 1
  python3 "$here/viewer.py" "$port" /state /decision /map >/dev/null 2>&1 &
  stopped=$!
  local i browser
  for i in $(seq 900); do [[ $(grep -c '^/decision' "$folder/seen") -ge 1 ]] && break; sleep 0.1; done
  kill -STOP $stopped
  python3 "$here/live_in_chromium.py" "$port" "${ROBORUN_SHOTS:-}"
  browser=$?
  ends 0 $run && is True run reached_goal && is 0 run heap_calls_after_start || return 1
  kill -9 $stopped
  [[ $browser -eq 77 ]] && skipped=77
  [[ $browser -eq 0 || $browser -eq 77 ]]
}
# How much of the flight is not in what a kill leaves: at most the last second, measured by what a viewer has seen.
kill_leaves_the_log() {
  start || return 1
  local i
  for i in $(seq 900); do [[ $(grep -c '^/state' "$folder/seen") -ge 12 ]] && break; sleep 0.1; done
  sleep "$((RANDOM % 10)).$((RANDOM % 1000))"
  kill -9 $run
  wait $run $viewer 2>/dev/null
  kill -9 $plant 2>/dev/null
  wait $plant 2>/dev/null
  "$roborun" report "$folder/flight.mcap" -o "$folder/page.html" >"$folder/report.out" 2>"$folder/report.err" || return 1
  python3 - "$folder/seen" "$folder/report.err" <<'PY'
import re, sys
seen = float([line for line in open(sys.argv[1]) if line.startswith("/state") and line.endswith("}\n")][-1].split(" ")[1])
whole = float(re.search(r"whole until ([0-9.]+) s", open(sys.argv[2]).read()).group(1))
print(f"killed after {seen:.1f} s, lost {seen - whole:.2f} s")
sys.exit(0 if seen - whole <= 1.0 else 1)
PY
}
failed=0 skipped=0
if [[ $kills == browser ]]; then
  tries "a browser shows the flight" shows_it_in_a_browser || failed=1
elif [[ $kills -gt 0 ]]; then
  for k in $(seq "$kills"); do kill_leaves_the_log || { echo "kill $k failed"; failed=$((failed + 1)); }; done
else
  tries "a viewer sees the flight" shows_a_flight || failed=1
  tries "a kill leaves the log until a second before" kill_leaves_the_log || failed=1
fi
echo "$failed failed"
exit $((failed > 0 ? 1 : skipped))
