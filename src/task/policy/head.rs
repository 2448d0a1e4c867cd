//! Heads of an actor: what its outputs say of actions, and what they should have said more.
//!
//! Discrete actions, logits `x`:
//!
//! ```text
//! pi_j     = exp(x_j - max) / sum exp(x_i - max)            down to 2^-31; what is missing goes to the first greatest: the sum is 1.
//!                                                           error < 2^-30 + pi_j 2^-21; of the greatest, 2^-30 an action
//! ln pi_j  = (x_j - max) - ln sum                           error < 2^-20
//! H        = - sum pi_j ln pi_j                             error < 2^-20 (1 + H)
//! e_j      = push (1[j = a] - pi_j) - beta pi_j (ln pi_j + H)        clamped to +-4
//! ```
//!
//! Continuous actions, means `mu`, deviations `s` that depend on no state; `u` is what was tried, the environment is told `tanh u`:
//!
//! ```text
//! z        = clamp((u - mu) / s, -16, 16)                   error < 2^-27 + |z| 2^-21
//! ln p     = sum -z^2 / 2 - ln s                            without its constant, which no ratio has; nor has one that of tanh
//! H        = sum ln s + ln(2 pi e) / 2                      of the Gaussian, before tanh
//! e_mu     = push z / s,     e_ln s = push (z^2 - 1) + beta        z clamped to +-4, errors to +-4
//! ```
//!
//! `push` is that of [`Clip`](super::ratio::Clip). Errors are multiples of 2^-20: e_j is off by less than `2^-19 + |push| 2^-21`,
//! e_mu by `2^-20 + |push| / s (|z| 2^-20 + 2^-27)`, e_ln s by `2^-20 + |push| 2^-15`. They point uphill: outputs should follow them. See docs/MODEL.md, 5.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use super::function;
use super::number::{
    Advantage, Deviation, Entropy, LogDeviation, LogProbability, Logit, Normal, OutputError,
    Precision, Probability, bounded, saturated,
};
use crate::num::fixed::rsh;
use crate::num::tables::PolicyTables;

/// `ln(2 pi e) / 2` in 2^-20.
const GAUSSIAN_ENTROPY: i64 = 1_487_865;
/// The greatest distance from the mean that errors know, in 2^-27.
const Z_BOUND: i64 = 4 << 27;

/// Probabilities of actions and their logarithms from logits, one each; gives the entropy.
///
/// # Panics
/// When there is no action, or the slices differ in length.
pub fn softmax(
    tables: &PolicyTables,
    logits: &[Logit],
    probabilities: &mut [Probability],
    logs: &mut [LogProbability],
) -> Entropy {
    assert!(logits.len() == probabilities.len() && logits.len() == logs.len(), "one an action");
    let max = *logits.iter().max().expect("there is an action");
    let mut sum = 0;
    for ((logit, p), log) in logits.iter().zip(&mut *probabilities).zip(&mut *logs) {
        let below = (i64::from(logit.to_bits()) - i64::from(max.to_bits())) << 6;
        let e = function::exp(tables, below, 31) as u32;
        *log = LogProbability::from_bits(below);
        *p = Probability::from_bits(e);
        sum += u64::from(e);
    }
    let log_sum = LogProbability::from_bits(function::ln(tables, sum, 31));
    let mut rest = Probability::ONE;
    for (p, log) in probabilities.iter_mut().zip(&mut *logs) {
        *p = Probability::from_bits(((u64::from(p.to_bits()) << 31) / sum) as u32);
        rest -= *p;
        *log -= log_sum;
    }
    let greatest = logits.iter().position(|&logit| logit == max).expect("one is the greatest");
    probabilities[greatest] += rest;
    let pairs = probabilities.iter().zip(&*logs);
    let entropy = pairs.map(|(p, log)| -i64::from(p.to_bits()) * log.to_bits()).sum();
    saturated(rsh::<i64>(entropy, 37))
}

