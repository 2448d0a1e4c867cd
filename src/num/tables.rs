//! Tables: floats in, integers out, at load only. The one room of the core where floats are allowed.
//!
//! ```text
//! lut_a[i] = floor(255 f + 1/2), lut_d[i] = floor(255 f' / peak + 1/2), both at z = i * 2^lsh units, clamped to 0..=255
//! unit     = weight_max / ( 2^level_bits * (2^drive_bits - 1) )                        of z
//! lsh      = least shift >= 0 with 2^(lut_bits - 1 + lsh) units >= 4 alpha (sigmoid), 4 (ReLU, identity)
//! exact    : units are rational, so tables of ReLU and identity, and their lsh, are computed in integers:
//!            lut_a[i] = floor( (2 * 255 * i * 2^p + D) / (2 D) ),  p = lsh + log2(weight_max) - level_bits,  D = 2^drive_bits - 1
//! k        = integer nearest to -log2( rate / (B m) * 2^error_bits
//!            / ( (2^drive_bits - 1) (2^(error_bits-1) - 1) 255 * 2 alpha ) * 2^level_bits / weight_max ),  0..=30
//! ```
//!
//! Elsewhere only `+ - * /` and the functions of the `libm` crate (pure Rust, pinned) are used, so the integers are the
//! same on every machine. See docs/MODEL.md, 2 and 3.
#![expect(clippy::float_arithmetic, reason = "floats become integers here and nowhere else")]
#![deny(clippy::disallowed_types, clippy::disallowed_methods)]

mod gaussian;
mod policy;
#[cfg(test)]
pub(crate) mod precise;
mod unit;

pub use gaussian::half_gaussian;
pub use policy::PolicyTables;
pub use unit::{FullDrive, Unit};

use super::fixed::{Batch, ErrorBits, LutBits, OutOfRange, RateMantissa, narrow};

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
    /// The accumulator itself, derivative 1 everywhere. No table: what is read out is `acc_p - acc_n`, or `acc_p` alone. For a
    /// last layer.
    Accumulator,
}

impl Activation {
    /// `1 / peak` of the derivative.
    fn steepness(self) -> f64 {
        match self {
            Self::Sigmoid(alpha) => 2.0 * alpha.0,
            Self::Relu | Self::Identity | Self::Rms | Self::Accumulator => 1.0,
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
            Activation::Rms | Activation::Accumulator => 0,
        }
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

/// How the rate falls over a training.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Decay {
    /// Not at all.
    Constant,
    /// Half a cosine, from 1 to 0.
    Cosine,
    /// A straight line, from 1 to 0.
    Linear,
}

/// What a rate is a measure of.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum RateOf {
    /// The step of a weight for a sum: what all other parts of a [`Rate`] scale.
    Sums,
    /// The chance of a pulse itself: `k` is the integer nearest to `-log2(rate)`.
    Pulses,
}

/// What a layer's rate is made of.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rate {
    /// Rate of the layer, its multiplier included.
    pub rate: Positive,
    /// What it is a measure of.
    pub of: RateOf,
    /// Configured batch.
    pub batch: Batch,
    /// Small factor beside the shift.
    pub mantissa: RateMantissa,
    /// Bits of an error word.
    pub error_bits: ErrorBits,
    /// The layer's activation.
    pub activation: Activation,
    /// The layer's accumulator unit.
    pub unit: Unit,
}

/// Greatest shift of a table's step: an index is made of a 32-bit sum.
pub const STEP_SHIFT_MAX: u32 = 30;

/// Greatest shift of a rate.
pub const SHIFT_MAX: u32 = 30;

impl Rate {
    fn shift_exact(self) -> f64 {
        if self.of == RateOf::Pulses {
            return -libm::log2(self.rate.0);
        }
        let rail = f64::from((1u32 << (self.error_bits.get() - 1)) - 1);
        let codes = self.unit.codes_of_one();
        let scale = libm::exp2(f64::from(self.error_bits.get()))
            / (codes * rail * 255.0 * self.activation.steepness());
        let levels = libm::exp2(f64::from(self.unit.level_bits.get()))
            / libm::exp2(f64::from(self.unit.weight_max_log2));
        let samples = f64::from(self.batch.get()) * f64::from(self.mantissa.get());
        -libm::log2(self.rate.0 / samples * scale * levels)
    }

    /// `k` before any decay: the integer nearest to the exact shift.
    ///
    /// # Errors
    /// When it lies outside `0..=SHIFT_MAX`: no shift stands for such a rate.
    pub fn shift(self) -> Result<u32, OutOfRange> {
        let nearest = libm::floor(self.shift_exact() + 0.5);
        #[expect(clippy::cast_possible_truncation, reason = "a logarithm: some hundreds at most")]
        let found = nearest as i64;
        let k = u32::try_from(found).ok().filter(|&k| k <= SHIFT_MAX);
        k.ok_or(OutOfRange { name: "k", found, min: 0, max: SHIFT_MAX.into() })
    }

