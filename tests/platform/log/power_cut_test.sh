#!/usr/bin/env bash
# usage: power_cut_test.sh ROBORUN RECORDER POWER_CUTS [CUTS]    A flight on real time whose log's writes are recorded, and what power cuts leave of it.
set -uo pipefail
roborun=$1 recorder=$2 power_cuts=$3 cuts=${4:-100}
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
# On real time: where the machine does not let the log's thread or the disk run, a flight may rightly lose more. So each has three tries.
for try in 1 2 3; do
  rm -f "$folder"/*
  RECORD_FILE=$folder/flight.mcap RECORD_TO=$folder/calls LD_PRELOAD=$recorder \
    "$roborun" audit --seconds 20 --best-effort --json --log "$folder/flight.mcap" >"$folder/audit.json" 2>"$folder/audit.err"
  [[ $? -le 1 ]] || { cat "$folder/audit.err"; exit 1; }  # 1: it flew, and missed deadlines
  "$power_cuts" "$folder/flight.mcap" "$folder/calls" "$cuts" "$try" && exit 0
done
exit 1
