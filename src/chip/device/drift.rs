//! Drift of levels between programming and reading, at one moment.
//!
//! ```text
//! g, r    = words of 16 bits of the cell at site 6, sub 0 and 1: a Gaussian, and rounding
//! power   level' = (level f + r) >> 16            f = e_(frac >> 4, rounded) >> int of x = rsh(nu T, 16), nu = max(0, mean + rsh(g sd, 12))
//! log     level' = ((level << 16) + c + r) >> 16  c = mean + rsh(g sd, 12)
//! then    clamp(level', 0, level_max)             also below the floor: the window is one of programming
//! ```
//!
//! Mean and sd are those of the level as it was programmed. Levels are the resolution: a fraction of one is kept with its chance. A
//! function of the place and the moment. See docs/MODEL.md, 3.12.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use crate::num::fixed::rsh;
use crate::num::tables::{DriftTables, Gaussian};

impl DriftTables {
    /// What a level has become, by the words of its cell.
    #[must_use]
    pub fn aged(&self, gaussian: &Gaussian, level: u16, [g, r]: [u16; 2], level_max: u16) -> u16 {
        let (old, r) = (i64::from(level), i64::from(r));
        let moved = match self {
            Self::Power { exponents, doublings, powers } => {
                let [mean, sd] = exponents[usize::from(level)];
                let exponent = (mean + rsh(gaussian.of(g) * sd, 12)).max(0);
                let x = rsh(exponent * doublings, 16);
                let (whole, part) = (x >> 16, rsh(x & 0xffff, 4));
                let factor = powers[usize::try_from(part).expect("a fraction")];
                let factor = i64::from(factor) >> whole.min(31);
                (old * factor + r) >> 16
            }
            Self::Log([mean, sd]) => ((old << 16) + mean + rsh(gaussian.of(g) * sd, 12) + r) >> 16,
        };
        u16::try_from(moved.clamp(0, i64::from(level_max))).expect("inside a level")
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::num::draw::{Place, Site};
    use crate::num::tables::{DriftLaw, OfLogarithm};

    fn words(sub: u32, count: usize) -> Vec<u16> {
        let place = Place { seed: 5, site: Site::Drift, layer: 0, pathway: 0, sub, count: 0 };
        let mut bytes = vec![0; count.div_ceil(32) * 64];
        place.columns(count, 0..1, 2, &mut bytes);
        bytes.as_chunks::<2>().0.iter().take(count).map(|b| u16::from_le_bytes(*b)).collect()
    }

    fn pcm() -> DriftLaw {
        DriftLaw::Power {
            exponent: OfLogarithm { slope: -0.0155, offset: 0.0244, least: 0.049, most: 0.1 },
            spread: OfLogarithm { slope: -0.0125, offset: -0.0059, least: 0.008, most: 0.045 },
        }
    }

    /// Mean and variance over 10^5 cells of one level, within four of the deviations that such a sample has; fails when rounding
    /// leans, when the exponent has no spread, or when time is not a logarithm.
    #[test]
    fn a_level_falls_by_the_power_of_time_with_its_spread() {
        let gaussian = Gaussian::new();
        let (g, r) = (words(0, 100_000), words(1, 100_000));
        for (level, ratio, nu, sd) in
            [(200u16, 4320.0, 0.049, 0.008), (60, 1.5e6, 0.046_827, 0.012_187)]
        {
            let nu = f64::max(nu, 0.049);
            let tables = DriftTables::new(pcm(), 255, ratio);
            let aged = g
                .iter()
                .zip(&r)
                .map(|(&g, &r)| f64::from(tables.aged(&gaussian, level, [g, r], 255)));
            let aged: Vec<f64> = aged.collect();
            let n = aged.len() as f64;
            let mean = aged.iter().sum::<f64>() / n;
            let var = aged.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / n;
            // log-normal, and rounding: a fraction p of a level has variance p (1 - p), a sixth on average
            let s = sd * f64::ln(ratio);
            let median = f64::from(level) * f64::powf(ratio, -nu);
            let wanted = median * (s * s / 2.0).exp();
            let spread = wanted * wanted * ((s * s).exp() - 1.0) + 1.0 / 6.0;
            assert!((mean - wanted).abs() < 4.0 * (spread / n).sqrt() + 0.02, "{mean} {wanted}");
            assert!((var / spread - 1.0).abs() < 0.04, "{var} {spread}");
        }
    }

    #[test]
    fn nothing_has_moved_at_the_start_and_no_level_leaves_its_range() {
        let gaussian = Gaussian::new();
        let log = DriftLaw::Log { change: -0.01, spread: 0.5 };
        for law in [pcm(), log] {
            let (now, late) = (DriftTables::new(law, 255, 1.0), DriftTables::new(law, 255, 1e12));
            for level in 0..=255 {
                for word in (0..=u16::MAX).step_by(257) {
                    assert_eq!(now.aged(&gaussian, level, [word, !word], 255), level);
                    assert!(late.aged(&gaussian, level, [word, word], 255) <= 255);
                }
            }
        }
    }

    #[test]
    fn a_logarithm_moves_all_levels_alike() {
        let tables = DriftTables::new(DriftLaw::Log { change: -0.01, spread: 0.0 }, 100, 1000.0);
        let gaussian = Gaussian::new();
        let aged = [0, 2, 50, 100].map(|level| tables.aged(&gaussian, level, [9, 0], 100));
        assert_eq!(aged, [0, 0, 47, 97]);
    }
}
