//! A policy as a task: epochs of rollouts and updates, episodes without learning, and the final test.
#![expect(
    clippy::disallowed_types,
    reason = "wall-clock seconds are shown to people, never compared"
)]

use std::time::Instant;

use super::task::{GoOn, Progress, Task, Told};
use super::{Machine, RunError};
use crate::chip::state::State;
use crate::lab::store::record::{
    EpisodesRecord, Note, Outcome, PolicyOutcome, PolicyTest, RETURN_BITS, SumRecord, TestOutcome,
};
use crate::learn::driver::Driver;
use crate::learn::statistics::PathwayRecord;
use crate::task::environment::{EnvSource, Record};
use crate::task::policy::{
    Method, PolicyEpoch, PolicyError, PolicyExperiment, PolicyProgress, PolicyTrainer, WatchedStep,
};

/// A training of a policy.
#[derive(Debug)]
pub(super) struct Policy {
    trainer: PolicyTrainer,
}

impl Policy {
    /// Builds the networks and the environments, and finds ranges of converters.
    pub(super) fn new(
        experiment: PolicyExperiment,
        machine: Machine,
        source: EnvSource,
    ) -> Result<Self, RunError> {
        let mut layers = experiment.actor.layers.clone();
        if matches!(experiment.method, Method::Ppo(_)) {
            layers.extend(experiment.critic.layers.clone());
        }
        let batch = experiment.actor.batch;
        super::weigh(&layers, &experiment.hardware, batch, super::Memory::left())?;
        let mut trainer = PolicyTrainer::new(experiment, machine.backend(), source)?;
        let threads = machine.threads();
        for network in trainer.networks_mut() {
            let engine = network.engine_mut();
            engine.set_threads(threads).map_err(|error| RunError::NoThreads { threads, error })?;
        }
        Ok(Self { trainer })
    }

    /// An epoch, and episodes without learning after it.
    fn told(&mut self, epoch: PolicyEpoch, seconds: f64) -> Result<Told, RunError> {
        let evaluating = self.trainer.experiment().evaluation;
        let mut found = self.trainer.evaluate(evaluating.episodes)?;
        let (currents, mute) =
            (std::mem::take(&mut found.currents), std::mem::take(&mut found.mute));
        let evaluation = EpisodesRecord::of(&found, evaluating.deterministic);
        let outcome = Outcome::Policy(Box::new(PolicyOutcome::of(epoch, evaluation)));
        Ok(Told { outcome, currents, mute, seconds })
    }
}

/// How far it is, as every task says it.
fn progress(of: PolicyProgress) -> Progress {
    let PolicyProgress { epoch, epochs, steps, steps_total, returns: [episodes, sum] } = of;
    let count = |steps: u64| usize::try_from(steps).unwrap_or(usize::MAX);
    let returns = SumRecord { sum, count: episodes.unsigned_abs(), bits: RETURN_BITS };
    Progress {
        epoch,
        epochs,
        done: count(steps),
        total: count(steps_total),
        answers: None,
        returns: Some(returns),
    }
}

impl Task for Policy {
    fn start(&mut self) -> Result<Told, RunError> {
        self.told(PolicyEpoch::default(), 0.0)
    }

    fn advance(&mut self, go_on: GoOn<'_>) -> Result<Option<Told>, RunError> {
        if self.trainer.epoch() >= self.trainer.epochs() {
            return Ok(None);
        }
        let started = Instant::now();
        let epoch = match self.trainer.learn(&mut |of| go_on(progress(of))) {
            Ok(epoch) => epoch,
            Err(PolicyError::Stopped) => return Ok(None),
            Err(error) => return Err(error.into()),
        };
        self.told(epoch, started.elapsed().as_secs_f64()).map(Some)
    }

    fn state(&mut self) -> &mut dyn State {
        &mut self.trainer
    }

    fn test(&mut self) -> Result<Option<TestOutcome>, RunError> {
        let evaluating = self.trainer.experiment().evaluation;
        let found = self.trainer.evaluate(evaluating.episodes_final)?;
        let (epoch, steps) = (self.trainer.epoch(), self.trainer.steps());
        Ok(Some(TestOutcome::Policy(PolicyTest {
            epoch,
            select: "last".into(),
            steps,
            episodes: EpisodesRecord::of(&found, evaluating.deterministic),
        })))
    }

    fn epoch(&self) -> u32 {
        self.trainer.epoch()
    }

    fn networks(&self) -> Vec<&Driver> {
        self.trainer.networks()
    }

    fn networks_mut(&mut self) -> Vec<&mut Driver> {
        self.trainer.networks_mut()
    }

    fn pathways(&self) -> Vec<PathwayRecord> {
        self.trainer.pathways()
    }

    fn notes(&self) -> Vec<Note> {
        super::notes::stuck(self.networks()).into_iter().collect()
    }

    fn epoch_size(&self) -> (usize, u64) {
        let (steps, updates) = self.trainer.epoch_size();
        (usize::try_from(steps).unwrap_or(usize::MAX), updates)
    }

    fn updates(&mut self, updates: u64) -> Result<u64, RunError> {
        let mut done = 0;
        if updates == 0 {
            return Ok(0);
        }
        let learnt = self.trainer.learn(&mut |_| {
            done += 1;
            done < updates
        });
        match learnt {
            Ok(_) | Err(PolicyError::Stopped) => Ok(done),
            Err(error) => Err(error.into()),
        }
    }

    fn infer(&mut self) -> Result<(), RunError> {
        Ok(self.trainer.watch(0, &mut |_| false)?)
    }

    fn take_record(&mut self) -> Option<Record> {
        self.trainer.take_record()
    }

    fn watch(
        &mut self,
        episode: u32,
        look: &mut dyn FnMut(&WatchedStep) -> bool,
    ) -> Result<bool, RunError> {
        self.trainer.watch(episode, look)?;
        Ok(true)
    }
}
