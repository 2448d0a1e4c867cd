//! Scales of whole layers: a power of two in 256ths of a doubling becomes a small mantissa and a shift.
//!
//! ```text
//! X = 256 e + f, held to 0 ..= 256 x 31 - 1;   (m, s) = table[f]
//! m 2^-(e + s)  is what comes nearest to 2^(-X / 256), by ratio, with m = 1 ..= 15;  the least m of those alike
//! ```
//!
//! It comes within 2^(1/11), 6.4 %. See docs/MODEL.md, 3.10.
#![expect(clippy::float_arithmetic, reason = "floats become integers here, at load only")]
#![deny(clippy::disallowed_types, clippy::disallowed_methods)]

use crate::num::fixed::{RateMantissa, narrow};

/// `X` that are not held lie below it.
const END: i64 = 256 * 31;

/// Mantissas and shifts by the fraction of a power.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Scales(Box<[[u32; 2]; 256]>);

/// A factor `mantissa 2^-shift`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Factor {
    /// 1..=15.
    pub mantissa: u32,
    /// 0..=34.
    pub shift: u32,
    /// Whether the power lay outside.
    pub held: bool,
}

impl Scales {
    /// Makes the table.
    #[must_use]
    pub fn new() -> Self {
        let entry = |f: u32| {
            let all = (RateMantissa::MIN..=RateMantissa::MAX).map(|m| {
                let exact = libm::log2(f64::from(m)) + f64::from(f) / 256.0;
                let shift = libm::floor(exact + 0.5);
                // one in a million is nothing, as of a rate's mantissa
                let off = libm::floor((exact - shift).abs() * 1e6 + 0.5);
                let [off, shift] = [off, shift].map(whole);
                (off, [m, shift])
            });
            all.min_by_key(|(off, _)| *off).expect("mantissas are some").1
        };
        Self(Box::new(std::array::from_fn(|f| entry(narrow(f, "256 entries")))))
    }

    /// The factor of a power, `2^(-power / 256)`.
    #[must_use]
    pub fn at(&self, power: i64) -> Factor {
        let held = power.clamp(0, END - 1);
        let [mantissa, shift] = self.0[narrow::<usize>(held % 256, "a remainder")];
        let shift = shift + narrow::<u32>(held / 256, "at most 30");
        Factor { mantissa, shift, held: held != power }
    }
}

impl Default for Scales {
    fn default() -> Self {
        Self::new()
    }
}

fn whole(x: f64) -> u32 {
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "whole, at most 1e6"
    )]
    {
        x as u32
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_power_has_its_nearest_factor_and_ends_are_held() {
        let scales = Scales::new();
        for power in -300..END + 300 {
            let scale = scales.at(power);
            assert_eq!(scale.held, !(0..END).contains(&power));
            let exact = power.clamp(0, END - 1) as f64 / 256.0;
            let off = |m: u32, s: u32| (f64::from(m).log2() - f64::from(s) + exact).abs();
            let found = off(scale.mantissa, scale.shift);
            assert!(found <= 1.0 / 11.0, "{power}: {scale:?}");
            for m in 1..=15 {
                for s in scale.shift.saturating_sub(5)..scale.shift + 5 {
                    // as near with less, or nearer, there is none
                    let limit = if m < scale.mantissa { found + 1e-6 } else { found - 1e-6 };
                    assert!(off(m, s) > limit || (m, s) == (scale.mantissa, scale.shift));
                }
            }
        }
        assert_eq!(scales.at(512), Factor { mantissa: 1, shift: 2, held: false });
    }
}
