#!/usr/bin/env bash
# Builds the native modules with AddressSanitizer and UndefinedBehaviorSanitizer into build/sanitize, and runs against
# them the tests of kernels and native readers, and damaged files of the kinds that native code reads.
#
# Arguments go to pytest. Exit status: 0 nothing was found; 1 a test failed or a sanitizer found something, which is in
# build/sanitize/findings; 2 the compiler has no sanitizers.
set -uo pipefail
cd "$(dirname "$0")/.." || exit 2

build=$PWD/build/sanitize
findings=$build/findings
compiler=${CXX:-c++}
preload=$build/formats/native/liballocation.so
for library in libasan.so libstdc++.so; do
    path=$("$compiler" -print-file-name="$library")
    if [ ! -f "$path" ]; then
        echo "volprep: $compiler has no $library. Set CXX to a GCC with sanitizers (Debian: apt-get install g++)." >&2
        exit 2
    fi
    preload+=:$path
done

make_modules() {
    PATH=$PWD/.venv/bin:$PATH
    cmake -S . -B "$1" -G Ninja -DCMAKE_BUILD_TYPE=Release -DVOLPREP_SANITIZE=ON \
        -DPython_EXECUTABLE="$PWD/.venv/bin/python" && cmake --build "$1"
}
export -f make_modules
tools/step.sh sanitize "building the native core with sanitizers" bash -c 'make_modules "$1"' - "$build" || exit 1

rm -rf "$findings"
mkdir -p "$findings"
# Python frees little at its end, so leaks are not looked for. liballocation.so must come before libasan.so.
options=detect_leaks=0:verify_asan_link_order=0:allocator_may_return_null=1
sanitized() {
    env LD_PRELOAD="$preload" ASAN_OPTIONS="$options:log_path=$findings/address" \
        UBSAN_OPTIONS="print_stacktrace=1:log_path=$findings/undefined" \
        PYTHONPATH="$PWD/tools/sanitize" VOLPREP_SANITIZED="$build" OMP_NUM_THREADS="${OMP_NUM_THREADS:-2}" \
        .venv/bin/python "$@"
}

failed=0
sanitized -c 'from volprep.kernels import _native; from volprep_formats import _dicom; print(_native.__file__, _dicom.__file__)' |
    grep -qF "$build" || failed=1
sanitized -m pytest -q -p no:cacheprovider tests/differential tests/truth/test_oracle_closed_forms.py \
    tests/truth/test_oracle_labels.py tests/truth/test_oracle_lit.py tests/truth/test_oracle_twin.py \
    tests/robustness/test_dicom_plain.py "$@" || failed=1
for kind in DICOM OpenVDB; do
    sanitized -m tests.robustness.fuzz --seconds 20 --seed 1 --only "$kind" || failed=1
done

for file in "$findings"/*; do
    [ -f "$file" ] || continue
    failed=1
    echo "volprep: a sanitizer found something, see $file" >&2
    head -n 12 "$file" >&2
done
exit "$failed"
