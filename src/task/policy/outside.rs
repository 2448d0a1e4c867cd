//! A policy that is trained from outside: a caller owns the environments, shows observations and hands over what came of actions.
//!
//! ```text
//! Begin   begin(shown)          what the environments show at the beginning of new episodes; once more after calibration
//! Act     take(outcomes)        actions for all of them, and what came of those: 256 steps of calibration, then a rollout
//! Learn   learn(go_on)          the rollout is full
//! Done                          all epochs are over
//! ```
//!
//! It does what [`PolicyTrainer`](super::PolicyTrainer) does with environments of this program, bit by bit. What is handed over
//! is checked before anything moves: an error leaves everything as it was, and the same turn is asked for again. See
//! docs/MODEL.md, 5.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use super::actor::Chosen;
use super::agent::Agent;
use super::experiment::{Method, PolicyExperiment};
use super::outcome::{PolicyEpoch, PolicyProgress};
use super::start;
use super::trainer::{ELSEWHERE, PolicyError, drawn_at};
use crate::chip::crossbar::kernel::Backend;
use crate::chip::engine::Phase;
use crate::chip::state::{Piece, Section, State, StateError, Visitor};
use crate::learn::driver::Driver;
use crate::learn::network::NetworkError;
use crate::num::draw::Place;
use crate::num::fixed::narrow;
use crate::task::environment::{Actions, EnvSpec, Observations, Outcomes, Taken};

/// What a [`PolicyLearner`] waits for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum PolicyTurn<'a> {
    /// Every environment begins a new episode, or goes on where a state was put back: [`PolicyLearner::begin`] is told what
    /// they show.
    Begin,
    /// Every environment takes its action: [`PolicyLearner::take`] is told what came of it.
    Act(Actions<'a>),
    /// [`PolicyLearner::learn`].
    Learn,
    /// Nothing: all epochs are over, or one was stopped.
    Done,
}

/// A policy in training whose environments are the caller's.
///
/// ```
/// use dalean::policy::{
///     Actions, EnvSpec, Observations, Outcomes, PolicyLearner, PolicyTurn, Real, Shown, Taken,
/// };
/// # #[cfg(not(feature = "lab"))] fn main() {}
/// # #[cfg(feature = "lab")]
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// use dalean::{Backend, Config, Sources};
///
/// // two environments that show two numbers and take one of two actions
/// let spec = EnvSpec {
///     id: "Mine-v0".into(),
///     shown: Shown::Dense(2),
///     taken: Taken::Discrete(2),
///     steps_max: 10,
///     inputs: vec![("number", 2)],
/// };
/// let text = "task = \"policy\"\n[environment]\ncount = 2\nhorizon = 16\nrollouts = 1\nsteps = 64\n\
///             [network]\nhidden = [8]\n[learning]\nbatch = 16";
/// let config = Config::load(&Sources { experiment: Some(("mine", text)), ..Sources::default() })?;
/// let experiment = config.policy_experiment()?.ok_or("a policy")?.facing(&spec);
/// let mut learner = PolicyLearner::new(experiment, spec, Backend::best())?;
///
/// let shown = Observations { values: vec![Real::ONE, Real::ZERO, Real::ZERO, Real::ONE], ..Default::default() };
/// let mut epochs = 0;
/// loop {
///     match learner.turn() {
///         PolicyTurn::Begin => learner.begin(&shown)?,
///         PolicyTurn::Act(Actions::Discrete(actions)) => {
///             // an action is worth its number; nothing ends
///             let rewards = actions.iter().map(|&action| Real::from_num(action)).collect();
///             let ends = vec![false; 2];
///             let (reached, next) = (shown.clone(), shown.clone());
///             learner.take(&Outcomes { reached, next, rewards, terminated: ends.clone(), truncated: ends })?;
///         }
///         PolicyTurn::Learn => epochs += u32::from(learner.learn(&mut |_progress| true)?.is_some()),
///         _ => break,
///     }
/// }
/// assert_eq!((epochs, learner.steps()), (2, 64));
/// // what it would do now
/// assert!(matches!(learner.answer(&shown, 0)?, Actions::Discrete([_, _])));
/// # Ok(())
/// # }
/// ```
#[derive(Debug)]
pub struct PolicyLearner {
    experiment: PolicyExperiment,
    agent: Agent,
    stage: Stage,
    told: PolicyEpoch,
    answered: Chosen,
}

