#!/usr/bin/env bash
# roborun sweep: bad input gets one line and exit code 2 and leaves no folder; after Ctrl-C and after kill -9 the same
# command goes on, and ends with the bytes of a run that was never stopped; --json ends with one JSON object.
set -u
. "$(dirname "$0")/../../support/checks.sh"
roborun=$(realpath "$1") || exit 1
folder=$(mktemp -d "${TMPDIR:-/tmp}/roborun_sweep_cli.XXXXXX") || exit 1
trap 'rm -rf "$folder"' EXIT
refuses() {
  local wanted=$1 out err code
  shift
  out=$("$roborun" sweep "$@" --out "$folder/no" </dev/null 2>"$folder/err")
  code=$?
  err=$(cat "$folder/err")
  if [[ $code -ne 2 || -n "$out" || $(wc -l <<<"$err") -ne 1 || "$err" != *"$wanted"* || -e "$folder/no" ]]; then
    echo "FAILED [$code] roborun sweep $*: '$err' does not say '$wanted' in one line with exit code 2, or made a folder"
    failed=$((failed + 1))
  else
    passed=$((passed + 1))
  fi
}
refuses "must be paper27, hard or foreign" --suite x
refuses "1 .. 27" --environments 28
refuses "1 .. 27" --environments 1,,2
refuses "given twice" --environments 1,1
refuses "aware, static, static-fair" --designs foo
refuses "given twice" --designs aware,aware
refuses "paper, host, cortex-a72, or a file" --profile nope
refuses "given twice" --profile paper,paper
refuses "must have those of map octomap, planner own" --profile cortex-a72 --map octomap
refuses "whole number" --seeds 1,-2
refuses "whole number" --seeds ""
refuses "given twice" --seeds 3,3
refuses "own or octomap" --map foo
refuses "must be own or ompl:NAME" --planner foo
refuses "package_delivery or search_and_rescue" --mission x
refuses "cannot be opened" --settings nope.toml
refuses "1 to 1024" --jobs 0
refuses "1 to 1024" --jobs 1.5
refuses "1 <= I <= N" --shard 0/4
refuses "1 <= I <= N" --shard 5/4
refuses "1 <= I <= N" --shard 2
refuses "--nope" --nope
refuses "unknown world 'nope' of suite hard: must be maze, trap" --suite hard --environments nope
refuses "--worlds: must be the folder" --suite foreign
refuses "--worlds: must be the folder" --suite hard --worlds "$folder"
refuses "has no eth_forest0.bt, eth_start_and_end.csv" --suite foreign --worlds "$folder" --environments eth-0
refuses "must be one: several go with" --vehicle paper,micro
refuses "--mission: goes with --suite paper27" --suite hard --mission search_and_rescue
refuses "racer has no camera" --suite hard --vehicle racer-six
mkdir "$folder/damaged" && echo "<sdf" >"$folder/damaged/mighty_easy_forest.world"
made=$("$roborun" sweep --suite foreign --worlds "$folder/damaged" --environments mighty-easy --profile paper --out "$folder/bad" 2>&1)
check "a damaged file is named" test $? -eq 2 -a "${made/mighty_easy_forest.world/}" != "$made"
refuses "required" merge
refuses "cannot be opened" merge /nonexistent

printf '[flight]\ntime_limit_s = 15\n' >"$folder/short.toml"
sweep() { "$roborun" sweep --environments 1,14 --designs aware,static --settings "$folder/short.toml" --jobs 2 "$@" 2>/dev/null; }
sweep --out "$folder/whole" >"$folder/table"
check "the table" grep -q "^aware  *paper" "$folder/table"
other=$("$roborun" sweep --out "$folder/whole" 2>&1)
check "another request in the same folder is refused" test $? -eq 2 -a "${other/other environments/}" != "$other"
commit=$("$roborun" --version | sed -n 's/.*, commit //p')
check "--version names the commit" grep -qE '^([0-9a-f]{40}(\+changes)?|unknown)$' <<<"$commit"
for file in request.json tables.txt report.html; do check "$file names the commit" grep -qF "$commit" "$folder/whole/$file"; done
"$roborun" sweep --environments 1,14,27 --designs aware --out "$folder/three" >/dev/null 2>&1
check "three missions in which all knobs change arrive" grep -qE '^aware +paper +3 +3 +0 ' "$folder/three/tables.txt"
for missing in "10, 19" "4, 7" "2, 3"; do
  check "they compare no knob" grep -q "aware        not compared; beside 1: $missing missing" "$folder/three/tables.txt"
