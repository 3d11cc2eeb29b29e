#!/usr/bin/env bash
# Runs one long step of the set-up:  tools/step.sh NAME "what it does, and how long it usually takes" COMMAND...
# Says what is going on, every ten seconds how far it is, and in the end how long it took. What the command prints
# goes to build/log/NAME.log; the end of that file is shown if the command fails. Exits as the command does.
set -uo pipefail

log=build/log/$1.log
what=$2
shift 2
mkdir -p "$(dirname "$log")"
# ninja would take its number of tasks from make, which counts steps.
unset MAKEFLAGS MFLAGS

# sleep must not hold our output open: whoever reads it through a pipe would wait for sleep to end.
heartbeat() {
    while sleep 10 >/dev/null 2>&1; do
        printf 'volprep: %s ... %s s: %.70s\n' "${what% (usually*}" "$SECONDS" "$(tail -n 1 "$log" | tr -d '\r')"
    done
}

echo "volprep: $what ..."
heartbeat &
teller=$!
trap 'kill "$teller" 2>/dev/null' EXIT

"$@" >"$log" 2>&1
status=$?
if [ "$status" -eq 0 ]; then
    echo "volprep: ${what% (usually*}: done in $SECONDS s"
else
    tail -n 25 "$log"
    echo "volprep: $what: FAILED with status $status after $SECONDS s. The whole output is in $PWD/$log" >&2
fi
exit "$status"
