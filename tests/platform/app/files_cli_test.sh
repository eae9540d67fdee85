#!/usr/bin/env bash
# What the program writes: whole or not at all, never over what it reads, and nothing is lost silently. Exit codes of all commands.
set -u
vehicles=$(cd "$(dirname "$0")/../../../platform/vehicle" && pwd)
. "$(dirname "$0")/../../support/cli.sh"
# refuses WANTED COMMAND...: exit code 2, one line on standard error that says it
refuses() {
  local wanted=$1 code
  shift
  "$@" </dev/null 2>"$work/err"
  code=$?
  if [[ $code -ne 2 || $(wc -l <"$work/err") -ne 1 || "$(cat "$work/err")" != *"$wanted"* ]]; then
    echo "FAILED [$code] $*: '$(head -c 300 "$work/err")' does not say '$wanted' in one line with exit code 2"
    failed=$((failed + 1))
  else
    passed=$((passed + 1))
  fi
}
exits() { # CODE COMMAND...
  local wanted=$1 code
  shift
  "$@" </dev/null >"$work/out" 2>"$work/err"
  code=$?
  check "exit code $wanted, not $code: $* ($(head -c 300 "$work/err"))" test $code -eq "$wanted"
}
emulated=false
[[ $(head -c 2 "$roborun" | tr -d '\0') == '#!' ]] && emulated=true

# A flight of two seconds, in a room.
cp "$data/worlds/room.toml" "$data/worlds/two_pillars.toml" .
printf '[flight]\ntime_limit_s = 2\n' >short.toml
short=(fly --world room.toml --settings short.toml)
python3 - <<'PY'
# OctoMap files: a floor-less block of 40 x 40 x 8 free cells of 0.5 m with a pillar in it, and a big one of scattered cells.
import random, struct
def write(name, occupied, free):
    def bits(cells, depth):
        # cells: {(x, y, z): state}; one node: 8 children of 2 bits
        half = 1 << (15 - depth)
        parts = [{} for _ in range(8)]
        for (x, y, z), s in cells.items():
            parts[(1 if x & half else 0) | (2 if y & half else 0) | (4 if z & half else 0)][(x, y, z)] = s
        word, below, count = 0, [], 1
        for i, p in enumerate(parts):
            if not p:
                continue
            if depth == 15:
                word |= (2 if next(iter(p.values())) else 1) << (2 * i)  # bit 0 of the pair free, bit 1 occupied
                count += 1
            else:
                word |= 3 << (2 * i)
                below.append(p)
        out = struct.pack("<H", word)
        for p in below:
            b, n = bits(p, depth + 1)
            out += b
            count += n
        return out, count
    cells = {c: False for c in free}
    cells.update({c: True for c in occupied})
    off = 1 << 15
    body, count = bits({(x + off, y + off, z + off): s for (x, y, z), s in cells.items()}, 0)
    with open(name, "wb") as f:
        f.write(f"# Octomap OcTree binary file\nid OcTree\nsize {count}\nres 0.5\ndata\n".encode() + body)
box = [(x, y, z) for x in range(40) for y in range(40) for z in range(8)]
pillar = [(x, y, z) for x in range(8, 12) for y in range(18, 22) for z in range(8)]
shelf = [(x, y, z) for x in range(28, 32) for y in range(18, 22) for z in range(0, 2)]
write("yard.bt", pillar + shelf, box)
random.seed(1)
write("big.bt", [(random.randrange(-400, 400), random.randrange(-400, 400), random.randrange(60)) for _ in range(250000)], [])
PY
exits 0 "$roborun" map info yard.bt

# ---- an output is never an input or another output, whatever it is called
ln -s room.toml link.toml
ln room.toml hard.toml
mkdir sub
sha256sum room.toml yard.bt short.toml >before.sha
for name in room.toml ./room.toml "$work/room.toml" sub/../room.toml link.toml hard.toml; do
  for option in --trace --plot --log; do
    refuses "which is read" "$roborun" "${short[@]}" $option "$name"
  done
