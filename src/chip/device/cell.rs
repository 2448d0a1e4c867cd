//! What a real cell does to a pulse, as data: tables of a device, and what sets one cell of it apart.
//!
//! ```text
//! place   i = ((level - floor) reach + 2^15) >> 16            floor, ceiling: the cell's own;  held to 0 ..= N, as a stuck level may lie outside
//! mean    m = rsh( table[polarity][i] factor[polarity], 24 )                  in 256ths of a level
//! noise   s = m + rsh( g d, 12 ),  d = rsh(m c, 16)  or  b                    g: h of its upper 12 bits, minus where it is odd; 12 fractional bits
//! move    up: (s + r) >> 8,   down: (r - s) >> 8                              r: a word of 8 bits
//! ```
//!
//! `N = ceiling - floor` of the chip's window, `reach = (2^16 N + n/2) / n` with `n` levels in the cell's own. What follows, and
//! that the window holds the cell after every pulse, is the last step of a write: `crossbar::kernel::respond`.
//!
//! ```text
//! word    of 32 bits of the cell, site 3:  sub 0 step, 1 asymmetry, 2 ceiling, 3 floor       factors F of their laws, see `num::tables::spread`
//! factor  up = rsh(F_0 A, 24),  down = rsh(F_0 (2 - A), 24),   A = min(F_1, 2)
//! own     ceiling + rsh((F_2 - 1) N, 24) in 1 ..= level_max,   floor + rsh((F_3 - 1) N, 24) in 0 .. own ceiling
//! ```
//!
//! What a cell is follows from its place alone: it is made again wherever it is wanted, and is no state. See docs/MODEL.md, 3.11.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use super::{DeviceSpec, PulseNoise};
use crate::num::draw::{Place, Site};
use crate::num::fixed::{Millionths, narrow, rsh};
use crate::num::tables::{FACTOR_BITS, FACTOR_ONE, Quantiles, STEP_BITS, SpreadLaw, half_gaussian};

#[cfg(test)]
mod tests;

/// Fractional bits of a cell's reach, and of noise as a share.
const FINE: u32 = 16;
/// Fractional bits of a Gaussian word.
const GAUSSIAN_BITS: u32 = 12;
/// Levels that a table has room for: those of 12 bits.
pub const PLACES: usize = 1 << 12;
/// Absolute Gaussians of a word's upper 12 bits.
const GAUSSIANS: usize = 1 << 12;

/// The tables of a chip's device.
#[derive(Debug, PartialEq, Eq)]
pub struct Device {
    /// Steps in 256ths of a level: those up by level above the floor, and from [`PLACES`] on those down.
    steps: Box<[u32; 2 * PLACES]>,
    /// The chip's window, and the greatest level there is.
    floor: u16,
    span: u16,
    level_max: u16,
    /// `c` with 16 fractional bits, and `b` in 256ths of a level: one of them is 0.
    noise: [i64; 2],
    /// Absolute Gaussians, where there is noise.
    gaussian: Box<[u16; GAUSSIANS]>,
    /// Factors by sub of their word, where cells differ in it.
    spread: [Option<Quantiles>; 4],
    rounds: bool,
    /// Levels of the chip's window over those of a cell's own, by how many it has.
    reaches: Box<[u32; PLACES]>,
    /// Where pulses are verified.
    verified: Option<Verified>,
    /// Whether every number of a pulse fits a lane of 32 bits, and every product one of 64.
    fits_lanes: bool,
}

/// Pulses that are looked at one by one: a cell gets no more once it has moved as far as it should.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Verified {
    /// Pulses at most for each that is asked for.
    pub tries: u8,
    /// The mean step, in 256ths of a level.
    pub mean: i64,
}

impl Verified {
    /// Pulses that a cell is given at most.
    #[must_use]
    pub const fn slots(self, asked: i8) -> u32 {
        self.tries as u32 * asked.unsigned_abs() as u32
    }

    /// Whether a cell has moved as far as so many pulses of mean length would take it, to half of one.
    #[must_use]
    pub fn arrived(self, asked: i8, [start, level]: [u16; 2]) -> bool {
        let moved = i64::from(level) - i64::from(start);
        let moved = if asked < 0 { -moved } else { moved };
        2 * (moved << STEP_BITS) >= (2 * i64::from(asked.unsigned_abs()) - 1) * self.mean
    }
}

/// What sets a cell apart from others.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct OwnCell {
    /// Factors of steps up and down, 24 fractional bits.
    pub factors: [u32; 2],
    /// Ends of its window.
    pub floor: u16,
    /// The other.
    pub ceiling: u16,
    /// Levels of the chip's window over levels of its own, 16 fractional bits.
    pub reach: u32,
}

