#!/usr/bin/env bash
# The papers of a release: what toolchain/release refuses, in a repository of two files.
set -u
root=$(cd "$(dirname "$0")/../.." && pwd)
tree=$(mktemp -d) || exit 1
trap 'rm -rf "$tree"' EXIT
failed=0
git -C "$tree" init -q
# papers VERSION LINE..: CMakeLists.txt of that version, and a changelog.
papers() {
  echo "project(roborun VERSION $1 LANGUAGES CXX)" >"$tree/CMakeLists.txt"
  shift
  printf '%s\n' '# Changelog' "$@" >"$tree/CHANGELOG.md"
  git -C "$tree" add -A
  git -C "$tree" -c user.name=a -c user.email=a@b commit -qm papers --allow-empty
}
expect() {  # CODE PATTERN
  local said got
  said=$(ROBORUN_ROOT=$tree "$root/toolchain/release" 1.2.3 --papers 2>/dev/null)
  got=$?
  [[ $got -eq $1 ]] && grep -Eq "$2" <<<"$said" || { echo "FAILED: exit code $got, wanted $1 and '$2': $said"; failed=1; }
}
papers 1.2.3 '## [Unreleased]' '## [1.2.3] - 2026-01-02' '- new'; expect 0 'passed  no such tag'
papers 1.2.3 '## [1.2.3] - 2026-01-02' '- new'; expect 0 'passed  CHANGELOG'
touch "$tree/left"; expect 1 'FAILED  clean tree: .*left'; rm "$tree/left"
papers 1.2.2 '## [1.2.3] - 2026-01-02'; expect 1 'FAILED  CMakeLists.txt'
papers 1.2.3 '## [Unreleased]' '- new' '## [1.2.3] - 2026-01-02'; expect 1 'FAILED  CHANGELOG.md: .*1 entries under Unreleased'
papers 1.2.3 '## [Unreleased]'; expect 1 'FAILED  CHANGELOG'
papers 1.2.3 '## [1.2.2] - 2026-01-02'; expect 1 'must be ## \[1.2.3\]'
papers 1.2.3 '## [1.2.3] - 2999-01-02'; expect 1 'in the future'
papers 1.2.3 '## [1.2.3] - 2026-01-02'; git -C "$tree" tag v1.2.3; expect 1 'FAILED  no such tag'
for bad in 1.2 v1.2.3 ''; do
  "$root/toolchain/release" $bad >/dev/null 2>&1
  [[ $? -eq 2 ]] || { echo "FAILED: version '$bad' is taken"; failed=1; }
done
[[ $failed -eq 0 ]] && echo "the papers of a release are looked at"
exit $failed
