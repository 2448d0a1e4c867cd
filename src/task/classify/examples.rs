//! Labelled data as it enters a run: unsigned values with a common full scale, in file order.
//!
//! ```text
//! code = floor( (2 x (2^drive_bits - 1) + M) / (2 M) )          x in 0 ..= M, M the full scale
//! ```
//!
//! See docs/MODEL.md, 1.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use std::ops::Range;
use std::sync::Arc;

use crate::num::fixed::DriveBits;

/// Why values and labels do not make a set of examples.
///
/// See [`Examples`].
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum ExamplesError {
    /// No such examples can be.
    #[error(
        "{features} features of 0 to {full_scale} and {classes} classes make no examples; features, full scale and \
         classes are above 0, and there are at most 256 classes"
    )]
    Kind {
        /// Features an example.
        features: usize,
        /// Greatest value.
        full_scale: u8,
        /// Number of classes.
        classes: usize,
    },
    /// Too many to be numbered.
    #[error("there are {found} examples; fewer than 2^32 are supported")]
    Count {
        /// Examples found.
        found: usize,
    },
    /// Values do not divide into rows.
    #[error("{values} values do not make {examples} examples of {features} features")]
    Shape {
        /// Values found.
        values: usize,
        /// Labels found.
        examples: usize,
        /// Features an example.
        features: usize,
    },
    /// A value above the full scale.
    #[error("example {example} holds the value {found}, above the full scale {full_scale}")]
    Value {
        /// Which example, counted from 0.
        example: usize,
        /// The value.
        found: u8,
        /// Greatest value allowed.
        full_scale: u8,
    },
    /// A label beyond the last class.
    #[error("example {example} has the label {found}, but there are {classes} classes (0..={})", .classes.saturating_sub(1))]
    Label {
        /// Which example, counted from 0.
        example: usize,
        /// The label.
        found: u8,
        /// Number of classes.
        classes: usize,
    },
}

/// Labelled examples. Every value is at most `full_scale`, every label below `classes`. Copies and parts share their
/// storage.
///
/// ```
/// use dalean::{Examples, ExamplesError};
///
/// // two examples of three values 0 to 16, in two classes
/// let set = Examples::new(vec![0, 8, 16, 1, 2, 3], vec![0, 1], 3, 16, 2)?;
/// assert_eq!((set.len(), set.features(), set.labels()), (2, 3, &[0, 1][..]));
/// let wrong = Examples::new(vec![0, 8, 17], vec![0], 3, 16, 2).unwrap_err();
/// assert_eq!(wrong.to_string(), "example 0 holds the value 17, above the full scale 16");
/// # Ok::<(), ExamplesError>(())
/// ```
#[derive(Debug, Clone)]
pub struct Examples {
    values: Arc<[u8]>,
    labels: Arc<[u8]>,
    /// Which of the stored examples these are.
    range: Range<usize>,
    features: usize,
    full_scale: u8,
    classes: usize,
}

impl PartialEq for Examples {
    fn eq(&self, other: &Self) -> bool {
        let of = |e: &Self| (e.features, e.full_scale, e.classes);
        let same = self.all_values() == other.all_values() && self.labels() == other.labels();
        same && of(self) == of(other)
    }
}

impl Eq for Examples {}

impl Examples {
    /// Checks and keeps `values` (example after example, `features` each) and `labels`.
    ///
    /// # Errors
    /// When the shapes disagree, a value is above `full_scale` or a label not below `classes`.
    ///
    /// When `features`, `full_scale` or `classes` is 0, `classes` is above 256, or there are 2^32 examples.
    pub fn new(
        values: Vec<u8>,
        labels: Vec<u8>,
        features: usize,
        full_scale: u8,
        classes: usize,
    ) -> Result<Self, ExamplesError> {
        if features == 0 || full_scale == 0 || !(1..=256).contains(&classes) {
            return Err(ExamplesError::Kind { features, full_scale, classes });
        }
        if u32::try_from(labels.len()).is_err() {
            return Err(ExamplesError::Count { found: labels.len() });
        }
        if labels.len().checked_mul(features) != Some(values.len()) {
            let (values, examples) = (values.len(), labels.len());
            return Err(ExamplesError::Shape { values, examples, features });
        }
        if let Some(at) = values.iter().position(|&v| v > full_scale) {
            let (example, found) = (at / features, values[at]);
            return Err(ExamplesError::Value { example, found, full_scale });
        }
        if let Some(example) = labels.iter().position(|&label| usize::from(label) >= classes) {
            return Err(ExamplesError::Label { example, found: labels[example], classes });
        }
        let range = 0..labels.len();
        let (values, labels) = (values.into(), labels.into());
        Ok(Self { values, labels, range, features, full_scale, classes })
    }

    /// Number of examples.
    #[must_use]
    pub fn len(&self) -> usize {
        self.range.len()
    }

