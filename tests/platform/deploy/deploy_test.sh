#!/usr/bin/env bash
# What can be checked of platform/deploy without a board: the unit's command is one that this program takes, its limits hold
# what the lanes ask for, systemd knows every key, and what the files and the README say is the same.
set -u
roborun=$1
deploy=$2/deploy
unit=$deploy/roborun.service
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
failed=0
passed=0
check() {
  local what=$1
  shift
  if "$@"; then passed=$((passed + 1)); else echo "FAILED $what"; failed=$((failed + 1)); fi
}
of_unit() { sed -n "s/^$1=//p" "$unit"; }

# The command with an interface that no machine has: its arguments are good if that interface is all that is refused.
command_refuses_only_the_interface() {
  local arguments out
  arguments=$(of_unit ExecStart | sed "s|^/usr/local/bin/roborun ||; s|can0|nope0|g; s|/etc/roborun/board.toml|paper|")
  [[ $arguments == audit* && $arguments == *nope0* ]] || return 1
  # shellcheck disable=SC2086 # words, as systemd splits them
  out=$("$roborun" $arguments --best-effort 2>&1 >/dev/null)
  [[ $? -eq 2 && $(wc -l <<<"$out") -eq 1 && $out == *"--can: nope0"* ]] || { echo "$out"; return 1; }
}
check "ExecStart's arguments" command_refuses_only_the_interface
check "no propeller turns by a service" grep -q -- "--props-off" "$unit"
check "LimitRTPRIO holds the watchdog's priority" [ "$(of_unit LimitRTPRIO)" -ge 90 ]
check "two CPUs, one for flight, one for decisions" [ "$(of_unit CPUAffinity | wc -w)" -eq 2 ]
check "Type=notify, as the audit tells systemd" [ "$(of_unit Type)" = notify ]
knows_every_key() {
  command -v systemd-analyze >/dev/null || { echo "no systemd-analyze here: not checked"; return 0; }
  # Programs where this machine has them: only what systemd does not understand is left to complain about.
  sed "s|/usr/local/bin/roborun|$roborun|; s|/usr/local/lib/roborun/can-irq-priority|$deploy/can-irq-priority|" "$unit" >"$scratch/roborun.service"
  local out
  out=$(systemd-analyze verify --man=no "$scratch/roborun.service" 2>&1 | grep "roborun.service")
  [[ -z $out ]] || { echo "$out"; return 1; }
}
check "systemd-analyze verify" knows_every_key
check "a queue that SocketCan takes" [ "$(sed -n 's/^TransmitQueueLength=//p' "$deploy/80-can.link")" -ge 128 ]
refuses_a_bad_priority() {
  local out
  out=$("$deploy/can-irq-priority" 100 2>&1)
  [[ $? -eq 2 && $out == *"1 to 99"* ]]
}
check "can-irq-priority" refuses_a_bad_priority
check "can-irq-priority --help" "$deploy/can-irq-priority" --help
for file in "$deploy"/*; do check "README names $(basename "$file")" grep -q "$(basename "$file")" "$2/README.md"; done
echo "$passed checks passed"
[ $failed -eq 0 ] && [ $passed -ge 14 ]
