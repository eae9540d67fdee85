# Counts what holds and what does not. Sourced; the script that does so ends by $failed.
failed=0
passed=0
check() {  # WHAT COMMAND..
  if "${@:2}"; then passed=$((passed + 1)); else echo "FAILED: $1"; failed=$((failed + 1)); fi
}
