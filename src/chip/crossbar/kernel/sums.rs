//! First step of a write: the sums of a half block.
//!
//! ```text
//! s[r,c] = sum_b x[b][r] * u[b][c]         x drive codes (u8), u gates (i8), b samples, or samples and positions
//! ```
//!
//! Sums are exact. Those of a batch fit 32 bits: 4,096 products, times a mantissa of at most 15. Those over many positions
//! are 64 bits wide. This is the law; every back end has products of its own. See docs/MODEL.md, 3.3.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use super::Half;
use crate::chip::crossbar::layout::HALF_COLUMNS;

/// Sums of a half block, row-major: `[64 rows][16 columns]`.
#[derive(Debug, Clone, Copy)]
pub enum Sums<'a> {
    /// At most 4,096 products of a drive and a gate each.
    Narrow(&'a Half<i32>),
    /// At most 2^58 in size, so that 15 times as much is far from an end.
    Wide(&'a Half<i64>),
}

impl<'a> From<&'a Half<i32>> for Sums<'a> {
    fn from(sums: &'a Half<i32>) -> Self {
        Self::Narrow(sums)
    }
}

impl<'a> From<&'a Half<i64>> for Sums<'a> {
    fn from(sums: &'a Half<i64>) -> Self {
        Self::Wide(sums)
    }
}

impl Sums<'_> {
    /// The sum of a cell.
    pub(super) fn at(self, row: usize, column: usize) -> i64 {
        let at = row * HALF_COLUMNS + column;
        match self {
            Self::Narrow(sums) => sums[at].into(),
            Self::Wide(sums) => sums[at],
        }
    }
}

/// The law of sums.
pub(super) fn accumulate(turned: &[u8], stride: usize, gates: &[i8], sums: &mut Half<i32>) {
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
