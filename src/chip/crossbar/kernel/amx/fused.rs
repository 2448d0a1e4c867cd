//! Products of tiles with vector work between multiplying and storing.
//!
//! A tile that is stored waits for its product, and nothing behind it starts meanwhile. So each block of assembly
//! loads and multiplies, then does what vector units have to do anyway, and only then stores its tiles: converts the
//! sums that the block before it stored, or draws the words that the sums will be rounded with.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use std::arch::asm;

use super::Tiles;
use crate::chip::crossbar::kernel::chacha::Counter;
use crate::chip::crossbar::kernel::data::Packed;
use crate::chip::crossbar::kernel::{Conversion, Draws, Half, Scratch};
use crate::chip::crossbar::layout::{BLOCK_CELLS, BLOCK_ROWS, HALF_COLUMNS};

/// Sums of 32 samples and 32 columns.
pub(super) type Sums = [i32; Scratch::SUMS];

/// One bank of one physical tile.
#[derive(Clone, Copy)]
pub(super) struct TileBank<'a> {
    /// Drives, from the first of 32 samples on.
    pub(super) drives: &'a [u8],
    /// Bytes from a block of drives to the next.
    pub(super) step: usize,
    /// Levels.
    pub(super) cells: &'a [u8],
    /// Drives and levels that are wanted next: fetched meanwhile.
    pub(super) next: [*const u8; 2],
}

/// Multiplies 32 samples by 32 columns into `now`; converts `before` meanwhile. `$combine` adds to or takes from codes.
macro_rules! converting {
    ($name:ident, $bank:literal, $combine:literal) => {
        pub(super) fn $name(
            _: &Tiles,
            tile: TileBank<'_>,
            now: &mut Sums,
            before: &Sums,
            conversion: Conversion,
            packed: &mut Packed,
        ) {
            let TileBank { drives, step, cells, next } = tile;
            let steps = cells.len() / BLOCK_CELLS;
            assert!(steps > 0, "there is something to multiply");
            assert!(drives.len() >= (steps - 1) * step + 32 * BLOCK_ROWS, "32 samples are there");
            let half = 1u32 << conversion.shift >> 1;
            let settings = [half, conversion.shift, u32::from(conversion.max)];
            // SAFETY: a `Tiles` says that tiles of this thread have 16 rows of 64 bytes and that the processor has
            // AVX-512 BW. Tile rows read at drives + i * step + 64 * row (row < 32) and cells + i * 2048 + 64 * row
            // (row < 32) for i < steps lie inside the slices by the assertion and the division. 32 rows of 128 bytes
            // of `before`, of 64 bytes of codes, and of 128 bytes of `now` are all of these arrays; codes and counts
            // are aligned to 64 bytes. Fetching ahead reads nothing. All registers used are named.
            unsafe {
                asm!(
                    "tilezero tmm0",
                    "tilezero tmm1",
                    "tilezero tmm2",
                    "tilezero tmm3",
                    "2:",
                    "tileloadd tmm4, [{a} + {row}]",
                    "tileloadd tmm6, [{b} + {row}]",
                    "tdpbuud tmm0, tmm4, tmm6",
                    "tileloadd tmm7, [{b} + {row} + 1024]",
                    "tdpbuud tmm1, tmm4, tmm7",
                    "tileloadd tmm5, [{a} + {row} + 1024]",
                    "tdpbuud tmm2, tmm5, tmm6",
                    "tdpbuud tmm3, tmm5, tmm7",
                    "add {a}, {step}",
                    "add {b}, 2048",
                    "dec {steps}",
                    "jnz 2b",
                    "vpbroadcastd zmm16, dword ptr [{settings}]",
                    "vpbroadcastd zmm17, dword ptr [{settings} + 4]",
                    "vpbroadcastw zmm18, word ptr [{settings} + 8]",
                    "vpternlogd zmm19, zmm19, zmm19, 255",
                    "vmovdqa64 zmm20, [{saturated}]",
                    "mov {steps:e}, 32",
                    "3:",
                    "prefetcht0 [{next_a}]",
                    "prefetcht0 [{next_b}]",
                    "vpaddd zmm0, zmm16, [{before}]",
                    "vpaddd zmm1, zmm16, [{before} + 64]",
                    "vpsrlvd zmm0, zmm0, zmm17",
                    "vpsrlvd zmm1, zmm1, zmm17",
                    "vpackusdw zmm0, zmm0, zmm1",
                    "vpcmpuw k1, zmm0, zmm18, 6",
                    "vpsubw zmm20 {{k1}}, zmm20, zmm19",
                    "vpminuw zmm0, zmm0, zmm18",
                    "vmovdqa64 zmm1, [{codes}]",
                    concat!($combine, " zmm0, zmm1, zmm0"),
                    "vmovdqa64 [{codes}], zmm0",
                    "add {before}, 128",
                    "add {codes}, 64",
                    "add {next_a}, 64",
                    "add {next_b}, 64",
                    "dec {steps:e}",
                    "jnz 3b",
                    "vmovdqa64 [{saturated}], zmm20",
                    "tilestored [{c} + {row} * 2], tmm0",
                    "tilestored [{c} + {row} * 2 + 64], tmm1",
                    "tilestored [{c} + {row} * 2 + 2048], tmm2",
                    "tilestored [{c} + {row} * 2 + 2112], tmm3",
                    steps = inout(reg) steps => _,
                    a = inout(reg) drives.as_ptr() => _,
                    step = in(reg) step,
                    b = inout(reg) cells.as_ptr() => _,
                    next_a = inout(reg) next[0] => _,
                    next_b = inout(reg) next[1] => _,
                    row = in(reg) 64usize,
                    c = in(reg) now.as_mut_ptr(),
                    before = inout(reg) before.as_ptr() => _,
                    codes = inout(reg) packed.codes.as_mut_ptr() => _,
                    saturated = in(reg) packed.saturated[$bank].as_mut_ptr(),
                    settings = in(reg) settings.as_ptr(),
                    out("zmm0") _, out("zmm1") _, out("zmm16") _, out("zmm17") _,
                    out("zmm18") _, out("zmm19") _, out("zmm20") _, out("k1") _,
                    out("tmm0") _, out("tmm1") _, out("tmm2") _, out("tmm3") _,
                    out("tmm4") _, out("tmm5") _, out("tmm6") _, out("tmm7") _,
                    options(nostack),
                );
            }
        }
    };
}

