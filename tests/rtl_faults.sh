#!/usr/bin/env bash
# Plants one fault at a time into a copy of the RTL tile and runs the lock-step test against it.
#
#   tests/rtl_faults.sh          all faults, one line each: caught (where), MISSED, NOT PLANTED or NOT JUDGED
#   tests/rtl_faults.sh slice    those whose name holds "slice"
#
# Only the model of 8 x 8 is built, as a shared library that the lock-step test loads in place of its own.
# Ends with 1 unless every fault was caught, and the tile without a fault agrees. Needs Verilator.
set -euo pipefail
root="$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)"
only="${1:-}"
jobs="$(nproc)"
work="$(mktemp -d)"
trap 'rm -rf "$work"' EXIT
cd "$root"

# --- what all faults share: the test, and what verilated models run on ---

cargo test --features rtl --test rtl --no-run 2>&1 | tee "$work/build.log" | tail -n 1
test_program="$(sed -n 's/.*(\(.*rtl-[0-9a-f]*\)).*/\1/p' "$work/build.log")"
runtime="$(verilator --getenv VERILATOR_ROOT)/include"
compile=(g++ -std=gnu++17 -O0 -fPIC -pthread -w -I "$runtime" -I "$runtime/vltstd")
for part in verilated verilated_threads; do "${compile[@]}" -c "$runtime/$part.cpp" -o "$work/$part.o"; done

# Builds the sources in a folder and runs the test against them: its log is FOLDER/log, its first difference FOLDER/line.
try() {
    local folder="$1"
    hw_models/rtl/verilate.sh "$folder/ed_tile.sv" 8 "$folder/model" >"$folder/log" 2>&1 &&
        "${compile[@]}" -I "$folder/model" -shared -Wl,-Bsymbolic "$folder/model/ed_tile.cpp" "$work"/verilated*.o \
            -o "$folder/ed_tile.so" >>"$folder/log" 2>&1 || return 2
    ED_TILE_LIBRARY="$folder/ed_tile.so" "$test_program" --exact --nocapture \
        rtl_and_tick_agree_in_every_register_of_every_cycle >>"$folder/log" 2>&1 && return 0
    sed -n 's/^DIFFERS //p' "$folder/log" >"$folder/line"
    test -s "$folder/line" || return 2
    return 1
}

# Name, file (tile or bank), and pairs of: what is there (fixed text within a line, once), what is put there.
fault() {
    local name="$1" file="ed_$2.sv" from to found folder
    shift 2
    [[ $name == *"$only"* ]] || return 0
    folder="$work/$planted"
    planted=$((planted + 1))
    mkdir "$folder"
    cp hw_models/rtl/*.sv "$folder"
    printf '%s\n' "$name" >"$folder/name"
    while (($#)); do
        from="$1" to="$2"
        shift 2
        found="$(grep -cF -- "$from" "$folder/$file" || true)"
        if [[ $found != 1 ]]; then
            printf 'NOT PLANTED (%s places)\n' "$found" >"$folder/verdict"
            return 0
        fi
        from="$(printf '%s' "$from" | sed 's/[][\.*^$|]/\\&/g')"
        to="$(printf '%s' "$to" | sed 's/[&|\]/\\&/g')"
        sed -i "s|$from|$to|" "$folder/$file"
    done
    while (($(jobs -rp | wc -l) >= jobs)); do wait -n || true; done
    (
        result=0
        try "$folder" || result=$?
        case $result in
            0) echo "MISSED" ;;
            1) sed 's/ in RTL, .*//; s/^/caught at /' "$folder/line" ;;
            *) echo "NOT JUDGED, no difference but: $(grep -m 1 -A 1 -e panicked -e '%Error' "$folder/log" | tail -n 1)" ;;
        esac >"$folder/verdict"
    ) &
}

planted=0

fault "none, for control" tile "// The tile: a crossbar" "// The tile: a crossbar"

# --- time ---
fault "sampled a cycle early" tile "front_phase == settle - 32'd1" "front_phase == settle - 32'd2"
fault "sampled a cycle late" tile "front_phase == settle - 32'd1" "front_phase == settle"
fault "slices never overlap" tile "assign period = !overlap ?" "assign period = 1'b1 ?"
fault "slices always overlap" tile "assign period = !overlap ?" "assign period = 1'b0 ?"
fault "a slice lasts as long as it settles" tile \
    "settle > conversion ? settle : conversion" "settle"
fault "slack ignored" tile \
    "assign slack = groups > front_cycles ? groups - front_cycles : 32'd0" "assign slack = 32'd0"
fault "slack one short" tile "? groups - front_cycles : 32'd0" "? groups - front_cycles - 32'd1 : 32'd0"
fault "a conversion takes one cycle less" tile "conv_count == convert - 32'd1" "conv_count + 32'd2 >= convert"
fault "the last step of a share is left out" tile "conv_step == share - 32'd1" "conv_step + 32'd2 >= share"
fault "a sample does not restart busy converters" tile \
    "end else if (sample) begin" "end else if (sample && !step_end) begin"