done
refuses "which is read" "$roborun" "${short[@]}" --trace short.toml
cp "$vehicles/x500.toml" mine.toml
refuses "which is read" "$roborun" "${short[@]}" --vehicle mine.toml --trace mine.toml
refuses "which is read" "$roborun" audit --seconds 1 --best-effort --profile paper --vehicle mine.toml --html mine.toml
refuses "is the file of --log" "$roborun" "${short[@]}" --log a.out --trace ./a.out
refuses "is the file of --trace" "$roborun" "${short[@]}" --trace a.out --plot a.out
refuses "is the file of --html" "$roborun" audit --seconds 1 --best-effort --profile paper --html a.out --trace a.out
refuses "is the file of --out" "$roborun" calibrate --repeats 1 --out a.out --plot a.out
refuses "which is read" "$roborun" map convert yard.bt yard.bt
refuses "which is read" "$roborun" map view yard.bt -o ./yard.bt
mkdir scenarios && cat >scenarios/one.toml <<'TOML'
[scenario]
about = "a short flight in a room"
world = "../room.toml"
[flight]
time_limit_s = 2
[expect]
outcome = "time_limit"
TOML
refuses "which is read" "$roborun" scenario run scenarios --junit scenarios/one.toml
refuses "which is read" "$roborun" scenario run scenarios --junit room.toml
mkdir sweep && cp short.toml sweep/settings.toml
refuses "must be another folder" "$roborun" sweep --environments 1 --designs aware --settings sweep/settings.toml --out sweep
check "inputs are as before" sha256sum --quiet -c before.sha
check "nothing was written" test ! -e a.out

# ---- all outputs are checked before work begins
for command in "${short[*]} --trace" "${short[*]} --plot" "${short[*]} --log" "audit --html" "audit --trace" "calibrate --out" "calibrate --plot" \
               "scenario run scenarios --junit" "map view yard.bt -o"; do
  # shellcheck disable=SC2086
  refuses "/nope/x: cannot be written: No such file or directory" timeout 20 "$roborun" $command /nope/x
  # shellcheck disable=SC2086
  refuses "cannot be written: Is a directory" timeout 20 "$roborun" $command sub
done
refuses "/nope/x.bt: cannot be written: No such file" "$roborun" map convert yard.bt /nope/x.bt

# ---- devices, FIFOs and links are written through
"$roborun" "${short[@]}" --trace plain.csv >/dev/null
check "a flight that is too short does not reach its goal" test $? -eq 1
check "the trace has its header" grep -q "^design," plain.csv
mkfifo pipe
cat pipe >through.csv &
reader=$!
"$roborun" "${short[@]}" --trace pipe >/dev/null
wait "$reader"
check "a FIFO is written through" cmp plain.csv through.csv
check "a FIFO stays one" test -p pipe
"$roborun" "${short[@]}" --trace /dev/stdout >all.txt
check "/dev/stdout holds trace and table" test "$(grep -c -e '^design,' -e state_hash all.txt)" -eq 2
"$roborun" "${short[@]}" --trace /dev/stdout | grep -q "^design,"
check "/dev/stdout may be a pipe" test "${PIPESTATUS[1]}" -eq 0
"$roborun" "${short[@]}" --trace /dev/null >/dev/null
check "/dev/null stays a device" test -c /dev/null
echo before >sub/target && ln -s sub/target out_link && chmod 640 sub/target
"$roborun" "${short[@]}" --trace out_link >/dev/null
check "a link stays" test -L out_link
check "its target is written" cmp plain.csv sub/target
check "permissions stay" test "$(stat -c %a sub/target)" = 640
refuses "standard output goes there, too" bash -c "'$roborun' ${short[*]} --trace table.txt >>table.txt"

# ---- killed, or the disk is full: the file before stays
# A log is the exception: what was written of it until then is worth having.
echo before >flight.mcap
"$roborun" fly --log flight.mcap >/dev/null 2>&1 &
pid=$!
for _ in $(seq 200); do [[ $(stat -c %s flight.mcap) -gt 300000 ]] && break; sleep 0.05; done
kill -9 "$pid"
wait "$pid" 2>/dev/null
check "fly --log: after kill -9 the log replays to its end" \
  bash -c '"$0" replay flight.mcap >out 2>err && grep -q "the same flight so far" out && grep -q "cut off; whole until" err' "$roborun"
check "and it is said in one line" test "$(wc -l <err)" -eq 1
if ! $emulated; then
  for delay in 0.01 0.03 0.05 0.08 0.1 0.15 0.2 0.3; do
    echo before >map.ot
    (timeout -s KILL $delay "$roborun" map convert big.bt map.ot >/dev/null 2>&1) 2>/dev/null
    check "map convert: whole or as before after $delay s" \
      bash -c '[[ $(head -c 7 map.ot) == before ]] || "$0" map diff big.bt map.ot >/dev/null 2>&1' "$roborun"
  done
  rm -f map.ot.*.part
  # A limit on the size of files stands for the full disk: EFBIG instead of ENOSPC.
  echo before >map.ot
  limited() { (trap '' XFSZ; ulimit -f 100; exec "$roborun" "$@"); }
  refuses "map.ot: cannot be written: File too large" limited map convert big.bt map.ot
  refuses "flight.mcap: cannot be written: File too large; " bash -c "trap '' XFSZ; ulimit -f 40; '$roborun' ${short[*]} --log flight.mcap >/dev/null"
  check "fly --log: the flight goes on, and its log replays to where the disk was full" \
    bash -c '"$0" replay flight.mcap 2>err | grep -q "the same flight so far"' "$roborun"
  check "map convert: the file before stays on a full disk" test "$(cat map.ot)" = before
  check "and nothing else" test -z "$(compgen -G '*.part')"
