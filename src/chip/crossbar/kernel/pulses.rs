//! Third step of a write: requests are rounded with a random word, put on top of the remainder, and bounded.
//!
//! ```text
//! SR(a, k)  q = rsh(a, k - D), or a << (D - k);   (q + r) >> D        r a word of D bits;  D = 0: rsh(a, k)
//! total     t = residual + SR(amount, shift);   wanted = t >> F
//! pulses    clamp( wanted, -d_max, +d_max )
//! residual  clamp( t - (pulses << F), 0, 2^F - 1 )
//! may_move  a group of four rows with a q that is not 0:  all others give no pulse, whatever their words
//! ```
//!
//! The law is for one cell. Its twin takes a column of four rows at a time, which is a word of four bytes in the order of
//! levels, so that compilers make vectors of 16 columns; back ends compile it for their processor. There:
//!
//! ```text
//! rounded  (((v + before) >> right) + (word >> less)) >> last          before = 2^(right - 1), or 0
//! ```
//!
//! Narrow sums are at most 4096 * 255 * 127 * 15 < 2^31 - 2^27 in size, wide ones 2^62, so adding `before` or a word cannot
//! wrap. Where the law shifts left by `less = D - shift`, it is `(s * 2^less + word) >> D = (s + (word >> less)) >> shift`,
//! as `word >> less` is the floor. Half-up is the word 128 of 8 bits, if what lies below is cut off instead of rounded:
//! `((v >> (k - 8)) + 128) >> 8 = (v + 2^(k-1)) >> k`. For `k < F` the law shifts left by `n = F - k` and no word matters:
//! `(s * 2^(D+n) + word) >> D = s * 2^n`. The product is first held to `+-2^(30-n)`, and so is what wide sums are rounded
//! to: beyond `+-2^30` pulses and residual rest at their ends anyway, as `2^30` is above `128 * 2^15`. Otherwise a narrow
//! sum is rounded to at most itself, and a residual of 16 bits fits above it. See docs/MODEL.md, 3.3.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use std::ops::BitOr;

use super::requests::{self, Plain, Request};
use super::{Cells, Dither, Half, Sums, WriteCounts, WriteLaw};
use crate::chip::crossbar::layout::{BLOCK_ROWS, HALF_CELLS, HALF_COLUMNS, in_half};
use crate::num::fixed::rsh;

/// Half a pulse, as words of 8 bits have it: what half-up rounds with.
pub(super) static HALVES: Half<u8> = [128; HALF_CELLS];
static NO_WORDS: Half<u16> = [0; HALF_CELLS];

/// The request in units of `2^-bits` steps, before a word is added. Shifted out of 64 bits it is far outside every bound,
/// and so is the end of 64 bits.
fn quotient(Request { amount, shift }: Request, bits: u32) -> i64 {
    match u32::try_from(shift - i64::from(bits)) {
        Ok(right) => rsh(amount, right),
        Err(_) => amount.saturating_mul(1 << (i64::from(bits) - shift)),
    }
}

/// What a cell wants, what it is given of that, and what remains.
struct Given {
    wanted: i64,
    pulses: i64,
    left: i64,
}

/// The law: a cell with a remainder asks for something, and is given it with a word of some bits.
fn given(residual: i64, request: Request, (word, bits): (i64, u32), write: &WriteLaw) -> Given {
    let (bound, fraction) = (i64::from(write.increment_max), write.residual_bits);
    let rounded = quotient(request, bits).saturating_add(word) >> bits;
    let total = rounded.saturating_add(residual);
    let wanted = total >> fraction;
    let pulses = wanted.clamp(-bound, bound);
    let left = (total - (pulses << fraction)).clamp(0, (1 << fraction) - 1);
    Given { wanted, pulses, left }
}

