//! Matrix unit: products of 16 rows x 64 bytes by 64 x 16 bytes at a time (`tdpbuud`, `tdpbusd`, `tdpbsud`), exact in
//! 32 bits; 512-bit loops for everything else.
//!
//! ```text
//! read         C[16 samples][16 columns] += A[16 samples][64 rows]  B[64 rows][16 columns]       u8 x u8
//! accumulate   C[16 rows][16 columns]    += A[16 rows][64 samples]  B[64 samples][16 columns]    u8 x i8
//! transposed   C[16 samples][16 rows]    += A[16 samples][64 cols]  B[64 cols][16 rows]          i8 x u8
//! ```
//!
//! B lies `[64 / 4][16][4]`: levels and packed gates are stored that way. Each block of assembly loads, multiplies and
//! stores: no tile carries data from one to the next. Only the shape of tiles is set before, by [`Tiles`].
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use std::arch::asm;
use std::arch::x86_64::{__cpuid, __cpuid_count, _xgetbv};
use std::ops::Range;
use std::sync::OnceLock;

use super::avx512::{self, Avx512};
use super::{Cells, Conversion, Dither, Drives, Half, LookUp, Loops, Write, WriteCounts, peak};
use crate::chip::crossbar::layout::{BLOCK_CELLS, BLOCK_ROWS, HALF_CELLS, HALF_COLUMNS, Layout};
use crate::num::draw::Place;
use crate::num::fixed::ErrorBits;

/// Proof that the processor has AMX with 8-bit products and AVX-512, and that the system lets this process use it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Amx(Avx512);

/// Tiles of this thread have their shape, until dropped.
#[derive(Debug)]
pub(super) struct Tiles(Avx512);

/// `ldtilecfg` takes this: palette 1, and eight tiles of 16 rows x 64 bytes.
#[repr(C, align(64))]
struct Configuration([u8; 64]);

static CONFIGURATION: Configuration = {
    let mut bytes = [0; 64];
    bytes[0] = 1;
    let mut tile = 0;
    while tile < 8 {
        bytes[16 + 2 * tile] = 64;
        bytes[48 + tile] = 16;
        tile += 1;
    }
    Configuration(bytes)
};

impl Amx {
    /// The token, where the processor has the features and the system grants their use. Asked once a process.
    #[must_use]
    pub fn detect() -> Option<Self> {
        static GRANTED: OnceLock<bool> = OnceLock::new();
        let avx512 = Avx512::detect()?;
        GRANTED.get_or_init(granted).then_some(Self(avx512))
    }

    /// Gives the tiles of this thread their shape.
    pub(super) fn configure(self) -> Tiles {
        // SAFETY: the token exists, so the instruction does and its state is enabled; it reads the 64 bytes of the
        // configuration, which is valid. Compiled code never uses tiles, so nothing of it is disturbed.
        unsafe {
            asm!("ldtilecfg [{}]", in(reg) &raw const CONFIGURATION, options(nostack, readonly));
        }
        Tiles(self.0)
    }
}

impl Drop for Tiles {
    fn drop(&mut self) {
        // SAFETY: a `Tiles` is made only by `configure`, so the instruction exists; it gives up tile state, which
        // compiled code never uses.
        unsafe { asm!("tilerelease", options(nostack, nomem)) }
    }
}

/// Whether processor and system have tiles of bytes, asking the system for permission.
fn granted() -> bool {
    let features = __cpuid_count(7, 0);
    let amx = [24, 25].iter().all(|bit| features.edx >> bit & 1 == 1);
    let saves = __cpuid(1).ecx >> 27 & 1 == 1;
    if !amx || !saves {
        return false;
    }
    // SAFETY: OSXSAVE is there, so the instruction is.
    let enabled = unsafe { xgetbv() };
    enabled >> 17 & 3 == 3 && permission()
}

#[target_feature(enable = "xsave")]
fn xgetbv() -> u64 {
    // SAFETY: register 0 exists wherever the instruction does.
    unsafe { _xgetbv(0) }
}

/// `arch_prctl(ARCH_REQ_XCOMP_PERM, XFEATURE_XTILEDATA)`: Linux grants the 8 KiB of tile data to a process once asked.
#[cfg(target_os = "linux")]
fn permission() -> bool {
    let answer: i64;
    // SAFETY: system call 158 with these numbers only changes what state the system saves for this process; the
    // two registers a call destroys are named.
    unsafe {
        asm!(
            "syscall",
            inlateout("rax") 158i64 => answer,
            in("rdi") 0x1023u64,
            in("rsi") 18u64,
            lateout("rcx") _,
            lateout("r11") _,
            options(nostack),
        );
    }
    answer == 0
}

#[cfg(not(target_os = "linux"))]
fn permission() -> bool {
    false
}

/// Where the bytes of a product of two by two tiles lie.
#[derive(Clone, Copy)]
struct Walk {
    /// Products along the common side, 64 bytes each.
    steps: usize,
    /// Bytes from a row of A to the next.
    a_row: usize,
    /// Bytes from A to the A of the next product.
    a_step: usize,
    /// Bytes from the first B to the one beside it.
    b_half: usize,
    /// Bytes from B to the B of the next product.
    b_step: usize,
    /// Sums from a row of C to the next.
    c_row: usize,
}

