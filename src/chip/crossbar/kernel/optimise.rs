//! What optimisers that do not take sums as they are do with the sums of a half block.
//!
//! ```text
//! centre    sum = (sum << 4) - mean[row] total[column]              mean: 4 fractional bits; total: sum of the column's gates
//! totals    of gates by column, and of drives by row                [stride / 4][16 columns][4], [64 rows][stride]
//! squares   (low, high) += (sum^2 mod 2^32, sum^2 >> 32), where centred;  else low += sum^2
//! loud      a bit for each group of four rows with |sum| >= least
//! signs     pulses = +-1 towards the sum, with the sign of the pathway, where |sum| >= least and word < chance;  else 0
//! ```
//!
//! `centre`: the sum of `(16 x - mean) u` over 4,096 samples is at most 4096 x 4080 x 127 < 2^31 in size whatever its two
//! terms are, which may wrap. `squares`: 1,024 squares of sums of 4096 x 255 x 127 are below 2^64. `signs`: words are of 16 bits, in the order of levels; a chance of `2^16` needs none.
//!
//! Each is written once, so that compilers make vectors of it: back ends compile it for their processor. See docs/MODEL.md, 3.10.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use super::{Cells, Half, WriteCounts};
use crate::chip::crossbar::layout::{BLOCK_ROWS, HALF_CELLS, HALF_COLUMNS};

/// Fractional bits of the mean of a row, and so of a centred sum.
pub const MEAN_BITS: u32 = 4;

/// Which sums are given a pulse.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SignLaw {
    /// Least size of a sum that asks for one, at least 1.
    pub least: u32,
    /// Words of 16 bits below it give it: 0..=65536.
    pub chance: u32,
    /// Inhibitory pathways take the negated sum.
    pub negate: bool,
    /// Groups of four rows that are looked at; all others get nothing.
    pub groups: u16,
}

impl SignLaw {
    /// The law of sums of at least that size, with a chance of `2^-shift`; none above 16.
    #[must_use]
    pub const fn new(least: u32, shift: u32, negate: bool) -> Self {
        let chance = if shift > 16 { 0 } else { 1 << (16 - shift) };
        Self { least, chance, negate, groups: u16::MAX }
    }

    /// Whether no word decides.
    #[must_use]
    pub const fn is_certain(&self) -> bool {
        self.chance > u16::MAX as u32
    }
}

/// Sums of squares, by the halves of each.
pub type Squares = [u64; 2];

/// What both halves add up to.
#[must_use]
pub fn joined([low, high]: Squares) -> u128 {
    u128::from(low) + (u128::from(high) << 32)
}

#[inline(always)]
pub(super) fn centre(
    sums: &mut Half<i32>,
    means: &[i32; BLOCK_ROWS],
    totals: &[i32; HALF_COLUMNS],
) {
    for (sums, mean) in sums.as_chunks_mut::<HALF_COLUMNS>().0.iter_mut().zip(means) {
        for c in 0..HALF_COLUMNS {
            sums[c] = (sums[c] << MEAN_BITS).wrapping_sub(mean.wrapping_mul(totals[c]));
        }
    }
}

/// Sums of the gates of each of 16 columns over all samples.
#[inline(always)]
pub(super) fn gate_totals(gates: &[i8]) -> [i32; HALF_COLUMNS] {
    let mut lanes = [0i32; 64];
    for gates in gates.as_chunks::<64>().0 {
        for i in 0..64 {
            lanes[i] += i32::from(gates[i]);
        }
    }
    std::array::from_fn(|c| lanes[4 * c..4 * c + 4].iter().sum())
}

/// Sums of the drives of each of 64 rows over all samples, which are padded to words of four.
#[inline(always)]
pub(super) fn drive_totals(turned: &[u8], stride: usize) -> [u32; BLOCK_ROWS] {
    let mut totals = [0; BLOCK_ROWS];
    for (total, drives) in totals.iter_mut().zip(turned.chunks_exact(stride)) {
        let mut lanes = [0u32; 32];
        let (whole, rest) = drives.as_chunks::<32>();
        for drives in whole {
            for i in 0..32 {
                lanes[i] += u32::from(drives[i]);
            }
        }
        *total = lanes.iter().sum::<u32>() + rest.iter().map(|&x| u32::from(x)).sum::<u32>();
    }
    totals
}

/// `wide`: sums may be 16 times as large as those of a batch, whose squares 64 bits hold.
#[inline(always)]
pub(super) fn squares(sums: &Half<i32>, wide: bool) -> Squares {
    let (mut low, mut high) = ([0u64; HALF_COLUMNS], [0u64; HALF_COLUMNS]);
    for sums in sums.as_chunks::<HALF_COLUMNS>().0 {
        for c in 0..HALF_COLUMNS {
            let sum = i64::from(sums[c]);
            let square = (sum * sum).cast_unsigned();
            if wide {
                low[c] += square & 0xffff_ffff;
                high[c] += square >> 32;
            } else {
                low[c] += square;
            }
        }
    }
    [low, high].map(|lanes| lanes.iter().sum())
}

#[inline(always)]
pub(super) fn loud(sums: &Half<i32>, least: u32) -> u16 {
    let mut loud = 0;
    for (group, sums) in sums.as_chunks::<64>().0.iter().enumerate() {
        let most = sums.iter().fold(0, |most: u32, sum| most.max(sum.unsigned_abs()));
        loud |= u16::from(most >= least) << group;
    }
    loud
}

#[inline(always)]
pub(super) fn signs(
    sums: &Half<i32>,
    law: &SignLaw,
    words: Option<&Half<u16>>,
    cells: &mut Cells<'_>,
    out: &mut Half<i8>,
) -> WriteCounts {
    // words are below 2^16: where all pass, that of nobody does
    let certain = law.is_certain();
    let below = if certain { 0 } else { law.chance as u16 };
    let flip = if law.negate { -1 } else { 0 };
    let mut given = 0;
    for group in (0..HALF_CELLS / 64).filter(|group| law.groups >> group & 1 == 1) {
        let sums = &sums.as_chunks::<64>().0[group];
        let out = &mut out.as_chunks_mut::<64>().0[group];
        let mut towards = [0i8; 64];
        for i in 0..64 {
            let asks = i32::from(sums[i].unsigned_abs() >= law.least);
            let sign = (sums[i] >> 31) | 1;
            towards[i] = (((sign ^ flip) - flip) * asks) as i8;
        }
        // a column's four rows side by side, as levels and words lie
        let mut turned = [0i8; 64];
        for c in 0..HALF_COLUMNS {
            for r in 0..4 {
                turned[4 * c + r] = towards[HALF_COLUMNS * r + c];
            }
        }
        if let (Some(words), false) = (words, certain) {
            let words = &words.as_chunks::<64>().0[group];
            for i in 0..64 {
                turned[i] &= if words[i] < below { -1 } else { 0 };
            }
        }
        *out = turned;
        given += turned.iter().map(|pulse| u32::from(pulse & 1 != 0)).sum::<u32>();
    }
    if let Some(told) = &mut cells.pulses {
        for group in (0..HALF_CELLS / 64).filter(|group| law.groups >> group & 1 == 1) {
            told.take(group * 64, &out.as_chunks::<64>().0[group]);
        }
    }
    let given = given.into();
    WriteCounts { requested: given, bounded: 0, attempted: given, effective: 0 }
}
