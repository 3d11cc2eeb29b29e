#!/usr/bin/env bash
# Prints the path of a Python that can build volprep: 3.11 to 3.13, with venv and C headers. Exits 1 if there is none.
# Newer ones are left out because not every package in constraints.txt has a wheel for them.
# PYTHON in the environment, if set, is the only one that is tried.
set -u

# Prints the real interpreter: not a version manager's shim, which may choose another one tomorrow, nor a .venv.
usable() {
    "$1" - 2>/dev/null <<'EOF'
import ensurepip, pathlib, sys, sysconfig, venv
headers = pathlib.Path(sysconfig.get_path("include"), "Python.h")
if not ((3, 11) <= sys.version_info < (3, 14) and headers.exists()):
    sys.exit(1)
print(getattr(sys, "_base_executable", sys.executable))
EOF
}

for name in ${PYTHON:-python3 /usr/bin/python3 python3.13 python3.12 python3.11}; do
    command -v "$name" >/dev/null && usable "$name" && exit 0
done
exit 1
