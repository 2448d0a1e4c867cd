//! What is kept of a rollout: `[step][environment]` throughout.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use std::borrow::Cow;

use super::experiment::InputCoding;
use super::number::{Advantage, LogProbability, Logit, Observed, Value};
use super::observe::{self, Standard};
use crate::num::fixed::DriveBits;
use crate::task::environment::{EnvSpec, Observations, Real, Shown};

/// How observations become drives.
#[derive(Debug, Clone)]
pub(super) struct Coding {
    pub(super) input: InputCoding,
    pub(super) bits: DriveBits,
    /// Lines of a sparse observation, or 0.
    lines: usize,
    /// Numbers of a dense one, or 0.
    values: usize,
    observed: Vec<Observed>,
}

impl Coding {
    pub(super) const fn new(input: InputCoding, bits: DriveBits, spec: &EnvSpec) -> Self {
        let (lines, values) = match spec.shown {
            Shown::Dense(values) => (0, values),
            Shown::Sparse { lines, .. } => (lines, 0),
        };
        Self { input, bits, lines, values, observed: vec![] }
    }

    /// Codes of a sample: one a row, or two where drives have a sign.
    pub(super) const fn rows(&self) -> usize {
        match self.input {
            InputCoding::Split | InputCoding::Signed => 2 * self.values + self.lines,
            InputCoding::Offset => self.values + self.lines,
        }
    }

    /// Numbers of an observation; 0 of sparse ones.
    pub(super) const fn values(&self) -> usize {
        self.values
    }

    /// Appends the drives of observation number `which`.
    pub(super) fn code(
        &mut self,
        standard: &Standard,
        shown: &Observations,
        which: usize,
        codes: &mut Vec<u8>,
    ) {
        if self.lines > 0 {
            observe::sparse(shown.lines_of(which), self.lines, self.bits, codes);
        } else {
            self.observed.clear();
            standard.apply(shown.values_of(which, self.values), &mut self.observed);
            match self.input {
                InputCoding::Split => observe::split(&self.observed, self.bits, codes),
                InputCoding::Offset => observe::offset(&self.observed, self.bits, codes),
                InputCoding::Signed => observe::signed(&self.observed, self.bits, codes),
            }
        }
    }
}

/// Steps that were made with one policy.
#[derive(Debug, Clone, Default)]
pub(super) struct Rollout {
    /// Codes, `[step][environment]`, as many each as [`Coding::rows`] says.
    pub(super) codes: Vec<u8>,
    /// Discrete actions.
    pub(super) choices: Vec<u16>,
    /// Continuous actions before they are squashed, `[step][environment][value]`.
    pub(super) tried: Vec<Logit>,
    /// Logarithm of the probability, or density, of the action.
    pub(super) logs: Vec<LogProbability>,
    /// What the observations are: their numbers, for the statistics.
    pub(super) shown: Vec<Real>,
    pub(super) rewards: Vec<Real>,
    pub(super) terminated: Vec<bool>,
    pub(super) truncated: Vec<bool>,
    /// Drives of what was reached where an episode was truncated, in order.
    pub(super) reached: Vec<u8>,
    /// Which steps those are.
    pub(super) stopped: Vec<usize>,
    /// Steps in which an environment began its next episode and nobody acted, rising: nothing is learnt from them.
    pub(super) idle: Vec<usize>,
    pub(super) advantages: Vec<Advantage>,
    /// Value targets, standardised.
    pub(super) targets: Vec<Value>,
}

impl Rollout {
    /// Forgets everything and keeps the memory.
    pub(super) fn clear(&mut self) {
        self.codes.clear();
        self.choices.clear();
        self.tried.clear();
        self.logs.clear();
        self.shown.clear();
        self.rewards.clear();
        self.terminated.clear();
        self.truncated.clear();
        self.reached.clear();
        self.stopped.clear();
        self.idle.clear();
        self.advantages.clear();
        self.targets.clear();
    }

    /// Steps of all environments.
    pub(super) fn len(&self) -> usize {
        self.rewards.len()
    }

    /// Whether somebody acted in that step.
    pub(super) fn acted(&self, step: usize) -> bool {
        self.idle.binary_search(&step).is_err()
    }

    /// What was shown where somebody acted, of `values` numbers each.
    pub(super) fn shown_to_actors(&self, values: usize) -> Cow<'_, [Real]> {
        if self.idle.is_empty() || values == 0 {
            return Cow::Borrowed(&self.shown);
        }
        let each = self.shown.chunks_exact(values).enumerate();
        Cow::Owned(
            each.filter(|&(step, _)| self.acted(step)).flat_map(|(_, one)| one).copied().collect(),
        )
    }
}