/// The errors of logits, one each, where `action` was taken; `beta` is what entropy is worth.
#[inline]
pub fn discrete_errors(
    softmax: &Softmax<'_>,
    action: usize,
    push: Advantage,
    beta: Probability,
    errors: &mut [OutputError],
) {
    let Softmax { probabilities, logs, entropy } = *softmax;
    assert!(probabilities.len() == logs.len() && logs.len() == errors.len(), "one an action");
    let push = i64::from(push.to_bits());
    let entropy = i64::from(entropy.to_bits()) << 6;
    for (j, ((p, log), error)) in probabilities.iter().zip(logs).zip(errors).enumerate() {
        let p = i64::from(p.to_bits());
        let taken = i64::from(j == action) << 31;
        let part = rsh(i64::from(beta.to_bits()) * p, 31);
        let spread = part * (log.to_bits() + entropy);
        *error = bounded(rsh(push * (taken - p) - rsh(spread, 6), 31));
    }
}

/// What [`softmax`] gave.
#[derive(Debug, Clone, Copy)]
pub struct Softmax<'a> {
    /// Of each action.
    pub probabilities: &'a [Probability],
    /// Their logarithms.
    pub logs: &'a [LogProbability],
    /// Of all.
    pub entropy: Entropy,
}

/// How far one number of an action is tried around its mean.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Scatter {
    log: LogDeviation,
    deviation: Deviation,
    precision: Precision,
}

impl Scatter {
    /// That of a logarithm of a deviation, clamped to -4 ..= 1.
    #[must_use]
    pub fn new(tables: &PolicyTables, log: LogDeviation) -> Self {
        let log = log.clamp(LogDeviation::from_bits(-4 << 20), LogDeviation::ONE);
        let exponent = i64::from(log.to_bits()) << 6;
        Self {
            log,
            deviation: Deviation::from_bits(function::exp(tables, exponent, 30) as u32),
            precision: Precision::from_bits(function::exp(tables, -exponent, 26) as u32),
        }
    }

    /// The logarithm of the deviation.
    #[must_use]
    pub const fn log(&self) -> LogDeviation {
        self.log
    }

    /// The deviation.
    #[must_use]
    pub const fn deviation(&self) -> Deviation {
        self.deviation
    }

    /// What this number adds to the entropy.
    #[must_use]
    pub fn entropy(&self) -> Entropy {
        saturated(i64::from(self.log.to_bits()) + GAUSSIAN_ENTROPY)
    }

    /// How many deviations `tried` lies above its mean.
    #[inline]
    #[must_use]
    pub fn distance(&self, tried: Logit, mean: Logit) -> Normal {
        let apart = i64::from(tried.to_bits()) - i64::from(mean.to_bits());
        // 64 is more than 16 of the greatest deviation
        let apart = apart.clamp(-64 << 20, 64 << 20);
        let z = rsh(apart * i64::from(self.precision.to_bits()), 19);
        let most = i64::from(i32::MAX);
        Normal::from_bits(z.clamp(-most, most) as i32)
    }

    /// What this number adds to the logarithm of the density, its constant left out.
    #[inline]
    #[must_use]
    pub fn log_density(&self, tried: Logit, mean: Logit) -> LogProbability {
        let z = i64::from(self.distance(tried, mean).to_bits());
        LogProbability::from_bits(-rsh(z * z, 29) - (i64::from(self.log.to_bits()) << 6))
    }

    /// The errors of the mean and of the logarithm of the deviation, where `tried` was done; `beta` is what entropy is
    /// worth.
    #[inline]
    #[must_use]
    pub fn errors(
        &self,
        tried: Logit,
        mean: Logit,
        push: Advantage,
        beta: Probability,
    ) -> [OutputError; 2] {
        let push = i64::from(push.to_bits());
        let z = i64::from(self.distance(tried, mean).to_bits()).clamp(-Z_BOUND, Z_BOUND);
        let pull = i128::from(push * z) * i128::from(self.precision.to_bits());
        let widen = i128::from(push) * i128::from(z * z - (1 << 54));
        let widen = widen + (i128::from(beta.to_bits()) << 43);
        [rsh(pull, 53), rsh(widen, 54)].map(|error| bounded(error as i64))
    }
}

