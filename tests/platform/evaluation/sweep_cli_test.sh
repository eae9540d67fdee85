#!/usr/bin/env bash
# roborun sweep: bad input gets one line and exit code 2 and leaves no folder; after Ctrl-C and after kill -9 the same
# command goes on, and ends with the bytes of a run that was never stopped; --json ends with one JSON object.
set -u
roborun=$1
folder=$(mktemp -d "${TMPDIR:-/tmp}/roborun_sweep_cli.XXXXXX") || exit 1
trap 'rm -rf "$folder"' EXIT
failed=0
passed=0
check() {
  local name=$1
  shift
  if "$@"; then passed=$((passed + 1)); else echo "FAILED $name"; failed=$((failed + 1)); fi
}
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
refuses "must be paper27" --suite x
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
echo "$passed passed, $failed failed"
[[ $failed -eq 0 && $passed -ge 45 ]]
