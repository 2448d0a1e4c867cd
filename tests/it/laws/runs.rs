//! Law 3: a run has one state, however it is carried out.

use std::num::NonZeroU32;

use dalean::chip::crossbar::kernel::Backend;
use dalean::chip::hardware::{Adc, AdcRange, HardwareSpec};
use dalean::chip::layer::{DrivenBy, Homeostasis, InitialLevels, LayerSpec, Optimiser, Pool};
use dalean::chip::population::Wiring;
use dalean::lab::store::checkpoint::{self, Identity};
use dalean::lab::store::hash;
use dalean::learn::error::{Centre, OutputError};
use dalean::learn::network::NetworkSpec;
use dalean::learn::route::Route;
use dalean::learn::rule::{Control, Rule, UpdateMode};
use dalean::num::fixed::{Batch, RateMantissa};
use dalean::num::tables::{Decay, Positive};
use dalean::task::classify::{Augment, Coding, Examples, Experiment, Trainer};
use proptest::prelude::*;

mod windows;

use super::choose::{Numbers, activation, flaws, hardware, side};
use super::config;

/// A small random training.
#[derive(Debug, Clone)]
struct Run {
    experiment: Experiment,
    data: Examples,
    /// Epochs before the interruption.
    stop: u32,
}

fn examples(seed: u64, features: usize, classes: usize) -> Examples {
    let mut numbers = Numbers(seed);
    let count = numbers.within(1, 30) as usize;
    let values = (0..count * features).map(|_| numbers.within(0, 16) * numbers.within(0, 1));
    let values = values.map(|v| v as u8).collect();
    let labels = (0..count).map(|i| (i % classes) as u8).collect();
    Examples::new(values, labels, features, 16, classes).unwrap()
}

fn rule() -> impl Strategy<Value = Rule> {
    prop::sample::select(vec![Rule::Ed, Rule::Ed, Rule::Kaneko, Rule::Dfa, Rule::Bp])
}

fn route(raw: [u8; 2], outputs: usize, rule: Rule) -> Option<Route> {
    let taps = 1 + usize::from(raw[1]) % outputs.min(4);
    Some(match raw[0] % 6 {
        _ if rule == Rule::Bp => return None,
        _ if rule == Rule::Dfa => Route::RandomDense { shift: None },
        0 => Route::RandomSparse,
        1 => Route::ScalarBroadcast,
        2 => Route::RandomDense { shift: None },
        3 if taps > 1 => Route::Modulo { taps, shift: Some(0) },
        _ => Route::Modulo { taps, shift: None },
    })
}

/// Examples of `values` values as images that can be moved by a pixel, if there is such a shape.
fn moved(values: usize) -> Option<Augment> {
    let height = (2..=values / 2).find(|height| values.is_multiple_of(*height))?;
    let (width, flip) = (values / height, values.is_multiple_of(2));
    Some(Augment { pixels: 1, height, width, channels: 1, flip })
}

fn run() -> impl Strategy<Value = Run> {
    let sides = (prop::collection::vec(side(), 1..=3), prop_oneof![Just(1usize), 2usize..=6]);
    let chip = sides.prop_flat_map(|(mut sides, outputs)| {
        sides.push(outputs);
        let widest = *sides.iter().max().unwrap();
        let layers = prop::collection::vec(
            (activation(), -1i32..=4, any::<bool>(), 0..4usize),
            sides.len() - 1,
        );
        (Just(sides), hardware(widest), layers)
    });
    let centres = vec![Centre::None, Centre::Batch, Centre::Running];
    let modes = vec![UpdateMode::Accumulate, UpdateMode::Replay, UpdateMode::Online];
    let learning = (
        rule(),
        prop::sample::select(modes),
        prop::sample::select(centres),
        any::<[u8; 2]>(),
        1i64..=12,
        1i64..=15,
        prop::sample::select(vec![Decay::Constant, Decay::Cosine]),
    );
    let times = (any::<u64>(), 2u32..=3, 0u32..=2, any::<bool>());
    (chip, learning, times)
        .prop_map(|((mut sides, mut hardware, layers), learning, times)| {
            let (rule, mode, mut centre, raw, batch, mantissa, decay) = learning;
            let (seed, epochs, stop, image) = times;
            if rule == Rule::Kaneko {
                *sides.last_mut().unwrap() = 1;
            }
            let outputs = *sides.last().unwrap();
            if (mode == UpdateMode::Online || batch == 1) && centre == Centre::Batch {
                centre = Centre::None;
            }
            if rule == Rule::Bp {
                let both_sides = |h: &mut HardwareSpec| {
                    (h.adc, h.tile.transposed_read) = (Adc::Ideal, true);
                };
                hardware = hardware.with(both_sides).unwrap();
            }
            hardware = hardware.with(flaws(seed)).unwrap();
            let count = layers.len();
            let control = match raw[1] >> 5 {
                0 if count > 1 => Control::FrozenHidden,
                1 if count > 1 && !matches!(rule, Rule::Dfa | Rule::Bp) => Control::SameSign,
                _ => Control::None,
            };
            let rates = [1.0, 20.0, 300.0, 5000.0];
            let rates = layers.iter().map(|layer| Positive::new(rates[layer.3]).unwrap()).collect();
            let specs = layers.into_iter().enumerate().map(|(at, (activation, weight, row, _))| {
                LayerSpec {
                    inputs: sides[at],
                    units: sides[at + 1],
                    wiring: match rule {
                        Rule::Dfa | Rule::Bp => Wiring::Single,
                        _ if at + 1 == count => Wiring::DualReadout,
                        _ => Wiring::Dual,
                    },
                    driven_by: if at == 0 { DrivenBy::Shared } else { DrivenBy::Streams },
                    activation,
                    weight_max_log2: weight,
                    initial: InitialLevels::Uniform { gain_64ths: [96, 32] },
                    constant_row: row,
                    convolution: None,
                    copies: 1,
                    pool: Pool::None,
                    homeostasis: Homeostasis::OFF,
                }
            });
            let network = NetworkSpec {
                layers: specs.collect(),
                rule,
                mode,
                error: OutputError::OneVsAll,
                centre,
                route: route(raw, outputs, rule),
                batch: Batch::new(batch).unwrap(),
                mantissas: (0..count as i64)
                    .map(|at| RateMantissa::new(1 + (mantissa - 1 + 4 * at) % 15).unwrap())
                    .collect(),
                rates,
                decay,
                optimisers: vec![Optimiser::Plain; count],
                centred: vec![false; count],
                control,
                // every update, every second, every third, or never
                refresh: NonZeroU32::new((seed >> 7) as u32 % 4),
            };
            let augment = image.then(|| moved(sides[0])).flatten();
            let coding = Coding::Values;
            let experiment = Experiment { seed, hardware, network, epochs, coding, augment };
            let data = examples(seed, sides[0], outputs.max(2));
            Run { experiment, data, stop: stop.min(epochs) }
        })
        .prop_filter("a rate that no shift stands for", |run| {
            let checked = run.experiment.check();
            let rate = checked.as_ref().err().map(|error| error.key());
            assert!(matches!(rate, None | Some("learning.rate")), "{checked:?}");
            checked.is_ok()
        })
}