#[cfg(test)]
mod tests {
    use std::sync::LazyLock;

    use proptest::prelude::*;

    use super::*;
    use crate::num::tables::precise::{self, BITS, ONE, div, mul};

    static TABLES: LazyLock<PolicyTables> = LazyLock::new(PolicyTables::build);

    /// A number with `bits` bits behind the point, as the reference has it.
    fn wide(x: i64, bits: u32) -> i128 {
        i128::from(x) << (BITS - bits)
    }

    fn logits(bits: &[i32]) -> Vec<Logit> {
        bits.iter().map(|&bits| Logit::from_bits(bits)).collect()
    }

    /// Probabilities, their logarithms, entropy.
    fn softmax_of(logits: &[Logit]) -> (Vec<Probability>, Vec<LogProbability>, Entropy) {
        let mut probabilities = vec![Probability::ZERO; logits.len()];
        let mut logs = vec![LogProbability::ZERO; logits.len()];
        let entropy = softmax(&TABLES, logits, &mut probabilities, &mut logs);
        (probabilities, logs, entropy)
    }

    #[test]
    fn the_first_greatest_takes_what_rounding_leaves() {
        let (p, log, entropy) = softmax_of(&logits(&[-9, 5, 5, -9 << 20, 5]));
        let bits: Vec<u32> = p.iter().map(|p| p.to_bits()).collect();
        assert_eq!(bits.iter().map(|&p| u64::from(p)).sum::<u64>(), 1 << 31);
        assert!(
            bits[1] >= bits[2] && bits[1] - bits[2] < 5 && bits[2] == bits[4] && bits[0] < bits[4]
        );
        assert!(log[1] == log[2] && log[0] < log[1] && log[3] < -10 && entropy > 1);
        let (p, log, entropy) = softmax_of(&logits(&[i32::MIN]));
        assert_eq!(
            (p[0], log[0], entropy),
            (Probability::ONE, LogProbability::ZERO, Entropy::ZERO)
        );
        let (p, log, entropy) = softmax_of(&logits(&[i32::MIN, i32::MAX]));
        assert_eq!(
            (p[0], p[1], log[1], entropy),
            (Probability::ZERO, Probability::ONE, LogProbability::ZERO, Entropy::ZERO)
        );
        assert_eq!(log[0].to_bits(), (1 - (1 << 32)) << 6);
    }

    #[test]
    #[should_panic(expected = "one an action")]
    fn a_softmax_has_one_probability_an_action() {
        softmax(
            &TABLES,
            &[Logit::ZERO; 2],
            &mut [Probability::ZERO; 1],
            &mut [LogProbability::ZERO; 2],
        );
    }

    #[test]
    #[should_panic(expected = "one an action")]
    fn a_softmax_has_one_logarithm_an_action() {
        softmax(
            &TABLES,
            &[Logit::ZERO; 2],
            &mut [Probability::ZERO; 2],
            &mut [LogProbability::ZERO; 1],
        );
    }

