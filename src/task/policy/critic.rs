//! The network that says what states are worth, on a scale of its own.
//!
//! ```text
//! value   scale(readout * 2^-point)
//! error   target - said, in units of the scale, clamped to +-4; a layer below hears it everywhere
//! ```
//!
//! A rollout is judged by the scale before it; the scale then takes its targets, and errors are in the new one. See
//! docs/MODEL.md, 5.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use super::advantage::{self, Happened, Horizon};
use super::experiment::Ppo;
use super::number::{Logit, Value};
use super::outcome::PolicyEpoch;
use super::prefixed::Prefixed;
use super::rollout::Rollout;
use super::value::{ValueScale, value_error};
use crate::chip::state::{State, StateError, Visitor};
use crate::learn::driver::Driver;

/// Samples read together when nothing is learnt. Does not change a result.
const READ_BATCH: usize = 256;
/// Rollouts that the scale of values looks back.
const WINDOW: u32 = 32;

/// The network that judges.
#[derive(Debug)]
pub(super) struct Critic {
    pub(super) driver: Driver,
    scale: ValueScale,
    said: Vec<Logit>,
}

impl Critic {
    pub(super) const fn new(driver: Driver) -> Self {
        Self { driver, scale: ValueScale::new(WINDOW), said: vec![] }
    }

    /// What some states are worth.
    pub(super) fn values(&mut self, codes: &[u8]) -> Vec<Value> {
        let rows = self.driver.engine().layers()[0].spec.inputs;
        let mut values = Vec::with_capacity(codes.len() / rows);
        for codes in codes.chunks(READ_BATCH * rows) {
            self.driver.read(codes);
            super::outputs(self.driver.engine(), &mut self.said);
            values.extend(self.said.iter().map(|&said| self.scale.to_value(said)));
        }
        values
    }

    /// Advantages and targets of a rollout; `last` are the drives of what environments show now.
    pub(super) fn judge(
        &mut self,
        rollout: &mut Rollout,
        last: &[u8],
        ppo: Ppo,
        epoch: &mut PolicyEpoch,
    ) {
        let values = self.values(&rollout.codes);
        let mut reached = vec![Value::ZERO; values.len()];
        let beyond = self.values(&rollout.reached);
        rollout.stopped.iter().zip(beyond).for_each(|(&step, value)| reached[step] = value);
        let last = self.values(last);
        let happened = Happened {
            rewards: &rollout.rewards,
            values: &values,
            reached: &reached,
            terminated: &rollout.terminated,
            truncated: &rollout.truncated,
            last: &last,
        };
        let horizon = Horizon { discount: ppo.discount, trace: ppo.lambda };
        advantage::advantages(&happened, horizon, &mut rollout.advantages, &mut rollout.targets);
        // of steps in which nobody acted there is nothing to learn
        let acted = Vec::from_iter((0..values.len()).filter(|&step| rollout.acted(step)));
        let of = |all: &[Value]| Vec::from_iter(acted.iter().map(|&step| all[step]));
        let (mut better, targets) = (of(&rollout.advantages), of(&rollout.targets));
        epoch.unexplained = unexplained(&of(&values), &targets);
        advantage::normalise(&mut better);
        self.scale.update(&targets);
        for ((step, better), target) in acted.into_iter().zip(better).zip(targets) {
            rollout.advantages[step] = better;
            rollout.targets[step] = self.scale.to_standard(target);
        }
    }

    /// One update from some steps of a rollout.
    pub(super) fn learn(
        &mut self,
        codes: &[u8],
        batch: &[u32],
        rollout: &Rollout,
        epoch: &mut PolicyEpoch,
    ) {
        let Self { driver, said, .. } = self;
        driver.learn(codes, |engine, first, errors| {
            super::outputs(engine, said);
            let steps = &batch[first..first + engine.samples()];
            for (&step, &said) in steps.iter().zip(&*said) {
                let error = i64::from(value_error(rollout.targets[step as usize], said).to_bits());
                epoch.value_loss.add((error * error) >> 21);
                errors.push(error as i32);
            }
        });
    }
}

/// Variance of targets that values leave, and their variance: both in 2^-20, as sums over the states.
fn unexplained(values: &[Value], targets: &[Value]) -> [i64; 2] {
    let count = targets.len() as i128;
    let variance = |numbers: &mut dyn Iterator<Item = i64>| {
        let (mut sum, mut squares) = (0i128, 0i128);
        numbers.for_each(|n| {
            sum += i128::from(n);
            squares += i128::from(n) * i128::from(n);
        });
        let apart = squares - sum * sum / count.max(1);
        i64::try_from(apart >> 20).unwrap_or(i64::MAX)
    };
    let bits = |number: &Value| i64::from(number.to_bits());
    let left = variance(&mut targets.iter().zip(values).map(|(t, v)| bits(t) - bits(v)));
    [left, variance(&mut targets.iter().map(bits))]
}

impl State for Critic {
    fn visit(&mut self, visitor: &mut dyn Visitor) -> Result<(), StateError> {
        self.driver.visit(&mut Prefixed { prefix: "critic", visitor })?;
        self.scale.visit(visitor)
    }
}