const IDENTITY: Identity<'_> = Identity { run: "run", data: "data" };

fn fresh(run: &Run, backend: Backend) -> Trainer {
    let seeded = run.experiment.build(backend, &run.data).unwrap();
    let mut trainer = Trainer::new(run.experiment.clone(), seeded);
    trainer.calibrate(&run.data);
    trainer
}

/// Trains up to an epoch; the state after each.
fn go_on(run: &Run, trainer: &mut Trainer, until: u32) -> Vec<String> {
    let mut hashes = vec![hash::state(trainer)];
    let again = matches!(
        run.experiment.hardware.adc,
        Adc::Finite { range: AdcRange::Calibrated { every_epoch: true, .. }, .. }
    );
    while trainer.epoch() < until {
        if again && trainer.epoch() > 0 {
            trainer.calibrate(&run.data);
        }
        trainer.learn(&run.data, &mut |_| true).unwrap();
        trainer.evaluate(&run.data);
        hashes.push(hash::state(trainer));
    }
    hashes
}

fn whole(run: &Run, backend: Backend, threads: usize) -> Vec<String> {
    let mut trainer = fresh(run, backend);
    trainer.driver_mut().engine_mut().set_threads(threads).unwrap();
    go_on(run, &mut trainer, run.experiment.epochs)
}

/// Stops after some epochs, learns a little more that is lost, and goes on from the checkpoint.
fn interrupted(run: &Run) -> String {
    let mut first = fresh(run, Backend::best());
    go_on(run, &mut first, run.stop);
    let bytes = checkpoint::write(&mut first, IDENTITY);
    if first.epoch() < run.experiment.epochs {
        let _ = first.learn(&run.data, &mut |_| false);
    }
    let mut second = fresh(run, Backend::best());
    checkpoint::read(&bytes, &mut second, IDENTITY).unwrap();
    go_on(run, &mut second, run.experiment.epochs).pop().unwrap()
}

proptest! {
    // one run in 30 counts samples since ranges were looked at when it stops: few cases would seldom see them restored
    #![proptest_config(config(128))]

    #[test]
    fn law_3_a_run_has_one_state(run in run(), tiles in (1usize..=200, 1usize..=200)) {
        let want = whole(&run, Backend::best(), 1);
        for backend in Backend::available() {
            let got = whole(&run, backend, 2);
            prop_assert_eq!(&got, &want, "{} on 2 threads", backend.name());
        }
        prop_assert_eq!(Some(&interrupted(&run)), want.last(), "stopped after {}", run.stop);
        // another tile has another converter, and its noise
        let chip = &run.experiment.hardware;
        let quiet = chip.read_noise.is_none() && chip.conducting().is_none();
        if run.experiment.hardware.adc == Adc::Ideal && quiet {
            let mut cut = run.clone();
            let smaller = |h: &mut HardwareSpec| (h.tile.rows, h.tile.columns) = tiles;
            cut.experiment.hardware = cut.experiment.hardware.with(smaller).unwrap();
            prop_assert_eq!(&whole(&cut, Backend::best(), 1), &want, "cut into {:?}", tiles);
        }
    }
}
