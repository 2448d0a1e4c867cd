//! Accumulators beside the middles of their units, a panel of 32 units at a time: what is left of them, and how far from
//! 0 they are looked up.
//!
//! ```text
//! totals[j]  += sum[b][j];   sum[b][j] = (sum[b][j] - offset[j]) << raise
//! squares    += i^2,   i = clamp( rsh(sum[b][j], shift), -half, half - 1 )              of the first `live` units
//! ```
//!
//! The twin of each is written so that compilers make vectors of it. See docs/MODEL.md, 2.5.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use crate::chip::crossbar::layout::PANEL_COLUMNS;
use crate::num::fixed::rsh;

/// What a panel of units takes off its accumulators.
#[derive(Debug, Clone, Copy)]
pub struct MiddleOf<'a> {
    /// By unit; of a size below [`OFFSET_MAX`].
    pub offsets: &'a [i32; PANEL_COLUMNS],
    /// Bits by which what is left is raised.
    pub raise: u32,
}

/// Accumulators and offsets of a size below this give differences that 32 bits hold.
pub const OFFSET_MAX: u32 = 1 << 30;

pub(super) fn law_offset(
    sums: &mut [i32],
    offsets: &[i32; PANEL_COLUMNS],
    raise: u32,
    totals: &mut [i64; PANEL_COLUMNS],
) {
    for (at, sum) in sums.iter_mut().enumerate() {
        let column = at % PANEL_COLUMNS;
        totals[column] += i64::from(*sum);
        *sum = (*sum - offsets[column]) << raise;
    }
}

pub(super) fn law_index_squares(sums: &[i32], shift: u32, half: i32, live: usize) -> u64 {
    let mut squares = 0;
    for (at, &sum) in sums.iter().enumerate() {
        let index = rsh(i64::from(sum), shift).clamp((-half).into(), (half - 1).into());
        if at % PANEL_COLUMNS < live {
            squares += (index * index).unsigned_abs();
        }
    }
    squares
}

#[inline(always)]
pub(super) fn offset(
    sums: &mut [i32],
    offsets: &[i32; PANEL_COLUMNS],
    raise: u32,
    totals: &mut [i64; PANEL_COLUMNS],
) {
    for sums in sums.as_chunks_mut::<PANEL_COLUMNS>().0 {
        for column in 0..PANEL_COLUMNS {
            totals[column] += i64::from(sums[column]);
            sums[column] = (sums[column] - offsets[column]) << raise;
        }
    }
}

#[inline(always)]
pub(super) fn index_squares(sums: &[i32], shift: u32, half: i32, live: usize) -> u64 {
    let mut squares = [0u64; PANEL_COLUMNS];
    let step_half = 1i32 << shift >> 1;
    for sums in sums.as_chunks::<PANEL_COLUMNS>().0 {
        for column in 0..PANEL_COLUMNS {
            // the carry is added after the shift: half a step beside the greatest sum would wrap
            let carry = i32::from(sums[column] & step_half != 0);
            let index = ((sums[column] >> shift) + carry).clamp(-half, half - 1);
            squares[column] += u64::from((index * index).unsigned_abs());
        }
    }
    squares[..live].iter().sum()
}

#[cfg(test)]
mod tests {
    use super::super::{Backend, Kernel};
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn every_back_end_takes_offsets_off_and_squares_as_the_law(
            sums in prop::collection::vec(
                prop_oneof![-300i32..300, -(1i32 << 20)..1 << 20, Just(0), 1i32 - (1 << 30)..1 << 30],
                32 * 5,
            ),
            samples in 0usize..=5,
            offsets in prop::collection::vec(
                prop_oneof![-300i32..300, 1i32 - (1 << 30)..1 << 30, Just(0)], 32,
            ),
            few in any::<bool>(),
            raise in 0u32..=8,
            shift in 0u32..=30,
            bits in 2u32..=14,
            live in 1usize..=32,
        ) {
            // what is raised is small
            let raise = if few { raise } else { 0 };
            let small = |v: i32| if raise > 0 { v % (1 << 21) } else { v };
            let sums: Vec<i32> = sums[..32 * samples].iter().map(|&v| small(v)).collect();
            let offsets: [i32; 32] = std::array::from_fn(|at| small(offsets[at]));
            let of = |backend| {
                let kernel = Kernel::start(backend);
                let (mut left, mut totals) = (sums.clone(), [3; 32]);
                kernel.offset(&mut left, &offsets, raise, &mut totals);
                let squares = kernel.index_squares(&left, shift, 1 << (bits - 1), live);
                (left, totals, squares)
            };
            let want = of(Backend::Scalar);
            for (at, &left) in want.0.iter().enumerate() {
                let exact = (i64::from(sums[at]) - i64::from(offsets[at % 32])) << raise;
                prop_assert_eq!(i64::from(left), exact);
            }
            for backend in Backend::available() {
                prop_assert_eq!(of(backend), want.clone(), "{}", backend.name());
            }
        }
    }
}
