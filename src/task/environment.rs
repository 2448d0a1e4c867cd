//! Environments: what a policy acts on, many side by side, in integers.
//!
//! A [`VecEnv`] shows observations, takes actions, gives rewards and says how an episode ended. An end has the meaning
//! that Gymnasium gives it: *terminated* is an end of the task, after which nothing is worth anything; *truncated* is a
//! stop from outside, most often a limit of time, after which the state would have been worth what it was. An episode
//! that ended begins again in the same step: what was reached and what the next one begins with are both shown.
//!
//! Numbers that are not counts are [`Real`]: 32 bits, 16 of them behind the point. What is drawn is drawn at its place:
//! site [`Environment`](crate::num::draw::Site::Environment), sub = number of the environment, count = number of its
//! episode.
//!
//! Which environments there are stands in [`ENVIRONMENTS`]; each is one small file with its law at its head, and becomes
//! many of it side by side in [`one`]. See docs/MODEL.md, 5.4.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use std::borrow::Cow;
use std::fmt;

use fixed::types::I16F16;

use crate::chip::state::State;

pub mod acrobot;
pub mod canvas;
pub mod cart_pole;
pub mod fine;
pub mod foray;
pub mod mountain_car;
pub mod one;
pub mod pendulum;
mod stream;

use one::SideBySide;
pub use stream::{EnvSource, KeptPiece, Purpose, Record, Replaying, ShownStream};

/// An observation, an action or a reward.
pub type Real = I16F16;

/// What an environment shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Shown {
    /// So many numbers.
    Dense(usize),
    /// So many lines, of which some are on and the others off.
    Sparse {
        /// Lines.
        lines: usize,
        /// On at a time, at most.
        active: usize,
    },
}

/// What an environment takes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Taken {
    /// One of so many actions.
    Discrete(usize),
    /// So many numbers from -1 to 1, which the environment scales to what it takes.
    Continuous(usize),
}

/// An environment, in words and sizes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct EnvSpec {
    /// What it is called, such as `CartPole-v1`.
    pub id: Cow<'static, str>,
    /// What it shows.
    pub shown: Shown,
    /// What it takes.
    pub taken: Taken,
    /// Steps after which an episode is truncated.
    pub steps_max: u32,
    /// Names of the numbers or of groups of lines that it shows, in order, with how many there are of each.
    pub inputs: Vec<(&'static str, usize)>,
}

impl EnvSpec {
    /// Numbers that it shows; 0 where it shows lines.
    #[must_use]
    pub const fn values(&self) -> usize {
        match self.shown {
            Shown::Dense(values) => values,
            Shown::Sparse { .. } => 0,
        }
    }
}

/// What some environments show, one after the other.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Observations {
    /// `[environment][value]`; none of sparse ones.
    pub values: Vec<Real>,
    /// Lines that are on, environment after environment, rising in each; of sparse ones.
    pub active: Vec<u32>,
    /// Where those of an environment end; none of dense ones.
    pub ends: Vec<usize>,
}

impl Observations {
    /// Forgets everything and keeps the memory.
    pub fn clear(&mut self) {
        self.values.clear();
        self.active.clear();
        self.ends.clear();
    }

    /// Puts others behind these.
    pub fn append(&mut self, others: &Self) {
        let before = self.active.len();
        self.values.extend_from_slice(&others.values);
        self.active.extend_from_slice(&others.active);
        self.ends.extend(others.ends.iter().map(|end| before + end));
    }

    /// Puts observation number `which` of others behind these.
    pub(crate) fn append_one(&mut self, others: &Self, which: usize, spec: &EnvSpec) {
        self.values.extend_from_slice(others.values_of(which, spec.values()));
        if let Shown::Sparse { .. } = spec.shown {
            self.active.extend_from_slice(others.lines_of(which));
            self.ends.push(self.active.len());
        }
    }

    /// How many there are.
    pub(crate) fn count(&self, spec: &EnvSpec) -> usize {
        match spec.shown {
            Shown::Dense(values) => self.values.len() / values.max(1),
            Shown::Sparse { .. } => self.ends.len(),
        }
    }

