//! Retention: what becomes of a level with time, as integers of one moment.
//!
//! ```text
//! power     G(t) = G (t / t0)^-nu          nu of a cell: Gaussian, mean and deviation clamp(a ln g + b, least, most), g = G / G_max
//! log       G(t) = G + G_max d log10(t / t0)                                     d of a cell: Gaussian
//! T = floor(2^16 log2(t / t0) + 1/2),  mean and deviation of nu at a level with 16 fractional bits, those of d log10(t / t0) in
//! levels too;  e_i = floor(2^16 2^(-i / 4096) + 1/2)                             i = 0 ..= 4096
//! ```
//!
//! A pace is a law whose moment each cell tells: tables of one doubling of time, and
//! `log2 n = k 2^16 + L_i`, k the place of the first bit of n, i its next 12 bits, `L_i = floor(2^16 log2(1 + i / 4096) + 1/2)`.
//!
//! See docs/MODEL.md, 3.13 and 3.16.
#![expect(
    clippy::float_arithmetic,
    reason = "floats become integers here, before anything is read"
)]
#![deny(clippy::disallowed_types, clippy::disallowed_methods)]

use crate::num::fixed::{Millionths, narrow};

/// `clamp(slope ln g + offset, least, most)`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OfLogarithm {
    /// Factor of the logarithm.
    pub slope: f64,
    /// Added to it.
    pub offset: f64,
    /// Not less.
    pub least: f64,
    /// Not more.
    pub most: f64,
}

/// How a kind of cell drifts.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum DriftLaw {
    /// By a power of time.
    Power {
        /// Mean of the exponent.
        exponent: OfLogarithm,
        /// Its standard deviation from cell to cell.
        spread: OfLogarithm,
    },
    /// By the logarithm of time.
    Log {
        /// Mean change a decade, in shares of the greatest conductance.
        change: f64,
        /// Its standard deviation from cell to cell.
        spread: f64,
    },
}

/// A law of drift as numbers that a chip is made of.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum DriftRates {
    /// By a power of time: slope, offset, least and most of the mean of the exponent, and of its standard deviation.
    Power([[Millionths; 4]; 2]),
    /// By the logarithm of time: mean change a decade in shares of the greatest conductance, and its standard deviation.
    Log([Millionths; 2]),
}

impl DriftRates {
    /// As a law.
    #[must_use]
    pub fn law(&self) -> DriftLaw {
        #[expect(clippy::cast_precision_loss, reason = "below 2^53 millionths")]
        let real = |of: Millionths| of.0 as f64 / 1e6;
        match *self {
            Self::Power(both) => {
                let [exponent, spread] = both.map(|of| {
                    let [slope, offset, least, most] = of.map(real);
                    OfLogarithm { slope, offset, least, most }
                });
                DriftLaw::Power { exponent, spread }
            }
            Self::Log([change, spread]) => {
                DriftLaw::Log { change: real(change), spread: real(spread) }
            }
        }
    }
}

/// A law whose moment each cell tells.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct DriftPace {
    /// Of one doubling of time.
    pub tables: DriftTables,
    logarithms: Vec<i64>,
}

impl DriftPace {
    /// That of levels up to `greatest` of cells whose greatest conductance is `ceiling`.
    #[must_use]
    pub fn new(rates: &DriftRates, ends: [u16; 2]) -> Self {
        let logarithm = |i: i32| rounded(libm::log2(1.0 + f64::from(i) / 4096.0), 16);
        Self {
            tables: DriftTables::new(rates.law(), ends, 2.0),
            logarithms: (0..4096).map(logarithm).collect(),
        }
    }

    /// Doublings from 1 to a number above 0, 16 fractional bits.
    ///
    /// # Panics
    /// When it is 0.
    #[must_use]
    pub fn doublings(&self, n: u64) -> i64 {
        let whole = n.ilog2();
        let next = (u128::from(n) << 12 >> whole) & 4095;
        i64::from(whole) * (1 << 16) + self.logarithms[usize::try_from(next).expect("12 bits")]
    }
}

