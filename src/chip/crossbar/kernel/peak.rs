//! How many products a back end's instruction makes when nothing else is in its way: operands stay in registers.
//!
//! ```text
//! amx      tdpbuud            16,384 products, 4 independent sums
//! avx512   vpdpbusd zmm           64 products, 12 independent sums
//! avx2     vpmaddwd, vpaddd       16 products, 10 independent sums
//! ```
//!
//! This is the measure that `dalean bench` holds reads against. Operands are random, because a matrix unit runs faster
//! on zeros. Sums wrap and are thrown away. Each loop is one block of assembly, so that no compiler moves a product of
//! constants out of it.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use std::arch::asm;

/// Four tiles of random bytes.
#[repr(C, align(64))]
struct Operands([u8; 4096]);

static OPERANDS: Operands = {
    let mut bytes = [0; 4096];
    let mut word = 0x9e37_79b9_7f4a_7c15u64;
    let mut at = 0;
    while at < bytes.len() {
        word ^= word << 13;
        word ^= word >> 7;
        word ^= word << 17;
        bytes[at] = word.to_le_bytes()[4];
        at += 1;
    }
    Operands(bytes)
};

/// Products of `rounds` rounds of four.
///
/// # Safety
/// Tiles of this thread have their shape.
pub(super) unsafe fn amx(rounds: usize) -> u64 {
    if rounds > 0 {
        // SAFETY: the caller says that tiles of this thread have 16 rows of 64 bytes, so the four loads read the 4096
        // bytes of the operands. Nothing else is read or written. All tiles used are named.
        unsafe {
            asm!(
                "tileloadd tmm4, [{a} + {row}]",
                "tileloadd tmm5, [{a} + {row} + 1024]",
                "tileloadd tmm6, [{a} + {row} + 2048]",
                "tileloadd tmm7, [{a} + {row} + 3072]",
                "tilezero tmm0",
                "tilezero tmm1",
                "tilezero tmm2",
                "tilezero tmm3",
                "2:",
                "tdpbuud tmm0, tmm4, tmm6",
                "tdpbuud tmm1, tmm4, tmm7",
                "tdpbuud tmm2, tmm5, tmm6",
                "tdpbuud tmm3, tmm5, tmm7",
                "dec {rounds}",
                "jnz 2b",
                a = in(reg) &raw const OPERANDS,
                row = in(reg) 64usize,
                rounds = inout(reg) rounds => _,
                out("tmm0") _, out("tmm1") _, out("tmm2") _, out("tmm3") _,
                out("tmm4") _, out("tmm5") _, out("tmm6") _, out("tmm7") _,
                options(nostack, readonly),
            );
        }
    }
    rounds as u64 * 4 * 16 * 16 * 64
}

/// Products of `rounds` rounds of twelve.
#[target_feature(enable = "avx512f,avx512vnni")]
pub(super) fn avx512(rounds: usize) -> u64 {
    if rounds > 0 {
        dot_products(rounds);
    }
    rounds as u64 * 12 * 64
}

#[target_feature(enable = "avx512f,avx512vnni")]
fn dot_products(rounds: usize) {
    // SAFETY: the function is compiled for the instructions; the five loads read the first 320 bytes of the operands.
    // Nothing else is read or written. What the sums hold before the first round does not matter. All registers used
    // are named.
    unsafe {
        asm!(
            "vmovdqa64 zmm16, [{a}]",
            "vmovdqa64 zmm17, [{a} + 64]",
            "vmovdqa64 zmm18, [{a} + 128]",
            "vmovdqa64 zmm19, [{a} + 192]",
            "vmovdqa64 zmm20, [{a} + 256]",
            "2:",
            "vpdpbusd zmm0, zmm16, zmm18",
            "vpdpbusd zmm1, zmm16, zmm19",
            "vpdpbusd zmm2, zmm16, zmm20",
            "vpdpbusd zmm3, zmm17, zmm18",
            "vpdpbusd zmm4, zmm17, zmm19",
            "vpdpbusd zmm5, zmm17, zmm20",
            "vpdpbusd zmm6, zmm18, zmm16",
            "vpdpbusd zmm7, zmm18, zmm17",
            "vpdpbusd zmm8, zmm19, zmm16",
            "vpdpbusd zmm9, zmm19, zmm17",
            "vpdpbusd zmm10, zmm20, zmm16",
            "vpdpbusd zmm11, zmm20, zmm17",
            "dec {rounds}",
            "jnz 2b",
            a = in(reg) &raw const OPERANDS,
            rounds = inout(reg) rounds => _,
            out("zmm0") _, out("zmm1") _, out("zmm2") _, out("zmm3") _, out("zmm4") _, out("zmm5") _,
            out("zmm6") _, out("zmm7") _, out("zmm8") _, out("zmm9") _, out("zmm10") _, out("zmm11") _,
            out("zmm16") _, out("zmm17") _, out("zmm18") _, out("zmm19") _, out("zmm20") _,
            options(nostack, readonly),
        );
    }
}