/// The law for a half block. Where groups are passed over, `out` is left as it is.
pub(super) fn law(
    sums: Sums<'_>,
    write: &WriteLaw,
    dither: Dither<'_>,
    cells: &mut Cells<'_>,
    out: &mut Half<i8>,
) -> WriteCounts {
    let mut counts = WriteCounts::default();
    for row in (0..BLOCK_ROWS).filter(|row| write.groups >> (row / 4) & 1 == 1) {
        for column in 0..HALF_COLUMNS {
            let at = in_half(row, column);
            let residual = cells.residual.as_ref().map_or(0, |residual| i64::from(residual[at]));
            let word = match dither {
                Dither::Nearest => (0, 0),
                Dither::Byte(words) => (words[at].into(), 8),
                Dither::Word(words) => (words[at].into(), 16),
            };
            let request = requests::plain(sums.at(row, column), write);
            let Given { wanted, pulses, left } = given(residual, request, word, write);
            if let Some(residual) = &mut cells.residual {
                residual[at] = u16::try_from(left).expect("at most 15 fractional bits");
            }
            out[at] = pulses as i8;
            if let Some(told) = &mut cells.pulses {
                told.take(at, &[pulses as i8]);
            }
            counts.requested += u64::from(wanted != 0);
            counts.bounded += u64::from(wanted != pulses);
            counts.attempted += pulses.unsigned_abs();
        }
    }
    counts
}

/// The law of groups that may move, a bit each.
pub(super) fn may_move(sums: Sums<'_>, write: &WriteLaw, bits: u32) -> u16 {
    let moves = |row: usize| {
        let mut requests = (0..HALF_COLUMNS).map(|c| requests::plain(sums.at(row, c), write));
        requests.any(|request| quotient(request, bits) != 0)
    };
    (0..BLOCK_ROWS).fold(0, |mask, row| mask | u16::from(moves(row)) << (row / 4))
}

/// Cells that are looked at together.
pub(super) const LANES: usize = 16;

/// Shifts and ends of a write, the same for every cell.
#[derive(Clone, Copy)]
pub(super) struct Scale {
    plain: Plain,
    before: i64,
    right: u32,
    less: u32,
    last: u32,
    /// Left shift, of remainders that are finer than the shift; what is shifted is held to `reach` on both sides.
    up: u32,
    reach: i32,
    bound: i32,
    fraction: u32,
}

impl Scale {
    /// Of words of 8 bits, or 16; half-up (`nearest`) is the word [`HALVES`].
    #[inline(always)]
    fn new(write: &WriteLaw, bits: u32, nearest: bool) -> Self {
        let up = write.residual_bits.saturating_sub(write.shift);
        let shift = write.shift.saturating_sub(write.residual_bits);
        let right = shift.saturating_sub(bits);
        let before = if nearest { 0 } else { 1i64 << right >> 1 };
        Self {
            plain: Plain::new(write),
            before,
            right,
            // where the product is shifted left no word matters: all its bits go
            less: if up > 0 { 31 } else { bits.saturating_sub(shift) },
            last: shift.min(bits),
            up,
            reach: 1 << (30 - up),
            bound: write.increment_max,
            fraction: write.residual_bits,
        }
    }
}

/// No remainder.
const NONE: u8 = 0;
/// A remainder that is no finer than the shift.
const COARSE: u8 = 1;
/// A remainder that is finer than the shift: products are shifted left.
const FINE: u8 = 2;

/// Lanes that sums come in.
trait Lane: Copy + Default + PartialEq + BitOr<Output = Self> {
    /// The request, cut or rounded to what words are added to.
    fn quotient(self, scale: &Scale) -> Self;

    /// Rounded with a word, in steps of the remainder.
    fn rounded<const RESIDUAL: u8>(self, word: u32, scale: &Scale) -> i32;

    /// Not 0 where a request that is rounded to units of `2^by` may move a cell.
    fn loudness(self, plain: Plain, by: u32) -> Self;
}

impl Lane for i32 {
    #[inline(always)]
    fn quotient(self, scale: &Scale) -> Self {
        // at most half of 2^31
        (scale.plain.narrow(self) + scale.before as i32) >> scale.right
    }