fi
refuses "No space left on device" bash -c "'$roborun' ${short[*]} --trace /dev/full >/dev/null"
refuses "No space left on device" bash -c "'$roborun' ${short[*]} --log /dev/full >/dev/null"

# ---- standard output that cannot be written is said, by every command
problem='{"delta_d_s": 0.8, "profile": "paper", "v_sensor_m3": 30000, "v_map_m3": 90000, "v_planner_max_m3": 12000}'
echo "$problem" >problem.json
echo '(1.0) can0 10015501#00000000000000C0' >can.log
echo '{"type":"uavcan.protocol.NodeStatus","source_node_id":2}' >can.json
"$roborun" "${short[@]}" --log good.mcap >/dev/null
for command in "${short[*]}" "${short[*]} --json" "map info yard.bt" "map info yard.bt --json" "map diff yard.bt yard.bt" "map convert yard.bt o.bt" \
               "map view yard.bt" "replay good.mcap" "scenario run scenarios" "scenario run scenarios --json" "can encode --json can.json" \
               "explain plain.csv --at 2" "vehicle list" "vehicle check x500" "config" "config --json" "memory" "--help" "--version" "fly --help" \
               "can decode --json --candump can.log"; do
  for closed in '>/dev/full' '>&-'; do
    "$roborun" $command >/dev/null 2>"$work/err"
    lines=$(wc -l <"$work/err")
    bash -c "'$roborun' $command $closed" </dev/null 2>"$work/err"
    code=$?
    [[ $command == "can decode"* ]] && lines=1
    check "'$command $closed' is said [$code]: $(head -c 200 "$work/err")" test $code -ne 0
    check "'$command $closed' is said in one line: $(head -c 300 "$work/err")" \
      bash -c 'grep -q "standard output: cannot be written: \(No space left on device\|Bad file descriptor\)" "$0" && [[ $(wc -l <"$0") -eq $(($1 + 1)) ]]' "$work/err" "$lines"
  done
done
refuses "standard output: cannot be written" bash -c "'$roborun' solve <problem.json >/dev/full"
bash -c "'$roborun' config | head -1 >/dev/null; exit \${PIPESTATUS[0]}" 2>"$work/err"
check "a reader that has enough is no error: $(cat "$work/err")" test ! -s "$work/err"
"$roborun" fly --nope 2>/dev/full
check "standard error that cannot be written does not matter" test $? -eq 2
"$roborun" "${short[@]}" --trace closed.csv >&- 2>/dev/null
check "no file takes the place of a closed standard output" cmp plain.csv closed.csv

