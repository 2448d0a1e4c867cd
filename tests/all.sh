#!/usr/bin/env bash
# All tests, in the order of continuous integration. Needs what `rustup` installs, and nothing else by hand.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
export PROPTEST_RNG_SEED="${PROPTEST_RNG_SEED:-1}" # property tests try the same cases every time

step() { printf '\n== %s\n' "$*"; }

# Debian's packages; false when a tool is missing and cannot be had
tool() {
    command -v "$1" >/dev/null && return 0
    if [[ $(id -u) == 0 ]] && command -v apt-get >/dev/null; then
        apt-get install -y -qq "$1" >/dev/null 2>&1 || { apt-get update -qq && apt-get install -y -qq "$1"; } >/dev/null 2>&1
    fi
    command -v "$1" >/dev/null
}

step cargo fmt --check
cargo fmt --check

step the tile in SystemVerilog: three readers
tool iverilog || true
tool yosys || true
rtl=()
if tool verilator; then rtl=(--features rtl); fi
hw_models/rtl/check.sh # says SKIPPED for what is missing

tool chromium || true # opens the pages; the tests say SKIPPED without it

step cargo clippy "${rtl[@]}"
cargo clippy --all-targets "${rtl[@]}" -- -D warnings

step cargo test "${rtl[@]}"
cargo test "${rtl[@]}" --lib --bins --test it --test tidy
cargo test "${rtl[@]}" --doc

if [[ ${#rtl[@]} -gt 0 ]]; then
    step the tile in SystemVerilog against the tile in Rust
    cargo test "${rtl[@]}" --test rtl -- --nocapture
else
    step "the tile in SystemVerilog against the tile in Rust: SKIPPED, no Verilator; the golden digests of \`it\` stand in"
fi

step cargo test --release --test it
cargo test --release --test it

step AVX-512 and AMX on an emulated processor
tests/emulated.sh "${rtl[@]}"

runs="$(mktemp -d)"
trap 'rm -rf "$runs"' EXIT
for example in examples/*.toml; do
    if grep -Eq '^set = "(mnist|fashion-mnist|cifar10)"' "$example"; then
        step "$example: SKIPPED, its data has to be fetched"
        continue
    fi
    step "$example, one epoch"
    # the program that the release tests have just built
    "${CARGO_TARGET_DIR:-target}/release/dalean" train "$example" --set learning.epochs=1 --out "$runs" --quiet
done

for sweep in examples/sweeps/*.toml; do
    if grep -Eq '^data.set = "(mnist|fashion-mnist|cifar10)"' "$sweep"; then
        step "$sweep: SKIPPED, its data has to be fetched"
        continue
    fi
    step "$sweep, one epoch"
    "${CARGO_TARGET_DIR:-target}/release/dalean" sweep "$sweep" --set learning.epochs=1 --store "$runs/store" --quiet
done

step all passed
