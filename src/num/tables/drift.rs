//! Retention: what becomes of a level with time, as integers of one moment.
//!
//! ```text
//! power     G(t) = G (t / t0)^-nu          nu of a cell: Gaussian, mean and deviation clamp(a ln g + b, least, most), g = G / G_max
//! log       G(t) = G + G_max d log10(t / t0)                                     d of a cell: Gaussian
//! T = floor(2^16 log2(t / t0) + 1/2),  mean and deviation of nu at a level with 16 fractional bits, those of d log10(t / t0) in
//! levels too;  e_i = floor(2^16 2^(-i / 4096) + 1/2)                             i = 0 ..= 4096
//! ```
//!
//! See docs/MODEL.md, 3.13.
#![expect(
    clippy::float_arithmetic,
    reason = "floats become integers here, before anything is read"
)]
#![deny(clippy::disallowed_types, clippy::disallowed_methods)]

use crate::num::fixed::narrow;

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
    /// A law for levels up to `level_max`, `ratio` times as long after programming as the levels are of.
    #[must_use]
    pub fn new(law: DriftLaw, level_max: u16, ratio: f64) -> Self {
        match law {
            DriftLaw::Power { exponent, spread } => {
                // level 0 has no logarithm and no current
                let g = |level: u16| f64::from(level.max(1)) / f64::from(level_max);
                let both = |level| [exponent, spread].map(|law| rounded(law.at(g(level)), 16));
                let power = |i: u32| {
                    narrow(rounded(libm::exp2(-f64::from(i) / 4096.0), 16), "at most 2^16")
                };
                Self::Power {
                    exponents: (0..=level_max).map(both).collect(),
                    doublings: rounded(libm::log2(ratio), 16),
                    powers: (0..=4096).map(power).collect(),
                }
            }
            DriftLaw::Log { change, spread } => {
                let decades = libm::log10(ratio) * f64::from(level_max);
                Self::Log([change, spread].map(|of| rounded(of * decades, 16)))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tables_are_those_of_their_law() {
        let exponent = OfLogarithm { slope: -0.0155, offset: 0.0244, least: 0.049, most: 0.1 };
        let spread = OfLogarithm { slope: -0.0125, offset: -0.0059, least: 0.008, most: 0.045 };
        let law = DriftLaw::Power { exponent, spread };
        let DriftTables::Power { exponents, doublings, powers } =
            DriftTables::new(law, 255, 1024.0)
        else {
            panic!("a power")
        };
        assert_eq!((doublings, exponents.len(), powers.len()), (10 << 16, 256, 4097));
        assert_eq!([powers[0], powers[4096]], [1 << 16, 1 << 15]);
        // at the top the mean is clamped from below; at 1/16 it is 0.0155 ln 16 + 0.0244 = 0.06738
        assert_eq!(exponents[255], [0.049, 0.008].map(|x: f64| (x * 65536.0 + 0.5) as i64));
        assert_eq!(exponents[16][0], (0.067_317_2 * 65536.0 + 0.5) as i64);
        assert!(exponents.windows(2).all(|pair| pair[1][0] <= pair[0][0]));
        let log = DriftTables::new(DriftLaw::Log { change: -0.01, spread: 0.002 }, 100, 1000.0);
        assert_eq!(log, DriftTables::Log([-3 * 65536, 39322]));
    }
}
