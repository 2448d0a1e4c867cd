//! Policies whose hidden units keep to a middle: what moves it, what does not, and the same cycle by cycle.

use proptest::prelude::*;

use super::*;
use crate::chip::engine::tick::Network;
use crate::chip::engine::{Operation, Side};
use crate::chip::hardware::timing::{PulseCode, Timing};
use crate::chip::hardware::{Adc, AdcRange, Subtract};
use crate::chip::layer::{Balance, Gain};
use crate::chip::ledger::Ledger;
use crate::learn::driver::Driver;
use crate::learn::error::ErrorUnit;
use crate::num::fixed::AdcBits;

const LAWS: [Homeostasis; 3] = [
    Homeostasis { threshold: true, gain: Gain::Tracking, window_log2: 5 },
    Homeostasis { threshold: true, gain: Gain::Fixed { spread: 1 }, window_log2: 9 },
    Homeostasis { threshold: false, gain: Gain::Tracking, window_log2: 4 },
];

/// The same network, its hidden units ramps.
fn ramps(mut network: NetworkSpec, law: Homeostasis) -> NetworkSpec {
    let last = network.layers.len() - 1;
    for (at, layer) in network.layers.iter_mut().enumerate() {
        if at < last {
            (layer.activation, layer.homeostasis) = (Activation::Ramp, law);
        }
        if at > 0 {
            layer.driven_by = DrivenBy::Streams;
        }
    }
    network
}

/// The same policy, the hidden units of both networks ramps.
pub(super) fn ramped(mut experiment: PolicyExperiment, law: Homeostasis) -> PolicyExperiment {
    experiment.actor = ramps(experiment.actor, law);
    experiment.critic = ramps(experiment.critic, law);
    experiment
}

/// Middles of the hidden layers of actor and critic.
fn middles(networks: &[&Driver]) -> Vec<Balance> {
    let layers = networks.iter().flat_map(|driver| driver.engine().layers());
    let on = layers.filter(|layer| layer.spec.homeostasis.is_on());
    on.map(|layer| layer.balance.clone()).collect()
}

#[test]
fn back_ends_stops_and_callers_give_the_same_middles() {
    for (id, law) in IDS.into_iter().cycle().zip(LAWS) {
        let experiment = ramped(experiment(id, Rule::Ed, None), law);
        let mut wanted = trainer(&experiment);
        let told = train(&mut wanted, 2);
        let mut other =
            PolicyTrainer::new(experiment.clone(), Backend::Scalar, EnvSource::Native).unwrap();
        let mut kept: Option<Book> = None;
        for (at, told) in told.iter().enumerate() {
            if let Some(mut kept) = kept.take() {
                // goes on from what was kept
                other = trainer(&experiment);
                kept.give = true;
                other.visit(&mut kept).unwrap();
            }
            assert_eq!(&train(&mut other, 1)[0], told, "{id}, epoch {at}");
            kept = Some(book(&mut other));
        }
        assert_eq!(book(&mut other).lines, book(&mut wanted).lines, "{id}");
        assert_eq!(middles(&other.networks()), middles(&wanted.networks()));
    }
}

#[test]
fn middles_are_found_before_anything_is_learnt_and_move_with_updates_alone() {
    for law in LAWS {
        let experiment = ramped(experiment(IDS[0], Rule::Ed, None), law);
        let mut policy = trainer(&experiment);
        let found = middles(&policy.networks());
        assert_eq!(found.len(), 2, "of actor and critic");
        let targets = Wiring::Dual.targets();
        let mut streams = found.iter().flat_map(|of| targets.iter().map(|&s| of.thresholds(s)));
        assert!(streams.any(|all| all.iter().any(|&threshold| threshold != 0)) == law.threshold);
        let _ = policy.evaluate(3).unwrap();
        assert_eq!(middles(&policy.networks()), found, "evaluation moved them");
        // an update of both networks, behind a rollout and values of all of it
        let _ = policy.learn(&mut |_| false).unwrap_err();
        let moved = middles(&policy.networks());
        assert!(moved.iter().zip(&found).all(|(moved, found)| moved != found));

        // by what the minibatch was read with, and by nothing that was acted on
        let mut again = trainer(&experiment);
        for driver in again.networks_mut() {
            let _ = driver.engine_mut().record(true);
        }
        let _ = again.learn(&mut |_| false).unwrap_err();
        for driver in again.networks_mut() {
            let tape = driver.engine_mut().record(false);
            let start = driver.engine().update_start().unwrap().layers.clone();
            let hardware = &experiment.hardware;
            let mut fresh = crate::chip::engine::Engine::new(
                hardware.clone(),
                Backend::Scalar,
                experiment.seed,
                start,
            );
            for operation in &tape {
                if let Recorded::LoadDrives { codes } = operation {
                    fresh.execute(&Operation::LoadDrives { codes });
                    fresh.execute(&Operation::Forward { layer: 0, side: Side::Rows });
                }
            }
            fresh.written(crate::chip::engine::WritesDone::Batch);
            assert_eq!(fresh.layers()[0].balance, driver.engine().layers()[0].balance);
        }
    }
}

#[test]
fn evolution_finds_a_step_and_never_moves_it() {
    let refused = |law: Homeostasis| {
        let experiment = ramped(experiment(IDS[0], Rule::Ed, Some(EVOLUTION)), law);
        let source = EnvSource::Native;
        PolicyTrainer::new(experiment, Backend::best(), source).err().unwrap().to_string()
    };
    assert!(refused(LAWS[0]).starts_with("`network.threshold` is true with evolution"));
    assert!(refused(LAWS[2]).starts_with("`network.gain` is \"tracking\" with evolution"));
    let law = Homeostasis { threshold: false, ..LAWS[1] };
    let mut evolved = trainer(&ramped(experiment(IDS[1], Rule::Ed, Some(EVOLUTION)), law));
    let found = middles(&evolved.networks());
    let _ = train(&mut evolved, 1);
    assert_eq!(middles(&evolved.networks()), found);
}

