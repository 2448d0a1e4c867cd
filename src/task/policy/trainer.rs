//! A training in native environments: rollouts, updates, and episodes without learning.
//!
//! ```text
//! calibration   256 steps in all under uniform actions; both networks' converters look at them; then all begin anew
//! epoch         `rollouts` rollouts with their updates
//! evaluation    environments of their own, whose seed has its highest bit turned: the same episodes at every look
//! ```
//!
//! Draws beside those of [`Agent`]: uniform actions at site 7, pathway 1, sub = environment, count = step; drawn actions of
//! episodes without learning at pathway 2. See docs/MODEL.md, 5.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use super::actor::Actor;
use super::agent::{Agent, Chosen};
use super::critic::Critic;
use super::experiment::{Method, PolicyExperiment};
use super::outcome::{PolicyEpoch, PolicyEvaluation, PolicyProgress, WatchedStep};
use crate::chip::crossbar::kernel::Backend;
use crate::chip::engine::Phase;
use crate::chip::state::{Piece, Section, State, StateError, Visitor};
use crate::learn::driver::Driver;
use crate::learn::network::{NetworkError, NetworkPlace, NetworkSpec};
use crate::learn::statistics::{self, FloorMap, PathwayRecord};
use crate::num::draw::{Place, Site, below};
use crate::num::fixed::narrow;
use crate::task::environment::{
    self, EnvError, EnvSpec, Observations, Outcomes, Real, Taken, UnknownEnvironment, VecEnv,
};

/// Steps whose observations are looked at before anything is learnt.
const CALIBRATION: usize = 256;
/// What distinguishes the environments of evaluation.
const ELSEWHERE: u64 = 1 << 63;

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
    /// Stopped by the caller inside an epoch, or no epoch is left.
    #[error("stopped")]
    Stopped,
}

/// A training in progress.
#[derive(Debug)]
pub struct PolicyTrainer {
    experiment: PolicyExperiment,
    agent: Agent,
    environments: Box<dyn VecEnv>,
    outcomes: Outcomes,
    start: [FloorMap; 2],
    epoch: u32,
}

impl PolicyTrainer {
    /// Builds the networks with their initial levels and the environments, and finds ranges of converters.
    ///
    /// # Errors
    /// When something does not fit.
    pub fn new(experiment: PolicyExperiment, backend: Backend) -> Result<Self, PolicyError> {
        let Method::Ppo(ppo) = experiment.method else { unimplemented!("evolution") };
        let count = experiment.environments as usize;
        let environments = environment::make(&experiment.environment, experiment.seed, count)?;
        let spec = environments.spec().clone();
        experiment.check(&spec)?;
        let first_layer = narrow(experiment.actor.layers.len(), "at most 64 layers");
        let build = |network: &NetworkSpec, first_layer| {
            let updates = experiment.updates();
            let place = NetworkPlace { seed: experiment.seed, first_layer, updates };
            network.build(&experiment.hardware, backend, place)
        };
        let actor = Actor::new(build(&experiment.actor, 0)?, spec.taken, ppo);
        let critic = Critic::new(build(&experiment.critic, first_layer)?);
        let start = [&actor.driver, &critic.driver];
        let start = start.map(|driver| statistics::floor_map(driver.engine()));
        let agent = Agent::new(&experiment, ppo, spec, actor, critic);
        let outcomes = Outcomes::default();
        let mut this = Self { experiment, agent, environments, outcomes, start, epoch: 0 };
        this.calibrate()?;
        Ok(this)
    }

