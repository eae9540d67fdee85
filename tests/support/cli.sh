# Sourced by a test of the command line with the arguments ROBORUN DATA: counts as checks.sh does, in a folder that goes with it.
. "$(dirname "${BASH_SOURCE[0]}")/checks.sh"
roborun=$1
data=$2
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work" || exit 1
