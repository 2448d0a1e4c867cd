//! Runs with convolutions: pools, thresholds, gains that follow, centred updates, every optimiser, transposed reads.

use dalean::chip::crossbar::kernel::ConvShape;
use dalean::chip::layer::Gain;
use dalean::num::tables::Activation;

use super::*;

/// What a layer of units between input and output does beside its table.
fn middle() -> impl Strategy<Value = (Activation, Homeostasis)> {
    let ramps =
        (any::<bool>(), prop::sample::select(vec![Gain::Tracking, Gain::Fixed { spread: 1 }]));
    let ramps = ramps.prop_map(|(threshold, gain)| {
        (Activation::Ramp, Homeostasis { threshold, gain, window_log2: 6 })
    });
    prop_oneof![ramps, activation().prop_map(|activation| (activation, Homeostasis::OFF))]
}

fn optimiser() -> impl Strategy<Value = Optimiser> {
    prop::sample::select(vec![
        Optimiser::Plain,
        Optimiser::Rms,
        Optimiser::Sign { dead_zone: true },
        Optimiser::Momentum { decay: 3 },
        Optimiser::AdamFx { first_decay: 3, second_decay: 6 },
    ])
}

/// A convolution, a pool, perhaps a hidden layer, and outputs.
fn windows() -> impl Strategy<Value = Run> {
    let shape = (1usize..=3, 1usize..=2, 0usize..=1, 1usize..=2)
        .prop_filter("some pixels are only border", |(side, stride, pad, _)| {
            pad < side && stride <= side
        });
    let pool =
        prop::sample::select(vec![Pool::None, Pool::Average { side: 2 }, Pool::Max { side: 2 }]);
    let units = (1usize..=70, prop::option::of(1usize..=20), 2usize..=6);
    let rules = prop::sample::select(vec![Rule::Ed, Rule::Dfa, Rule::Bp, Rule::Bp]);
    let learning = (rules, optimiser(), any::<[bool; 2]>(), any::<[u8; 2]>(), 2i64..=12, -1i32..=3);
    let times = (any::<u64>(), 1u32..=2, 0u32..=1);
    (shape, pool, units, middle(), middle(), hardware(200), (learning, times))
        .prop_map(|((side, stride, pad, channels), pool, units, first, second, hardware, rest)| {
            let ((rule, optimiser, [centred, softmax], raw, batch, weight), (seed, epochs, stop)) =
                rest;
            let (units, hidden, outputs) = units;
            // the least image that positions and a square of two fill
            let size = side + 3 * stride - 2 * pad;
            let shape = ConvShape { channels, height: size, width: size, side, stride, pad };
            let wiring = |last: bool| match rule {
                Rule::Dfa | Rule::Bp => Wiring::Single,
                _ if last => Wiring::DualReadout,
                _ => Wiring::Dual,
            };
            let layer = |inputs, units, last, (activation, homeostasis)| LayerSpec {
                inputs,
                units,
                wiring: wiring(last),
                driven_by: DrivenBy::Streams,
                activation,
                weight_max_log2: weight,
                initial: InitialLevels::Uniform { gain_64ths: [96, 64] },
                constant_row: raw[1] % 3 == 0,
                convolution: None,
                copies: 1,
                pool: Pool::None,
                homeostasis,
            };
            let mut layers = vec![LayerSpec {
                driven_by: DrivenBy::Shared,
                convolution: Some(shape),
                copies: 1,
                pool,
                ..layer(shape.rows(), units, false, first)
            }];
            let mut inputs = layers[0].sample_outputs();
            if let Some(hidden) = hidden {
                layers.push(layer(inputs, hidden, false, second));
                inputs = hidden;
            }
            let sigmoid = Activation::Sigmoid(Positive::new(4.0).unwrap());
            layers.push(layer(inputs, outputs, true, (sigmoid, Homeostasis::OFF)));
            let backwards = |h: &mut HardwareSpec| {
                h.tile.transposed_read = true;
                if rule == Rule::Bp {
                    h.adc = Adc::Ideal;
                }
            };
            let count = layers.len();
            let error = if softmax {
                OutputError::Softmax { temperature: Positive::ONE }
            } else {
                OutputError::OneVsAll
            };
            let network = NetworkSpec {
                layers,
                rule,
                mode: UpdateMode::Accumulate,
                error,
                centre: Centre::Batch,
                route: route(raw, outputs, rule),
                batch: Batch::new(batch).unwrap(),
                mantissas: vec![RateMantissa::new(1).unwrap(); count],
                rates: vec![
                    Positive::new(if optimiser == Optimiser::Plain { 20.0 } else { 0.3 })
                        .unwrap();
                    count
                ],
                decay: Decay::Cosine,
                optimisers: vec![optimiser; count],
                centred: vec![centred; count],
                control: Control::None,
                refresh: None,
            };
            let experiment = Experiment {
                seed,
                hardware: hardware.with(backwards).unwrap(),
                network,
                epochs,
                coding: Coding::Pixels { image: [size, size, channels] },
                augment: None,
            };
            let data = examples(seed, size * size * channels, outputs);
            Run { experiment, data, stop: stop.min(epochs) }
        })
        .prop_filter(
            "a rate that no shift stands for, a rule that a chip cannot carry out",
            |run| run.experiment.check().is_ok(),
        )
}

proptest! {
    #![proptest_config(config(96))]

    #[test]
    fn law_3_a_run_with_convolutions_has_one_state(run in windows()) {
        let want = whole(&run, Backend::best(), 1);
        for backend in Backend::available() {
            let got = whole(&run, backend, 3);
            prop_assert_eq!(&got, &want, "{} on 3 threads", backend.name());
        }
        prop_assert_eq!(Some(&interrupted(&run)), want.last(), "stopped after {}", run.stop);
        if run.experiment.hardware.adc == Adc::Ideal {
            let mut cut = run.clone();
            let smaller = |h: &mut HardwareSpec| (h.tile.rows, h.tile.columns) = (7, 5);
            cut.experiment.hardware = cut.experiment.hardware.with(smaller).unwrap();
            prop_assert_eq!(&whole(&cut, Backend::best(), 1), &want, "cut into tiles of 7 x 5");
        }
        let mut shared = run.clone();
        let first = &mut shared.experiment.network.layers[0];
        first.copies = first.positions().min(2 + run.stop as usize);
        if shared.experiment.check().is_ok() {
            prop_assert_eq!(&whole(&shared, Backend::best(), 1), &want, "shared out among copies");
        }
    }
}

/// The runs above are not all of one kind, and cells do move in them.
#[test]
fn runs_with_convolutions_are_of_every_kind() {
    use proptest::strategy::ValueTree;
    use proptest::test_runner::TestRunner;
    let mut runner = TestRunner::deterministic();
    let (mut kinds, mut moved) = (std::collections::BTreeSet::new(), 0);
    for _ in 0..60 {
        let run = windows().new_tree(&mut runner).unwrap().current();
        let network = &run.experiment.network;
        let first = &network.layers[0];
        kinds.insert(format!("{:?}", network.rule));
        kinds.insert(format!("{:?}", network.optimisers[0]));
        kinds.insert(format!("{:?}", first.pool));
        kinds.insert(format!("{:?}", first.homeostasis.gain));
        kinds.insert(format!("centred {}", network.centred[0]));
        let hashes = whole(&run, Backend::best(), 1);
        moved += usize::from(hashes.first() != hashes.last());
    }
    assert!(kinds.len() >= 3 + 5 + 3 + 3 + 2, "{kinds:?}");
    assert!(moved >= 50, "of 60 runs {moved} moved");
}
