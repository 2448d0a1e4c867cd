//! How cells of a device differ: factors of a normal or log-normal law, by a random word.
//!
//! ```text
//! q_i     = PHI^-1( i / 65536 ),  i = 1 .. 65535;   q_0 = -q_65536 = PHI^-1( 2^-18 )
//! T_i     = clamp( floor( 2^24 f(q_i) + 1/2 ), 0, 2^32 - 1 ),   f(q) = 1 + s q  (normal)  or  exp(s q)  (log-normal)
//! factor  = T_i + ( (T_(i+1) - T_i) low >> 16 ),                i = word >> 16,  low = word mod 2^16
//! ```
//!
//! A factor has 24 fractional bits. Of a normal law what would lie below 0 is 0; the median of both is 1. See docs/MODEL.md, 3.11.
#![expect(clippy::float_arithmetic, reason = "floats become integers here, at load only")]
#![deny(clippy::disallowed_types, clippy::disallowed_methods)]

use std::sync::LazyLock;

use crate::num::fixed::Millionths;

/// Fractional bits of a factor.
pub const FACTOR_BITS: u32 = 24;
/// A factor of 1.
pub const FACTOR_ONE: u32 = 1 << FACTOR_BITS;
/// Words of 16 bits that a quantile stands for.
const KNOTS: u32 = 1 << 16;

/// What a factor is drawn from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum SpreadLaw {
    /// `1 + s q`, not below 0.
    Normal,
    /// `exp(s q)`.
    LogNormal,
}

/// Factors of a law, by quantile.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Quantiles(Vec<u32>);

impl Quantiles {
    /// Those of a standard deviation: of the factor, or of its logarithm.
    #[must_use]
    pub fn new(law: SpreadLaw, deviation: Millionths) -> Self {
        #[expect(clippy::cast_precision_loss, reason = "below 2^53 millionths")]
        let deviation = deviation.0 as f64 / 1e6;
        let factor = |q: f64| {
            let factor = match law {
                SpreadLaw::Normal => 1.0 + deviation * q,
                SpreadLaw::LogNormal => libm::exp(deviation * q),
            };
            let fine = libm::floor(factor * libm::exp2(f64::from(FACTOR_BITS)) + 0.5);
            #[expect(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "held between 0 and 2^32 - 1"
            )]
            let fine = fine.max(0.0).min(f64::from(u32::MAX)) as u32;
            fine
        };
        // the lower half, and its mirror
        let half = &*LOWER_QUANTILES;
        let all = half.iter().copied().chain([0.0]).chain(half.iter().rev().map(|q| -q));
        Self(all.map(factor).collect())
    }

    /// The greatest factor.
    #[must_use]
    pub fn greatest(&self) -> u32 {
        self.0.last().copied().unwrap_or_default()
    }

    /// The factor of a word.
    #[must_use]
    pub fn factor(&self, word: u32) -> u32 {
        let at = (word >> 16) as usize;
        let [from, to] = [self.0[at], self.0[at + 1]];
        let part = u64::from(to - from) * u64::from(word & 0xffff);
        from + u32::try_from(part >> 16).expect("a part of 32 bits")
    }
}

/// [`lower_quantiles`], found once.
static LOWER_QUANTILES: LazyLock<Vec<f64>> = LazyLock::new(lower_quantiles);

/// `q_0 .. q_32767`, rising: each from the one above it by Newton's rule.
fn lower_quantiles() -> Vec<f64> {
    let root = libm::sqrt(2.0);
    let below = |q: f64| 0.5 * libm::erfc(-q / root);
    let density = |q: f64| libm::exp(-0.5 * q * q) / libm::sqrt(2.0 * std::f64::consts::PI);
    let mut q = 0.0;
    let mut all: Vec<f64> = (0..KNOTS / 2)
        .rev()
        .map(|i| {
            let share = if i == 0 { 0.25 } else { f64::from(i) } / f64::from(KNOTS);
            // the first is farther from its neighbour than others
            for _ in 0..if i == 0 { 8 } else { 4 } {
                q -= (below(q) - share) / density(q);
            }
            q
        })
        .collect();
    all.reverse();
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_are_those_of_tables() {
        let q = lower_quantiles();
        assert!(q.is_sorted() && q.len() == 32_768);
        // PHI^-1 of 1/4, 1/8, 1/1024 and 2^-18
        let known = [(16_384, -0.674_489_75), (8_192, -1.150_349_38), (64, -3.097_269_08)];
        for (at, want) in known.into_iter().chain([(0, -4.472_0)]) {
            let error = q[at] - want;
            assert!(error.abs() < if at == 0 { 1e-1 } else { 1e-7 }, "{at}: {}", q[at]);
        }
    }

    #[test]
    fn a_factor_has_the_moments_of_its_law() {
        for deviation in [0.01, 0.3, 0.78] {
            let millionths = Millionths((deviation * 1e6) as i64);
            let normal = Quantiles::new(SpreadLaw::Normal, millionths);
            let log = Quantiles::new(SpreadLaw::LogNormal, millionths);
            // every 2^12th word: an even draw
            let words = || (0..1u32 << 20).map(|at| at << 12 | 0x800);
            let mean = |of: &dyn Fn(u32) -> f64| words().map(of).sum::<f64>() / f64::from(1 << 20);
            let of = |q: &Quantiles, word: u32| f64::from(q.factor(word)) / f64::from(FACTOR_ONE);
            let logarithm = |word: u32| libm::log(of(&log, word));
            let (m, v) = (mean(&logarithm), mean(&|w| logarithm(w) * logarithm(w)));
            assert!(m.abs() < 1e-5 && (v / (deviation * deviation) - 1.0).abs() < 1e-3, "{v}");
            if deviation < 0.2 {
                let off = |word: u32| of(&normal, word) - 1.0;
                let (m, v) = (mean(&off), mean(&|w| off(w) * off(w)));
                assert!(m.abs() < 1e-5 && (v / (deviation * deviation) - 1.0).abs() < 1e-3);
            }
            assert!(words().is_sorted_by_key(|word| normal.factor(word)));
        }
        let one = Quantiles::new(SpreadLaw::Normal, Millionths(300_000));
        assert_eq!(one.factor(1 << 31), FACTOR_ONE);
        assert_eq!(one.factor(0), 0, "1 - 0.3 q below 0 is 0");
    }
}
