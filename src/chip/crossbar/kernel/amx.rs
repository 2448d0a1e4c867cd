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
use std::cell::Cell;
use std::ops::Range;
use std::sync::OnceLock;

use self::drawn::Factors;
use self::fused::TileBank;
use self::product::{Walk, half_block, levels_by_drives, levels_by_gates, pair};
use super::avx512::{self, Avx512};
use super::ops::Ops;
use super::{Banks, Draws, Drives, Half, Image, Packed, Rails, Scratch, TOGETHER, peak};
use crate::chip::crossbar::layout::{BLOCK_CELLS, BLOCK_ROWS, HALF_CELLS, Layout};

/// Sums of the first four tile registers start at 0.
macro_rules! zero_sums {
    () => {
        "tilezero tmm0\ntilezero tmm1\ntilezero tmm2\ntilezero tmm3\n"
    };
}

/// One step of a half block: 64 rows of A by 16 columns of B, over 64 samples.
macro_rules! half_step {
    () => {
        concat!(
            "tileloadd tmm7, [{b} + {row}]\n",
            "tileloadd tmm4, [{a0} + {stride}]\n",
            "tdpbusd tmm0, tmm4, tmm7\n",
            "tileloadd tmm5, [{a1} + {stride}]\n",
            "tdpbusd tmm1, tmm5, tmm7\n",
            "tileloadd tmm6, [{a2} + {stride}]\n",
            "tdpbusd tmm2, tmm6, tmm7\n",
            "tileloadd tmm4, [{a3} + {stride}]\n",
            "tdpbusd tmm3, tmm4, tmm7\n",
            "add {a0}, 64\n",
            "add {a1}, 64\n",
            "add {a2}, 64\n",
            "add {a3}, 64\n",
            "add {b}, 1024\n",
        )
    };
}

mod conv;
mod drawn;
mod fused;
mod product;

/// Proof that the processor has AMX with 8-bit products and AVX-512, and that the system lets this process use it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Amx(());

thread_local! {
    /// How many [`Tiles`] this thread has: the last one that goes gives up the shape.
    static HOLDERS: Cell<usize> = const { Cell::new(0) };
}

/// Tiles of this thread have their shape, until dropped. It never leaves its thread: [`super::Kernel`] holds it, which
/// cannot be sent.
#[derive(Debug)]
pub(super) struct Tiles(());

impl Tiles {
    /// The tiles of this thread.
    ///
    /// # Safety
    /// They have their shape, and keep it as long as the reference is used.
    unsafe fn here<'a>() -> &'a Self {
        static HERE: Tiles = Tiles(());
        &HERE
    }
}

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
        Avx512::detect()?;
        GRANTED.get_or_init(granted).then_some(Self(()))
    }

    /// Gives the tiles of this thread their shape, if they do not have it yet.
    pub(super) fn configure(self) -> Tiles {
        let holders = HOLDERS.get();
        if holders == 0 {
            // SAFETY: the token exists, so the instruction does and its state is enabled; it reads the 64 bytes of
            // the configuration, which is valid. Compiled code never uses tiles, so nothing of it is disturbed.
            unsafe {
                asm!("ldtilecfg [{}]", in(reg) &raw const CONFIGURATION, options(nostack, readonly));
            }
        }
        HOLDERS.set(holders + 1);
        Tiles(())
    }
}

impl Drop for Tiles {
    fn drop(&mut self) {
        let left = HOLDERS.get() - 1;
        HOLDERS.set(left);
        if left == 0 {
            // SAFETY: a `Tiles` is made only by `configure`, so the instruction exists; it gives up tile state, which
            // compiled code never uses, and which no other `Tiles` of this thread needs.
            unsafe { asm!("tilerelease", options(nostack, nomem)) }
        }
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

/// Handed out by the token: functions compiled for its features, of which those of this module take tiles in their
/// shape.
pub(super) const OPS: Ops = Ops {
    read,
    read_conv,
    read_converted,
    read_columns,
    accumulate,
    accumulate_drawn: Some(accumulate_drawn),
    accumulate_reads: None,
    drive_sums: None,
    peak: peak::amx,
    ..avx512::OPS
};

/// # Safety
/// Tiles of this thread have their shape.
#[target_feature(enable = "avx512f,avx512bw,avx512vl,avx512vnni,avx512vbmi,popcnt")]
unsafe fn read(cells: &[u8], drives: Drives<'_>, samples: Range<usize>, out: &mut [i32]) {
    // SAFETY: the caller says that tiles have their shape. Only the last `Tiles` of the thread takes it from them, and none is
    // dropped before this returns.
    let tiles = unsafe { Tiles::here() };
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
            levels_by_drives(tiles, walk, a, cells, these);
        } else {
            pair(tiles, walk, a, cells, these);
        }
        (at, out) = (at + together, rest);
    }
    if at < samples.end {
        avx512::read(cells, drives, at..samples.end, out);
    }
}

/// # Safety
/// Tiles of this thread have their shape.
#[target_feature(enable = "avx512f,avx512bw,avx512vl,avx512vnni,avx512vbmi,popcnt")]
unsafe fn read_conv(
    cells: &[u8],
    image: Image<'_>,
    (blocks, positions): (Range<usize>, Range<usize>),
    out: &mut [i32],
) -> bool {
    // SAFETY: the caller says that tiles have their shape. Only the last `Tiles` of the thread takes it from them, and none is
    // dropped before this returns.
    let tiles = unsafe { Tiles::here() };
    let offsets = image.plan().offsets().map(|offsets| &offsets[blocks]);
    offsets.is_some_and(|offsets| conv::read(tiles, cells, image, offsets, positions, out))
}

