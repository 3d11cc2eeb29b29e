#!/usr/bin/env bash
# Feeds damaged packages to formats/c/volpkg.h under AddressSanitizer and UndefinedBehaviorSanitizer: COUNT of them made
# from sound packages of every kind by chance that SEED repeats, and with --seconds as many as libFuzzer makes in that
# time, which needs Clang (Debian: clang-14 libclang-rt-14-dev).
#
# Usage: tools/fuzz_c.sh [--count N] [--seed N] [--seconds N]
# Exit status: 0 nothing was found; 1 something was, and the package is in out/fuzz-c.
set -uo pipefail
cd "$(dirname "$0")/.." || exit 2

count=100000
seed=$(date +%s)
seconds=0
while [ $# -gt 0 ]; do
    case $1 in
        --count) count=$2 ;;
        --seed) seed=$2 ;;
        --seconds) seconds=$2 ;;
        *)
            echo "usage: tools/fuzz_c.sh [--count N] [--seed N] [--seconds N]" >&2
            exit 2
            ;;
    esac
    shift 2
done

root=$PWD
build=$root/build/fuzz-c
mkdir -p "$build/found" out/fuzz-c
flags="-std=c99 -O2 -g -fno-sanitize-recover=all"
.venv/bin/python tests/support/every_kind.py "$build/packages" >/dev/null || exit 1
# shellcheck disable=SC2086 # the flags are words
${CC:-cc} $flags -fsanitize=address,undefined tests/c/fuzz_volpkg.c -o "$build/fuzz_volpkg" -lm || exit 1

failed=0
echo "volprep: $count damaged packages, seed $seed"
(cd out/fuzz-c && "$build/fuzz_volpkg" "$seed" "$count" "$build"/packages/*.zip) || failed=1

if [ "$seconds" -gt 0 ]; then
    clang=
    for name in clang clang-{20..14}; do
        command -v "$name" >/dev/null && clang=$name && break
    done
    # shellcheck disable=SC2086 # as above
    if [ -z "$clang" ] || ! $clang $flags -DVOLPKG_LIBFUZZER -fsanitize=fuzzer,address,undefined tests/c/fuzz_volpkg.c \
        -o "$build/libfuzzer_volpkg" -lm 2>"$build/libfuzzer.log"; then
        echo "volprep: no libFuzzer here: install clang and its compiler-rt" >&2
        exit 1
    fi
    "$build/libfuzzer_volpkg" -max_total_time="$seconds" -max_len=200000 -timeout=20 -rss_limit_mb=4096 \
        -print_final_stats=1 -artifact_prefix="$root/out/fuzz-c/" "$build/found" "$build/packages" \
        >"$build/libfuzzer.log" 2>&1 || failed=1
    grep -E "number_of_executed_units|SUMMARY|ERROR" "$build/libfuzzer.log"
fi
exit "$failed"
