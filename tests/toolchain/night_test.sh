#!/usr/bin/env bash
# toolchain/night over a program that answers at once: what it counts, keeps, goes on with and says. usage: night_test.sh
set -uo pipefail
root=$(cd "$(dirname "$0")/../.." && pwd)
folder=$(mktemp -d) || exit 1
trap 'rm -rf "$folder"' EXIT
# A flight of 2 km; $folder/answer is the rest of what it says, $folder/flown has its name.
cat >"$folder/program" <<'FAKE'
#!/usr/bin/env bash
here=$(dirname "$0")
[[ $1 == world ]] && { touch "${@: -1}"; exit; }
basename "$3" >>"$here/flown"
grep -q '^\[\[fault\]\]' "$3" && begun=3 || begun=-1
echo "{\"first_fault_s\": $begun, \"distance_m\": 2000, \"decisions\": 10, \"mission_time_s\": 360, \"touchdown_mps\": 0, \"state_hash\": \"0\", $(cat "$here/answer")}"
FAKE
chmod +x "$folder/program"
fine='"outcome": "reached_goal", "collided": false, "deadline_misses": 0'
night() { ROBORUN=$folder/program "$root/toolchain/night" "$@" 2>&1; }
failed=0
expect() {  # CODE PATTERN NAME COMMAND..
  local code=$1 pattern=$2 name=$3 said got
  shift 3
  said=$("$@")
  got=$?
  [[ $got -eq $code ]] && grep -Eq -- "$pattern" <<<"$said" || { echo "FAILED $name: exit code $got: $said"; failed=1; }
}
echo "$fine" >"$folder/answer"
expect 0 'without a fault .* 0\.0000 +' "a night of four" night "$folder/a" --flights 4 --jobs 2
[[ $(wc -l <"$folder/flown") -eq 4 && -z $(ls "$folder/a" | grep -v jsonl) ]] || { echo "FAILED four flights, and nothing kept of good ones"; failed=1; }
expect 0 'without' "the same again flies nothing" night "$folder/a" --flights 4
[[ $(wc -l <"$folder/flown") -eq 4 ]] || { echo "FAILED resumption"; failed=1; }
printf '{"number": 5, "cut' >>"$folder/a/shard-1.jsonl"
expect 0 'no flight is left out' "after a cut line" night "$folder/a" --flights 6
[[ $(sort "$folder/flown" | uniq -d | wc -l) -eq 0 && $(wc -l <"$folder/flown") -eq 6 ]] || { echo "FAILED each flight once"; failed=1; }
rm "$folder/flown"
for k in 1 2; do night "$folder/b" --flights 3 --shard $k/2 >/dev/null; done
[[ $(sort -u "$folder/flown" | wc -l) -eq 6 ]] || { echo "FAILED shards fly different flights"; failed=1; }
echo "${fine/false/true}" >"$folder/answer"
expect 1 'scenario run .*/c/1-000001.toml' "collisions are told and kept" night "$folder/c" --flights 4
[[ -e $folder/c/1-000001.toml ]] || { echo "FAILED the file of a collision stays"; failed=1; }
echo "${fine/misses\": 0/misses\": 2}" >"$folder/answer"
expect 0 'came late' "late decisions are told" night "$folder/d" --flights 2
echo 'nonsense' >"$folder/answer"
expect 1 'the program failed' "an answer that is none" night "$folder/e" --flights 2
expect 2 "must be K/N" "a wrong shard" night "$folder/f" --shard 3/2
expect 2 "no such folder" "a report of nothing" night "$folder/g" --report
# 95 % bound of a Poisson rate: 3.00 for none, 4.74 for one, 6.30 for two.
python3 - "$root/toolchain/night" <<'PY' || failed=1
import importlib.machinery, importlib.util, sys
sys.dont_write_bytecode = True
loader = importlib.machinery.SourceFileLoader("night", sys.argv[1])
night = importlib.util.module_from_spec(importlib.util.spec_from_loader("night", loader))
loader.exec_module(night)
assert [round(night.bound(k, 1.0), 2) for k in range(3)] == [3.0, 4.74, 6.3], [night.bound(k, 1.0) for k in range(3)]
assert night.drawn(1, 7) == night.drawn(1, 7) != night.drawn(2, 7)
made = [flight for flight in (night.drawn(1, number) for number in range(100)) if "made" in flight]
assert 30 < len(made) < 70
for flight in made:
    file = night.tomllib.loads(night.vehicle_file(flight))
    assert [file["body"]["radius_m"], file["limits"]["finest_cell_m"], file["limits"]["speed_mps"]] == list(flight["made"].values())
PY
[[ $failed -eq 0 ]] && echo "a night is counted, goes on and says what was bad"
exit $failed
