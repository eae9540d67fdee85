#!/usr/bin/env bash
# usage: page_test.sh ROBORUN SAMPLE_FLIGHT_LOG    A log of ten minutes, its page, and a browser that uses it. Exit code 77: no Chromium.
set -uo pipefail
here=$(cd "$(dirname "$0")" && pwd)
roborun=$1 sample=$2
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work" || exit 1
"$sample" flight.mcap 600 || { echo "no sample"; exit 1; }
"$roborun" report flight.mcap || exit 1
"$roborun" report flight.mcap -o again.html >/dev/null && cmp flight.html again.html || { echo "FAILED: the same log gives another page"; exit 1; }
python3 "$here/page_in_chromium.py" flight.html "${ROBORUN_SHOTS:-}"
