use super::*;
use crate::chip::layer::{DrivenBy, Homeostasis, InitialLevels, Optimiser, Pool};
use crate::learn::error::{Centre, OutputError};
use crate::learn::route::Route;
use crate::learn::rule::{Control, Readout, Rule};
use crate::num::fixed::{Batch, RateMantissa};
use crate::num::tables::{Activation, Decay, Positive};

const PLACE: NetworkPlace = NetworkPlace { seed: 7, first_layer: 0, updates: 10 };

/// 5 to 70 to 3.
fn network(rule: Rule, mode: UpdateMode) -> NetworkSpec {
    let activation = Activation::Sigmoid(Positive::new(4.0).unwrap());
    let layer = |inputs, units, last: bool| LayerSpec {
        inputs,
        units,
        wiring: rule.wiring(last.then_some(Readout::P)),
        driven_by: if last { DrivenBy::Streams } else { DrivenBy::Shared },
        activation,
        weight_max_log2: 2,
        initial: InitialLevels::Uniform { gain_64ths: [96, 32] },
        constant_row: true,
        convolution: None,
        copies: 1,
        pool: Pool::None,
        homeostasis: Homeostasis::OFF,
    };
    NetworkSpec {
        layers: vec![layer(5, 70, false), layer(70, 3, true)],
        rule,
        mode,
        error: OutputError::OneVsAll,
        centre: Centre::None,
        route: (rule != Rule::Bp).then_some(Route::Modulo { taps: 1, shift: None }),
        batch: Batch::new(4).unwrap(),
        mantissas: vec![RateMantissa::new(1).unwrap(); 2],
        rates: vec![Positive::new(20.0).unwrap(); 2],
        decay: Decay::Constant,
        optimisers: vec![Optimiser::Plain; 2],
        centred: vec![false; 2],
        control: Control::None,
        refresh: None,
    }
}

fn chip() -> Hardware {
    Hardware::reference().with(|parts| parts.tile.transposed_read = true).unwrap()
}

fn driven(rule: Rule, mode: UpdateMode, words: HiddenWords) -> DrivenNetwork {
    DrivenNetwork::new(&network(rule, mode), &chip(), Backend::Scalar, PLACE, words).unwrap()
}

fn levels(engine: &Engine) -> Vec<u16> {
    let arrays = engine.layers().iter().flat_map(|layer| &layer.arrays);
    arrays.flat_map(|array| array.levels()).collect()
}

#[test]
fn driven_from_outside_a_network_learns_as_a_driver_has_it() {
    use UpdateMode::{Accumulate, Online, Replay};
    let codes: Vec<u8> = (0..20).map(|at| (at * 37 % 256) as u8).collect();
    for (rule, mode) in [
        (Rule::Ed, Accumulate),
        (Rule::Ed, Replay),
        (Rule::Ed, Online),
        (Rule::EdNonDalean, Accumulate),
        (Rule::Bp, Accumulate),
    ] {
        let mut driver = network(rule, mode).build(&chip(), Backend::Scalar, PLACE).unwrap();
        let mut outside = driven(rule, mode, HiddenWords::Routed);
        assert_eq!(levels(driver.engine()), levels(outside.engine()));
        let batch = if mode == Online { 1 } else { 4 };
        for codes in codes.chunks(batch * 5) {
            let errors = |activities: &[u8]| -> Vec<i32> {
                let wanted = [255, 0, 90].into_iter().cycle();
                wanted.zip(activities).map(|(want, &is)| want - i32::from(is)).collect()
            };
            driver.learn(codes, |engine, _, list| {
                let of = |sample| (0..3).map(move |at| engine.output_activity(sample, at));
                let activities: Vec<u8> = (0..engine.samples()).flat_map(of).collect();
                list.extend(errors(&activities));
            });
            outside.read(codes, true).unwrap();
            let errors = errors(&outside.codes(1, 'p').unwrap());
            let words = outside.error_words(&errors).unwrap();
            outside.deliver(&words).unwrap();
            outside.write(&[]).unwrap();
        }
        assert_eq!(levels(driver.engine()), levels(outside.engine()), "{rule:?} {mode:?}");
        let of = |engine: &Engine| engine.ledger(Phase::Training).clone();
        assert_eq!(of(driver.engine()), of(outside.engine()), "{rule:?} {mode:?}");
        assert_eq!(driver.updates(), outside.updates());
    }
}

