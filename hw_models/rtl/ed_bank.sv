// One bank of a tile: unsigned cells, their row drivers, sample-and-holds, digital sums and programming pulses.
//
//   current      I[c] = sum over rows of level[r][c] * x_s[r],   x_s = bits of the drive code of slice s
//   code         adc 1: min(rsh(I, ash), 2^bits - 1);   otherwise the current itself (the tile subtracts it)
//   sum          sum[r][c] += +-drive[r] * gate[c]                    + in the exciting bank, - in the inhibiting one
//   pulses       clamp(SR(t * mantissa, k), -increment_max, increment_max)
//   cells        one level a pulse, inside floor .. ceiling; an absorbing floor keeps what lies on it after a write
//
// rsh(v, s) = (v + 2^(s-1)) >> s, halves toward +infinity. A cell has no sign: polarity belongs to the bank.
// Registers and cycles: docs/TILE.md. Time, choice of row, slot and phase come from ed_tile.sv.
`default_nettype none

module ed_bank #(
    parameter int ROWS     = 8,
    parameter int COLUMNS  = 8,
    parameter int SLOTS    = 4,
    parameter bit INHIBITS = 0
) (
    input wire logic                       clock,
    input wire logic                       reset,
    // What is in use, and how many.
    input wire logic [31:0]                rows,
    input wire logic [31:0]                columns,
    input wire logic [COLUMNS-1:0]         used,
    // Loading levels of a row, or the drive code of a row.
    input wire logic                       load_levels,
    input wire logic                       load_drive,
    input wire logic [31:0]                load_row,
    input wire logic [31:0]                load_slot,
    input wire logic [12*COLUMNS-1:0]      load_level,
    input wire logic [7:0]                 load_code,
    // Reading: one slice of the drive codes of a slot.
    input wire logic                       slice_start,
    input wire logic                       sample,
    input wire logic [31:0]                slot,
    input wire logic [31:0]                slice_shift,
    input wire logic [7:0]                 slice_mask,
    // Converting: the columns of one step. `convert_here` is 0 where one converter serves both banks from bank e.
    input wire logic                       convert,
    input wire logic                       convert_here,
    input wire logic [COLUMNS-1:0]         step_columns,
    input wire logic                       digital,
    input wire logic [5:0]                 adc_shift,
    input wire logic [31:0]                adc_code_max,
    input wire logic [COLUMNS-1:0]         clipped_outside,
    output logic [32*COLUMNS-1:0]          code,
    // Learning: add a group of columns to the sums of a row, or compute the pulses of a row.
    input wire logic                       add,
    input wire logic [COLUMNS-1:0]         group_columns,
    input wire logic                       compute,
    input wire logic                       from_sums,
    input wire logic [31:0]                update_row,
    input wire logic [31:0]                update_slot,
    input wire logic [5:0]                 update_shift,
    input wire logic [8*COLUMNS-1:0]       gate,
    input wire logic [5:0]                 mantissa,
    input wire logic [5:0]                 dither_bits,
    input wire logic [16*COLUMNS-1:0]      dither,
    input wire logic [31:0]                increment_max,
    output logic [6:0]                     peak_set,
    output logic [6:0]                     peak_reset,
    // Programming: the end of a pulse of the row, and the turn after the last one.
    input wire logic                       pulse_end,
    input wire logic                       upward,
    input wire logic [31:0]                pulse_number,
    input wire logic                       turn,
    input wire logic                       absorbing,
    input wire logic [11:0]                floor,
    input wire logic [11:0]                ceiling
);
    // Flat vectors, the first in the low bits: cell (r, c) is number COLUMNS * r + c, row r of slot s is ROWS * s + r.
    localparam int CELLS = ROWS * COLUMNS;
    localparam int EVENTS = 15;

    logic [12*CELLS-1:0]      level;
    logic [CELLS-1:0]         pruned;
    logic [8*SLOTS*ROWS-1:0]  drive;
    logic [32*COLUMNS-1:0]    hold;
    logic [32*CELLS-1:0]      sum;
    logic [8*COLUMNS-1:0]     pulse;
    logic [32*EVENTS-1:0]     events;

    function automatic logic signed [63:0] rsh(input logic signed [63:0] v, input logic [5:0] s);
        rsh = (v + $signed((64'd1 << s) >> 1)) >>> s;
    endfunction

    // SR(t, k): rounds t / 2^k with `bits` bits of dither below the unit; with none, halves go up.
    function automatic logic signed [63:0] stochastic(
        input logic signed [63:0] t, input logic [5:0] k, input logic [5:0] bits, input logic [15:0] draw
    );
        logic signed [63:0] q;
        logic [63:0] below;
        q = k >= bits ? rsh(t, k - bits) : t <<< (bits - k);
        below = 64'(draw) & ((64'd1 << bits) - 64'd1);
        stochastic = bits == 6'd0 ? rsh(t, k) : (q + $signed(below)) >>> bits;
    endfunction

    function automatic logic [31:0] ones(input logic [COLUMNS-1:0] mask);
        ones = 32'd0;
        for (int c = 0; c < COLUMNS; c++) ones = ones + 32'(mask[c]);
    endfunction

    // --- reading: row drivers apply a slice, a column adds the currents of its cells ---

    logic [8*ROWS-1:0]     applied;
    logic [32*COLUMNS-1:0] current;
    logic [31:0]           column_current;

    always_comb begin : drivers
        applied = '0;
        for (int s = 0; s < SLOTS; s++)
            for (int r = 0; r < ROWS; r++)
                if (slot == s && rows > r)
                    applied[8*r +: 8] = (drive[8*(ROWS*s + r) +: 8] >> slice_shift) & slice_mask;
    end

    always_comb begin : crossbar
        current = hold;
        column_current = 32'd0;
        if (sample)
            for (int c = 0; c < COLUMNS; c++) begin
                column_current = 32'd0;
                for (int r = 0; r < ROWS; r++)
                    column_current = column_current + 32'(level[12*(COLUMNS*r + c) +: 12]) * 32'(applied[8*r +: 8]);
                if (used[c]) current[32*c +: 32] = column_current;
            end
    end

    always_ff @(posedge clock) begin : sample_and_hold
        hold <= reset ? '0 : current;
    end

    // --- converting ---

    logic [COLUMNS-1:0] clipped;
    logic signed [63:0] steps;

    always_comb begin : converters
        code = hold;
        clipped = '0;
        steps = 64'sd0;
        for (int c = 0; c < COLUMNS; c++)
            if (digital) begin
                steps = rsh(64'($signed(hold[32*c +: 32])), adc_shift);
                clipped[c] = steps > $signed(64'(adc_code_max));
                code[32*c +: 32] = clipped[c] ? adc_code_max : 32'(steps);
            end
    end

    // --- the row being updated, as its lines select it ---

    logic [7:0]            row_drive;
    logic [12*COLUMNS-1:0] row_level;
    logic [COLUMNS-1:0]    row_pruned;
    logic [32*COLUMNS-1:0] row_sum;

    always_comb begin : select_row
        row_drive = '0;
        row_level = '0;
        row_pruned = '0;
        row_sum = '0;
        for (int r = 0; r < ROWS; r++)
            if (update_row == r) begin
                row_level = level[12*COLUMNS*r +: 12*COLUMNS];
                row_pruned = pruned[COLUMNS*r +: COLUMNS];
                row_sum = sum[32*COLUMNS*r +: 32*COLUMNS];
                for (int s = 0; s < SLOTS; s++) if (update_slot == s) row_drive = drive[8*(ROWS*s + r) +: 8];
            end
    end

    // --- learning: drive times gate, at once or summed, becomes a bounded number of pulses ---

    logic [32*COLUMNS-1:0] sum_next;
    logic [8*COLUMNS-1:0]  pulse_next;
    logic [COLUMNS-1:0]    is_requested, is_bounded;
    logic signed [63:0]    product, wanted, bounded, most;

    always_comb begin : increments
        sum_next = row_sum;
        pulse_next = pulse;
        is_requested = '0;
        is_bounded = '0;
        peak_set = '0;
        peak_reset = '0;
        product = 64'sd0;
        wanted = 64'sd0;
        bounded = 64'sd0;
        most = $signed(64'(increment_max));
        for (int c = 0; c < COLUMNS; c++) begin
            product = $signed(64'(row_drive)) * 64'($signed(gate[8*c +: 8]));
            if (INHIBITS) product = -product;
            if (add && group_columns[c]) sum_next[32*c +: 32] = row_sum[32*c +: 32] + 32'(product);
            if (compute && used[c]) begin
                wanted = from_sums ? 64'($signed(row_sum[32*c +: 32])) : product;
                wanted = stochastic(wanted * $signed(64'(mantissa)), update_shift, dither_bits, dither[16*c +: 16]);
                bounded = wanted > most ? most : wanted < -most ? -most : wanted;
                is_requested[c] = wanted != 64'sd0;
                is_bounded[c] = wanted != bounded;
                pulse_next[8*c +: 8] = 8'(bounded);
                if (from_sums) sum_next[32*c +: 32] = 32'd0;
                if (bounded > $signed(64'(peak_set))) peak_set = 7'(bounded);
                if (-bounded > $signed(64'(peak_reset))) peak_reset = 7'(-bounded);
            end
        end
    end

    always_ff @(posedge clock) begin : learning
        pulse <= reset ? '0 : pulse_next;
        if (reset) sum <= '0;
        else if (add || compute)
            for (int r = 0; r < ROWS; r++)
                if (update_row == r) sum[32*COLUMNS*r +: 32*COLUMNS] <= sum_next;
    end

    // --- programming: a pulse of the row moves every cell that still has some to come, within its window ---

    logic [12*COLUMNS-1:0] level_next;
    logic [COLUMNS-1:0]    pruned_next, pulsed, moved;
    logic [11:0]           found;
    logic signed [31:0]    pulses;

    always_comb begin : cells
        level_next = row_level;
        pruned_next = row_pruned;
        pulsed = '0;
        moved = '0;
        found = '0;
        pulses = 32'sd0;
        for (int c = 0; c < COLUMNS; c++) begin
            found = row_level[12*c +: 12];
            pulses = 32'($signed(pulse[8*c +: 8]));
            if (!upward) pulses = -pulses;
            pulsed[c] = pulse_end && used[c] && pulses > $signed(pulse_number);
            moved[c] = pulsed[c] && !row_pruned[c] && (upward ? found < ceiling : found > floor);
            if (moved[c]) level_next[12*c +: 12] = upward ? found + 12'd1 : found - 12'd1;
            if (turn && absorbing && used[c] && pulses != 32'sd0 && found == floor) pruned_next[c] = 1'b1;
        end
    end

    always_ff @(posedge clock) begin : crosspoints
        if (reset) begin
            level <= '0;
            pruned <= '0;
        end else begin
            for (int r = 0; r < ROWS; r++) begin
                if (load_levels && load_row == r)
                    for (int c = 0; c < COLUMNS; c++)
                        if (used[c]) level[12*(COLUMNS*r + c) +: 12] <= load_level[12*c +: 12];
                if (pulse_end && update_row == r) level[12*COLUMNS*r +: 12*COLUMNS] <= level_next;
                if (turn && update_row == r) pruned[COLUMNS*r +: COLUMNS] <= pruned_next;
            end
        end
    end

    always_ff @(posedge clock) begin : drive_codes
        if (reset) drive <= '0;
        else if (load_drive)
            for (int s = 0; s < SLOTS; s++)
                for (int r = 0; r < ROWS; r++)
                    if (load_slot == s && load_row == r) drive[8*(ROWS*s + r) +: 8] <= load_code;
    end

    // --- counters, in the order of docs/TILE.md ---

    logic [32*EVENTS-1:0] happened;
    logic [31:0]          converted;

    assign converted = convert && convert_here ? ones(step_columns) : 32'd0;

    always_comb begin : count
        happened = '0;
        happened[32*0 +: 32] = load_levels ? columns : 32'd0;
        happened[32*1 +: 32] = slice_start ? rows : 32'd0;
        happened[32*2 +: 32] = sample ? rows * columns : 32'd0;
        happened[32*3 +: 32] = sample ? columns : 32'd0;
        happened[32*4 +: 32] = converted;
        happened[32*5 +: 32] = converted;
        happened[32*6 +: 32] = add ? ones(group_columns) : compute && !from_sums ? columns : 32'd0;
        happened[32*7 +: 32] = compute ? columns : 32'd0;
        happened[32*8 +: 32] = ones(is_requested);
        happened[32*9 +: 32] = ones(is_bounded);
        happened[32*10 +: 32] = ones(pulsed);
        happened[32*11 +: 32] = ones(moved);
        happened[32*12 +: 32] = convert ? ones(step_columns & (clipped | clipped_outside)) : 32'd0;
    end

    always_ff @(posedge clock) begin : counters
        for (int n = 0; n < EVENTS; n++)
            events[32*n +: 32] <= reset ? 32'd0 : events[32*n +: 32] + happened[32*n +: 32];
    end
endmodule

`default_nettype wire
