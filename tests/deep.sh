#!/usr/bin/env bash
# Proofs that are slow by nature, run by hand when the files they guard change. docs/PROOFS.md says when each ran last.
#
#   tests/deep.sh                 all of them, about two hours on two cores
#   tests/deep.sh emulated faults only these
#
#   name       guards                                        what it does
#   release    everything                                    `it` once more, with optimiser and without overflow checks
#   cases      src/chip, src/num                             laws 1 to 5 with thousands of cases
#   faults     src/chip, src/learn, src/lab/store            plants faults into the sources; the laws must notice
#   rtl        hw_models/rtl, src/chip/engine/tick/tile      plants faults into the SystemVerilog
#   emulated   src/chip/crossbar/kernel                      AVX-512 and AMX on an emulated processor
#   attack     src/cli, src/lab                              thousands of starts over damaged files, full disks, limits, kills
#   grown      src/lab, src/chip/ledger.rs                   the program with more keys, events and columns
#   extending  docs/EXTENDING.md                             its changes, applied to a copy, compiled and trained with
#   defaults   hw_models, src/lab/config, src/chip/engine    every chip and converter width trains by default, three seeds
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
known=(release cases faults rtl emulated attack grown extending defaults)
chosen=("$@")
[[ ${#chosen[@]} -gt 0 ]] || chosen=("${known[@]}")
for name in "${chosen[@]}"; do
    [[ " ${known[*]} " == *" $name "* ]] || { echo "tests/deep.sh: no proof \`$name\`; there are ${known[*]}" >&2 && exit 2; }
done

for name in "${chosen[@]}"; do
    printf '\n== %s, %s\n' "$name" "$(git describe --always --dirty 2>/dev/null || echo 'no revision')"
    before=$SECONDS
    case $name in
        release) cargo test --release --test it ;;
        cases)
            PROPTEST_CASES="${PROPTEST_CASES:-500}" cargo test --release --test it laws::law_1
            PROPTEST_CASES="${PROPTEST_CASES:-500}" cargo test --release --test it laws::law_2
            PROPTEST_CASES="${PROPTEST_CASES:-500}" cargo test --release --test it laws::runs
            PROPTEST_CASES="${PROPTEST_CASES:-3000}" cargo test --release --test it laws::law_4
            PROPTEST_CASES="${PROPTEST_CASES:-2000}" cargo test --release --test it laws::product
            ;;
        faults) tests/faults.sh ;;
        rtl) tests/rtl_faults.sh ;;
        emulated)
            cargo build --release
            tests/emulated.sh
            ;;
        extending) cargo test --test it extending -- --ignored ;;
        attack) ATTACK_STARTS="${ATTACK_STARTS:-4000}" cargo test --release --test attack -- --nocapture ;;
        grown) cargo test --features grown --test it golden_run ;;
        defaults) cargo test --release --test it defaults -- --include-ignored --nocapture ;;
    esac
    printf '== %s: passed in %d s\n' "$name" $((SECONDS - before))
done