#[test]
fn words_of_its_own_reach_one_unit_each_and_write_that_layer_alone() {
    let mut outside = driven(Rule::Ed, UpdateMode::Accumulate, HiddenWords::Own);
    outside.read(&[255; 5], true).unwrap();
    let slopes = outside.slopes(0, 'n').unwrap();
    let mut words = vec![0; 70];
    words[66] = 100;
    outside.deliver_to(0, &words).unwrap();
    let (p, n) = (outside.gates(0, 'p').unwrap(), outside.gates(0, 'n').unwrap());
    let gate = crate::chip::periphery::gate;
    let bits = outside.engine().hardware().digital.error_bits;
    assert_eq!(n[66], gate(-100, slopes[66], bits).0);
    assert!(p[66] > 0 && p.iter().enumerate().all(|(at, &u)| at == 66 || u == 0));
    let before = [0, 1].map(|layer| outside.levels(layer, "pp").unwrap());
    outside.write(&[Some(0)]).unwrap();
    let after = [0, 1].map(|layer| outside.levels(layer, "pp").unwrap());
    assert_eq!(before[1], after[1]);
    let moved = before[0].iter().zip(&after[0]).enumerate().filter(|(_, (b, a))| b != a);
    let columns: Vec<usize> = moved.map(|(at, _)| at % 70).collect();
    assert_eq!(columns, [66; 6]);
}

#[test]
fn what_cannot_be_done_is_refused_and_moves_nothing() {
    let mut outside = driven(Rule::Ed, UpdateMode::Accumulate, HiddenWords::Routed);
    let said = |error: DriveError| error.to_string();
    assert!(said(outside.read(&[0; 4], true).unwrap_err()).contains("a sample has 5"));
    assert!(said(outside.codes(0, 'p').unwrap_err()).contains("read something first"));
    assert!(said(outside.deliver(&[0; 3]).unwrap_err()).contains("with learning on"));
    outside.read(&[9; 5], false).unwrap();
    assert!(said(outside.deliver(&[0; 3]).unwrap_err()).contains("with learning on"));
    outside.read(&[9; 5], true).unwrap();
    for (words, wanted) in [(&[0i16; 2][..], "have 3"), (&[0, 300, 0], "-127..=127")] {
        assert!(said(outside.deliver(words).unwrap_err()).contains(wanted));
    }
    assert!(said(outside.deliver_to(0, &[0; 70]).unwrap_err()).contains("deliver to all"));
    assert!(said(outside.read_back(1).unwrap_err()).contains("differential pairs"));
    assert!(said(outside.levels(2, "pp").unwrap_err()).contains("numbered from 0"));
    assert!(said(outside.levels(1, "nn").unwrap_err()).contains("pp, np"));
    assert!(said(outside.codes(1, 'n').unwrap_err()).contains("'p' alone"));
    assert!(said(outside.load(1, "pp", &[1; 3]).unwrap_err()).contains("71 rows of 3 cells"));
    assert!(said(outside.write(&[Some(31)]).unwrap_err()).contains("deliver error words"));
    outside.deliver(&[1, 2, 3]).unwrap();
    assert!(said(outside.write(&[Some(31)]).unwrap_err()).contains("0..=30"));
    outside.write(&[]).unwrap();
    // a batch is learnt from once
    assert!(said(outside.deliver(&[1, 2, 3]).unwrap_err()).contains("with learning on"));
}
