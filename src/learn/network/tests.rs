use super::*;
use crate::chip::crossbar::kernel::ConvShape;
use crate::chip::engine::Phase;
use crate::chip::hardware::{Adc, AdcRange, HardwareSpec, Subtract, WriteScheme};
use crate::chip::layer::{DrivenBy, Gain, Homeostasis, Pool};
use crate::chip::ledger::{During, Event};
use crate::chip::population::Wiring;
use crate::learn::rule::Readout;
use crate::num::fixed::{AdcBits, ResidualBits};
use crate::num::tables::Activation;

const SOFTMAX: OutputError = OutputError::Softmax { temperature: Positive::ONE };
const MIDDLE: Homeostasis = Homeostasis { threshold: true, ..Homeostasis::OFF };

/// 5 to 4 to 3 units by error diffusion: as plain as can be.
fn plain() -> NetworkSpec {
    let layer = |inputs, units, wiring| LayerSpec {
        inputs,
        units,
        wiring,
        driven_by: if inputs == 5 { DrivenBy::Shared } else { DrivenBy::Streams },
        activation: Activation::Sigmoid(Positive::new(4.0).unwrap()),
        weight_max_log2: 2,
        initial: InitialLevels::Uniform { gain_64ths: [96, 32] },
        constant_row: false,
        convolution: None,
        copies: 1,
        pool: Pool::None,
        homeostasis: Homeostasis::OFF,
    };
    NetworkSpec {
        layers: vec![layer(5, 4, Wiring::Dual), layer(4, 3, Wiring::DualReadout)],
        rule: Rule::Ed,
        mode: UpdateMode::Accumulate,
        error: OutputError::OneVsAll,
        centre: Centre::Batch,
        route: Some(Route::Modulo { taps: 1, shift: None }),
        batch: Batch::new(8).unwrap(),
        mantissas: vec![RateMantissa::new(1).unwrap(); 2],
        rates: vec![Positive::new(20.0).unwrap(); 2],
        decay: Decay::Constant,
        optimisers: vec![Optimiser::Plain; 2],
        centred: vec![false; 2],
        control: Control::None,
        refresh: None,
    }
}

/// The same, by pulses towards sums.
fn signs() -> NetworkSpec {
    let optimisers = vec![Optimiser::Sign { dead_zone: false }; 2];
    NetworkSpec { optimisers, rates: vec![Positive::ONE; 2], ..plain() }
}

fn baseline(rule: Rule) -> NetworkSpec {
    let mut network = plain();
    network.layers.iter_mut().for_each(|layer| layer.wiring = Wiring::Single);
    network.route = (rule == Rule::Dfa).then_some(Route::RandomDense { shift: None });
    network.rule = rule;
    network
}

fn modulo(taps: usize, shift: Option<u32>) -> Option<Route> {
    Some(Route::Modulo { taps, shift })
}

const PLACE: NetworkPlace = NetworkPlace { seed: 7, first_layer: 0, updates: 10 };

fn build(network: &NetworkSpec, place: NetworkPlace) -> Result<Driver, NetworkError> {
    network.build(&Hardware::reference(), Backend::Scalar, place)
}

/// What is wrong with a network after a change: nothing builds that the check refuses.
fn refused(network: &NetworkSpec) -> NetworkError {
    let error = network.check(&Hardware::reference()).unwrap_err();
    assert_eq!(build(network, PLACE).err().as_ref(), Some(&error));
    assert!(network.rates_effective(&Hardware::reference()).is_err());
    error
}

