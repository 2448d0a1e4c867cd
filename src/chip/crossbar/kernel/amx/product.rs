//! Products of tiles. Each block of assembly loads, multiplies and stores.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use std::arch::asm;

use super::Tiles;
use crate::chip::crossbar::kernel::Half;
use crate::chip::crossbar::layout::{BLOCK_ROWS, HALF_CELLS};

/// Where the bytes of a product of two by two tiles lie.
#[derive(Clone, Copy)]
pub(super) struct Walk {
    /// Products along the common side, 64 bytes each.
    pub(super) steps: usize,
    /// Bytes from a row of A to the next.
    pub(super) a_row: usize,
    /// Bytes from A to the A of the next product.
    pub(super) a_step: usize,
    /// Bytes from the first B to the one beside it.
    pub(super) b_half: usize,
    /// Bytes from B to the B of the next product.
    pub(super) b_step: usize,
    /// Sums from a row of C to the next.
    pub(super) c_row: usize,
}

/// Two by two tiles: 32 rows of A, 32 columns of B. `$product` is the instruction.
macro_rules! quad {
    ($name:ident, $product:literal) => {
        pub(super) fn $name(_: &Tiles, walk: Walk, a: &[u8], b: &[u8], c: &mut [i32]) {
            let Walk { steps, a_row, a_step, b_half, b_step, c_row } = walk;
            assert!(steps > 0, "there is something to multiply");
            assert!(a.len() >= (steps - 1) * a_step + 31 * a_row + 64, "every row of A is there");
            assert!(b.len() >= (steps - 1) * b_step + b_half + 1024, "every B is there");
            assert!(c.len() >= 31 * c_row + 32, "every sum has its place");
            // SAFETY: a `Tiles` says that tiles of this thread have 16 rows of 64 bytes. Tile rows read at
            // a + step * a_step + row * a_row (row < 32), b + step * b_step + half * b_half + 64 * row (row < 16)
            // and written at c + 4 * c_row * row (row < 32, 128 bytes) lie inside the slices by the assertions.
            // Pointers move past the end only after the last use. All tiles used are named.
            unsafe {
                asm!(
                    zero_sums!(),
                    "2:",
                    "tileloadd tmm4, [{a} + {a_row}]",
                    "tileloadd tmm6, [{b} + {b_row}]",
                    concat!($product, " tmm0, tmm4, tmm6"),
                    "tileloadd tmm7, [{b2} + {b_row}]",
                    concat!($product, " tmm1, tmm4, tmm7"),
                    "tileloadd tmm5, [{a2} + {a_row}]",
                    concat!($product, " tmm2, tmm5, tmm6"),
                    concat!($product, " tmm3, tmm5, tmm7"),
                    "add {a}, {a_step}",
                    "add {a2}, {a_step}",
                    "add {b}, {b_step}",
                    "add {b2}, {b_step}",
                    "dec {steps}",
                    "jnz 2b",
                    "tilestored [{c} + {c_row}], tmm0",
                    "tilestored [{c} + {c_row} + 64], tmm1",
                    "tilestored [{c2} + {c_row}], tmm2",
                    "tilestored [{c2} + {c_row} + 64], tmm3",
                    steps = inout(reg) steps => _,
                    a = inout(reg) a.as_ptr() => _,
                    a2 = inout(reg) a[16 * a_row..].as_ptr() => _,
                    a_row = in(reg) a_row,
                    a_step = in(reg) a_step,
                    b = inout(reg) b.as_ptr() => _,
                    b2 = inout(reg) b[b_half..].as_ptr() => _,
                    b_row = in(reg) 64usize,
                    b_step = in(reg) b_step,
                    c = in(reg) c.as_mut_ptr(),
                    c2 = in(reg) c[16 * c_row..].as_mut_ptr(),
                    c_row = in(reg) 4 * c_row,
                    out("tmm0") _, out("tmm1") _, out("tmm2") _, out("tmm3") _,
                    out("tmm4") _, out("tmm5") _, out("tmm6") _, out("tmm7") _,
                    options(nostack),
                );
            }
        }
    };
}

quad!(levels_by_drives, "tdpbuud");
quad!(levels_by_gates, "tdpbsud");

/// One by two tiles: 16 rows of A, 32 columns of B.
pub(super) fn pair(_: &Tiles, walk: Walk, a: &[u8], b: &[u8], c: &mut [i32]) {
    let Walk { steps, a_row, a_step, b_half, b_step, c_row } = walk;
    assert!(steps > 0, "there is something to multiply");
    assert!(a.len() >= (steps - 1) * a_step + 15 * a_row + 64, "every row of A is there");
    assert!(b.len() >= (steps - 1) * b_step + b_half + 1024, "every B is there");
    assert!(c.len() >= 15 * c_row + 32, "every sum has its place");
    // SAFETY: as in `quad`, with 16 rows of A and of C.
    unsafe {
        asm!(
            "tilezero tmm0",
            "tilezero tmm1",
            "2:",
            "tileloadd tmm4, [{a} + {a_row}]",
            "tileloadd tmm6, [{b} + {b_row}]",
            "tdpbuud tmm0, tmm4, tmm6",
            "tileloadd tmm7, [{b2} + {b_row}]",
            "tdpbuud tmm1, tmm4, tmm7",
            "add {a}, {a_step}",
            "add {b}, {b_step}",
            "add {b2}, {b_step}",
            "dec {steps}",
            "jnz 2b",
            "tilestored [{c} + {c_row}], tmm0",
            "tilestored [{c} + {c_row} + 64], tmm1",
            steps = inout(reg) steps => _,
            a = inout(reg) a.as_ptr() => _,
            a_row = in(reg) a_row,
            a_step = in(reg) a_step,
            b = inout(reg) b.as_ptr() => _,
            b2 = inout(reg) b[b_half..].as_ptr() => _,
            b_row = in(reg) 64usize,
            b_step = in(reg) b_step,
            c = in(reg) c.as_mut_ptr(),
            c_row = in(reg) 4 * c_row,
            out("tmm0") _, out("tmm1") _, out("tmm4") _, out("tmm6") _, out("tmm7") _,
            options(nostack),
        );
    }
}

/// Four by one tiles: 64 rows of A that lie `stride` bytes apart, 16 columns of B, as many times 64 samples as B has.
pub(super) fn half_block(
    _: &Tiles,
    stride: usize,
    turned: &[u8],
    gates: &[u8],
    sums: &mut Half<i32>,
) {
    let steps = gates.len() / HALF_CELLS;
    assert!(steps > 0, "there is something to multiply");
    assert!(turned.len() >= (BLOCK_ROWS - 1) * stride + steps * 64, "every row of A is there");
    // SAFETY: a `Tiles` says that tiles of this thread have 16 rows of 64 bytes. Tile rows read at
    // turned + step * 64 + row * stride (row < 64) and gates + step * 1024 + 64 * row (row < 16) lie inside the slices
    // by the assertion and the division; the 64 rows of 64 bytes written are all of `sums`. All tiles used are named.
    unsafe {
        asm!(
            zero_sums!(),
            "2:",
            half_step!(),
            "dec {steps}",
            "jnz 2b",
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
            out("tmm0") _, out("tmm1") _, out("tmm2") _, out("tmm3") _,
            out("tmm4") _, out("tmm5") _, out("tmm6") _, out("tmm7") _,
            options(nostack),
        );
    }
}
