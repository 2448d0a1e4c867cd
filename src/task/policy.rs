//! Policies: an actor and a critic on crossbars learn by proximal policy optimisation, in fixed point.
//!
//! ```text
//! rollout    environments side by side, so many steps each: observations are standardised by the statistics of all steps
//!            before, coded as drives, read by both networks; actions are drawn from what the actor puts out
//! update     advantages and value targets of the rollout; a few passes over its steps in minibatches: the error of each output
//!            goes to the chip, which learns as it does from anything else
//! ```
//!
//! [`PolicyExperiment`] is everything that decides a result, [`PolicyTrainer`] carries it out. Nothing here prints or reads files.
//! See docs/MODEL.md, 5.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

mod actor;
pub mod advantage;
mod agent;
mod critic;
mod evolution;
mod experiment;
pub mod function;
pub mod head;
pub mod moments;
pub mod number;
pub mod observe;
mod outcome;
mod outside;
mod player;
mod prefixed;
pub mod rank;
pub mod ratio;
mod rollout;
pub mod sample;
mod start;
mod trainer;
pub mod value;

#[cfg(test)]
mod tests;

use crate::chip::engine::Engine;
use crate::num::fixed::rsh;
use number::{Logit, saturated};

pub use experiment::{Evaluating, Evolution, InputCoding, Method, PolicyExperiment, Ppo, Share};
pub use outcome::{PolicyEpoch, PolicyEvaluation, PolicyProgress, SumOf, WatchedStep};
pub use outside::{PolicyLearner, PolicyTurn};
pub use trainer::{PolicyError, PolicyTrainer};

/// What the last layer put out, `[sample][output]`: `floor(readout unit 2^20 + 1/2)`, saturating.
fn outputs(engine: &Engine, put_out: &mut Vec<Logit>) {
    let mut sums = Vec::new();
    engine.readouts(&mut sums);
    let [above, below] = engine.readout_unit().ratio();
    put_out.clear();
    if above == 1 && below.is_power_of_two() && below >= 1 << 20 {
        let shift = below.trailing_zeros() - 20;
        put_out.extend(sums.iter().map(|&sum| saturated(rsh(sum, shift))));
    } else {
        let (above, below) = (i128::from(above), i128::from(below));
        put_out.extend(sums.iter().map(|&sum| {
            let number = (((i128::from(sum) * above) << 21) + below).div_euclid(2 * below);
            saturated(i64::try_from(number).unwrap_or(if sum < 0 { i64::MIN } else { i64::MAX }))
        }));
    }
}
