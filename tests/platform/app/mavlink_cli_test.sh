#!/usr/bin/env bash
# `roborun mavlink`: golden vectors there and back, damage counted, bad input refused.
set -u
roborun=$1
data=$2
work=$(mktemp -d) || exit 1
trap 'rm -rf "$work"' EXIT
failed=0
check() { if ! "${@:2}"; then echo "FAILED: $1"; failed=1; fi; }

# All frames of the vectors, in the three forms; the same as a .tlog; and what is in them, field by field.
python3 - "$data/mavlink_vectors.json" "$work" <<'PY'
import json, struct, sys
v = json.load(open(sys.argv[1]))
frames, wanted = [], []
for m in v["messages"]:
    names = [(f.split()[0], f.split()[1].split("@")[0].split("[")[0], f.endswith("+")) for f in m["fields"]]
    for x in m["vectors"]:
        for version, hexes in ((2, x["frame"]), (2, x.get("signed", {}).get("frame")), (1, x.get("v1"))):
            if hexes is None:
                continue
            frames.append(bytes.fromhex(hexes))
            fields = {n: [t, value] for (t, n, ext), value in zip(names, x["values"]) if version == 2 or not ext}
            wanted.append({"msgid": m["id"], "name": m["name"], "seq": x["seq"], "sysid": x["sysid"], "compid": x["compid"],
                           "version": version, "signed": hexes == x.get("signed", {}).get("frame"), "fields": fields})
open(sys.argv[2] + "/all.raw", "wb").write(b"".join(frames))
open(sys.argv[2] + "/all.tlog", "wb").write(b"".join(struct.pack(">Q", 1700000000000000 + i) + f for i, f in enumerate(frames)))
json.dump(wanted, open(sys.argv[2] + "/wanted.json", "w"))
open(sys.argv[2] + "/key", "w").write(v["key"] + "\n")
PY
check "decode succeeds" "$roborun" mavlink decode "$work/all.raw" --json >"$work/out.jsonl" 2>"$work/err"
check "decode counts: $(cat "$work/err")" grep -q "1147 messages, 0 of unknown ids, 0 with a wrong checksum.* 0 bytes outside of frames" "$work/err"
check "decode gives the values" python3 - "$work" <<'PY'
import json, math, struct, sys
wanted = json.load(open(sys.argv[1] + "/wanted.json"))
got = [json.loads(line) for line in open(sys.argv[1] + "/out.jsonl")]
def bits(x):
    if isinstance(x, str):
        if x.startswith("NaN("):
            return x[6:-1]
        return {"NaN": "7fc00000", "Infinity": "7f800000", "-Infinity": "ff800000"}[x]
    return struct.pack(">f", x).hex()
def same(kind, w, g):
    if isinstance(g, list):
        return len(w) == len(g) and all(same(kind, a, b) for a, b in zip(w, g))
    if kind == "char":
        return bytes.fromhex(w).rstrip(b"\0") == g.encode("latin-1")
    return w == bits(g) if kind == "float" else int(w) == g
def right(w, g):
    head = all(w[k] == g[k] for k in ("msgid", "name", "seq", "sysid", "compid", "version", "signed"))
    return head and list(w["fields"]) == list(g["fields"]) and all(same(t, x, g["fields"][n]) for n, (t, x) in w["fields"].items())
