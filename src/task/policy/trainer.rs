//! A training in native environments: rollouts, updates, and episodes without learning.
//!
//! ```text
//! calibration   uniform actions; both networks' converters look at what they lead to; then all begin anew
//! epoch         `rollouts` rollouts with their updates, or so many generations
//! evaluation    environments of their own, whose seed has its highest bit turned: the same episodes at every look
//! ```
//!
//! Actions of episodes without learning that are drawn are drawn at site 7, pathway 2. See docs/MODEL.md, 5.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use super::agent::Agent;
use super::evolution::Evolver;
use super::experiment::{Method, PolicyExperiment};
use super::outcome::{PolicyEpoch, PolicyEvaluation, PolicyProgress, WatchedStep};
use super::player::{Manner, Player};
use super::start;
use crate::chip::crossbar::kernel::Backend;
use crate::chip::engine::Phase;
use crate::chip::state::{Piece, Section, State, StateError, Visitor};
use crate::learn::driver::Driver;
use crate::learn::network::NetworkError;
use crate::learn::statistics::{self, FloorMap, PathwayRecord};
use crate::num::draw::{Place, Site};
use crate::task::environment::{
    self, EnvError, EnvSource, EnvSpec, Observations, Outcomes, Purpose, Record,
    UnknownEnvironment, VecEnv,
};

/// What distinguishes the environments of evaluation.
pub(super) const ELSEWHERE: u64 = 1 << 63;