/// What pulses of a device are made of, for cells side by side.
#[derive(Debug, Clone, Copy)]
pub struct DeviceLanes<'a> {
    /// Steps up by level above the floor, and from [`PLACES`] on steps down.
    pub steps: &'a [u32; 2 * PLACES],
    /// The last level above the floor.
    pub last: u32,
    /// `c` and `b`.
    pub noise: [u32; 2],
    /// Absolute Gaussians by the upper 12 bits of a word.
    pub gaussian: &'a [u16; GAUSSIANS],
}

/// Words of a cell for a pulse.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PulseWords {
    /// Of site 14.
    pub rounding: u8,
    /// Of site 4.
    pub noise: u16,
}

impl Device {
    /// What makes cells differ, in the order of the sub of their words.
    pub const SPREADS: u32 = 4;

    /// Cells of a device whose window is `floor ..= ceiling`, of levels up to `level_max`.
    ///
    /// # Panics
    /// When the window is empty.
    #[must_use]
    pub fn new(device: &DeviceSpec, [floor, ceiling]: [u16; 2], level_max: u16) -> Self {
        let DeviceSpec { response, states, asymmetry, noise, write_noise: _, tries: _, spread } =
            device;
        let span = ceiling - floor;
        let scaled = |share: Millionths, whole: i64| (share.0 * whole + 500_000) / 1_000_000;
        let noise = match *noise {
            PulseNoise::Off => [0, 0],
            PulseNoise::OfStep(share) => [scaled(share, 1 << FINE), 0],
            PulseNoise::OfWindow(share) => [0, scaled(share, i64::from(span) << STEP_BITS)],
        };
        let quantiles = |law: SpreadLaw, deviation: Millionths| {
            (deviation.0 != 0).then(|| Quantiles::new(law, deviation))
        };
        let spread = [
            quantiles(spread.step_law, spread.step),
            quantiles(SpreadLaw::Normal, spread.asymmetry),
            quantiles(SpreadLaw::Normal, spread.ceiling),
            quantiles(SpreadLaw::Normal, spread.floor),
        ];
        let tables = response.table(span, *states, *asymmetry);
        let mut steps = Box::new([0; 2 * PLACES]);
        for (of, table) in steps.chunks_exact_mut(PLACES).zip(&tables) {
            of[..table.len()].copy_from_slice(table);
        }
        let whole = |step: &u32| step.trailing_zeros() >= STEP_BITS;
        let rounds = noise != [0, 0]
            || spread[..2].iter().any(Option::is_some)
            || !tables.iter().flatten().all(whole);
        let mut gaussian = Box::new([0; GAUSSIANS]);
        if noise != [0, 0] {
            gaussian.copy_from_slice(&half_gaussian());
        }
        let mut reaches = Box::new([0; PLACES]);
        for (own, reach) in (0u64..).zip(reaches.iter_mut()).skip(1) {
            let wide = ((u64::from(span) << FINE) + own / 2) / own;
            *reach = narrow(wide, "2^12 windows at most");
        }
        let fits_lanes = fits_lanes(&steps[..], &spread, noise);
        let verified = None;
        Self {
            reaches,
            verified,
            fits_lanes,
            steps,
            floor,
            span,
            level_max,
            noise,
            gaussian,
            spread,
            rounds,
        }
    }

    /// The same, whose pulses are verified.
    #[must_use]
    pub fn with_verified(self, device: &DeviceSpec) -> Self {
        let (span, states) = (i64::from(self.span), i64::from(device.states));
        let mean = (2 * (span << STEP_BITS) + states) / (2 * states);
        let tries = narrow(device.tries, "16 at most");
        Self { verified: Some(Verified { tries, mean }), ..self }
    }

    /// How pulses are verified, if they are.
    #[must_use]
    pub const fn verified(&self) -> Option<Verified> {
        self.verified
    }

    /// Whether steps are rounded with a word, and whether they take one for noise.
    #[must_use]
    pub fn wants(&self) -> [bool; 2] {
        [self.rounds, self.noise != [0, 0]]
    }

    /// Whether cells differ in their steps, and in their windows.
    #[must_use]
    pub fn differs(&self) -> [bool; 2] {
        let [step, asymmetry, ceiling, floor] = self.spread.each_ref().map(Option::is_some);
        [step || asymmetry, ceiling || floor]
    }

    /// Where the words of the cells of an array come from: `place` with the site, a sub for each.
    #[must_use]
    pub const fn place(place: Place, sub: u32) -> Place {
        Place { site: Site::Variation, sub, count: 0, ..place }
    }

