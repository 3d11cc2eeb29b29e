#!/usr/bin/env bash
# Installs the requirements of the named extras of pyproject.toml (tools/requirements.py) into .venv, in the versions
# of constraints.txt. Modules are compiled when they are first imported: most never are.
#
# Usage: tools/install.sh "how long it usually takes" EXTRA...
set -euo pipefail
cd "$(dirname "$0")/.."

usually=$1
shift
mapfile -t requirements < <(.venv/bin/python tools/requirements.py "$@")
tools/step.sh "install-$1" "installing Python packages: $* (usually $usually)" \
    .venv/bin/pip install --no-compile --constraint constraints.txt "${requirements[@]}"
