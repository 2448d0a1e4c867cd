//! Heads of an actor: what its outputs say of actions, and what they should have said more.
//!
//! Discrete actions, logits `x`:
//!
//! ```text
//! pi_j     = exp(x_j - max) / sum exp(x_i - max)            floored to 2^-31; what is missing goes to the first greatest: the sum is 1
//! ln pi_j  = (x_j - max) - ln sum                           error < 2^-20
//! H        = - sum pi_j ln pi_j                             error < 2^-20 (1 + H)
//! e_j      = weight (1[j = a] - pi_j) - beta pi_j (ln pi_j + H)        clamped to +-4
//! ```
//!
//! Continuous actions, means `mu`, deviations `s` that depend on no state; `u` is what was tried, the environment is told `tanh u`:
//!
//! ```text
//! z        = clamp((u - mu) / s, -16, 16)                   error < 2^-27 + |z| 2^-21
//! ln p     = sum -z^2 / 2 - ln s                            without its constant, which no ratio has; nor has one that of tanh
//! H        = sum ln s + ln(2 pi e) / 2                      of the Gaussian, before tanh
//! e_mu     = weight z / s,     e_ln s = weight (z^2 - 1) + beta        z clamped to +-4, errors to +-4
//! ```
//!
//! `weight` is that of [`Clip`](super::ratio::Clip). Errors are multiples of 2^-20: e_j is off by less than `2^-19 + |weight| 2^-21`,
//! e_mu by `2^-20 + |weight| / s (|z| 2^-20 + 2^-27)`, e_ln s by `2^-20 + |weight| 2^-15`. They point uphill: outputs should follow them. See docs/MODEL.md, 5.
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
    weight: Advantage,
    beta: Probability,
    errors: &mut [OutputError],
) {
    let Softmax { probabilities, logs, entropy } = *softmax;
    assert!(probabilities.len() == logs.len() && logs.len() == errors.len(), "one an action");
    let weight = i64::from(weight.to_bits());
    let entropy = i64::from(entropy.to_bits()) << 6;
    for (j, ((p, log), error)) in probabilities.iter().zip(logs).zip(errors).enumerate() {
        let p = i64::from(p.to_bits());
        let taken = i64::from(j == action) << 31;
        let part = rsh(i64::from(beta.to_bits()) * p, 31);
        let spread = part * (log.to_bits() + entropy);
        *error = bounded(rsh(weight * (taken - p) - rsh(spread, 6), 31));
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
        weight: Advantage,
        beta: Probability,
    ) -> [OutputError; 2] {
        let weight = i64::from(weight.to_bits());
        let z = i64::from(self.distance(tried, mean).to_bits()).clamp(-Z_BOUND, Z_BOUND);
        let pull = i128::from(weight * z) * i128::from(self.precision.to_bits());
        let widen = i128::from(weight) * i128::from(z * z - (1 << 54));
        let widen = widen + (i128::from(beta.to_bits()) << 43);
        [rsh(pull, 53), rsh(widen, 54)].map(|error| bounded(error as i64))
    }
}
