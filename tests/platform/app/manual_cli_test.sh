#!/usr/bin/env bash
# manual_cli_test.sh ROBORUN: man pages and completions hold every command and option; --help keeps to the terminal's width.
set -u
. "$(dirname "$0")/../../support/checks.sh"
roborun=$1
work=$(mktemp -d) || exit 1
trap 'rm -rf "$work"' EXIT
"$roborun" manual --out "$work/share" || exit 1
pages=$work/share/man/man1
bash=$work/share/bash-completion/completions/roborun
zsh=$work/share/zsh/vendor-completions/_roborun
fish=$work/share/fish/vendor_completions.d/roborun.fish
commands_of() { "$roborun" "$@" --help | sed -n '/^Subcommands:/,/^$/s/^  \([a-z][a-z]*\) .*/\1/p'; }
options_of() { "$roborun" "$@" --help | sed -n '/^Options:/,/^$/s/^  \(-[^ ,]*,\)\?\(--[a-z-]*\).*/\2/p'; }
mapfile -t commands < <(commands_of)
check "there are commands" [ ${#commands[@]} -ge 20 ]
for command in "${commands[@]}"; do
  page=$pages/roborun-$command.1
  check "roborun.1 names $command" grep -q "roborun\\\\-$command" "$pages/roborun.1"
  check "$page has its name" grep -q "^\.TH roborun-$command 1 " "$page"
  check "fish knows $command" grep -q -- "__fish_use_subcommand' -f -a $command -d" "$fish"
done
for words in fly audit "can decode" "scenario run" "port check"; do
  read -ra path <<<"$words"
  mapfile -t options < <(options_of "${path[@]}")
  check "$words has options" [ ${#options[@]} -ge 2 ]
  for option in "${options[@]}"; do
    check "$words $option is in the page" grep -qF -- "${option//-/\\-}" "$pages/roborun-${path[0]}.1"
    check "$words $option in zsh" grep -qE -- "^    '$words'\) next='[^']*$option[ ']" "$zsh"
    check "$words $option in fish" grep -qE -- "seen_subcommand_from ${words##* }' .*-l ${option#--} " "$fish"
  done
done
# completes WANTED WORD...: bash, with the cursor at the end of the last word.
completes() {
  local wanted=$1
  shift
  bash -c '. "$1"; shift; COMP_WORDS=(roborun "$@"); COMP_CWORD=$#; _roborun; printf " %s" "${COMPREPLY[@]}" ""' _ "$bash" "$@" | grep -qF -- " $wanted "
}
check "bash: a command" completes replay repl
check "bash: an option of a command" completes --vehicle fly --veh
check "bash: a command below" completes decode can de
check "bash: an option below" completes --json can decode --j
check "bash: behind an option with a value" completes --goal fly --env 14 --go
not() { ! "$@"; }
check "bash: not the options of another one" not completes --props-off fly --props
for shell in zsh fish; do
  command -v $shell >/dev/null && check "$shell reads it" $shell -n "${!shell}"
done
if command -v man >/dev/null; then
  for page in "$pages"/*; do check "man reads $page" [ -z "$(LC_ALL=C.UTF-8 MANWIDTH=80 man --warnings -l "$page" 2>&1 >/dev/null)" ]; done
fi
check "a folder that cannot be made: exit code 2" [ "$("$roborun" manual --out /dev/null/x 2>/dev/null; echo $?)" -eq 2 ]

# ---- --help at 60 columns: only the first line, commands and tables, which begin with a space, and single words are longer
for command in fly run sweep "scenario run"; do
  # shellcheck disable=SC2086
  COLUMNS=60 "$roborun" $command --help >"$work/narrow"
  check "$command --help at 60 columns" [ -z "$(awk 'NR > 1 && length > 60 && !/^ / && / /' "$work/narrow")" ]
  check "options, too" [ -z "$(sed -n '/^Options:/,/^$/p' "$work/narrow" | awk 'length > 60 && substr($0, 31) ~ / /')" ]
  # shellcheck disable=SC2086
  check "no word is lost" cmp -s <(tr -s ' \n' '\n\n' <"$work/narrow") <("$roborun" $command --help | tr -s ' \n' '\n\n')
done
check "version: commit, date, compiler" grep -qzE 'roborun [0-9]+\.[0-9]+\.[0-9]+, commit [^ ]+.committed [^ ]+, compiled by [^ ]+ [0-9]' <("$roborun" --version)
echo "$passed checks passed"
[ $failed -eq 0 ] && [ $passed -ge 150 ]