    /// A cell of which nothing is its own.
    #[must_use]
    pub const fn nominal(&self) -> OwnCell {
        OwnCell {
            factors: [FACTOR_ONE; 2],
            floor: self.floor,
            ceiling: self.floor + self.span,
            reach: 1 << FINE,
        }
    }

    /// Whether it takes a word of that sub.
    #[must_use]
    pub const fn takes(&self, sub: usize) -> bool {
        self.spread[sub].is_some()
    }

    /// The cell of these words.
    #[must_use]
    pub fn cell(&self, words: [u32; 4]) -> OwnCell {
        let factor = |sub: usize| {
            let factor = self.spread[sub].as_ref().map(|of| of.factor(words[sub]));
            i64::from(factor.unwrap_or(FACTOR_ONE))
        };
        let one = i64::from(FACTOR_ONE);
        let (step, up) = (factor(0), factor(1).min(2 * one));
        let factors = [up, 2 * one - up].map(|side| {
            // a factor of nearly 2^8 twice is the only one that does not fit
            narrow(rsh(step * side, FACTOR_BITS).min(u32::MAX.into()), "held to 32 bits")
        });
        let span = i64::from(self.span);
        let moved = |sub: usize| rsh((factor(sub) - one) * span, FACTOR_BITS);
        let ceiling = i64::from(self.floor) + span + moved(2);
        let ceiling = ceiling.clamp(1, self.level_max.into());
        let floor = (i64::from(self.floor) + moved(3)).clamp(0, ceiling - 1);
        let own = ceiling - floor;
        OwnCell {
            factors,
            floor: narrow(floor, "a level"),
            ceiling: narrow(ceiling, "a level"),
            reach: self.reach(narrow(own, "a level")),
        }
    }

    /// What a pulse is made of, where every number of it fits a lane of 32 bits and every product one of 64.
    #[must_use]
    #[inline]
    pub fn lanes(&self) -> Option<DeviceLanes<'_>> {
        let narrow = |of: i64| u32::try_from(of).expect("below 2^23, and a window of steps");
        self.fits_lanes.then(|| DeviceLanes {
            steps: &self.steps,
            last: u32::from(self.span),
            noise: self.noise.map(narrow),
            gaussian: &self.gaussian,
        })
    }

    /// Levels of the chip's window over so many of a cell's own, 16 fractional bits.
    #[must_use]
    #[inline]
    pub fn reach(&self, own: u16) -> u32 {
        self.reaches[usize::from(own) % PLACES]
    }

    /// By how many levels a pulse moves a cell at a level of its own window, before the window holds it.
    #[must_use]
    #[inline]
    pub fn moves(&self, cell: &OwnCell, level: u16, rises: bool, words: PulseWords) -> i64 {
        let above = u64::from(level.saturating_sub(cell.floor)) * u64::from(cell.reach);
        let at = usize::try_from((above + (1 << (FINE - 1))) >> FINE).expect("a level");
        let at = at.min(self.span.into());
        let polarity = usize::from(!rises);
        let table = i64::from(self.steps[polarity * PLACES + at]);
        let mut step = rsh(table * i64::from(cell.factors[polarity]), FACTOR_BITS);
        if self.noise != [0, 0] {
            let half = i64::from(self.gaussian[usize::from(words.noise >> 4)]);
            let gaussian = if words.noise & 1 == 0 { half } else { -half };
            let [share, whole] = self.noise;
            let deviation = rsh(step * share, FINE) + whole;
            step += rsh(gaussian * deviation, GAUSSIAN_BITS);
        }
        let signed = if rises { step } else { -step };
        (signed + i64::from(words.rounding)) >> STEP_BITS
    }
}

/// Whether the numbers of any pulse fit 32 bits: noise is below four deviations.
fn fits_lanes(steps: &[u32], spread: &[Option<Quantiles>; 4], noise: [i64; 2]) -> bool {
    let longest = u128::from(steps.iter().copied().max().unwrap_or_default());
    let one = u128::from(FACTOR_ONE);
    let most = |sub: usize| spread[sub].as_ref().map_or(FACTOR_ONE, Quantiles::greatest).into();
    let (step, up): (u128, u128) = (most(0), most(1));
    let up = if up > one { 2 * one } else { one };
    let mean = ((longest * step * up) >> (2 * FACTOR_BITS)) + 2;
    let [share, whole] = noise.map(|of| u128::from(of.unsigned_abs()));
    let deviation = ((mean * share) >> FINE) + whole + 1;
    mean + 4 * deviation + 256 < 1 << 31
}