# ---- what cannot be read is not the end of the file
for command in "explain DIR --at 1" "replay DIR" "can decode --candump DIR" "can encode --json DIR" "fly --settings DIR" "fly --profile DIR" \
               "fly --vehicle DIR" "vehicle check DIR" "audit --compare DIR DIR"; do
  # shellcheck disable=SC2086
  refuses "sub: cannot be read: Is a directory" "$roborun" ${command//DIR/sub}
done
mkdir folder.toml folder.bt
refuses "cannot be read: Is a directory" "$roborun" fly --world folder.toml
refuses "cannot be read: Is a directory" "$roborun" map info folder.bt
refuses "standard input: cannot be read: Is a directory" bash -c "'$roborun' can decode <sub"
refuses "standard input: cannot be read: Is a directory" bash -c "'$roborun' solve <sub"
refuses "standard input: cannot be read: Bad file descriptor" bash -c "'$roborun' solve <&-"
refuses "larger than 64 MiB" timeout 60 "$roborun" explain /dev/zero --at 1
python3 -c 'print("[" * 200000)' >deep.json
refuses "line 1: longer than 65536 bytes" "$roborun" can encode --json deep.json
python3 -c 'print("[" * 60000)' >deep.json
refuses "nested more than 64 deep" "$roborun" can encode --json deep.json
python3 -c 'd = 5000; print("{\"type\":\"uavcan.protocol.NodeStatus\",\"source_node_id\":2,\"fields\":" + "[" * d + "]" * d + "}")' >deep.json
refuses "nested more than 64 deep" "$roborun" can encode --json deep.json
python3 -c 'd = 1000000; print("{\"identity\":" + "{\"a\":" * d + "1" + "}" * d + ",\"slots\":[],\"lanes\":[]}")' >deep.json
refuses "nested more than 64 deep" "$roborun" audit --compare deep.json deep.json
refuses "nested more than 64 deep" bash -c "'$roborun' solve <deep.json"

# ---- exit codes
exits 0 "$roborun" replay good.mcap
exits 0 "$roborun" map diff yard.bt yard.bt
exits 1 "$roborun" map diff yard.bt big.bt
exits 1 "$roborun" "${short[@]}"
exits 0 "$roborun" scenario run scenarios
sed -i 's/"time_limit"$/"landed"/' scenarios/one.toml
exits 1 "$roborun" scenario run scenarios
exits 0 bash -c "'$roborun' solve <problem.json"
for command in "can monitor nocan7" "can send-esc nocan7 --props-off --seconds 1" "gpio check --open nope_a --closed nope_b --seconds 1" \
               "audit --can nocan7,nocan7 --props-off --best-effort --profile paper --seconds 1" \
               "audit --kill-lines nope_a,nope_b --best-effort --profile paper --seconds 1"; do
  # shellcheck disable=SC2086
  exits 2 timeout 60 "$roborun" $command
done
[[ -e /dev/gpiochip0 ]] || exits 2 "$roborun" gpio list

# ---- Ctrl-C and SIGTERM: said in one line, exit code 130, no file half-done
stops() { # SIGNAL WANTED COMMAND...
  local signal=$1 wanted=$2 pid code
  shift 2
  "$roborun" "$@" >"$work/out" 2>"$work/err" &
  pid=$!
  if $emulated; then
    sleep 15
  else  # until it catches Ctrl-C
    for _ in $(seq 600); do
      (($((16#$(awk '/^SigCgt/ { print $2 }' "/proc/$pid/status"))) & 2)) && break
      sleep 0.1
    done
    sleep 0.5
  fi
  kill -s "$signal" "$pid"
  wait "$pid"
  code=$?
  check "$signal ends '$*' with 130 [$code]: $(head -c 300 "$work/err")" test $code -eq 130
  check "$signal of '$*' is said in one line: $(head -c 300 "$work/err")" \
    bash -c 'grep -q "interrupted: .*$1" "$0" && [[ $(grep -vc "^roborun: not real time" "$0") -eq 1 ]]' "$work/err" "$wanted"
}
for signal in INT TERM HUP; do
  # In a subshell: a job of a script ignores Ctrl-C unless it says otherwise.
  set -m
  stops $signal "of flight.*0 of 1 designs flown; the log ends there" fly --env 27 --design static --log flight.mcap
  for i in 1 2 3 4; do sed 's/time_limit_s = 2/time_limit_s = 7000/; s/world = .*/environment = "27"\ndesign = "static"/' scenarios/one.toml >"scenarios/$i.toml"; done
  echo before >junit.xml
  stops $signal "of 5 scenarios flown.*no file was written" scenario run scenarios --junit junit.xml --jobs 2
  stops $signal "what was flown is kept" sweep --environments 27 --designs static --jobs 1 --out stopped
  rm -f audit.html
  stops $signal "audit after .* of 600 s; the report is of that time" audit --seconds 600 --best-effort --profile paper --json --html audit.html
  check "an audit that $signal ends prints what it measured, as FAIL" \
    python3 -c 'import json, sys; r = json.load(open("out")); sys.exit(not (r["interrupted"] and "interrupted" in r["identity"] and r["verdict"] == "fail" and 0 < r["seconds"] < 600 and r["lanes"][0]["frames"] > 0))'
  check "and writes it" grep -q "Interrupted: all figures are of the time until then" audit.html
  set +m
  check "the files before stay" test "$(cat junit.xml)" = before
  rm scenarios/[1-4].toml
done
check "no part stays" test -z "$(compgen -G '*.part')"

# ---- a start, a goal or a climb that is not free
refuses "start (5.00, 10.00, 2.00) is closer than" "$roborun" fly --world yard.bt --start 5,10,2 --goal 18,10,2
refuses "goal (5.00, 10.00, 2.00) is closer than" "$roborun" fly --world yard.bt --start 2,2,2 --goal 5,10,2
refuses "no room to climb to it from the ground at 0.00 m" "$roborun" fly --world yard.bt --start 13.6,10,2.5 --goal 2,2,2

echo "$passed passed, $failed failed"
[[ $failed -eq 0 && $passed -gt 100 ]]