    #[test]
    fn errors_are_held_within_four() {
        let (p, log, entropy) = softmax_of(&logits(&[0, 0]));
        let softmax = Softmax { probabilities: &p, logs: &log, entropy };
        let mut errors = [OutputError::ZERO; 2];
        discrete_errors(&softmax, 1, Advantage::from_num(7), Probability::ZERO, &mut errors);
        assert_eq!(errors, [-7, 7].map(|halves| OutputError::from_bits(halves << 19)));
        discrete_errors(&softmax, 0, Advantage::from_num(9), Probability::ONE, &mut errors);
        assert_eq!(errors, [4, -4].map(OutputError::from_num));
        let scatter = Scatter::new(&TABLES, LogDeviation::ZERO);
        let [mean, log] =
            scatter.errors(Logit::from_num(9), Logit::ZERO, Advantage::ONE, Probability::ZERO);
        assert_eq!((mean, log), (OutputError::from_num(4), OutputError::from_num(4)));
        let held = scatter.errors(
            Logit::from_num(-9),
            Logit::ZERO,
            Advantage::from_bits(-1 << 18),
            Probability::ZERO,
        );
        assert_eq!(held, [4, -15].map(|quarters| OutputError::from_bits(quarters << 18)));
    }

    #[test]
    fn a_deviation_ends_where_it_says() {
        let ends =
            [(i32::MIN, -4 << 20), (-4 << 20, -4 << 20), (1 << 20, 1 << 20), (i32::MAX, 1 << 20)];
        for (asked, kept) in ends {
            let scatter = Scatter::new(&TABLES, LogDeviation::from_bits(asked));
            assert_eq!(scatter.log().to_bits(), kept);
            assert_eq!(scatter, Scatter::new(&TABLES, LogDeviation::from_bits(kept)));
        }
        let one = Scatter::new(&TABLES, LogDeviation::ZERO);
        assert_eq!((one.deviation(), one.precision), (Deviation::ONE, Precision::ONE));
        // ln(2 pi e) / 2 = 1.41893853320467
        let exact = (1_418_938_533_205i64 << 20) / 10i64.pow(12);
        assert_eq!(i64::from(one.entropy().to_bits()), exact + 1);
        let wide = Scatter::new(&TABLES, LogDeviation::ONE);
        assert_eq!(wide.entropy(), one.entropy() + Entropy::ONE);
    }

    #[test]
    fn distances_saturate() {
        for log in [-4 << 20, 0, 1 << 20] {
            let scatter = Scatter::new(&TABLES, LogDeviation::from_bits(log));
            assert_eq!(scatter.distance(Logit::MAX, Logit::MIN), Normal::MAX);
            assert_eq!(scatter.distance(Logit::MIN, Logit::MAX), -Normal::MAX);
            assert_eq!(scatter.distance(Logit::from_bits(5), Logit::from_bits(5)), Normal::ZERO);
        }
        let wide = Scatter::new(&TABLES, LogDeviation::ONE);
        assert_eq!(wide.distance(Logit::from_num(44), Logit::ZERO), Normal::MAX);
        assert!(wide.distance(Logit::from_num(43), Logit::ZERO) < Normal::MAX);
    }

