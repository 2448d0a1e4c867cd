//! The law: what every kernel computes, one cell after the other.
//!
//! ```text
//! read        v[c]   = sum_r level[r][c] * x[r]
//! transposed  v[r]   = sum_c level[r][c] * g[c]
//! sums        s[r,c] = sum_b x[b][r] * u[b][c],  negated for inhibitory pathways
//! pulses      p = clamp( SR(s * mantissa, k), -d_max, +d_max )
//! SR(s, k)    = (q + r) >> D,  q = rsh(s, k - D) or s << (D - k),  r uniform in 0..2^D-1;  D = 0: rsh(s, k)
//! residual    t = residual + SR(s * mantissa, k - F);  p = clamp(t >> F, +-d_max);  residual = clamp(t - (p << F), 0, 2^F - 1)
//! level       clamp( level + p, floor, ceiling );  a clamp that moved the level also puts the residual at that end
//! ```
//!
//! Level and residual are one number: without that, a cell pushed below its floor would keep a full residual and the
//! next small push upward would lift it. //! See docs/MODEL.md, 3.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use std::ops::Range;

use super::{Cells, Dither, Half, Write, WriteCounts};
use crate::chip::crossbar::layout::{BLOCK_CELLS, HALF_CELLS, HALF_COLUMNS, Layout, in_half};
use crate::num::draw::Place;
use crate::num::fixed::rsh;

pub(super) fn read(
    plane: &[u8],
    blocks: Range<usize>,
    drives: &[u8],
    stride: usize,
    out: &mut [i32],
) {
    for (x, out) in drives.chunks_exact(stride).zip(out.chunks_exact_mut(32)) {
        out.fill(0);
        for block in blocks.clone() {
            let cells = &plane[block * BLOCK_CELLS..][..BLOCK_CELLS];
            for (half, cells) in cells.chunks_exact(HALF_CELLS).enumerate() {
                for row in 0..64 {
                    let drive = i32::from(x[block * 64 + row]);
                    for column in 0..HALF_COLUMNS {
                        out[half * HALF_COLUMNS + column] +=
                            i32::from(cells[in_half(row, column)]) * drive;
                    }
                }
            }
        }
    }
}

pub(super) fn read_columns(plane: &[u8], layout: Layout, gates: &[u8], out: &mut [i32]) {
    let gates = gates.chunks_exact(layout.columns_padded());
    for (gates, out) in gates.zip(out.chunks_exact_mut(layout.rows_padded())) {
        for (row, out) in out.iter_mut().enumerate() {
            *out = 0;
            for (column, gate) in gates.iter().enumerate() {
                *out += i32::from(plane[layout.index(row, column)]) * i32::from(*gate);
            }
        }
    }
}

pub(super) fn accumulate(drives: &[u8], stride: usize, gates: &[i8], sums: &mut Half<i32>) {
    sums.fill(0);
    for (x, sums) in drives.chunks_exact(stride).zip(sums.chunks_exact_mut(HALF_COLUMNS)) {
        for (x, u) in x.chunks_exact(4).zip(gates.chunks_exact(64)) {
            for (sum, u) in sums.iter_mut().zip(u.chunks_exact(4)) {
                for (x, u) in x.iter().zip(u) {
                    *sum += i32::from(*x) * i32::from(*u);
                }
            }
        }
    }
}

pub(super) fn dither(place: &Place, rows: usize, column: usize, block: usize, out: &mut Half<u8>) {
    for c in 0..HALF_COLUMNS {
        let mut words = [0; 64];
        place.bytes(rows, column + c, block, &mut words);
        for (row, word) in words.iter().enumerate() {
            out[in_half(row, c)] = *word;
        }
    }
}

/// `SR(sum, k)`: rounds to units of `2^shift`, with a word of `bits` random bits.
fn round(sum: i64, shift: i64, bits: u32, word: i64) -> i64 {
    let by = shift - i64::from(bits);
    let q = match u32::try_from(by) {
        Ok(right) => rsh(sum, right),
        Err(_) => sum << by.unsigned_abs(),
    };
    (q + word) >> bits
}

pub(super) fn program(
    mut cells: Cells<'_>,
    sums: &Half<i32>,
    write: &Write,
    dither: Dither<'_>,
) -> WriteCounts {
    let mut counts = WriteCounts::default();
    let (floor, ceiling) = (i64::from(write.floor), i64::from(write.ceiling));
    let bound = i64::from(write.increment_max);
    let fraction = write.residual_bits;
    for row in 0..64 {
        for column in 0..HALF_COLUMNS {
            let at = in_half(row, column);
            // a pruned cell takes pulses and does not move: attempted, not effective
            let gone = cells.pruned.as_ref().is_some_and(|pruned| pruned[at] != 0);
            let sum = i64::from(sums[row * HALF_COLUMNS + column]) * i64::from(write.mantissa);
            let sum = if write.negate { -sum } else { sum };
            let shift = i64::from(write.shift) - i64::from(fraction);
            let rounded = match dither {
                Dither::Nearest => round(sum, shift, 0, 0),
                Dither::Byte(words) => round(sum, shift, 8, i64::from(words[at])),
                Dither::Word(words) => round(sum, shift, 16, i64::from(words[at])),
            };
            let remainder = cells.residual.as_ref().map_or(0, |residual| i64::from(residual[at]));
            let total = remainder + rounded;
            let wanted = total >> fraction;
            let pulses = wanted.clamp(-bound, bound);

            let high = cells.high.as_ref().map_or(0, |high| i64::from(high[at]));
            let before = i64::from(cells.low[at]) + (high << 8);
            let level = if gone { before } else { (before + pulses).clamp(floor, ceiling) };
            cells.low[at] = (level & 0xff) as u8;
            if let Some(high) = cells.high.as_mut() {
                high[at] = (level >> 8) as u8;
            }
            if let Some(residual) = cells.residual.as_mut() {
                let (least, most) = (0, (1 << fraction) - 1);
                let left = match before + pulses {
                    reached if reached < floor => least,
                    reached if reached > ceiling => most,
                    _ => (total - (pulses << fraction)).clamp(least, most),
                };
                residual[at] = u16::try_from(left).expect("at most 15 fractional bits");
            }
            if let Some(pruned) = cells.pruned.as_mut() {
                pruned[at] = u8::from(gone || (pulses != 0 && level == floor));
            }
            counts.requested += u64::from(wanted != 0);
            counts.bounded += u64::from(wanted != pulses);
            counts.attempted += pulses.unsigned_abs();
            counts.effective += (level - before).unsigned_abs();
        }
    }
    counts
}