    #[inline(always)]
    fn rounded<const RESIDUAL: u8>(self, word: u32, scale: &Scale) -> i32 {
        let rounded = (self + (word >> scale.less).cast_signed()) >> scale.last;
        // else nothing is shifted left
        if RESIDUAL == FINE {
            rounded.min(scale.reach).max(-scale.reach) << scale.up
        } else {
            rounded
        }
    }

    #[inline(always)]
    fn loudness(self, plain: Plain, by: u32) -> Self {
        // half of 2^31 beside the greatest sum wraps, and has the top bit as one that is too small
        let v = plain.narrow(self).wrapping_add((1u32 << by >> 1).cast_signed());
        (v.cast_unsigned() >> by).cast_signed()
    }
}

impl Lane for i64 {
    #[inline(always)]
    fn quotient(self, scale: &Scale) -> Self {
        (scale.plain.wide(self) + scale.before) >> scale.right
    }

    #[inline(always)]
    fn rounded<const RESIDUAL: u8>(self, word: u32, scale: &Scale) -> i32 {
        let rounded = (self + i64::from(word >> scale.less)) >> scale.last;
        let reach = i64::from(scale.reach);
        (rounded.min(reach).max(-reach) as i32) << scale.up
    }

    #[inline(always)]
    fn loudness(self, plain: Plain, by: u32) -> Self {
        (plain.wide(self) + (1i64 << by >> 1)) >> by
    }
}

/// [`law`], as compilers make vectors of it.
#[inline(always)]
pub(super) fn twin(
    sums: Sums<'_>,
    write: &WriteLaw,
    dither: Dither<'_>,
    cells: &mut Cells<'_>,
    out: &mut Half<i8>,
) -> WriteCounts {
    match sums {
        Sums::Narrow(sums) => of_lanes(sums, write, dither, cells, out),
        Sums::Wide(sums) => of_lanes(sums, write, dither, cells, out),
    }
}

/// [`may_move`], as compilers make vectors of it.
#[inline(always)]
pub(super) fn may_move_twin(sums: Sums<'_>, write: &WriteLaw, bits: u32) -> u16 {
    match sums {
        Sums::Narrow(sums) => moving_lanes(sums, write, bits),
        Sums::Wide(sums) => moving_lanes(sums, write, bits),
    }
}

#[inline(always)]
fn moving_lanes<L: Lane>(sums: &Half<L>, write: &WriteLaw, bits: u32) -> u16 {
    let by = write.shift.saturating_sub(write.residual_bits).saturating_sub(bits);
    let plain = Plain::new(write);
    let mut moving = 0;
    for (group, sums) in sums.as_chunks::<64>().0.iter().enumerate() {
        let any = sums.iter().fold(L::default(), |any, sum| any | sum.loudness(plain, by));
        moving |= u16::from(any != L::default()) << group;
    }
    moving
}

#[inline(always)]
fn of_lanes<L: Lane>(
    sums: &Half<L>,
    write: &WriteLaw,
    dither: Dither<'_>,
    cells: &mut Cells<'_>,
    out: &mut Half<i8>,
) -> WriteCounts {
    // words that a write does not have are not read
    let (words, wide) = match dither {
        Dither::Nearest => ((&HALVES, &NO_WORDS), false),
        Dither::Byte(bytes) => ((bytes, &NO_WORDS), false),
        Dither::Word(words) => ((&HALVES, words), true),
    };
    let kind = match write.residual_bits {
        0 => NONE,
        bits if bits <= write.shift => COARSE,
        _ => FINE,
    };
    let scale = Scale::new(write, if wide { 16 } else { 8 }, matches!(dither, Dither::Nearest));
    let by = (scale, write.groups);
    match (wide, kind) {
        (false, NONE) => of_cells::<L, false, NONE>(sums, by, words, cells, out),
        (false, COARSE) => of_cells::<L, false, COARSE>(sums, by, words, cells, out),
        (false, _) => of_cells::<L, false, FINE>(sums, by, words, cells, out),
        (true, NONE) => of_cells::<L, true, NONE>(sums, by, words, cells, out),
        (true, COARSE) => of_cells::<L, true, COARSE>(sums, by, words, cells, out),
        (true, _) => of_cells::<L, true, FINE>(sums, by, words, cells, out),
    }
}

