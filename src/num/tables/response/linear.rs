//! A straight line: `up(x) = m (u_0 + (u_1 - u_0) x)`, `down(x) = m (d_0 + (d_1 - d_0) x)`, `m` the mean step.
#![expect(clippy::float_arithmetic, reason = "floats become integers in the room above")]

use super::{Curve, ResponseError, Steps, number, within};
use crate::num::fixed::Millionths;

/// Steps at the floor and at the ceiling, in mean steps; a straight line between them.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LinearSteps {
    /// `u_0` and `u_1`.
    pub up: [Millionths; 2],
    /// `d_0` and `d_1`.
    pub down: [Millionths; 2],
}

impl Default for LinearSteps {
    /// The mean step everywhere.
    fn default() -> Self {
        Self { up: [Millionths::ONE; 2], down: [Millionths::ONE; 2] }
    }
}

impl Curve for LinearSteps {
    fn steps(&self, mean: f64) -> Steps<'_> {
        let lines = [self.up, self.down].map(|ends| ends.map(number));
        Box::new(move |x| lines.map(|[floor, ceiling]| mean * (floor + (ceiling - floor) * x)))
    }

    fn name(&self) -> &'static str {
        "linear"
    }

    fn numbers(&self) -> Vec<Millionths> {
        [self.up, self.down].concat()
    }

    fn check(&self) -> Result<(), ResponseError> {
        let allowed = "steps at the floor and the ceiling are 0 to 1000 mean steps";
        within("up", &self.up, [0, 1000], allowed)?;
        within("down", &self.down, [0, 1000], allowed)
    }
}
