//! Orders of operations that are refused: what a waiting sum is made of may not change under it.

use dalean::chip::crossbar::kernel::Backend;
use dalean::chip::engine::{Engine, Operation, Side, Write};
use dalean::chip::hardware::Adc;
use dalean::chip::layer::{DrivenBy, WordSource};
use proptest::prelude::*;
use proptest::strategy::ValueTree;
use proptest::test_runner::TestRunner;

use super::choose::net;
use super::play::engine;

/// Two layers, both read, one sample of each added and not yet written.
fn waiting() -> Engine {
    let mut runner = TestRunner::deterministic();
    let mut net = net(Just(vec![3, 2, 2])).new_tree(&mut runner).unwrap().current();
    net.change(|h| h.adc = Adc::Ideal);
    net.specs[0].driven_by = DrivenBy::Shared;
    net.deliveries.iter_mut().for_each(|delivery| delivery.source = WordSource::Output);
    let mut engine = engine(&net, Backend::Scalar);
    engine.execute(&Operation::LoadDrives { codes: &[0; 6] });
    for layer in 0..2 {
        engine.execute(&Operation::Forward { layer, side: Side::Rows });
        let words = vec![1; 2 * net.deliveries[layer].output_words()];
        engine.execute(&Operation::Error { layer, samples: 0..2, words: &words, shared: false });
        let update = Operation::Update { layer, write: Write::Add, samples: 0..1, shift: 0 };
        engine.execute(&update);
    }
    engine
}

#[test]
fn gates_of_samples_that_are_not_added_may_change() {
    let mut engine = waiting();
    let words = vec![0; engine.layers()[1].delivery.output_words()];
    engine.execute(&Operation::Error { layer: 1, samples: 1..2, words: &words, shared: false });
}

#[test]
#[should_panic(expected = "sums wait to be programmed")]
fn gates_of_added_samples_do_not_change_before_the_write() {
    let mut engine = waiting();
    let words = vec![0; engine.layers()[1].delivery.output_words()];
    engine.execute(&Operation::Error { layer: 1, samples: 0..1, words: &words, shared: false });
}

#[test]
#[should_panic(expected = "sums wait to be programmed")]
fn drives_of_added_samples_do_not_change_before_the_write() {
    waiting().execute(&Operation::Forward { layer: 0, side: Side::Rows });
}

#[test]
#[should_panic(expected = "sums wait to be programmed")]
fn a_batch_does_not_replace_added_samples_before_the_write() {
    waiting().execute(&Operation::LoadDrives { codes: &[0; 3] });
}
