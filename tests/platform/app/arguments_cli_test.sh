#!/usr/bin/env bash
# What would be ignored is refused in one line; unknown commands and options are named, with what may have been meant.
set -u
roborun=$1
data=$2
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
failed=0
passed=0
refuses() {
  local wanted=$1 out err code
  shift
  out=$(timeout 60 "$roborun" "$@" </dev/null 2>"$work/err")
  code=$?
  err=$(cat "$work/err")
  if [[ $code -ne 2 || -n "$out" || $(wc -l <<<"$err") -ne 1 || "$err" != *"$wanted"* ]]; then
    echo "FAILED [$code] roborun $*: '$err' does not say '$wanted' in one line with exit code 2"
    failed=$((failed + 1))
  else
    passed=$((passed + 1))
  fi
}
room=$data/worlds/room.toml

# ---- unknown commands and options
refuses "roborun: 'flyy' is no command: did you mean 'fly'? (see roborun --help)" flyy
refuses "roborun: 'swep' is no command: did you mean 'sweep'? (see roborun --help)" swep --seeds 1
refuses "roborun: 'scenari' is no command: did you mean 'scenario'?" scenari run x
refuses "roborun: 'zzzzzz' is no command (see roborun --help)" zzzzzz
refuses "roborun: '' is no command" ""
refuses "roborun: 'decod' is no command: did you mean 'decode'? (see roborun can --help)" can decod
refuses "'chek' is no command: did you mean 'check'?" vehicle chek x500
refuses "'rum' is no command: did you mean 'run'?" scenario rum x
refuses "roborun: '--sede' is no option of roborun fly: did you mean '--seed'? (see roborun fly --help)" fly --sede 3
refuses "'--sede' is no option of roborun fly: did you mean '--seed'?" fly --sede=3
refuses "'--enviroments' is no option of roborun sweep: did you mean '--environments'?" sweep --enviroments 1
refuses "'--opne' is no option of roborun gpio check: did you mean '--open'?" gpio check --opne a --closed b
refuses "'--zzzzzz' is no option of roborun fly (see roborun fly --help)" fly --zzzzzz
refuses "'-q' is no option of roborun fly" fly -q
refuses "'extra' is one argument too many for roborun replay" replay a extra
refuses "'extra' is one argument too many for roborun fly" fly extra
refuses "(see roborun can --help)" can
refuses "(see roborun map convert --help)" map convert a.bt

# ---- combinations in which one would be ignored
refuses "--env excludes --world" fly --world "$room" --env 3
refuses "--env excludes --world" fly --env 14 --world "$room"
refuses "--mission excludes --world" fly --world "$room" --mission search_and_rescue
refuses "--start, --goal and the like go with --world" fly --start 1,1,1
refuses "--host-factor: goes with --profile host" fly --host-factor 2
refuses "--host-factor: goes with --profile host" fly --profile paper --host-factor 1
refuses "--host-file: goes with --profile host" fly --host-file x.toml
refuses "--color: goes with --plot FILE" fly --color all
refuses "--color: goes with --plot FILE" fly --color speed
for option in "--plot x.svg" "--map octomap" "--planner own" "--repeats 3"; do
  # shellcheck disable=SC2086
  refuses "${option%% *}: goes with a run without --stopping" calibrate --stopping $option
done
refuses "--seeds: is not of 'roborun sweep merge'" sweep --seeds 1,2 merge a b --out c
refuses "--out: is not of 'roborun sweep compare'" sweep --out x compare a b
refuses "--json: is not of 'roborun sweep merge'" sweep --json merge a --out c

# ---- numbers, everywhere read in one way
for number in nan inf 1e999 "" " 1" 1x 0x1 ,; do
  refuses "--host-factor: '$number' is out of range: must be a number from 0.001 to 1000" fly --profile host --host-factor "$number"
  refuses "--at: '$number' is out of range" explain x.csv --at "$number"
  refuses "--height: '$number' is out of range" map view x.bt --height "$number"
  refuses "--seconds: '$number' is out of range: must be a number from 0.1 to 60" can send-esc can0 --seconds "$number"
  refuses "--seconds: '$number' is out of range: must be a number from 0 to" can monitor can0 --seconds "$number"
  refuses "--seconds: '$number' is out of range: must be a number from 0.1 to 3600" gpio check --open a --closed b --seconds "$number"
done
for number in nan 1.5 "" 1x 0 -1 99999999999; do
  refuses "--repeats: '$number' is out of range: must be a whole number from 1 to 1000" calibrate --repeats "$number"
  refuses "--count: '$number' is out of range: must be a whole number from 1 to 20" can send-esc can0 --seconds 1 --count "$number"
  refuses "--jobs: '$number' is out of range: must be a whole number from 1 to 1024" sweep --jobs "$number" --out "$work/s"
  refuses "--jobs: '$number' is out of range: must be a whole number from 1 to 1024" scenario run x --jobs "$number"
done
for seed in -1 +1 1.0 1x 18446744073709551616; do
  refuses "--seed: '$seed' is not a seed" fly --seed "$seed"
  refuses "--seeds: '$seed' is not a seed" sweep --seeds "1,$seed"
done
for point in 1,2 1,2,3,4 1,2,x ,, 1,2,nan 1,2,; do
  refuses "is not a point: must be X,Y,Z in metres" fly --world "$room" --start "$point"
done
# Whole numbers in files.
toml() { # WANTED TEXT COMMAND...
  printf '%b' "$2" >"$work/f.toml"
  refuses "$1" "${@:3}"
}
head='[scenario]\nabout = "x"\nenvironment = "1"\n'
expect='[expect]\noutcome = "landed"\n'
toml ":2: pixels: must be a whole number from 8 to 1280" '[camera]\npixels = 96.5\n' fly --settings "$work/f.toml"
toml ":2: pixels: must be a whole number from 8 to 1280" '[camera]\npixels = 96.5\n' audit --settings "$work/f.toml"
toml ":2: pixels: must be a whole number from 8 to 1280" '[camera]\npixels = 96.5\n' sweep --out "$work/s" --settings "$work/f.toml"
toml ":5: pixels: must be a whole number" "${head}[camera]\npixels = 96.5\n$expect" scenario run "$work/f.toml"
toml ":4: seed: must be a whole number" "${head}seed = 1.5\n$expect" scenario run "$work/f.toml"
toml ":6: instance: must be a whole number" "${head}[[fault]]\ncomponent = \"depth\"\ninstance = 0.5\nkind = \"off\"\n$expect" scenario run "$work/f.toml"

echo "$passed passed, $failed failed"
[[ $failed -eq 0 && $passed -gt 90 ]]
