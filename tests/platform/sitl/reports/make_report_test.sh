#!/usr/bin/env bash
# make_report never touches another report than the one that is named, keeps the old one until the new one is whole, and
# makes nothing of sweeps that other sources flew. A stand-in for roborun: what is tested is the script.
set -u
tree=$(mktemp -d) || exit 1
trap 'rm -rf "$tree"' EXIT
failed=0
passed=0
check() {
  local what=$1
  shift
  if "$@"; then passed=$((passed + 1)); else echo "FAILED $what"; failed=$((failed + 1)); fi
}
reports=$tree/platform/sitl/reports
mkdir -p "$reports/2026-01-01" "$tree/sweep" "$tree/stock" "$tree/build/release"
cp "$1/platform/sitl/reports/make_report" "$reports/"
echo "of the first of January" >"$reports/2026-01-01/README.md"
for folder in sweep stock; do
  echo '{"commit": "c0ffee", "suite": "paper27", "environments": ["1"], "profiles": [{"name": "paper"}], "designs": ["aware"],
    "seeds": [1], "map": "own", "planner": "own", "settings": ""}' >"$tree/$folder/request.json"
  echo "a table" >"$tree/$folder/tables.txt"
  echo "{}" >"$tree/$folder/results.jsonl"
  echo "<svg/>" | tee "$tree/$folder/overall.svg" >"$tree/$folder/sensitivity.svg"
done
cat >"$tree/build/release/roborun" <<'STAND_IN'
#!/usr/bin/env bash
if [[ $1 == --version ]]; then echo "roborun 0.1.0, commit c0ffee"; exit; fi
if [[ $1 == sweep ]]; then printf 'kernels of %s\nhost: awareness, own     1        1.71     1.65\n' "${*:3}"; exit; fi
if [[ -e ${0%/*}/breaks ]]; then exit 3; fi
while [[ $# -gt 0 ]]; do
  if [[ $1 == --plot || $1 == --out ]]; then echo "<svg/>" >"$2"; fi
  if [[ $1 == --json ]]; then
    echo '{"design": "aware", "reached_goal": true, "mission_time_s": 9, "mean_velocity_mps": 2, "energy_kJ": 3, "latency_s": {"median": 1}}'
  fi
  shift
done
STAND_IN
chmod 755 "$tree/build/release/roborun"
state() { find "$reports" -type f -exec md5sum {} + | sort; }
before=$(state)
# refuses WANTED ARGUMENT...: exit code 2, one line with WANTED, and every report as it was.
refuses() {
  local wanted=$1 out code
  shift
  out=$(cd "$tree" && "$reports/make_report" "$@" 2>&1 >/dev/null)
  code=$?
  check "make_report $(printf "'%s' " "$@")[$code]: $out" \
    test $code -eq 2 -a "$(wc -l <<<"$out")" -eq 1 -a "${out/"$wanted"/}" != "$out" -a "$(state)" = "$before"
}
for date in "" . .. / ../reports ../../sitl "2026-01-01/" "2026-01-01/.." "2026-01-01 x" " " "-rf" "*"; do
  refuses "must be a date, as in 2026-11-22" "$date" sweep
done
refuses "must be the folder of a finished roborun sweep" 2026-01-01 nope
refuses "must be the folder of a finished roborun sweep" 2026-01-01 ""
refuses "must be the folder of a finished roborun sweep" 2026-01-01 sweep ""
sed -i 's/c0ffee/0123/' "$tree/stock/request.json"
refuses "stock: was flown by commit 0123, build/release/roborun is of c0ffee: must be the same" 2026-01-01 sweep stock
sed -i 's/"commit": "0123", //' "$tree/stock/request.json"
refuses "stock: was flown by commit unknown" 2026-01-01 sweep stock
sed -i 's/{"suite"/{"commit": "c0ffee", "suite"/' "$tree/stock/request.json"

touch "$tree/build/release/breaks"
(cd "$tree" && "$reports/make_report" 2026-01-01 sweep stock) >/dev/null 2>&1
check "a report that cannot be made ends with an error" test $? -ne 0
check "and leaves the one before, and nothing else" test "$(state)" = "$before" -a "$(ls -A "$reports" | wc -l)" -eq 2
rm "$tree/build/release/breaks"
(cd "$tree" && "$reports/make_report" 2026-01-01 sweep stock >/dev/null) || failed=1
check "a whole one takes its place" grep -q "Flown by commit .c0ffee." "$reports/2026-01-01/README.md"
for part in "a table" "aware        8 of 8" "kernels of stock" "^1.71 times as fast as .static-fair." "!\[Sensitivity\](sensitivity.svg)" "--environments 1"; do
  check "it has: $part" grep -q -e "$part" "$reports/2026-01-01/README.md"
done

# Who arrives: of the suites of worlds, all of one kind.
cp -r "$tree/sweep" "$tree/hard"
sed -i 's/paper27/hard/; s/"environments": \["1"\]/"environments": ["maze\/paper", "maze\/micro-six"]/' "$tree/hard/request.json"
printf 'a row\nfailed: maze\n  roborun world make maze\n' >"$tree/hard/tables.txt"
before=$(state)
refuses "must be all of paper27, or all of the suites" 2026-01-01 sweep hard
refuses "must be all of paper27, or all of the suites" 2026-01-01 hard sweep
(cd "$tree" && "$reports/make_report" 2026-01-02-arriving hard hard >/dev/null) || failed=1
arriving=$reports/2026-01-02-arriving
for part in "flown in simulation by commit .c0ffee." "a row" "failed: maze" "--environments maze --vehicle paper,micro-six --out hard"; do
  check "it has: $part" grep -q -e "$part" "$arriving/README.md"
done
check "but not the commands" test "$(grep -c 'roborun world make' "$arriving/README.md")" -eq 0
for file in maze.svg results_1.jsonl.gz results_2.jsonl.gz request_2.json; do check "$file" test -s "$arriving/$file"; done
check "no world is left" test ! -e "$arriving/maze.toml"
rm -r "$arriving"
check "and nothing else is there" test "$(ls -A "$reports" | wc -l)" -eq 2
echo "$passed passed, $failed failed"
[[ $failed -eq 0 && $passed -ge 38 ]]
