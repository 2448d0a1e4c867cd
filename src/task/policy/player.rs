//! What acts without learning: observations in, actions out; and whole episodes of it.
//!
//! ```text
//! episode   from the beginning to its first end; environments whose episode is over are no longer read
//! ```
//!
//! See docs/MODEL.md, 5.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use super::actor::{Actor, Chosen};
use super::observe::{Standard, Statistics};
use super::rollout::Coding;
use crate::chip::state::{State, StateError, Visitor};
use crate::num::draw::Place;
use crate::num::tables::PolicyTables;
use crate::task::environment::{EnvError, EnvSpec, Observations, Outcomes, VecEnv};

/// An actor and what it needs to see.
#[derive(Debug)]
pub(super) struct Player {
    pub(super) spec: EnvSpec,
    pub(super) tables: PolicyTables,
    pub(super) actor: Actor,
    pub(super) coding: Coding,
    /// Of all observations that were learnt from.
    pub(super) statistics: Statistics,
    /// As it was when the rollout began.
    pub(super) standard: Standard,
}

/// Returns (16 fractional bits) and lengths of some episodes.
#[derive(Debug, Default)]
pub(super) struct Played {
    pub(super) returns: Vec<i64>,
    pub(super) lengths: Vec<u32>,
}

/// How episodes are played.
#[derive(Debug, Clone, Copy)]
pub(super) struct Manner {
    /// Where actions are drawn, its count being that of the first step; `None`: the likeliest are taken.
    pub(super) drawn: Option<Place>,
    /// Steps after which nobody looks any more.
    pub(super) steps_max: u32,
}

impl Player {
    /// Takes observations into the statistics.
    pub(super) fn look(&mut self, shown: &Observations) {
        self.statistics.add(&shown.values);
        self.standard = self.statistics.freeze();
    }

    /// The drives of some environments.
    pub(super) fn codes(&mut self, shown: &Observations, which: &[usize], codes: &mut Vec<u8>) {
        for &which in which {
            self.coding.code(&self.standard, shown, which, codes);
        }
    }

    /// What environments are told by what was read last.
    pub(super) fn choose(&self, which: &[usize], drawn: Option<Place>) -> Chosen {
        match drawn {
            Some(place) => self.actor.drawn(&self.tables, place, which),
            None => self.actor.likeliest(&self.tables),
        }
    }

    /// Plays an episode in each environment; `seen` is told what was shown, and to whom.
    pub(super) fn play(
        &mut self,
        environments: &mut dyn VecEnv,
        manner: Manner,
        seen: &mut dyn FnMut(&Observations, &[usize]),
    ) -> Result<Played, EnvError> {
        let (mut shown, mut outcomes) = (Observations::default(), Outcomes::default());
        environments.reset(&mut shown);
        let count = environments.count();
        let mut played = Played { returns: vec![0; count], lengths: vec![0; count] };
        let mut live: Vec<usize> = (0..count).collect();
        let mut codes = Vec::new();
        for step in 0..manner.steps_max {
            codes.clear();
            self.codes(&shown, &live, &mut codes);
            seen(&shown, &live);
            let _ = self.actor.read(&codes);
            let later = |place: Place| Place { count: place.count + u64::from(step), ..place };
            let chosen = self.choose(&live, manner.drawn.map(later));
            environments.step(chosen.spread_to(&live, count).actions(), &mut outcomes)?;
            outcomes.check(&self.spec, count)?;
            for &which in &live {
                played.returns[which] += i64::from(outcomes.rewards[which].to_bits());
                played.lengths[which] += 1;
            }
            live.retain(|&which| !(outcomes.terminated[which] || outcomes.truncated[which]));
            if live.is_empty() {
                break;
            }
            std::mem::swap(&mut shown, &mut outcomes.next);
        }
        Ok(played)
    }
}

impl State for Player {
    fn visit(&mut self, visitor: &mut dyn Visitor) -> Result<(), StateError> {
        self.actor.visit(visitor)?;
        self.statistics.visit(visitor)?;
        self.standard = self.statistics.freeze();
        Ok(())
    }
}
