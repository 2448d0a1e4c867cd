//! The law in 32-bit lanes, written so that a compiler makes vectors of it: 16 columns at a time. Back ends inline
//! these loops into functions compiled for their processor; what they do better they write themselves.
//!
//! ```text
//! v       hold( sum * (+-mantissa), +-reach ) << up            up = F - k where k < F, else 0
//! wanted  (((v + before) >> right) + (word >> less)) >> last   rounded; half-up has the word 1
//! total   residual + rounded;  wanted = total >> F
//! ```
//!
//! Sums are 32-bit: at most 4096 * 255 * 127 * 15 < 2^31 - 2^27 in size, so adding `before <= 2^22` or a word cannot
//! wrap. Where the law shifts left by `less = bits - shift`, it is
//! `(s * 2^less + word) >> bits = (s + (word >> less)) >> shift`, as `word >> less` is the floor. For `k < F` the law
//! shifts left by `n = F - k` and no word matters: `(s * 2^(D+n) + word) >> D = s * 2^n`. The product is first held
//! to `+-2^(30-n)`: beyond `+-2^30` pulses and residual rest at their ends anyway, as `2^30` is above `128 * 2^15`.
//! Otherwise `rounded` is at most the sum, and a residual of 16 bits fits above it.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use super::{Cells, Conversion, Dither, Half, Write, WriteCounts};
use crate::chip::crossbar::layout::{BLOCK_ROWS, HALF_CELLS, HALF_COLUMNS, PANEL_COLUMNS};
use crate::num::fixed::ErrorBits;

/// [`super::scalar::convert`] where half a step and a current fit 32 bits: see [`Conversion::SHIFT_MAX`].
#[inline(always)]
pub(super) fn convert(
    [e, i]: [&[i32]; 2],
    conversion: Conversion,
    live: usize,
    codes: &mut [i16],
) -> [u64; 2] {
    let half = 1u32 << conversion.shift >> 1;
    let (shift, max) = (conversion.shift, u32::from(conversion.max));
    let alive: [u32; PANEL_COLUMNS] = std::array::from_fn(|c| u32::from(c < live));
    let mut saturated = [[0u32; PANEL_COLUMNS]; 2];
    let codes = codes.as_chunks_mut::<PANEL_COLUMNS>().0;
    let rows = e.as_chunks::<PANEL_COLUMNS>().0.iter().zip(i.as_chunks::<PANEL_COLUMNS>().0);
    for (codes, (e, i)) in codes.iter_mut().zip(rows) {
        for c in 0..PANEL_COLUMNS {
            let e = (e[c].cast_unsigned() + half) >> shift;
            let i = (i[c].cast_unsigned() + half) >> shift;
            let d = e.min(max).cast_signed() - i.min(max).cast_signed();
            codes[c] += d as i16 * alive[c] as i16;
            saturated[0][c] += u32::from(e > max) & alive[c];
            saturated[1][c] += u32::from(i > max) & alive[c];
        }
    }
    saturated.map(|counts| counts.iter().map(|&count| u64::from(count)).sum())
}

/// [`super::scalar::gate`]. An error of at most `2^(bits-1) - 1` times a derivative of at most 255 rounds to at most
/// 127 in size, for every width from 2 to 9: no gate saturates.
#[inline(always)]
pub(super) fn gate(
    errors: &[i16],
    derivatives: &[u8],
    negate: bool,
    bits: ErrorBits,
    stride: usize,
    gates: &mut [i8],
) -> u64 {
    let sign = if negate { -1 } else { 1 };
    let (half, shift) = (1 << (bits.get() - 1), bits.get());
    gates.fill(0);
    let samples = errors
        .as_chunks::<BLOCK_ROWS>()
        .0
        .iter()
        .zip(derivatives.as_chunks::<BLOCK_ROWS>().0)
        .enumerate();
    for (sample, (errors, slopes)) in samples {
        let mut row = [0; BLOCK_ROWS];
        for c in 0..BLOCK_ROWS {
            let product = i32::from(errors[c]) * sign * i32::from(slopes[c]);
            row[c] = ((product + half) >> shift).clamp(-127, 127) as i8;
        }
        for (h, row) in row.as_chunks::<HALF_COLUMNS>().0.iter().enumerate() {
            let at = h * HALF_COLUMNS * stride + sample / 4 * 64 + sample % 4;
            for (c, &gate) in row.iter().enumerate() {
                gates[at + c * 4] = gate;
            }
        }
    }
    0
}

