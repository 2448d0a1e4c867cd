//! `task = "policy"`: what is acted on, two networks and how they learn. What belongs to the other task is refused, here
//! and there, with words that say what to use.

use super::learning::{Kind, Learning, Named};
use super::{
    DataConfig, ImageInput, Learnt, Select, between, learning, mantissas, per_layer, positive,
    range, route, word, wrong,
};
use crate::chip::hardware::Hardware;
use crate::lab::config::ConfigError;
use crate::lab::config::defaults::policy::{self as defaults, PolicyDefaults};
use crate::lab::config::file::{
    EnvironmentFile, EvaluationFile, EvolutionFile, ExperimentFile, LearningFile, PpoFile,
};
use crate::lab::config::policy::PolicySettings;
use crate::lab::near;
use crate::learn::error::Centre;
use crate::learn::rule::Rule;
use crate::num::fixed::{Batch, RateMantissa};
use crate::task::environment::{self, EnvSpec, Real, Taken};
use crate::task::policy::{Evaluating, Evolution, Method, Ppo, Share};

mod network;

/// Steps of all environments, at most.
const STEPS_MAX: i64 = 1 << 40;
/// Steps of a rollout of all environments, at most.
const ROLLOUT_MAX: i64 = 1 << 22;

/// Refuses what is there and means nothing.
fn refuse(keys: &[(&str, bool, &str)]) -> Result<(), ConfigError> {
    match keys.iter().find(|(_, given, _)| *given) {
        Some((key, _, allowed)) => Err(wrong(key, "is given", allowed)),
        None => Ok(()),
    }
}

/// Refuses keys of policies where examples are learnt from.
pub(super) fn refused_in_classification(file: &ExperimentFile) -> Result<(), ConfigError> {
    const USE: &str = "it belongs to task = \"policy\": say that, or take it out";
    let network = file.network.as_ref();
    refuse(&[
        ("environment", file.environment.is_some(), USE),
        ("ppo", file.ppo.is_some(), USE),
        ("es", file.es.is_some(), USE),
        ("evaluation", file.evaluation.is_some(), USE),
        ("network.critic_hidden", network.is_some_and(|n| n.critic_hidden.is_some()), USE),
    ])
}

/// Refuses keys of classification.
fn refused_here(file: &ExperimentFile) -> Result<(), ConfigError> {
    const WINDOWS: &str =
        "it belongs to convolutions, and policies have dense layers alone: take the key out";
    let (network, learning) = (file.network.as_ref(), file.learning.as_ref());
    refuse(&[
        (
            "data",
            file.data.is_some(),
            "a policy learns from no examples: environment.id says what it acts on",
        ),
        (
            "preset",
            file.preset.is_some(),
            "it says whose defaults networks have that learn from examples: take the key out",
        ),
        (
            "network.channels",
            network.is_some_and(|n| n.channels.is_some()),
            "policies have dense layers alone: take the key out",
        ),
        ("network.kernel", network.is_some_and(|n| n.kernel.is_some()), WINDOWS),
        ("network.stride", network.is_some_and(|n| n.stride.is_some()), WINDOWS),
        ("network.padding", network.is_some_and(|n| n.padding.is_some()), WINDOWS),
        ("network.pool", network.is_some_and(|n| n.pool.is_some()), WINDOWS),
        ("network.pool_side", network.is_some_and(|n| n.pool_side.is_some()), WINDOWS),
        ("network.copies", network.is_some_and(|n| n.copies.is_some()), WINDOWS),
        (
            "learning.error",
            learning.is_some_and(|l| l.error.is_some()),
            "what came of acting makes the errors of a policy: take the key out",
        ),
        (
            "learning.temperature",
            learning.is_some_and(|l| l.temperature.is_some()),
            "what came of acting makes the errors of a policy: take the key out",
        ),
        (
            "learning.flip",
            learning.is_some_and(|l| l.flip.is_some()),
            "a policy is shown no images: take the key out",
        ),
        (
            "network.outputs",
            network.is_some_and(|n| n.outputs.is_some()),
            "the actions of the environment say how many outputs there are: take the key out",
        ),
        (
            "network.init_gain",
            network.is_some_and(|n| n.init_gain.is_some()),
            "policies start with levels of the absolute Gaussian, excitatory and inhibitory alike: take the key out",
        ),
        (
            "network.init_gain_output",
            network.is_some_and(|n| n.init_gain_output.is_some()),
            "outputs of policies start at 0.1 (actor) and 0.3 (critic) of the absolute Gaussian: take the key out",
        ),
        (
            "learning.epochs",
            learning.is_some_and(|l| l.epochs.is_some()),
            "environment.steps says how long a policy learns, environment.rollouts how long an epoch is",
        ),
        (
            "learning.shift_pixels",
            learning.is_some_and(|l| l.shift_pixels.is_some()),
            "a policy is shown no images: take the key out",
        ),
        (
            "learning.train_on",
            learning.is_some_and(|l| l.train_on.is_some()),
            "a policy learns from no examples: take the key out",
        ),
    ])
}

