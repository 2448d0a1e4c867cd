//! Law 5: a crossbar is a matrix.

use dalean::chip::crossbar::kernel::Backend;
use dalean::chip::engine::{Operation, Phase, Side};
use dalean::chip::hardware::{Adc, AdcRange, Subtract};
use dalean::chip::layer::{DrivenBy, WordSource};
use dalean::chip::ledger::Event;
use dalean::chip::population::{Stream, Wiring};
use dalean::num::fixed::AdcBits;
use dalean::num::tables::Activation;
use proptest::prelude::*;

use super::choose::{Net, Numbers, choices, net, side};
use super::config;
use super::play::{Op, engine, execute, script};

/// `w x`, of a matrix in rows.
fn product(w: &[Vec<i64>], x: &[i64]) -> Vec<i64> {
    w.iter().map(|row| row.iter().zip(x).map(|(w, x)| w * x).sum()).collect()
}

fn transposed(w: &[Vec<i64>]) -> Vec<Vec<i64>> {
    (0..w[0].len()).map(|column| w.iter().map(|row| row[column]).collect()).collect()
}

/// One layer with ideal converters, both reads, derivative 255 everywhere.
fn ideal(mut net: Net) -> Net {
    net.change(|h| (h.adc, h.tile.transposed_read) = (Adc::Ideal, true));
    net.specs[0].activation = Activation::Identity;
    net.specs[0].driven_by = DrivenBy::Shared;
    net.specs[0].constant_row = false;
    if net.specs[0].wiring.pairs(Stream::P).len() > 1 {
        // rows that several pairs share are not read backwards
        net.specs[0].wiring = Wiring::Dual;
    }
    net
}

fn equals_its_product(net: &Net, backend: Backend) {
    let mut engine = engine(net, backend);
    let (inputs, units) = (net.specs[0].inputs, net.specs[0].units);
    let window = net.hardware.cell.window;
    let mut numbers = Numbers(net.seed);
    let mut matrix = vec![vec![0; units]; inputs];
    for (array, sign) in [(0, 1), (1, -1)] {
        for (row, weights) in matrix.iter_mut().enumerate() {
            let level = |_| numbers.within(i64::from(window.floor()), i64::from(window.ceiling()));
            let levels: Vec<i64> = (0..units).map(level).collect();
            weights.iter_mut().zip(&levels).for_each(|(w, level)| *w += sign * level);
            let levels: Vec<u16> = levels.into_iter().map(|level| level as u16).collect();
            engine.execute(&Operation::LoadWeights { layer: 0, array, row, levels: &levels });
        }
    }
    let samples = 1 + numbers.within(0, 12) as usize;
    let greatest = i64::from(net.hardware.drive.bits.code_max());
    let x: Vec<i64> = (0..samples * inputs).map(|_| numbers.within(0, greatest)).collect();
    let codes: Vec<u8> = x.iter().map(|&x| x as u8).collect();
    engine.execute(&Operation::LoadDrives { codes: &codes });
    engine.execute(&Operation::Forward { layer: 0, side: Side::Rows });
    let columns = transposed(&matrix);
    for (sample, x) in x.chunks(inputs).enumerate() {
        let got: Vec<i64> = (0..units).map(|c| engine.output_accumulator(sample, c)).collect();
        assert_eq!(got, product(&columns, x), "{}", backend.name());
    }

    let bits = net.hardware.digital.error_bits.get();
    let rail = (1i64 << (bits - 1)) - 1;
    let taps = &net.deliveries[0].taps;
    let word = |_| numbers.within(-rail, rail) as i16;
    let words: Vec<i16> = (0..samples * taps.width).map(word).collect();
    engine.execute(&Operation::Error {
        layer: 0,
        samples: 0..samples,
        words: &words,
        shared: false,
    });
    engine.execute(&Operation::Forward { layer: 0, side: Side::Columns });
    let rows = engine.backward(0).chunks(inputs);
    for (words, got) in words.chunks(taps.width).zip(rows) {
        let gates: Vec<i64> = taps
            .words
            .iter()
            .map(|&word| (i64::from(words[usize::from(word)]) * 255 + (1 << (bits - 1))) >> bits)
            .collect();
        assert_eq!(got, product(&matrix, &gates), "{}", backend.name());
    }
}

/// Converters that lose nothing, for levels and slices small enough; any slices, any tiles that fit.
fn lossless(mut net: Net, dac_bits: u32, subtract: Subtract) -> Option<Net> {
    let hw = &net.hardware;
    let dac_bits = 1 + dac_bits % hw.drive.bits.get();
    let slice = (1usize << dac_bits) - 1;
    let greatest = if subtract == Subtract::Digital { 65_535 } else { 32_767 };
    let fits = greatest / (slice * usize::from(hw.cell.window.ceiling()));
    let bits = AdcBits::new(16).unwrap();
    if fits == 0 {
        return None;
    }
    net.change(|h| {
        h.drive.dac_bits = dac_bits;
        h.tile.rows = h.tile.rows.min(fits);
        h.adc = Adc::Finite { bits, subtract, range: AdcRange::Shift(0) };
    });
    Some(net)
}

proptest! {
    #![proptest_config(config(64))]

    #[test]
    fn law_5_a_read_is_a_product_and_a_transposed_read_that_of_the_transpose(
        net in net(prop::collection::vec(side(), 2..=2)),
    ) {
        let mut net = ideal(net);
        net.deliveries[0].source = WordSource::Output;
        net.deliveries[0].taps.per_unit = 1;
        net.deliveries[0].taps.words.truncate(net.specs[0].units);
        for backend in Backend::available() {
            equals_its_product(&net, backend);
        }
    }

    #[test]
    fn law_5_a_lossless_converter_is_an_ideal_one(
        net in net(prop::collection::vec(side(), 2..=3)),
        dac_bits in any::<u32>(),
        subtract in prop::sample::select(vec![Subtract::Digital, Subtract::Current]),
        choices in choices(),
    ) {
        let mut plain = net;
        plain.change(|h| h.adc = Adc::Ideal);
        let Some(sliced) = lossless(plain.clone(), dac_bits, subtract) else {
            return Err(TestCaseError::reject("no tile is small enough"));
        };
        let (mut a, mut b) =
            (engine(&plain, Backend::best()), engine(&sliced, Backend::best()));
        for op in script(&plain, &choices) {
            execute(&mut a, &op);
            execute(&mut b, &op);
            let last = plain.specs.len() - 1;
            if matches!(op, Op::Forward(layer) if layer == last) {
                for sample in 0..a.samples() {
                    for unit in 0..plain.specs[last].units {
                        let [a, b] = [&a, &b].map(|e| e.output_accumulator(sample, unit));
                        prop_assert_eq!(a, b);
                    }
                }
            }
        }
        for (a, b) in a.layers().iter().zip(b.layers()) {
            prop_assert_eq!(&a.arrays, &b.arrays);
        }
        for phase in Phase::ALL {
            prop_assert_eq!(b.ledger(phase).total(Event::SaturatedConversions), 0);
        }
    }
}