/// Shifts and ends of a write, the same for every cell.
#[derive(Clone, Copy)]
struct Scale {
    mantissa: i32,
    reach: i32,
    up: u32,
    before: i32,
    right: u32,
    less: u32,
    last: u32,
    fraction: u32,
    bound: i32,
    floor: i32,
    ceiling: i32,
}

#[inline(always)]
fn scale(write: &Write, bits: u32) -> Scale {
    let up = write.residual_bits.saturating_sub(write.shift);
    let shift = write.shift.saturating_sub(write.residual_bits);
    // Half-up adds its 1 where others add their word: half of it before would be up to 2^30.
    let bits = if bits == 0 { 1 } else { bits };
    let (right, before, last) = if shift > bits {
        (shift - bits, if bits == 1 { 0 } else { 1 << (shift - bits - 1) }, bits)
    } else {
        (0, 0, shift)
    };
    Scale {
        mantissa: if write.negate { -write.mantissa } else { write.mantissa },
        reach: if up == 0 { i32::MAX } else { 1 << (30 - up) },
        up,
        before,
        right,
        // where the product is shifted left no word matters: all its bits go
        less: if up > 0 { 31 } else { bits.saturating_sub(shift) },
        last,
        fraction: write.residual_bits,
        bound: write.increment_max,
        floor: i32::from(write.floor),
        ceiling: i32::from(write.ceiling),
    }
}

/// [`super::scalar::program`], for writes whose numbers keep to the ranges of [`super::Write`].
#[inline(always)]
pub(super) fn program(
    cells: Cells<'_>,
    sums: &Half<i32>,
    write: &Write,
    dither: Dither<'_>,
) -> WriteCounts {
    debug_assert!(write.shift <= 31 && write.residual_bits <= 15, "shifts fit 32 bits");
    // What a write does not have is nowhere: zeros that are read and thrown away.
    let (mut high, mut residual, mut pruned) = ([0; HALF_CELLS], [0; HALF_CELLS], [0; 16]);
    let high = cells.high.unwrap_or(&mut high);
    let residual = cells.residual.unwrap_or(&mut residual);
    let mut out = cells.pulses;
    let absorbs = cells.pruned.is_some();
    let pruned = cells.pruned.unwrap_or(&mut pruned);
    let (scale, bytes, words) = match dither {
        Dither::Nearest => (scale(write, 0), None, None),
        Dither::Byte(bytes) => (scale(write, 8), Some(bytes), None),
        Dither::Word(words) => (scale(write, 16), None, Some(words)),
    };
    let mut counts = [[0u32; HALF_COLUMNS]; 4];
    for (group, pruned) in pruned.iter_mut().enumerate() {
        let from = group * 64;
        let mut drawn = [[1u32; HALF_COLUMNS]; 4];
        if let Some(bytes) = bytes {
            rows_of_bytes(bytes, from, &mut drawn);
        }
        if let Some(words) = words {
            rows_of_words(words, from, &mut drawn);
        }
        let [mut levels, mut above, mut left] = [[[0u32; HALF_COLUMNS]; 4]; 3];
        rows_of_bytes(cells.low, from, &mut levels);
        rows_of_bytes(high, from, &mut above);
        rows_of_words(residual, from, &mut left);
        let mut gone = [[0u32; HALF_COLUMNS]; 4];
        if absorbs {
            for (r, gone) in gone.iter_mut().enumerate() {
                for (c, gone) in gone.iter_mut().enumerate() {
                    *gone = u32::from(*pruned >> (c * 4 + r) & 1 == 1);
                }
            }
        }
        let mut pulses = [[0u32; HALF_COLUMNS]; 4];
        for r in 0..4 {
            for c in 0..HALF_COLUMNS {
                levels[r][c] |= above[r][c] << 8;
            }
            row(
                scale,
                sums[from + r * HALF_COLUMNS..].first_chunk().expect("16 sums a row"),
                &drawn[r],
                [&mut levels[r], &mut left[r], &mut gone[r], &mut pulses[r]],
                &mut counts,
            );
        }
        if let Some(out) = &mut out {
            let mut bytes = [0; 64];
            bytes_of_rows(&pulses, 0, &mut bytes);
            out.take(from, &bytes.map(u8::cast_signed));
        }
        bytes_of_rows(&levels, 0, &mut cells.low[from..from + 64]);
        bytes_of_rows(&levels, 8, &mut high[from..from + 64]);
        words_of_rows(&left, residual, from);
        if absorbs {
            for (r, gone) in gone.iter().enumerate() {
                for (c, &gone) in gone.iter().enumerate() {
                    *pruned |= u64::from(gone) << (c * 4 + r);
                }
            }
        }
    }
    let [requested, bounded, attempted, effective] =
        counts.map(|lanes| lanes.iter().map(|&lane| u64::from(lane)).sum());
    WriteCounts { requested, bounded, attempted, effective }
}

