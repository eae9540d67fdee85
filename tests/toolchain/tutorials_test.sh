#!/usr/bin/env bash
# tutorials_test.sh ROBORUN: runs what the guides say, in a folder that looks like a clone.
# Blocks "```sh tutorial" of every page are one script each, in the order of the page, and must end with 0. Blocks
# "```cpp FILE" must stand in FILE (beside the page) word for word.
set -uo pipefail
program=$(realpath "$1")
root=$(cd "$(dirname "$0")/../.." && pwd)
work=$(mktemp -d) || exit 1
trap 'rm -rf "$work"' EXIT
python3 - "$root" "$work" <<'PY' || exit 1
import pathlib, re, sys, textwrap

root, work = map(pathlib.Path, sys.argv[1:])
bad, scripts, quotes = [], 0, 0
# A block may be indented below an item of a list.
block = re.compile(r"^( *)```(sh tutorial|cpp [\w.]+)\n(.*?)^\1```$", re.M | re.S)
pages = sorted(p for p in root.rglob("*.md") if not {"build", "out"} & set(p.relative_to(root).parts[:1]))
for page in pages:
    for number, (_, kind, text) in enumerate(block.findall(page.read_text()), 1):
        if kind == "sh tutorial":
            text = textwrap.dedent(text)
            scripts += 1
            name = str(page.relative_to(root)).replace("/", "__")
            (work / f"{name}.{number:02}.sh").write_text(text)
        else:
            quotes += 1
            if text not in (page.parent / kind.split()[1]).read_text():
                bad.append(f"{page}: the block 'cpp {kind.split()[1]}' is not what that file says")
if scripts < 8 or quotes < 2:
    bad.append(f"{scripts} tutorials and {quotes} quotes found: must be 8 and 2 at least")
print("\n".join(bad))
sys.exit(bool(bad))
PY
mkdir -p "$work/clone/build/release" "$work/clone/out"
ln -s "$root/tests" "$root/platform" "$work/clone/"
ln -s "$program" "$work/clone/build/release/roborun"
cd "$work/clone" || exit 1
failed=0
for script in "$work"/*.sh; do
  start=$SECONDS
  bash -euo pipefail "$script" >"$work/log" 2>&1 </dev/null
  code=$?
  if [[ $code -eq 0 ]]; then
    echo "passed  $(basename "$script") ($((SECONDS - start)) s)"
  else
    echo "FAILED  $(basename "$script"), exit code $code:"
    cat "$script"
    tail -n 15 "$work/log"
    failed=1
  fi
done
exit $failed
