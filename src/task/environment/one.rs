//! One environment, and many of it side by side.
//!
//! ```text
//! begin    words of 32 bits at site Environment, sub = number of the environment, count = episodes begun before
//! step     act; terminated, or else truncated when that was step `steps_max`; then the next episode begins at once
//! ```
//!
//! An environment here is its rules alone: how it begins, what an action does, what it shows. What all have in common is
//! said once, in [`SideBySide`]. See docs/MODEL.md, 5.4.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use std::fmt;
use std::ops::RangeInclusive;

use super::{Actions, EnvError, EnvSpec, Observations, Outcomes, Real, Shown, Taken, VecEnv};
use crate::chip::state::{Piece, Section, State, StateError, Visitor};
use crate::num::draw::{Place, Site};

/// What one environment is told to do.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Action<'a> {
    /// Which of its actions.
    Discrete(u16),
    /// Numbers from -1 to 1.
    Continuous(&'a [Real]),
}

impl Action<'_> {
    /// Which of its actions.
    ///
    /// # Panics
    /// When numbers were given: [`SideBySide`] lets none through to an environment that takes choices.
    #[inline]
    #[must_use]
    pub fn choice(self) -> u16 {
        let Self::Discrete(choice) = self else { panic!("this environment takes choices") };
        choice
    }

    /// The first of its numbers.
    ///
    /// # Panics
    /// When a choice was given: [`SideBySide`] lets none through to an environment that takes numbers.
    #[inline]
    #[must_use]
    pub fn number(self) -> Real {
        let Self::Continuous([number, ..]) = self else { panic!("this environment takes numbers") };
        *number
    }
}

/// What came of one step of one environment.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Came {
    /// Its reward.
    pub reward: Real,
    /// Whether the task is over.
    pub terminated: bool,
}

/// A part of an environment's state.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct StatePart {
    /// What it is called, such as `pole_angle`.
    pub name: &'static str,
    /// How many numbers it is.
    pub numbers: usize,
    /// What each of them lies in, whatever is done.
    pub within: RangeInclusive<i64>,
}

/// The rules of one environment. Its value is the state of an episode.
pub trait Environment: fmt::Debug + Send + Sized {
    /// What it is.
    fn spec() -> EnvSpec;

    /// What its state is made of, in the order of [`Environment::numbers`].
    fn parts() -> Vec<StatePart>;

    /// The beginning of an episode.
    fn begin(words: &mut impl Iterator<Item = u32>) -> Self;

    /// One step. The action is of the kind and size that the spec says.
    fn act(&mut self, action: Action<'_>) -> Came;

    /// Adds what it shows.
    fn show(&self, shown: &mut Observations);

    /// Adds its state in numbers.
    fn numbers(&self, numbers: &mut Vec<i64>);

    /// The state that such numbers stand for; each lies within its part.
    fn from_numbers(numbers: &[i64]) -> Self;

    /// A picture in characters.
    fn picture(&self) -> String;
}

/// Most episodes of an environment: fewer than a place of draws has counts.
const EPISODES_MAX: i64 = 1 << 35;

/// Environments of one kind, side by side. Made, each is at the beginning of its first episode.
#[derive(Debug)]
pub struct SideBySide<E> {
    spec: EnvSpec,
    seed: u64,
    all: Vec<E>,
    /// Episodes begun, an environment each.
    episodes: Vec<i64>,
    /// Steps of its episode.
    steps: Vec<i64>,
}

/// What a seed and the number of an environment and of an episode begin with.
fn begin<E: Environment>(seed: u64, which: usize, episode: i64) -> E {
    let sub = u32::try_from(which).expect("fewer than 2^32 environments stand side by side");
    let place = Place {
        seed,
        site: Site::Environment,
        layer: 0,
        pathway: 0,
        sub,
        count: episode.unsigned_abs(),
    };
    E::begin(&mut place.words())
}

impl<E: Environment> SideBySide<E> {
    /// `count` environments.
    #[must_use]
    pub fn new(seed: u64, count: usize) -> Self {
        let all = (0..count).map(|which| begin(seed, which, 0)).collect();
        Self { spec: E::spec(), seed, all, episodes: vec![1; count], steps: vec![0; count] }
    }

    /// One of them, in numbers, as [`Environment::parts`] lists them.
    #[must_use]
    pub fn state(&self, which: usize) -> Vec<i64> {
        let mut numbers = vec![];
        self.all[which].numbers(&mut numbers);
        numbers
    }

    /// Puts one of them into a state. Its count of steps stays.
    ///
    /// # Errors
    /// When they are more or fewer numbers than the state has, or one of them is out of its range.
    pub fn put(&mut self, which: usize, numbers: &[i64]) -> Result<(), EnvError> {
        let wrong = |found: String, allowed: String| EnvError {
            id: self.spec.id.to_string(),
            which,
            found,
            allowed,
        };
        let parts: Vec<StatePart> = E::parts().into_iter().flat_map(singles).collect();
        if parts.len() != numbers.len() {
            let found = format!("is given a state of {} numbers", numbers.len());
            return Err(wrong(found, format!("its state has {}", parts.len())));
        }
        for (part, number) in parts.iter().zip(numbers) {
            if !part.within.contains(number) {
                let found = format!("is given {number} as `{}`", part.name);
                return Err(wrong(found, format!("it lies in {:?}", part.within)));
            }
        }
        self.all[which] = E::from_numbers(numbers);
        Ok(())
    }

    fn begin(&mut self, which: usize) {
        self.all[which] = begin(self.seed, which, self.episodes[which]);
        self.episodes[which] += 1;
        self.steps[which] = 0;
    }