/// Four rows of 16 columns out of bytes in the order of levels: a column's four rows are one word.
#[inline(always)]
fn rows_of_bytes(bytes: &Half<u8>, from: usize, rows: &mut [[u32; HALF_COLUMNS]; 4]) {
    for (c, four) in bytes[from..from + 64].as_chunks::<4>().0.iter().enumerate() {
        let four = u32::from_le_bytes(*four);
        for (r, row) in rows.iter_mut().enumerate() {
            row[c] = four >> (8 * r) & 0xff;
        }
    }
}

/// The reverse of [`rows_of_bytes`], of bits `shift .. shift + 8`.
#[inline(always)]
fn bytes_of_rows(rows: &[[u32; HALF_COLUMNS]; 4], shift: u32, bytes: &mut [u8]) {
    for (c, four) in bytes.as_chunks_mut::<4>().0.iter_mut().enumerate() {
        let mut word = 0;
        for (r, row) in rows.iter().enumerate() {
            word |= (row[c] >> shift & 0xff) << (8 * r);
        }
        *four = word.to_le_bytes();
    }
}

/// Four rows of 16 columns out of 16-bit words in the order of levels.
#[inline(always)]
fn rows_of_words(words: &Half<u16>, from: usize, rows: &mut [[u32; HALF_COLUMNS]; 4]) {
    for (c, four) in words[from..from + 64].as_chunks::<4>().0.iter().enumerate() {
        for (row, &word) in rows.iter_mut().zip(four) {
            row[c] = u32::from(word);
        }
    }
}

/// The reverse of [`rows_of_words`].
#[inline(always)]
fn words_of_rows(rows: &[[u32; HALF_COLUMNS]; 4], words: &mut Half<u16>, from: usize) {
    for (c, four) in words[from..from + 64].as_chunks_mut::<4>().0.iter_mut().enumerate() {
        for (row, word) in rows.iter().zip(four) {
            *word = row[c] as u16;
        }
    }
}

/// One row of 16 cells: levels, remainders and pruned flags, and counts by lane.
#[inline(always)]
fn row(
    scale: Scale,
    sums: &[i32; HALF_COLUMNS],
    words: &[u32; HALF_COLUMNS],
    [levels, left, gone, pulsed]: [&mut [u32; HALF_COLUMNS]; 4],
    counts: &mut [[u32; HALF_COLUMNS]; 4],
) {
    let most_left = (1 << scale.fraction) - 1;
    for c in 0..HALF_COLUMNS {
        let v = (sums[c] * scale.mantissa).clamp(-scale.reach, scale.reach) << scale.up;
        let word = (words[c] >> scale.less).cast_signed();
        let rounded = (((v + scale.before) >> scale.right) + word) >> scale.last;
        let total = left[c].cast_signed() + rounded;
        let wanted = total >> scale.fraction;
        let pulses = wanted.clamp(-scale.bound, scale.bound);
        let before = levels[c].cast_signed();
        let reached = before + pulses;
        let held = reached.clamp(scale.floor, scale.ceiling);
        let level = if gone[c] != 0 { before } else { held };
        let rest = (total - (pulses << scale.fraction)).clamp(0, most_left);
        let rest = if reached < scale.floor { 0 } else { rest };
        let rest = if reached > scale.ceiling { most_left } else { rest };
        left[c] = rest.cast_unsigned();
        gone[c] |= u32::from(pulses != 0) & u32::from(level == scale.floor);
        levels[c] = level.cast_unsigned();
        pulsed[c] = pulses.cast_unsigned();
        counts[0][c] += u32::from(wanted != 0);
        counts[1][c] += u32::from(wanted != pulses);
        counts[2][c] += pulses.unsigned_abs();
        counts[3][c] += (level - before).unsigned_abs();
    }
}