    /// Whether there is no example.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.range.is_empty()
    }

    /// Values of one example, row-major.
    #[must_use]
    pub(crate) fn values(&self, example: usize) -> &[u8] {
        &self.all_values()[example * self.features..][..self.features]
    }

    /// Values of all examples.
    #[must_use]
    pub fn all_values(&self) -> &[u8] {
        &self.values[self.range.start * self.features..self.range.end * self.features]
    }

    /// Labels of all examples.
    #[must_use]
    pub fn labels(&self) -> &[u8] {
        &self.labels[self.range.clone()]
    }

    /// Values an example has.
    #[must_use]
    pub const fn features(&self) -> usize {
        self.features
    }

    /// Greatest value.
    #[must_use]
    pub const fn full_scale(&self) -> u8 {
        self.full_scale
    }

    /// Number of classes.
    #[must_use]
    pub const fn classes(&self) -> usize {
        self.classes
    }

    /// Splits off the examples from `at` on.
    ///
    /// # Panics
    /// When `at` is beyond the end.
    #[must_use]
    pub(crate) fn split_at(self, at: usize) -> (Self, Self) {
        assert!(at <= self.len(), "a cut lies inside");
        let Range { start, end } = self.range;
        let rest = Self { range: start + at..end, ..self.clone() };
        (Self { range: start..start + at, ..self }, rest)
    }

    /// The examples of `self`, then those of `other`.
    ///
    /// # Panics
    /// When the two differ in features, full scale or classes.
    #[must_use]
    pub(crate) fn joined(self, other: &Self) -> Self {
        let shape = |e: &Self| (e.features, e.full_scale, e.classes);
        assert_eq!(shape(&self), shape(other), "only sets of one kind are joined");
        let values = [self.all_values(), other.all_values()].concat().into();
        let labels: Arc<[u8]> = [self.labels(), other.labels()].concat().into();
        Self { values, range: 0..labels.len(), labels, ..self }
    }

    /// The drive code of every possible value.
    #[must_use]
    pub fn codes(&self, bits: DriveBits) -> [u8; 256] {
        codes_of(self.full_scale, bits)
    }
}

/// The drive code of every possible value of a full scale.
pub(super) fn codes_of(full_scale: u8, bits: DriveBits) -> [u8; 256] {
    let (scale, code_max) = (u32::from(full_scale), u32::from(bits.code_max()));
    std::array::from_fn(|value| {
        let value = (value as u32).min(scale);
        u8::try_from((2 * value * code_max + scale) / (2 * scale)).expect("code <= code_max")
    })
}

/// A data set: what is learnt from, what is chosen on, and what is read once at the end.
///
/// `Data::new` makes a data set of one.
#[derive(Debug, Clone)]
pub struct Split {
    /// Training half.
    pub train: Examples,
    /// Validation part, cut from the end of the training half.
    pub validation: Examples,
    /// Test half.
    pub test: Examples,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn codes_round_half_up_and_reach_both_ends() {
        let set = Examples::new(vec![], vec![], 1, 16, 2).unwrap();
        let codes = set.codes(DriveBits::new(8).unwrap());
        assert_eq!([0, 1, 8, 16].map(|x| codes[x]), [0, 16, 128, 255]);
        let codes = set.codes(DriveBits::new(1).unwrap());
        assert_eq!([0, 7, 8, 16].map(|x| codes[x]), [0, 0, 1, 1]);
        let set = Examples::new(vec![], vec![], 1, 255, 2).unwrap();
        let codes = set.codes(DriveBits::new(8).unwrap());
        assert!((0..256).all(|x| usize::from(codes[x]) == x));
    }

    #[test]
    fn values_and_labels_are_checked_at_the_door() {
        let new = |values: &[u8], labels: &[u8]| {
            Examples::new(values.to_vec(), labels.to_vec(), 2, 16, 3).map(|e| e.len())
        };
        assert_eq!(new(&[0, 16, 1, 2], &[0, 2]), Ok(2));
        assert!(matches!(new(&[0, 16, 1], &[0, 2]), Err(ExamplesError::Shape { .. })));
        let value = ExamplesError::Value { example: 1, found: 17, full_scale: 16 };
        assert_eq!(new(&[0, 16, 17, 0], &[0, 2]), Err(value));
        let label = ExamplesError::Label { example: 0, found: 3, classes: 3 };
        assert_eq!(new(&[0, 16, 1, 2], &[3, 2]), Err(label));
    }

    #[test]
    fn splitting_and_joining_are_inverse() {
        let set = Examples::new((0..12).collect(), vec![0, 1, 2, 0], 3, 16, 3).unwrap();
        let (head, tail) = set.clone().split_at(3);
        assert_eq!((head.len(), tail.len(), tail.values(0)), (3, 1, &[9, 10, 11][..]));
        assert_eq!(head.joined(&tail), set);
    }
}