/// Reads some samples in both engines, as acting does.
fn act(engine: &mut Engine, tick: &mut Network, codes: &[u8]) {
    let mut operations = vec![Operation::LoadDrives { codes }];
    let layers = 0..engine.layers().len();
    operations.extend(layers.map(|layer| Operation::Forward { layer, side: Side::Rows }));
    operations.iter().for_each(|operation| engine.execute(operation));
    engine.settle();
    tick.run(&operations);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn networks_of_a_policy_agree_cycle_by_cycle(
        seed in 0u64..1 << 40,
        inputs in 1usize..=7,
        outputs in 1usize..=3,
        laws in prop::sample::select(vec![0usize, 1, 2]),
        rule in prop::sample::select(vec![Rule::Ed, Rule::EdNonDalean, Rule::Dfa]),
        optimiser in prop::sample::select(vec![
            Optimiser::Sign { dead_zone: true },
            Optimiser::Plain,
            Optimiser::Rms,
        ]),
        centred: bool,
        mode in prop::sample::select(
            vec![UpdateMode::Accumulate, UpdateMode::Replay, UpdateMode::Online],
        ),
        adc in 0usize..4,
        tile in (2usize..=12, 2usize..=12),
        times in (1u64..=9, 1u64..=3, 1u64..=6, any::<bool>(), 1u64..=12, 1u64..=3),
    ) {
        let (settle, convert, share, overlapped, lanes, beat) = times;
        let timing = Timing {
            clock_khz: 1, beat, settle, convert, share, overlapped, lanes, hops: 1, pulse: 2,
            pulse_code: PulseCode::Unary, verify: false, active_max: None, slices: None,
        };
        let finite = |subtract| {
            let bits = AdcBits::new(6).unwrap();
            Adc::Finite { bits, subtract, range: AdcRange::Tracking }
        };
        let hardware = Hardware::reference().with(|chip| {
            (chip.tile.rows, chip.tile.columns) = tile;
            chip.adc = [Adc::Ideal, Adc::Ideal, finite(Subtract::Digital), finite(Subtract::Current)][adc];
            chip.timing = Some(timing);
        }).unwrap();
        let samples = 5;
        let mut spec = ramps(network(inputs, outputs, rule), LAWS[laws]);
        spec.mode = mode;
        spec.batch = Batch::new(samples as i64).unwrap();
        // one by one neither a sum of samples nor a mean of them is left
        let (optimiser, centred) = match mode {
            UpdateMode::Accumulate => (optimiser, centred),
            _ => (Optimiser::Plain, false),
        };
        spec.optimisers = vec![optimiser; 2];
        spec.centred = vec![centred, false];
        let place = NetworkPlace { seed, first_layer: 0, updates: 4 };
        if rule == Rule::EdNonDalean {
            spec.layers.iter_mut().for_each(|layer| layer.wiring = Wiring::DualPairs);
        }
        let mut driver = spec.build(&hardware, Backend::best(), place).unwrap();
        let word = |at: usize| {
            (seed ^ at as u64).wrapping_add(1).wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 40
        };
        let codes = |from: usize, samples: usize| -> Vec<u8> {
            (0..samples * inputs).map(|at| word(from + at) as u8).collect()
        };
        let _ = driver.engine_mut().calibrate(&codes(0, 32));
        for phase in [Phase::Training, Phase::Evaluation] {
            *driver.engine_mut().ledger_mut(phase) = Ledger::with_cycles(2);
        }
        let mut tick = Network::new(&hardware, seed, driver.engine().layers(), samples);
        tick.set_learning(driver.engine().mantissas(), driver.engine().potentiation_only());
        tick.set_error_unit(&ErrorUnit::handed(hardware.digital.error_bits));
        let _ = driver.engine_mut().record(true);
        for update in 0..3 {
            driver.learn(&codes(100 * update, samples), |engine, first, errors| {
                let each = engine.samples() * outputs;
                let error = |at| (word(7 * update + first + at) as i32 - (1 << 23)) >> 1;
                errors.extend((0..each).map(error));
            });
            tick.play_tape(&driver.engine_mut().record(true));
            act(driver.engine_mut(), &mut tick, &codes(31 * update, 3));
            driver.engine_mut().set_phase(Phase::Evaluation);
            tick.set_phase(Phase::Evaluation);
            act(driver.engine_mut(), &mut tick, &codes(17 * update, 2));
            driver.engine_mut().set_phase(Phase::Training);
            tick.set_phase(Phase::Training);
            let engine = driver.engine();
            for (at, layer) in engine.layers().iter().enumerate() {
                let balance = &layer.balance;
                for &target in layer.spec.wiring.targets() {
                    prop_assert_eq!(balance.thresholds(target), tick.thresholds(at, target));
                }
                if balance.law().is_on() {
                    let variance = balance.tracks().then_some(balance.variance());
                    prop_assert_eq!((balance.shift(), variance), tick.table_step(at));
                }
                for (array, cells) in layer.arrays.iter().enumerate() {
                    prop_assert!(cells.levels().eq(tick.levels(at, array)), "{} {}", at, array);
                }
                prop_assert_eq!(&layer.adc_shifts[..], tick.adc_shifts(at));
            }
            for phase in [Phase::Training, Phase::Evaluation] {
                prop_assert_eq!(engine.ledger(phase), tick.ledger(phase));
            }
        }
    }
}