    /// Checks that this is what so many environments show, whoever made it.
    ///
    /// # Errors
    /// When it is not.
    pub fn check(&self, spec: &EnvSpec, count: usize) -> Result<(), EnvError> {
        let wrong = |found: String, allowed: String| {
            Err(EnvError { id: spec.id.to_string(), which: 0, found, allowed })
        };
        let (fits, lines) = match spec.shown {
            Shown::Dense(values) => {
                let lineless = self.ends.is_empty() && self.active.is_empty();
                (self.values.len() == count * values && lineless, 0)
            }
            Shown::Sparse { lines, .. } => {
                let ends = self.ends.len() == count
                    && self.ends.is_sorted()
                    && self.ends.last().copied().unwrap_or(0) == self.active.len();
                (ends && self.values.is_empty(), lines)
            }
        };
        if !fits {
            let found = "shows more or less than it has".into();
            let allowed = "give what the environment says that it shows, of each".into();
            return wrong(found, allowed);
        }
        match self.active.iter().find(|&&line| line as usize >= lines) {
            Some(line) => wrong(format!("shows line {line}"), format!("there are {lines}, from 0")),
            None => Ok(()),
        }
    }

    /// What environment number `which` shows, for people: its numbers, 16 fractional bits, or its lines that are on.
    #[must_use]
    pub fn numbers_of(&self, which: usize, spec: &EnvSpec) -> Vec<i64> {
        match spec.shown {
            Shown::Dense(values) => {
                self.values_of(which, values).iter().map(|v| v.to_bits().into()).collect()
            }
            Shown::Sparse { .. } => self.lines_of(which).iter().map(|&line| line.into()).collect(),
        }
    }

    /// The numbers of environment number `which`, of `values` each.
    #[must_use]
    pub fn values_of(&self, which: usize, values: usize) -> &[Real] {
        &self.values[which * values..(which + 1) * values]
    }

    /// The lines that are on of environment number `which`.
    #[must_use]
    pub fn lines_of(&self, which: usize) -> &[u32] {
        let from = which.checked_sub(1).map_or(0, |before| self.ends[before]);
        &self.active[from..self.ends[which]]
    }
}

/// What some environments are told to do.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Actions<'a> {
    /// An action each.
    Discrete(&'a [u16]),
    /// `[environment][value]`, from -1 to 1.
    Continuous(&'a [Real]),
}

/// What came of a step, an entry an environment.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Outcomes {
    /// What each reached.
    pub reached: Observations,
    /// What each shows now: what it reached, or the beginning of its next episode.
    pub next: Observations,
    /// Rewards.
    pub rewards: Vec<Real>,
    /// Whose task is over.
    pub terminated: Vec<bool>,
    /// Who was stopped. Never both.
    pub truncated: Vec<bool>,
}

impl Outcomes {
    /// Checks that these are outcomes of so many environments, whoever made them.
    ///
    /// # Errors
    /// When they are not.
    pub fn check(&self, spec: &EnvSpec, count: usize) -> Result<(), EnvError> {
        let wrong = |which, found: String, allowed: &str| {
            Err(EnvError { id: spec.id.to_string(), which, found, allowed: allowed.into() })
        };
        let lengths = [self.rewards.len(), self.terminated.len(), self.truncated.len()];
        if let Some(found) = lengths.iter().find(|&&length| length != count) {
            let found = format!("is one of {count}, but a list of their outcomes has {found}");
            return wrong(0, found, "give a reward, and whether it ended, of each");
        }
        self.reached.check(spec, count)?;
        self.next.check(spec, count)?;
        let both = |(&over, &stopped): (&bool, &bool)| over && stopped;
        match self.terminated.iter().zip(&self.truncated).position(both) {
            Some(which) => {
                let found = "is terminated and truncated at once".into();
                wrong(which, found, "a task that is over is terminated alone")
            }
            None => Ok(()),
        }
    }