#[test]
fn everything_that_does_not_fit_together_is_refused_with_its_key() {
    type Change = fn(&mut NetworkSpec);
    let cases: [(&str, &str, Change); 60] = [
        ("network.hidden", "0 layers", |n| n.layers.clear()),
        ("network.hidden", "a layer of 0 units", |n| n.layers[1].units = 0),
        ("network.hidden", "a layer of 0 inputs", |n| n.layers[0].inputs = 0),
        ("network.hidden", "4 units, and layer 1 9 inputs", |n| n.layers[1].inputs = 9),
        ("network.hidden", "at most 65535", |n| n.layers[0].inputs = usize::MAX),
        ("network.hidden", "at most 65535", |n| {
            n.layers[0].inputs = usize::MAX;
            n.layers[0].constant_row = true;
        }),
        ("network.hidden", "65 layers", |n| {
            let mut layer = n.layers[0].clone();
            layer.inputs = layer.units;
            n.layers.splice(1..1, std::iter::repeat_n(layer, 63));
            n.rates = vec![Positive::ONE; 65];
        }),
        ("network.weight_max", "of layer 0 is 2^9", |n| n.layers[0].weight_max_log2 = 9),
        ("network.weight_max", "of layer 1 is 2^-9", |n| n.layers[1].weight_max_log2 = -9),
        ("network.init_gain", "1025/64", |n| {
            n.layers[0].initial = InitialLevels::Uniform { gain_64ths: [1024, 1025] }
        }),
        ("network.init_gain_output", "0/64", |n| {
            n.layers[1].initial = InitialLevels::Uniform { gain_64ths: [0, 1] }
        }),
        ("network.init_gain", "of layer 0 is 0/3", |n| {
            n.layers[0].initial = InitialLevels::AbsGaussian { gain: [0, 3] }
        }),
        ("network.init_gain", "of layer 0 is 33/2", |n| {
            n.layers[0].initial = InitialLevels::AbsGaussian { gain: [33, 2] }
        }),
        ("network.activation", "only hidden layers", |n| n.layers[1].activation = Activation::Rms),
        ("network.activation", "keeps the accumulators of layer 0", |n| {
            n.layers[0].activation = Activation::Accumulator
        }),
        ("learning.centre", "the task hands the errors", |n| {
            n.layers[1].activation = Activation::Accumulator
        }),
        ("learning.rule", "have two populations above and below", |n| {
            (n.layers[1].activation, n.centre) = (Activation::Accumulator, Centre::None)
        }),
        ("network.hidden", "normalised drives for each stream", |n| {
            n.layers[0].activation = Activation::Rms
        }),
        ("learning.rule", "two classes", |n| n.rule = Rule::Kaneko),
        ("learning.rule", "make arrays that are differential pairs", |n| {
            (n.rule, n.route) = (Rule::Dfa, Some(Route::RandomDense { shift: None }));
        }),
        ("learning.rule", "read one of two populations out", |n| n.layers[1].wiring = Wiring::Dual),
        ("learning.rule", "have two populations above and below", |n| {
            n.layers[0].wiring = Wiring::Single
        }),
        ("network.hidden", "give it one set of drives", |n| {
            n.layers[0].driven_by = DrivenBy::Streams
        }),
        ("network.hidden", "give it a set of drives for each stream", |n| {
            n.layers[1].driven_by = DrivenBy::Shared
        }),
        ("learning.centre", "one sample has no mean", |n| n.mode = UpdateMode::Online),
        ("learning.centre", "larger learning.batch", |n| n.batch = Batch::new(1).unwrap()),
        ("learning.route", "is missing", |n| n.route = None),
        ("learning.route", "leave the key out", |n| {
            *n = NetworkSpec { route: modulo(1, None), ..baseline(Rule::Bp) };
        }),
        ("learning.route", "random dense feedback", |n| {
            *n = NetworkSpec { route: modulo(1, None), ..baseline(Rule::Dfa) };
        }),
        ("learning.taps", "in 1..=3", |n| n.route = modulo(0, None)),
        ("learning.taps", "in 1..=3", |n| n.route = modulo(4, None)),
        ("learning.tap_shift", "no sum", |n| n.route = modulo(1, Some(0))),
        ("learning.tap_shift", "at most 16", |n| n.route = modulo(2, Some(17))),
        ("learning.control", "no hidden layer to freeze", |n| {
            n.layers.remove(0);
            n.layers[0].driven_by = DrivenBy::Shared;
            n.control = Control::FrozenHidden;
        }),
        ("learning.control", "no hidden layer that could hear", |n| {
            n.layers.remove(0);
            n.layers[0].driven_by = DrivenBy::Shared;
            n.control = Control::SameSignHidden;
        }),
        ("learning.control", "no layer has a stream n", |n| {
            n.layers.remove(0);
            n.layers[0].driven_by = DrivenBy::Shared;
            n.control = Control::SameSign;
        }),
        ("learning.control", "no layer has a stream n", |n| {
            *n = NetworkSpec { control: Control::SameSignHidden, ..baseline(Rule::Dfa) };
        }),
        ("learning.rate_multipliers", "makes 1 rates", |n| n.rates.truncate(1)),
        ("learning.rate", "layer 1 a k of 33", |n| {
            n.rates[1] = Positive::new(5e-6).unwrap();
        }),
        ("learning.optimiser", "of 1 layers", |n| n.optimisers.truncate(1)),
        ("learning.centred", "of 0 layers", |n| n.centred.clear()),
        ("learning.optimiser", "learning.mode = \"accumulate\"", |n| {
            (n.mode, n.optimisers[1]) = (UpdateMode::Replay, Optimiser::Rms);
        }),
        ("learning.centred", "learning.mode = \"accumulate\"", |n| {
            (n.mode, n.centred[0]) = (UpdateMode::Replay, true);
        }),
        ("learning.optimiser", "leave learning.rate_mantissa at 1", |n| {
            n.optimisers[0] = Optimiser::Sign { dead_zone: true };
            n.rates[0] = Positive::ONE;
            n.mantissas[0] = RateMantissa::new(3).unwrap();
        }),
        ("learning.optimiser", "forgets 2^-9 in layer 1", |n| {
            n.optimisers[1] = Optimiser::Momentum { decay: 9 };
        }),
        ("learning.optimiser", "forgets 2^-0 in layer 0", |n| {
            n.optimisers[0] = Optimiser::AdamFx { first_decay: 3, second_decay: 0 };
        }),
        ("learning.rate", "layer 0 a chance of 2^-17", |n| {
            n.optimisers[0] = Optimiser::Sign { dead_zone: false };
            n.rates[0] = Positive::new(1e-5).unwrap();
        }),
        ("learning.rate", "layer 0 a k of -4", |n| {
            n.optimisers[0] = Optimiser::Sign { dead_zone: false };
            n.rates[0] = Positive::new(20.0).unwrap();
        }),
        ("learning.rate", "words of 16 bits give 2^-15 at least", |n| {
            *n = baseline(Rule::Dfa);
            n.optimisers[1] = Optimiser::Sign { dead_zone: false };
            n.rates[1] = Positive::new(1.0 / 65_536.0).unwrap();
        }),
        ("learning.error", "outputs of such a network keep theirs", |n| n.error = SOFTMAX),
        ("learning.error", "of one output", |n| {
            (n.error, n.layers[1].units) = (SOFTMAX, 1);
            n.layers[1].activation = Activation::Accumulator;
        }),
        ("learning.rule", "read one of two populations out", |n| {
            (n.error, n.layers[1].wiring) = (SOFTMAX, Wiring::Dual);
            n.layers[1].activation = Activation::Accumulator;
        }),
        ("network.gain", "have to be found", |n| n.layers[0].activation = Activation::Ramp),
        ("network.gain", "which is no ramp", |n| n.layers[0].homeostasis.gain = Gain::Tracking),
        ("network.threshold", "layer 1, the output", |n| n.layers[1].homeostasis = MIDDLE),
        ("network.threshold", "layer 0, which is normalised", |n| {
            n.layers[0].activation = Activation::Rms;
            n.layers[0].homeostasis = MIDDLE;
        }),
        ("network.gain_spread", "of layer 0 is 3", |n| {
            n.layers[0].activation = Activation::Ramp;
            n.layers[0].homeostasis.gain = Gain::Fixed { spread: 3 };
        }),
        ("network.homeostasis_window", "of layer 0 is 4 samples", |n| {
            n.layers[0].homeostasis = Homeostasis { window_log2: 2, ..MIDDLE };
        }),
        ("network.homeostasis_window", "is 2^25 samples", |n| {
            n.layers[0].homeostasis = Homeostasis { window_log2: 25, ..MIDDLE };
        }),
        ("learning.rate", "layer 0 a k of -2", |n| n.rates[0] = Positive::new(1e5).unwrap()),
    ];
    for (key, words, change) in cases {
        let mut network = plain();
        change(&mut network);
        let error = refused(&network);
        assert_eq!(error.key(), key, "{error}");
        assert!(error.to_string().contains(words), "no `{words}` in {error}");
    }
}