/// Two by two tiles: 32 rows of A, 32 columns of B. `$product` is the instruction.
macro_rules! quad {
    ($name:ident, $product:literal) => {
        fn $name(_: &Tiles, walk: Walk, a: &[u8], b: &[u8], c: &mut [i32]) {
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
                    "tilezero tmm0",
                    "tilezero tmm1",
                    "tilezero tmm2",
                    "tilezero tmm3",
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
fn pair(_: &Tiles, walk: Walk, a: &[u8], b: &[u8], c: &mut [i32]) {
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

/// Four by one tiles: 64 rows of A, 16 columns of B, `steps` times 64 samples.
fn half_block(_: &Tiles, steps: usize, turned: &[u8], gates: &[u8], sums: &mut Half<i32>) {
    let stride = steps * 64;
    assert!(steps > 0, "there is something to multiply");
    assert!(turned.len() >= BLOCK_ROWS * stride, "every row of A is there");
    assert!(gates.len() >= HALF_COLUMNS * stride, "every B is there");
    // SAFETY: a `Tiles` says that tiles of this thread have 16 rows of 64 bytes. Tile rows read at
    // turned + step * 64 + row * stride (row < 64) and gates + step * 1024 + 64 * row (row < 16) lie inside the slices
    // by the assertions; the 64 rows of 64 bytes written are all of `sums`. All tiles used are named.
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

impl Loops for &Tiles {
    fn read(self, cells: &[u8], drives: Drives<'_>, samples: Range<usize>, out: &mut [i32]) {
        if cells.is_empty() {
            return out.fill(0);
        }
        let walk = Walk {
            steps: drives.blocks(),
            a_row: BLOCK_ROWS,
            a_step: drives.samples() * BLOCK_ROWS,
            b_half: HALF_CELLS,
            b_step: BLOCK_CELLS,
            c_row: 32,
        };
        let (mut at, mut out) = (samples.start, out);
        while samples.end - at >= 16 {
            let together = if samples.end - at >= 32 { 32 } else { 16 };
            let (these, rest) = out.split_at_mut(together * 32);
            let a = &drives.codes()[at * BLOCK_ROWS..];
            if together == 32 {
                levels_by_drives(self, walk, a, cells, these);
            } else {
                pair(self, walk, a, cells, these);
            }
            (at, out) = (at + together, rest);
        }
        if at < samples.end {
            self.0.read(cells, drives, at..samples.end, out);
        }
    }

    fn read_columns(self, plane: &[u8], layout: Layout, gates: Drives<'_>, out: &mut [i32]) {
        let samples = gates.samples();
        let together = samples / 32 * 32;
        let rows = layout.rows_padded();
        let mut turned = avx512::Turned::new(gates.blocks());
        for block in 0..layout.blocks() {
            self.0.turn_columns(plane, layout, block, &mut turned);
            for pair in 0..2 {
                let at = block * BLOCK_ROWS + 32 * pair;
                let walk = Walk {
                    steps: gates.blocks(),
                    a_row: BLOCK_ROWS,
                    a_step: samples * BLOCK_ROWS,
                    b_half: turned.group_bytes(),
                    b_step: 16 * 64,
                    c_row: rows,
                };
                for first in (0..together).step_by(32) {
                    let a = &gates.codes()[first * BLOCK_ROWS..];
                    let c = &mut out[first * rows + at..];
                    levels_by_gates(self, walk, a, turned.groups(2 * pair), c);
                }
                if together < samples {
                    let out = &mut out[together * rows + at..];
                    self.0.columns_pair(gates, together..samples, rows, &turned, pair, out);
                }
            }
        }
    }

    fn accumulate(self, turned: &[u8], stride: usize, gates: &[i8], sums: &mut Half<i32>) {
        if stride.is_multiple_of(64) {
            half_block(self, stride / 64, turned, avx512::as_bytes(gates), sums);
        } else {
            self.0.accumulate(turned, stride, gates, sums);
        }
    }

    fn convert(
        self,
        currents: [&[i32]; 2],
        conversion: Conversion,
        live: usize,
        codes: &mut [i16],
    ) -> [u64; 2] {
        self.0.convert(currents, conversion, live, codes)
    }

    fn look_up(
        self,
        accumulators: &[i32],
        table: &LookUp,
        live: usize,
        values: &mut [u8],
        derivatives: &mut [u8],
    ) -> u64 {
        self.0.look_up(accumulators, table, live, values, derivatives)
    }

    fn gate(
        self,
        errors: &[i16],
        derivatives: &[u8],
        negate: bool,
        bits: ErrorBits,
        stride: usize,
        gates: &mut [i8],
    ) -> u64 {
        self.0.gate(errors, derivatives, negate, bits, stride, gates)
    }

    fn turn(self, codes: &[u8], stride: usize, turned: &mut [u8]) {
        self.0.turn(codes, stride, turned);
    }

    fn is_quiet(self, sums: &Half<i32>, write: &Write, bits: u32) -> bool {
        self.0.is_quiet(sums, write, bits)
    }

    fn dither(self, place: &Place, rows: usize, column: usize, block: usize, words: &mut Half<u8>) {
        self.0.dither(place, rows, column, block, words);
    }

    fn dither_words(
        self,
        place: &Place,
        rows: usize,
        column: usize,
        block: usize,
        words: &mut Half<u16>,
    ) {
        self.0.dither_words(place, rows, column, block, words);
    }

    fn program(
        self,
        cells: Cells<'_>,
        sums: &Half<i32>,
        write: &Write,
        dither: Dither<'_>,
    ) -> WriteCounts {
        self.0.program(cells, sums, write, dither)
    }

    fn peak(self, rounds: usize) -> u64 {
        peak::amx(self, rounds)
    }
}
