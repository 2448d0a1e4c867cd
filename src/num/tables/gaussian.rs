//! The absolute value of a Gaussian as a table, and Gaussian numbers of words.
//!
//! ```text
//! h_i = floor( 2^12 PHI^-1( 1/2 + (i + 1/2) / 8192 ) + 1/2 )                  i = 0 .. 4095
//!     = greatest h with erf( (h - 1/2) / (2^12 sqrt 2) ) <= (2 i + 1) / 8192
//! ```
//!
//! No `erf` of the table lies nearer to its bound than a million times its own error. See docs/MODEL.md, 3.6.
#![expect(clippy::float_arithmetic, reason = "floats become integers here, as in the room above")]
#![deny(clippy::disallowed_types, clippy::disallowed_methods)]

/// Entries of the table.
const ENTRIES: u16 = 4096;
/// Fractional bits of an entry.
const POINT: i32 = 12;

/// `erf((h - 1/2) / (2^12 sqrt 2))`: how often an absolute Gaussian rounds to less than `h`.
fn below(h: u16) -> f64 {
    libm::erf((f64::from(h) - 0.5) * libm::exp2(f64::from(-POINT)) / libm::sqrt(2.0))
}

/// `h_i`, 12 fractional bits, rising: what the places of an even draw become.
#[must_use]
pub fn half_gaussian() -> Vec<u16> {
    let mut h = 0;
    let entry = |i: u16| {
        let bound = f64::from(2 * i + 1) / f64::from(2 * ENTRIES);
        while below(h + 1) <= bound {
            h += 1;
        }
        h
    };
    (0..ENTRIES).map(entry).collect()
}

/// Gaussian numbers of words.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Gaussian(Vec<u16>);

impl Gaussian {
    /// The table.
    #[must_use]
    pub fn new() -> Self {
        Self(half_gaussian())
    }

    /// The number of a word, 12 fractional bits: its upper 12 bits are the place, its last bit is the sign. Its variance lies
    /// 0.02 % below 1 and nothing lies beyond 3.85.
    #[inline]
    #[must_use]
    pub fn of(&self, word: u16) -> i64 {
        let size = i64::from(self.0[usize::from(word >> 4)]);
        if word & 1 == 0 { size } else { -size }
    }
}

impl Default for Gaussian {
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_numbers_of_all_words_are_a_gaussian() {
        let gaussian = Gaussian::new();
        let all: Vec<f64> = (0..=u16::MAX).map(|word| gaussian.of(word) as f64 / 4096.0).collect();
        let mean = |power: i32| all.iter().map(|x| x.powi(power)).sum::<f64>() / 65_536.0;
        assert_eq!(mean(1), 0.0, "as often below as above");
        assert!((0.9995..1.0).contains(&mean(2)), "{}", mean(2));
        assert!((mean(4) - 3.0).abs() < 0.05, "{}", mean(4));
        for (beyond, share) in [(1.0, 0.31731), (2.0, 0.0455), (3.0, 0.0027)] {
            let found = all.iter().filter(|x| x.abs() > beyond).count() as f64 / 65_536.0;
            assert!((found - share).abs() < 2.5e-4, "{beyond}: {found}");
        }
        let most = all.iter().copied().fold(0.0, f64::max);
        assert!((3.8..3.85).contains(&most), "{most}");
    }

    #[test]
    fn no_entry_is_rounded_by_chance() {
        for (i, h) in (0u16..).zip(half_gaussian()) {
            let bound = f64::from(2 * i + 1) / 8192.0;
            assert!(below(h) <= bound - 1e-9 && below(h + 1) >= bound + 1e-9, "{i}");
        }
    }

    #[test]
    fn it_has_the_moments_of_an_absolute_gaussian() {
        let table = half_gaussian();
        assert!(table.is_sorted() && table.len() == 4096);
        // quantiles known from tables: PHI^-1 of 3/4, 0.9 and 0.975 are 0.67449, 1.28155, 1.95996
        let at = |share: f64| f64::from(table[(share * 4096.0) as usize]) / 4096.0;
        for (share, x) in [(0.5, 0.674_49), (0.8, 1.281_55), (0.95, 1.959_96)] {
            assert!((at(share) - x).abs() < 1e-3, "{share}");
        }
        let mean = |power: i32| {
            let sum: f64 = table.iter().map(|&h| (f64::from(h) / 4096.0).powi(power)).sum();
            sum / 4096.0
        };
        // sqrt(2 / pi) and 1, less what lies beyond the last entry
        assert!((mean(1) - 0.797_88).abs() < 1e-3 && (mean(2) - 1.0).abs() < 3e-3);
        assert_eq!(table[0], 1);
    }
}
