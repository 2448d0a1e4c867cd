#!/usr/bin/env bash
# All tests, in the order of continuous integration. Needs what `rustup` installs, and nothing else by hand.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
export PROPTEST_RNG_SEED="${PROPTEST_RNG_SEED:-1}" # property tests try the same cases every time

step() { printf '\n== %s\n' "$*"; }

step cargo fmt --check
cargo fmt --check

step cargo clippy
cargo clippy --all-targets -- -D warnings

step cargo test
cargo test

step cargo test --release --test it
cargo test --release --test it

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

step all passed