    /// Looks at what uniform actions lead to, and begins anew.
    fn calibrate(&mut self) -> Result<(), PolicyError> {
        let Self { experiment, agent, environments, outcomes, .. } = self;
        let count = environments.count();
        let mut seen = Observations::default();
        let mut shown = Observations::default();
        environments.reset(&mut shown);
        for step in 0..CALIBRATION.div_ceil(count) as u64 {
            seen.append(&shown);
            let place = Place::global(experiment.seed, Site::Exploration, step);
            let actions = uniform(agent.spec.taken, count, place);
            environments.step(actions.actions(), outcomes)?;
            shown.clone_from(&outcomes.next);
        }
        agent.look(&seen);
        let mut codes = Vec::new();
        for which in 0..CALIBRATION {
            agent.coding.code(&agent.standard, &seen, which, &mut codes);
        }
        for driver in [&mut agent.actor.driver, &mut agent.critic.driver] {
            let _ = driver.engine_mut().calibrate(&codes);
        }
        environments.reset(&mut shown);
        agent.begin(&shown);
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
        &self.agent.spec
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

    /// Steps and updates (of each network) of an epoch.
    #[must_use]
    pub fn epoch_size(&self) -> (u64, u64) {
        let epochs = u64::from(self.epochs());
        (self.experiment.steps_per_epoch(), self.experiment.updates() / epochs)
    }

    /// One epoch.
    ///
    /// # Errors
    /// When `go_on` says to stop (asked after every update), no epoch is left, or the environment cannot go on.
    pub fn learn(
        &mut self,
        go_on: &mut dyn FnMut(PolicyProgress) -> bool,
    ) -> Result<PolicyEpoch, PolicyError> {
        let (epoch, epochs) = (self.epoch, self.epochs());
        if epoch >= epochs {
            return Err(PolicyError::Stopped);
        }
        let steps_total = self.experiment.steps_per_epoch();
        let Self { experiment, agent, environments, outcomes, .. } = self;
        let mut told = PolicyEpoch::default();
        let mut steps = 0;
        for _ in 0..experiment.rollouts {
            while !agent.is_full() {
                let chosen = agent.act();
                environments.step(chosen.actions(), outcomes)?;
                agent.take(outcomes, &mut told)?;
                steps += environments.count() as u64;
            }
            let (sum, count) = (told.returns.sum, told.returns.count as i64);
            let progress =
                PolicyProgress { epoch, epochs, steps, steps_total, returns: [count, sum] };
            if !agent.learn(&mut told, &mut || go_on(progress)) {
                return Err(PolicyError::Stopped);
            }
        }
        self.epoch += 1;
        told.steps = u64::from(self.epoch) * steps_total;
        told.log_sigma = self.agent.actor.log_sigma().to_vec();
        Ok(told)
    }

    /// Episodes without learning, from environments of their own; charged to evaluation.
    ///
    /// # Errors
    /// When the environment cannot go on.
    pub fn evaluate(&mut self, episodes: u32) -> Result<PolicyEvaluation, PolicyError> {
        let Self { experiment, agent, .. } = self;
        let networks = [&mut agent.actor.driver, &mut agent.critic.driver];
        let phases = networks.map(|driver| {
            let (phase, engine) = (driver.engine().phase(), driver.engine_mut());
            let _ = (engine.take_currents(), engine.take_mute());
            engine.set_phase(Phase::Evaluation);
            phase
        });
        let count = episodes as usize;
        let mut told = PolicyEvaluation {
            returns: vec![0; count],
            lengths: vec![0; count],
            ..PolicyEvaluation::default()
        };
        if count > 0 {
            let seed = experiment.seed ^ ELSEWHERE;
            let mut environments = environment::make(&experiment.environment, seed, count)?;
            let deterministic = experiment.evaluation.deterministic;
            play(agent, &mut *environments, (seed, deterministic), &mut told)?;
        }
        let networks = [&mut agent.actor.driver, &mut agent.critic.driver];
        for (driver, phase) in networks.into_iter().zip(phases) {
            let engine = driver.engine_mut();
            told.currents.extend(engine.take_currents());
            told.mute.extend(engine.take_mute());
            engine.set_phase(phase);
        }
        Ok(told)
    }

    /// Watches an episode of the evaluation. False stops.
    ///
    /// # Errors
    /// When the environment cannot go on.
    pub fn watch(
        &mut self,
        episode: u32,
        look: &mut dyn FnMut(&WatchedStep) -> bool,
    ) -> Result<(), PolicyError> {
        let Self { experiment, agent, .. } = self;
        let (which, seed) = (episode as usize, experiment.seed ^ ELSEWHERE);
        let mut environments = environment::make(&experiment.environment, seed, which + 1)?;
        let (mut shown, mut outcomes) = (Observations::default(), Outcomes::default());
        environments.reset(&mut shown);
        let mut codes = Vec::new();
        for step in 0.. {
            codes.clear();
            agent.coding.code(&agent.standard, &shown, which, &mut codes);
            let actor = agent.actor.read(&codes).iter().map(|out| out.to_bits().into()).collect();
            let chosen = if experiment.evaluation.deterministic {
                agent.actor.likeliest(&agent.tables)
            } else {
                agent.actor.drawn(&agent.tables, drawn_at(seed, step), &[which])
            };
            let value = agent.critic.values(&codes)[0].to_bits().into();
            let all = chosen.spread_to(&[which], which + 1);
            let picture = environments.picture(which);
            environments.step(all.actions(), &mut outcomes)?;
            let watched = WatchedStep {
                step,
                picture,
                shown: shown.numbers_of(which, &agent.spec),
                action: chosen.numbers(),
                actor,
                value,
                reward: outcomes.rewards[which].to_bits().into(),
            };
            let ended = outcomes.terminated[which] || outcomes.truncated[which];
            if !look(&watched) || ended {
                break;
            }
            shown.clone_from(&outcomes.next);
        }
        Ok(())
    }

    /// Actor, then critic.
    #[must_use]
    pub fn networks(&self) -> Vec<&Driver> {
        vec![&self.agent.actor.driver, &self.agent.critic.driver]
    }

    /// The same, to set what changes no result, or to restore.
    pub fn networks_mut(&mut self) -> Vec<&mut Driver> {
        vec![&mut self.agent.actor.driver, &mut self.agent.critic.driver]
    }

    /// Statistics of every pathway of both networks.
    #[must_use]
    pub fn pathways(&self) -> Vec<PathwayRecord> {
        let networks = self.networks().into_iter().zip(&self.start);
        networks.flat_map(|(driver, start)| statistics::pathways(driver.engine(), start)).collect()
    }
}

/// Where an action is drawn that is not learnt from.
const fn drawn_at(seed: u64, step: u32) -> Place {
    Place { pathway: 2, ..Place::global(seed, Site::Exploration, step as u64) }
}

/// Plays an episode in each environment.
fn play(
    agent: &mut Agent,
    environments: &mut dyn VecEnv,
    (seed, deterministic): (u64, bool),
    told: &mut PolicyEvaluation,
) -> Result<(), PolicyError> {
    let (mut shown, mut outcomes) = (Observations::default(), Outcomes::default());
    environments.reset(&mut shown);
    let count = environments.count();
    let mut live: Vec<usize> = (0..count).collect();
    let mut codes = Vec::new();
    for step in 0.. {
        codes.clear();
        for &which in &live {
            agent.coding.code(&agent.standard, &shown, which, &mut codes);
        }
        let _ = agent.actor.read(&codes);
        let chosen = if deterministic {
            agent.actor.likeliest(&agent.tables)
        } else {
            agent.actor.drawn(&agent.tables, drawn_at(seed, step), &live)
        };
        environments.step(chosen.spread_to(&live, count).actions(), &mut outcomes)?;
        for &which in &live {
            told.returns[which] += i64::from(outcomes.rewards[which].to_bits());
            told.lengths[which] += 1;
        }
        live.retain(|&which| !(outcomes.terminated[which] || outcomes.truncated[which]));
        if live.is_empty() {
            break;
        }
        shown.clone_from(&outcomes.next);
    }
    Ok(())
}

/// Any action, each as likely as another: from the first word, or words, of the environment.
fn uniform(taken: Taken, count: usize, place: Place) -> Chosen {
    let words = |environment: u32| Place { pathway: 1, sub: environment, ..place }.words();
    let environments = 0..narrow(count, "at most 1024");
    match taken {
        Taken::Discrete(actions) => {
            let bound = narrow(actions, "an action has 16 bits");
            let one = |environment| {
                let word = words(environment).next().expect("the stream has no end");
                narrow(below(word, bound), "an action has 16 bits")
            };
            Chosen::Discrete(environments.map(one).collect())
        }
        Taken::Continuous(values) => {
            // from -1 to 1 in steps of 2^-16
            let one = |word: u32| {
                Real::from_bits(narrow(
                    i64::from(below(word, (2 << 16) + 1)) - (1 << 16),
                    "17 bits",
                ))
            };
            Chosen::Continuous(environments.flat_map(|e| words(e).take(values).map(one)).collect())
        }
    }
}

impl State for PolicyTrainer {
    fn visit(&mut self, visitor: &mut dyn Visitor) -> Result<(), StateError> {
        let within = 0..=i64::from(self.epochs());
        let piece = Piece { name: "epoch", section: Some(Section::Progress), within };
        if let Some(epoch) = visitor.numbers(&piece, &[i64::from(self.epoch)])? {
            self.epoch = u32::try_from(epoch[0]).expect("a visitor keeps to the range");
        }
        self.agent.visit(visitor)?;
        self.environments.visit(visitor)?;
        self.environments.show(&mut self.outcomes.next);
        self.agent.begin(&self.outcomes.next);
        Ok(())
    }
}
