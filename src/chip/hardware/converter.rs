//! Kinds of converters: how many steps a conversion of so many bits takes.
//!
//! ```text
//! sar       bits + 1       a comparison a bit, and one step to sample
//! counter   2^bits         counts up to the greatest code
//! ramp      2^bits         compares with one reference that rises code by code
//! flash     1              2^bits - 1 comparators at once
//! fixed     -              takes the cycles it is given, whatever its bits
//! ```
//!
//! Where a drive code is read in phases, a converter may convert in each only what that phase still owes: the bits of the
//! output that earlier phases have not carried, and at least one. See docs/MODEL.md, 4.5.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

/// What a converter does in a conversion.
///
/// ```
/// use dalean::hardware::ConverterKind;
///
/// assert_eq!(ConverterKind::Sar.steps(6), Some(7));
/// assert_eq!(ConverterKind::Counter.steps(6), Some(64));
/// assert_eq!(ConverterKind::Fixed.steps(6), None);
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ConverterKind {
    /// Takes the cycles it is given.
    Fixed,
    /// Successive approximation.
    Sar,
    /// Counts.
    Counter,
    /// Compares with a rising reference.
    Ramp,
    /// A comparator a code.
    Flash,
}

impl ConverterKind {
    /// All of them, by their words in files.
    pub const NAMES: &[(&str, Self)] = &[
        (Self::Fixed.name(), Self::Fixed),
        (Self::Sar.name(), Self::Sar),
        (Self::Counter.name(), Self::Counter),
        (Self::Ramp.name(), Self::Ramp),
        (Self::Flash.name(), Self::Flash),
    ];

    /// Its word in files.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Fixed => "fixed",
            Self::Sar => "sar",
            Self::Counter => "counter",
            Self::Ramp => "ramp",
            Self::Flash => "flash",
        }
    }

    /// Steps of a conversion of so many bits, 1..=16; `None` where bits decide nothing.
    #[must_use]
    pub const fn steps(self, bits: u32) -> Option<u64> {
        match self {
            Self::Fixed => None,
            Self::Sar => Some(bits as u64 + 1),
            Self::Counter | Self::Ramp => Some(1 << bits),
            Self::Flash => Some(1),
        }
    }
}

/// Bits of an output that a phase still owes when those before it have carried so many.
#[must_use]
pub const fn owed(bits: u32, carried: u32) -> u32 {
    if bits > carried { bits - carried } else { 1 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_phase_owes_at_least_one_bit() {
        assert_eq!([0, 4, 9, 10, 11, 40].map(|carried| owed(10, carried)), [10, 6, 1, 1, 1, 1]);
    }

    #[test]
    fn a_counter_of_one_bit_more_takes_twice_the_steps() {
        for bits in 1..16 {
            for kind in [ConverterKind::Counter, ConverterKind::Ramp] {
                assert_eq!(kind.steps(bits + 1), kind.steps(bits).map(|steps| 2 * steps));
            }
            assert_eq!(ConverterKind::Sar.steps(bits), Some(u64::from(bits) + 1));
        }
    }
}