#[test]
fn sums_of_a_batch_that_64_bits_may_not_hold_are_refused() {
    // 61,440 rows of 255 x 255 with 8 fractional bits, in 256 samples of 181 x 181 positions
    let shape = ConvShape { channels: 3840, height: 184, width: 184, side: 4, stride: 1, pad: 0 };
    let network = |shape: ConvShape| {
        let mut network = plain();
        let [hidden, last] = &mut network.layers[..] else { panic!("two layers") };
        (hidden.inputs, hidden.units) = (16 * shape.channels, 1);
        hidden.convolution = Some(shape);
        hidden.homeostasis = MIDDLE;
        last.inputs = hidden.sample_outputs();
        NetworkSpec { batch: Batch::new(2).unwrap(), ..network }
    };
    let error = network(shape).check(&Hardware::reference()).unwrap_err();
    let words = error.to_string();
    assert!(error.key() == "network.threshold" && words.contains("adds up to 2^63"), "{error}");
    let smaller = ConvShape { height: 131, width: 131, ..shape };
    let error = network(smaller).check(&Hardware::reference()).err();
    assert!(error.is_none_or(|error| error.key() == "learning.rate"));
}

#[test]
fn what_lies_at_the_edge_is_built() {
    let cases = [
        NetworkSpec { route: modulo(3, Some(16)), ..plain() },
        {
            let mut network = plain();
            network.layers[0].homeostasis = Homeostasis { window_log2: 3, ..MIDDLE };
            network
        },
        {
            let mut network = NetworkSpec { rates: vec![Positive::ONE; 2], ..plain() };
            network.layers[0].activation = Activation::Ramp;
            network.layers[0].homeostasis.gain = Gain::Fixed { spread: 2 };
            network
        },
        {
            let mut network = NetworkSpec { error: SOFTMAX, ..plain() };
            network.layers[1].activation = Activation::Accumulator;
            network.rates[1] = Positive::ONE;
            network
        },
        NetworkSpec { route: Some(Route::RandomSparse), ..plain() },
        NetworkSpec { route: Some(Route::ScalarBroadcast), ..plain() },
        NetworkSpec { mode: UpdateMode::Online, centre: Centre::Running, ..plain() },
        NetworkSpec { batch: Batch::new(1).unwrap(), centre: Centre::None, ..plain() },
        baseline(Rule::Dfa),
        baseline(Rule::Bp),
        NetworkSpec { control: Control::FrozenHidden, ..baseline(Rule::Bp) },
        NetworkSpec { control: Control::FrozenHidden, ..plain() },
        NetworkSpec { control: Control::SameSignHidden, ..plain() },
        NetworkSpec { control: Control::SameSign, ..plain() },
        NetworkSpec {
            optimisers: vec![Optimiser::Sign { dead_zone: true }; 2],
            rates: vec![Positive::ONE, Positive::new(1.0 / 65_536.0).unwrap()],
            centred: vec![true, false],
            ..plain()
        },
        NetworkSpec {
            optimisers: vec![Optimiser::Rms, Optimiser::Momentum { decay: 8 }],
            ..plain()
        },
    ];
    for network in cases {
        let driver = build(&network, PLACE).unwrap();
        let layers = driver.engine().layers();
        let cells: usize =
            layers.iter().flat_map(|l| &l.arrays).map(|array| array.layout().cells()).sum();
        let loaded = driver.engine().ledger(Phase::Training).total(Event::CellLoads);
        assert_eq!(loaded, cells as u64, "every cell is loaded, once");
    }
}

