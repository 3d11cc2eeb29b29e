#!/usr/bin/env bash
# Makes the wheel and the sdist in dist/: native libraries inside, checked by auditwheel, an SBOM (PEP 770) and the
# licences of those libraries in the metadata. Built twice from one commit they are the same bytes.
set -euo pipefail
cd "$(dirname "$0")/.."

python=$PWD/.venv/bin/python
# The time of the commit stands for the time of every file in the archives. A checkout without git gives its own.
export SOURCE_DATE_EPOCH=${SOURCE_DATE_EPOCH:-$(git log -1 --format=%ct)}
export PATH=$PWD/.venv/bin:$PATH PYTHONHASHSEED=0

rm -rf build/wheel dist
mkdir -p build/wheel dist
tools/step.sh sdist "making the sdist" \
    "$python" -c 'from scikit_build_core.build import build_sdist; build_sdist("dist")'
tools/step.sh wheel "building the wheel" \
    "$python" -m pip wheel --no-build-isolation --no-deps --wheel-dir build/wheel .
tools/step.sh repair "putting the libraries inside" \
    "$python" -m auditwheel repair --wheel-dir build/wheel/repaired build/wheel/volprep-*.whl
tools/step.sh licences "adding their licences" \
    "$python" tools/wheel_licences.py build/wheel/repaired/volprep-*.whl dist
"$python" -m auditwheel show dist/volprep-*.whl | sed -n '/is consistent with/,/tag:/p'
sha256sum dist/*