/// Checks a policy and writes defaults back.
pub(super) fn resolve(
    file: &mut ExperimentFile,
    hardware: &Hardware,
) -> Result<Learnt, ConfigError> {
    refused_here(file)?;
    let of = file.environment.get_or_insert_default();
    let id = of.id.get_or_insert_with(|| defaults::ENVIRONMENT.into()).clone();
    let spec = spec_of(&id)?;
    let time = time(of)?;
    let continuous = matches!(spec.taken, Taken::Continuous(_));

    let learning = file.learning.get_or_insert_default();
    let named = word("learning.rule", &mut learning.rule, "ed", &learning::RULES)?;
    let method = match named {
        Named::Evolution => {
            if hardware.programming.is_some() {
                let allowed = "evolution strategies load every candidate anew, and what a load leaves in a cell is drawn \
                               once: take the table out";
                return Err(wrong("hw.device.programming", "is given", allowed));
            }
            let given = file.ppo.is_some();
            refuse(&[(
                "ppo",
                given,
                "it belongs to every rule but \"es\", whose keys are those of [es]",
            )])?;
            Method::Evolution(evolution(file.es.get_or_insert_default())?)
        }
        Named::Seeded | Named::Rule(Rule::Kaneko) => {
            let found = format!("is \"{}\"", learning.rule.as_deref().unwrap_or_default());
            let allowed = "it learns from labels: policies have ed, ed_non_dalean, dfa, bp and es";
            return Err(wrong("learning.rule", found, allowed));
        }
        Named::Rule(_) => {
            refuse(&[("es", file.es.is_some(), "it belongs to learning.rule = \"es\"")])?;
            let defaults = PolicyDefaults::of(&spec.id);
            Method::Ppo(ppo(file.ppo.get_or_insert_default(), continuous, defaults)?)
        }
    };
    let evolution = matches!(method, Method::Evolution(_));
    let network = file.network.get_or_insert_default();
    let made = network::resolve(network, &spec, evolution)?;
    let layers = made.hidden.len() + 1;
    let centred = !evolution && *learning.centred.get_or_insert(true);
    let learnt = match named {
        Named::Rule(rule) => learns(learning, rule, layers)?,
        _ => evolves(learning, layers)?,
    };
    let mantissas = match evolution {
        true => vec![RateMantissa::new(1).expect("in range"); layers],
        false => mantissas(learning, &learnt, &made.network, &[], hardware)?,
    };
    let policy = PolicySettings {
        environment: spec,
        environments: time.environments,
        input: made.input,
        critic_hidden: made.critic_hidden,
        centred,
        method,
        steps: time.steps,
        horizon: time.horizon,
        rollouts: time.rollouts,
        evaluation: evaluation(file.evaluation.get_or_insert_default(), PolicyDefaults::of(&id))?,
    };
    let epochs = policy.epochs().ok_or_else(|| {
        let allowed = "a run has fewer than 2^32 epochs: lower it, or raise environment.rollouts";
        wrong("environment.steps", format!("is {}", policy.steps), allowed)
    })?;
    Ok(Learnt {
        data: DataConfig::default(),
        input: ImageInput::Raw,
        convolutions: vec![],
        hidden: made.hidden,
        outputs: None,
        network: made.network,
        learning: Learning { epochs, ..learnt },
        mantissas,
        policy: Some(policy),
    })
}

