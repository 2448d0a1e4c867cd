//! Errors: what the output got wrong.
//!
//! ```text
//! e[b][c] = target - a_p                                      target 255 onehot; one output: 255 label
//! ```
//!
//! What an error unit makes of them, [`ErrorUnit`], is a part of the chip. See docs/MODEL.md, 3.1.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

pub use crate::chip::engine::{Centre, ErrorUnit};

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
