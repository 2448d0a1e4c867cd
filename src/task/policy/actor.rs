//! The network that acts: what it puts out, what is drawn from that, and the errors that it learns from.
//!
//! ```text
//! logit, mean   readout * 2^-point                                        of its last layer
//! ln sigma     += rsh(rate * sum of errors / steps of the minibatch)       a register an action value, clamped to -4 ..= 1
//! ```
//!
//! See docs/MODEL.md, 5.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use super::experiment::{Ppo, Share};
use super::function;
use super::head::{self, Scatter, Softmax};
use super::number::{
    Advantage, LogDeviation, LogProbability, Logit, OutputError, Probability, Ratio,
};
use super::outcome::PolicyEpoch;
use super::ratio::{self, Clip};
use super::rollout::Rollout;
use super::sample;
use crate::chip::state::{Piece, Section, State, StateError, Visitor};
use crate::learn::driver::Driver;
use crate::num::draw::Place;
use crate::num::fixed::narrow;
use crate::num::tables::PolicyTables;
use crate::task::environment::{Actions, Real, Taken};

/// `ln sigma` in 2^-20.
const LOG_SIGMA: std::ops::RangeInclusive<i64> = -4 << 20..=1 << 20;

/// Actions of all environments.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Chosen {
    Discrete(Vec<u16>),
    Continuous(Vec<Real>),
}

impl Chosen {
    /// Those of `count` environments, of which `live` are told these; what others are told does not matter.
    pub(super) fn spread_to(&self, live: &[usize], count: usize) -> Self {
        match self {
            Self::Discrete(actions) => {
                let mut all = vec![0; count];
                live.iter().zip(actions).for_each(|(&which, &action)| all[which] = action);
                Self::Discrete(all)
            }
            Self::Continuous(values) => {
                let width = values.len() / live.len();
                let mut all = vec![Real::ZERO; count * width];
                for (&which, values) in live.iter().zip(values.chunks_exact(width)) {
                    all[which * width..(which + 1) * width].copy_from_slice(values);
                }
                Self::Continuous(all)
            }
        }
    }

    /// Numbers of actions, or their values with 16 fractional bits.
    pub(super) fn numbers(&self) -> Vec<i64> {
        match self {
            Self::Discrete(actions) => actions.iter().map(|&action| action.into()).collect(),
            Self::Continuous(values) => values.iter().map(|v| v.to_bits().into()).collect(),
        }
    }

    pub(super) fn actions(&self) -> Actions<'_> {
        match self {
            Self::Discrete(actions) => Actions::Discrete(actions),
            Self::Continuous(values) => Actions::Continuous(values),
        }
    }
}

/// The network that acts.
#[derive(Debug)]
pub(super) struct Actor {
    pub(super) driver: Driver,
    taken: Taken,
    law: ActorLaw,
    /// `ln sigma` of each value of an action, 20 fractional bits; empty of discrete actions.
    log_sigma: Vec<i64>,
    /// Room for what is put out.
    logits: Vec<Logit>,
}

/// What an actor learns by; of no account where nothing is learnt from errors.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct ActorLaw {
    clip: Share,
    entropy: Share,
    log_sigma_start: i32,
    log_sigma_rate: Share,
}

impl From<Ppo> for ActorLaw {
    fn from(ppo: Ppo) -> Self {
        let Ppo { clip, entropy, log_sigma_start, log_sigma_rate, .. } = ppo;
        Self { clip, entropy, log_sigma_start, log_sigma_rate }
    }
}

/// How likely what was drawn was, and what was tried of continuous actions.
#[derive(Default)]
struct Drawn {
    logs: Vec<LogProbability>,
    tried: Vec<Logit>,
}

impl Actor {
    pub(super) fn new(driver: Driver, taken: Taken, law: ActorLaw) -> Self {
        let values = if let Taken::Continuous(values) = taken { values } else { 0 };
        let log_sigma = vec![i64::from(law.log_sigma_start) << 4; values];
        Self { driver, taken, law, log_sigma, logits: vec![] }
    }