fault "tree one stage short" tile "if (tree_stages == s + 1) begin" "if (tree_stages == s + 2) begin"
fault "tree forgets whose sample it carries" tile "lane_slot <= arrives_slot" "lane_slot <= conv_slot"
fault "lanes one group short" tile "lane_group == groups - 32'd1" "lane_group + 32'd2 >= groups"
fault "a hop too few" tile "err_count >= hops && err_count" "err_count + 32'd1 >= hops && err_count"
fault "the last error word is lost" tile "err_count < hops + words;" "err_count + 32'd1 < hops + words;"
fault "a pulse is a cycle short" tile "upd_count == pulse - 32'd1" "upd_count + 32'd2 >= pulse"
fault "RESET before SET" tile \
    "upd_phase <= set_most != 7'd0 ? SET : reset_most != 7'd0 ? RESET : TURN" \
    "upd_phase <= reset_most != 7'd0 ? RESET : set_most != 7'd0 ? SET : TURN"
fault "no RESET after SET" tile "upd_phase == SET && peak_reset != 7'd0 ? RESET : TURN" "TURN"
fault "the last row is left out" tile "upd_row == rows - 32'd1" "upd_row + 32'd2 >= rows"
fault "peak of SET over bank E only" tile "set_e > set_i ? set_e : set_i" "set_e"
fault "peak of RESET over bank I only" tile "reset_e > reset_i ? reset_e : reset_i" "reset_i"

# --- commands ---
fault "FWD accepted while updating" tile "!(front_busy || err_busy || upd_busy)" "!(front_busy || err_busy)"
fault "FWD waits for the converters" tile "!(front_busy || err_busy || upd_busy)" "idle"
fault "loads accepted while converting" tile "!(front_busy || conv_busy ||" "!(front_busy ||"
fault "loads accepted while the tree is full" tile "tree_valid != '0 || lane_busy" "lane_busy"
fault "UPD add keeps a shift" tile "cmd_op == ADD ? 6'd0 : cmd_shift" "cmd_shift"
fault "UPD write keeps a slot" tile "cmd_op == WRITE ? 32'd0 : cmd_slot" "cmd_slot"
fault "LOADX into every slot" bank "if (load_slot == s && load_row == r)" "if (load_row == r)"
fault "LOADW into unused columns" bank \
    "if (used[c]) level[12*(COLUMNS*r + c) +: 12]" "level[12*(COLUMNS*r + c) +: 12]"
fault "banks share a drive code" tile ".load_code(cmd_code_i)" ".load_code(cmd_code_e)"

# --- reading ---
fault "slices in reverse" tile "assign slice_shift = front_slice" "assign slice_shift = (slices - 32'd1 - front_slice)"
fault "a slice has all bits above it" tile "assign slice_mask = (8'd1 << dac_bits) - 8'd1" "assign slice_mask = 8'hff"
fault "rows that are not in use are read" bank "if (slot == s && rows > r)" "if (slot == s)"
fault "digital converter truncates" bank \
    "steps = rsh(64'(\$signed(hold[32*c +: 32])), adc_shift)" "steps = 64'(\$signed(hold[32*c +: 32])) >>> adc_shift"
fault "current converter truncates" tile "rounded = rsh(difference, adc_shift)" "rounded = difference >>> adc_shift"
fault "digital converter does not saturate" bank "= clipped[c] ? adc_code_max : 32'(steps)" "= 32'(steps)"
fault "current converter does not saturate" tile "difference = clamp(rounded, least, most)" "difference = rounded"
fault "current converter is symmetric" tile "assign least = -most - 64'sd1" "assign least = -most"
fault "first slice adds to what was there" tile \
    "(conv_slice == 32'd0 ? 32'd0 : acc[32*c +: 32])" "acc[32*c +: 32]"
fault "codes lose the weight of their slice" tile "assign code_shift = conv_slice * dac_bits +" "assign code_shift ="
fault "codes lose the weight of a step" tile "(adc == IDEAL ? 32'd0 : 32'(adc_shift))" "32'd0"
fault "lane group off by one" tile "group_of[32*c +: 32] == lane_group" "group_of[32*c +: 32] == lane_group + 32'd1"
fault "index truncates" tile \
    ": rsh(distance, lut_shift)" ": distance >>> lut_shift"
fault "thresholds ignored" tile " - rsh(64'(\$signed(threshold[40*c +: 40])), 6'd8)" ""
fault "thresholds truncate" tile \
    "rsh(64'(\$signed(threshold[40*c +: 40])), 6'd8)" "(64'(\$signed(threshold[40*c +: 40])) >>> 8)"
fault "thresholds have no sign" tile "64'(\$signed(threshold[40*c +: 40]))" "64'(threshold[40*c +: 40])"
fault "one threshold for all" tile "threshold[40*c +: 40])), 6'd8)" "threshold[39:0])), 6'd8)"
fault "thresholds lose their fraction" tile "+: 40])), 6'd8)" "+: 40])), 6'd0)"
fault "steps below one count as one" tile "distance <<< (6'd0 - lut_shift)" "distance"
fault "the sign of a shift is ignored" tile "lut_shift[5] ? distance <<< (6'd0 - lut_shift) : rsh" "rsh"
fault "index is symmetric" tile "held = clamp(index, -half, half - 64'sd1)" "held = clamp(index, 64'sd1 - half, half - 64'sd1)"
fault "halves go down" tile ">> 1)) >>> s;" ">> 1) - (s == 6'd0 ? 64'sd0 : 64'sd1)) >>> s;"