/// Why a policy cannot be trained, or not further.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum PolicyError {
    /// A network that does not fit.
    #[error(transparent)]
    Network(#[from] NetworkError),
    /// An environment that nobody knows.
    #[error(transparent)]
    Unknown(#[from] UnknownEnvironment),
    /// An environment that cannot go on. The state is that before the step.
    #[error(transparent)]
    Environment(#[from] EnvError),
    /// Something that is not waited for now. Nothing has moved.
    #[error("`{call}` is called out of turn; {allowed}")]
    Turn {
        /// What was called.
        call: &'static str,
        /// What is to be called.
        allowed: &'static str,
    },
    /// Stopped by the caller inside an epoch, or no epoch is left.
    #[error("stopped")]
    Stopped,
}

/// A training in progress.
#[derive(Debug)]
pub struct PolicyTrainer {
    experiment: PolicyExperiment,
    source: EnvSource,
    learner: Learner,
    environments: Box<dyn VecEnv>,
    outcomes: Outcomes,
    start: Vec<FloorMap>,
    epoch: u32,
}

/// Who learns.
#[derive(Debug)]
enum Learner {
    Ppo(Box<Agent>),
    Evolution(Box<Evolver>),
}

impl Learner {
    fn player(&mut self) -> &mut Player {
        match self {
            Self::Ppo(agent) => &mut agent.player,
            Self::Evolution(evolver) => &mut evolver.player,
        }
    }

    const fn spec(&self) -> &EnvSpec {
        match self {
            Self::Ppo(agent) => &agent.player.spec,
            Self::Evolution(evolver) => &evolver.player.spec,
        }
    }

    fn networks(&self) -> Vec<&Driver> {
        match self {
            Self::Ppo(agent) => vec![&agent.player.actor.driver, &agent.critic.driver],
            Self::Evolution(evolver) => vec![&evolver.player.actor.driver],
        }
    }

    /// Reads are charged to evaluation from now on; what they were charged to.
    fn look(&mut self) -> Vec<Phase> {
        let phase = |driver: &mut Driver| {
            let (phase, engine) = (driver.engine().phase(), driver.engine_mut());
            let _ = (engine.take_currents(), engine.take_mute());
            engine.set_phase(Phase::Evaluation);
            phase
        };
        self.networks_mut().into_iter().map(phase).collect()
    }

    fn go_back_to(&mut self, phases: &[Phase]) {
        let networks = self.networks_mut().into_iter().zip(phases);
        networks.for_each(|(driver, &phase)| driver.engine_mut().set_phase(phase));
    }

    fn networks_mut(&mut self) -> Vec<&mut Driver> {
        match self {
            Self::Ppo(agent) => vec![&mut agent.player.actor.driver, &mut agent.critic.driver],
            Self::Evolution(evolver) => vec![&mut evolver.player.actor.driver],
        }
    }
}

impl PolicyTrainer {
    /// Builds the networks with their initial levels and the environments, and finds ranges of converters.
    ///
    /// # Errors
    /// When something does not fit.
    pub fn new(
        experiment: PolicyExperiment,
        backend: Backend,
        source: EnvSource,
    ) -> Result<Self, PolicyError> {
        let (id, count) = (&experiment.environment, experiment.environments as usize);
        let environments = source.make(id, experiment.seed, count, Purpose::Training)?;
        let player = start::player(&experiment, environments.spec().clone(), backend)?;
        let learner = match experiment.method {
            Method::Ppo(ppo) => {
                let critic = start::critic(&experiment, backend)?;
                Learner::Ppo(Box::new(Agent::new(&experiment, ppo, player, critic)))
            }
            Method::Evolution(law) => {
                let evolver = Evolver::new(&experiment, law, player, source.clone());
                Learner::Evolution(Box::new(evolver))
            }
        };
        let start = learner.networks().into_iter();
        let start = start.map(|driver| statistics::floor_map(driver.engine())).collect();
        let outcomes = Outcomes::default();
        let mut this =
            Self { experiment, source, learner, environments, outcomes, start, epoch: 0 };
        this.calibrate()?;
        Ok(this)
    }

    /// Looks at what uniform actions lead to, and begins anew.
    fn calibrate(&mut self) -> Result<(), PolicyError> {
        let Self { experiment, learner, environments, outcomes, .. } = self;
        let count = environments.count();
        let mut seen = Observations::default();
        let mut shown = Observations::default();
        environments.reset(&mut shown);
        for step in 0..start::steps(count) {
            seen.append(&shown);
            let actions = start::uniform(learner.spec().taken, count, experiment.seed, step);
            environments.step(actions.actions(), outcomes)?;
            std::mem::swap(&mut shown, &mut outcomes.next);
        }
        let codes = start::look(learner.player(), &seen);
        for driver in learner.networks_mut() {
            let _ = driver.engine_mut().calibrate(&codes);
        }
        environments.reset(&mut shown);
        if let Learner::Ppo(agent) = learner {
            agent.begin(&shown);
        }
        Ok(())
    }

    /// What decides the result.
    #[must_use]
    pub const fn experiment(&self) -> &PolicyExperiment {
        &self.experiment
    }

    /// What is acted on.
    #[must_use]
    pub const fn environment(&self) -> &EnvSpec {
        self.learner.spec()
    }

    /// Epochs in all.
    #[must_use]
    pub fn epochs(&self) -> u32 {
        self.experiment.epochs()
    }

    /// Epochs finished.
    #[must_use]
    pub const fn epoch(&self) -> u32 {
        self.epoch
    }

    /// Steps of all environments that were learnt from in the epochs that are finished.
    #[must_use]
    pub fn steps(&self) -> u64 {
        match &self.learner {
            Learner::Ppo(_) => u64::from(self.epoch) * self.experiment.steps_per_epoch(),
            Learner::Evolution(evolver) => evolver.steps,
        }
    }

    /// Steps (at most, of evolution) and updates (of each network) of an epoch.
    #[must_use]
    pub fn epoch_size(&self) -> (u64, u64) {
        let epochs = u64::from(self.epochs());
        (self.experiment.steps_per_epoch(), self.experiment.updates() / epochs)
    }

    /// One epoch.
    ///
    /// # Errors
    /// When `go_on` says to stop (asked after every update, or pair of candidates), no epoch is left, or the environment
    /// cannot go on.
    pub fn learn(
        &mut self,
        go_on: &mut dyn FnMut(PolicyProgress) -> bool,
    ) -> Result<PolicyEpoch, PolicyError> {
        let (epoch, epochs) = (self.epoch, self.epochs());
        if epoch >= epochs {
            return Err(PolicyError::Stopped);
        }
        let steps_total = self.experiment.steps_per_epoch();
        let Self { experiment, learner, environments, outcomes, .. } = self;
        let mut told = PolicyEpoch::default();
        let progress = |steps, told: &PolicyEpoch| {
            let returns = [told.returns.count as i64, told.returns.sum];
            PolicyProgress { epoch, epochs, steps, steps_total, returns }
        };
        for rollout in 1..=experiment.rollouts {
            let steps = steps_total / u64::from(experiment.rollouts) * u64::from(rollout);
            let went_on = match &mut *learner {
                Learner::Ppo(agent) => {
                    while !agent.is_full() {
                        let chosen = agent.act();
                        environments.step(chosen.actions(), outcomes)?;
                        agent.take(outcomes, &[], &mut told)?;
                    }
                    let progress = progress(steps, &told);
                    agent.learn(&mut told, &mut || go_on(progress))
                }
                Learner::Evolution(evolver) => {
                    let progress = progress(steps, &told);
                    evolver.evolve(&mut told, &mut || go_on(progress))?
                }
            };
            if !went_on {
                return Err(PolicyError::Stopped);
            }
        }
        self.epoch += 1;
        told.steps = self.steps();
        told.log_sigma = self.learner.player().actor.log_sigma().to_vec();
        Ok(told)
    }

    /// Episodes without learning, from environments of their own; charged to evaluation.
    ///
    /// # Errors
    /// When the environment cannot go on.
    pub fn evaluate(&mut self, episodes: u32) -> Result<PolicyEvaluation, PolicyError> {
        let Self { experiment, source, learner, .. } = self;
        let phases = learner.look();
        let mut told = PolicyEvaluation::default();
        if episodes > 0 {
            let seed = experiment.seed ^ ELSEWHERE;
            let count = episodes as usize;
            let id = &experiment.environment;
            let mut environments = source.make(id, seed, count, Purpose::Evaluation)?;
            let drawn = (!experiment.evaluation.deterministic).then_some(drawn_at(seed));
            let manner = Manner { drawn, steps_max: u32::MAX };
            let played = learner.player().play(&mut *environments, manner, &mut |_, _| {})?;
            (told.returns, told.lengths) = (played.returns, played.lengths);
        }
        for driver in learner.networks_mut() {
            let engine = driver.engine_mut();
            told.currents.extend(engine.take_currents());
            told.mute.extend(engine.take_mute());
        }
        learner.go_back_to(&phases);
        Ok(told)
    }

    /// Watches an episode of the evaluation, and is charged to it. False stops.
    ///
    /// # Errors
    /// When the environment cannot go on.
    pub fn watch(
        &mut self,
        episode: u32,
        look: &mut dyn FnMut(&WatchedStep) -> bool,
    ) -> Result<(), PolicyError> {
        let Self { experiment, learner, .. } = self;
        let (which, seed) = (episode as usize, experiment.seed ^ ELSEWHERE);
        let mut environments = environment::make(&experiment.environment, seed, which + 1)?;
        let (mut shown, mut outcomes) = (Observations::default(), Outcomes::default());
        environments.reset(&mut shown);
        let phases = learner.look();
        let mut codes = Vec::new();
        for step in 0.. {
            codes.clear();
            let player = learner.player();
            player.codes(&shown, &[which], &mut codes);
            let actor = player.actor.read(&codes).iter().map(|out| out.to_bits().into()).collect();
            let drawn = Place { count: step.into(), ..drawn_at(seed) };
            let drawn = (!experiment.evaluation.deterministic).then_some(drawn);
            let chosen = player.choose(&[which], drawn);
            let value = match learner {
                Learner::Ppo(agent) => agent.critic.values(&codes)[0].to_bits().into(),
                Learner::Evolution(_) => 0,
            };
            let picture = environments.picture(which);
            let all = chosen.spread_to(&[which], which + 1);
            environments.step(all.actions(), &mut outcomes)?;
            let watched = WatchedStep {
                step,
                picture,
                shown: shown.numbers_of(which, learner.spec()),
                action: chosen.numbers(),
                actor,
                value,
                reward: outcomes.rewards[which].to_bits().into(),
            };
            let ended = outcomes.terminated[which] || outcomes.truncated[which];
            if !look(&watched) || ended {
                break;
            }
            std::mem::swap(&mut shown, &mut outcomes.next);
        }
        learner.go_back_to(&phases);
        Ok(())
    }

    /// What environments showed since the last call, or the beginning; nothing unless it is recorded.
    pub fn take_record(&mut self) -> Option<Record> {
        match &self.source {
            EnvSource::Recorded(record) => Some(Record::take(record, &mut *self.environments)),
            EnvSource::Native | EnvSource::Replayed(_) => None,
        }
    }

    /// Actor, then critic.
    #[must_use]
    pub fn networks(&self) -> Vec<&Driver> {
        self.learner.networks()
    }

    /// The same, to set what changes no result, or to restore.
    pub fn networks_mut(&mut self) -> Vec<&mut Driver> {
        self.learner.networks_mut()
    }

    /// Statistics of every pathway of both networks.
    #[must_use]
    pub fn pathways(&self) -> Vec<PathwayRecord> {
        let networks = self.networks().into_iter().zip(&self.start);
        networks.flat_map(|(driver, start)| statistics::pathways(driver.engine(), start)).collect()
    }
}

/// Where the actions of an episode are drawn that is not learnt from.
pub(super) const fn drawn_at(seed: u64) -> Place {
    Place { pathway: 2, ..Place::global(seed, Site::Exploration, 0) }
}

impl State for PolicyTrainer {
    fn visit(&mut self, visitor: &mut dyn Visitor) -> Result<(), StateError> {
        let within = 0..=i64::from(self.epochs());
        let piece = Piece { name: "epoch", section: Some(Section::Progress), within };
        if let Some(epoch) = visitor.numbers(&piece, &[i64::from(self.epoch)])? {
            self.epoch = u32::try_from(epoch[0]).expect("a visitor keeps to the range");
        }
        match &mut self.learner {
            Learner::Ppo(agent) => agent.visit(visitor)?,
            Learner::Evolution(evolver) => evolver.visit(visitor)?,
        }
        self.environments.visit(visitor)?;
        self.environments.show(&mut self.outcomes.next);
        if let Learner::Ppo(agent) = &mut self.learner {
            agent.begin(&self.outcomes.next);
        }
        Ok(())
    }
}
