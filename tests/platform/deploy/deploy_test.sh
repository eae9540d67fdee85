#!/usr/bin/env bash
# What can be checked of platform/deploy without a board: the unit's command is one that this program takes, its limits hold
# what the lanes ask for, systemd knows every key, and what the files and the README say is the same.
set -u
. "$(dirname "$0")/../../support/checks.sh"
roborun=$1
deploy=$2/deploy
unit=$deploy/roborun-bench.service
scratch=$(mktemp -d) || exit 1
trap 'rm -rf "$scratch"' EXIT
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
  sed "s|/usr/local/bin/roborun|$roborun|; s|/usr/local/lib/roborun/can-irq-priority|$deploy/can-irq-priority|" "$unit" >"$scratch/roborun-bench.service"
  local out
  out=$(systemd-analyze verify --man=no "$scratch/roborun-bench.service" 2>&1 | grep "roborun-bench.service")
  [[ -z $out ]] || { echo "$out"; return 1; }
}
check "systemd-analyze verify" knows_every_key
is_shut() {
  local exposure
  exposure=$(systemd-analyze security --offline=true --no-pager "$unit" 2>/dev/null | sed -n 's/.*exposure level for .*: \([0-9.]*\) .*/\1/p')
  [[ -n $exposure ]] || { echo "no systemd-analyze that judges a file here: not checked"; return 0; }
  echo "exposure $exposure"
  awk -v is="$exposure" 'BEGIN { exit !(is <= 1.5) }'
}
check "systemd-analyze security: exposed at most 1.5" is_shut
# What systemd leaves of its calls in the end; without these two it is killed at its start (platform/rt/confinement.cpp).
may_confine_itself() {
  [[ $(grep '^SystemCallFilter=' "$unit" | tail -n 1) == "SystemCallFilter=capset seccomp" ]]
}
check "the unit leaves the calls that confine it further" may_confine_itself
# A run that turns motors: by hand, after the operator has said since the last boot that the propellers are off.
check "no target can want it" test "$(grep -cE '^\[Install\]|^(WantedBy|RequiredBy|UpheldBy|Alias|Also)=' "$unit")" -eq 0
check "it asserts what an operator says" grep -q '^AssertPathExists=/run/roborun-propellers-are-off$' "$unit"
check "the README says how" grep -q 'touch /run/roborun-propellers-are-off' "$2/README.md"
cannot_be_enabled() {
  command -v systemctl >/dev/null || { echo "no systemctl here: not checked"; return 0; }
  mkdir -p "$scratch/root/etc/systemd/system"
  cp "$unit" "$scratch/root/etc/systemd/system/"
  systemctl --root="$scratch/root" enable roborun-bench >/dev/null 2>&1
  [[ $(systemctl --root="$scratch/root" is-enabled roborun-bench) == static && -z $(find "$scratch/root" -type l) ]]
}
check "systemctl enable does nothing" cannot_be_enabled
makes_the_folder() {
  command -v systemd-tmpfiles >/dev/null || { echo "no systemd-tmpfiles here: not checked"; return 0; }
  mkdir -p "$scratch/root/etc/tmpfiles.d"
  cp "$deploy/roborun.conf" "$scratch/root/etc/tmpfiles.d/"
  printf 'root:x:0:0::/:/bin/sh\n' >"$scratch/root/etc/passwd"
  printf 'root:x:0:\n' >"$scratch/root/etc/group"
  systemd-tmpfiles --root="$scratch/root" --create roborun.conf
  [[ -d $scratch/root/etc/roborun ]]
}
check "/etc/roborun is made" makes_the_folder
check "so that calibrate can write what the unit reads" grep -q -- "--out /etc/roborun/board.toml" "$2/README.md"
check "the unit makes it too" test "$(of_unit ConfigurationDirectory)" = roborun
check "a queue that SocketCan takes" [ "$(sed -n 's/^TransmitQueueLength=//p' "$deploy/80-can.link")" -ge 128 ]
refuses_a_bad_priority() {
  local out
  out=$("$deploy/can-irq-priority" 100 2>&1)
  [[ $? -eq 2 && $out == *"1 to 99"* ]]
}
check "can-irq-priority" refuses_a_bad_priority
# A stand-in for chrt: nothing of this machine is changed, and what it is asked is kept.
mkdir "$scratch/bin"
printf '#!/bin/sh\necho "$@" >>"%s"\nexit ${CHRT_CODE:-0}\n' "$scratch/chrt" >"$scratch/bin/chrt"
chmod 755 "$scratch/bin/chrt"
irq_priority() { PATH=$scratch/bin:$PATH "$deploy/can-irq-priority" 70 >"$scratch/out" 2>&1; }
finds_nothing() {
  if grep -qsE '^irq/.*-(can[0-9]|mcp25)' /proc/[0-9]*/comm; then echo "this machine has a CAN controller: not checked"; return 0; fi
  irq_priority
  [[ $? -eq 1 && ! -e $scratch/chrt && $(wc -l <"$scratch/out") -eq 1 ]] && grep -q "no interrupt thread of a CAN controller" "$scratch/out"
}
check "can-irq-priority that finds nothing fails and says so" finds_nothing
sets_what_it_finds() {
  mkfifo "$scratch/never"
  bash -c 'echo "irq/99-can7" >/proc/$$/comm; read -r -t 30' <>"$scratch/never" &
  local thread=$! code
  for _ in $(seq 100); do grep -qs can7 "/proc/$thread/comm" && break; sleep 0.02; done
  irq_priority
  code=$?
  CHRT_CODE=1 irq_priority
  local refused=$?
  kill "$thread"
  wait "$thread" 2>/dev/null
  [[ $code -eq 0 && $refused -eq 1 ]] && grep -q -- "-f -p 70 $thread\$" "$scratch/chrt" && grep -q "could not be set" "$scratch/out"
}
check "can-irq-priority sets the interrupt threads it finds, or fails" sets_what_it_finds
check "can-irq-priority --help" "$deploy/can-irq-priority" --help
for file in "$deploy"/[!P]*; do check "README names $(basename "$file")" grep -q "$(basename "$file")" "$2/README.md"; done
echo "$passed checks passed"
[ $failed -eq 0 ] && [ $passed -ge 24 ]