converting!(converting_excitation, 0, "vpaddw");
converting!(converting_inhibition, 1, "vpsubw");

/// One step of four quarter rounds: state words a, b, c, d of each.
macro_rules! quarters {
    ($([$a:literal $b:literal $c:literal $d:literal])*) => {
        concat!(
            $("vpaddd zmm", $a, ", zmm", $a, ", zmm", $b, "\n",)*
            $("vpxord zmm", $d, ", zmm", $d, ", zmm", $a, "\n",)*
            $("vprold zmm", $d, ", zmm", $d, ", 16\n",)*
            $("vpaddd zmm", $c, ", zmm", $c, ", zmm", $d, "\n",)*
            $("vpxord zmm", $b, ", zmm", $b, ", zmm", $c, "\n",)*
            $("vprold zmm", $b, ", zmm", $b, ", 12\n",)*
            $("vpaddd zmm", $a, ", zmm", $a, ", zmm", $b, "\n",)*
            $("vpxord zmm", $d, ", zmm", $d, ", zmm", $a, "\n",)*
            $("vprold zmm", $d, ", zmm", $d, ", 8\n",)*
            $("vpaddd zmm", $c, ", zmm", $c, ", zmm", $d, "\n",)*
            $("vpxord zmm", $b, ", zmm", $b, ", zmm", $c, "\n",)*
            $("vprold zmm", $b, ", zmm", $b, ", 7\n",)*
        )
    };
}

/// Starts ChaCha: word i of all lanes, where columns 1, 2 and 3 of the first round are done.
macro_rules! start {
    ($([$word:literal $at:literal])*) => {
        concat!($("vpbroadcastd zmm", $word, ", dword ptr [{mixed} + ", $at, "]\n",)*)
    };
}

/// Ends ChaCha: adds where word i of all lanes started, and stores it.
macro_rules! finish {
    ($([$word:literal $at:literal $to:literal])*) => {
        concat!($(
            "vpaddd zmm", $word, ", zmm", $word, ", dword ptr [{start} + ", $at, "]{{1to16}}\n",
            "vmovdqu64 [{words} + ", $to, "], zmm", $word, "\n",
        )*)
    };
}

/// Numbers of the lanes.
static LANES: Lanes = Lanes([0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15]);

#[repr(align(64))]
struct Lanes([i32; 16]);

