#!/usr/bin/env bash
# Plans in lockstep, on both fakes: flown to the end, no collision, the same twice. usage: plan_lockstep_test.sh ROBORUN ROOT
set -uo pipefail
roborun=$1 root=$2
for kind in px4 arducopter; do
  for _ in 1 2; do
    "$roborun" fly --env 14 --seed 1 --profile paper --autopilot $kind --plan "$root/tests/data/missions/environment_14_goals.plan" --json 2>/dev/null
  done | python3 -c 'import json, sys
a, b = [r["result"] if "result" in r else r for r in (json.loads(l) for l in sys.stdin)]
ok = a["reached_goal"] and not a["collided"] and a["state_hash"] == b["state_hash"]
ok = ok and [g["answer"] for g in a["goals"]] == ["reached"] * 4 and a["mission"]["done"] == a["mission"]["steps"]
print(sys.argv[1], a["reason"], a["mission_time_s"], [g["answer"] for g in a["goals"]], a["state_hash"])
sys.exit(not ok)' $kind || exit 1
  # Take-off, way-points, hold, speed, fence, release, return: as `run --mission` flies it.
  "$roborun" fly --world "$root/tests/data/worlds/two_pillars.toml" --profile paper --autopilot $kind \
    --plan "$root/tests/data/missions/two_pillars.plan" --json 2>/dev/null | python3 -c 'import json, sys
a = json.loads(sys.stdin.readlines()[-1])
a = a.get("result", a)
print(sys.argv[1], a["reason"], a["mission_time_s"], a["mission"], [g["time_s"] for g in a["goals"]])
sys.exit(not (a["reached_goal"] and not a["collided"] and a["mission"] == {"steps": 6, "done": 6, "released": 1}))' $kind || exit 1
done
