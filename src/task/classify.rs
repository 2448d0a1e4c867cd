//! Classification of labelled images.

mod examples;

pub use examples::{Examples, ExamplesError, Split};