/// Converts each bank of a tile while the next one is multiplied.
///
/// # Safety
/// Tiles of this thread have their shape.
#[target_feature(enable = "avx512f,avx512bw,avx512vl,avx512vnni,avx512vbmi,popcnt")]
unsafe fn read_converted(
    banks: &Banks<'_>,
    samples: Range<usize>,
    scratch: &mut Scratch,
    codes: &mut [i16],
) -> Option<Rails> {
    // SAFETY: the caller says that tiles have their shape. Only the last `Tiles` of the thread takes it from them, and none is
    // dropped before this returns.
    let tiles = unsafe { Tiles::here() };
    let blocks = banks.drives[0].blocks();
    let mut rails = Rails::default();
    let sums = &mut scratch.currents;
    for (group, codes) in codes.as_chunks_mut::<{ Scratch::SUMS }>().0.iter_mut().enumerate() {
        let first = (samples.start + group * TOGETHER) * BLOCK_ROWS;
        let (saturated, reached) = ([[0; 32]; 2], [[0; 32]; 2]);
        let mut packed = Packed { codes: [0; Scratch::SUMS], saturated, reached };
        let tile = |tile: &Range<usize>, bank: usize| {
            let drives = banks.drives[bank];
            let size = drives.samples() * BLOCK_ROWS;
            let next = |bank: usize, block: usize| {
                let block = if block < blocks { block } else { 0 };
                [
                    banks.drives[bank].codes()[block * size + first..].as_ptr(),
                    banks.cells[bank][block * BLOCK_CELLS..].as_ptr(),
                ]
            };
            TileBank {
                drives: &drives.codes()[tile.start * size + first..tile.end * size],
                step: size,
                cells: &banks.cells[bank][tile.start * BLOCK_CELLS..tile.end * BLOCK_CELLS],
                next: if bank == 0 { next(1, tile.start) } else { next(0, tile.end) },
            }
        };
        let walk = (0..blocks).step_by(banks.tile_blocks);
        for (at, from) in walk.enumerate() {
            let blocks = from..(from + banks.tile_blocks).min(blocks);
            let [e, i] = &mut *sums;
            if at == 0 {
                // nothing to convert yet: zeros are code 0, which is no rail
                i.fill(0);
            }
            fused::converting_inhibition(
                tiles,
                tile(&blocks, 0),
                e,
                i,
                banks.conversion,
                &mut packed,
            );
            fused::converting_excitation(
                tiles,
                tile(&blocks, 1),
                i,
                e,
                banks.conversion,
                &mut packed,
            );
        }
        rails += avx512::settle(&sums[1], banks.conversion, banks.live, &mut packed, codes);
    }
    Some(rails)
}

/// # Safety
/// Tiles of this thread have their shape.
#[target_feature(enable = "avx512f,avx512bw,avx512vl,avx512vnni,avx512vbmi,popcnt")]
unsafe fn read_columns(plane: &[u8], layout: Layout, gates: Drives<'_>, out: &mut [i32]) {
    // SAFETY: the caller says that tiles have their shape. Only the last `Tiles` of the thread takes it from them, and none is
    // dropped before this returns.
    let tiles = unsafe { Tiles::here() };
    let samples = gates.samples();
    let together = samples / 32 * 32;
    let rows = layout.rows_padded();
    let mut turned = avx512::Turned::new(gates.blocks());
    for block in 0..layout.blocks() {
        avx512::turn_columns(plane, layout, block, &mut turned);
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
                levels_by_gates(tiles, walk, a, turned.groups(2 * pair), c);
            }
            if together < samples {
                let out = &mut out[together * rows + at..];
                avx512::pair(gates, together..samples, rows, &turned, pair, out);
            }
        }
    }
}

/// # Safety
/// Tiles of this thread have their shape.
#[target_feature(enable = "avx512f,avx512bw,avx512vl,avx512vnni,avx512vbmi,popcnt")]
unsafe fn accumulate_drawn(
    (turned, stride): (&[u8], usize),
    gates: &[i8],
    sums: &mut Half<i32>,
    (draws, (column, block)): (&Draws, (usize, usize)),
    words: &mut Half<u8>,
    prefetch: &Half<u8>,
) -> bool {
    // SAFETY: the caller says that tiles have their shape. Only the last `Tiles` of the thread takes it from them, and none is
    // dropped before this returns.
    let tiles = unsafe { Tiles::here() };
    if !stride.is_multiple_of(64) {
        return false;
    }
    let counter = draws.counter(64, column, block);
    let factors = Factors { turned, gates: avx512::as_bytes(gates) };
    drawn::half_block_drawn(tiles, factors, sums, (draws, counter), words, prefetch);
    true
}

/// # Safety
/// Tiles of this thread have their shape.
#[target_feature(enable = "avx512f,avx512bw,avx512vl,avx512vnni,avx512vbmi,popcnt")]
unsafe fn accumulate(turned: &[u8], stride: usize, gates: &[i8], sums: &mut Half<i32>) {
    // SAFETY: the caller says that tiles have their shape. Only the last `Tiles` of the thread takes it from them, and none is
    // dropped before this returns.
    let tiles = unsafe { Tiles::here() };
    if gates.len().is_multiple_of(HALF_CELLS) {
        half_block(tiles, stride, turned, avx512::as_bytes(gates), sums);
    } else {
        avx512::accumulate(turned, stride, gates, sums);
    }
}