/// How networks of so many layers learn from errors.
fn learns(file: &mut LearningFile, rule: Rule, layers: usize) -> Result<Learning, ConfigError> {
    const MULTIPLIERS: &str = "learning.rate_multipliers";
    let centre = word("learning.centre", &mut file.centre, "none", &learning::CENTRES)?;
    if centre != Centre::None {
        let found = format!("is \"{}\"", file.centre.as_deref().unwrap_or_default());
        let allowed = "errors of policies have no mean to be taken from: use \"none\" (learning.centred is another thing)";
        return Err(wrong("learning.centre", found, allowed));
    }
    let batch = *file.batch.get_or_insert(defaults::BATCH);
    let optimiser = learning::optimiser(file, "sign", true)?;
    let rate = *file.rate.get_or_insert(defaults::rate_of(optimiser, rule));
    let rate = positive("learning.rate", rate)?;
    file.rate_multipliers.get_or_insert_with(|| defaults::multipliers(optimiser, layers));
    let factors = per_layer(MULTIPLIERS, &mut file.rate_multipliers, 1.0, layers)?;
    Ok(Learning {
        kind: Kind { rule, seeded: false },
        mode: word("learning.mode", &mut file.mode, "accumulate", &learning::MODES)?,
        centre,
        control: word("learning.control", &mut file.control, "none", &learning::CONTROLS)?,
        refresh: learning::refresh(file)?,
        route: route::resolve(file, rule, 1)?,
        batch: range("learning.batch", Batch::new(batch))?,
        rates: learning::products(rate, factors)?,
        decay: word("learning.decay", &mut file.decay, "linear", &learning::DECAYS)?,
        optimiser,
        select: last(file)?,
        ..Learning::neutral()
    })
}

/// Networks of so many layers that no error reaches: what such a layer has to say is neutral.
fn evolves(file: &mut LearningFile, layers: usize) -> Result<Learning, ConfigError> {
    const WHY: &str =
        "evolution has no errors, updates and rates: its keys are those of [es]; take the key out";
    refuse(&[
        ("learning.batch", file.batch.is_some(), WHY),
        ("learning.mode", file.mode.is_some(), WHY),
        ("learning.centred", file.centred.is_some(), WHY),
        ("learning.optimiser", file.optimiser.is_some(), WHY),
        ("learning.dead_zone", file.dead_zone.is_some(), WHY),
        ("learning.momentum_shift", file.momentum_shift.is_some(), WHY),
        ("learning.adam_shifts", file.adam_shifts.is_some(), WHY),
        ("learning.rate", file.rate.is_some(), WHY),
        ("learning.rate_multipliers", file.rate_multipliers.is_some(), WHY),
        ("learning.rate_mantissa", file.rate_mantissa.is_some(), WHY),
        ("learning.decay", file.decay.is_some(), WHY),
        ("learning.centre", file.centre.is_some(), WHY),
        ("learning.control", file.control.is_some(), WHY),
        ("learning.refresh", file.refresh.is_some(), WHY),
        ("learning.route", file.route.is_some(), WHY),
        ("learning.taps", file.taps.is_some(), WHY),
        ("learning.tap_shift", file.tap_shift.is_some(), WHY),
    ])?;
    let one = positive("learning.rate", 1.0)?;
    Ok(Learning { rates: vec![one; layers], select: last(file)?, ..Learning::neutral() })
}

/// The state that is tested.
fn last(file: &mut LearningFile) -> Result<Select, ConfigError> {
    let states = [("last", Select::Last), ("best_validation", Select::BestValidation)];
    match word("learning.select", &mut file.select, "last", &states)? {
        Select::Last => Ok(Select::Last),
        Select::BestValidation => {
            let allowed = "a policy has no validation examples; use \"last\"";
            Err(wrong("learning.select", "is \"best_validation\"", allowed))
        }
    }
}

/// How long it learns, in which pieces.
struct Time {
    environments: u32,
    steps: u64,
    horizon: u32,
    rollouts: u32,
}

fn time(file: &mut EnvironmentFile) -> Result<Time, ConfigError> {
    let count = *file.count.get_or_insert(defaults::COUNT);
    let count = between("environment.count", count, 1, 1024)?;
    let steps = *file.steps.get_or_insert(defaults::STEPS);
    let steps = between("environment.steps", steps, 1, STEPS_MAX)?;
    let horizon = *file.horizon.get_or_insert(defaults::HORIZON);
    let horizon = between("environment.horizon", horizon, 1, 65_536)?;
    let rollout = count * horizon;
    if rollout > ROLLOUT_MAX {
        let allowed = format!(
            "times environment.count it is {rollout} steps of a rollout, which are kept at once: at most {ROLLOUT_MAX}"
        );
        return Err(wrong("environment.horizon", format!("is {horizon}"), allowed));
    }
    let rollouts = *file.rollouts.get_or_insert(defaults::rollouts(steps, rollout));
    let rollouts = between("environment.rollouts", rollouts, 1, i64::from(u32::MAX))?;
    Ok(Time {
        environments: small(count),
        steps: steps.unsigned_abs(),
        horizon: small(horizon),
        rollouts: small(rollouts),
    })
}