sys.exit(0 if len(wanted) == len(got) == 1147 and all(map(right, wanted, got)) else 1)
PY
check "encode succeeds" "$roborun" mavlink encode --json "$work/out.jsonl" --out "$work/again.raw"
check "encode gives the frames back" cmp "$work/again.raw" "$work/all.raw"
"$roborun" mavlink encode --json <"$work/out.jsonl" >"$work/piped.raw"
check "and through pipes" cmp "$work/piped.raw" "$work/all.raw"
"$roborun" mavlink encode "$work/out.jsonl" --json --key "$work/key" >"$work/keyed.raw"
check "the key makes the same signatures" cmp "$work/keyed.raw" "$work/all.raw"
check "a .tlog is read" "$roborun" mavlink decode "$work/all.tlog" --json >"$work/tlog.jsonl" 2>"$work/err"
check "a .tlog has times: $(cat "$work/err")" grep -q '"time_us":1700000000001146}' "$work/tlog.jsonl"
check "a .tlog holds the same" cmp <(sed 's/,"time_us":[0-9]*}$/}/' "$work/tlog.jsonl") "$work/out.jsonl"
"$roborun" mavlink decode --tlog --json <"$work/all.tlog" 2>"$work/err" | cmp - "$work/tlog.jsonl"
check "and through a pipe" test "${PIPESTATUS[0]}${PIPESTATUS[1]}" = 00
check "text for people" grep -q "HEARTBEAT" <("$roborun" mavlink decode "$work/all.raw" 2>/dev/null)
check "with the key only signed ones are printed" "$roborun" mavlink decode "$work/all.raw" --json --key "$work/key" >"$work/keyed.jsonl" 2>"$work/err"
check "as many as there are: $(cat "$work/err")" python3 - "$work" <<'PY'
import json, re, sys
got = [json.loads(line) for line in open(sys.argv[1] + "/keyed.jsonl")]
n = [int(x) for x in re.findall(r"(\d+) (?:messages|not signed|wrongly signed|signed but not new)", open(sys.argv[1] + "/err").read())]
sys.exit(0 if got and all(g["signed"] for g in got) and n[0] == len(got) and n[1] == 1147 - 183 and n[2] == 0 and n[0] + n[3] == 183 else 1)
PY
# One bit in the middle of the stream costs one message.
python3 - "$work" <<'PY'
import sys
b = bytearray(open(sys.argv[1] + "/all.raw", "rb").read())
b[23] ^= 4
open(sys.argv[1] + "/bad.raw", "wb").write(b + b"\xfd")
PY
"$roborun" mavlink decode "$work/bad.raw" --json >"$work/bad.jsonl" 2>"$work/err"
check "one bit costs one message: $(cat "$work/err")" grep -q "1146 messages.* 1 cut short" "$work/err"
check "which is counted" grep -qE "[1-9][0-9]* with a wrong checksum" "$work/err"
check "an empty stream is no error" test "$("$roborun" mavlink decode --json </dev/null 2>/dev/null; echo $?)" = 0

# The lines of --help work as they stand.
"$roborun" mavlink encode --help >"$work/help"
(cd "$work" && PATH="$work/bin:$PATH" && mkdir bin && printf '#!/bin/sh\nexec %s "$@"\n' "$roborun" >bin/roborun && chmod +x bin/roborun &&
  sed -n 's/ | xxd$/ >beat.raw/; s/^  echo /echo /p' help >lines.sh && test -s lines.sh && sh lines.sh)
check "the example of encode makes a heartbeat" grep -q '"name":"HEARTBEAT".*"type":18' <("$roborun" mavlink decode "$work/beat.raw" --json 2>/dev/null)

refuses() {
  local wanted=$1 code
  shift
  "$roborun" mavlink "$@" >"$work/out" 2>"$work/err"
  code=$?
  check "'$*' is refused in one line with nothing on standard output" test $code -eq 2 -a ! -s "$work/out" -a "$(wc -l <"$work/err")" -eq 1
  check "'$*' is answered '$wanted', not '$(cat "$work/err")'" grep -qF -- "$wanted" "$work/err"
}
refuses "nope.raw: cannot be opened: must be recorded MAVLink" decode nope.raw
refuses "cannot be read: Is a directory" decode "$work"
refuses "must be a file of 64 hexadecimal digits" encode --json /dev/null --out "$work/x" --key "$work/beat.raw"
refuses "cannot be written" encode --json /dev/null --out /nonexistent/x
refuses "must be one" encode --json a b
refuses "did you mean 'decode'" decod
for line in '{broken' '{"name":"NOPE"}' '{"name":"HEARTBEAT","sysid":256}' '{"name":"HEARTBEAT","fields":{"type":"x"}}'; do
  printf '{"name":"PING"}\n%s\n' "$line" >"$work/in.jsonl"
  refuses "line 2: " encode --json "$work/in.jsonl" --out "$work/never.raw"
  check "nothing is written for '$line'" test ! -e "$work/never.raw"
done
[[ $failed -eq 0 ]] && echo "roborun mavlink: all checks passed"
exit $failed
