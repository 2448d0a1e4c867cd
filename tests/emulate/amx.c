/* Tiles: the instructions of AMX-TILE and AMX-INT8 and their bits of `cpuid`, as Intel's manual of instructions defines
 * them. Bochs calls them undefined and comes here. What the manual forbids ends the program: shapes that do not fit
 * each other, a tile named twice in a product, a configuration with reserved bits. */
#include "emulate.h"

#include <string.h>

struct tiles tiles;

void tile_features(u32 leaf, u32 part, u32 answer[4])
{
    enum { EAX, EBX, ECX, EDX };
    u32 whole[4] = { 0 };
    switch (leaf << 8 | part) {
    case 0x700:
        answer[EDX] |= 1u << 24 | 1u << 25; /* AMX-TILE, AMX-INT8 */
        return;
    case 0xd00:
        answer[EAX] |= 3u << 17;
        answer[EBX] = answer[ECX] = 2816 + 8192;
        return;
    case 0xd01: /* without gaps */
        answer[EBX] = 2432 + 64 + 8192;
        return;
    case 0xd11: /* shape: size and place in the area of xsave, on a line of its own */
        whole[EAX] = 64, whole[EBX] = 2752, whole[ECX] = 2;
        break;
    case 0xd12: /* data: as well; may be off by default */
        whole[EAX] = 8192, whole[EBX] = 2816, whole[ECX] = 6;
        break;
    case 0x1d00: /* palettes */
        whole[EAX] = 1;
        break;
    case 0x1d01: /* bytes in all and of a tile, bytes of a row, tiles, rows */
        whole[EAX] = 1024 << 16 | 8192, whole[EBX] = 8 << 16 | 64, whole[ECX] = 16;
        break;
    case 0x1e00: /* rows and bytes of a factor */
        whole[EBX] = 64 << 8 | 16;
        break;
    default:
        return;
    }
    memcpy(answer, whole, sizeof whole);
}

/* --- shapes --- */

static bool configure(const u8 *from)
{
    struct tiles next = { .palette = from[0], .start_row = from[1] };
    if (!next.palette) {
        tiles = (struct tiles){ 0 };
        return true;
    }
    u8 reserved = next.palette > 1 || next.start_row; /* a load here is never half done: there is none to go on with */
    for (int i = 2; i < 64; i++)
        if (i < 16 || (i >= 32 && i < 48) || i >= 56)
            reserved |= from[i];
    for (int tile = 0; tile < 8; tile++) {
        memcpy(&next.columns[tile], from + 16 + 2 * tile, 2);
        next.rows[tile] = from[48 + tile];
        reserved |= next.columns[tile] > 64 || next.rows[tile] > 16 || !next.columns[tile] != !next.rows[tile];
    }
    if (reserved)
        return false;
    tiles = next;
    return true;
}

static void store_configuration(u8 *to)
{
    memset(to, 0, 64);
    to[0] = tiles.palette;
    to[1] = tiles.start_row;
    memcpy(to + 16, tiles.columns, sizeof tiles.columns);
    memcpy(to + 48, tiles.rows, sizeof tiles.rows);
}

static bool shaped(int tile) { return tiles.palette && tiles.rows[tile]; }

/* --- movement and products --- */

static bool load_tile(int tile, u64 address, u64 stride)
{
    if (!shaped(tile))
        return false;
    memset(tiles.data[tile], 0, sizeof tiles.data[tile]);
    for (int row = 0; row < tiles.rows[tile]; row++)
        memcpy(tiles.data[tile][row], (u8 *)(address + row * stride), tiles.columns[tile]);
    return true;
}

static bool store_tile(int tile, u64 address, u64 stride)
{
    if (!shaped(tile))
        return false;
    for (int row = 0; row < tiles.rows[tile]; row++)
        memcpy((u8 *)(address + row * stride), tiles.data[tile][row], tiles.columns[tile]);
    return true;
}

