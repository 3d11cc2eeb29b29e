#!/usr/bin/env bash
# Writes constraints.txt anew: the newest versions of everything that volprep, its build, tests, linters and benchmarks
# need. For a maintainer, from time to time; afterwards run the four make commands and look at what changed.
# Needs the oldest supported Python, since its versions work on the newer ones, but not always the other way round.
set -euo pipefail
cd "$(dirname "$0")/.."

python=$(PYTHON=python3.11 tools/find_python.sh) || { echo "pin_versions.sh: no usable Python 3.11" >&2; exit 1; }
venv=$(mktemp -d)
trap 'rm -rf "$venv"' EXIT

"$python" -m venv "$venv"
"$venv/bin/pip" install -q --upgrade pip
"$venv/bin/python" tools/requirements.py core validate batch zarr convex build test lint docs bench wheel >"$venv/requirements.txt"
tools/step.sh pin "installing the newest versions" "$venv/bin/pip" install --only-binary=:all: -r "$venv/requirements.txt"
{
    echo "# The versions that volprep was tested with. Every installation that make does takes these."
    echo "# Written by tools/pin_versions.sh."
    "$venv/bin/pip" freeze --all --exclude setuptools
} >constraints.txt
