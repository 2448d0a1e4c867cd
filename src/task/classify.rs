//! Classification of labelled images: epochs over examples, returning events. Nothing here prints or reads files.
//!
//! [`Experiment`] is everything that decides a result; [`Trainer`] carries it out.

mod examples;
mod experiment;
mod trainer;

pub use examples::{Examples, ExamplesError, Split};
pub use experiment::{Augment, Experiment, Seeded};
pub use trainer::{Evaluation, Progress, Stop, Trainer};
