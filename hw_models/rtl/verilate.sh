#!/usr/bin/env bash
# Turns the tile into one C++ file, ed_tile.cpp, that holds the verilated model and its C interface (shim.cpp).
#
#   verilate.sh SOURCE SIZE FOLDER      SOURCE: ed_tile.sv; its other modules are sought beside it, then beside this script
#
# The model has SIZE rows and columns, 4 slots, 64 table entries and 4 tree stages; its C interface is the function
# ed_tile_SIZExSIZE. Loops stay loops (--unroll-count 1), which keeps the C++ small enough to compile in seconds.
set -euo pipefail
source="$1" size="$2" folder="$3"
here="$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)"
name="ed_tile_${size}x${size}"

rm -rf "$folder"
mkdir -p "$folder"
verilator --cc -O3 --unroll-count 1 --x-assign 0 --x-initial 0 -Wno-fatal --prefix "V$name" --Mdir "$folder" \
    "-GROWS=$size" "-GCOLUMNS=$size" -GSLOTS=4 -GLUT_BITS=6 -GTREE_MAX=4 \
    -y "$(dirname "$source")" -y "$here" "$here/registers.vlt" "$source"

cd "$folder"
parts=("V$name"*.cpp)
{
    echo "#define ED_TILE_NAME $name"
    echo "#define ED_TILE_MODEL V$name"
    echo "#define ED_TILE_ROOT V${name}___024root"
    echo "constexpr int ROWS = $size, COLUMNS = $size, SLOTS = 4, TREE_MAX = 4;"
    printf '#include "%s"\n' "V$name.h" "V${name}___024root.h" "${parts[@]}" "$here/shim.cpp"
} >ed_tile.cpp