/// Products of `rounds` rounds of ten.
#[target_feature(enable = "avx2")]
pub(super) fn avx2(rounds: usize) -> u64 {
    if rounds > 0 {
        pair_products(rounds);
    }
    rounds as u64 * 10 * 16
}

#[target_feature(enable = "avx2")]
fn pair_products(rounds: usize) {
    // SAFETY: the function is compiled for the instructions; the three loads read the first 96 bytes of the operands.
    // Nothing else is read or written. What the sums hold before the first round does not matter. All registers used
    // are named.
    unsafe {
        asm!(
            "vmovdqa ymm13, [{a}]",
            "vmovdqa ymm14, [{a} + 32]",
            "vmovdqa ymm15, [{a} + 64]",
            "2:",
            "vpmaddwd ymm10, ymm13, ymm14",
            "vpmaddwd ymm11, ymm13, ymm15",
            "vpmaddwd ymm12, ymm14, ymm15",
            "vpaddd ymm0, ymm0, ymm10",
            "vpaddd ymm1, ymm1, ymm11",
            "vpaddd ymm2, ymm2, ymm12",
            "vpmaddwd ymm10, ymm13, ymm14",
            "vpmaddwd ymm11, ymm13, ymm15",
            "vpmaddwd ymm12, ymm14, ymm15",
            "vpaddd ymm3, ymm3, ymm10",
            "vpaddd ymm4, ymm4, ymm11",
            "vpaddd ymm5, ymm5, ymm12",
            "vpmaddwd ymm10, ymm13, ymm14",
            "vpmaddwd ymm11, ymm13, ymm15",
            "vpmaddwd ymm12, ymm14, ymm15",
            "vpaddd ymm6, ymm6, ymm10",
            "vpaddd ymm7, ymm7, ymm11",
            "vpaddd ymm8, ymm8, ymm12",
            "vpmaddwd ymm10, ymm13, ymm14",
            "vpaddd ymm9, ymm9, ymm10",
            "dec {rounds}",
            "jnz 2b",
            a = in(reg) &raw const OPERANDS,
            rounds = inout(reg) rounds => _,
            out("ymm0") _, out("ymm1") _, out("ymm2") _, out("ymm3") _, out("ymm4") _, out("ymm5") _,
            out("ymm6") _, out("ymm7") _, out("ymm8") _, out("ymm9") _, out("ymm10") _, out("ymm11") _,
            out("ymm12") _, out("ymm13") _, out("ymm14") _, out("ymm15") _,
            options(nostack, readonly),
        );
    }
}

#[cfg(test)]
mod tests {
    use crate::chip::crossbar::kernel::{Backend, Kernel};

    #[test]
    fn products_are_counted_by_round_and_no_round_is_none() {
        for backend in Backend::available() {
            let kernel = Kernel::start(backend);
            let one = kernel.peak(1);
            assert_eq!([kernel.peak(0), kernel.peak(7)], [0, 7 * one], "{}", backend.name());
            assert_eq!(one == 0, backend == Backend::Scalar, "{}", backend.name());
        }
    }
}
