#!/usr/bin/env bash
# Installs the requirements of the named extras of pyproject.toml (tools/requirements.py) into .venv, in the versions
# of constraints.txt. Makes .venv first if it is not there or its Python does not run.
set -euo pipefail
cd "$(dirname "$0")/.."

make_venv() {
    local python
    python=$(tools/find_python.sh)
    "$python" -m venv --clear .venv
    .venv/bin/pip install --constraint constraints.txt --upgrade pip
}
export -f make_venv

.venv/bin/pip --version >/dev/null 2>&1 || tools/step.sh venv "making .venv" bash -euo pipefail -c make_venv
mapfile -t requirements < <(.venv/bin/python tools/requirements.py "$@")
tools/step.sh "$1" "installing Python packages ($*)" \
    .venv/bin/pip install --constraint constraints.txt "${requirements[@]}"