    /// This rate with the mantissa whose effective rate comes nearest to it, by ratio: the least one on ties. Its own
    /// where no shift stands for the rate with any.
    #[must_use]
    pub fn with_nearest_mantissa(self) -> Self {
        let all = (RateMantissa::MIN..=RateMantissa::MAX)
            .map(|m| Self { mantissa: RateMantissa::new(m.into()).expect("in range"), ..self });
        let off = |rate: &Self| {
            let off = (rate.shift_exact() - f64::from(rate.shift().ok()?)).abs();
            // one in a million is nothing: 2 and 4 stand for the same rates as 1
            #[expect(clippy::cast_possible_truncation, reason = "at most half a million")]
            let millionths = libm::floor(off * 1e6 + 0.5) as i64;
            Some(millionths)
        };
        let found = all.filter_map(|rate| Some((off(&rate)?, rate)));
        found.min_by_key(|(off, _)| *off).map_or(self, |(_, rate)| rate)
    }

    /// The rate that `k` and the mantissa really give: within a factor of `sqrt(2)` of the one asked for.
    ///
    /// # Errors
    /// As of [`Rate::shift`].
    pub fn effective(self) -> Result<Positive, OutOfRange> {
        let k = self.shift()?;
        if self.of == RateOf::Pulses {
            return Ok(Positive(libm::exp2(-f64::from(k))));
        }
        let rail = f64::from((1u32 << (self.error_bits.get() - 1)) - 1);
        let codes = self.unit.codes_of_one();
        let samples = f64::from(self.batch.get()) * f64::from(self.mantissa.get());
        let log2 = self.unit.weight_max_log2;
        let bits = self.unit.level_bits.get() + self.error_bits.get() + k;
        let scale = libm::exp2(f64::from(log2) - f64::from(bits));
        // whole numbers but for alpha: scaled by a power of two last
        Ok(Positive(samples * codes * rail * 255.0 * self.activation.steepness() * scale))
    }

    /// The shifts over `updates` updates: `(first update, k)`, in order; k changes at each entry.
    ///
    /// The decay is applied before rounding, `k(t) = nearest(k* - log2(decay(t)))`, and the table ends at
    /// `SHIFT_MAX`: a rate that has fallen further stays there.
    ///
    /// # Errors
    /// When the shift before any decay lies outside `0..=SHIFT_MAX`.
    pub fn shifts(self, decay: Decay, updates: u64) -> Result<Vec<(u64, u32)>, OutOfRange> {
        self.shift()?;
        let mut table = vec![(0, self.shift_at(decay, 0, updates))];
        if decay == Decay::Constant {
            return Ok(table);
        }
        // k only rises, so where it does is found by halving: a training may be as long as it likes
        let last = updates.max(1) - 1;
        let (mut now, mut k) = table[0];
        while self.shift_at(decay, last, updates) > k {
            let mut next = last;
            while next - now > 1 {
                let middle = now + (next - now) / 2;
                if self.shift_at(decay, middle, updates) > k {
                    next = middle;
                } else {
                    now = middle;
                }
            }
            (now, k) = (next, self.shift_at(decay, next, updates));
            table.push((now, k));
        }
        Ok(table)
    }

