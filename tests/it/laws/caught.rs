//! A law must be able to fail: every fault planted into the shadow is noticed within a few cases.

use dalean::chip::crossbar::kernel::Backend;
use proptest::prelude::*;
use proptest::strategy::ValueTree;
use proptest::test_runner::TestRunner;

use super::choose::{Choice, Net, choices, flawed, net, side};
use super::fault::Fault;
use super::play::{law, script};

/// Cases within which a fault must show.
const CASES: usize = 96;

/// The same cases in every run.
fn cases() -> Vec<(Net, Vec<Choice>)> {
    let small = prop_oneof![9 => 1usize..=12, 1 => side()];
    let strategy = (net(prop::collection::vec(small, 2..=4)).prop_map(flawed), choices());
    let mut runner = TestRunner::deterministic();
    (0..CASES).map(|_| strategy.new_tree(&mut runner).unwrap().current()).collect()
}

#[test]
fn each_planted_fault_is_caught() {
    let cases = cases();
    let missed = |fault: &&Fault| {
        !cases.iter().any(|(net, choices)| {
            law(net, &script(net, choices), &[Backend::best()], Some(**fault)).is_err()
        })
    };
    let missed: Vec<_> = Fault::ALL.iter().filter(missed).collect();
    assert!(missed.is_empty(), "no law notices {missed:?}");
}