/// A law at one moment.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum DriftTables {
    /// `[mean, deviation]` of the exponent by level, 16 fractional bits; doublings of time, 16 fractional bits; powers.
    Power {
        /// By level, 0 to the greatest.
        exponents: Vec<[i64; 2]>,
        /// `T`.
        doublings: i64,
        /// `e`.
        powers: Vec<u32>,
    },
    /// Mean and deviation of the change in levels, 16 fractional bits.
    Log([i64; 2]),
}

fn rounded(x: f64, bits: i32) -> i64 {
    // what is configured lies far inside
    #[expect(clippy::cast_possible_truncation, reason = "at most 2^40")]
    let rounded = libm::floor(libm::ldexp(x, bits) + 0.5).clamp(-1e12, 1e12) as i64;
    rounded
}

impl OfLogarithm {
    fn at(self, g: f64) -> f64 {
        (self.slope * libm::log(g) + self.offset).clamp(self.least, self.most)
    }
}

impl DriftTables {
    /// A law for levels up to `greatest` of cells whose greatest conductance is `ceiling`, `ratio` times as long after programming as
    /// the levels are of.
    #[must_use]
    pub fn new(law: DriftLaw, [ceiling, greatest]: [u16; 2], ratio: f64) -> Self {
        match law {
            DriftLaw::Power { exponent, spread } => {
                // level 0 has no logarithm and no current
                let g = |level: u16| f64::from(level.max(1)) / f64::from(ceiling);
                let both = |level| [exponent, spread].map(|law| rounded(law.at(g(level)), 16));
                let power = |i: u32| {
                    narrow(rounded(libm::exp2(-f64::from(i) / 4096.0), 16), "at most 2^16")
                };
                Self::Power {
                    exponents: (0..=greatest).map(both).collect(),
                    doublings: rounded(libm::log2(ratio), 16),
                    powers: (0..=4096).map(power).collect(),
                }
            }
            DriftLaw::Log { change, spread } => {
                let decades = libm::log10(ratio) * f64::from(ceiling);
                Self::Log([change, spread].map(|of| rounded(of * decades, 16)))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn doublings_are_logarithms() {
        let pace = DriftPace::new(&DriftRates::Log([Millionths(-10_000), Millionths(0)]), [255; 2]);
        assert_eq!([1, 2, 1 << 40].map(|n| pace.doublings(n)), [0, 1 << 16, 40 << 16]);
        for n in [3u64, 7, 100, 4097, 123_456_789, u64::MAX] {
            let want = (n as f64).log2() * 65_536.0;
            let found = pace.doublings(n) as f64;
            assert!((found - want).abs() < 24.0, "{n}: {found} {want}");
        }
    }

    #[test]
    fn tables_are_those_of_their_law() {
        let exponent = OfLogarithm { slope: -0.0155, offset: 0.0244, least: 0.049, most: 0.1 };
        let spread = OfLogarithm { slope: -0.0125, offset: -0.0059, least: 0.008, most: 0.045 };
        let law = DriftLaw::Power { exponent, spread };
        let DriftTables::Power { exponents, doublings, powers } =
            DriftTables::new(law, [255; 2], 1024.0)
        else {
            panic!("a power")
        };
        assert_eq!((doublings, exponents.len(), powers.len()), (10 << 16, 256, 4097));
        assert_eq!([powers[0], powers[4096]], [1 << 16, 1 << 15]);
        // at the top the mean is clamped from below; at 1/16 it is 0.0155 ln 16 + 0.0244 = 0.06738
        assert_eq!(exponents[255], [0.049, 0.008].map(|x: f64| (x * 65536.0 + 0.5) as i64));
        assert_eq!(exponents[16][0], (0.067_317_2 * 65536.0 + 0.5) as i64);
        assert!(exponents.windows(2).all(|pair| pair[1][0] <= pair[0][0]));
        let log =
            DriftTables::new(DriftLaw::Log { change: -0.01, spread: 0.002 }, [100; 2], 1000.0);
        assert_eq!(log, DriftTables::Log([-3 * 65536, 39322]));
    }
}
