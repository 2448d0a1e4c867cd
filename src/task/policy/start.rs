//! How a policy begins: networks with their initial levels, and ranges of converters from what uniform actions lead to.
//!
//! ```text
//! calibration   256 steps in all under uniform actions, in order (step, environment); both networks' converters look at them
//! ```
//!
//! Uniform actions are drawn at site 7, pathway 1, sub = environment, count = step. See docs/MODEL.md, 5.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use super::actor::{Actor, ActorLaw, Chosen};
use super::critic::Critic;
use super::experiment::{Method, PolicyExperiment};
use super::observe::Statistics;
use super::player::Player;
use super::rollout::Coding;
use crate::chip::crossbar::kernel::Backend;
use crate::learn::driver::Driver;
use crate::learn::network::{NetworkError, NetworkPlace, NetworkSpec};
use crate::num::draw::{Place, Site, below};
use crate::num::fixed::narrow;
use crate::num::tables::PolicyTables;
use crate::task::environment::{EnvSpec, Observations, Real, Taken};

/// Steps of all environments whose observations are looked at before anything is learnt.
pub(super) const CALIBRATION: usize = 256;

/// Steps that so many environments take for that.
pub(super) const fn steps(environments: usize) -> u64 {
    CALIBRATION.div_ceil(environments) as u64
}

fn build(
    experiment: &PolicyExperiment,
    network: &NetworkSpec,
    first_layer: u16,
    backend: Backend,
) -> Result<Driver, NetworkError> {
    let updates = experiment.updates();
    let place = NetworkPlace { seed: experiment.seed, first_layer, updates };
    network.build(&experiment.hardware, backend, place)
}

/// What acts on such environments.
///
/// # Errors
/// When something does not fit.
pub(super) fn player(
    experiment: &PolicyExperiment,
    spec: EnvSpec,
    backend: Backend,
) -> Result<Player, NetworkError> {
    experiment.check(&spec)?;
    let law = match experiment.method {
        Method::Ppo(ppo) => ppo.into(),
        Method::Evolution(_) => ActorLaw::default(),
    };
    let statistics = Statistics::new(spec.values());
    Ok(Player {
        actor: Actor::new(build(experiment, &experiment.actor, 0, backend)?, spec.taken, law),
        coding: Coding::new(experiment.input, experiment.hardware.drive.bits, &spec),
        tables: PolicyTables::build(),
        standard: statistics.freeze(),
        statistics,
        spec,
    })
}

/// What judges, behind the layers of what acts.
///
/// # Errors
/// When something does not fit.
pub(super) fn critic(
    experiment: &PolicyExperiment,
    backend: Backend,
) -> Result<Critic, NetworkError> {
    let first_layer = narrow(experiment.actor.layers.len(), "at most 64 layers");
    Ok(Critic::new(build(experiment, &experiment.critic, first_layer, backend)?))
}

/// Takes what was seen into the first statistics; the drives that converters look at.
pub(super) fn look(player: &mut Player, seen: &Observations) -> Vec<u8> {
    player.look(seen);
    let mut codes = Vec::new();
    player.codes(seen, &Vec::from_iter(0..CALIBRATION), &mut codes);
    codes
}

/// Any action, each as likely as another: from the first word, or words, of the environment.
pub(super) fn uniform(taken: Taken, count: usize, seed: u64, step: u64) -> Chosen {
    let place = Place::global(seed, Site::Exploration, step);
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
