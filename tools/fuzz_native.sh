#!/usr/bin/env bash
# Feeds damaged files to the native readers: those of formats/native/fuzz, one after the other, with libFuzzer where
# Clang is, else with our own driver. The sound files come from the generators of the tests.
#
# Usage: tools/fuzz_native.sh [--seconds N] [--only NAME]    (60 seconds each; header or vdb)
# Exit status: 0 nothing was found; 1 a reader failed, and the file that it failed on is in out/fuzz-native.
set -uo pipefail
cd "$(dirname "$0")/.." || exit 2

seconds=60
only=
while [ $# -gt 0 ]; do
    case $1 in
        --seconds) seconds=$2 ;;
        --only) only=$2 ;;
        *)
            echo "usage: tools/fuzz_native.sh [--seconds N] [--only NAME]" >&2
            exit 2
            ;;
    esac
    shift 2
done

has_libfuzzer() {
    echo 'extern "C" int LLVMFuzzerTestOneInput(const unsigned char*, unsigned long) { return 0; }' |
        "$1" -x c++ -fsanitize=fuzzer,address - -o /dev/null 2>/dev/null
}

compiler=${CXX:-c++}
for name in "$compiler" clang++ clang++-{20..14}; do
    if has_libfuzzer "$name"; then
        compiler=$name
        break
    fi
done

# One folder for each compiler: cmake cannot change it.
build=$PWD/build/fuzz/${compiler##*/}
make_fuzzers() {
    PATH=$PWD/.venv/bin:$PATH
    cmake -S formats/native/fuzz -B "$1" -G Ninja -DCMAKE_CXX_COMPILER="$2" && cmake --build "$1"
}
export -f make_fuzzers
tools/step.sh fuzz-native "building the fuzzers with $compiler" bash -c 'make_fuzzers "$1" "$2"' - \
    "$build" "$compiler" || exit 1
.venv/bin/python -m tests.robustness.native_corpus build/fuzz/corpus || exit 1

failed=0
mkdir -p out/fuzz-native
for program in "$build"/fuzz_*"$only"*; do
    [ -x "$program" ] || continue
    name=${program##*/fuzz_}
    mkdir -p "build/fuzz/found/$name"
    echo "volprep: fuzzing $name for $seconds s"
    # What libFuzzer finds worth keeping goes into the first folder, from which the next run goes on.
    if ! "$program" -max_total_time="$seconds" -max_len=300000 -timeout=20 -rss_limit_mb=4096 -print_final_stats=1 \
        -artifact_prefix="out/fuzz-native/$name-" "build/fuzz/found/$name" "build/fuzz/corpus/$name" \
        >"build/log/fuzz-$name.log" 2>&1; then
        failed=1
        echo "volprep: $name FAILED; the file is in out/fuzz-native, the report in build/log/fuzz-$name.log" >&2
    fi
    grep -E "runs|SUMMARY|ERROR" "build/log/fuzz-$name.log" | tail -n 3
done
exit "$failed"
