#!/usr/bin/env bash
# Three readers of SystemVerilog accept the tile: Verilator without a warning, Icarus, and Yosys without a latch or an
# undriven or twice driven wire. A tool that is missing is SKIPPED.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")"
sources=(ed_tile.sv ed_bank.sv)
out="$(mktemp -d)"
trap 'rm -rf "$out"' EXIT

# The tool's name, or nothing when it is missing.
have() { command -v "$1" >"$out/where" || { printf '%s: SKIPPED, not installed\n' "$1"; return 1; }; }

if have verilator; then
    for size in 4 8 16; do
        verilator --lint-only -Wall "-GROWS=$size" "-GCOLUMNS=$size" -y . ed_tile.sv
    done
    verilator --lint-only -Wall -GROWS=5 -GCOLUMNS=3 -GSLOTS=1 -GLUT_BITS=10 -GTREE_MAX=1 -y . ed_tile.sv
    echo "verilator: no warnings"
fi
if have iverilog; then
    iverilog -g2012 -Wall -s ed_tile -o "$out/ed_tile.vvp" "${sources[@]}"
    echo "iverilog: elaborates"
fi
if have yosys; then
    yosys -q -p "read_verilog -sv ${sources[*]}; hierarchy -check -top ed_tile -chparam ROWS 4 -chparam COLUMNS 4;
        proc; opt; check -assert; select -assert-none t:\$dlatch t:\$adlatch t:\$dlatchsr"
    echo "yosys: no latch, no loop, every wire driven once"
fi
