//! Products of tiles with conversions between them: of the sums that the block before it stored.
//!
//! As in `drawn`, products that stand among vector instructions cost little, and tiles are stored last: nothing behind
//! a tile that waits for its product starts before it.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use std::arch::asm;

use super::Tiles;
use crate::chip::crossbar::kernel::data::Packed;
use crate::chip::crossbar::kernel::{Conversion, Scratch};
use crate::chip::crossbar::layout::{BLOCK_CELLS, BLOCK_ROWS};

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

/// Vectors of codes that a block converts.
const VECTORS: usize = 32;
/// Bytes of the codes of a block: `i` goes up to here.
const CODES: usize = 64 * VECTORS;

/// Converts two vectors of sums to one of codes. `$combine` adds to or takes from codes.
macro_rules! convert {
    ($combine:literal, $label:literal) => {
        concat!(
            $label,
            ":\n",
            "prefetcht0 [{next_a} + {i}]\n",
            "prefetcht0 [{next_b} + {i}]\n",
            "vpaddd zmm0, zmm16, [{before} + {i} * 2]\n",
            "vpaddd zmm1, zmm16, [{before} + {i} * 2 + 64]\n",
            "vpsrlvd zmm0, zmm0, zmm17\n",
            "vpsrlvd zmm1, zmm1, zmm17\n",
            "vpackusdw zmm0, zmm0, zmm1\n",
            "vpcmpuw k1, zmm0, zmm18, 6\n",
            "vpsubw zmm20 {{k1}}, zmm20, zmm19\n",
            "vpcmpuw k2, zmm0, zmm18, 5\n",
            "vpsubw zmm21 {{k2}}, zmm21, zmm19\n",
            "vpminuw zmm0, zmm0, zmm18\n",
            "vmovdqa64 zmm1, [{packed} + {i}]\n",
            $combine,
            " zmm0, zmm1, zmm0\n",
            "vmovdqa64 [{packed} + {i}], zmm0\n",
            "add {i}, 64\n",
        )
    };
}

/// Does so `{each}` times.
macro_rules! convert_some {
    ($combine:literal, $label:literal) => {
        concat!(
            "mov {count}, {each}\n",
            convert!($combine, $label),
            "dec {count}\n",
            "jnz ",
            $label,
            "b\n",
        )
    };
}

/// Multiplies 32 samples by 32 columns into `now`; converts `before` between the products. `$combine` adds to or takes
/// from codes.
macro_rules! converting {
    ($name:ident, $combine:literal, $saturated:literal, $reached:literal) => {
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
            // four products a step: so many vectors behind each, until all are converted
            let mixed = steps.min(VECTORS / 4);
            let each = VECTORS / 4 / mixed;
            assert!(steps >> 31 == 0, "steps with conversions and steps without share a word");
            // SAFETY: a `Tiles` says that tiles of this thread have 16 rows of 64 bytes and that the processor has
            // AVX-512 BW. Tile rows read at drives + i * step + 64 * row (row < 32) and cells + i * 2048 + 64 * row
            // (row < 32) for i < steps lie inside the slices by the assertion and the division: `mixed` and the rest
            // make `steps`. They share a word, so that thirteen general registers are enough. `i` goes from 0 to 2048 in steps of 64, as 4 * mixed * each <= 32: 32 rows of 128 bytes
            // of `before` and of 64 bytes of codes are touched; 32 rows of 128 bytes of `now` are written. Codes and
            // counts lie in `packed` in this order, aligned to 64 bytes. Fetching ahead reads nothing. All registers
            // used are named.
            unsafe {
                asm!(
                    zero_sums!(),
                    "vpbroadcastd zmm16, dword ptr [{count}]",
                    "vpbroadcastd zmm17, dword ptr [{count} + 4]",
                    "vpbroadcastw zmm18, word ptr [{count} + 8]",
                    "vpternlogd zmm19, zmm19, zmm19, 255",
                    concat!("vmovdqa64 zmm20, [{packed} + ", $saturated, "]"),
                    concat!("vmovdqa64 zmm21, [{packed} + ", $reached, "]"),
                    "2:",
                    "tileloadd tmm4, [{a} + {row}]",
                    "tileloadd tmm6, [{b} + {row}]",
                    "tdpbuud tmm0, tmm4, tmm6",
                    convert_some!($combine, "30"),
                    "tileloadd tmm7, [{b} + {row} + 1024]",
                    "tdpbuud tmm1, tmm4, tmm7",
                    convert_some!($combine, "31"),
                    "tileloadd tmm5, [{a} + {row} + 1024]",
                    "tdpbuud tmm2, tmm5, tmm6",
                    convert_some!($combine, "32"),
                    "tdpbuud tmm3, tmm5, tmm7",
                    convert_some!($combine, "33"),
                    "add {a}, {step}",
                    "add {b}, 2048",
                    "dec {steps}",
                    "test {steps:e}, {steps:e}",
                    "jnz 2b",
                    "shr {steps}, 32",
                    "jz 5f",
                    "4:",
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
                    "jnz 4b",
                    "5:",
                    "cmp {i}, {codes}",
                    "jae 7f",
                    convert!($combine, "6"),
                    "cmp {i}, {codes}",
                    "jb 6b",
                    "7:",
                    concat!("vmovdqa64 [{packed} + ", $saturated, "], zmm20"),
                    concat!("vmovdqa64 [{packed} + ", $reached, "], zmm21"),
                    "tilestored [{c} + {row} * 2], tmm0",
                    "tilestored [{c} + {row} * 2 + 64], tmm1",
                    "tilestored [{c} + {row} * 2 + 2048], tmm2",
                    "tilestored [{c} + {row} * 2 + 2112], tmm3",
                    steps = inout(reg) (steps - mixed) << 32 | mixed => _,
                    each = in(reg) each,
                    count = inout(reg) settings.as_ptr() => _,
                    i = inout(reg) 0usize => _,
                    codes = const CODES,
                    a = inout(reg) drives.as_ptr() => _,
                    step = in(reg) step,
                    b = inout(reg) cells.as_ptr() => _,
                    next_a = in(reg) next[0],
                    next_b = in(reg) next[1],
                    row = in(reg) 64usize,
                    c = in(reg) now.as_mut_ptr(),
                    before = in(reg) before.as_ptr(),
                    packed = in(reg) std::ptr::from_mut(packed),
                    out("zmm0") _, out("zmm1") _, out("zmm16") _, out("zmm17") _,
                    out("zmm18") _, out("zmm19") _, out("zmm20") _, out("zmm21") _,
                    out("k1") _, out("k2") _,
                    out("tmm0") _, out("tmm1") _, out("tmm2") _, out("tmm3") _,
                    out("tmm4") _, out("tmm5") _, out("tmm6") _, out("tmm7") _,
                    options(nostack),
                );
            }
        }
    };
}

converting!(converting_excitation, "vpaddw", "2048", "2176");
converting!(converting_inhibition, "vpsubw", "2112", "2240");