#[test]
fn a_chip_that_a_network_does_not_fit_is_refused() {
    type Change = fn(&mut HardwareSpec);
    let cases: [(NetworkSpec, &str, Change); 5] = [
        (baseline(Rule::Bp), "learning.rule", |h| h.tile.transposed_read = false),
        (baseline(Rule::Bp), "learning.rule", |h| {
            let (bits, subtract) = (AdcBits::new(8).unwrap(), Subtract::Digital);
            h.adc = Adc::Finite { bits, subtract, range: AdcRange::Full };
        }),
        (plain(), "learning.mode", |h| h.write.scheme = WriteScheme::Trains { slots_log2: 2 }),
        (signs(), "learning.optimiser", |h| {
            h.write.residual_bits = ResidualBits::new(1).unwrap();
        }),
        (plain(), "hw.tile.count", |h| h.tile.count_max = Some(2)),
    ];
    for (network, key, change) in cases {
        let hardware = Hardware::reference().with(change).unwrap();
        assert_eq!(network.check(&hardware).unwrap_err().key(), key);
    }
}

#[test]
fn networks_whose_layers_are_numbered_through_share_no_draw() {
    let network = NetworkSpec { route: Some(Route::RandomSparse), ..plain() };
    let levels = |driver: &Driver, layer: usize| -> Vec<u16> {
        driver.engine().layers()[layer].arrays.iter().flat_map(|array| array.levels()).collect()
    };
    let actor = build(&network, PLACE).unwrap();
    let critic = build(&network, NetworkPlace { first_layer: 2, ..PLACE }).unwrap();
    let numbers =
        |driver: &Driver| driver.engine().layers().iter().map(|l| l.index).collect::<Vec<_>>();
    assert_eq!((numbers(&actor), numbers(&critic)), (vec![0, 1], vec![2, 3]));
    assert_ne!(levels(&actor, 0), levels(&critic, 0));
    // a number is a place, whoever stands there
    let mut longer = network.clone();
    let mut second = network.layers[0].clone();
    second.inputs = 4;
    second.driven_by = DrivenBy::Streams;
    longer.layers.insert(1, second.clone());
    longer.layers.insert(1, second);
    longer.rates = vec![network.rates[0]; 4];
    longer.mantissas = vec![network.mantissas[0]; 4];
    (longer.optimisers, longer.centred) = (vec![Optimiser::Plain; 4], vec![false; 4]);
    let longer = build(&longer, PLACE).unwrap();
    assert_eq!(levels(&longer, 3), levels(&critic, 1));
    assert_ne!(levels(&longer, 3), levels(&actor, 1));
    // and there are so many
    let last = NetworkPlace { first_layer: u16::MAX - 1, ..PLACE };
    assert!(build(&network, last).is_ok());
    let error = build(&network, NetworkPlace { first_layer: u16::MAX, ..PLACE }).unwrap_err();
    assert!(error.to_string().contains("behind 65535 others"), "{error}");
}

