//! Normalised activities, a panel of 32 units at a time: sums of squares, and codes.
//!
//! ```text
//! squares[b] += sum_j max(sum[b][j], 0)^2                            |sum| < 2^29, so that 64 squares fit 64 bits
//! code        = min( (max(sum, 0) rc[b] + 2^39) >> 40, 255 );  value = min( rsh(code, shift), max )
//! ```
//!
//! The law is `chip::periphery::normalise`, one unit after the other; its twin is written so that compilers make vectors of
//! it; x86 has its own. See docs/MODEL.md, 2.3.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use crate::chip::crossbar::layout::{BLOCK_ROWS, PANEL_COLUMNS};
use crate::chip::periphery::normalise;
use crate::num::fixed::DriveBits;

/// How an activity code becomes what a unit hands on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct HandOn {
    /// Bits that are rounded off.
    pub(super) shift: u32,
    /// Greatest value.
    pub(super) max: u32,
}

impl HandOn {
    /// As the drive code of the next layer.
    #[must_use]
    pub fn new(bits: DriveBits) -> Self {
        Self { shift: 8 - bits.get(), max: bits.code_max().into() }
    }
}

/// Sums below this square to what 64 bits hold 64 of.
pub const SQUARED_MAX: u32 = 1 << 29;

impl HandOn {
    /// What a unit hands on whose activity is `code`.
    #[inline(always)]
    #[must_use]
    pub const fn value(self, code: u8) -> u8 {
        let rounded = (code as u32 + ((1 << self.shift) >> 1)) >> self.shift;
        (if rounded > self.max { self.max } else { rounded }) as u8
    }
}

pub(super) fn law_squares(sums: &[i32], squares: &mut [u64]) {
    for (square, sums) in squares.iter_mut().zip(sums.chunks_exact(PANEL_COLUMNS)) {
        let more = normalise::squares(sums.iter().map(|&sum| i64::from(sum)));
        *square += u64::try_from(more).expect("sums lie below `SQUARED_MAX`");
    }
}

pub(super) fn law_scale(
    sums: &[i32],
    reciprocals: &[u64],
    hand_on: HandOn,
    values: &mut [u8],
    derivatives: &mut [u8],
) -> u64 {
    let mut saturated = 0;
    for (at, &sum) in sums.iter().enumerate() {
        let (sample, column) = (at / PANEL_COLUMNS, at % PANEL_COLUMNS);
        let (code, beyond) = normalise::code(sum.into(), reciprocals[sample]);
        let to = sample * BLOCK_ROWS + column;
        values[to] = hand_on.value(code);
        derivatives[to] = normalise::slope(sum.into());
        saturated += u64::from(beyond);
    }
    saturated
}

#[cfg(target_arch = "aarch64")]
#[inline(always)]
pub(super) fn stream_squares(sums: &[i32], squares: &mut [u64]) {
    for (square, sums) in squares.iter_mut().zip(sums.as_chunks::<PANEL_COLUMNS>().0) {
        let mut total = 0;
        for &sum in sums {
            let v = u64::from(sum.max(0).unsigned_abs());
            total += v * v;
        }
        *square += total;
    }
}

#[cfg(target_arch = "aarch64")]
#[inline(always)]
pub(super) fn scale(
    sums: &[i32],
    reciprocals: &[u64],
    hand_on: HandOn,
    values: &mut [u8],
    derivatives: &mut [u8],
) -> u64 {
    let HandOn { shift, max } = hand_on;
    let half = (1 << shift) >> 1;
    let mut saturated = 0;
    let rows = values.chunks_mut(BLOCK_ROWS).zip(derivatives.chunks_mut(BLOCK_ROWS));
    let sums = sums.as_chunks::<PANEL_COLUMNS>().0.iter().zip(reciprocals);
    for ((sums, &rc), (values, derivatives)) in sums.zip(rows) {
        let mut codes = [0u32; PANEL_COLUMNS];
        let code = |v: u32, rc: u64| ((u64::from(v) * rc + (1 << 39)) >> 40) as u32;
        // one product of 32 bits where that is enough, as it is for a root of 2^13 and more
        match u32::try_from(rc) {
            Ok(rc) => {
                for (to, &sum) in codes.iter_mut().zip(sums) {
                    *to = code(sum.max(0).unsigned_abs(), rc.into());
                }
            }
            Err(_) => {
                for (to, &sum) in codes.iter_mut().zip(sums) {
                    *to = code(sum.max(0).unsigned_abs(), rc);
                }
            }
        }
        let (Some(values), Some(derivatives)) = (
            values.first_chunk_mut::<PANEL_COLUMNS>(),
            derivatives.first_chunk_mut::<PANEL_COLUMNS>(),
        ) else {
            unreachable!("every unit has its place")
        };
        let mut beyond = 0u32;
        for at in 0..PANEL_COLUMNS {
            beyond += u32::from(codes[at] > 255);
            values[at] = ((codes[at].min(255) + half) >> shift).min(max) as u8;
            derivatives[at] = if sums[at] > 0 { 255 } else { 0 };
        }
        saturated += u64::from(beyond);
    }
    saturated
}

#[cfg(test)]
mod tests {
    use super::super::{Backend, Kernel};
    use super::*;
    use crate::chip::periphery;
    use proptest::prelude::*;

    #[test]
    fn what_is_handed_on_is_the_drive_of_the_activity() {
        for bits in 1..=8 {
            let bits = DriveBits::new(bits).unwrap();
            let hand_on = HandOn::new(bits);
            assert!((0..=255).all(|code| hand_on.value(code) == periphery::drive(code, bits)));
        }
    }

    proptest! {
        #[test]
        fn every_back_end_normalises_as_the_law(
            sums in prop::collection::vec(
                prop_oneof![-300i32..300, -(1i32 << 20)..1 << 20, Just(0), 1i32 - (1 << 29)..1 << 29],
                32 * 5,
            ),
            samples in 0usize..=5,
            roots in prop::array::uniform5(1u64..1 << 29),
            bits in 1i64..=8,
        ) {
            let sums = &sums[..32 * samples];
            let rc: Vec<u64> = sums.chunks(32).zip(roots).map(|(sums, root)| {
                // as great as the plan lets it be
                let most = sums.iter().max().unwrap_or(&1);
                (1 << 45) / root.max((*most / 512).max(1) as u64)
            }).collect();
            let hand_on = HandOn::new(DriveBits::new(bits).unwrap());
            let of = |backend| {
                let kernel = Kernel::start(backend);
                let mut squares = vec![7; samples];
                kernel.stream_squares(sums, &mut squares);
                let (mut values, mut slopes) = (vec![1; 2 * sums.len()], vec![1; 2 * sums.len()]);
                let beyond = kernel.scale(sums, &rc, hand_on, &mut values, &mut slopes);
                (squares, values, slopes, beyond)
            };
            let want = of(Backend::Scalar);
            for backend in Backend::available() {
                prop_assert_eq!(of(backend), want.clone(), "{}", backend.name());
            }
        }
    }
}
