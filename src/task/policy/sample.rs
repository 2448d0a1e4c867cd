//! Which action is taken: drawn, or the one that is likeliest.
//!
//! ```text
//! drawn:    discrete    first a with sum of pi_0 ..= pi_a > word / 2^32
//!           continuous  u = mu + s normal(word)                        within 2^-20 + s 2^-16 + |u - mu| 2^-21, saturating
//! likeliest: discrete   the first greatest logit;  continuous  u = mu
//! told to the environment:  tanh u
//! ```
//!
//! Words are those of site [`Exploration`](crate::num::draw::Site::Exploration), sub = number of the environment, count =
//! number of the step, one a number of the action. Probabilities sum to 1 exactly, so every word finds an action. See
//! docs/MODEL.md, 5.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use super::function;
use super::head::Scatter;
use super::number::{Logit, Probability, saturated};
use crate::num::fixed::{narrow, rsh};
use crate::num::tables::PolicyTables;

/// The action that a word picks.
///
/// # Panics
/// When the probabilities do not sum to 1.
#[inline]
#[must_use]
pub fn discrete(probabilities: &[Probability], word: u32) -> u16 {
    let mut below = 0;
    let holds = |p: &Probability| {
        below += p.to_bits();
        word >> 1 < below
    };
    let action = probabilities.iter().position(holds).expect("probabilities sum to 1");
    narrow(action, "an action has 16 bits")
}

/// The likeliest action, the first of equals.
///
/// # Panics
/// When there is none.
#[inline]
#[must_use]
pub fn likeliest(logits: &[Logit]) -> u16 {
    let max = logits.iter().max().expect("there is an action");
    let action = logits.iter().position(|logit| logit == max).expect("one is the greatest");
    narrow(action, "an action has 16 bits")
}

/// What is tried around a mean, before its `tanh`.
#[inline]
#[must_use]
pub fn continuous(tables: &PolicyTables, mean: Logit, scatter: &Scatter, word: u32) -> Logit {
    let normal = i64::from(function::normal(tables, word).to_bits());
    let apart = rsh(i64::from(scatter.deviation().to_bits()) * normal, 37);
    saturated(i64::from(mean.to_bits()) + apart)
}

#[cfg(test)]
mod tests {
    use std::sync::LazyLock;

    use proptest::prelude::*;

    use super::super::number::LogDeviation;
    use super::*;
    use crate::num::tables::precise::{self, BITS, ONE};

    static TABLES: LazyLock<PolicyTables> = LazyLock::new(PolicyTables::build);

    #[test]
    fn every_word_picks_an_action_by_its_share() {
        let probabilities = [0, 1 << 30, 0, 3 << 28, 1 << 28].map(Probability::from_bits);
        let pick = |word| discrete(&probabilities, word);
        let quarter = 1 << 30;
        assert_eq!([0, 2 * quarter - 1].map(pick), [1; 2]);
        assert_eq!([2 * quarter, 7 * (quarter / 2) - 1].map(pick), [3; 2]);
        assert_eq!([7 * (quarter / 2), u32::MAX].map(pick), [4; 2]);
        assert_eq!(discrete(&[Probability::ONE, Probability::ZERO], u32::MAX), 0);
    }

    #[test]
    #[should_panic(expected = "probabilities sum to 1")]
    fn what_sums_to_less_than_one_is_a_fault() {
        let _ = discrete(&[Probability::from_bits((1 << 31) - 1)], u32::MAX);
    }

    #[test]
    fn of_equals_the_first_is_the_likeliest() {
        let logits = |all: [i32; 4]| likeliest(&all.map(Logit::from_bits));
        assert_eq!([logits([-5, -3, -4, -3]), logits([7; 4]), logits([0, 1, 2, 3])], [1, 0, 3]);
    }

    #[test]
    fn what_is_tried_saturates() {
        let wide = Scatter::new(&TABLES, LogDeviation::ONE);
        assert_eq!(continuous(&TABLES, Logit::MAX, &wide, u32::MAX), Logit::MAX);
        assert_eq!(continuous(&TABLES, Logit::MIN, &wide, 0), Logit::MIN);
    }

    proptest! {
        #[test]
        fn what_is_tried_is_within_its_bound(mean in -1i32 << 28..1 << 28, log in -4i32 << 20..=1 << 20, word: u32) {
            let scatter = Scatter::new(&TABLES, LogDeviation::from_bits(log));
            let tried = continuous(&TABLES, Logit::from_bits(mean), &scatter, word);
            let apart = i128::from(tried.to_bits() - mean) << (BITS - 20);
            let s = precise::exp(i128::from(log) << (BITS - 20));
            let bound = (ONE >> 20) + (s >> 16) + (apart.abs() >> 21);
            // the mass above each end of the bound, in deviations
            let above = ONE - (i128::from(2 * u64::from(word) + 1) << (BITS - 33));
            let slack = 4;
            prop_assert!(precise::tail(precise::div(apart - bound, s)) + slack >= above);
            prop_assert!(precise::tail(precise::div(apart + bound, s)) <= above + slack);
        }
    }
}