#[test]
fn effective_rates_are_those_of_whole_shifts() {
    let network = plain();
    let hardware = Hardware::reference();
    let effective = network.rates_effective(&hardware).unwrap();
    let driver = build(&network, PLACE).unwrap();
    for (layer, rate) in effective.iter().enumerate() {
        // the rate that a shift really gives is given back by asking for it
        let mut again = network.clone();
        again.rates[layer] = *rate;
        assert_eq!(again.rates_effective(&hardware).unwrap()[layer], *rate);
        assert_eq!(build(&again, PLACE).unwrap().shift(layer), driver.shift(layer));
        assert_ne!(*rate, network.rates[layer]);
    }
}

#[test]
fn a_table_whose_steps_are_too_great_to_shift_by_is_refused() {
    let mut network = plain();
    network.layers[0].weight_max_log2 = -8;
    network.layers[0].activation = Activation::Sigmoid(Positive::new(1e6).unwrap());
    network.rates[0] = Positive::new(1e6).unwrap();
    let hardware = Hardware::reference()
        .with(|h| h.digital.lut_bits = crate::num::fixed::LutBits::new(2).unwrap())
        .unwrap();
    let error = network.check(&hardware).unwrap_err();
    assert_eq!(error.key(), "network.alpha");
    // 2 2^(lsh - 16) / (256 x 255) reaches 4,000,000 at 2^45; a table of 14 bits needs 2^12 less, and a smaller alpha
    assert!(
        error.to_string().contains("2^45 units") && error.to_string().contains("2^15 times"),
        "{error}"
    );
    network.layers[0].activation = Activation::Sigmoid(Positive::new(16.0).unwrap());
    assert!(
        network.check(&hardware).is_ok()
            || network.check(&hardware).unwrap_err().key() == "learning.rate"
    );
}