    /// Checks who is said to have been idle: one entry each, or none at all, and one that was neither ended nor earned anything.
    pub(crate) fn check_idle(&self, spec: &EnvSpec, idle: &[bool]) -> Result<(), EnvError> {
        let wrong = |which, found: String, allowed: &str| {
            Err(EnvError { id: spec.id.to_string(), which, found, allowed: allowed.into() })
        };
        if !idle.is_empty() && idle.len() != self.rewards.len() {
            let found = format!(
                "is one of {}, but {} are said to be idle or not",
                self.rewards.len(),
                idle.len()
            );
            return wrong(0, found, "say it of each, or of none");
        }
        for which in (0..idle.len()).filter(|&which| idle[which]) {
            if self.terminated[which] || self.truncated[which] {
                let found = "ends an episode in the step that begins it".into();
                return wrong(
                    which,
                    found,
                    "nobody acted there: the step that begins an episode shows it and no more",
                );
            }
            if self.rewards[which] != Real::ZERO {
                let found =
                    format!("earns {} in the step that begins an episode", self.rewards[which]);
                return wrong(which, found, "nobody acted there: its reward is 0");
            }
        }
        Ok(())
    }
}

/// An environment that cannot go on.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("environment {which} of `{id}` {found}; {allowed}")]
pub struct EnvError {
    /// What it is called.
    pub id: String,
    /// Which of those side by side.
    pub which: usize,
    /// What was found.
    pub found: String,
    /// What is allowed and what to try.
    pub allowed: String,
}

/// Environments of one kind, side by side.
pub trait VecEnv: State + fmt::Debug + Send {
    /// What they are.
    fn spec(&self) -> &EnvSpec;

    /// How many there are.
    fn count(&self) -> usize;

    /// Begins a new episode in each, and shows it.
    fn reset(&mut self, shown: &mut Observations);

    /// Shows each as it is: what the last step or reset left.
    fn show(&self, shown: &mut Observations);

    /// One step in each. Ended episodes begin again.
    ///
    /// # Errors
    /// When one of them cannot go on; nothing that is shown may then be used.
    fn step(&mut self, actions: Actions<'_>, outcomes: &mut Outcomes) -> Result<(), EnvError>;

    /// A picture of one of them in characters, for people; empty where there is none.
    fn picture(&self, which: usize) -> String {
        let _ = which;
        String::new()
    }
}

/// Makes so many environments from a seed.
pub type MakeEnv = fn(seed: u64, count: usize) -> Box<dyn VecEnv>;

/// Every environment, by what it is called.
pub const ENVIRONMENTS: [(&str, MakeEnv); 5] = [
    ("CartPole-v1", |seed, count| Box::new(SideBySide::<cart_pole::CartPole>::new(seed, count))),
    ("Acrobot-v1", |seed, count| Box::new(SideBySide::<acrobot::Acrobot>::new(seed, count))),
    ("Pendulum-v1", |seed, count| Box::new(SideBySide::<pendulum::Pendulum>::new(seed, count))),
    ("MountainCarContinuous-v0", |seed, count| {
        Box::new(SideBySide::<mountain_car::MountainCar>::new(seed, count))
    }),
    ("Foray-v0", |seed, count| Box::new(SideBySide::<foray::Foray>::new(seed, count))),
];

/// An environment that there is not.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("there is no environment `{id}`; there are {}", ENVIRONMENTS.map(|(id, _)| id).join(", "))]
pub struct UnknownEnvironment {
    /// What was asked for.
    pub id: String,
}

/// `count` environments called `id`.
///
/// # Errors
/// When there is none of that name.
pub fn make(id: &str, seed: u64, count: usize) -> Result<Box<dyn VecEnv>, UnknownEnvironment> {
    let known = ENVIRONMENTS.iter().find(|(known, _)| *known == id);
    let (_, make) = known.ok_or_else(|| UnknownEnvironment { id: id.into() })?;
    Ok(make(seed, count))
}
