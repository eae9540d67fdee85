#!/usr/bin/env bash
# toolchain/sbom names the package of every library that the program loads, twice the same, and refuses what is no program.
set -euo pipefail
roborun=$1
cd "$(dirname "$0")/../.."
command -v dpkg-query >/dev/null || { echo "skipped: no dpkg"; exit 77; }
one=$(mktemp) two=$(mktemp)
trap 'rm -f "$one" "$two"' EXIT
toolchain/sbom "$roborun" >"$one"
toolchain/sbom "$roborun" >"$two"
cmp "$one" "$two"
python3 - "$one" "$roborun" <<'PY'
import json, subprocess, sys
document = json.load(open(sys.argv[1]))
assert document["spdxVersion"] == "SPDX-2.3"
ids = {p["SPDXID"] for p in document["packages"]}
assert len(ids) == len(document["packages"]), "an id twice"
linked = [r["relatedSpdxElement"] for r in document["relationships"] if r["relationshipType"] == "DYNAMIC_LINK"]
for r in document["relationships"]:
    assert {r["spdxElementId"], r["relatedSpdxElement"]} <= ids | {"SPDXRef-DOCUMENT"}, r
names = {p["SPDXID"]: p["name"] for p in document["packages"]}
wanted = {"libc6", "libstdc++6", "libzstd1"}
assert wanted <= {names[i] for i in linked}, wanted - {names[i] for i in linked}
assert all(p["versionInfo"] for p in document["packages"])
libraries = subprocess.run(["ldd", sys.argv[2]], stdout=subprocess.PIPE, text=True).stdout.count("(0x")
assert len(linked) >= 10 and libraries >= len(linked), (len(linked), libraries)
PY
for bad in /nonexistent tests/data/missions/hover.waypoints; do
  if toolchain/sbom "$bad" 2>"$two"; then echo "'$bad' was taken" >&2; exit 1; fi
  [[ $(wc -l <"$two") -eq 1 ]]
done
