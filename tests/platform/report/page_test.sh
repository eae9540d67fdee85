#!/usr/bin/env bash
# usage: page_test.sh ROBORUN SAMPLE_FLIGHT_LOG    A log of ten minutes, its page, that of its folder and of an audit, and a browser that uses them. Exit code 77: no Chromium.
set -uo pipefail
here=$(cd "$(dirname "$0")" && pwd)
roborun=$1 sample=$2
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work" || exit 1
"$sample" flight.mcap 600 || { echo "no sample"; exit 1; }
"$roborun" report flight.mcap || exit 1
"$roborun" report flight.mcap -o again.html >/dev/null && cmp flight.html again.html || { echo "FAILED: the same log gives another page"; exit 1; }
mkdir cut && head -c 200000 flight.mcap >cut/flight.mcap && "$roborun" report cut -o index.html >/dev/null || exit 1
"$roborun" audit --seconds 1 --best-effort --html audit.html >/dev/null || [[ $? -eq 1 ]] || exit 1  # 1: an audit that fails has a page, too
python3 "$here/page_in_chromium.py" flight.html "${ROBORUN_SHOTS:-}" index.html audit.html