/// A hidden layer that is normalised, and a readout.
fn normalised(rule: Rule) -> NetworkSpec {
    let mut network = match rule {
        Rule::Dfa | Rule::Bp => baseline(rule),
        _ => NetworkSpec { rule, ..plain() },
    };
    network.centre = Centre::None;
    let [hidden, last] = &mut network.layers[..] else { panic!("two layers") };
    (hidden.activation, last.activation) = (Activation::Rms, Activation::Accumulator);
    (hidden.wiring, last.wiring) = (rule.wiring(None), rule.wiring(Some(Readout::All)));
    last.driven_by = DrivenBy::Normalised;
    hidden.initial = InitialLevels::AbsGaussian { gain: [1, 1] };
    last.initial = InitialLevels::AbsGaussian { gain: [1, 10] };
    network
}

#[test]
fn every_rule_learns_from_errors_that_a_task_hands() {
    let both = |h: &mut HardwareSpec| h.tile.transposed_read = true;
    let hardware = Hardware::reference().with(both).unwrap();
    for rule in [Rule::Ed, Rule::EdNonDalean, Rule::Dfa, Rule::Bp] {
        let network = normalised(rule);
        let mut driver = network.build(&hardware, Backend::best(), PLACE).unwrap();
        let mean_percent = |layer: usize| {
            let arrays = driver.engine().layers()[layer].arrays.iter();
            let levels: Vec<u64> = arrays.flat_map(|a| a.levels()).map(u64::from).collect();
            100 * levels.iter().sum::<u64>() / levels.len() as u64
        };
        // weight_max 4: 0.8 times a width of 64 / sqrt(2 x 5), and of a tenth of 64 / sqrt(2 x 4)
        assert!((1000..2300).contains(&mean_percent(0)), "{rule:?} {}", mean_percent(0));
        assert!((110..260).contains(&mean_percent(1)), "{rule:?} {}", mean_percent(1));
        let codes: Vec<u8> = (0..5 * 8).map(|at| (at * 37 % 256) as u8).collect();
        let said = |driver: &mut Driver| {
            driver.read(&codes);
            let mut readouts = vec![];
            driver.engine().readouts(&mut readouts);
            readouts.chunks(3).map(|all| all[1]).sum::<i64>()
        };
        let before = said(&mut driver);
        // two up, one down, in numbers of 20 fractional bits
        driver.learn(&codes, |engine, _, list| {
            for _ in 0..engine.samples() {
                list.extend([-1 << 20, 2 << 20, 0]);
            }
        });
        let after = said(&mut driver);
        assert!(after > before, "{rule:?}: {before} became {after}");
        let words = driver.engine_mut().output_words(&[1 << 20, 1 << 23, 0]);
        assert_eq!(words, [32, 127, 0]);
    }
}

/// A convolution with a pool, one without, a dense layer and outputs.
fn windows(rule: Rule, control: Control) -> NetworkSpec {
    let mut network = match rule {
        Rule::Dfa | Rule::Bp => baseline(rule),
        _ => NetworkSpec { rule, ..plain() },
    };
    let classes = if rule == Rule::Kaneko { 1 } else { 3 };
    let shape = ConvShape { channels: 2, height: 6, width: 6, side: 3, stride: 1, pad: 1 };
    let [hidden, last] = &network.layers[..] else { panic!("two layers") };
    let hidden = LayerSpec { wiring: rule.wiring(None), ..hidden.clone() };
    let one = LayerSpec {
        inputs: shape.rows(),
        units: 6,
        convolution: Some(shape),
        copies: 1,
        pool: Pool::Max { side: 2 },
        ..hidden.clone()
    };
    let above = ConvShape { channels: 6, height: 3, width: 3, pad: 0, side: 2, ..shape };
    let driven_by = DrivenBy::Streams;
    let two = LayerSpec {
        inputs: above.rows(),
        units: 5,
        driven_by,
        convolution: Some(above),
        copies: 1,
        ..hidden.clone()
    };
    let dense = LayerSpec { inputs: 20, units: 7, driven_by, ..hidden };
    let wiring = rule.wiring(Some(Readout::P));
    let last = LayerSpec { inputs: 7, units: classes, wiring, driven_by, ..last.clone() };
    network.layers = vec![one, two, dense, last];
    network.rates = vec![Positive::new(20.0).unwrap(); 4];
    network.mantissas = vec![RateMantissa::new(1).unwrap(); 4];
    network.optimisers = vec![Optimiser::Plain; 4];
    network.centred = vec![false; 4];
    NetworkSpec { control, ..network }
}