#[inline(always)]
fn of_cells<L: Lane, const WORDS: bool, const RESIDUAL: u8>(
    sums: &Half<L>,
    (scale, groups): (Scale, u16),
    (bytes, words): (&Half<u8>, &Half<u16>),
    cells: &mut Cells<'_>,
    out: &mut Half<i8>,
) -> WriteCounts {
    let mut tally = [[0; LANES]; 3];
    let mut none = [0; 64];
    for group in (0..HALF_CELLS / 64).filter(|group| groups >> group & 1 == 1) {
        let sums = &sums.as_chunks::<64>().0[group];
        let (bytes, words) = (&bytes.as_chunks().0[group], &words.as_chunks().0[group]);
        let left = match &mut cells.residual {
            Some(residual) if RESIDUAL != NONE => &mut residual.as_chunks_mut().0[group],
            _ => &mut none,
        };
        let out = &mut out.as_chunks_mut().0[group];
        lanes::<L, WORDS, RESIDUAL>(sums, (bytes, words), left, out, scale, &mut tally);
    }
    if let Some(told) = &mut cells.pulses {
        for group in (0..HALF_CELLS / 64).filter(|group| groups >> group & 1 == 1) {
            told.take(group * 64, &out.as_chunks::<64>().0[group]);
        }
    }
    let [requested, bounded, attempted] = [0, 1, 2].map(|of| total(&tally[of]));
    WriteCounts { requested, bounded, attempted, effective: 0 }
}

/// 64 cells.
#[inline(always)]
fn lanes<L: Lane, const WORDS: bool, const RESIDUAL: u8>(
    sums: &[L; 64],
    (bytes, words): (&[u8; 64], &[u16; 64]),
    left: &mut [u16; 64],
    out: &mut [i8; 64],
    scale: Scale,
    [requested, bounded, attempted]: &mut [[u32; LANES]; 3],
) {
    let most_left = (1 << scale.fraction) - 1;
    // copies, which compilers know to lie nowhere else
    let (mut rest, mut given) = (*left, [0; 64]);
    // a column's four rows side by side, as everything but sums lies
    let mut quotients = [L::default(); 64];
    for c in 0..HALF_COLUMNS {
        for r in 0..4 {
            quotients[4 * c + r] = sums[HALF_COLUMNS * r + c].quotient(&scale);
        }
    }
    for quarter in 0..64 / LANES {
        for lane in 0..LANES {
            let i = quarter * LANES + lane;
            let word = if WORDS { words[i].into() } else { bytes[i].into() };
            let rounded = quotients[i].rounded::<RESIDUAL>(word, &scale);
            let total = if RESIDUAL != NONE { i32::from(rest[i]) + rounded } else { rounded };
            let wanted = if RESIDUAL != NONE { total >> scale.fraction } else { total };
            let pulses = wanted.min(scale.bound).max(-scale.bound);
            if RESIDUAL != NONE {
                rest[i] = (total - (pulses << scale.fraction)).min(most_left).max(0) as u16;
            }
            // the bound is at least 1, so no pulses are given exactly where none are wanted
            requested[lane] += u32::from(pulses != 0);
            bounded[lane] += u32::from(wanted != pulses);
            attempted[lane] += pulses.unsigned_abs();
            given[i] = pulses as i8;
        }
    }
    (*left, *out) = (rest, given);
}

/// The sum of what lanes counted.
#[inline(always)]
pub(super) fn total(lanes: &[u32; LANES]) -> u64 {
    lanes.iter().sum::<u32>().into()
}
