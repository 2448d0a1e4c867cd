//! The law: what every kernel computes, one cell after the other.
//!
//! ```text
//! read        v[c]   = sum_r level[r][c] * x[r]
//! transposed  v[r]   = sum_c level[r][c] * g[c]
//! converted   code[c] += min( rsh(v_E, ash), max ) - min( rsh(v_I, ash), max )      tile by tile
//! look-up     i = clamp( rsh(acc, lsh), -half, half - 1 );  value, derivative = table[i]
//! gate        u = sat_8( rsh( err * a', error_bits ) )
//! sums        s[r,c] = sum_b x[b][r] * u[b][c],  negated for inhibitory pathways
//! pulses      p = clamp( SR(s * mantissa, k), -d_max, +d_max )
//! SR(s, k)    = (q + r) >> D,  q = rsh(s, k - D) or s << (D - k),  r uniform in 0..2^D-1;  D = 0: rsh(s, k)
//! residual    t = residual + SR(s * mantissa, k - F);  p = clamp(t >> F, +-d_max);  residual = clamp(t - (p << F), 0, 2^F - 1)
//! level       clamp( level + p, floor, ceiling );  a clamp that moved the level also puts the residual at that end
//! ```
//!
//! Level and residual are one number: without that, a cell pushed below its floor would keep a full residual and the
//! next small push upward would lift it. See docs/MODEL.md, 2 and 3.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use std::ops::Range;

use super::{
    Cells, ConvScratch, Conversion, Dither, Draws, Drives, Extremes, Half, Image, LookUp, Loops,
    Peaks, Write, WriteCounts, conv,
};
use crate::chip::crossbar::layout::{
    BLOCK_CELLS, BLOCK_ROWS, HALF_CELLS, HALF_COLUMNS, Layout, PANEL_COLUMNS, in_half,
};
use crate::num::fixed::{ErrorBits, rsh, sat};

/// The law as a back end.
#[derive(Debug, Clone, Copy)]
pub(super) struct Scalar;

impl Loops for Scalar {
    fn read_conv(
        self,
        cells: &[u8],
        image: Image<'_>,
        range: (Range<usize>, Range<usize>),
        _: &mut ConvScratch,
        out: &mut [i32],
    ) {
        conv::read(cells, image, range, out);
    }

    fn read(self, cells: &[u8], drives: Drives<'_>, samples: Range<usize>, out: &mut [i32]) {
        for (sample, out) in samples.zip(out.chunks_exact_mut(PANEL_COLUMNS)) {
            out.fill(0);
            for (block, cells) in cells.chunks_exact(BLOCK_CELLS).enumerate() {
                let x = drives.row(block, sample);
                for (half, cells) in cells.chunks_exact(HALF_CELLS).enumerate() {
                    for (row, &drive) in x.iter().enumerate() {
                        for column in 0..HALF_COLUMNS {
                            out[half * HALF_COLUMNS + column] +=
                                i32::from(cells[in_half(row, column)]) * i32::from(drive);
                        }
                    }
                }
            }
        }
    }

    fn accumulate(self, turned: &[u8], stride: usize, gates: &[i8], sums: &mut Half<i32>) {
        sums.fill(0);
        for (x, sums) in turned.chunks(stride).zip(sums.chunks_exact_mut(HALF_COLUMNS)) {
            for (x, u) in x.chunks_exact(4).zip(gates.chunks_exact(64)) {
                for (sum, u) in sums.iter_mut().zip(u.chunks_exact(4)) {
                    for (x, u) in x.iter().zip(u) {
                        *sum += i32::from(*x) * i32::from(*u);
                    }
                }
            }
        }
    }
}

pub(super) fn convert(
    currents: [&[i32]; 2],
    conversion: Conversion,
    live: usize,
    codes: &mut [i16],
) -> [u64; 2] {
    let mut saturated = [0; 2];
    for (at, code) in codes.iter_mut().enumerate() {
        if at % PANEL_COLUMNS >= live {
            continue;
        }
        let bank = |bank: usize| rsh(i64::from(currents[bank][at]), conversion.shift);
        let max = i64::from(conversion.max);
        let steps = [bank(0), bank(1)];
        *code += (steps[0].min(max) - steps[1].min(max)) as i16;
        saturated.iter_mut().zip(steps).for_each(|(count, steps)| *count += u64::from(steps > max));
    }
    saturated
}

pub(super) fn look_up(
    accumulators: &[i32],
    table: &LookUp,
    live: usize,
    values: &mut [u8],
    derivatives: &mut [u8],
) -> u64 {
    let half = (table.entries.len() / 2) as i64;
    let mut saturated = 0;
    for (sample, accumulators) in accumulators.chunks_exact(PANEL_COLUMNS).enumerate() {
        for (column, &accumulator) in accumulators.iter().enumerate() {
            let at = sample * BLOCK_ROWS + column;
            let steps = rsh(i64::from(accumulator), table.shift);
            let i = steps.clamp(-half, half - 1);
            let entry = if column < live { table.entries[(i + half) as usize] } else { 0 };
            [values[at], derivatives[at], ..] = entry.to_le_bytes();
            saturated += u64::from(column < live && i != steps);
        }
    }
    saturated
}

#[inline(always)]
pub(super) fn difference([e, i]: [&[i32]; 2], sums: &mut [i32]) {
    for (sum, (e, i)) in sums.iter_mut().zip(e.iter().zip(i)) {
        *sum = e - i;
    }
}