/* C[m][n] += the sum over k and i of A[m][4k + i] B[k][4n + i], in 32 bits that wrap. A tile is 0 outside its shape. */
static bool multiply(int c, int a, int b, bool a_signed, bool b_signed)
{
    bool fits = shaped(a) && shaped(b) && shaped(c) && a != b && a != c && b != c
        && tiles.rows[c] == tiles.rows[a] && tiles.columns[c] == tiles.columns[b]
        && tiles.columns[a] == 4 * tiles.rows[b] && tiles.columns[c] % 4 == 0;
    if (!fits)
        return false;
    int32_t factors[64][16]; /* B with k and i together */
    for (int k = 0; k < 64; k++)
        for (int n = 0; n < 16; n++) {
            u8 byte = tiles.data[b][k / 4][4 * n + k % 4];
            factors[k][n] = b_signed ? (int8_t)byte : byte;
        }
    for (int m = 0; m < tiles.rows[c]; m++) {
        u32 sums[16];
        memcpy(sums, tiles.data[c][m], sizeof sums);
        for (int k = 0; k < tiles.columns[a]; k++) {
            u8 byte = tiles.data[a][m][k];
            int32_t factor = a_signed ? (int8_t)byte : byte;
            for (int n = 0; n < 16; n++)
                sums[n] += (u32)(factor * factors[k][n]);
        }
        memcpy(tiles.data[c][m], sums, sizeof sums);
    }
    return true;
}

/* --- encodings --- */

/* What a byte of three-byte VEX, an opcode and its operands say. */
struct coded {
    int reg, rm, second;    /* tiles */
    bool memory, indexed;   /* an address; with a byte for base and index */
    u64 address, stride;
    int size;
};

static u64 extended(u8 inverted, int low) { return get((inverted ? 0 : 8) | low); }

static int32_t displacement(const u8 *from, int size)
{
    int32_t value = 0;
    memcpy(&value, from, size);
    return size == 1 ? (int8_t)value : value;
}

static struct coded decode(const u8 *code)
{
    struct coded it = { .reg = code[4] >> 3 & 7, .rm = code[4] & 7, .second = ~code[2] >> 3 & 15, .size = 5 };
    int mod = code[4] >> 6, size = mod == 1 ? 1 : mod == 2 ? 4 : 0;
    it.memory = mod != 3;
    if (!it.memory)
        return it;
    it.indexed = it.rm == 4;
    if (it.indexed) {
        u8 both = code[it.size++];
        bool no_index = (both >> 3 & 7) == 4 && code[1] & 0x40, no_base = (both & 7) == 5 && mod == 0;
        it.stride = no_index ? 0 : extended(code[1] & 0x40, both >> 3 & 7) << (both >> 6);
        it.address = no_base ? 0 : extended(code[1] & 0x20, both & 7);
        size = no_base ? 4 : size;
    } else if (it.rm == 5 && mod == 0) {
        size = 4;
        it.address = (u64)code + 5 + 4; /* after the instruction: there is no immediate */
    } else {
        it.address = extended(code[1] & 0x20, it.rm);
    }
    it.address += displacement(code + it.size, size);
    it.size += size;
    return it;
}

int tile_instruction(u64 pc)
{
    const u8 *code = (const u8 *)pc;
    /* three-byte VEX, map 0F38, W0, 128 bits, one of eight tiles */
    if (code[0] != 0xc4 || (code[1] & 0x9f) != 0x82 || code[2] & 0x84)
        return 0;
    enum { NONE, X66, XF3, XF2 } prefix = code[2] & 3;
    struct coded it = decode(code);
    bool alone = it.second == 0, done = false;
    if (!it.memory && !(code[1] & 0x20))
        return 0;
    switch (code[3]) {
    case 0x49:
        if (!alone)
            return 0;
        if (prefix == NONE && it.memory && it.reg == 0)
            done = configure((u8 *)it.address);
        else if (prefix == X66 && it.memory && it.reg == 0)
            store_configuration((u8 *)it.address), done = true;
        else if (prefix == NONE && code[4] == 0xc0)
            tiles = (struct tiles){ 0 }, done = true;
        else if (prefix == XF2 && !it.memory && it.rm == 0 && shaped(it.reg))
            memset(tiles.data[it.reg], 0, sizeof tiles.data[0]), done = true;
        break;
    case 0x4b:
        if (!alone || !it.indexed || prefix == NONE)
            return 0;
        done = prefix == XF3 ? store_tile(it.reg, it.address, it.stride) : load_tile(it.reg, it.address, it.stride);
        break;
    case 0x5e:
        if (it.memory || it.second > 7)
            return 0;
        done = multiply(it.reg, it.rm, it.second, prefix == XF3 || prefix == XF2, prefix == X66 || prefix == XF2);
        break;
    default:
        return 0;
    }
    return done ? it.size : -1;
}
