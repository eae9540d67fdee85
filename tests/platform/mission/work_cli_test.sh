#!/usr/bin/env bash
# roborun fly takes a plugin's count of its work at its word only as far as the clock does (mission/work_check.hpp).
set -u
roborun=$1 plugins=$2
pillars=(--world "$3/worlds/two_pillars.toml")
flight=("${pillars[@]}")
work=$(mktemp -d) || exit 1
trap 'rm -rf "$work"' EXIT
export XDG_CACHE_HOME=$work
failed=0
passed=0
# flies CODE WANTED ARGUMENT...: the exit code, and what standard error says (WANTED empty: nothing).
flies() {
  local code=$1 wanted=$2 got
  shift 2
  "$roborun" fly "${flight[@]}" --json "$@" >"$work/out" 2>"$work/err"
  got=$?
  if [[ $got -eq $code ]] && { if [[ -n $wanted ]]; then grep -q -- "$wanted" "$work/err"; else [[ ! -s $work/err ]]; fi; }; then
    passed=$((passed + 1))
  else
    echo "FAILED [$got, wanted $code and '$wanted'] fly $*: $(cat "$work/err")"
    failed=$((failed + 1))
  fi
}
json_says() { grep -q "\"believed\":$1}" "$work/out" || { echo "FAILED --json does not say believed: $1: $(cat "$work/out")"; failed=$((failed + 1)); }; }
flies 0 ""
json_says true
flies 0 "this machine is not measured" --planner "plugin:$plugins/honest_plugin.so"
flies 1 "planner (plugin:.*): took .* must be at least 1/5 of it; the flight does not count" --planner "plugin:$plugins/lying_plugin.so"
json_says false
flies 2 "silent_plugin.so: planned a path, and said that it did no work for which the profile paper charges" \
  --planner "plugin:$plugins/silent_plugin.so"
[[ -s $work/out ]] && { echo "FAILED a flight that is refused prints a result"; failed=$((failed + 1)); }
# A machine on which nothing costs anything: at its prices nobody's work is worth the time. What ships flies on with a warning.
# The map takes half a second in environment 1; between two pillars a fast processor needs less than the 50 ms that can be told.
mkdir "$work/roborun"
six='[0, 0, 0, 0, 0, 0]'
printf '[board]\nmachine = "none"\nper_unit_s = %s\n' "$six" >"$work/roborun/host.toml"
for stage in map export planner; do
  printf '[%s]\nmean_fixed_s = %s\nmean_s_per_m3 = %s\np99_fixed_s = %s\np99_s_per_m3 = %s\n' $stage "$six" "$six" "$six" "$six"
done >>"$work/roborun/host.toml"
flight=(--env 1)
flies 0 "aware, map (own): took .* the work that it counted is worth 0.00 s"
flight=("${pillars[@]}")
flies 1 "planner (plugin:.*): took .* is worth 0.00 s" --planner "plugin:$plugins/lying_plugin.so"
echo "not TOML" >"$work/roborun/host.toml"
flies 0 ""
echo "$passed passed, $failed failed"
[[ $failed -eq 0 && $passed -ge 7 ]]