pub(super) fn latch(words: &[i16], width: usize, taps: &[u16], errors: &mut [i16]) {
    for (words, errors) in words.chunks_exact(width).zip(errors.chunks_exact_mut(BLOCK_ROWS)) {
        let (errors, beyond) = errors.split_at_mut(taps.len());
        beyond.fill(0);
        for (error, &tap) in errors.iter_mut().zip(taps) {
            *error = words[usize::from(tap)];
        }
    }
}

pub(super) fn gate(
    errors: &[i16],
    derivatives: &[u8],
    negate: bool,
    bits: ErrorBits,
    stride: usize,
    gates: &mut [i8],
) -> u64 {
    gates.fill(0);
    let mut saturated = 0;
    for (at, (&error, &slope)) in errors.iter().zip(derivatives).enumerate() {
        let (sample, column) = (at / BLOCK_ROWS, at % BLOCK_ROWS);
        let error = if negate { -i64::from(error) } else { i64::from(error) };
        let (u, changed) = sat(rsh(error * i64::from(slope), bits.get()), 8);
        let half = column / HALF_COLUMNS * HALF_COLUMNS * stride;
        gates[half + sample / 4 * 64 + column % HALF_COLUMNS * 4 + sample % 4] = u as i8;
        saturated += u64::from(changed);
    }
    saturated
}

pub(super) fn turn(codes: &[u8], stride: usize, turned: &mut [u8]) {
    turned.fill(0);
    for (sample, codes) in codes.chunks_exact(BLOCK_ROWS).enumerate() {
        for (row, &code) in codes.iter().enumerate() {
            turned[row * stride + sample] = code;
        }
    }
}

pub(super) fn read_columns(plane: &[u8], layout: Layout, gates: Drives<'_>, out: &mut [i32]) {
    for (sample, out) in out.chunks_exact_mut(layout.rows_padded()).enumerate() {
        for (row, out) in out.iter_mut().enumerate() {
            *out = 0;
            for column in 0..layout.columns {
                let gate = gates.row(column / BLOCK_ROWS, sample)[column % BLOCK_ROWS];
                *out += i32::from(plane[layout.index(row, column)]) * i32::from(gate.cast_signed());
            }
        }
    }
}

pub(super) fn dither(draws: &Draws, column: usize, block: usize, words: &mut Half<u8>) {
    for c in 0..HALF_COLUMNS {
        let mut bytes = [0; 64];
        draws.place().bytes(draws.rows(), column + c, block, &mut bytes);
        for (row, byte) in bytes.iter().enumerate() {
            words[in_half(row, c)] = *byte;
        }
    }
}

/// Rows of a group beyond the last one have words that nobody reads.
pub(super) fn dither_words(draws: &Draws, column: usize, block: usize, words: &mut Half<u16>) {
    let rows = draws.rows();
    for (c, group) in (0..HALF_COLUMNS).flat_map(|c| [(c, 0), (c, 1)]) {
        if (2 * block + group) * 32 < rows {
            let drawn = draws.place().halves(rows, column + c, 2 * block + group);
            for (row, word) in drawn.into_iter().enumerate() {
                words[in_half(32 * group + row, c)] = word;
            }
        }
    }
}

/// The sum in units of `2^-bits` pulses, before a word is added.
fn quotient(sum: i64, shift: i64, bits: u32) -> i64 {
    let by = shift - i64::from(bits);
    match u32::try_from(by) {
        Ok(right) => rsh(sum, right),
        Err(_) => sum << by.unsigned_abs(),
    }
}

/// `SR(sum, k)`: rounds to units of `2^shift`, with a word of `bits` random bits.
fn round(sum: i64, shift: i64, bits: u32, word: i64) -> i64 {
    (quotient(sum, shift, bits) + word) >> bits
}

/// The sum that is rounded, and by how much.
fn scaled(sum: i32, write: &Write) -> (i64, i64) {
    let sum = i64::from(sum) * i64::from(write.mantissa);
    let sum = if write.negate { -sum } else { sum };
    (sum, i64::from(write.shift) - i64::from(write.residual_bits))
}

pub(super) fn loud(sums: &Half<i32>, write: &Write, bits: u32) -> u16 {
    let loud = |&sum: &i32| {
        let (sum, shift) = scaled(sum, write);
        quotient(sum, shift, bits) != 0
    };
    let groups = sums.chunks_exact(4 * HALF_COLUMNS).enumerate();
    groups.fold(0, |mask, (group, sums)| mask | u16::from(sums.iter().any(loud)) << group)
}

pub(super) fn peaks(extremes: &Extremes) -> Peaks {
    let peak = |cells: &Half<i8>, row| {
        let sizes = (0..HALF_COLUMNS).map(|column| cells[in_half(row, column)].unsigned_abs());
        sizes.max().expect("16 columns")
    };
    std::array::from_fn(|row| [&extremes.most, &extremes.least].map(|cells| peak(cells, row)))
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
    for row in 0..BLOCK_ROWS {
        for column in 0..HALF_COLUMNS {
            let at = in_half(row, column);
            // a pruned cell takes pulses and does not move: attempted, not effective
            let gone =
                cells.pruned.as_ref().is_some_and(|bits| bits[at / 64] >> (at % 64) & 1 == 1);
            let (sum, shift) = scaled(sums[row * HALF_COLUMNS + column], write);
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
                let now = gone || (pulses != 0 && level == floor);
                pruned[at / 64] |= u64::from(now) << (at % 64);
            }
            if let Some(out) = cells.pulses.as_mut() {
                out.take(at, &[pulses as i8]);
            }
            counts.requested += u64::from(wanted != 0);
            counts.bounded += u64::from(wanted != pulses);
            counts.attempted += pulses.unsigned_abs();
            counts.effective += (level - before).unsigned_abs();
        }
    }
    counts
}
