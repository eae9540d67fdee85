#!/usr/bin/env bash
# MCAP's own reader (@mcap/core, from npm) reads every message, schema and the summary of a flight's log.
# official_test.sh ROBORUN DATA. Exit code 77 (skipped) where npm reaches no registry.
set -uo pipefail
roborun=$1
data=$2
root=$(cd "$(dirname "$0")/../../.." && pwd)
work=$(mktemp -d) || exit 1
trap 'rm -rf "$work"' EXIT
modules=${ROBORUN_MCAP_READER:-$root/build/mcap_reader}
"$root/toolchain/mcap_reader" "$modules"
code=$?
[[ $code -eq 77 ]] && { echo "SKIPPED: MCAP's own reader cannot be had here (the line above says why)"; exit 77; }
[[ $code -eq 0 ]] || exit 1
printf '[flight]\ntime_limit_s = 20\n[camera]\npixels = 32\n' >"$work/short.toml"
"$roborun" fly --world "$data/worlds/two_pillars.toml" --settings "$work/short.toml" --log "$work/flight.mcap" --json >"$work/result.json"
[[ $? -le 1 ]] || { echo "FAILED: the flight"; exit 1; }
node "$root/tests/platform/log/official/read.mjs" "$modules" "$work/flight.mcap" >"$work/read.json" || { echo "FAILED: MCAP's own reader"; exit 1; }
cat "$work/read.json"
python3 - "$work" <<'PY' || { echo "FAILED: it read something else"; exit 1; }
import json, sys
read = json.load(open(sys.argv[1] + "/read.json"))
flown = json.load(open(sys.argv[1] + "/result.json"))
topics = read["topics"]
assert topics["/decision"] == flown["decisions"] >= 4, topics
assert topics["/state"] >= 39 * flown["mission_time_s"] > 300, topics
assert topics["/configuration"] == topics["/result"] == 1, topics
for topic in ("/pose", "/tf", "/path", "/trajectory", "/map", "/events", "/inputs"):
    assert topics[topic] > 0, topic
for name in ("PoseInFrame", "PosesInFrame", "FrameTransforms", "Grid", "Log"):
    assert "foxglove." + name in read["schemas"], name
assert read["metadata"] == ["build", "configuration"], read["metadata"]
assert read["summary_offsets"] == 5 and read["chunks"] >= flown["mission_time_s"], read
PY
echo "passed"
