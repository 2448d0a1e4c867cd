//! Converters and tables beside a crossbar: pure functions of numbers.
//!
//! ```text
//! slice        x_s = (x >> s dac_bits) & (2^dac_bits - 1)
//! digital      code = min( rsh(v, ash), 2^adc_bits - 1 )                              v >= 0
//! current      d = clamp( rsh(v_E - v_I, ash), -2^(adc_bits-1), 2^(adc_bits-1) - 1 )
//! index        i = clamp( rsh(acc, lsh), -2^(lut_bits-1), 2^(lut_bits-1) - 1 )
//! next drive   min( rsh(a, 8 - drive_bits), 2^drive_bits - 1 )
//! gate         u = sat_8( rsh( err * a', error_bits ) )
//! ```
//!
//! A saturation is a value that its clamp changed; reaching the rail is none. See docs/MODEL.md, 2.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

pub mod normalise;

use super::hardware::Subtract;
use crate::num::fixed::{AdcBits, DriveBits, ErrorBits, rsh, sat};

/// Slice `slice` of a drive code.
#[inline]
#[must_use]
pub const fn slice(code: u8, slice: u32, dac_bits: u32) -> u8 {
    ((code as u32 >> (slice * dac_bits)) & ((1 << dac_bits) - 1)) as u8
}

/// One converter: its ends and its step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Converter {
    /// Least code.
    pub min: i64,
    /// Greatest code.
    pub max: i64,
    /// Step, as a shift of the current.
    pub shift: u32,
}

impl Converter {
    /// A converter of `bits` with step `2^shift`.
    #[must_use]
    pub const fn new(bits: AdcBits, subtract: Subtract, shift: u32) -> Self {
        match subtract {
            Subtract::Digital => Self { min: 0, max: (1 << bits.get()) - 1, shift },
            Subtract::Current => {
                Self { min: -(1 << (bits.get() - 1)), max: (1 << (bits.get() - 1)) - 1, shift }
            }
        }
    }

    /// Code of a current, and whether the converter saturated.
    #[inline]
    #[must_use]
    pub fn convert(self, current: i64) -> (i64, bool) {
        let steps = rsh(current, self.shift);
        if steps > self.max {
            (self.max, true)
        } else if steps < self.min {
            (self.min, true)
        } else {
            (steps, false)
        }
    }

    /// Whether a code lies at an end of the range: the greatest one or, of a difference, also the least.
    #[inline]
    #[must_use]
    pub const fn is_rail(self, code: i64) -> bool {
        code == self.max || (self.min < 0 && code == self.min)
    }

    /// The least shift at which `current` does not reach the rail.
    #[must_use]
    pub fn least_shift(self, current: i64) -> u32 {
        let inside = |shift: &u32| {
            let steps = rsh(current, *shift);
            steps < self.max && (self.min == 0 || steps > self.min)
        };
        (0..63).find(inside).unwrap_or(63)
    }
}

/// Look-up of an accumulator in a table of `2 half` entries: the place, and whether the index saturated.
#[inline]
#[must_use]
pub fn index(accumulator: i64, shift: u32, half: i64) -> (usize, bool) {
    let steps = rsh(accumulator, shift);
    let i = if steps < -half {
        -half
    } else if steps >= half {
        half - 1
    } else {
        steps
    };
    ((i + half) as usize, i != steps)
}

/// The drive code an activity becomes for the next layer.
#[must_use]
pub fn drive(activity: u8, bits: DriveBits) -> u8 {
    let code = rsh(i64::from(activity), 8 - bits.get()).min(i64::from(bits.code_max()));
    u8::try_from(code).expect("a drive code is a byte")
}

