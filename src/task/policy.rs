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

pub mod advantage;
mod experiment;
pub mod function;
pub mod head;
pub mod moments;
pub mod number;
pub mod observe;
mod outcome;
pub mod rank;
pub mod ratio;
pub mod sample;
mod trainer;
pub mod value;

pub use experiment::{Evaluating, Evolution, InputCoding, Method, PolicyExperiment, Ppo, Share};
pub use outcome::{PolicyEpoch, PolicyEvaluation, PolicyProgress, SumOf};
pub use trainer::{PolicyError, PolicyTrainer, WatchedStep};
