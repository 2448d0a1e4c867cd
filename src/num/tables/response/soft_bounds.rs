//! Soft bounds: `up(x) = m u (1 - x)`, `down(x) = m d x`, `m` the mean step. With 2 each, both are the mean step in the middle.
#![expect(clippy::float_arithmetic, reason = "floats become integers in the room above")]

use super::{Curve, ResponseError, Steps, number, within};
use crate::num::fixed::Millionths;

/// Steps that shrink towards the end they lead to.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SoftBoundSteps {
    /// Step up at the floor, in mean steps.
    pub up: Millionths,
    /// Step down at the ceiling, in mean steps.
    pub down: Millionths,
}

impl Default for SoftBoundSteps {
    fn default() -> Self {
        Self { up: Millionths(2_000_000), down: Millionths(2_000_000) }
    }
}

impl Curve for SoftBoundSteps {
    fn steps(&self, mean: f64) -> Steps<'_> {
        let [up, down] = [self.up, self.down].map(number);
        Box::new(move |x| [mean * up * (1.0 - x), mean * down * x])
    }

    fn name(&self) -> &'static str {
        "soft_bounds"
    }

    fn numbers(&self) -> Vec<Millionths> {
        vec![self.up, self.down]
    }

    fn check(&self) -> Result<(), ResponseError> {
        let allowed = "the longest step is 0 to 1000 mean steps";
        within("up", &[self.up], [0, 1000], allowed)?;
        within("down", &[self.down], [0, 1000], allowed)
    }
}
