//! What an accumulator unit is worth.
//!
//! ```text
//! unit = weight_max / ( 2^level_bits (2^drive_bits - 1) )                    of z; 255/32 of it behind a normalised layer
//! ```
//!
//! Rational, so it is known exactly too. See docs/MODEL.md, 2.2 and 2.3.
#![expect(clippy::float_arithmetic, reason = "floats become integers here, as in the room above")]
#![deny(clippy::disallowed_types, clippy::disallowed_methods)]

use crate::num::fixed::{DriveBits, LevelBits};

/// What code 255 on the rows of a layer stands for, whatever the bits of a drive.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum FullDrive {
    /// 1: data, and activities of a table.
    One,
    /// 255/32, as 32 stands for 1: normalised activities.
    Normalised,
}

/// What one accumulator unit stands for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Unit {
    /// `log2(weight_max)`.
    pub weight_max_log2: i32,
    /// Bits of a level.
    pub level_bits: LevelBits,
    /// Bits of a drive code.
    pub drive_bits: DriveBits,
    /// What the greatest drive code stands for.
    pub full_drive: FullDrive,
}

impl Unit {
    pub(super) fn of_z(self) -> f64 {
        let levels = libm::exp2(f64::from(self.level_bits.get()));
        libm::exp2(f64::from(self.weight_max_log2)) / (levels * self.codes_of_one())
    }

    /// Drive codes that stand for 1.
    pub(super) fn codes_of_one(self) -> f64 {
        let codes = f64::from(self.drive_bits.code_max());
        match self.full_drive {
            FullDrive::One => codes,
            FullDrive::Normalised => codes * 32.0 / 255.0,
        }
    }

    /// What it is worth, as numerator and denominator in lowest terms: `weight_max / (2^level_bits (2^drive_bits - 1))`, 255/32
    /// of it behind a normalised layer.
    #[must_use]
    pub fn ratio(self) -> [u64; 2] {
        let codes = u64::from(self.drive_bits.code_max());
        let (mut above, mut below, point) = match self.full_drive {
            FullDrive::One => (1, codes, 0),
            FullDrive::Normalised => (255, codes, 5),
        };
        // 255 is 3 x 5 x 17
        for factor in [3, 5, 17] {
            if above % factor == 0 && below % factor == 0 {
                (above, below) = (above / factor, below / factor);
            }
        }
        let log2 = i64::from(self.weight_max_log2) - i64::from(self.level_bits.get()) - point;
        let by = log2.unsigned_abs();
        if log2 >= 0 { [above << by, below] } else { [above, below << by] }
    }

    /// The point of an accumulator: one unit is worth exactly `2^-point`. `None` where no power of two is: behind a
    /// normalised layer it is one with 8 drive bits, `weight_max / (32 2^level_bits)`.
    #[must_use]
    pub fn point(self) -> Option<i32> {
        let [above, below] = self.ratio();
        match (above.is_power_of_two(), below.is_power_of_two()) {
            (true, true) => {
                let log2 = |n: u64| i32::try_from(n.trailing_zeros()).expect("below 64");
                Some(log2(below) - log2(above))
            }
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Activation, Lut, Positive, Rate, RateOf};
    use super::*;
    use crate::num::fixed::{Batch, ErrorBits, LutBits, RateMantissa};

    fn unit(weight_max_log2: i32, level_bits: i64, drive_bits: i64, full_drive: FullDrive) -> Unit {
        Unit {
            weight_max_log2,
            level_bits: LevelBits::new(level_bits).unwrap(),
            drive_bits: DriveBits::new(drive_bits).unwrap(),
            full_drive,
        }
    }

    #[test]
    fn a_unit_is_a_fraction_and_now_and_then_a_power_of_two() {
        let of = |log2, level_bits, drive_bits, full| {
            let unit = unit(log2, level_bits, drive_bits, full);
            (unit.ratio(), unit.point())
        };
        use FullDrive::{Normalised, One};
        assert_eq!(of(2, 8, 8, One), ([1, 64 * 255], None));
        assert_eq!(of(2, 8, 1, One), ([1, 64], Some(6)));
        assert_eq!(of(8, 1, 1, One), ([128, 1], Some(-7)));
        // weight_max / (32 2^level_bits)
        assert_eq!(of(0, 8, 8, Normalised), ([1, 256 * 32], Some(13)));
        assert_eq!(of(-2, 8, 8, Normalised), ([1, 1024 * 32], Some(15)));
        assert_eq!(of(8, 1, 8, Normalised), ([4, 1], Some(-2)));
        assert_eq!(of(0, 8, 4, Normalised), ([17, 256 * 32], None));
        assert_eq!(of(0, 8, 3, Normalised), ([255, 7 * 256 * 32], None));
    }

    #[test]
    fn the_fraction_is_the_number() {
        for drive_bits in 1..=8 {
            for (log2, level_bits) in [(-8, 12), (0, 8), (8, 1)] {
                for full_drive in [FullDrive::One, FullDrive::Normalised] {
                    let unit = unit(log2, level_bits, drive_bits, full_drive);
                    let [above, below] = unit.ratio().map(|n| n as f64);
                    assert!((above / below / unit.of_z() - 1.0).abs() < 1e-12, "{unit:?}");
                }
            }
        }
    }

    /// 255/32 is nearly 8: three steps of a shift.
    #[test]
    fn behind_a_normalised_layer_tables_and_rates_are_three_shifts_off() {
        let bits = LutBits::new(10).unwrap();
        let step = |activation, full| Lut::step_shift(activation, bits, unit(2, 8, 8, full));
        let sigmoid = Activation::Sigmoid(Positive::new(4.0).unwrap());
        let rate = |full_drive| Rate {
            positions: 1,
            rate: Positive::new(3.0).unwrap(),
            batch: Batch::new(32).unwrap(),
            mantissa: RateMantissa::new(1).unwrap(),
            error_bits: ErrorBits::new(8).unwrap(),
            activation: sigmoid,
            unit: unit(2, 8, 8, full_drive),
            of: RateOf::Sums,
            window: None,
        };
        let (one, normalised) = (rate(FullDrive::One), rate(FullDrive::Normalised));
        assert_eq!(one.shift().unwrap(), normalised.shift().unwrap() + 3);
        let effective = |rate: Rate| rate.effective().unwrap().get();
        assert!((effective(one) / effective(normalised) - 255.0 / 256.0).abs() < 1e-12);
        for activation in [sigmoid, Activation::Relu] {
            let shifts = [FullDrive::One, FullDrive::Normalised].map(|full| step(activation, full));
            assert!((2..=3).contains(&(shifts[0] - shifts[1])), "{shifts:?}");
        }
    }
}
