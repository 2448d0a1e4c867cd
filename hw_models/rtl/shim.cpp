// The C interface of the verilated tile, for tests/rtl. verilate.sh includes this file after the model, with
// ED_TILE_NAME as the one name that is seen from outside and ED_TILE_MODEL, ED_TILE_ROOT as the model's classes.
//
// A cycle is: inputs, outputs, edge, registers. Registers come as 64-bit numbers in the order of docs/TILE.md,
// section 2: a row of its table after the other, in a row register after register, of a register bank e before i.

#include <cstddef>
#include <cstdint>
#include <string>

namespace {

struct Tile {
    VerilatedContext context;
    ED_TILE_MODEL top{&context};

    void edge() {
        top.clock = 1;
        top.eval();
        top.clock = 0;
        top.eval();
    }
};

struct Inputs {
    uint32_t valid, op, row, slot, shift;
    uint32_t code[2];
    int32_t bus_word;
    const uint16_t* level[2];   // COLUMNS each
    const uint16_t* dither[2];  // COLUMNS each
};

struct Outputs {
    uint32_t ready, bus_index, dither_row, dither_wanted;
};

// Bits lsb .. lsb + width of a signal; width is at most 32.
uint64_t bits(uint64_t signal, int lsb, int width) { return (signal >> lsb) & ((uint64_t{1} << width) - 1); }

template <std::size_t Words>
uint64_t bits(const VlWide<Words>& signal, int lsb, int width) {
    const std::size_t word = lsb / 32;
    const uint64_t above = word + 1 < Words ? signal.at(word + 1) : 0;
    return bits((above << 32) | signal.at(word), lsb % 32, width);
}

// Cuts numbers of `width` bits, at most 16, into a wide input.
template <std::size_t Words>
void put(VlWide<Words>& input, int width, const uint16_t* numbers) {
    uint64_t waiting = 0;
    int held = 0;
    std::size_t word = 0;
    for (int c = 0; c < COLUMNS; c++) {
        waiting |= uint64_t{numbers[c]} << held;
        held += width;
        for (; held >= 32; held -= 32, waiting >>= 32) input.at(word++) = static_cast<uint32_t>(waiting);
    }
    if (held > 0) input.at(word) = static_cast<uint32_t>(waiting);
}

// Calls `visit(name, signal, count, width, is_signed)` for every register.
template <class Visit>
void each_register(const ED_TILE_ROOT& root, Visit&& visit) {
#define TILE(name, count, width, is_signed) visit(#name, root.ed_tile__DOT__##name, count, width, is_signed)
#define BANKS(name, count, width, is_signed)                                                     \
    visit(#name "_e", root.ed_tile__DOT__bank_e__DOT__##name, count, width, is_signed),          \
        visit(#name "_i", root.ed_tile__DOT__bank_i__DOT__##name, count, width, is_signed)
    BANKS(level, ROWS * COLUMNS, 12, false);
    BANKS(pruned, ROWS * COLUMNS, 1, false);
    BANKS(drive, SLOTS * ROWS, 8, false);
    BANKS(hold, COLUMNS, 32, true);
    TILE(acc, COLUMNS, 32, true);
    TILE(tree, TREE_MAX * COLUMNS, 32, true);
    TILE(tree_valid, TREE_MAX, 1, false);
    TILE(tree_slot, TREE_MAX, 32, false);
    TILE(out, COLUMNS, 32, true);
    TILE(value, SLOTS * COLUMNS, 8, false);
    TILE(slope, SLOTS * COLUMNS, 8, false);
    TILE(error, COLUMNS, 9, true);
    TILE(gate, SLOTS * COLUMNS, 8, true);
    BANKS(sum, ROWS * COLUMNS, 32, true);
    BANKS(pulse, COLUMNS, 8, true);
    TILE(peak_set, 1, 7, false);
    TILE(peak_reset, 1, 7, false);
    TILE(front_busy, 1, 1, false);
    TILE(front_slice, 1, 32, false);
    TILE(front_phase, 1, 32, false);
    TILE(front_slot, 1, 32, false);
    TILE(conv_busy, 1, 1, false);
    TILE(conv_slice, 1, 32, false);
    TILE(conv_step, 1, 32, false);
    TILE(conv_count, 1, 32, false);
    TILE(conv_slot, 1, 32, false);
    TILE(lane_busy, 1, 1, false);
    TILE(lane_group, 1, 32, false);
    TILE(lane_slot, 1, 32, false);
    TILE(err_busy, 1, 1, false);
    TILE(err_count, 1, 32, false);
    TILE(err_slot, 1, 32, false);
    TILE(upd_busy, 1, 1, false);
    TILE(upd_kind, 1, 2, false);
    TILE(upd_row, 1, 32, false);
    TILE(upd_group, 1, 32, false);
    TILE(upd_phase, 1, 2, false);
    TILE(upd_pulse, 1, 32, false);
    TILE(upd_count, 1, 32, false);
    TILE(upd_slot, 1, 32, false);
    TILE(upd_shift, 1, 6, false);
    BANKS(events, 15, 32, false);
    TILE(events, 6, 32, false);
#undef BANKS
#undef TILE
}

// A cycle of reset; configuration and table stay.
void reset(Tile* tile) {
    tile->top.reset = 1;
    tile->edge();
    tile->top.reset = 0;
}

// A tile after its reset. Give it back to `destroy`.
Tile* create() {
    Tile* tile = new Tile;
    tile->top.clock = 0;
    tile->top.eval();
    reset(tile);
    return tile;
}

void destroy(Tile* tile) { delete tile; }

// Writes a configuration register, in a cycle of its own.
void configure(Tile* tile, uint32_t address, uint32_t value) {
    tile->top.cmd_valid = 0;
    tile->top.config_write = 1;
    tile->top.config_address = address;
    tile->top.config_value = value;
    tile->edge();
    tile->top.config_write = 0;
}

// Writes an entry of the look-up table, in a cycle of its own.
void write_table(Tile* tile, uint32_t address, uint32_t value, uint32_t slope) {
    tile->top.cmd_valid = 0;
    tile->top.lut_write = 1;
    tile->top.lut_address = address;
    tile->top.lut_value = value;
    tile->top.lut_slope = slope;
    tile->edge();
    tile->top.lut_write = 0;
}

// Writes the threshold of a column, in a cycle of its own.
void write_threshold(Tile* tile, uint32_t column, int64_t threshold) {
    tile->top.cmd_valid = 0;
    tile->top.threshold_write = 1;
    tile->top.threshold_address = column;
    tile->top.threshold_value = static_cast<uint64_t>(threshold) & ((uint64_t{1} << 40) - 1);
    tile->edge();
    tile->top.threshold_write = 0;
}

// Puts inputs on the ports, settles what depends on them, and reads the outputs.
void set_inputs(Tile* tile, const Inputs* inputs, Outputs* outputs) {
    auto& top = tile->top;
    top.cmd_valid = inputs->valid;
    top.cmd_op = inputs->op;
    top.cmd_row = inputs->row;
    top.cmd_slot = inputs->slot;
    top.cmd_shift = inputs->shift;
    top.cmd_code_e = inputs->code[0];
    top.cmd_code_i = inputs->code[1];
    top.bus_word = static_cast<uint32_t>(inputs->bus_word) & 0x1ff;
    put(top.cmd_level_e, 12, inputs->level[0]);
    put(top.cmd_level_i, 12, inputs->level[1]);
    put(top.dither_e, 16, inputs->dither[0]);
    put(top.dither_i, 16, inputs->dither[1]);
    top.eval();
    *outputs = {top.cmd_ready, top.bus_index, top.dither_row, top.dither_wanted};
}

// One edge of the clock.
void edge(Tile* tile) { tile->edge(); }

// Names and lengths of the registers, one a line; the text lives until the thread asks again.
const char* layout(const Tile* tile) {
    static thread_local std::string text;
    text.clear();
    each_register(*tile->top.rootp, [](const char* name, const auto&, int count, int, bool) {
        text += std::string(name) + " " + std::to_string(count) + "\n";
    });
    return text.c_str();
}

// Every register, into as many numbers as the layout says.
void read_registers(const Tile* tile, int64_t* numbers) {
    each_register(*tile->top.rootp, [&](const char*, const auto& signal, int count, int width, bool is_signed) {
        for (int i = 0; i < count; i++) {
            const uint64_t raw = bits(signal, i * width, width);
            const uint64_t sign = is_signed ? (raw >> (width - 1)) << width : 0;
            *numbers++ = static_cast<int64_t>(raw) - static_cast<int64_t>(sign);
        }
    });
}

struct Functions {
    Tile* (*create)();
    void (*destroy)(Tile*);
    void (*reset)(Tile*);
    void (*configure)(Tile*, uint32_t, uint32_t);
    void (*write_table)(Tile*, uint32_t, uint32_t, uint32_t);
    void (*set_inputs)(Tile*, const Inputs*, Outputs*);
    void (*edge)(Tile*);
    const char* (*layout)(const Tile*);
    void (*read_registers)(const Tile*, int64_t*);
    void (*write_threshold)(Tile*, uint32_t, int64_t);
};

}  // namespace

// What tests/rtl calls; the order is that of `Functions` there.
extern "C" const Functions* ED_TILE_NAME() {
    static const Functions functions = {create,     destroy, reset,  configure,     write_table,
                                        set_inputs, edge,    layout, read_registers, write_threshold};
    return &functions;
}