/// What a column contributes to an increment, and whether that saturated.
#[inline]
#[must_use]
pub fn gate(error: i16, derivative: u8, bits: ErrorBits) -> (i8, bool) {
    let (u, saturated) = sat(rsh(i64::from(error) * i64::from(derivative), bits.get()), 8);
    (u as i8, saturated)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn adc(bits: i64, subtract: Subtract, shift: u32) -> Converter {
        Converter::new(AdcBits::new(bits).unwrap(), subtract, shift)
    }

    #[test]
    fn halves_round_up_and_the_rail_saturates() {
        let adc = adc(2, Subtract::Digital, 3); // step 8, codes 0 to 3
        assert_eq!([3, 4, 11, 12, 27].map(|v| adc.convert(v).0), [0, 1, 1, 2, 3]);
        assert!(!adc.convert(27).1 && adc.convert(28).1);
    }

    #[test]
    fn a_difference_has_one_code_more_below_zero() {
        let adc = adc(3, Subtract::Current, 0);
        assert_eq!(
            [-5, -4, 3, 4].map(|v| adc.convert(v)),
            [(-4, true), (-4, false), (3, false), (3, true)]
        );
    }

    #[test]
    fn a_code_at_an_end_is_on_the_rail_whether_or_not_it_was_changed() {
        let on_rail = |adc: Converter, v| adc.is_rail(adc.convert(v).0);
        let digital = adc(8, Subtract::Digital, 0);
        assert_eq!([0, 254, 255, 256].map(|v| on_rail(digital, v)), [false, false, true, true]);
        let current = adc(8, Subtract::Current, 0);
        let seen = [-129, -128, -127, 0, 126, 127, 128].map(|v| on_rail(current, v));
        assert_eq!(seen, [true, true, false, false, false, true, true]);
    }

    #[test]
    fn the_least_shift_keeps_a_current_off_the_rail() {
        let digital = adc(8, Subtract::Digital, 0);
        assert_eq!([0, 254, 255, 508, 509].map(|v| digital.least_shift(v)), [0, 0, 1, 1, 2]);
        let current = adc(8, Subtract::Current, 0);
        assert_eq!([-127, -128, 126, 127].map(|v| current.least_shift(v)), [0, 1, 0, 1]);
    }

    #[test]
    fn slices_cover_the_code() {
        for code in 0..=255 {
            let back: u32 = (0..3).map(|s| u32::from(slice(code, s, 3)) << (3 * s)).sum();
            assert_eq!(back, u32::from(code));
        }
    }

    #[test]
    fn a_table_is_entered_at_its_middle_and_left_at_its_ends() {
        assert_eq!(
            [-6, -5, -4, -1, 0, 1, 2, 3, 1 << 40].map(|acc| index(acc, 1, 2)),
            [
                (0, true),
                (0, false),
                (0, false),
                (2, false),
                (2, false),
                (3, false),
                (3, false),
                (3, true),
                (3, true)
            ]
        );
    }

    #[test]
    fn drives_and_gates_at_their_edges() {
        let four = DriveBits::new(4).unwrap();
        assert_eq!([0, 7, 8, 247, 248, 255].map(|a| drive(a, four)), [0, 0, 1, 15, 15, 15]);
        let bits = ErrorBits::new(8).unwrap();
        assert_eq!(
            [(127, 255), (-127, 255), (1, 127), (1, 128), (-1, 128), (-1, 129)]
                .map(|(e, d)| gate(e, d, bits)),
            [(127, false), (-127, false), (0, false), (1, false), (0, false), (-1, false)]
        );
        // nine-bit errors at the peak derivative still fit: 255 * 255 / 512 = 127.00
        assert_eq!(gate(255, 255, ErrorBits::new(9).unwrap()), (127, false));
    }

    proptest! {
        #[test]
        fn more_current_never_reads_lower(
            bits in 2i64..=16, shift in 0u32..=24, a in -1i64<<32..1i64<<32, b in -1i64<<32..1i64<<32,
        ) {
            for subtract in [Subtract::Digital, Subtract::Current] {
                let adc = adc(bits, subtract, shift);
                prop_assert!(adc.convert(a.min(b)).0 <= adc.convert(a.max(b)).0);
            }
        }
    }
}
