// The tile: a crossbar of unsigned cells in two banks, with its converters and lanes, that learns in place.
//
//   read     acc[c]   = sum over slices of (code_e[c] - code_i[c]) << (ash + slice * dac_bits)
//   look up  i        = clamp(rsh(acc - rsh(T[c], 8), lsh), -2^(lut_bits-1), 2^(lut_bits-1) - 1),  a = value(i), a' = slope(i)
//   gate     u[c]     = sat_8(rsh(error[c] * a'[c], error_bits))
//   learn    level   += clamp(SR(+-drive * u * mantissa, k), +-increment_max) pulses, inside floor .. ceiling
//
// rsh(v, s) = (v + 2^(s-1)) >> s, halves toward +infinity, and v << -s where s is below 0; sat_8 is symmetric. Every register, command, counter
// and cycle is that of docs/TILE.md; register names are those of its table. The schedule is static: no part ever waits
// for another, and data enter it only as the pulses of a row. There is no divider: which converter step, lane group and
// bus word a column belongs to follows from the configuration through a chain of counters along the columns.
//
// The cells, their drivers and their pulses are in ed_bank.sv, once for each bank. Counts and times have 32 bits.
`default_nettype none

module ed_tile #(
    parameter int ROWS     = 8,
    parameter int COLUMNS  = 8,
    parameter int SLOTS    = 4,
    parameter int LUT_BITS = 6,
    parameter int TREE_MAX = 4
) (
    input wire logic                     clock,
    input wire logic                     reset,
    // Configuration: register number `config_address` in the order of docs/TILE.md. Heard only while idle.
    input wire logic                     config_write,
    input wire logic [4:0]               config_address,
    input wire logic [31:0]              config_value,
    // Look-up table: entry i + 2^(lut_bits-1) belongs to index i. Heard only while idle.
    input wire logic                     lut_write,
    input wire logic [LUT_BITS-1:0]      lut_address,
    input wire logic [7:0]               lut_value,
    input wire logic [7:0]               lut_slope,
    // Thresholds, with 8 fractional bits. Heard only while idle.
    input wire logic                     threshold_write,
    input wire logic [31:0]              threshold_address,
    input wire logic [39:0]              threshold_value,
    // Commands.
    input wire logic                     cmd_valid,
    output logic                         cmd_ready,
    input wire logic [2:0]               cmd_op,
    input wire logic [31:0]              cmd_row,
    input wire logic [31:0]              cmd_slot,
    input wire logic [5:0]               cmd_shift,
    input wire logic [12*COLUMNS-1:0]    cmd_level_e,
    input wire logic [12*COLUMNS-1:0]    cmd_level_i,
    input wire logic [7:0]               cmd_code_e,
    input wire logic [7:0]               cmd_code_i,
    // Error bus: the word that arrives in this cycle, and its number.
    input wire logic signed [8:0]        bus_word,
    output logic [31:0]                  bus_index,
    // Dither: the draws of a row, taken in the cycle in which they are wanted.
    input wire logic [16*COLUMNS-1:0]    dither_e,
    input wire logic [16*COLUMNS-1:0]    dither_i,
    output logic [31:0]                  dither_row,
    output logic                         dither_wanted,
    // Activities of a slot, for whoever drives the next layer.
    input wire logic [31:0]              read_slot,
    output logic [8*COLUMNS-1:0]         read_value
);
    localparam logic [2:0] LOADW = 3'd0, LOADX = 3'd1, FWD = 3'd2, ERR = 3'd3, NOW = 3'd4, ADD = 3'd5, WRITE = 3'd6;
    localparam logic [1:0] KIND_NOW = 2'd0, KIND_ADD = 2'd1, KIND_WRITE = 2'd2;
    localparam logic [1:0] COMPUTE = 2'd0, SET = 2'd1, RESET = 2'd2, TURN = 2'd3;
    localparam logic [1:0] IDEAL = 2'd0, DIGITAL = 2'd1, CURRENT = 2'd2;

    function automatic logic signed [63:0] rsh(input logic signed [63:0] v, input logic [5:0] s);
        rsh = (v + $signed((64'd1 << s) >> 1)) >>> s;
    endfunction

    function automatic logic signed [63:0] clamp(
        input logic signed [63:0] v, input logic signed [63:0] least, input logic signed [63:0] most
    );
        clamp = v < least ? least : v > most ? most : v;
    endfunction

    function automatic logic [31:0] ones(input logic [COLUMNS-1:0] mask);
        ones = 32'd0;
        for (int c = 0; c < COLUMNS; c++) ones = ones + 32'(mask[c]);
    endfunction

    // --- configuration: undefined until written; a reset leaves it, and the table, as they are ---

    logic [31:0] rows, columns, settle, convert, share, slices, dac_bits, tree_stages, lanes, hops, words, tap_base;
    logic [31:0] pulse, increment_max;
    logic [5:0]  adc_bits, adc_shift, lut_bits, lut_shift, error_bits, mantissa, dither_bits;
    logic [11:0] floor, ceiling;
    logic [1:0]  adc;
    logic        overlap, negate, absorbing;
    logic        idle;

    always_ff @(posedge clock) begin : configuration
        if (config_write && idle)
            case (config_address)
                5'd0:  rows          <= config_value;
                5'd1:  columns       <= config_value;
                5'd2:  settle        <= config_value;
                5'd3:  convert       <= config_value;
                5'd4:  share         <= config_value;
                5'd5:  overlap       <= config_value[0];
                5'd6:  slices        <= config_value;
                5'd7:  dac_bits      <= config_value;
                5'd8:  tree_stages   <= config_value;
                5'd9:  lanes         <= config_value;
                5'd10: hops          <= config_value;
                5'd11: words         <= config_value;
                5'd12: tap_base      <= config_value;
                5'd13: pulse         <= config_value;
                5'd14: adc           <= config_value[1:0];
                5'd15: adc_bits      <= config_value[5:0];
                5'd16: adc_shift     <= config_value[5:0];
                5'd17: lut_bits      <= config_value[5:0];
                5'd18: lut_shift     <= config_value[5:0];
                5'd19: error_bits    <= config_value[5:0];
                5'd20: negate        <= config_value[0];
                5'd21: mantissa      <= config_value[5:0];
                5'd22: dither_bits   <= config_value[5:0];
                5'd23: increment_max <= config_value;
                5'd24: floor         <= config_value[11:0];
                5'd25: ceiling       <= config_value[11:0];
                5'd26: absorbing     <= config_value[0];
                default: ;
            endcase
    end

    // Which converter step, bus word and lane group a column belongs to.
    logic [32*COLUMNS-1:0] step_of, word_of, group_of;
    logic [COLUMNS-1:0] used;
    logic [31:0] step, word, group, lane, groups;

    always_comb begin : chain
        step = 32'd0;
        word = tap_base;
        group = 32'd0;
        lane = 32'd0;
        groups = 32'd0;
        used = '0;
        step_of = '0;
        word_of = '0;
        group_of = '0;
        for (int c = 0; c < COLUMNS; c++) begin
            used[c] = columns > c;
            if (columns > c) groups = group + 32'd1;
            step_of[32*c +: 32] = step;
            word_of[32*c +: 32] = word;
            group_of[32*c +: 32] = group;
            step = step + 32'd1 == share ? 32'd0 : step + 32'd1;
            word = word + 32'd1 == words ? 32'd0 : word + 32'd1;
            group = lane + 32'd1 == lanes ? group + 32'd1 : group;
            lane = lane + 32'd1 == lanes ? 32'd0 : lane + 32'd1;
        end
    end

    // The static period of a slice, and how much longer the lanes need than the front end.
    logic [31:0] conversion, period, front_cycles, slack;

    assign conversion = share * convert;
    assign period = !overlap ? settle + conversion : settle > conversion ? settle : conversion;
    assign front_cycles = slices * period;
    assign slack = groups > front_cycles ? groups - front_cycles : 32'd0;

    // --- registers of the parts, as the other parts see them ---

    logic        front_busy, conv_busy, lane_busy, err_busy, upd_busy;
    logic [31:0] front_slice, front_phase, front_slot;
    logic [31:0] conv_slice, conv_step, conv_count, conv_slot;
    logic [31:0] lane_group, lane_slot;
    logic [31:0] err_count, err_slot;
    logic [1:0]  upd_kind, upd_phase;
    logic [31:0] upd_row, upd_group, upd_pulse, upd_count, upd_slot;
    logic [5:0]  upd_shift;
    logic [TREE_MAX-1:0] tree_valid;
    logic [32*TREE_MAX-1:0]         tree_slot;
    logic [32*TREE_MAX*COLUMNS-1:0] tree;
    logic [32*COLUMNS-1:0]          acc, out;
    logic [8*SLOTS*COLUMNS-1:0]     value, slope, gate;
    logic [9*COLUMNS-1:0]           error;
    logic [32*6-1:0]                events;
    logic [6:0]  peak_set, peak_reset;

    // --- commands ---

    logic accept, accept_forward, accept_error, accept_update;

    assign idle = !(front_busy || conv_busy || tree_valid != '0 || lane_busy || err_busy || upd_busy);
    assign cmd_ready = cmd_op == FWD ? !(front_busy || err_busy || upd_busy) : cmd_op <= WRITE && idle;
    assign accept = cmd_valid && cmd_ready;
    assign accept_forward = accept && cmd_op == FWD;
    assign accept_error = accept && cmd_op == ERR;
    assign accept_update = accept && (cmd_op == NOW || cmd_op == ADD || cmd_op == WRITE);

    // --- front end: a slice settles on the row lines, is sampled, and keeps its period ---

    logic in_slice, slice_start, sample, slice_end, last_slice, slack_end;

    assign in_slice = front_busy && front_slice < slices;
    assign slice_start = in_slice && front_phase == 32'd0;
    assign sample = in_slice && front_phase == settle - 32'd1;
    assign slice_end = in_slice && front_phase == period - 32'd1;
    assign last_slice = front_slice == slices - 32'd1;
    assign slack_end = front_busy && !in_slice && front_phase == slack - 32'd1;

    always_ff @(posedge clock) begin : front_end
        if (reset) begin
            front_busy <= 1'b0;
            front_slice <= 32'd0;
            front_phase <= 32'd0;
            front_slot <= 32'd0;
        end else if (accept_forward) begin
            front_busy <= 1'b1;
            front_slot <= cmd_slot;
        end else if (slack_end || slice_end && last_slice && slack == 32'd0) begin
            front_busy <= 1'b0;
            front_slice <= 32'd0;
            front_phase <= 32'd0;
        end else if (slice_end) begin
            front_slice <= front_slice + 32'd1;
            front_phase <= 32'd0;
        end else if (front_busy) front_phase <= front_phase + 32'd1;
    end

    // --- converters: one step takes the columns of one place in the share, then the accumulators add ---

    logic step_end, convert_end, sample_end;
    logic [31:0] code_shift;
    logic [COLUMNS-1:0] step_columns, current_clipped;
    logic [32*COLUMNS-1:0] code_e, code_i, acc_next;
    logic signed [63:0] difference, rounded, least, most;

    assign step_end = conv_busy && conv_count == convert - 32'd1;
    assign convert_end = step_end && conv_step == share - 32'd1;
    assign sample_end = convert_end && conv_slice == slices - 32'd1;
    assign code_shift = conv_slice * dac_bits + (adc == IDEAL ? 32'd0 : 32'(adc_shift));
    assign most = $signed(64'd1 << (adc_bits - 6'd1)) - 64'sd1;
    assign least = -most - 64'sd1;

    always_comb begin : accumulate
        acc_next = acc;
        step_columns = '0;
        current_clipped = '0;
        difference = 64'sd0;
        rounded = 64'sd0;
        for (int c = 0; c < COLUMNS; c++)
            if (step_end && used[c] && step_of[32*c +: 32] == conv_step) begin
                step_columns[c] = 1'b1;
                difference = 64'($signed(code_e[32*c +: 32])) - 64'($signed(code_i[32*c +: 32]));
                if (adc == CURRENT) begin // one converter, after the currents are subtracted
                    rounded = rsh(difference, adc_shift);
                    difference = clamp(rounded, least, most);
                    current_clipped[c] = difference != rounded;
                end
                acc_next[32*c +: 32] = (conv_slice == 32'd0 ? 32'd0 : acc[32*c +: 32]) + 32'(difference <<< code_shift);
            end
    end

    always_ff @(posedge clock) begin : converters
        acc <= reset ? '0 : acc_next;
        if (reset) begin
            conv_busy <= 1'b0;
            conv_slice <= 32'd0;
            conv_step <= 32'd0;
            conv_count <= 32'd0;
            conv_slot <= 32'd0;
        end else if (sample) begin
            conv_busy <= 1'b1;
            conv_slice <= front_slice;
            conv_slot <= front_slot;
            conv_step <= 32'd0;
            conv_count <= 32'd0;
        end else if (step_end) begin
            conv_busy <= !convert_end;
            conv_step <= convert_end ? 32'd0 : conv_step + 32'd1;
            conv_count <= 32'd0;
        end else if (conv_busy) conv_count <= conv_count + 32'd1;
    end

    // --- adder tree, as a delay: a sample moves one stage a cycle ---

    logic enters_tree, arrives;
    logic [31:0] arrives_slot;
    logic [32*COLUMNS-1:0] arriving;

    assign enters_tree = sample_end && tree_stages != 32'd0;

    always_comb begin : tree_output
        arrives = sample_end && tree_stages == 32'd0;
        arrives_slot = conv_slot;
        arriving = acc_next;
        for (int s = 0; s < TREE_MAX; s++)
            if (tree_stages == s + 1) begin
                arrives = tree_valid[s];
                arrives_slot = tree_slot[32*s +: 32];
                arriving = tree[32*COLUMNS*s +: 32*COLUMNS];
            end
    end

    always_ff @(posedge clock) begin : adder_tree
        if (reset) begin
            tree_valid <= '0;
            tree_slot <= '0;
            tree <= '0;
        end else begin
            tree_valid[0] <= enters_tree;
            if (enters_tree) begin
                tree_slot[31:0] <= conv_slot;
                tree[32*COLUMNS-1:0] <= acc_next;
            end
            for (int s = 1; s < TREE_MAX; s++) begin
                tree_valid[s] <= tree_valid[s-1] && tree_stages > s;
                if (tree_valid[s-1] && tree_stages > s) begin
                    tree_slot[32*s +: 32] <= tree_slot[32*(s-1) +: 32];
                    tree[32*COLUMNS*s +: 32*COLUMNS] <= tree[32*COLUMNS*(s-1) +: 32*COLUMNS];
                end
            end
        end
    end

    // --- look-up lanes: a group of columns a cycle ---

    logic [40*COLUMNS-1:0] threshold;
    logic [7:0] lut_values [0:2**LUT_BITS-1];
    logic [7:0] lut_slopes [0:2**LUT_BITS-1];
    logic lanes_end;
    logic [COLUMNS-1:0] look_columns, look_clipped;
    logic [8*COLUMNS-1:0] look_values, look_slopes;
    logic signed [63:0] half, distance, index, held;

    assign lanes_end = lane_group == groups - 32'd1;
    assign half = $signed(64'd1 << (lut_bits - 6'd1));

    always_comb begin : look_up
        look_columns = '0;
        look_clipped = '0;
        look_values = '0;
        look_slopes = '0;
        distance = 64'sd0;
        index = 64'sd0;
        held = 64'sd0;
        for (int c = 0; c < COLUMNS; c++)
            if (lane_busy && used[c] && group_of[32*c +: 32] == lane_group) begin
                distance = 64'($signed(out[32*c +: 32])) - rsh(64'($signed(threshold[40*c +: 40])), 6'd8);
                // a shift of six bits with a sign
                index = lut_shift[5] ? distance <<< (6'd0 - lut_shift) : rsh(distance, lut_shift);
                held = clamp(index, -half, half - 64'sd1);
                look_columns[c] = 1'b1;
                look_clipped[c] = index != held;
                look_values[8*c +: 8] = lut_values[LUT_BITS'(held + half)];
                look_slopes[8*c +: 8] = lut_slopes[LUT_BITS'(held + half)];
            end
    end

    always_ff @(posedge clock) begin : look_up_table
        if (lut_write && idle) begin
            lut_values[lut_address] <= lut_value;
            lut_slopes[lut_address] <= lut_slope;
        end
    end

    always_ff @(posedge clock) begin : thresholds
        if (threshold_write && idle)
            for (int c = 0; c < COLUMNS; c++)
                if (threshold_address == c) threshold[40*c +: 40] <= threshold_value;
    end

    always_ff @(posedge clock) begin : look_up_lanes
        if (reset) begin
            lane_busy <= 1'b0;
            lane_group <= 32'd0;
            lane_slot <= 32'd0;
            out <= '0;
        end else if (arrives) begin
            lane_busy <= 1'b1;
            lane_group <= 32'd0;
            lane_slot <= arrives_slot;
            out <= arriving;
        end else if (lane_busy) begin
            lane_busy <= !lanes_end;
            lane_group <= lanes_end ? 32'd0 : lane_group + 32'd1;
        end
    end

    always_ff @(posedge clock) begin : activities
        if (reset) begin
            value <= '0;
            slope <= '0;
        end else if (lane_busy)
            for (int s = 0; s < SLOTS; s++)
                for (int c = 0; c < COLUMNS; c++)
                    if (lane_slot == s && look_columns[c]) begin
                        value[8*(COLUMNS*s + c) +: 8] <= look_values[8*c +: 8];
                        slope[8*(COLUMNS*s + c) +: 8] <= look_slopes[8*c +: 8];
                    end
    end

    always_comb begin : read_out
        read_value = '0;
        for (int s = 0; s < SLOTS; s++)
            if (read_slot == s) read_value = value[8*COLUMNS*s +: 8*COLUMNS];
    end

    // --- error bus and multipliers: words pass, columns latch theirs by a static tap, then error times slope ---

    logic bus_active, multiply, err_end;
    logic [31:0] err_group;
    logic [COLUMNS-1:0] multiply_columns, gate_clipped;
    logic [9*COLUMNS-1:0] error_next;
    logic [8*COLUMNS-1:0] err_slope, gate_next;
    logic signed [63:0] raised, sat_8;

    assign bus_active = err_busy && err_count >= hops && err_count < hops + words;
    assign bus_index = bus_active ? err_count - hops : 32'd0;
    assign multiply = err_busy && err_count >= hops + words;
    assign err_group = err_count - hops - words;
    assign err_end = multiply && err_group == groups - 32'd1;

    always_comb begin : taps
        error_next = error;
        for (int c = 0; c < COLUMNS; c++)
            if (bus_active && used[c] && word_of[32*c +: 32] == bus_index)
                error_next[9*c +: 9] = negate ? -bus_word : bus_word;
    end

    always_comb begin : multipliers
        gate_next = '0;
        multiply_columns = '0;
        gate_clipped = '0;
        raised = 64'sd0;
        sat_8 = 64'sd0;
        err_slope = '0;
        for (int s = 0; s < SLOTS; s++)
            if (err_slot == s) err_slope = slope[8*COLUMNS*s +: 8*COLUMNS];
        for (int c = 0; c < COLUMNS; c++)
            if (multiply && used[c] && group_of[32*c +: 32] == err_group) begin
                raised = rsh(64'($signed(error[9*c +: 9])) * $signed(64'(err_slope[8*c +: 8])), error_bits);
                sat_8 = clamp(raised, -64'sd127, 64'sd127);
                multiply_columns[c] = 1'b1;
                gate_clipped[c] = raised != sat_8;
                gate_next[8*c +: 8] = 8'(sat_8);
            end
    end

    always_ff @(posedge clock) begin : error_unit
        error <= reset ? '0 : error_next;
        if (reset) begin
            err_busy <= 1'b0;
            err_count <= 32'd0;
            err_slot <= 32'd0;
        end else if (accept_error) begin
            err_busy <= 1'b1;
            err_slot <= cmd_slot;
        end else if (err_busy) begin
            err_busy <= !err_end;
            err_count <= err_end ? 32'd0 : err_count + 32'd1;
        end
    end

    always_ff @(posedge clock) begin : gates
        if (reset) gate <= '0;
        else if (multiply)
            for (int s = 0; s < SLOTS; s++)
                for (int c = 0; c < COLUMNS; c++)
                    if (err_slot == s && multiply_columns[c])
                        gate[8*(COLUMNS*s + c) +: 8] <= gate_next[8*c +: 8];
    end

    // --- update: row by row, either sums or pulses: SET, then RESET, then a cycle to turn the row around ---

    logic upd_add, upd_compute, upd_turn, pulse_end, pulses_end, last_row;
    logic [COLUMNS-1:0] add_columns;
    logic [8*COLUMNS-1:0] upd_gate;
    logic [6:0] set_e, set_i, reset_e, reset_i, set_most, reset_most;

    assign upd_add = upd_busy && upd_kind == KIND_ADD;
    assign upd_compute = upd_busy && !upd_add && upd_phase == COMPUTE;
    assign upd_turn = upd_busy && upd_phase == TURN;
    assign pulse_end = upd_busy && (upd_phase == SET || upd_phase == RESET) && upd_count == pulse - 32'd1;
    assign pulses_end = pulse_end && upd_pulse + 32'd1 == (upd_phase == SET ? 32'(peak_set) : 32'(peak_reset));
    assign last_row = upd_row == rows - 32'd1;
    assign set_most = set_e > set_i ? set_e : set_i;
    assign reset_most = reset_e > reset_i ? reset_e : reset_i;
    assign dither_row = upd_row;
    assign dither_wanted = upd_compute;

    always_comb begin : select_slot
        upd_gate = '0;
        for (int s = 0; s < SLOTS; s++)
            if (upd_slot == s) upd_gate = gate[8*COLUMNS*s +: 8*COLUMNS];
    end

    always_comb begin : add_group
        for (int c = 0; c < COLUMNS; c++) add_columns[c] = upd_add && used[c] && group_of[32*c +: 32] == upd_group;
    end

    always_ff @(posedge clock) begin : update
        if (reset) begin
            upd_busy <= 1'b0;
            upd_kind <= 2'd0;
            upd_row <= 32'd0;
            upd_group <= 32'd0;
            upd_phase <= COMPUTE;
            upd_pulse <= 32'd0;
            upd_count <= 32'd0;
            upd_slot <= 32'd0;
            upd_shift <= 6'd0;
            peak_set <= 7'd0;
            peak_reset <= 7'd0;
        end else if (accept_update) begin
            upd_busy <= 1'b1;
            upd_kind <= cmd_op == NOW ? KIND_NOW : cmd_op == ADD ? KIND_ADD : KIND_WRITE;
            upd_slot <= cmd_op == WRITE ? 32'd0 : cmd_slot; // a command leaves 0 where it has no field
            upd_shift <= cmd_op == ADD ? 6'd0 : cmd_shift;
        end else if (upd_add) begin
            upd_group <= upd_group == groups - 32'd1 ? 32'd0 : upd_group + 32'd1;
            if (upd_group == groups - 32'd1) begin
                upd_row <= last_row ? 32'd0 : upd_row + 32'd1;
                upd_busy <= !last_row;
            end
        end else if (upd_compute) begin
            peak_set <= set_most;
            peak_reset <= reset_most;
            upd_phase <= set_most != 7'd0 ? SET : reset_most != 7'd0 ? RESET : TURN;
        end else if (upd_turn) begin
            upd_phase <= COMPUTE;
            upd_row <= last_row ? 32'd0 : upd_row + 32'd1;
            upd_busy <= !last_row;
        end else if (upd_busy) begin
            upd_count <= pulse_end ? 32'd0 : upd_count + 32'd1;
            if (pulses_end) begin
                upd_pulse <= 32'd0;
                upd_phase <= upd_phase == SET && peak_reset != 7'd0 ? RESET : TURN;
            end else if (pulse_end) upd_pulse <= upd_pulse + 32'd1;
        end
    end

    // --- the two banks: alike but for the sign with which they learn ---

    logic [31:0] slice_shift, adc_code_max;
    logic [7:0] slice_mask;

    assign slice_shift = front_slice * dac_bits;
    assign slice_mask = (8'd1 << dac_bits) - 8'd1;
    assign adc_code_max = (32'd1 << adc_bits) - 32'd1;

    ed_bank #(.ROWS(ROWS), .COLUMNS(COLUMNS), .SLOTS(SLOTS), .INHIBITS(1'b0)) bank_e (
        .clock(clock), .reset(reset), .rows(rows), .columns(columns), .used(used),
        .load_levels(accept && cmd_op == LOADW), .load_drive(accept && cmd_op == LOADX), .load_row(cmd_row),
        .load_slot(cmd_slot), .load_level(cmd_level_e), .load_code(cmd_code_e),
        .slice_start(slice_start), .sample(sample), .slot(front_slot), .slice_shift(slice_shift),
        .slice_mask(slice_mask), .convert(step_end), .convert_here(1'b1), .step_columns(step_columns),
        .digital(adc == DIGITAL), .adc_shift(adc_shift), .adc_code_max(adc_code_max),
        .clipped_outside(current_clipped), .code(code_e), .add(upd_add), .group_columns(add_columns),
        .compute(upd_compute), .from_sums(upd_kind == KIND_WRITE), .update_row(upd_row), .update_slot(upd_slot),
        .update_shift(upd_shift), .gate(upd_gate), .mantissa(mantissa), .dither_bits(dither_bits), .dither(dither_e),
        .increment_max(increment_max), .peak_set(set_e), .peak_reset(reset_e), .pulse_end(pulse_end),
        .upward(upd_phase == SET), .pulse_number(upd_pulse), .turn(upd_turn), .absorbing(absorbing), .floor(floor),
        .ceiling(ceiling));

    ed_bank #(.ROWS(ROWS), .COLUMNS(COLUMNS), .SLOTS(SLOTS), .INHIBITS(1'b1)) bank_i (
        .clock(clock), .reset(reset), .rows(rows), .columns(columns), .used(used),
        .load_levels(accept && cmd_op == LOADW), .load_drive(accept && cmd_op == LOADX), .load_row(cmd_row),
        .load_slot(cmd_slot), .load_level(cmd_level_i), .load_code(cmd_code_i),
        .slice_start(slice_start), .sample(sample), .slot(front_slot), .slice_shift(slice_shift),
        .slice_mask(slice_mask), .convert(step_end), .convert_here(adc != CURRENT), .step_columns(step_columns),
        .digital(adc == DIGITAL), .adc_shift(adc_shift), .adc_code_max(adc_code_max),
        .clipped_outside({COLUMNS{1'b0}}), .code(code_i), .add(upd_add), .group_columns(add_columns),
        .compute(upd_compute), .from_sums(upd_kind == KIND_WRITE), .update_row(upd_row), .update_slot(upd_slot),
        .update_shift(upd_shift), .gate(upd_gate), .mantissa(mantissa), .dither_bits(dither_bits), .dither(dither_i),
        .increment_max(increment_max), .peak_set(set_i), .peak_reset(reset_i), .pulse_end(pulse_end),
        .upward(upd_phase == SET), .pulse_number(upd_pulse), .turn(upd_turn), .absorbing(absorbing), .floor(floor),
        .ceiling(ceiling));

    // --- counters that belong to no bank ---

    logic [32*6-1:0] happened;

    assign happened[32*0 +: 32] = ones(look_columns);
    assign happened[32*1 +: 32] = ones(look_clipped);
    assign happened[32*2 +: 32] = 32'(bus_active);
    assign happened[32*3 +: 32] = ones(multiply_columns);
    assign happened[32*4 +: 32] = ones(gate_clipped);
    assign happened[32*5 +: 32] = 32'(pulse_end);

    always_ff @(posedge clock) begin : counters
        for (int n = 0; n < 6; n++)
            events[32*n +: 32] <= reset ? 32'd0 : events[32*n +: 32] + happened[32*n +: 32];
    end
endmodule

`default_nettype wire
