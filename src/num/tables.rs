//! Tables: floats in, integers out, at load only. The one room of the core where floats are allowed.
//!
//! ```text
//! lut_a[i] = floor(255 f + 1/2), lut_d[i] = floor(255 f' / peak + 1/2), both at z = i * 2^lsh units, clamped to 0..=255
//! unit     = weight_max / ( 2^level_bits * (2^drive_bits - 1) )                        of z
//! lsh      = least shift >= 0 with 2^(lut_bits - 1 + lsh) units >= 4 alpha (sigmoid), 4 (ReLU, identity)
//! exact    : units are rational, so tables of ReLU and identity, and their lsh, are computed in integers:
//!            lut_a[i] = floor( (2 * 255 * i * 2^p + D) / (2 D) ),  p = lsh + log2(weight_max) - level_bits,  D = 2^drive_bits - 1
//! softmax  of accumulators, by look-up: `softmax`
//! k        of a rate: `rate`;  factors of a layer: `scales`
//! steps    of pulses: `response`;  factors of cells: `spread`
//! ```
//!
//! Elsewhere only `+ - * /` and the functions of the `libm` crate (pure Rust, pinned) are used, so the integers are the
//! same on every machine. See docs/MODEL.md, 2 and 3.
#![expect(clippy::float_arithmetic, reason = "floats become integers here and nowhere else")]
#![deny(clippy::disallowed_types, clippy::disallowed_methods)]

mod drift;
mod gaussian;
mod policy;
#[cfg(test)]
pub(crate) mod precise;
mod rate;
mod response;
mod scales;
mod softmax;
mod spread;
mod unit;

pub use drift::{DriftLaw, DriftPace, DriftRates, DriftTables, OfLogarithm};
pub use gaussian::{Gaussian, half_gaussian};
pub use policy::PolicyTables;
pub use rate::{Decay, LEVELS_SHIFT_MAX, Rate, RateOf, SHIFT_MAX};
pub use response::{
    ExponentialSteps, LinearSteps, MeasuredSteps, NeurosimSteps, Response, ResponseError,
    STEP_BITS, SoftBoundSteps, TableSteps,
};
pub use scales::{Factor, Scales};
pub use softmax::SoftmaxTables;
pub use spread::{FACTOR_BITS, FACTOR_ONE, Quantiles, SpreadLaw};
pub use unit::{FullDrive, Unit};

use super::fixed::{LutBits, narrow, rsh};

/// A finite number above 0, given by the user: a width, a rate, a factor.
///
/// ```
/// use dalean::network::Positive;
///
/// let rate = Positive::new(20.0).expect("in range");
/// assert_eq!(rate.times(rate).map(Positive::get), Some(400.0));
/// assert_eq!([0.0, -1.0, f64::NAN].map(Positive::new), [None; 3]);
/// ```
#[derive(Debug, Clone, Copy, PartialEq, PartialOrd)]
pub struct Positive(f64);

impl Positive {
    /// One.
    pub const ONE: Self = Self(1.0);

    /// `value`, if it is finite and lies in `1e-6..=1e6`.
    #[must_use]
    pub fn new(value: f64) -> Option<Self> {
        (1e-6..=1e6).contains(&value).then_some(Self(value))
    }

    /// The plain number, for files and reports.
    #[must_use]
    pub const fn get(self) -> f64 {
        self.0
    }

    /// The product, if it is still in range.
    #[must_use]
    pub fn times(self, other: Self) -> Option<Self> {
        Self::new(self.0 * other.0)
    }
}

/// The function a unit applies to its pre-activation.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum Activation {
    /// `1 / (1 + exp(-2 z / alpha))`, of width alpha (paper, section 3.3).
    Sigmoid(Positive),
    /// `max(z, 0)`, full code at 1; derivative 0 at 0.
    Relu,
    /// `z` in 0..=1.
    Identity,
    /// `max(z, 0)` over its root mean square in the stream: code 32 where they are equal, derivative 1 where `z > 0`. No
    /// table: `chip::periphery::normalise`. For layers whose units drive others.
    Rms,
    /// `z / 3` in 0..=1 where a standard deviation is 1: a table in steps of a [gain](crate::chip::layer::Gain) that is found,
    /// 2^(lut_bits - 3) of them a deviation. Derivative 1 where `0 < z < 3`.
    Ramp,
    /// The accumulator itself, derivative 1 everywhere. No table: what is read out is `acc_p - acc_n`, or `acc_p` alone. For a
    /// last layer.
    Accumulator,
}

impl Activation {
    /// `1 / peak` of the derivative.
    fn steepness(self) -> f64 {
        match self {
            Self::Sigmoid(alpha) => 2.0 * alpha.0,
            Self::Relu | Self::Identity | Self::Rms | Self::Ramp | Self::Accumulator => 1.0,
        }
    }

    /// Whether accumulators are looked up in a table.
    #[must_use]
    pub const fn has_table(self) -> bool {
        !matches!(self, Self::Rms | Self::Accumulator)
    }
}