    /// `k` at one update of so many.
    fn shift_at(self, decay: Decay, update: u64, updates: u64) -> u32 {
        #[expect(clippy::cast_precision_loss, reason = "a share of the way")]
        let t = update as f64 / updates.max(1) as f64;
        let factor = match decay {
            Decay::Constant => 1.0,
            Decay::Cosine => 0.5 * (1.0 + libm::cos(std::f64::consts::PI * t)),
            Decay::Linear => 1.0 - t,
        };
        let nearest = libm::floor(self.shift_exact() - libm::log2(factor) + 0.5);
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "0..=30")]
        {
            nearest.min(f64::from(SHIFT_MAX)) as u32
        }
    }
}

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

    fn rate(rate: f64, alpha: f64) -> Rate {
        Rate {
            rate: Positive::new(rate).unwrap(),
            of: RateOf::Sums,
            batch: Batch::new(32).unwrap(),
            mantissa: RateMantissa::new(1).unwrap(),
            error_bits: ErrorBits::new(8).unwrap(),
            activation: sigmoid(alpha),
            unit: unit(2, 8, 8),
        }
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
    fn a_mantissa_and_a_batch_divide_the_rate() {
        // 13.24 of the known recipe, + log2(3), + log2(4)
        let three = Rate { mantissa: RateMantissa::new(3).unwrap(), ..rate(20.0, 6.0) };
        assert_eq!(three.shifts(Decay::Constant, 1).unwrap(), [(0, 15)]);
        let large = Rate { batch: Batch::new(128).unwrap(), ..rate(20.0, 6.0) };
        assert_eq!(large.shifts(Decay::Constant, 1).unwrap(), [(0, 15)]);
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
    fn the_known_recipe_has_the_known_shift() {
        // rate 20, B = 32, alpha = 6, weight_max = 4, 8 bits: k = 13 with 8-bit gates
        assert_eq!(rate(20.0, 6.0).shifts(Decay::Constant, 1000).unwrap(), [(0, 13)]);
        // 13.2404 is rounded to 13, so the rate is 20 x 2^0.2404
        let effective = rate(20.0, 6.0).effective().unwrap().get();
        assert_eq!(effective, 255.0 * 127.0 * 255.0 * 12.0 * 32.0 * 4.0 / 65536.0 / 8192.0);
        assert!((23.62..23.63).contains(&effective), "{effective}");
    }

    /// Rates 14 to 22 once were one rate, and nobody said so.
    #[test]
    fn the_nearest_mantissa_comes_within_seven_percent() {
        let mut shifts = vec![];
        for asked in 14..=22 {
            let asked = rate(f64::from(asked), 6.0);
            let near = asked.with_nearest_mantissa();
            let ratio = near.effective().unwrap().get() / asked.rate.get();
            assert!((0.94..1.07).contains(&ratio), "{asked:?}: {ratio}");
            shifts.push((near.mantissa.get(), near.shift().unwrap()));
        }
        shifts.dedup();
        assert!(shifts.len() >= 5, "{shifts:?}");
        // 20 is 13.2404 with 1: 2^0.2404 too much; with 7 it is 16.0478
        assert_eq!((shifts.contains(&(1, 13)), shifts.contains(&(7, 16))), (false, true));
        // an exact power of two keeps the least mantissa
        let exact = Rate { rate: rate(20.0, 6.0).effective().unwrap(), ..rate(20.0, 6.0) };
        assert_eq!(exact.with_nearest_mantissa().mantissa.get(), 1);
        // where 1 would need a shift below 0, more than 1 does not
        let great = Rate { rate: Positive::new(20.0 * 32768.0).unwrap(), ..rate(20.0, 6.0) };
        let near = great.with_nearest_mantissa();
        assert_eq!((great.shift().is_err(), near.shift().is_ok()), (true, true));
    }

    #[test]
    fn shifts_outside_0_to_30_are_refused_with_what_they_would_be() {
        // a factor of 2^k moves the shift by k; 20 at 13.2404
        let k = |times: f64| rate(20.0 * times, 6.0).shift().map_err(|error| error.found);
        assert_eq!([k(8192.0), k(8192.0 * 1.8)], [Ok(0), Err(-1)]);
        assert_eq!([k(1.0 / 131_072.0), k(0.8 / 131_072.0)], [Ok(30), Err(31)]);
        assert!(rate(1e-6, 6.0).shifts(Decay::Constant, 1).is_err());
    }

    #[test]
    fn a_cosine_starts_at_the_constant_shift_and_only_rises() {
        let table = rate(20.0, 6.0).shifts(Decay::Cosine, 1000).unwrap();
        // 13.2404 - log2( (1 + cos(pi t / 1000)) / 2 ) passes 13.5, 14.5 and 15.5 there
        assert_eq!(table[..4], [(0, 13), (267, 14), (553, 15), (698, 16)]);
        assert!(table.is_sorted() && table.last().unwrap().1 <= SHIFT_MAX);
    }

    #[test]
    fn a_schedule_of_any_length_is_made_at_once_and_is_the_one_counted_update_by_update() {
        for (start, alpha) in [(20.0, 6.0), (3.7, 4.0), (900.0, 1.0), (0.04, 9.0)] {
            let rate = rate(start, alpha);
            for updates in [1, 2, 3, 7, 100, 1_199, 20_000] {
                let mut wanted: Vec<(u64, u32)> = vec![];
                for update in 0..updates {
                    let k = rate.shift_at(Decay::Cosine, update, updates);
                    if wanted.last().is_none_or(|&(_, last)| last != k) {
                        wanted.push((update, k));
                    }
                }
                assert_eq!(rate.shifts(Decay::Cosine, updates).unwrap(), wanted, "{updates}");
            }
            // it once took an hour and a signal did not end it
            for updates in [0, u64::from(u32::MAX) * 120, u64::MAX] {
                let table = rate.shifts(Decay::Cosine, updates).unwrap();
                assert!(table.is_sorted() && (1..=31).contains(&table.len()), "{updates}");
            }
        }
    }

    #[test]
    fn numbers_outside_the_range_are_refused() {
        for bad in [0.0, -1.0, 1e7, f64::NAN, f64::INFINITY] {
            assert_eq!(Positive::new(bad), None);
        }
    }
}
