//! What a back end does: a table with a function an operation.
//!
//! An operation is declared here, once. A back end's table has its own functions and takes all others from the table it
//! builds on: that of the law, or of a smaller back end. What an operation does, and what has been checked of its
//! arguments, is said at the method of [`Kernel`](super::Kernel) that bears its name.
//!
//! Functions are `unsafe` to call, because they are compiled for features of the processor, and some need tiles in their
//! shape. Only a token hands out its table, and only a kernel that holds what the token stands for calls from it.
//!
//! What gives a `bool` or an `Option` may decline: then nothing was done, and the kernel composes it of other operations.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use std::ops::Range;

use super::respond::{Sent, Words};
use super::{
    Banks, Cells, Conversion, Dither, Draws, Drives, Ends, Extremes, Half, HandOn, Image, LookUp,
    MiddleOf, OneSample, Peaks, Rails, Scratch, SignLaw, Squares, Sums, WriteCounts, WriteLaw,
};
use crate::chip::crossbar::layout::{BLOCK_ROWS, HALF_COLUMNS, Layout, PANEL_COLUMNS};
use crate::chip::device::DeviceLanes;
use crate::num::fixed::ErrorBits;

/// The operations of a back end.
#[derive(Debug)]
#[expect(
    clippy::type_complexity,
    reason = "this is where a signature is written, and the only place"
)]
pub(super) struct Ops {
    pub(super) read: unsafe fn(&[u8], Drives<'_>, Range<usize>, &mut [i32]),
    /// Where reads take what the drives of each sample add up to.
    pub(super) drive_sums: Option<unsafe fn(Drives<'_>, &mut [i32])>,
    pub(super) read_conv:
        unsafe fn(&[u8], Image<'_>, (Range<usize>, Range<usize>), &mut [i32]) -> bool,
    /// Of whole groups of [`TOGETHER`](super::TOGETHER) samples.
    pub(super) read_converted:
        unsafe fn(&Banks<'_>, Range<usize>, &mut Scratch, &mut [i16]) -> Option<Rails>,
    pub(super) convert: unsafe fn([&[i32]; 2], Conversion, usize, &mut [i16]) -> Rails,
    pub(super) look_up: unsafe fn(&[i32], &LookUp, usize, &mut [u8], &mut [u8]) -> u64,
    pub(super) offset: unsafe fn(&mut [i32], &[i32; PANEL_COLUMNS], u32, &mut [i64; PANEL_COLUMNS]),
    pub(super) index_squares: unsafe fn(&[i32], u32, i32, usize) -> u64,
    /// All that a panel of units with a middle puts out, where a back end does that at once; squares of places, and saturated
    /// ones.
    pub(super) put_out: Option<
        unsafe fn(
            &[i32],
            (MiddleOf<'_>, &LookUp),
            usize,
            &mut [i64; PANEL_COLUMNS],
            (&mut [u8], &mut [u8]),
        ) -> Option<[u64; 2]>,
    >,
    pub(super) difference: unsafe fn([&[i32]; 2], &mut [i32]),
    pub(super) stream_squares: unsafe fn(&[i32], &mut [u64]),
    pub(super) scale: unsafe fn(&[i32], &[u64], HandOn, &mut [u8], &mut [u8]) -> u64,
    pub(super) latch: unsafe fn(&[i16], usize, &[u16], &mut [i16]),
    pub(super) gate: unsafe fn(&[i16], &[u8], bool, ErrorBits, usize, &mut [i8]) -> u64,
    /// Of words that so many samples in a row share, where a back end does that.
    pub(super) gate_shared:
        Option<unsafe fn((&[i16], usize), &[u8], bool, ErrorBits, usize, &mut [i8]) -> u64>,
    pub(super) turn: unsafe fn(&[u8], usize, &mut [u8]),
    pub(super) read_columns: unsafe fn(&[u8], Layout, Drives<'_>, &mut [i32]),
    /// Of as many samples as gates say, of rows that lie a stride apart.
    pub(super) accumulate: unsafe fn(&[u8], usize, &[i8], &mut Half<i32>),
    /// Where it is faster than one after the other.
    pub(super) accumulate_drawn: Option<
        unsafe fn(
            (&[u8], usize),
            &[i8],
            &mut Half<i32>,
            (&Draws, (usize, usize)),
            &mut Half<u8>,
            &Half<u8>,
        ) -> bool,
    >,
    /// Where a back end takes many reads at once, of codes as reads lie and rows that exist, and of gates and their stride;
    /// otherwise they are turned some at a time.
    pub(super) accumulate_reads:
        Option<unsafe fn((&[u8], usize), (&[i8], usize, usize), &mut [Half<i32>])>,
    pub(super) dither: unsafe fn(&Draws, usize, usize, &mut Half<u8>),
    pub(super) dither_words: unsafe fn(&Draws, usize, usize, &mut Half<u16>),
    pub(super) may_move: unsafe fn(Sums<'_>, &WriteLaw, u32) -> u16,
    pub(super) pulses:
        unsafe fn(Sums<'_>, &WriteLaw, Dither<'_>, &mut Cells<'_>, &mut Half<i8>) -> WriteCounts,
    pub(super) levels: unsafe fn(&mut Cells<'_>, &Half<i8>, Ends, u16) -> u64,
    /// A pulse of cells that are not ideal, where a back end does that side by side.
    pub(super) pulse: Option<unsafe fn(&mut Sent, &DeviceLanes<'_>, Words<'_>, usize) -> u64>,
    pub(super) centre: unsafe fn(&mut Half<i32>, &[i32; BLOCK_ROWS], &[i32; HALF_COLUMNS]),
    pub(super) gate_totals: unsafe fn(&[i8]) -> [i32; HALF_COLUMNS],
    pub(super) drive_totals: unsafe fn(&[u8], usize) -> [u32; BLOCK_ROWS],
    pub(super) squares: unsafe fn(&Half<i32>, bool) -> Squares,
    pub(super) loud: unsafe fn(&Half<i32>, u32) -> u16,
    pub(super) signs: unsafe fn(
        &Half<i32>,
        &SignLaw,
        Option<&Half<u16>>,
        &mut Cells<'_>,
        &mut Half<i8>,
    ) -> WriteCounts,
    /// Both at once, for writes as they usually are.
    pub(super) fused:
        unsafe fn(&mut Cells<'_>, &Half<i32>, &WriteLaw, Dither<'_>) -> Option<WriteCounts>,
    pub(super) one_sample: unsafe fn(OneSample<'_>) -> Option<WriteCounts>,
    pub(super) peaks: unsafe fn(&Extremes) -> Peaks,
    pub(super) peak: unsafe fn(usize) -> u64,
}

/// Compiles twins of a write's steps and of offsets for features of the processor. Where the whole program is compiled for them, tables have
/// the twins themselves.
#[cfg(target_arch = "x86_64")]
macro_rules! twins {
    ($features:literal) => {
        #[target_feature(enable = $features)]
        fn may_move(sums: Sums<'_>, write: &WriteLaw, bits: u32) -> u16 {
            crate::chip::crossbar::kernel::pulses::may_move_twin(sums, write, bits)
        }

        #[target_feature(enable = $features)]
        fn pulses(
            sums: Sums<'_>,
            write: &WriteLaw,
            dither: Dither<'_>,
            cells: &mut Cells<'_>,
            out: &mut Half<i8>,
        ) -> WriteCounts {
            crate::chip::crossbar::kernel::pulses::twin(sums, write, dither, cells, out)
        }

        #[target_feature(enable = $features)]
        fn levels(cells: &mut Cells<'_>, pulses: &Half<i8>, ends: Ends, groups: u16) -> u64 {
            crate::chip::crossbar::kernel::levels::twin(cells, pulses, ends, groups)
        }

        #[target_feature(enable = $features)]
        fn pulse(
            sent: &mut crate::chip::crossbar::kernel::respond::Sent,
            device: &crate::chip::device::DeviceLanes<'_>,
            words: crate::chip::crossbar::kernel::respond::Words<'_>,
            active: usize,
        ) -> u64 {
            crate::chip::crossbar::kernel::respond::pulse(sent, device, words, active)
        }

        #[target_feature(enable = $features)]
        fn offset(
            sums: &mut [i32],
            offsets: &[i32; crate::chip::crossbar::layout::PANEL_COLUMNS],
            raise: u32,
            totals: &mut [i64; crate::chip::crossbar::layout::PANEL_COLUMNS],
        ) {
            crate::chip::crossbar::kernel::offsets::offset(sums, offsets, raise, totals);
        }

        #[target_feature(enable = $features)]
        fn index_squares(sums: &[i32], shift: u32, half: i32, live: usize) -> u64 {
            crate::chip::crossbar::kernel::offsets::index_squares(sums, shift, half, live)
        }

        #[target_feature(enable = $features)]
        fn gate_totals(gates: &[i8]) -> [i32; HALF_COLUMNS] {
            crate::chip::crossbar::kernel::optimise::gate_totals(gates)
        }

        #[target_feature(enable = $features)]
        fn drive_totals(turned: &[u8], stride: usize) -> [u32; BLOCK_ROWS] {
            crate::chip::crossbar::kernel::optimise::drive_totals(turned, stride)
        }

        #[target_feature(enable = $features)]
        fn loud(sums: &Half<i32>, least: u32) -> u16 {
            crate::chip::crossbar::kernel::optimise::loud(sums, least)
        }

        #[target_feature(enable = $features)]
        fn signs(
            sums: &Half<i32>,
            law: &SignLaw,
            words: Option<&Half<u16>>,
            cells: &mut Cells<'_>,
            out: &mut Half<i8>,
        ) -> WriteCounts {
            crate::chip::crossbar::kernel::optimise::signs(sums, law, words, cells, out)
        }
    };
}

#[cfg(target_arch = "x86_64")]
pub(super) use twins;
