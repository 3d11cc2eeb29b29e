#!/usr/bin/env bash
# Makes .venv, with the pip of constraints.txt, unless there is one that runs.
set -euo pipefail
cd "$(dirname "$0")/.."

.venv/bin/pip --version >/dev/null 2>&1 && exit 0
"$(tools/find_python.sh)" -m venv --clear .venv
.venv/bin/pip install --constraint constraints.txt --upgrade pip