#[test]
fn copies_are_of_convolutions_and_of_cells_that_are_alike() {
    use crate::chip::device::{Endurance, ReadNoise, Worn};
    use crate::num::fixed::Millionths;
    let plain = Hardware::reference();
    let with = |layer: usize, copies: usize| {
        let mut network = windows(Rule::Ed, Control::None);
        network.layers[layer].copies = copies;
        network
    };
    let refused = |network: NetworkSpec, chip: &Hardware| {
        let error = network.check(chip).unwrap_err();
        assert_eq!(error.key(), "network.copies");
        error.to_string()
    };
    // 36 and 4 positions
    assert!(with(0, 36).check(&plain).is_ok() && with(1, 4).check(&plain).is_ok());
    assert!(refused(with(0, 37), &plain).contains("36 positions"));
    assert!(refused(with(1, 5), &plain).contains("4 positions"));
    assert!(refused(with(2, 2), &plain).contains("dense"));
    assert!(refused(with(0, 0), &plain).contains("once at least"));
    let endurance =
        |spread| Some(Endurance { pulses: 9, spread: Millionths(spread), worn: Worn::Level });
    let alike = plain
        .with(|h| (h.read_noise, h.endurance) = (Some(ReadNoise { sigma: 9 }), endurance(0)))
        .unwrap();
    assert!(with(0, 3).check(&alike).is_ok());
    let differ = plain.with(|h| h.endurance = endurance(1)).unwrap();
    assert!(refused(with(0, 3), &differ).contains("hw.device.endurance.spread"));
    assert!(with(0, 1).check(&differ).is_ok());
}

#[test]
fn every_rule_and_control_learns_through_convolutions() {
    let both = |h: &mut HardwareSpec| h.tile.transposed_read = true;
    let hardware = Hardware::reference().with(both).unwrap();
    let rules = [Rule::Ed, Rule::EdNonDalean, Rule::Kaneko, Rule::Dfa, Rule::Bp];
    let controls =
        [Control::None, Control::FrozenHidden, Control::SameSignHidden, Control::SameSign];
    let other = [Route::RandomSparse, Route::ScalarBroadcast, Route::RandomDense { shift: None }];
    let routes = other.map(|route| (Rule::Ed, Control::None, Some(route)));
    let cases = rules.into_iter().flat_map(|rule| controls.map(|control| (rule, control, None)));
    for (rule, control, route) in cases.chain(routes) {
        let mut network = windows(rule, control);
        network.route = route.or(network.route);
        let built = network.build(&hardware, Backend::best(), PLACE);
        let one_stream = matches!(rule, Rule::Dfa | Rule::Bp);
        if one_stream && matches!(control, Control::SameSign | Control::SameSignHidden) {
            assert_eq!(built.err().map(|e| e.key()), Some("learning.control"), "{rule:?}");
            continue;
        }
        let mut driver = built.unwrap_or_else(|error| panic!("{rule:?} {control:?}: {error}"));
        let codes: Vec<u8> = (0..8 * 72).map(|at| (at * 37 % 256) as u8).collect();
        for _ in 0..3 {
            driver.learn(&codes, |engine, first, list| {
                let outputs = engine.layers()[3].spec.units;
                let samples = first..first + engine.samples();
                list.extend(samples.flat_map(|s| {
                    (0..outputs).map(move |o| (s * 7 + o * 11) as i32 % 23 * 12 - 130)
                }));
            });
        }
        let ledger = driver.engine().ledger(Phase::Training);
        for layer in 0..4 {
            let codes = driver.engine().layers()[layer].spec.wiring.pathways();
            let moved = codes.iter().map(|pathway| {
                ledger.get(layer, pathway.code, During::Update, Event::PulsesEffective)
            });
            let frozen = control == Control::FrozenHidden && layer < 3;
            assert_eq!(moved.sum::<u64>() == 0, frozen, "{rule:?} {control:?} {route:?} {layer}");
        }
    }
}
