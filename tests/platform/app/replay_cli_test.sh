#!/usr/bin/env bash
# roborun replay --from, --what-if, and roborun report FOLDER, by what they print and write.
set -u
. "$(dirname "$0")/../../support/cli.sh"
export XDG_CACHE_HOME=$work/cache
exits() { # CODE COMMAND...
  local wanted=$1 code
  shift
  "$@" >out 2>err </dev/null
  code=$?
  if [[ $code -ne $wanted ]]; then
    echo "FAILED [$code, not $wanted] $*: $(head -c 500 err)"
    failed=$((failed + 1))
  else
    passed=$((passed + 1))
  fi
}
refuses() { # WANTED COMMAND...: exit code 2, nothing on standard output, one line that says it
  local wanted=$1
  shift
  exits 2 "$@"
  check "'$*' says '$wanted' in one line: $(head -c 500 err)" \
    test "$(wc -l <err)" -eq 1 -a "$(wc -c <out)" -eq 0 -a "$(grep -cF -- "$wanted" err)" -eq 1
}
has() { check "'$1' in $2: $(head -c 800 "$2")" grep -qF -- "$1" "$2"; }

printf '[camera]\npixels = 32\n[flight]\ntime_limit_s = 100\n' >settings.toml
cp "$data/worlds/two_pillars.toml" world.toml
fly() { exits "$1" "$roborun" fly --world world.toml --settings settings.toml --log "$2" "${@:3}"; }
fly 0 flight.mcap

# ---- --from: the decisions from then on, which are the last ones of all
exits 0 "$roborun" replay flight.mcap --from 0 --json
cp out all.json
exits 0 "$roborun" replay flight.mcap --from 12 --json
cp out tail.json
exits 0 "$roborun" replay flight.mcap --from 3 --until 6 --json
cp out middle.json
size=$(stat -c %s flight.mcap)
head -c $((size * 3 / 4)) flight.mcap >cut.mcap
exits 0 "$roborun" replay cut.mcap --from 12 --json
cp out cut.json
check "decisions from a moment on are those of the whole replay" python3 - <<'PY'
import json
load = lambda name: json.load(open(name))
everything, tail, middle, cut = (load(name) for name in ("all.json", "tail.json", "middle.json", "cut.json"))
assert everything["same"] and tail["same"] and middle["same"] and cut["same"]
assert len(everything["decided"]) == everything["decisions"] >= 4
expected = [d for d in everything["decided"] if d["time_s"] >= 12]
assert 0 < len(expected) < len(everything["decided"])
assert tail["decided"] == expected
assert tail["digest"] == everything["digest"] == everything["recorded_digest"]
assert middle["decided"] == [d for d in everything["decided"] if 3 <= d["time_s"] <= 6] != []
assert cut["damage"] and 12 < cut["seconds"] < everything["seconds"]
assert cut["decided"] == expected[: len(cut["decided"])] and 0 < len(cut["decided"])
assert all(d["why"] for d in tail["decided"])
PY
exits 0 "$roborun" replay flight.mcap --from 12
has "Decision " out
check "each says where the vehicle was" test "$(grep -c "at (0.0, 0.0, 0.0) m" out)" -eq 0
has "the same flight" out
exits 0 "$roborun" replay flight.mcap
check "a replay without --from prints no decision" test "$(grep -c Decision out)" -eq 0
refuses "--from: 900 s: must be within the log, which ends at" "$roborun" replay flight.mcap --from 900
refuses "where it is cut or damaged" "$roborun" replay cut.mcap --from 50
refuses "must not be behind --until" "$roborun" replay flight.mcap --from 12 --until 5
refuses "--from" "$roborun" replay flight.mcap --from -1

# ---- --what-if
exits 0 "$roborun" replay flight.mcap --from 12 --what-if flight.v_max_mps=2 --log slow.mcap --json
check "it is slower from then on" python3 - <<'PY'
import json
j = json.load(open("out"))
assert j["same_until_then"] and j["logged"]["reached_goal"] and j["flown"]["reached_goal"], j
assert j["flown"]["mission_time_s"] > j["logged"]["mission_time_s"] + 1, j
PY
exits 0 "$roborun" replay slow.mcap
has "the same flight" out
exits 0 "$roborun" replay flight.mcap --from 12 --what-if flight.v_max_mps=2
has "the same flight until 12 s, bit for bit; from then on flight.v_max_mps=2" out
has "mean speed m/s" out
exits 1 "$roborun" replay flight.mcap --from 12 --what-if flight.time_limit_s=13
has "time_limit" out
refuses "--log: goes with --what-if" "$roborun" replay flight.mcap --log x.mcap
refuses "--what-if: goes with --from" "$roborun" replay flight.mcap --what-if flight.v_max_mps=2
refuses "does not change in flight: must be flight.v_max_mps, " "$roborun" replay flight.mcap --from 12 --what-if camera.pixels=8
refuses "must be within the log" "$roborun" replay flight.mcap --from 900 --what-if flight.v_max_mps=2
refuses "--log" "$roborun" replay flight.mcap --from 12 --what-if flight.v_max_mps=2 --log flight.mcap
refuses "does not say from what world" "$roborun" replay slow.mcap --from 12 --what-if flight.v_max_mps=1
sed -i 's/radius = 2/radius = 1.5/' world.toml
exits 1 "$roborun" replay flight.mcap --from 12 --what-if flight.v_max_mps=2
check "it names the first difference of another world" test "$(grep -c 'is not the same flight until 12 s.*first in minor frame' err)" -eq 1
rm world.toml
refuses "world.toml" "$roborun" replay flight.mcap --from 12 --what-if flight.v_max_mps=2
cp "$data/worlds/two_pillars.toml" world.toml

# ---- of a scenario
printf '[scenario]\nabout = "slow"\nworld = "world.toml"\n[camera]\npixels = 32\n[expect]\noutcome = "reached_goal"\n' >scene.toml
exits 0 "$roborun" scenario run scene.toml --log scene.mcap
exits 0 "$roborun" replay scene.mcap --from 4 --what-if governor.longest_s=0.5
has "the same flight until 4 s" out

# ---- report FOLDER
mkdir flights
cp slow.mcap "flights/slow one.mcap"
cp cut.mcap flights/cut.mcap
sed s/100/5/ settings.toml >short.toml
exits 1 "$roborun" fly --world world.toml --settings short.toml --log flights/late.mcap
printf 'no log' >flights/foreign.mcap
printf '{"a":1}\n' >flights/other.jsonl
exits 0 "$roborun" report flights
check "it names what it leaves out" test "$(grep -c 'left out: flights/' err)" -eq 2
has "index: flights/index.html" out
has 'href="slow%20one.html"' flights/index.html
has "foreign.mcap" flights/index.html
check "failed flights come first" test "$(grep -o 'href="[^"]*"' flights/index.html | head -1)" = 'href="late.html"'
check "there is a page beside each log" test -s "flights/slow one.html" -a -s flights/cut.html -a ! -e flights/foreign.html
check "nothing is left of unfinished files" test -z "$(find . -name '*.part')"
mkdir empty
refuses "holds no flights" "$roborun" report empty
printf 'no log' >empty/a.mcap
exits 2 "$roborun" report empty
check "a folder without a flight gets no table" test ! -e empty/index.html
refuses "--env: goes with one log" "$roborun" report flights --env 14

echo "$passed passed, $failed failed"
[[ $failed -eq 0 && $passed -gt 40 ]]
