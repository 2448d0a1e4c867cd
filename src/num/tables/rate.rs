//! Rates: from what a user asks to shifts over the updates of a training.
//!
//! ```text
//! sums      k* = -log2( rate / (B P m) * 2^error_bits / ( (2^drive_bits - 1) (2^(error_bits-1) - 1) 255 * 2 alpha ) * L )
//! pulses    k* = -log2( rate )                                             L = 2^level_bits / weight_max
//! requests  k* = 12 - log2( rate L / m )
//! k(t)      = min( nearest( k* - log2 f(t) ), 30 );   f = 1,  (1 + cos(pi t / T)) / 2  or  1 - t / T
//!           of a device, L = states 2^level_bits / ((ceiling - floor) weight_max): pulses, not levels
//! levels    2^14 - c(t),  c = floor( 256 (log2(cells) / 2 + log2 rho) + 1/2 ),  rho = rate f(t) L / sqrt(fan_in)
//! ```
//!
//! See docs/MODEL.md, 3.5 and 3.10.
#![expect(clippy::float_arithmetic, reason = "floats become integers here, at load only")]
#![deny(clippy::disallowed_types, clippy::disallowed_methods)]

use super::{Activation, Positive, Unit};
use crate::num::fixed::{Batch, ErrorBits, OutOfRange, RateMantissa};

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
    /// The root mean square of the steps of the weights of a layer, times `sqrt(fan_in)`. What stands in the place of `k` is
    /// `2^14 - c`, `c = floor( 256 (log2(cells)/2 + log2(rho)) + 1/2 )`, where `rho` is that step in levels.
    Levels {
        /// Inputs of a pathway.
        fan_in: usize,
        /// Cells that the mean is taken over.
        cells: usize,
    },
    /// The step of a weight for a request of `2^12`.
    Requests,
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
    /// Positions of a sample, over which sums run as over samples: 1 of a dense layer.
    pub positions: usize,
    /// Small factor beside the shift.
    pub mantissa: RateMantissa,
    /// Bits of an error word.
    pub error_bits: ErrorBits,
    /// The layer's activation.
    pub activation: Activation,
    /// The layer's accumulator unit.
    pub unit: Unit,
    /// Pulses across the window and the levels of it, of cells that a pulse does not move by a level.
    pub window: Option<[u32; 2]>,
}

/// Greatest shift of a rate.
pub const SHIFT_MAX: u32 = 30;
/// What stands in its place where a rate is of levels.
pub const LEVELS_SHIFT_MAX: u32 = 1 << 15;

impl Rate {
    /// Pulses in a weight of 1: levels of ideal cells.
    fn pulses(self) -> f64 {
        let [pulses, levels] = self.window.unwrap_or([1, 1]).map(f64::from);
        // the factor is 1 and exact where a pulse is a level
        pulses / levels * libm::exp2(f64::from(self.unit.level_bits.get()))
            / libm::exp2(f64::from(self.unit.weight_max_log2))
    }

    /// Reads that a sum runs over.
    fn reads(self) -> f64 {
        #[expect(clippy::cast_precision_loss, reason = "positions of an image, below 2^30")]
        let positions = self.positions as f64;
        f64::from(self.batch.get()) * positions
    }

    fn shift_exact(self) -> f64 {
        match self.of {
            RateOf::Sums => {}
            RateOf::Pulses => return -libm::log2(self.rate.0),
            RateOf::Levels { fan_in, cells } => {
                #[expect(clippy::cast_precision_loss, reason = "sizes of arrays, below 2^40")]
                let [fan_in, cells] = [fan_in, cells].map(|count| libm::log2(count as f64));
                let rho = libm::log2(self.rate.0 * self.pulses()) - 0.5 * fan_in;
                return 64.0 - (0.5 * cells + rho);
            }
            RateOf::Requests => {
                let mantissa = f64::from(self.mantissa.get());
                return 12.0 - libm::log2(self.rate.0 / mantissa * self.pulses());
            }
        }
        let rail = f64::from((1u32 << (self.error_bits.get() - 1)) - 1);
        let codes = self.unit.codes_of_one();
        let scale = libm::exp2(f64::from(self.error_bits.get()))
            / (codes * rail * 255.0 * self.activation.steepness());
        let samples = self.reads() * f64::from(self.mantissa.get());
        -libm::log2(self.rate.0 / samples * scale * self.pulses())
    }

