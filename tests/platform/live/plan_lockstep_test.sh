#!/usr/bin/env bash
# Plans in lockstep, on both fakes: flown to the end, no collision, the same twice. usage: plan_lockstep_test.sh ROBORUN ROOT
set -uo pipefail
roborun=$1 root=$2
for kind in px4 arducopter; do
  "$roborun" fly --env 14 --seed 1 --profile paper --autopilot $kind --plan "$root/tests/data/missions/environment_14_goals.plan" --json 2>/dev/null |
    python3 -c 'import json, sys
a = json.loads(sys.stdin.readlines()[-1])
a = a.get("result", a)
ok = a["reached_goal"] and not a["collided"]
ok = ok and [g["answer"] for g in a["goals"]] == ["reached"] * 4 and a["mission"]["done"] == a["mission"]["steps"]
print(sys.argv[1], a["reason"], a["mission_time_s"], [g["answer"] for g in a["goals"]], a["state_hash"])
sys.exit(not ok)' $kind || exit 1
  # Take-off, way-points, hold, speed, fence, release, return: as `run --mission` flies it.
  for _ in 1 2; do
    "$roborun" fly --world "$root/tests/data/worlds/two_pillars.toml" --profile paper --autopilot $kind \
      --plan "$root/tests/data/missions/two_pillars.plan" --json 2>/dev/null
  done | python3 -c 'import json, sys
a, b = [r.get("result", r) for r in (json.loads(l) for l in sys.stdin)]
ok = a["reached_goal"] and not a["collided"] and a["mission"] == {"steps": 6, "done": 6, "released": 1}
print(sys.argv[1], a["reason"], a["mission_time_s"], a["mission"], [g["time_s"] for g in a["goals"]], a["state_hash"], b["state_hash"])
sys.exit(not (ok and a["state_hash"] == b["state_hash"]))' $kind || exit 1
done
# A way-point without room ends the flight as soon as that is known, as in `run`: nothing of a plan is left out. 0.3 m inside of a pillar.
printf 'QGC WPL 110\n%s\n%s\n%s\n%s\n' "0 1 0 16 0 0 0 0 47.397742 8.545594 488 1" "1 0 3 22 0 0 0 0 47.397742 8.545594 4 1" \
  "2 0 3 16 0 0 0 0 47.397751 8.5458364 4 1" "3 0 3 16 0 0 0 0 47.397742 8.546389 4 1" | tr ' ' '\t' | sed '1s/\t/ /g' >"${TMPDIR:-/tmp}/blocked-$$.waypoints"
"$roborun" fly --world "$root/tests/data/worlds/two_pillars.toml" --profile paper --plan "${TMPDIR:-/tmp}/blocked-$$.waypoints" --json 2>/dev/null |
  python3 -c 'import json, sys
a = json.loads(sys.stdin.readlines()[-1])
a = a.get("result", a)
print("blocked", a["reason"], a["mission_time_s"], a["goals"])
sys.exit(not (a["reason"] == "goal_blocked" and a["mission"]["done"] == 0 and a["mission_time_s"] < 60.0))'
code=${PIPESTATUS[1]}  # the flight's own says that its goal was not reached
rm -f "${TMPDIR:-/tmp}/blocked-$$.waypoints"
exit $code