/// Sums of a half block, as [`super::product::half_block`], and meanwhile its 8-bit words: ChaCha8 of 16 blocks that
/// start from `draws`, with word 12 by lane.
pub(super) fn half_block_drawn(
    _: &Tiles,
    turned: &[u8],
    gates: &[u8],
    sums: &mut Half<i32>,
    draws: &Draws,
    counter: Counter,
    words: &mut Half<u8>,
) {
    let stride = turned.len() / BLOCK_ROWS;
    let steps = stride / 64;
    assert!(steps > 0 && stride.is_multiple_of(64), "there is something to multiply");
    assert!(turned.len() == BLOCK_ROWS * stride, "every row of A is there");
    assert!(gates.len() == HALF_COLUMNS * stride, "every B is there");
    // SAFETY: a `Tiles` says that tiles of this thread have 16 rows of 64 bytes and that the processor has AVX-512 F.
    // Tile rows read at turned + step * 64 + row * stride (row < 64) and gates + step * 1024 + 64 * row (row < 16) lie
    // inside the slices by the assertions; the 64 rows of 64 bytes written are all of `sums`, and 16 vectors of 64
    // bytes all of `words`. All registers used are named.
    unsafe {
        asm!(
            "tilezero tmm0",
            "tilezero tmm1",
            "tilezero tmm2",
            "tilezero tmm3",
            "2:",
            "tileloadd tmm7, [{b} + {row}]",
            "tileloadd tmm4, [{a0} + {stride}]",
            "tdpbusd tmm0, tmm4, tmm7",
            "tileloadd tmm5, [{a1} + {stride}]",
            "tdpbusd tmm1, tmm5, tmm7",
            "tileloadd tmm6, [{a2} + {stride}]",
            "tdpbusd tmm2, tmm6, tmm7",
            "tileloadd tmm4, [{a3} + {stride}]",
            "tdpbusd tmm3, tmm4, tmm7",
            "add {a0}, 64",
            "add {a1}, 64",
            "add {a2}, 64",
            "add {a3}, 64",
            "add {b}, 1024",
            "dec {steps}",
            "jnz 2b",
            start!([0 0][1 4][2 8][3 12][4 16][5 20][6 24][7 28]),
            start!([8 32][9 36][10 40][11 44][13 52][14 56][15 60]),
            "vpbroadcastd zmm16, {step:e}",
            "vpmulld zmm16, zmm16, [{lanes}]",
            "vpbroadcastd zmm12, {first:e}",
            "vpaddd zmm16, zmm12, zmm16",
            "vmovdqa64 zmm12, zmm16",
            quarters!([0 4 8 12]),
            quarters!([0 5 10 15][1 6 11 12][2 7 8 13][3 4 9 14]),
            "mov {steps:e}, 3",
            "3:",
            quarters!([0 4 8 12][1 5 9 13][2 6 10 14][3 7 11 15]),
            quarters!([0 5 10 15][1 6 11 12][2 7 8 13][3 4 9 14]),
            "dec {steps:e}",
            "jnz 3b",
            "vpaddd zmm12, zmm12, zmm16",
            finish!([0 0 0][1 4 64][2 8 128][3 12 192][4 16 256][5 20 320][6 24 384][7 28 448]),
            finish!([8 32 512][9 36 576][10 40 640][11 44 704][13 52 832]),
            "vmovdqu64 [{words} + 768], zmm12",
            finish!([14 56 896][15 60 960]),
            "tilestored [{c} + {row}], tmm0",
            "tilestored [{c} + {row} + 1024], tmm1",
            "tilestored [{c} + {row} + 2048], tmm2",
            "tilestored [{c} + {row} + 3072], tmm3",
            steps = inout(reg) steps => _,
            a0 = inout(reg) turned.as_ptr() => _,
            a1 = inout(reg) turned[16 * stride..].as_ptr() => _,
            a2 = inout(reg) turned[32 * stride..].as_ptr() => _,
            a3 = inout(reg) turned[48 * stride..].as_ptr() => _,
            b = inout(reg) gates.as_ptr() => _,
            c = in(reg) sums.as_mut_ptr(),
            row = in(reg) 64usize,
            stride = in(reg) stride,
            start = in(reg) draws.start().as_ptr(),
            mixed = in(reg) draws.mixed().as_ptr(),
            first = in(reg) counter.first,
            step = in(reg) counter.step,
            lanes = in(reg) LANES.0.as_ptr(),
            words = in(reg) words.as_mut_ptr(),
            out("zmm0") _, out("zmm1") _, out("zmm2") _, out("zmm3") _, out("zmm4") _, out("zmm5") _,
            out("zmm6") _, out("zmm7") _, out("zmm8") _, out("zmm9") _, out("zmm10") _,
            out("zmm11") _, out("zmm12") _, out("zmm13") _, out("zmm14") _, out("zmm15") _,
            out("zmm16") _,
            out("tmm0") _, out("tmm1") _, out("tmm2") _, out("tmm3") _,
            out("tmm4") _, out("tmm5") _, out("tmm6") _, out("tmm7") _,
            options(nostack),
        );
    }
}
