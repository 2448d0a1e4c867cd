#!/usr/bin/env bash
# All tests, as continuous integration runs them: from nothing to green in some twenty minutes on two quiet cores.
#
#   bash tests/all.sh                 sets up what is missing, and says so; needs rustup and a C compiler by hand
#   bash tests/all.sh --no-install    installs nothing: what needs a missing tool is SKIPPED
#
# What is slow by nature (emulated processors, thousands of cases, planted faults) is in tests/deep.sh.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
export PROPTEST_RNG_SEED="${PROPTEST_RNG_SEED:-1}" # property tests try the same cases every time

install=yes
case "${1:-}" in
    '') ;;
    --no-install) install=no ;;
    *)
        echo "tests/all.sh: unknown option $1; there is --no-install" >&2
        exit 2
        ;;
esac

log=$(mktemp)
runs=$(mktemp -d)
trap 'rm -rf "$log" "$runs"' EXIT
started=$SECONDS
last=$SECONDS
current=

# the name of a step, and how long the one before it took
step() {
    [[ -z $current ]] || printf '   (%s: %d s)\n' "$current" $((SECONDS - last))
    last=$SECONDS
    current=$*
    printf '\n== %s\n' "$*"
}

# a Debian package and what it is for; false when it is missing and cannot be had
tool() {
    command -v "$1" >/dev/null && return 0
    if [[ $install == no ]]; then
        echo "$1 is not installed: $2 is skipped (--no-install)"
        return 1
    fi
    if [[ $(id -u) != 0 ]] || ! command -v apt-get >/dev/null; then
        echo "$1 is not installed, and this is no root shell with apt-get: $2 is skipped"
        return 1
    fi
    local before=$SECONDS
    echo "installing $1, for $2; about a minute"
    apt-get install -y -qq "$1" >/dev/null 2>&1 || { apt-get update -qq && apt-get install -y -qq "$1"; } >/dev/null 2>&1 || true
    if command -v "$1" >/dev/null; then
        echo "installed $1 in $((SECONDS - before)) s"
    else
        echo "$1 cannot be installed: $2 is skipped"
        return 1
    fi
}

tests() {
    step cargo fmt --check
    cargo fmt --check

    step "the tile in SystemVerilog: three readers"
    rtl=()
    if tool verilator "the tile in SystemVerilog, beside the one in Rust"; then rtl=(--features rtl); fi
    tool iverilog "a second reader of the tile" || true
    tool yosys "a third reader of the tile" || true
    hw_models/rtl/check.sh # says SKIPPED for what is missing
    tool chromium "opening pages in a browser" || true

    step cargo clippy "${rtl[@]}"
    cargo clippy --all-targets "${rtl[@]}" -- -D warnings

    step cargo test "${rtl[@]}"
    cargo test "${rtl[@]}" --lib --bins --test it --test tidy
    cargo test "${rtl[@]}" --doc

    # a few hundred starts; tests/deep.sh attack does thousands
    step "an attack on the program"
    cargo test "${rtl[@]}" --test attack -- --nocapture

    step "the tile in SystemVerilog against the tile in Rust"
    if [[ ${#rtl[@]} -gt 0 ]]; then
        cargo test "${rtl[@]}" --test rtl -- --nocapture
    else
        echo "SKIPPED: no Verilator; the golden digests of \`it\` stand in"
    fi

    # another optimiser, no overflow checks: the same bits
    step "cargo build --release, the golden run and the kept run"
    cargo build --release
    local program=${CARGO_TARGET_DIR:-target}/release/dalean golden done kernel
    golden=$(<tests/golden/digits.hash)
    for kernel in "" "--kernel scalar"; do
        # shellcheck disable=SC2086
        done=$("$program" train tests/golden/small.toml $kernel --json --out "$runs" | tail -n 1)
        [[ $done == *"\"state_hash\":\"$golden\""* ]] || { echo "not the golden hash $golden: $done" && exit 1; }
        echo "golden run${kernel:+, $kernel}: $golden"
    done
    cp -r tests/golden/run "$runs/kept"
    "$program" verify "$runs/kept"

    step "the Python package, from its wheel"
    if [[ $install == yes ]]; then
        bash tests/python.sh
    else
        echo "SKIPPED the Python package: its tests need packages (--no-install)"
    fi
    printf '   (%s: %d s)\n' "$current" $((SECONDS - last))
}

tests 2>&1 | tee "$log" # a failure inside ends this script here
skipped=$(grep -h 'SKIPPED' "$log" | sed 's/^ *//' | sort -u | paste -sd';' || true)
printf '\n== all passed in %d min %02d s; ' $(((SECONDS - started) / 60)) $(((SECONDS - started) % 60))
echo "skipped: ${skipped:-nothing}"
