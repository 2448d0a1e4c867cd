//! Laws, over any valid chip and any order of operations.
//!
//! ```text
//! 1   after every operation, cells, outputs and counts are those of a plain recomputation; levels stay in their window;
//!     bounds are reached and never passed
//! 2   every back end gives the same, and skipping what is zero changes nothing
//! 3   one state, whatever the threads, the back end, an interruption or (with ideal converters) the tiles
//! 4   the closed forms of time are what a network of tiles takes, cycle by cycle
//! 5   an ideal crossbar is an integer matrix; a lossless converter is an ideal one
//! ```
//!
//! `PROPTEST_CASES` sets how many cases each law sees. Counterexamples are kept in tests/proptest-regressions.
#![expect(clippy::unwrap_used, reason = "what cannot be built fails its test")]

use dalean::chip::crossbar::kernel::Backend;
use proptest::prelude::*;
use proptest::test_runner::FileFailurePersistence;

mod bounds;
mod caught;
mod choose;
mod draws;
mod fault;
mod order;
mod play;
mod product;
mod runs;
mod shadow;
mod time;

/// `cases` unless `PROPTEST_CASES` says otherwise.
fn config(cases: u32) -> ProptestConfig {
    let default = ProptestConfig::default();
    let chosen = std::env::var_os("PROPTEST_CASES").is_some();
    let place = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/proptest-regressions/laws.txt");
    ProptestConfig {
        cases: if chosen { default.cases } else { cases },
        failure_persistence: Some(Box::new(FileFailurePersistence::Direct(place))),
        ..default
    }
}

/// Networks with several blocks and panels, where there is something to skip.
fn wide_net() -> impl Strategy<Value = choose::Net> {
    let side = || prop::sample::select(vec![17usize, 33, 65, 100, 129, 140]);
    choose::net(prop::collection::vec(side(), 2..=3))
}

proptest! {
    #![proptest_config(config(48))]

    #[test]
    fn law_1_every_operation_is_its_equation(
        net in choose::any_net().prop_map(choose::flawed), choices in choose::choices(),
    ) {
        let ops = play::script(&net, &choices);
        play::law(&net, &ops, &Backend::available(), None).map_err(TestCaseError::fail)?;
    }
}

proptest! {
    #![proptest_config(config(12))]

    #[test]
    fn law_2_skipping_changes_nothing(
        net in wide_net().prop_map(choose::flawed), choices in choose::choices(),
    ) {
        let ops = play::script(&net, &choices);
        play::law(&net, &ops, &Backend::available(), None).map_err(TestCaseError::fail)?;
    }
}

proptest! {
    #![proptest_config(config(96))]

    #[test]
    fn law_4_closed_forms_are_cycle_by_cycle(
        net in choose::timed_net().prop_map(choose::flawed), choices in choose::choices(), seed: u64,
    ) {
        time::law(&net, &choices, seed).map_err(TestCaseError::fail)?;
    }
}
