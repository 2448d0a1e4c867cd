#!/usr/bin/env bash
# AVX-512 and AMX on machines that lack them: the kernels against the law, and the golden run, on an emulated processor.
#
#   tests/emulated.sh [OPTIONS OF CARGO]      after `cargo test` and `cargo test --release --test it`
#
# Few cases of each property, and without the tests that take a minute or more here; PROPTEST_CASES=N for more.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

skip() {
    echo "SKIPPED: $1"
    exit
}

[[ $(uname -sm) == 'Linux x86_64' ]] || skip 'only programs for Linux on x86-64 run on it'
! grep -qw amx_int8 /proc/cpuinfo || skip 'this processor has both, so all tests have used them'
tests/emulate.sh --fetch || skip 'the emulator cannot be fetched'
tests/emulate.sh --self-test

if ! built=$(cargo test "$@" --lib --no-run 2>&1); then
    echo "$built"
    exit 1
fi
tests=$(sed -n 's/.*Executable unittests src.lib.rs (\(.*\))/\1/p' <<<"$built")
PROPTEST_CASES="${PROPTEST_CASES:-8}" tests/emulate.sh "$tests" --test-threads=1 \
    kernel::tests kernel::team whole_blocks_of_channels \
    --skip the_longest --skip the_largest_sums --skip the_edges_of --skip every_shift

golden=$(<tests/golden/digits.hash)
runs=$(mktemp -d)
trap 'rm -rf "$runs"' EXIT
for kernel in avx512 amx; do
    done=$(tests/emulate.sh "${CARGO_TARGET_DIR:-target}/release/dalean" train tests/golden/small.toml --json --out "$runs" \
        --threads 2 --kernel "$kernel" | tail -n 1)
    hash=$(sed -n 's/.*"state_hash":"\([0-9a-f]*\)".*/\1/p' <<<"$done")
    echo "golden run, $kernel: $hash"
    [[ $hash == "$golden" ]] || { echo "not the golden hash, $golden" && exit 1; }
done
