#!/usr/bin/env bash
# `roborun can`: golden vectors there and back, malformed input named and counted, bad input refused.
set -u
roborun=$1
data=$2
work=$(mktemp -d) || exit 1
trap 'rm -rf "$work"' EXIT
failed=0
check() { if ! "${@:2}"; then echo "FAILED: $1"; failed=1; fi; }

python3 - "$data/dronecan_vectors.json" "$work" <<'PY'
import json, sys
vectors = json.load(open(sys.argv[1]))["vectors"]
with open(sys.argv[2] + "/in.jsonl", "w") as objects, open(sys.argv[2] + "/wanted.log", "w") as log:
    for i, v in enumerate(vectors):
        objects.write(json.dumps({k: v[k] for k in ("type", "source_node_id", "priority", "transfer_id", "fields")}) + "\n")
        for frame in v["frames"]:
            log.write(f"({i / 1000:.6f}) can0 {frame['id'].upper()}#{frame['data'].upper()}\n")
PY
check "there are 108 vectors" test "$(wc -l <"$work/in.jsonl")" -eq 108
check "encode succeeds" "$roborun" can encode --json "$work/in.jsonl" >"$work/out.log"
check "encode gives the golden frames" cmp "$work/out.log" "$work/wanted.log"
check "decode succeeds" "$roborun" can decode --candump "$work/wanted.log" --json >"$work/out.jsonl" 2>"$work/err"
check "decode counts" grep -q "108 transfers, 0 malformed" "$work/err"
check "decode gives the fields" python3 - "$work" <<'PY'
import json, sys
keys = ("type", "source_node_id", "priority", "transfer_id", "fields")
rows = lambda name: [{k: o[k] for k in keys} for o in map(json.loads, open(sys.argv[1] + name))]
wanted, got = rows("/in.jsonl"), rows("/out.jsonl")
sys.exit(0 if len(wanted) == 108 and wanted == got else 1)
PY
# Without the third frame of the log's longest transfers nothing of them is delivered, and each is named.
awk '{ n[$1]++; if (n[$1] != 3) print }' "$work/wanted.log" >"$work/holes.log"
"$roborun" can decode --candump "$work/holes.log" --json >"$work/holes.jsonl" 2>"$work/err"
check "some transfers have holes" test "$(wc -l <"$work/holes.jsonl")" -lt 108
check "holes are named" grep -qE "line [0-9]+: [0-9A-F]{8}: (wrong toggle|missed start)" "$work/err"
check "no transfer comes from a hole" python3 - "$work" <<'PY'
import json, sys
good = set(open(sys.argv[1] + "/out.jsonl"))
sys.exit(0 if all(line in good for line in open(sys.argv[1] + "/holes.jsonl")) else 1)
PY
printf 'nonsense\n(1.0) can0 123#00\n(1.0) can0 01040674#042B78B70F1062\n' | "$roborun" can decode >"$work/out" 2>"$work/err"
check "nothing is delivered from nonsense" test ! -s "$work/out"
check "nonsense is counted" grep -q "0 transfers, 1 malformed.* 1 frames that are not DroneCAN, 1 lines not understood" "$work/err"
refuses() {
  local wanted=$1 input=$2
  echo "$input" | "$roborun" can encode --json >"$work/out" 2>"$work/err"
  local code=$?
  check "'$input' is refused with '$wanted'" test $code -eq 2 -a ! -s "$work/out" -a "$(wc -l <"$work/err")" -eq 1
  check "'$input' is answered '$wanted'" grep -qF -- "$wanted" "$work/err"
}
refuses "from -8192 to 8191" '{"type":"uavcan.equipment.esc.RawCommand","source_node_id":3,"fields":{"cmd":[9000]}}'
refuses "at most 20 items" "{\"type\":\"uavcan.equipment.esc.RawCommand\",\"source_node_id\":3,\"fields\":{\"cmd\":[$(printf '1,%.0s' {1..20})1]}}"
refuses "'x' (message) is unknown" '{"type":"x","source_node_id":3}'
refuses "source_node_id must be" '{"type":"uavcan.protocol.NodeStatus","source_node_id":200}'
refuses "'fields.nope' is unknown" '{"type":"uavcan.protocol.NodeStatus","source_node_id":2,"fields":{"nope":1}}'
refuses "line 1" '{broken'
[[ $failed -eq 0 ]] && echo "roborun can: all checks passed"
exit $failed