    /// Of what kind, how many and how large actions are.
    fn check(&self, actions: Actions<'_>) -> Result<(), EnvError> {
        let wrong = |which, found: String, allowed: String| {
            Err(EnvError { id: self.spec.id.to_string(), which, found, allowed })
        };
        let (each, given) = match (self.spec.taken, actions) {
            (Taken::Discrete(choices), Actions::Discrete(actions)) => {
                let beyond = |action: &u16| usize::from(*action) >= choices;
                if let Some(which) = actions.iter().position(beyond) {
                    let found = format!("is given action {}", actions[which]);
                    return wrong(which, found, format!("its actions are 0 to {}", choices - 1));
                }
                (1, actions.len())
            }
            (Taken::Continuous(each), Actions::Continuous(actions)) => (each, actions.len()),
            (Taken::Discrete(_), Actions::Continuous(_)) => {
                return wrong(0, "is given numbers".into(), "it takes choices".into());
            }
            (Taken::Continuous(_), Actions::Discrete(_)) => {
                return wrong(0, "is given choices".into(), "it takes numbers".into());
            }
        };
        let wanted = each * self.all.len();
        if given == wanted {
            return Ok(());
        }
        let which = (given / each).min(self.all.len().saturating_sub(1));
        let found = format!("is one of {} that are given {given} values", self.all.len());
        wrong(which, found, format!("{wanted} are needed"))
    }

    /// What all of them came to.
    fn advance<'a>(&mut self, outcomes: &mut Outcomes, action: impl Fn(usize) -> Action<'a>) {
        let steps_max = i64::from(self.spec.steps_max);
        for which in 0..self.all.len() {
            let one = &mut self.all[which];
            let Came { reward, terminated } = one.act(action(which));
            self.steps[which] += 1;
            let truncated = !terminated && self.steps[which] >= steps_max;
            add(one, self.spec.shown, &mut outcomes.reached);
            if terminated || truncated {
                self.begin(which);
            }
            add(&self.all[which], self.spec.shown, &mut outcomes.next);
            outcomes.rewards.push(reward);
            outcomes.terminated.push(terminated);
            outcomes.truncated.push(truncated);
        }
    }
}

/// A part of a number each.
fn singles(part: StatePart) -> impl Iterator<Item = StatePart> {
    let single = StatePart { numbers: 1, ..part.clone() };
    std::iter::repeat_n(single, part.numbers)
}

#[inline]
fn add<E: Environment>(one: &E, kind: Shown, shown: &mut Observations) {
    one.show(shown);
    if let Shown::Sparse { .. } = kind {
        shown.ends.push(shown.active.len());
    }
}

impl<E: Environment> VecEnv for SideBySide<E> {
    fn spec(&self) -> &EnvSpec {
        &self.spec
    }

    fn count(&self) -> usize {
        self.all.len()
    }

    fn reset(&mut self, shown: &mut Observations) {
        (0..self.all.len()).for_each(|which| self.begin(which));
        self.show(shown);
    }

    fn show(&self, shown: &mut Observations) {
        shown.clear();
        self.all.iter().for_each(|one| add(one, self.spec.shown, shown));
    }

    fn step(&mut self, actions: Actions<'_>, outcomes: &mut Outcomes) -> Result<(), EnvError> {
        self.check(actions)?;
        outcomes.reached.clear();
        outcomes.next.clear();
        outcomes.rewards.clear();
        outcomes.terminated.clear();
        outcomes.truncated.clear();
        match (actions, self.spec.taken) {
            (Actions::Continuous(numbers), Taken::Continuous(each)) => {
                let of = |which| Action::Continuous(&numbers[which * each..][..each]);
                self.advance(outcomes, of);
            }
            (Actions::Discrete(choices), _) => {
                self.advance(outcomes, |which| Action::Discrete(choices[which]));
            }
            (Actions::Continuous(_), Taken::Discrete(_)) => unreachable!("it was checked"),
        }
        Ok(())
    }

    fn picture(&self, which: usize) -> String {
        self.all[which].picture()
    }
}

/// Shows some numbers and takes what comes back.
fn visit_numbers(
    visitor: &mut dyn Visitor,
    name: &str,
    within: RangeInclusive<i64>,
    numbers: &mut Vec<i64>,
) -> Result<(), StateError> {
    let name = format!("environment.{name}");
    let piece = Piece { name: &name, section: Some(Section::Task), within };
    if let Some(new) = visitor.numbers(&piece, numbers)? {
        *numbers = new;
    }
    Ok(())
}

impl<E: Environment> State for SideBySide<E> {
    fn visit(&mut self, visitor: &mut dyn Visitor) -> Result<(), StateError> {
        let steps_max = i64::from(self.spec.steps_max);
        visit_numbers(visitor, "episodes", 0..=EPISODES_MAX, &mut self.episodes)?;
        visit_numbers(visitor, "steps", 0..=steps_max, &mut self.steps)?;
        let mut states: Vec<Vec<i64>> =
            (0..self.all.len()).map(|which| self.state(which)).collect();
        let mut first = 0;
        for StatePart { name, numbers, within } in E::parts() {
            let part = first..first + numbers;
            first = part.end;
            let mut values: Vec<i64> =
                states.iter().flat_map(|state| &state[part.clone()]).copied().collect();
            visit_numbers(visitor, name, within, &mut values)?;
            states.iter_mut().zip(values.chunks_exact(numbers)).for_each(|(state, new)| {
                state[part.clone()].copy_from_slice(new);
            });
        }
        self.all = states.iter().map(|numbers| E::from_numbers(numbers)).collect();
        Ok(())
    }
}

#[cfg(test)]
mod tests;
