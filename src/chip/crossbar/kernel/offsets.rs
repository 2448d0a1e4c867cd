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

use super::{Kernel, LookUp, call};
use crate::chip::crossbar::layout::{BLOCK_ROWS, PANEL_COLUMNS};
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

impl Kernel {
    /// Takes an offset a unit off the sums of a panel of 32 units, `[sample][32]`, and raises what is left by a power of two;
    /// the sums of each unit, as they were, are added to its total. The plan proves that differences fit: numbers lie below
    /// [`OFFSET_MAX`], `raise` below it where they are raised.
    ///
    /// # Panics
    /// When the sizes do not match.
    pub fn offset(
        &self,
        sums: &mut [i32],
        offsets: &[i32; PANEL_COLUMNS],
        raise: u32,
        totals: &mut [i64; PANEL_COLUMNS],
    ) {
        assert!(sums.len().is_multiple_of(PANEL_COLUMNS) && raise < 31, "32 units a sample");
        call!(self, offset(sums, offsets, raise, totals));
    }

    /// Sum of the squares of the places at which the first `live` units of a panel (`[sample][32]`) are looked up, counted from
    /// the middle of a table of `2 half` entries.
    ///
    /// # Panics
    /// When the sizes do not match.
    #[must_use]
    pub fn index_squares(&self, sums: &[i32], shift: u32, half: i32, live: usize) -> u64 {
        assert!(sums.len().is_multiple_of(PANEL_COLUMNS), "32 units a sample");
        assert!(live <= PANEL_COLUMNS && shift <= 30, "a panel has 32 columns");
        assert!((1..=1 << 15).contains(&half), "squares of indices fit 32 bits");
        call!(self, index_squares(sums, shift, half, live))
    }

    /// [`Kernel::offset`], [`Kernel::index_squares`] and [`Kernel::look_up`] of a panel, one after the other or at once: what units
    /// put out that take a middle off their accumulators. Returns the sum of the squares of the places at which the first
    /// `live` units are looked up, and the places that saturated. Accumulators are left as they are, or not.
    ///
    /// # Panics
    /// As these do.
    pub fn put_out(
        &self,
        sums: &mut [i32],
        (middle, table): (MiddleOf<'_>, &LookUp),
        live: usize,
        totals: &mut [i64; PANEL_COLUMNS],
        (values, derivatives): (&mut [u8], &mut [u8]),
    ) -> [u64; 2] {
        let samples = sums.len() / PANEL_COLUMNS;
        assert_eq!(samples * PANEL_COLUMNS, sums.len(), "32 accumulators a sample");
        assert!(live <= PANEL_COLUMNS && table.shift <= 30, "a panel has 32 columns");
        assert!(middle.raise < 31, "what is left is raised by fewer bits than it has");
        let entries = table.entries.len();
        assert!(entries.is_power_of_two() && (2..=1 << 16).contains(&entries), "2^bits entries");
        let least = samples.saturating_sub(1) * BLOCK_ROWS + PANEL_COLUMNS;
        assert!(values.len() >= least && derivatives.len() >= least, "every unit has its place");
        if let Some(put_out) = self.ops.put_out
            && let Some(seen) =
                call!(put_out, (sums, (middle, table), live, totals, (values, derivatives)))
        {
            return seen;
        }
        self.offset(sums, middle.offsets, middle.raise, totals);
        let half = i32::try_from(entries / 2).expect("at most 2^15");
        let squares = self.index_squares(sums, table.shift, half, live);
        [squares, self.look_up(sums, table, live, values, derivatives)]
    }
}

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
    use super::super::{Backend, Kernel, LookUp, MiddleOf};
    use crate::chip::crossbar::layout::BLOCK_ROWS;
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

    proptest! {
        #[test]
        fn what_a_panel_puts_out_is_offset_squared_and_looked_up(
            sums in prop::collection::vec(prop_oneof![-300i32..300, -(1i32 << 20)..1 << 20], 32 * 32),
            samples in 0usize..=32,
            offsets in prop::collection::vec(-(1i32 << 20)..1 << 20, 32),
            raise in 0u32..=6,
            shift in 0u32..=30,
            bits in 1u32..=14,
            live in 0usize..=32,
        ) {
            let entries = (0..1u32 << bits).map(|at| at.wrapping_mul(0x9e37_79b9) >> 16).collect();
            let table = LookUp { entries, shift };
            let offsets: [i32; 32] = std::array::from_fn(|at| offsets[at]);
            let size = samples.max(1) * BLOCK_ROWS;
            let mut sums = sums[..32 * samples].to_vec();
            let at_once = |backend, sums: &[i32]| {
                let (kernel, mut sums) = (Kernel::start(backend), sums.to_vec());
                let (mut totals, mut values, mut slopes) = ([3; 32], vec![9; size], vec![9; size]);
                let middle = MiddleOf { offsets: &offsets, raise };
                let out = (&mut values[..], &mut slopes[..]);
                let seen = kernel.put_out(&mut sums, (middle, &table), live, &mut totals, out);
                (seen, totals, values, slopes)
            };
            let want = at_once(Backend::Scalar, &sums);
            for backend in Backend::available() {
                prop_assert_eq!(at_once(backend, &sums), want.clone(), "{}", backend.name());
            }
            let law = Kernel::start(Backend::Scalar);
            let (mut totals, mut values, mut slopes) = ([3; 32], vec![9; size], vec![9; size]);
            law.offset(&mut sums, &offsets, raise, &mut totals);
            let squares = law.index_squares(&sums, shift, 1 << (bits - 1), live);
            let saturated = law.look_up(&sums, &table, live, &mut values, &mut slopes);
            prop_assert_eq!(([squares, saturated], totals, values, slopes), want);
        }
    }
}