/// Which turn it is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Due {
    Begin,
    Act,
    Learn,
    Nothing,
}

/// Where a training stands.
#[derive(Debug)]
enum Stage {
    /// Nothing was shown yet.
    Calibrate,
    /// Uniform actions are taken, and what is shown is kept.
    Explore { seen: Observations, shown: Observations, step: u64, chosen: Chosen },
    /// Episodes are to begin, or to go on.
    Begin,
    /// Actions are due, or were told.
    Act(Option<Chosen>),
    /// An epoch was stopped.
    Stopped,
}

impl PolicyLearner {
    /// Builds both networks for environments of this kind.
    ///
    /// # Errors
    /// When something does not fit; [`PolicyExperiment::facing`] fits an experiment to an environment.
    pub fn new(
        experiment: PolicyExperiment,
        spec: EnvSpec,
        backend: Backend,
    ) -> Result<Self, PolicyError> {
        let misfit = |key, found: &str, allowed| -> Result<_, PolicyError> {
            Err(NetworkError::misfit(key, found, allowed).into())
        };
        let Method::Ppo(ppo) = experiment.method else {
            let allowed = "evolution begins the episodes of its candidates itself, which takes environments of this \
                           program; use \"ed\", \"ed_non_dalean\", \"dfa\" or \"bp\"";
            return misfit("learning.rule", "is \"es\"", allowed);
        };
        if let Taken::Discrete(65_537..) = spec.taken {
            let allowed = "an action is one of 65536 at most";
            return misfit("environment.id", "has more actions", allowed);
        }
        let player = start::player(&experiment, spec, backend)?;
        let critic = start::critic(&experiment, backend)?;
        let agent = Agent::new(&experiment, ppo, player, critic);
        let (told, answered) = (PolicyEpoch::default(), Chosen::Discrete(vec![]));
        Ok(Self { experiment, agent, stage: Stage::Calibrate, told, answered })
    }

    /// Shares large operations among so many threads from now on; no bit depends on it.
    ///
    /// # Errors
    /// When the system gives no threads.
    pub fn set_threads(&mut self, threads: usize) -> std::io::Result<()> {
        self.networks_mut()
            .into_iter()
            .try_for_each(|network| network.engine_mut().set_threads(threads))
    }

    /// What decides the result.
    #[must_use]
    pub const fn experiment(&self) -> &PolicyExperiment {
        &self.experiment
    }

    /// What is acted on.
    #[must_use]
    pub const fn environment(&self) -> &EnvSpec {
        &self.agent.player.spec
    }

    /// Epochs in all.
    #[must_use]
    pub fn epochs(&self) -> u32 {
        self.experiment.epochs()
    }

    /// Epochs finished.
    #[must_use]
    pub fn epoch(&self) -> u32 {
        narrow(self.rollouts() / u64::from(self.experiment.rollouts), "as many as were checked")
    }

    /// Rollouts learnt from.
    fn rollouts(&self) -> u64 {
        let full = self.agent.steps() / u64::from(self.experiment.horizon);
        // one that is full is not yet learnt from
        full - u64::from(self.agent.is_full())
    }

    /// Steps of all environments in the rollouts that were learnt from.
    #[must_use]
    pub fn steps(&self) -> u64 {
        self.rollouts()
            * u64::from(self.experiment.horizon)
            * u64::from(self.experiment.environments)
    }

    const fn count(&self) -> usize {
        self.experiment.environments as usize
    }