/// A number whose range was checked.
fn small(number: i64) -> u32 {
    u32::try_from(number).expect("its range was checked")
}

/// A number from 0 to 1 in fixed point.
fn share(key: &str, found: f64, least: f64, most: f64) -> Result<Share, ConfigError> {
    if (least..=most).contains(&found) {
        Ok(Share::from_num(found))
    } else {
        Err(wrong(key, format!("is {found}"), format!("it must lie in {least}..={most}")))
    }
}

fn ppo(
    file: &mut PpoFile,
    continuous: bool,
    defaults: &PolicyDefaults,
) -> Result<Ppo, ConfigError> {
    let entropy = if continuous { defaults::ENTROPY_OF_NUMBERS } else { defaults.entropy };
    let passes = between("ppo.passes", *file.passes.get_or_insert(10), 1, 1000)?;
    let (mut log_sigma_start, mut log_sigma_rate, mut noise_steps) = (0, Share::ZERO, 1);
    if continuous {
        let start = *file.log_sigma.get_or_insert(defaults::LOG_SIGMA);
        if !(-4.0..=1.0).contains(&start) {
            return Err(wrong("ppo.log_sigma", format!("is {start}"), "it must lie in -4..=1"));
        }
        log_sigma_start = Real::from_num(start).to_bits();
        let rate = *file.log_sigma_rate.get_or_insert(defaults::LOG_SIGMA_RATE);
        log_sigma_rate = share("ppo.log_sigma_rate", rate, 0.0, 1.0)?;
        let steps = *file.noise_steps.get_or_insert(defaults::NOISE_STEPS);
        noise_steps = small(between("ppo.noise_steps", steps, 1, 1024)?);
    } else {
        const WHY: &str =
            "the environment takes one of some actions, which have no spread: take the key out";
        refuse(&[
            ("ppo.log_sigma", file.log_sigma.is_some(), WHY),
            ("ppo.log_sigma_rate", file.log_sigma_rate.is_some(), WHY),
            ("ppo.noise_steps", file.noise_steps.is_some(), WHY),
        ])?;
    }
    Ok(Ppo {
        passes: small(passes),
        discount: share("ppo.gamma", *file.gamma.get_or_insert(defaults.gamma), 0.0, 1.0)?,
        lambda: share("ppo.lambda", *file.lambda.get_or_insert(0.95), 0.0, 1.0)?,
        clip: share("ppo.clip", *file.clip.get_or_insert(0.2), 1e-3, 1.0)?,
        entropy: share("ppo.entropy", *file.entropy.get_or_insert(entropy), 0.0, 1.0)?,
        log_sigma_start,
        log_sigma_rate,
        noise_steps,
    })
}

fn evolution(file: &mut EvolutionFile) -> Result<Evolution, ConfigError> {
    let pairs = *file.pairs.get_or_insert(defaults::PAIRS);
    let step = *file.step.get_or_insert(defaults::STEP);
    let shift = *file.shift.get_or_insert(defaults::SHIFT);
    Ok(Evolution {
        pairs: small(between("es.pairs", pairs, 1, 4096)?),
        step: small(between("es.step", step, 1, 4095)?),
        shift: small(between("es.shift", shift, 0, 16)?),
    })
}

fn evaluation(
    file: &mut EvaluationFile,
    defaults: &PolicyDefaults,
) -> Result<Evaluating, ConfigError> {
    let episodes = *file.episodes.get_or_insert(8);
    let last = *file.final_episodes.get_or_insert(100);
    Ok(Evaluating {
        episodes: small(between("evaluation.episodes", episodes, 1, 10_000)?),
        episodes_final: small(between("evaluation.final_episodes", last, 1, 10_000)?),
        deterministic: *file.deterministic.get_or_insert(defaults.deterministic),
    })
}

/// What an environment is.
fn spec_of(id: &str) -> Result<EnvSpec, ConfigError> {
    let found = environment::make(id, 0, 1);
    let found = found.map_err(|error| {
        let names = environment::ENVIRONMENTS.iter().map(|(name, _)| *name);
        let hint = near::hint(id, names);
        wrong("environment.id", format!("is \"{id}\""), format!("{error}{hint}"))
    });
    Ok(found?.spec().clone())
}
