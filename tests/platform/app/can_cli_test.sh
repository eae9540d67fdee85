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
check "there are 126 vectors" test "$(wc -l <"$work/in.jsonl")" -eq 126
check "encode succeeds" "$roborun" can encode --json "$work/in.jsonl" >"$work/out.log"
check "encode gives the golden frames" cmp "$work/out.log" "$work/wanted.log"
check "decode succeeds" "$roborun" can decode --candump "$work/wanted.log" --json >"$work/out.jsonl" 2>"$work/err"
check "decode counts" grep -q "126 transfers, 0 malformed" "$work/err"
check "decode gives the fields" python3 - "$work" <<'PY'
import json, sys
keys = ("type", "source_node_id", "priority", "transfer_id", "fields")
rows = lambda name: [{k: o[k] for k in keys} for o in map(json.loads, open(sys.argv[1] + name))]
wanted, got = rows("/in.jsonl"), rows("/out.jsonl")
sys.exit(0 if len(wanted) == 126 and wanted == got else 1)
PY
# Without the third frame of the log's longest transfers nothing of them is delivered, and each is named.
awk '{ n[$1]++; if (n[$1] != 3) print }' "$work/wanted.log" >"$work/holes.log"
"$roborun" can decode --candump "$work/holes.log" --json >"$work/holes.jsonl" 2>"$work/err"
check "some transfers have holes" test "$(wc -l <"$work/holes.jsonl")" -lt 126
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
# A log that names ever new interfaces takes no more memory than one with the most there may be.
python3 -c 'print("\n".join(f"({i}.0) c{i} 10015501#00000000000000C0" for i in range(2000)))' >"$work/many.log"
python3 - "$roborun" "$work" <<'PY'
import resource, subprocess, sys
with open(sys.argv[2] + "/err", "w") as err:
    code = subprocess.run([sys.argv[1], "can", "decode", "--candump", sys.argv[2] + "/many.log"], stdout=subprocess.DEVNULL, stderr=err).returncode
sys.exit(0 if code == 2 and resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss < 500000 else 1)
PY
check "too many interfaces are refused within 500 MB" test $? -eq 0
check "the one too many is named: $(tail -1 "$work/err")" \
  grep -q "line 33: interface 'c32' is one too many: must be at most 32 in a log" "$work/err"
head -32 "$work/many.log" | "$roborun" can decode >"$work/out" 2>"$work/err"
check "as many as there may be are read" grep -q "^roborun can decode: 32 transfers" "$work/err"
printf '(1.0) \xff 10015501#00000000000000C0\n' | "$roborun" can decode --json >"$work/out" 2>"$work/err"
check "a name that is no text does not end the decoding: $(tail -1 "$work/err")" grep -q "^roborun can decode: 1 transfers" "$work/err"
"$roborun" can decode --candump "$work" 2>"$work/err" >"$work/out"
check "a folder is no log" test $? -eq 2
[[ $failed -eq 0 ]] && echo "roborun can: all checks passed"
exit $failed