    fn due(&self) -> Due {
        match self.stage {
            Stage::Stopped => Due::Nothing,
            _ if self.epoch() >= self.epochs() => Due::Nothing,
            Stage::Calibrate | Stage::Begin => Due::Begin,
            Stage::Act(_) if self.agent.is_full() => Due::Learn,
            Stage::Explore { .. } | Stage::Act(_) => Due::Act,
        }
    }

    /// What it waits for: asked again, the same.
    pub fn turn(&mut self) -> PolicyTurn<'_> {
        match self.due() {
            Due::Begin => PolicyTurn::Begin,
            Due::Learn => PolicyTurn::Learn,
            Due::Nothing => PolicyTurn::Done,
            Due::Act => match &mut self.stage {
                Stage::Explore { chosen, .. } => PolicyTurn::Act(chosen.actions()),
                Stage::Act(chosen) => {
                    let agent = &mut self.agent;
                    PolicyTurn::Act(chosen.get_or_insert_with(|| agent.act()).actions())
                }
                _ => unreachable!("actions are due in these stages alone"),
            },
        }
    }

    /// What all environments show at the beginning.
    ///
    /// # Errors
    /// When it is not their turn, or this is not what such environments show. Nothing has moved then.
    pub fn begin(&mut self, shown: &Observations) -> Result<(), PolicyError> {
        shown.check(self.environment(), self.count())?;
        match self.stage {
            Stage::Calibrate => {
                self.stage = self.exploring(Observations::default(), shown.clone(), 0);
            }
            Stage::Begin => {
                self.agent.begin(shown);
                self.stage = Stage::Act(None);
            }
            _ => return self.out_of_turn("begin"),
        }
        Ok(())
    }

    fn exploring(&self, seen: Observations, shown: Observations, step: u64) -> Stage {
        let (taken, seed) = (self.environment().taken, self.experiment.seed);
        let chosen = start::uniform(taken, self.count(), seed, step);
        Stage::Explore { seen, shown, step, chosen }
    }

    /// What came of the actions, in every environment. Of one whose episode ended, `reached` is what it ended with and `next`
    /// what its next one begins with; of all others both are the same.
    ///
    /// # Errors
    /// When it is not their turn, or these are not outcomes of such environments. Nothing has moved then: the actions are still
    /// those to take.
    pub fn take(&mut self, outcomes: &Outcomes) -> Result<(), PolicyError> {
        self.take_idle(outcomes, &[])
    }

    /// As [`PolicyLearner::take`], of environments that begin their next episode in the step after the one that ended: `idle` says
    /// which of them did so now. Nobody acted there, so nothing is learnt from it, nor counted as a step of an episode; it is one
    /// of the rollout.
    ///
    /// # Errors
    /// As [`PolicyLearner::take`], and when one that was idle ended or earned something.
    pub fn take_idle(&mut self, outcomes: &Outcomes, idle: &[bool]) -> Result<(), PolicyError> {
        outcomes.check(self.environment(), self.count())?;
        outcomes.check_idle(self.environment(), idle)?;
        match &mut self.stage {
            Stage::Explore { seen, shown, step, .. } => {
                for which in 0..self.experiment.environments as usize {
                    if idle.get(which) != Some(&true) {
                        seen.append_one(shown, which, &self.agent.player.spec);
                    }
                }
                let (seen, step) = (std::mem::take(seen), *step + 1);
                if seen.count(&self.agent.player.spec) < start::CALIBRATION {
                    self.stage = self.exploring(seen, outcomes.next.clone(), step);
                } else {
                    self.calibrate(&seen);
                    self.stage = Stage::Begin;
                }
                Ok(())
            }
            Stage::Act(chosen @ Some(_)) => {
                self.agent.take(outcomes, idle, &mut self.told)?;
                *chosen = None;
                Ok(())
            }
            _ => self.out_of_turn("take"),
        }
    }

    fn calibrate(&mut self, seen: &Observations) {
        let codes = start::look(&mut self.agent.player, seen);
        for network in self.networks_mut() {
            let _ = network.engine_mut().calibrate(&codes);
        }
    }

    /// Learns from a full rollout; what came of the epoch, if that was its last one. `go_on` is asked after every update.
    ///
    /// # Errors
    /// When it is not its turn, or `go_on` said to stop: the state then lies inside an update, and only one that is put back
    /// goes on.
    pub fn learn(
        &mut self,
        go_on: &mut dyn FnMut(PolicyProgress) -> bool,
    ) -> Result<Option<PolicyEpoch>, PolicyError> {
        if self.due() != Due::Learn {
            return self.out_of_turn("learn");
        }
        let (epoch, epochs) = (self.epoch(), self.epochs());
        let rollouts = u64::from(self.experiment.rollouts);
        let steps_total = self.experiment.steps_per_epoch();
        let steps = steps_total / rollouts * (self.rollouts() % rollouts + 1);
        let returns = [self.told.returns.count as i64, self.told.returns.sum];
        let progress = PolicyProgress { epoch, epochs, steps, steps_total, returns };
        if !self.agent.learn(&mut self.told, &mut || go_on(progress)) {
            self.stage = Stage::Stopped;
            return Err(PolicyError::Stopped);
        }
        if steps < steps_total {
            return Ok(None);
        }
        let mut told = std::mem::take(&mut self.told);
        told.steps = self.steps();
        told.log_sigma = self.agent.player.actor.log_sigma().to_vec();
        Ok(Some(told))
    }

    /// What it does when it is shown this in step number `step` of episodes that are not learnt from; charged to evaluation.
    /// The likeliest actions, or drawn ones, as the experiment says.
    ///
    /// # Errors
    /// When this is not what so many environments show.
    pub fn answer(&mut self, shown: &Observations, step: u64) -> Result<Actions<'_>, PolicyError> {
        shown.check(self.environment(), self.count())?;
        let engine = self.agent.player.actor.driver.engine_mut();
        let phase = engine.phase();
        engine.set_phase(Phase::Evaluation);
        let which = Vec::from_iter(0..self.count());
        let player = &mut self.agent.player;
        let mut codes = Vec::new();
        player.codes(shown, &which, &mut codes);
        let _ = player.actor.read(&codes);
        let drawn = Place { count: step, ..drawn_at(self.experiment.seed ^ ELSEWHERE) };
        let drawn = (!self.experiment.evaluation.deterministic).then_some(drawn);
        self.answered = player.choose(&which, drawn);
        player.actor.driver.engine_mut().set_phase(phase);
        Ok(self.answered.actions())
    }

    fn out_of_turn<T>(&self, call: &'static str) -> Result<T, PolicyError> {
        let allowed = match self.due() {
            Due::Begin => "`begin` tells it first what the environments show",
            Due::Act => "`turn` says which actions are taken, and `take` what came of them",
            Due::Learn => "the rollout is full: call `learn`",
            Due::Nothing => "no epoch is left, or one was stopped",
        };
        Err(PolicyError::Turn { call, allowed })
    }

    /// Actor, then critic.
    #[must_use]
    pub fn networks(&self) -> Vec<&Driver> {
        vec![&self.agent.player.actor.driver, &self.agent.critic.driver]
    }

    fn networks_mut(&mut self) -> Vec<&mut Driver> {
        vec![&mut self.agent.player.actor.driver, &mut self.agent.critic.driver]
    }
}

impl State for PolicyLearner {
    fn visit(&mut self, visitor: &mut dyn Visitor) -> Result<(), StateError> {
        let epoch = i64::from(self.epoch());
        let within = 0..=i64::from(self.epochs());
        let piece = Piece { name: "epoch", section: Some(Section::Progress), within };
        let put_back = visitor.numbers(&piece, &[epoch])?.is_some();
        self.agent.visit(visitor)?;
        if put_back {
            // environments are not part of it: they show where they are
            (self.stage, self.told) = (Stage::Begin, PolicyEpoch::default());
        }
        Ok(())
    }
}