# --- errors and gates ---
fault "tap of the next column" tile \
    "word = tap_base;" "word = tap_base + 32'd1 == words ? 32'd0 : tap_base + 32'd1;"
fault "tap base ignored" tile "word = tap_base;" "word = 32'd0;"
fault "unused columns latch words" tile "if (bus_active && used[c] && word_of" "if (bus_active && word_of"
fault "negated after the product" tile \
    "= negate ? -bus_word : bus_word" "= bus_word" "8'(sat_8)" "8'(negate ? -sat_8 : sat_8)"
fault "gate does not saturate" tile "sat_8 = clamp(raised, -64'sd127, 64'sd127)" "sat_8 = raised"
fault "gate reaches -128" tile "clamp(raised, -64'sd127" "clamp(raised, -64'sd128"
fault "gates of one slot for all" tile "if (err_slot == s && multiply_columns[c])" "if (s == 0 && multiply_columns[c])"
fault "slope of the wrong slot" tile "if (err_slot == s) err_slope" "if (lane_slot == s) err_slope"
fault "update with gates of the last error" tile "if (upd_slot == s) upd_gate" "if (err_slot == s) upd_gate"

# --- writing ---
fault "inhibition learns like excitation" bank "if (INHIBITS) product = -product;" ""
fault "mantissa ignored" bank "stochastic(wanted * \$signed(64'(mantissa))," "stochastic(wanted,"
fault "dither ignored" bank "(q + \$signed(below)) >>> bits" "q >>> bits"
fault "dither bits shifted" bank "below = 64'(draw)" "below = 64'(draw >> 1)"
fault "both banks take the same draws" tile ".dither(dither_i)" ".dither(dither_e)"
fault "no dither truncates" bank "bits == 6'd0 ? rsh(t, k)" "bits == 6'd0 ? t >>> k"
fault "shift off by one" bank "? rsh(t, k - bits)" "? rsh(t, k - bits + 6'd1)"
fault "small shifts count for the dither's width" bank "t <<< (bits - k)" "t"
fault "bound one less" bank "most = \$signed(64'(increment_max))" "most = \$signed(64'(increment_max)) - 64'sd1"
fault "bound above only" bank "wanted < -most ? -most : wanted" "wanted"
fault "sums not cleared" bank "if (from_sums) sum_next[32*c +: 32] = 32'd0;" ""
fault "sums cleared by UPD now" bank "if (from_sums) sum_next[32*c +: 32] = 32'd0;" "sum_next[32*c +: 32] = 32'd0;"
fault "a pulse too many" bank "pulses > \$signed(pulse_number)" "pulses >= \$signed(pulse_number)"
fault "floor off by one" bank "found > floor)" "found > floor + 12'd1)"
fault "ceiling off by one" bank "found < ceiling" "found <= ceiling"
fault "pruned cell lifted" bank "moved[c] = pulsed[c] && !row_pruned[c] &&" "moved[c] = pulsed[c] &&"
fault "absorbed without a pulse" bank "&& pulses != 32'sd0 && found == floor" "&& found == floor"
fault "every floor absorbs" bank "if (turn && absorbing &&" "if (turn &&"
fault "absorbed by SET only" bank "&& pulses != 32'sd0 && found" "&& pulses < 32'sd0 && found"

# --- counters ---
fault "row pulses counted once a row" tile "= 32'(pulse_end)" "= 32'(pulses_end)"
fault "bus words counted while hopping" tile "= 32'(bus_active)" "= 32'(err_busy)"
fault "unbounded cells counted as bounded" bank "ones(is_bounded)" "ones(is_requested)"
fault "attempts that move nothing not counted" bank "ones(pulsed)" "ones(moved)"
fault "currents converted twice" tile ".convert_here(adc != CURRENT)" ".convert_here(1'b1)"
fault "UPD write accumulates" bank "compute && !from_sums ? columns" "compute ? columns"
fault "reads forget rows" bank "sample ? rows * columns" "sample ? columns"
fault "a rail that is reached saturates" bank "clipped[c] = steps > " "clipped[c] = steps >= "

wait
status=0 caught=0
for ((i = 0; i < planted; i++)); do
    name="$(<"$work/$i/name")" verdict="$(<"$work/$i/verdict")"
    if [[ $name == none,* ]]; then
        [[ $verdict == MISSED ]] && verdict="agrees" || status=1
    elif [[ $verdict == caught* ]]; then
        caught=$((caught + 1))
    else
        status=1
    fi
    printf '%-44s %s\n' "$name" "$verdict"
done
printf '%s faults caught, %s runs\n' "$caught" "$planted"
exit $status
