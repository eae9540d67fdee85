#!/usr/bin/env bash
# toolchain/requirements: every promise has tests in this build, a failed one fails, and what is no result is refused.
set -u
build=$1
root=$(cd "$(dirname "$0")/../.." && pwd)
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
failed=0
# expect CODE WHAT [OPTION...]
expect() {
  local wanted=$1 what=$2
  shift 2
  "$root/toolchain/requirements" --build "$build" "$@" >"$scratch/out" 2>&1
  local code=$?
  if [[ $code -ne $wanted ]]; then
    echo "FAILED $what: exit code $code instead of $wanted"
    cat "$scratch/out"
    failed=1
  fi
}
# junit STATUS: a run of one test that ended so.
junit() { echo "<testsuite><testcase name=\"Reassembly.NamesWhatIsWrong\" status=\"$1\"/></testsuite>" >"$scratch/junit.xml"; }
expect 0 "every promise has tests"
junit run; expect 0 "a test passed" --junit "$scratch/junit.xml" --json "$scratch/table.json"
grep -q '^CAN-2 *passed *1 ' "$scratch/out" || { echo "FAILED: CAN-2 must have passed"; failed=1; }
python3 -c 'import json, sys; assert {r["id"]: r for r in json.load(open(sys.argv[1]))["requirements"]}["CAN-2"]["passed"] == 1' "$scratch/table.json" || failed=1
junit fail; expect 1 "a test failed" --junit "$scratch/junit.xml"
grep -q 'FAILED Reassembly.NamesWhatIsWrong' "$scratch/out" || { echo "FAILED: the failed test must be named"; failed=1; }
junit notrun; expect 0 "a test was skipped" --junit "$scratch/junit.xml"
echo "no xml" >"$scratch/junit.xml"; expect 2 "no JUnit file" --junit "$scratch/junit.xml"
echo "<testsuite/>" >"$scratch/junit.xml"; expect 2 "a run of nothing" --junit "$scratch/junit.xml"
expect 2 "no such file" --junit "$scratch/none.xml"
# The same program over a table of its own.
mkdir -p "$scratch/toolchain" "$scratch/tests"
cp "$root/toolchain/requirements" "$scratch/toolchain/"
with() {
  local wanted=$1 what=$2
  printf '[[requirement]]\nid = "A"\npromise = "x"\n%s\n' "$3" >"$scratch/tests/requirements.toml"
  "$scratch/toolchain/requirements" --build "$build" >"$scratch/out" 2>&1
  local code=$?
  [[ $code -eq $wanted ]] || { echo "FAILED $what: exit code $code instead of $wanted"; failed=1; }
}
with 0 "a pattern that fits" 'tests = ["Reassembly.*"]'
with 1 "a pattern that fits no test" 'tests = ["Reassembly.*", "Reasembly.*"]'
with 1 "no test at all" 'tests = []'
with 1 "a command that is not there" $'tests = ["Reassembly.*"]\ncommands = ["toolchain/nothing"]'
with 2 "no tests key" 'test = "Reassembly.*"'
exit $failed