    proptest! {
        #[test]
        fn softmax_and_its_errors_are_within_their_bounds(
            bits in prop::collection::vec(any::<i32>(), 1..12), scale in 6u32..20,
            action: prop::sample::Index, push in -128i32 << 20..=128 << 20, small in 0u32..12, beta in 0u32..1 << 31,
        ) {
            let logits = logits(&bits.iter().map(|x| x >> scale).collect::<Vec<_>>());
            let (action, push) = (action.index(logits.len()), push >> small);
            let (p, log, entropy) = softmax_of(&logits);
            let max = logits.iter().max().unwrap();
            let below: Vec<i128> =
                logits.iter().map(|x| wide(i64::from(x.to_bits()) - i64::from(max.to_bits()), 20)).collect();
            let powers: Vec<i128> = below.iter().map(|&x| precise::exp(x.max(-60 * ONE))).collect();
            let sum: i128 = powers.iter().sum();
            let exact: Vec<i128> = powers.iter().map(|&e| div(e, sum)).collect();
            let logs: Vec<i128> = below.iter().map(|x| x - precise::ln(sum)).collect();
            let exact_entropy: i128 = exact.iter().zip(&logs).map(|(&p, &log)| -mul(p, log.max(-70 * ONE))).sum();

            prop_assert_eq!(p.iter().map(|p| u64::from(p.to_bits())).sum::<u64>(), 1 << 31);
            for (j, (p, exact)) in p.iter().zip(&exact).enumerate() {
                let off = (wide(p.to_bits().into(), 31) - exact).abs();
                let steps = if logits[j] == *max { 2 * bits.len() as i128 } else { 2 };
                prop_assert!(off <= (steps << (BITS - 31)) + (exact >> 21), "{off}");
            }
            for (log, exact) in log.iter().zip(&logs) {
                let off = (wide(log.to_bits(), 26) - exact).abs();
                prop_assert!(off < ONE >> 20, "{off}");
            }
            let off = (wide(entropy.to_bits().into(), 20) - exact_entropy).abs();
            prop_assert!(off < (ONE + exact_entropy) >> 20, "{off}");

            let mut errors = vec![OutputError::ZERO; logits.len()];
            let softmax = Softmax { probabilities: &p, logs: &log, entropy };
            discrete_errors(&softmax, action, Advantage::from_bits(push), Probability::from_bits(beta), &mut errors);
            let push = wide(push.into(), 20);
            for (j, error) in errors.iter().enumerate() {
                let taken = if j == action { ONE } else { 0 };
                let spread = mul(exact[j], logs[j].max(-70 * ONE) + exact_entropy);
                let e = mul(push, taken - exact[j]) - mul(wide(beta.into(), 31), spread);
                let off = (wide(error.to_bits().into(), 20) - e.clamp(-4 * ONE, 4 * ONE)).abs();
                prop_assert!(off <= (ONE >> 19) + (push.abs() >> 21), "{off}");
            }
        }

        #[test]
        fn a_gaussian_is_within_its_bounds(
            log in -4i32 << 20..=1 << 20, mean in -8i32 << 20..8 << 20, apart in -45i32 << 20..45 << 20, near in 0u32..12,
            push in -128i32 << 20..=128 << 20, small in 0u32..12, beta in 0u32..1 << 31,
        ) {
            let (apart, push) = (apart >> near, push >> small);
            let scatter = Scatter::new(&TABLES, LogDeviation::from_bits(log));
            let (tried, mean) = (Logit::from_bits(mean + apart), Logit::from_bits(mean));
            let (ln_s, s) = (wide(log.into(), 20), precise::exp(wide(log.into(), 20)));
            let off = (wide(scatter.deviation().to_bits().into(), 30) - s).abs();
            prop_assert!(off <= s >> 21, "{off}");

            let z = div(wide(apart.into(), 20), s).clamp(-16 * ONE, 16 * ONE);
            let z_bound = (ONE >> 27) + (z.abs() >> 21);
            let off = (wide(scatter.distance(tried, mean).to_bits().into(), 27) - z).abs();
            prop_assert!(off <= z_bound, "{off}");
            let density = -mul(z, z) / 2 - ln_s;
            let off = (wide(scatter.log_density(tried, mean).to_bits(), 26) - density).abs();
            prop_assert!(off <= mul(z.abs(), z_bound) + (ONE >> 26), "{off}");

            let errors = scatter.errors(tried, mean, Advantage::from_bits(push), Probability::from_bits(beta));
            let z = z.clamp(-4 * ONE, 4 * ONE);
            let push = wide(push.into(), 20);
            let pull = div(mul(push, z), s);
            let widen = mul(push, mul(z, z) - ONE) + wide(beta.into(), 31);
            let bounds = [
                (ONE >> 20) + div(mul(push.abs(), (z.abs() >> 20) + (ONE >> 27)), s),
                (ONE >> 20) + (push.abs() >> 15),
            ];
            for ((error, exact), bound) in errors.iter().zip([pull, widen]).zip(bounds) {
                let off = (wide(error.to_bits().into(), 20) - exact.clamp(-4 * ONE, 4 * ONE)).abs();
                prop_assert!(off <= bound, "{off} {bound}");
            }
        }
    }
}
