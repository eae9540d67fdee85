# What flights by processes are asked for. Sourced; the script that does so has its answers in $folder/NAME.json.
# value FILE PATH: of the last object, keys with dots between; "none" if there is no such thing.
value() { python3 -c 'import functools, json, sys
try: print(functools.reduce(lambda d, k: d[k], sys.argv[2].split("."), json.loads(open(sys.argv[1]).read().splitlines()[-1])))
except Exception: print("none")' "$folder/$1.json" "$2"; }
ends() {  # CODE PID
  wait "$2"
  local code=$?
  [[ $code -eq $1 ]] || { echo "exit code $code, not $1"; return 1; }
}
is() {  # WANTED FILE PATH
  local got
  got=$(value "$2" "$3")
  [[ "$got" == "$1" ]] || { echo "$2: $3 is $got, not $1"; return 1; }
}
# On real time: on a machine that does not let them run for a while the vehicle may rightly be given up. So each flight has
# three tries; what is asked of it is the same each time.
tries() {  # NAME COMMAND..
  local what=$1 try
  shift
  for try in 1 2 3; do
    if "$@"; then
      echo "ok $what"
      return 0
    fi
    echo "try $try of $what failed: $(cat "$folder"/*.err "$folder"/*.json | tail -c 1500)"
    kill -9 $plant $run ${feeder:-} 2>/dev/null
    wait 2>/dev/null
  done
  return 1
}
