//! The law of reads, units and words: what every kernel computes, one cell after the other. That of a write stands with
//! its steps: `sums`, `requests`, `pulses`, `levels`; that of normalised activities in `normalise`,
//! that of offsets in `offsets`.
//!
//! ```text
//! read        v[c]   = sum_r level[r][c] * x[r]
//! transposed  v[r]   = sum_c level[r][c] * g[c]
//! converted   code[c] += min( rsh(v_E, ash), max ) - min( rsh(v_I, ash), max )      tile by tile
//! look-up     i = clamp( rsh(acc, lsh), -half, half - 1 );  value, derivative = table[i]
//! gate        u = sat_8( rsh( err * a', error_bits ) )
//! ```
//!
//! See docs/MODEL.md, 2 and 3.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use std::ops::Range;

use super::ops::Ops;
use super::{
    Conversion, Draws, Drives, Extremes, Half, LookUp, Peaks, Rails, conv, levels, normalise,
    offsets, optimise, pulses, sums,
};
use crate::chip::crossbar::layout::{
    BLOCK_CELLS, BLOCK_ROWS, HALF_CELLS, HALF_COLUMNS, Layout, PANEL_COLUMNS, in_half,
};
use crate::num::fixed::{ErrorBits, rsh, sat};

/// The law as a back end.
pub(super) const OPS: Ops = Ops {
    read,
    read_conv: conv::read,
    read_converted: |_, _, _, _| None,
    convert,
    look_up,
    offset: offsets::law_offset,
    index_squares: offsets::law_index_squares,
    difference,
    stream_squares: normalise::law_squares,
    scale: normalise::law_scale,
    latch,
    gate,
    turn,
    read_columns,
    accumulate: sums::accumulate,
    accumulate_drawn: None,
    accumulate_reads: None,
    drive_sums: None,
    gate_shared: None,
    put_out: None,
    dither,
    dither_words,
    may_move: pulses::may_move,
    pulses: pulses::law,
    levels: levels::law,
    pulse: None,
    centre: optimise::centre,
    gate_totals: optimise::gate_totals,
    drive_totals: optimise::drive_totals,
    squares: optimise::squares,
    loud: optimise::loud,
    signs: optimise::signs,
    fused: |_, _, _, _| None,
    one_sample: |_| None,
    peaks,
    peak: |_| 0,
};

fn read(cells: &[u8], drives: Drives<'_>, samples: Range<usize>, out: &mut [i32]) {
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

pub(super) fn convert(
    currents: [&[i32]; 2],
    conversion: Conversion,
    live: usize,
    codes: &mut [i16],
) -> Rails {
    let mut rails = Rails::default();
    for (at, code) in codes.iter_mut().enumerate() {
        if at % PANEL_COLUMNS >= live {
            continue;
        }
        let bank = |bank: usize| rsh(i64::from(currents[bank][at]), conversion.shift);
        let max = i64::from(conversion.max);
        let steps = [bank(0), bank(1)];
        *code += (steps[0].min(max) - steps[1].min(max)) as i16;
        for (count, steps) in rails.saturated.iter_mut().zip(steps) {
            *count += u64::from(steps > max);
            rails.reached += u64::from(steps >= max);
        }
    }
    rails
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

pub(super) fn peaks(extremes: &Extremes) -> Peaks {
    let peak = |cells: &Half<i8>, row| {
        let sizes = (0..HALF_COLUMNS).map(|column| cells[in_half(row, column)].unsigned_abs());
        sizes.max().expect("16 columns")
    };
    std::array::from_fn(|row| [&extremes.most, &extremes.least].map(|cells| peak(cells, row)))
}