done
check "nor is one drawn beside the published" test "$(grep -c '\[1.[345]x\]' "$folder/three/sensitivity.svg")" -eq 0
cp -r "$folder/whole" "$folder/older"
sed -i 's/"commit": ".*"/"commit": "0123"/' "$folder/older/request.json"
other=$(sweep --out "$folder/older" 2>&1 >/dev/null)
check "a folder of another commit is not gone on with" test $? -eq 2
other=$("$roborun" sweep merge "$folder/older" --out "$folder/merged" 2>&1)
check "nor merged" test $? -eq 2 -a "${other/flown by commit 0123/}" != "$other" -a ! -e "$folder/merged"
check "compare names commits" grep -qF "$folder/whole: commit $commit" <("$roborun" sweep compare "$folder/whole")
made=$("$roborun" sweep --out /proc/nope 2>&1)
check "a folder that cannot be made is refused" test $? -eq 2 -a "${made/cannot be made/}" != "$made"
for signal in INT KILL; do
  # A job of its own, so that the shell does not make it ignore SIGINT.
  set -m
  sweep --out "$folder/$signal" >/dev/null &
  set +m
  for _ in $(seq 1000); do [[ -s "$folder/$signal/results.jsonl" ]] && break; sleep 0.02; done
  kill -$signal -- -$! 2>/dev/null
  wait $! 2>/dev/null
  sweep --out "$folder/$signal" >/dev/null
  check "goes on after $signal" diff -r "$folder/whole" "$folder/$signal"
done
check "one JSON object" test "$(sweep --out "$folder/whole" --json | tee "$folder/json" | wc -l)" -eq 1
check "its designs" grep -q '"designs":{"aware":{"missions":2,' "$folder/json"
cat >"$folder/board.toml" <<'BOARD'
[board]
machine = "a board"
per_unit_s = [1e-7, 0, 1e-7, 1e-7, 1e-7, 1e-7]
[map]
mean_fixed_s = [0.01, 0.01, 0.01, 0.01, 0.01, 0.01]
mean_s_per_m3 = [4.3e-6, 2.7e-6, 1.8e-6, 1.4e-6, 1.2e-6, 1.1e-6]
p99_fixed_s = [0.02, 0.02, 0.02, 0.02, 0.02, 0.02]
p99_s_per_m3 = [5.3e-6, 3.7e-6, 2.8e-6, 2.4e-6, 2.2e-6, 2.1e-6]
[export]
mean_fixed_s = [0.001, 0.001, 0.001, 0.001, 0.001, 0.001]
mean_s_per_m3 = [1e-7, 1e-7, 1e-7, 1e-7, 1e-7, 1e-7]
p99_fixed_s = [0.002, 0.002, 0.002, 0.002, 0.002, 0.002]
p99_s_per_m3 = [2e-7, 2e-7, 2e-7, 2e-7, 2e-7, 2e-7]
[planner]
mean_fixed_s = [0.01, 0.01, 0.01, 0.01, 0.01, 0.01]
mean_s_per_m3 = [1e-6, 1e-6, 1e-6, 1e-6, 1e-6, 1e-6]
p99_fixed_s = [0.02, 0.02, 0.02, 0.02, 0.02, 0.02]
p99_s_per_m3 = [2e-6, 2e-6, 2e-6, 2e-6, 2e-6, 2e-6]
BOARD
"$roborun" sweep --environments 1 --designs aware --settings "$folder/short.toml" --profile "paper,$folder/board.toml" \
  --out "$folder/boards" --json >"$folder/json" 2>/dev/null
