//! Any bytes as a policy that is trained from outside, and as what its environments show.

use dalean::policy::{
    EnvSpec, Evaluating, Evolution, InputCoding, Method, Observations, Outcomes, PolicyExperiment,
    PolicyLearner, PolicyTurn, Ppo, Real, Share, Shown, Taken,
};

use super::*;

/// What some environments show, mostly as many numbers or lines as the kind has.
fn observations(c: &mut Choices<'_>, spec: &EnvSpec, count: usize) -> Observations {
    let mut shown = Observations::default();
    match spec.shown {
        Shown::Dense(values) if values < 100 => {
            let wanted = count.min(64) * values + usize::from(c.one_in(32));
            let values = (0..wanted).map(|_| Real::from_bits(c.word() as i32 >> (c.byte() % 32)));
            shown.values = values.collect();
        }
        Shown::Sparse { lines, .. } => {
            for _ in 0..count.min(64) {
                let on = u32::from(c.byte() % 16);
                if (on as usize) < lines || c.one_in(64) {
                    shown.active.push(on);
                }
                shown.ends.push(shown.active.len());
            }
        }
        Shown::Dense(_) => {}
    }
    shown
}

/// What hidden units keep to, and their function: mostly what goes together.
fn middle(c: &mut Choices<'_>) -> (Homeostasis, Activation) {
    let gain = match c.byte() % 3 {
        0 => Gain::Fixed { spread: c.near(0, 2) as u32 },
        1 => Gain::Tracking,
        _ => Gain::Table,
    };
    let ramp = (gain != Gain::Table) != c.one_in(16);
    let law = Homeostasis { threshold: c.one_in(2), gain, window_log2: c.near(4, 24) as u32 };
    (law, if ramp { Activation::Ramp } else { Activation::Relu })
}

/// A policy that is trained from outside.
pub(super) fn policy(c: &mut Choices<'_>) {
    let spec = EnvSpec {
        id: "fuzz".into(),
        shown: match c.byte() % 3 {
            0 => Shown::Sparse { lines: c.size(1, 12), active: c.size(0, 3) },
            _ => Shown::Dense(c.size(1, 3)),
        },
        taken: match c.byte() % 2 {
            0 => Taken::Discrete(c.size(1, 4)),
            _ => Taken::Continuous(c.size(1, 2)),
        },
        steps_max: c.word() as u32,
        inputs: vec![],
    };
    let share = |c: &mut Choices<'_>| match c.byte() {
        255 => Share::from_bits(c.word() as u32),
        byte => Share::from_num(f32::from(byte) / 255.0),
    };
    let policy = |outputs, homeostasis: Homeostasis, hidden: Activation| NetworkSpec {
        rule: Rule::Ed,
        mode: UpdateMode::Accumulate,
        error: OutputError::OneVsAll,
        centre: Centre::None,
        route: Some(Route::Modulo { taps: 1, shift: None }),
        batch: Batch::new(16).expect("inside"),
        mantissas: vec![RateMantissa::new(1).expect("inside"); 2],
        rates: vec![Positive::ONE; 2],
        decay: Decay::Linear,
        optimisers: vec![Optimiser::Sign { dead_zone: true }; 2],
        centred: vec![false; 2],
        control: Control::None,
        refresh: None,
        layers: [(1, 4), (4, outputs)]
            .into_iter()
            .map(|(inputs, units)| LayerSpec {
                inputs,
                units,
                wiring: Wiring::Dual,
                driven_by: match inputs {
                    1 => DrivenBy::Shared,
                    _ if hidden == Activation::Rms => DrivenBy::Normalised,
                    _ => DrivenBy::Streams,
                },
                activation: if inputs == 1 { hidden } else { Activation::Accumulator },
                weight_max_log2: 0,
                initial: InitialLevels::AbsGaussian { gain: [1, 1] },
                constant_row: inputs == 1,
                convolution: None,
                copies: 1,
                pool: Pool::None,
                homeostasis: if inputs == 1 { homeostasis } else { Homeostasis::OFF },
            })
            .collect(),
    };
    let own = |c: &mut Choices<'_>, outputs| match c.byte() % 16 {
        15 => network(c, 1, outputs),
        11..15 => {
            let (law, hidden) = middle(c);
            policy(outputs, law, hidden)
        }
        _ => policy(outputs, Homeostasis::OFF, Activation::Rms),
    };
    let experiment = PolicyExperiment {
        seed: c.word(),
        hardware: hardware(c),
        environment: String::new(),
        environments: c.near(1, 6) as u32,
        input: c.of(&[InputCoding::Split, InputCoding::Offset]),
        actor: own(c, 1),
        critic: own(c, 1),
        method: match c.one_in(32) {
            true => Method::Evolution(Evolution { pairs: c.word() as u32, step: 1, shift: 1 }),
            false => Method::Ppo(Ppo {
                passes: c.near(1, 3) as u32,
                discount: share(c),
                lambda: share(c),
                clip: share(c),
                entropy: share(c),
                log_sigma_start: c.near(-4 << 16, 1 << 16) as i32,
                log_sigma_rate: share(c),
                noise_steps: c.near(1, 9) as u32,
            }),
        },
        steps: c.near(1, 999) as u64,
        horizon: c.near(1, 4) as u32,
        rollouts: c.near(1, 3) as u32,
        evaluation: Evaluating { episodes: 1, episodes_final: 1, deterministic: c.one_in(2) },
    };
    let experiment = if c.one_in(16) { experiment } else { experiment.facing(&spec) };
    let count = experiment.environments as usize;
    let backend = c.of(&Backend::available());
    let mut learner = match PolicyLearner::new(experiment, spec.clone(), backend) {
        Ok(learner) => learner,
        Err(error) => return shown(&error),
    };
    for turn in 0..400 {
        if c.0.is_empty() && turn > 300 {
            break;
        }
        let due = match learner.turn() {
            PolicyTurn::Begin => 0,
            PolicyTurn::Act(_) => 1,
            PolicyTurn::Learn => 2,
            _ => 3,
        };
        let called = match if c.one_in(64) { c.byte() % 4 } else { due } {
            0 => learner.begin(&observations(c, &spec, count)),
            1 => {
                let (next, reached) =
                    (observations(c, &spec, count), observations(c, &spec, count));
                let ends =
                    |c: &mut Choices<'_>| (0..count).map(|_| c.one_in(16)).collect::<Vec<_>>();
                let (terminated, truncated) = (ends(c), ends(c));
                let rewards = (0..count).map(|_| Real::from_bits(c.word() as i32)).collect();
                learner.take(&Outcomes { reached, next, rewards, terminated, truncated })
            }
            2 => learner.learn(&mut |_| true).map(|_| ()),
            _ => learner.answer(&observations(c, &spec, count), turn).map(|_| ()),
        };
        if let Err(error) = called {
            shown(&error);
        }
        if due == 3 {
            break;
        }
    }
    assert!(learner.epoch() <= learner.epochs());
    let _ = learner.steps();
}