    /// `k` before any decay: the integer nearest to the exact shift.
    ///
    /// # Errors
    /// When it lies outside `0..=SHIFT_MAX`: no shift stands for such a rate.
    pub fn shift(self) -> Result<u32, OutOfRange> {
        if matches!(self.of, RateOf::Levels { .. }) {
            return Ok(self.shift_at(Decay::Constant, 0, 1));
        }
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
        match self.of {
            RateOf::Sums => {}
            RateOf::Pulses => return Ok(Positive(libm::exp2(-f64::from(k)))),
            // to a 256th of a doubling; the mantissas of the moment come within 6 % of it
            RateOf::Levels { .. } => return Ok(self.rate),
            RateOf::Requests => {
                let mantissa = f64::from(self.mantissa.get());
                return Ok(Positive(libm::exp2(12.0 - f64::from(k)) * mantissa / self.pulses()));
            }
        }
        let rail = f64::from((1u32 << (self.error_bits.get() - 1)) - 1);
        let codes = self.unit.codes_of_one();
        let samples = self.reads() * f64::from(self.mantissa.get());
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
        let exact = self.shift_exact() - libm::log2(factor);
        let (nearest, end) = match self.of {
            // 2^14 - floor(x + 1/2) of 2^14 less the exact one
            RateOf::Levels { .. } => (libm::ceil(256.0 * exact - 0.5), LEVELS_SHIFT_MAX),
            _ => (libm::floor(exact + 0.5), SHIFT_MAX),
        };
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "0..=end")]
        {
            nearest.clamp(0.0, f64::from(end)) as u32
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::num::fixed::{DriveBits, LevelBits};
    use crate::num::tables::FullDrive;

    fn rate(rate: f64, alpha: f64) -> Rate {
        Rate {
            positions: 1,
            rate: Positive::new(rate).unwrap(),
            of: RateOf::Sums,
            batch: Batch::new(32).unwrap(),
            mantissa: RateMantissa::new(1).unwrap(),
            error_bits: ErrorBits::new(8).unwrap(),
            activation: Activation::Sigmoid(Positive::new(alpha).unwrap()),
            unit: Unit {
                weight_max_log2: 2,
                level_bits: LevelBits::new(8).unwrap(),
                drive_bits: DriveBits::new(8).unwrap(),
                full_drive: FullDrive::One,
            },
            window: None,
        }
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
    fn a_line_falls_by_half_in_half_the_time_and_ends_at_the_last_shift() {
        let quarter = Rate { of: RateOf::Pulses, ..rate(0.25, 6.0) };
        // 2 - log2(1 - t / 1024) passes 2.5 at 1 - 2^-0.5, and so on; 2^-10 is left at the last update
        let table = quarter.shifts(Decay::Linear, 1024).unwrap();
        let first = [(0, 2), (300, 3), (662, 4), (843, 5), (934, 6)];
        assert_eq!((&table[..5], table.last()), (&first[..], Some(&(1023, 12))));
        let long = quarter.shifts(Decay::Linear, u64::MAX).unwrap();
        assert_eq!(long.last().unwrap().1, SHIFT_MAX, "later none: that is the table's law");
    }

    #[test]
    fn a_chance_is_its_own_rate() {
        let chance = |rate_of: f64| Rate { of: RateOf::Pulses, ..rate(rate_of, 6.0) };
        assert_eq!(
            [1.0, 0.5, 0.36, 0.35, 1e-5].map(|r| chance(r).shift().unwrap()),
            [0, 1, 1, 2, 17]
        );
        assert_eq!(chance(0.35).effective().unwrap().get(), 0.25);
        assert_eq!(chance(1.5).shift().map_err(|error| error.found), Err(-1));
    }

    #[test]
    fn a_rate_of_levels_is_in_256ths_and_falls_by_its_decay() {
        // 0.5 in a weight is 32 levels; of 16 inputs 8; 2^10 cells are 5 doublings of a root
        let levels = Rate { of: RateOf::Levels { fan_in: 16, cells: 1 << 10 }, ..rate(0.5, 6.0) };
        assert_eq!(levels.shift().unwrap(), (1 << 14) - 256 * (5 + 3));
        let table = levels.shifts(Decay::Linear, 1000).unwrap();
        let at = |update| table[table.partition_point(|&(first, _)| first <= update) - 1].1;
        assert_eq!([at(500), at(750)], [256, 512].map(|more| levels.shift().unwrap() + more));
        // between: 256 log2(1000 / 900) is 38.9
        assert_eq!(at(100), levels.shift().unwrap() + 39);
        let far = levels.shifts(Decay::Linear, u64::MAX).unwrap();
        assert!(far.is_sorted() && far.last().unwrap().1 <= LEVELS_SHIFT_MAX);
    }

    #[test]
    fn a_rate_of_requests_is_the_step_of_a_request_of_one() {
        // 2^-8 in a weight is a quarter of a level
        let step = Rate { of: RateOf::Requests, ..rate(1.0 / 256.0, 6.0) };
        assert_eq!(step.shift().unwrap(), 14);
        assert_eq!(step.effective().unwrap().get(), 1.0 / 256.0);
        let three = Rate { mantissa: RateMantissa::new(3).unwrap(), ..step };
        assert_eq!((three.shift().unwrap(), three.effective().unwrap().get()), (16, 3.0 / 1024.0));
    }
}