check "a board file is a profile" grep -q '"profiles":{"paper":{"aware":.*},"board":{"aware":{"missions":1,' "$folder/json"
check "each profile has its picture" test -s "$folder/boards/sensitivity_board.svg"

# Suites of worlds. The command of each failed flight flies the same flight.
suite() { "$roborun" sweep --profile paper --settings "$folder/short.toml" --jobs 2 "$@" 2>/dev/null; }
suite --suite hard --environments gaps,closed-maze --vehicle paper --seeds 3,4 --out "$folder/hard" --json >"$folder/json"
for wanted in '"suite":"hard","complete":true' '"world":"gaps","vehicle":"paper"' '"seeds":[3,4],"flights":2,"possible":2,"reached":0' \
  '"world":"closed-maze"' '"flights":2,"possible":0' '"reason":"time_limit"'; do
  check "the suite's JSON has $wanted" grep -qF -- "$wanted" "$folder/json"
done
check "the suite's table has its seeds" grep -qE '^gaps +paper +paper +2 +2 +0 +0 +0 .* 3-4$' "$folder/hard/tables.txt"
command=$(grep -o 'roborun world make gaps --seed 3 .*--settings FILE' "$folder/hard/tables.txt" | head -1)
check "a failed flight has a command" test -n "$command"
hash_of() { grep -o '"state_hash":"[0-9a-f]*"'; }
again=$(cd "$folder" && bash -c "roborun() { '$roborun' \"\$@\"; }; ${command/FILE/short.toml} --json" 2>/dev/null | hash_of)
check "that flies the same flight" test -n "$again" -a "$again" = "$(sed -n 1p "$folder/hard/results.jsonl" | hash_of)"
mkdir "$folder/worlds"
cat >"$folder/worlds/mighty_easy_forest.world" <<'WORLD'
<sdf version="1.6"><world name="w"><model name="tree"><static>1</static><pose>40 0 3 0 0 0</pose><link name="l">
<collision name="c"><geometry><cylinder><radius>1</radius><length>6</length></cylinder></geometry></collision></link></model>
<model name="ground"><static>1</static><link name="l"><collision name="c"><geometry><plane><normal>0 0 1</normal>
<size>400 400</size></plane></geometry></collision></link></model></world></sdf>
WORLD
suite --suite foreign --worlds "$folder/worlds" --environments mighty-easy --out "$folder/foreign" >"$folder/table"
check "a foreign world is possible" grep -qE '^mighty-easy +mighty-six +paper +1 +1 +0 +0 ' "$folder/table"
command=$(grep -o "roborun fly --world $folder/worlds/mighty_easy.*--settings FILE" "$folder/table")
again=$(bash -c "roborun() { '$roborun' \"\$@\"; }; ${command/FILE/$folder/short.toml} --json" 2>/dev/null | hash_of)
check "its command flies the same flight" test -n "$again" -a "$again" = "$(hash_of <"$folder/foreign/results.jsonl")"
"$roborun" sweep --suite hard --environments closed-office --vehicle paper --profile paper --seeds 1 --jobs 2 --out "$folder/closed" \
  --json >"$folder/json" 2>/dev/null
check "a closed world is proven to be one" grep -qF '"flights":1,"possible":0,"reached":0,"collided":0,"no_way":1' "$folder/json"
for shard in 1 2; do
  suite --suite hard --environments gaps,closed-maze --vehicle paper --seeds 3,4 --shard $shard/2 --out "$folder/s$shard" >/dev/null
done
"$roborun" sweep merge "$folder/s1" "$folder/s2" --out "$folder/hard2" >/dev/null
check "shards of a suite merge to the same bytes" diff -r "$folder/hard" "$folder/hard2"
echo "$passed passed, $failed failed"
[[ $failed -eq 0 && $passed -ge 66 ]]