    /// Numbers it puts out.
    const fn width(&self) -> usize {
        match self.taken {
            Taken::Discrete(actions) => actions,
            Taken::Continuous(values) => values,
        }
    }

    /// `ln sigma` of each value, 20 fractional bits.
    pub(super) fn log_sigma(&self) -> &[i64] {
        &self.log_sigma
    }

    fn scatters(&self, tables: &PolicyTables) -> Vec<Scatter> {
        let scatter = |&log: &i64| Scatter::new(tables, LogDeviation::from_bits(log as i32));
        self.log_sigma.iter().map(scatter).collect()
    }

    /// Reads some observations; what is put out, `[sample][output]`.
    pub(super) fn read(&mut self, codes: &[u8]) -> &[Logit] {
        self.driver.read(codes);
        super::outputs(self.driver.engine(), &mut self.logits);
        &self.logits
    }

    /// What is drawn for what was read last, of all environments; the rollout keeps it, and how likely it was.
    pub(super) fn act(&self, tables: &PolicyTables, place: Place, rollout: &mut Rollout) -> Chosen {
        let samples = self.logits.len() / self.width();
        let (chosen, drawn) = self.drawn_with(tables, place, 0..samples);
        rollout.logs.extend(drawn.logs);
        rollout.tried.extend(drawn.tried);
        if let Chosen::Discrete(actions) = &chosen {
            rollout.choices.extend_from_slice(actions);
        }
        chosen
    }

    /// What is drawn for what was read last, where `which` environments those are.
    pub(super) fn drawn(&self, tables: &PolicyTables, place: Place, which: &[usize]) -> Chosen {
        self.drawn_with(tables, place, which.iter().copied()).0
    }

    fn drawn_with(
        &self,
        tables: &PolicyTables,
        place: Place,
        which: impl Iterator<Item = usize>,
    ) -> (Chosen, Drawn) {
        let width = self.width();
        let samples = self.logits.chunks_exact(width).zip(which);
        let words = |environment: usize| {
            let sub = narrow(environment, "at most 1024 environments");
            Place { sub, ..place }.words()
        };
        let mut drawn = Drawn::default();
        let chosen = match self.taken {
            Taken::Discrete(_) => {
                let mut probabilities = vec![Probability::ZERO; width];
                let mut logs = vec![LogProbability::ZERO; width];
                let mut chosen = Vec::new();
                for (logits, environment) in samples {
                    head::softmax(tables, logits, &mut probabilities, &mut logs);
                    let word = words(environment).next().expect("the stream has no end");
                    let action = sample::discrete(&probabilities, word);
                    drawn.logs.push(logs[usize::from(action)]);
                    chosen.push(action);
                }
                Chosen::Discrete(chosen)
            }
            Taken::Continuous(_) => {
                let scatters = self.scatters(tables);
                let mut chosen = Vec::new();
                for (means, environment) in samples {
                    let mut log = LogProbability::ZERO;
                    let each = means.iter().zip(&scatters).zip(words(environment));
                    for ((&mean, scatter), word) in each {
                        let tried = sample::continuous(tables, mean, scatter, word);
                        log += scatter.log_density(tried, mean);
                        drawn.tried.push(tried);
                        chosen.push(function::tanh(tables, tried));
                    }
                    drawn.logs.push(log);
                }
                Chosen::Continuous(chosen)
            }
        };
        (chosen, drawn)
    }

    /// What is likeliest for what was read last.
    pub(super) fn likeliest(&self, tables: &PolicyTables) -> Chosen {
        match self.taken {
            Taken::Discrete(actions) => {
                Chosen::Discrete(self.logits.chunks_exact(actions).map(sample::likeliest).collect())
            }
            Taken::Continuous(_) => Chosen::Continuous(
                self.logits.iter().map(|&mean| function::tanh(tables, mean)).collect(),
            ),
        }
    }

