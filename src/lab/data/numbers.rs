//! What kind of numbers a part holds, told from all of them, and the one door from floats to codes.
//!
//! ```text
//! whole numbers 0 ..= 255        value = x                          integers, or floats without a fraction above 1
//! fractions 0 ..= 1              value = floor( x M + 1/2 )         M the full scale, in binary64, halves up
//! ```
//!
//! Anything else is refused with what it is: nothing is clipped, shifted or scaled to fit.

/// The kind of numbers of a part.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum NumberKind {
    /// Whole numbers 0 to 255, taken as they are.
    Whole,
    /// Floats 0 to 1, taken to 0 ..= the full scale.
    Fraction,
}

/// Why numbers are no values of examples.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum NumbersError {
    /// Not a number, or infinite.
    #[error(
        "hold {found} (number {at} of the array, from 0): a missing value, and no level of light; leave \
         the example out, or fill the gap before it is saved (numpy.nan_to_num makes it 0)"
    )]
    NotFinite {
        /// Place in file order.
        at: usize,
        /// As printed.
        found: String,
    },
    /// Below 0.
    #[error(
        "reach from {least} to {greatest}, but a row is driven with 0 or more: values are 0 to 1, or whole \
         numbers 0 to 255; shift and scale all parts alike, by the training part: \
         (x - least) / (greatest - least)"
    )]
    Negative {
        /// Least number.
        least: f64,
        /// Greatest number.
        greatest: f64,
    },
    /// Whole numbers beyond a byte.
    #[error(
        "are whole numbers up to {greatest}, but they go in as bytes, 0 to 255; divide all parts by \
         {greatest} and save floats 0 to 1"
    )]
    Large {
        /// Greatest number.
        greatest: f64,
    },
    /// Fractions beyond 1.
    #[error(
        "have fractions and reach from {least} to {greatest}, but fractions are 0 to 1; divide all parts \
         alike by the greatest ({}) and save them anew", .greatest.max(1.0)
    )]
    Scale {
        /// Least number.
        least: f64,
        /// Greatest number.
        greatest: f64,
    },
}

/// What has been seen of the numbers of a part.
#[derive(Debug, Clone, PartialEq)]
pub struct NumberRange {
    least: f64,
    greatest: f64,
    /// Whether they are floats, as far as their file tells.
    floats: bool,
    fraction: bool,
    not_finite: Option<(usize, f64)>,
}

impl NumberRange {
    /// Nothing seen; `floats` says what the file calls them.
    #[must_use]
    pub const fn new(floats: bool) -> Self {
        Self {
            least: f64::INFINITY,
            greatest: f64::NEG_INFINITY,
            floats,
            fraction: false,
            not_finite: None,
        }
    }

    /// Takes number `at` into account.
    pub fn see(&mut self, at: usize, x: f64) {
        if !x.is_finite() {
            self.not_finite.get_or_insert((at, x));
            return;
        }
        self.least = self.least.min(x);
        self.greatest = self.greatest.max(x);
        self.fraction |= x.fract() != 0.0;
    }

    /// Takes a column of a table into account, whose numbers are finite.
    pub fn see_column(&mut self, least: f64, greatest: f64, floats: bool, fraction: bool) {
        self.least = self.least.min(least);
        self.greatest = self.greatest.max(greatest);
        self.floats |= floats;
        self.fraction |= fraction;
    }

    /// Greatest number seen.
    #[must_use]
    pub const fn greatest(&self) -> f64 {
        self.greatest
    }

    /// Whether these are floats that are read as the whole numbers they are.
    #[must_use]
    pub fn whole_floats(&self) -> bool {
        self.floats && !self.fraction && self.greatest > 1.0
    }

    /// The kind of these numbers.
    ///
    /// # Errors
    /// When they are neither whole numbers 0 to 255 nor fractions 0 to 1.
    pub fn kind(&self) -> Result<NumberKind, NumbersError> {
        let Self { least, greatest, floats, fraction, not_finite } = *self;
        if let Some((at, found)) = not_finite {
            return Err(NumbersError::NotFinite { at, found: found.to_string() });
        }
        if least < 0.0 {
            return Err(NumbersError::Negative { least, greatest });
        }
        match (fraction, greatest > 1.0, greatest > 255.0) {
            (true, true, _) => Err(NumbersError::Scale { least, greatest }),
            (false, _, true) => Err(NumbersError::Large { greatest }),
            (false, true, false) => Ok(NumberKind::Whole),
            // zeros and ones say nothing of their kind but by the name their file gives them
            _ if floats => Ok(NumberKind::Fraction),
            _ => Ok(NumberKind::Whole),
        }
    }
}

const TWO_TO_52: f64 = 4_503_599_627_370_496.0;

/// A number as a value; `kind` is that of a range in which it was seen.
#[must_use]
pub fn value(x: f64, kind: NumberKind, full_scale: u8) -> u8 {
    let whole = match kind {
        NumberKind::Whole => x,
        NumberKind::Fraction => (x * f64::from(full_scale) + 0.5).floor(),
    };
    // a whole number below 2^52 stands in the last bits of its sum with 2^52
    (whole + TWO_TO_52).to_bits().to_le_bytes()[0]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn kind(numbers: &[f64], floats: bool) -> Result<NumberKind, String> {
        let mut range = NumberRange::new(floats);
        numbers.iter().enumerate().for_each(|(at, &x)| range.see(at, x));
        range.kind().map_err(|error| error.to_string())
    }

    #[test]
    fn a_part_is_whole_numbers_or_fractions_or_refused_with_what_it_is() {
        use NumberKind::{Fraction, Whole};
        let cases: [(&[f64], bool, NumberKind); 6] = [
            (&[0.0, 255.0], false, Whole),
            (&[0.0, 16.0], true, Whole),
            (&[0.0, 1.0], false, Whole),
            (&[0.0, 1.0], true, Fraction),
            (&[0.0, 0.5, 1.0], true, Fraction),
            (&[-0.0], true, Fraction),
        ];
        for (numbers, floats, wanted) in cases {
            assert_eq!(kind(numbers, floats), Ok(wanted), "{numbers:?}");
        }
        let refused: [(&[f64], &str); 7] = [
            (&[0.5, f64::NAN], "hold NaN (number 1"),
            (&[f64::INFINITY], "hold inf"),
            (&[-0.5, 2.0], "reach from -0.5 to 2,"),
            (&[0.0, 256.0], "whole numbers up to 256,"),
            (&[0.5, 254.5], "reach from 0.5 to 254.5, but fractions are 0 to 1"),
            (&[0.5, 1.0 + f64::EPSILON], "fractions are 0 to 1"),
            (&[-1e-9], "or more"),
        ];
        for (numbers, wanted) in refused {
            let error = kind(numbers, true).unwrap_err();
            assert!(error.contains(wanted), "{error}");
        }
    }

    #[test]
    fn every_code_comes_back_from_its_own_float_and_halves_round_up() {
        for scale in [1u8, 16, 255] {
            for code in 0..=scale {
                let x = f64::from(code) / f64::from(scale);
                assert_eq!(value(x, NumberKind::Fraction, scale), code);
                assert_eq!(value(f64::from(code), NumberKind::Whole, scale), code);
            }
        }
        let halves = [0.0, 255.0, 509.0, 510.0].map(|n| n / 510.0);
        assert_eq!(halves.map(|x| value(x, NumberKind::Fraction, 255)), [0, 128, 255, 255]);
    }
}