/// Activation and derivative of a layer, by table index; empty where an activation has no table.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Lut {
    /// `lut_a`: activity code at index `i + 2^(bits-1)`.
    pub activity: Vec<u8>,
    /// `lut_d`: derivative code, peak 255.
    pub derivative: Vec<u8>,
    /// `lsh`: accumulator units of one table step, as a shift.
    pub shift: u32,
}

impl Lut {
    /// Builds the table of `2^bits` entries.
    #[must_use]
    pub fn new(activation: Activation, bits: LutBits, unit: Unit) -> Self {
        match activation {
            Activation::Sigmoid(alpha) => Self::sigmoid(alpha, bits, unit),
            Activation::Relu => Self::linear(bits, unit, |i| i > 0),
            Activation::Identity => Self::linear(bits, unit, |_| true),
            Activation::Ramp => Self::ramp(bits),
            Activation::Rms | Activation::Accumulator => {
                Self { activity: vec![], derivative: vec![], shift: 0 }
            }
        }
    }

    /// `lsh` of the table of `2^bits` entries.
    #[must_use]
    pub fn step_shift(activation: Activation, bits: LutBits, unit: Unit) -> u32 {
        match activation {
            Activation::Sigmoid(alpha) => Self::sigmoid_shift(alpha, bits, unit),
            Activation::Relu | Activation::Identity => Self::linear_shift(bits, unit),
            Activation::Rms | Activation::Ramp | Activation::Accumulator => 0,
        }
    }

    /// `clamp(rsh(85 i, lut_bits - 3), 0, 255)`: 255 at 3 deviations. The step is found, not made: its shift is 0 here.
    fn ramp(bits: LutBits) -> Self {
        let half = 1i64 << (bits.get() - 1);
        let entry = |i: i64| {
            // 2 bits have half an index a deviation
            let scaled = if bits.get() < 3 { 2 * 85 * i } else { rsh(85 * i, bits.get() - 3) };
            narrow::<u8>(scaled.clamp(0, 255), "clamped to a byte")
        };
        let activity: Vec<u8> = (-half..half).map(entry).collect();
        let inside = |&a: &u8| if 0 < a && a < 255 { 255 } else { 0 };
        let derivative = activity.iter().map(inside).collect();
        Self { activity, derivative, shift: 0 }
    }

    fn sigmoid_shift(alpha: Positive, bits: LutBits, unit: Unit) -> u32 {
        let half = 1i32 << (bits.get() - 1);
        let span = f64::from(half) * unit.of_z();
        let mut shift = 0;
        while span * libm::exp2(f64::from(shift)) < 4.0 * alpha.0 {
            shift += 1;
        }
        shift
    }

    fn linear_shift(bits: LutBits, unit: Unit) -> u32 {
        let [above, below] = unit.ratio();
        // least lsh with 2^(bits - 1 + lsh) above >= 4 below
        let mut shift = 0;
        while u128::from(above) << (bits.get() - 1 + shift) < 4 * u128::from(below) {
            shift += 1;
        }
        shift
    }

    fn sigmoid(alpha: Positive, bits: LutBits, unit: Unit) -> Self {
        let half = 1i32 << (bits.get() - 1);
        let shift = Self::sigmoid_shift(alpha, bits, unit);
        let step = unit.of_z() * libm::exp2(f64::from(shift));
        let (activity, derivative) = (-half..half)
            .map(|i| {
                let z = f64::from(i) * step;
                let y = 1.0 / (1.0 + libm::exp(-2.0 * z / alpha.0));
                (code(y), code(4.0 * y * (1.0 - y)))
            })
            .unzip();
        Self { activity, derivative, shift }
    }

    /// `z` in 0..=1, in integers; the derivative is 1 where `slope` says so of an index, else 0.
    fn linear(bits: LutBits, unit: Unit, slope: impl Fn(i64) -> bool) -> Self {
        let half = 1i64 << (bits.get() - 1);
        let [above, below] = unit.ratio().map(i128::from);
        let shift = Self::linear_shift(bits, unit);
        // z = i 2^lsh above / below, so 255 z + 1/2 = (2 255 i 2^lsh above + below) / (2 below)
        let factor = (255 * above) << shift;
        let activity = (-half..half).map(|i| {
            let rounded = (2 * factor * i128::from(i) + below).div_euclid(2 * below);
            narrow::<u8>(rounded.clamp(0, 255), "clamped to a byte")
        });
        let derivative = (-half..half).map(|i| if slope(i) { 255 } else { 0 });
        Self { activity: activity.collect(), derivative: derivative.collect(), shift }
    }
}

