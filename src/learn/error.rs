//! Errors: what the output got wrong.
//!
//! ```text
//! e[b][c] = target - a_p                                      target 255 onehot; one output: 255 label
//! e[b][c] = 255 onehot - p                                    p: what classes share of 255, by softmax of accumulators
//! ```
//!
//! What an error unit makes of them, [`ErrorUnit`], is a part of the chip. See docs/MODEL.md, 3.1.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

pub use crate::chip::engine::{Centre, ErrorUnit};
use crate::num::tables::Positive;

/// What an error of an output is.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[non_exhaustive]
pub enum OutputError {
    /// How far its activity is from its target, each class for itself. Of an output that is read out as it is, the error is
    /// what a task hands.
    #[default]
    OneVsAll,
    /// How far what it shares with the others is from its target, by look-up of its accumulator.
    Softmax {
        /// Nats of an accumulator are divided by it.
        temperature: Positive,
    },
}

/// Errors of one sample: `255 onehot - a`, or `255 label - a` of a single output.
pub fn errors(label: u8, activity: impl ExactSizeIterator<Item = u8>, out: &mut Vec<i32>) {
    let outputs = activity.len();
    for (class, a) in activity.enumerate() {
        let on = if outputs == 1 { label != 0 } else { usize::from(label) == class };
        out.push(i32::from(on) * 255 - i32::from(a));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_output_takes_the_label_itself() {
        let mut out = Vec::new();
        errors(1, [55].into_iter(), &mut out);
        errors(0, [55].into_iter(), &mut out);
        errors(2, [1, 2, 3].into_iter(), &mut out);
        assert_eq!(out, [200, -55, -1, -2, 252]);
    }
}
