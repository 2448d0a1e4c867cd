//! What acts, remembers and learns, wherever observations come from: a native environment, a recorded stream, or a caller.
//!
//! ```text
//! act     drives of what is shown; the actor is read; an action is drawn for each environment
//! take    what came of it; after `horizon` steps the rollout is full
//! learn   the critic is read once for the whole rollout; advantages, targets; passes in minibatches, actor then critic;
//!         then the rollout joins the statistics that the next one is standardised by
//! ```
//!
//! Draws: exploration at site 7, sub = environment, count = step since the start, of continuous actions over `noise_steps`; order of steps at site 2, count = pass since
//! the start. See docs/MODEL.md, 5.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use super::actor::Chosen;
use super::critic::Critic;
use super::experiment::{PolicyExperiment, Ppo};
use super::outcome::PolicyEpoch;
use super::player::Player;
use super::rollout::Rollout;
use crate::chip::state::{Piece, Section, State, StateError, Visitor, visit_counts};
use crate::num::draw::{self, Place, Site};
use crate::num::fixed::narrow;
use crate::task::environment::{EnvError, Observations, Outcomes, Taken};

/// A policy that learns.
#[derive(Debug)]
pub(super) struct Agent {
    pub(super) player: Player,
    pub(super) critic: Critic,
    settings: Settings,
    /// What the environments show now.
    shown: Observations,
    /// Returns (16 fractional bits) and lengths of episodes that go on.
    going: Vec<[i64; 2]>,
    /// Steps of each environment, and passes, since the start.
    steps: u64,
    passes: u64,
    rollout: Rollout,
}

/// What an agent does with what it remembers.
#[derive(Debug, Clone, Copy)]
struct Settings {
    seed: u64,
    environments: usize,
    horizon: usize,
    minibatch: usize,
    ppo: Ppo,
}

/// Asked after every minibatch; false stops.
pub(super) type Next<'a> = &'a mut dyn FnMut() -> bool;

impl Agent {
    pub(super) fn new(
        experiment: &PolicyExperiment,
        ppo: Ppo,
        player: Player,
        critic: Critic,
    ) -> Self {
        let environments = experiment.environments as usize;
        Self {
            player,
            critic,
            settings: Settings {
                seed: experiment.seed,
                environments,
                horizon: experiment.horizon as usize,
                minibatch: experiment.actor.batch.get() as usize,
                ppo,
            },
            shown: Observations::default(),
            going: vec![[0; 2]; environments],
            steps: 0,
            passes: 0,
            rollout: Rollout::default(),
        }
    }

    /// What environments show at the beginning.
    pub(super) fn begin(&mut self, shown: &Observations) {
        self.shown.clone_from(shown);
    }

    /// What each environment is told to do now.
    pub(super) fn act(&mut self) -> Chosen {
        let Self { player, rollout, shown, settings, .. } = self;
        let from = rollout.codes.len();
        for which in 0..settings.environments {
            player.coding.code(&player.standard, shown, which, &mut rollout.codes);
        }
        rollout.shown.extend_from_slice(&shown.values);
        let _ = player.actor.read(&rollout.codes[from..]);
        let drawn = match player.spec.taken {
            Taken::Discrete(_) => self.steps,
            Taken::Continuous(_) => self.steps / u64::from(settings.ppo.noise_steps),
        };
        let place = Place::global(settings.seed, Site::Exploration, drawn);
        player.actor.act(&player.tables, place, rollout)
    }

    /// What came of that. `epoch` is told the return and length of every episode that ended. `idle` says who began an episode
    /// and did not act; nobody where it is empty.
    ///
    /// # Errors
    /// When the outcomes are not those of so many environments.
    pub(super) fn take(
        &mut self,
        outcomes: &Outcomes,
        idle: &[bool],
        epoch: &mut PolicyEpoch,
    ) -> Result<(), EnvError> {
        outcomes.check(&self.player.spec, self.settings.environments)?;
        outcomes.check_idle(&self.player.spec, idle)?;
        let first = self.rollout.len();
        for which in 0..self.settings.environments {
            if idle.get(which) == Some(&true) {
                self.rollout.idle.push(first + which);
                continue;
            }
            let [gained, length] = &mut self.going[which];
            *gained += i64::from(outcomes.rewards[which].to_bits());
            *length += 1;
            if outcomes.truncated[which] {
                self.rollout.stopped.push(first + which);
                let (player, codes) = (&mut self.player, &mut self.rollout.reached);
                player.codes(&outcomes.reached, &[which], codes);
            }
            if outcomes.truncated[which] || outcomes.terminated[which] {
                epoch.returns.add(*gained);
                epoch.lengths.add(*length);
                (*gained, *length) = (0, 0);
            }
        }
        self.rollout.rewards.extend_from_slice(&outcomes.rewards);
        self.rollout.terminated.extend_from_slice(&outcomes.terminated);
        self.rollout.truncated.extend_from_slice(&outcomes.truncated);
        self.shown.clone_from(&outcomes.next);
        self.steps += 1;
        Ok(())
    }

    /// Steps of each environment since the start.
    pub(super) const fn steps(&self) -> u64 {
        self.steps
    }

    /// Whether it is time to learn.
    pub(super) fn is_full(&self) -> bool {
        self.rollout.len() == self.settings.environments * self.settings.horizon
    }

    /// Learns from a full rollout and forgets it. False when `next` said to stop: the state then lies inside an update.
    pub(super) fn learn(&mut self, epoch: &mut PolicyEpoch, next: Next<'_>) -> bool {
        let Settings { seed, minibatch, ppo, environments, .. } = self.settings;
        let mut last = Vec::new();
        for which in 0..environments {
            self.player.codes(&self.shown, &[which], &mut last);
        }
        self.critic.judge(&mut self.rollout, &last, ppo, epoch);
        let steps = self.rollout.len();
        let rows = self.player.coding.rows();
        let Self { player, critic, rollout, .. } = self;
        let mut codes = Vec::new();
        for _ in 0..ppo.passes {
            let steps = narrow(steps, "a rollout has few steps");
            let mut order = draw::shuffled(seed, self.passes, steps);
            order.retain(|&step| rollout.acted(step as usize));
            self.passes += 1;
            for batch in order.chunks(minibatch) {
                codes.clear();
                for &step in batch {
                    let at = step as usize * rows;
                    codes.extend_from_slice(&rollout.codes[at..at + rows]);
                }
                player.actor.learn(&player.tables, &codes, batch, rollout, epoch);
                critic.learn(&codes, batch, rollout, epoch);
                if !next() {
                    return false;
                }
            }
        }
        player.statistics.add(&rollout.shown_to_actors(player.spec.values()));
        player.standard = player.statistics.freeze();
        rollout.clear();
        true
    }
}

impl State for Agent {
    fn visit(&mut self, visitor: &mut dyn Visitor) -> Result<(), StateError> {
        self.player.visit(visitor)?;
        self.critic.visit(visitor)?;
        let counts = [&mut self.steps, &mut self.passes];
        visit_counts(visitor, "policy.counts", Section::Task, counts.into_iter())?;
        let going: Vec<i64> = self.going.iter().flatten().copied().collect();
        let piece = Piece {
            name: "policy.going",
            section: Some(Section::Task),
            within: i64::MIN..=i64::MAX,
        };
        if let Some(going) = visitor.numbers(&piece, &going)? {
            self.going = going.as_chunks::<2>().0.to_vec();
            // a state is put back as it was between rollouts; who looks alone forgets nothing
            self.rollout.clear();
        }
        Ok(())
    }
}
