//! Classification of labelled images: epochs over examples, returning events. Nothing here prints or reads files.
//!
//! [`Experiment`] is everything that decides a result; [`Trainer`] carries it out.

mod augment;
mod classifier;
mod coding;
mod examples;
mod experiment;
mod trainer;

pub use classifier::Classifier;
pub use coding::{Coding, WHITE_NAME};
pub use examples::{Examples, ExamplesError, Split};
pub use experiment::{Augment, Experiment, Seeded};
pub use trainer::{EpochProgress, Evaluation, Stop, Trainer};
