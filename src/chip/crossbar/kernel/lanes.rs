//! The law of converters and gates, written so that a compiler makes vectors of it. Back ends inline these loops into
//! functions compiled for their processor; what they do better they write themselves.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use super::{Conversion, Rails};
use crate::chip::crossbar::layout::PANEL_COLUMNS;
#[cfg(target_arch = "aarch64")]
use crate::chip::crossbar::layout::{BLOCK_ROWS, HALF_COLUMNS};
#[cfg(target_arch = "aarch64")]
use crate::num::fixed::ErrorBits;

/// [`super::scalar::convert`] where half a step and a current fit 32 bits: see [`Conversion::SHIFT_MAX`].
#[inline(always)]
pub(super) fn convert(
    [e, i]: [&[i32]; 2],
    conversion: Conversion,
    live: usize,
    codes: &mut [i16],
) -> Rails {
    let half = 1u32 << conversion.shift >> 1;
    let (shift, max) = (conversion.shift, u32::from(conversion.max));
    let alive: [u32; PANEL_COLUMNS] = std::array::from_fn(|c| u32::from(c < live));
    let mut saturated = [[0u32; PANEL_COLUMNS]; 2];
    let mut reached = [0u32; PANEL_COLUMNS];
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
            reached[c] += (u32::from(e >= max) + u32::from(i >= max)) * alive[c];
        }
    }
    let sum = |counts: [u32; PANEL_COLUMNS]| counts.iter().map(|&count| u64::from(count)).sum();
    Rails { saturated: saturated.map(sum), reached: sum(reached) }
}

/// [`super::scalar::gate`]. An error of at most `2^(bits-1) - 1` times a derivative of at most 255 rounds to at most
/// 127 in size, for every width from 2 to 9: no gate saturates.
#[cfg(target_arch = "aarch64")]
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