    /// One update from some steps of a rollout.
    pub(super) fn learn(
        &mut self,
        tables: &PolicyTables,
        codes: &[u8],
        batch: &[u32],
        rollout: &Rollout,
        epoch: &mut PolicyEpoch,
    ) {
        let scatters = self.scatters(tables);
        let Self { driver, taken, law, logits, log_sigma, .. } = self;
        let beta = law.entropy;
        let clip = Clip { epsilon: Ratio::from_num(law.clip) };
        let mut widen = vec![0i64; log_sigma.len()];
        driver.learn(codes, |engine, first, errors| {
            super::outputs(engine, logits);
            let steps = &batch[first..first + engine.samples()];
            match *taken {
                Taken::Discrete(actions) => {
                    let mut probabilities = vec![Probability::ZERO; actions];
                    let mut logs = vec![LogProbability::ZERO; actions];
                    let mut wanted = vec![OutputError::ZERO; actions];
                    for (&step, logits) in steps.iter().zip(logits.chunks_exact(actions)) {
                        let step = step as usize;
                        let entropy = head::softmax(tables, logits, &mut probabilities, &mut logs);
                        let action = usize::from(rollout.choices[step]);
                        let push = push_of(tables, clip, logs[action], rollout, step, epoch);
                        let softmax =
                            Softmax { probabilities: &probabilities, logs: &logs, entropy };
                        head::discrete_errors(&softmax, action, push, beta, &mut wanted);
                        epoch.entropy.add(entropy.to_bits().into());
                        errors.extend(wanted.iter().map(|error| error.to_bits()));
                    }
                }
                Taken::Continuous(values) => {
                    for (&step, means) in steps.iter().zip(logits.chunks_exact(values)) {
                        let step = step as usize;
                        let tried = &rollout.tried[step * values..(step + 1) * values];
                        let each = || tried.iter().zip(means).zip(&scatters);
                        let log: LogProbability =
                            each().map(|((&t, &mean), scatter)| scatter.log_density(t, mean)).sum();
                        let push = push_of(tables, clip, log, rollout, step, epoch);
                        for (((&t, &mean), scatter), widen) in each().zip(&mut widen) {
                            let [error, wider] = scatter.errors(t, mean, push, beta);
                            errors.push(error.to_bits());
                            *widen += i64::from(wider.to_bits());
                        }
                        let entropy =
                            scatters.iter().map(|s| i64::from(s.entropy().to_bits())).sum();
                        epoch.entropy.add(entropy);
                    }
                }
            }
        });
        let steps = batch.len() as i64;
        for (log, widen) in log_sigma.iter_mut().zip(widen) {
            let rate = i128::from(law.log_sigma_rate.to_bits());
            let (above, below) = (2 * rate * i128::from(widen), i128::from(steps) << 31);
            // halves up
            let by = (above + below).div_euclid(2 * below) as i64;
            *log = (*log + by).clamp(*LOG_SIGMA.start(), *LOG_SIGMA.end());
        }
    }
}

/// What the errors of a step are multiples of, and what it says of the update.
fn push_of(
    tables: &PolicyTables,
    clip: Clip,
    log: LogProbability,
    rollout: &Rollout,
    step: usize,
    epoch: &mut PolicyEpoch,
) -> Advantage {
    let advantage = rollout.advantages[step];
    let d = ratio::log_ratio(log, rollout.logs[step]);
    let ratio = ratio::ratio(tables, d);
    epoch.policy_loss.add(-i64::from(clip.gain(ratio, advantage).to_bits()));
    epoch.approx_kl.add(ratio::divergence(ratio, d) >> 7); // cut to 2^-20
    epoch.clipped.add(i64::from(clip.outside(ratio)));
    clip.push(ratio, advantage)
}

impl State for Actor {
    fn visit(&mut self, visitor: &mut dyn Visitor) -> Result<(), StateError> {
        self.driver.visit(visitor)?;
        if self.log_sigma.is_empty() {
            return Ok(());
        }
        let piece =
            Piece { name: "policy.log_sigma", section: Some(Section::Task), within: LOG_SIGMA };
        if let Some(log_sigma) = visitor.numbers(&piece, &self.log_sigma)? {
            self.log_sigma = log_sigma;
        }
        Ok(())
    }
}