/// `floor(255 x + 1/2)`, clamped to a byte.
fn code(x: f64) -> u8 {
    let rounded = libm::floor(255.0 * x + 0.5).clamp(0.0, 255.0);
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "0..=255, whole")]
    {
        rounded as u8
    }
}
/// Greatest shift of a table's step: an index is made of a 32-bit sum.
pub const STEP_SHIFT_MAX: u32 = 30;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::num::fixed::{DriveBits, LevelBits};

    fn unit(weight_max_log2: i32, level_bits: i64, drive_bits: i64) -> Unit {
        Unit {
            weight_max_log2,
            level_bits: LevelBits::new(level_bits).unwrap(),
            drive_bits: DriveBits::new(drive_bits).unwrap(),
            full_drive: FullDrive::One,
        }
    }

    fn sigmoid(alpha: f64) -> Activation {
        Activation::Sigmoid(Positive::new(alpha).unwrap())
    }

    #[test]
    fn a_sigmoid_table_is_centred_monotone_and_reaches_both_rails() {
        let lut = Lut::new(sigmoid(4.0), LutBits::new(10).unwrap(), unit(2, 8, 8));
        assert_eq!(lut.shift, 9); // 2^9 * 2^9 units of 4 / (256 * 255) just reach 16
        assert_eq!((lut.activity[512], lut.derivative[512]), (128, 255));
        assert_eq!((lut.activity[0], lut.activity[1023]), (0, 255));
        assert!(lut.activity.is_sorted());
        assert!((1..512).all(|i| lut.derivative[512 - i] == lut.derivative[512 + i]));
    }

    #[test]
    fn a_sigmoid_table_is_the_exact_function_rounded() {
        // entry i lies at z = i 2^9 4 / (256 255); 255 / (1 + exp(-z / 2)) and its slope, by hand
        let lut = Lut::new(sigmoid(4.0), LutBits::new(10).unwrap(), unit(2, 8, 8));
        let of = |table: &[u8]| [-300, -100, 1, 100, 200].map(|i: i32| table[(512 + i) as usize]);
        assert_eq!(of(&lut.activity), [2, 44, 128, 211, 244]);
        assert_eq!(of(&lut.derivative), [9, 146, 255, 146, 41]);
    }

    #[test]
    fn products_stay_in_range_or_are_refused() {
        let number = |value| Positive::new(value).unwrap();
        assert_eq!(number(3.0).times(number(5.0)).map(Positive::get), Some(15.0));
        assert_eq!(number(1e4).times(number(1e3)), None);
    }

    #[test]
    fn exact_halves_of_a_linear_table_go_up() {
        // floats once put them just below: entry 5 at z = 5/6, where 255 z is 212 1/2; entry 33 at 16 1/2
        for (bits, drive_bits, entry, code) in [(6, 2, 5, 213), (12, 8, 33, 17)] {
            for activation in [Activation::Relu, Activation::Identity] {
                let lut_bits = LutBits::new(bits).unwrap();
                let lut = Lut::new(activation, lut_bits, unit(0, 8, drive_bits));
                assert_eq!((lut.shift, lut.activity[(1 << (bits - 1)) + entry]), (7, code));
            }
        }
    }

    #[test]
    fn a_linear_table_is_the_rational_function_rounded_and_just_reaches_its_end() {
        for (weight_max_log2, level_bits, drive_bits, bits) in
            [(8, 1, 1, 2), (-8, 12, 8, 14), (4, 4, 3, 9), (8, 1, 8, 14), (0, 5, 5, 5)]
        {
            let lut_bits = LutBits::new(bits).unwrap();
            let lut =
                Lut::new(Activation::Relu, lut_bits, unit(weight_max_log2, level_bits, drive_bits));
            let scaled = |v: i128| v << 40;
            // one accumulator unit is `top / (bottom 2^40)` of z
            let top = scaled(1) >> level_bits << (weight_max_log2 + 8) >> 8;
            let bottom = (1i128 << drive_bits) - 1;
            let half = 1i128 << (bits - 1);
            let reaches = |shift: u32| (half << shift) * top >= 4 * scaled(bottom);
            assert!(reaches(lut.shift) && (lut.shift == 0 || !reaches(lut.shift - 1)));
            for (i, &code) in (-half..half).zip(&lut.activity) {
                // code <= 255 z + 1/2 < code + 1, unless an end is nearer
                let twice = 2 * 255 * (i << lut.shift) * top + scaled(bottom);
                let code = i128::from(code);
                assert!(code == 0 || 2 * code * scaled(bottom) <= twice, "{i}");
                assert!(code == 255 || twice < 2 * (code + 1) * scaled(bottom), "{i}");
            }
        }
    }

    #[test]
    fn relu_and_identity_end_at_full_code() {
        let bits = LutBits::new(10).unwrap();
        let relu = Lut::new(Activation::Relu, bits, unit(0, 8, 8));
        assert_eq!((relu.activity[512], relu.derivative[512]), (0, 0));
        assert_eq!((relu.derivative[513], relu.activity[1023]), (255, 255));
        let identity = Lut::new(Activation::Identity, bits, unit(0, 8, 8));
        assert!(identity.derivative.iter().all(|&d| d == 255) && identity.activity[0] == 0);
    }

    #[test]
    fn numbers_outside_the_range_are_refused() {
        for bad in [0.0, -1.0, 1e7, f64::NAN, f64::INFINITY] {
            assert_eq!(Positive::new(bad), None);
        }
    }
}
