//! Steps with an exponential part, as fits of resistive and phase-change memories have them.
//!
//! ```text
//! z        = z_0 + (z_1 - z_0) x
//! up(x)    = m max( 0, 1 - A_up   exp(  g_up   z ) )             m the mean step
//! down(x)  = m max( 0, 1 - A_down exp( -g_down z ) )
//! ```
#![expect(clippy::float_arithmetic, reason = "floats become integers in the room above")]

use super::{Curve, ResponseError, Steps, number, within};
use crate::num::fixed::Millionths;

/// Amplitude and growth of the exponential part.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ExponentialSteps {
    /// `A` of steps up and down.
    pub amplitude: [Millionths; 2],
    /// `g` of steps up and down.
    pub growth: [Millionths; 2],
    /// `z` at the floor and at the ceiling.
    pub z: [Millionths; 2],
}

impl Curve for ExponentialSteps {
    fn steps(&self, mean: f64) -> Steps<'_> {
        let [from, to] = self.z.map(number);
        let (amplitude, growth) = (self.amplitude.map(number), self.growth.map(number));
        let step = move |polarity: usize, z: f64| {
            mean * (1.0 - amplitude[polarity] * libm::exp(growth[polarity] * z)).max(0.0)
        };
        Box::new(move |x| {
            let z = from + (to - from) * x;
            [step(0, z), step(1, -z)]
        })
    }

    fn name(&self) -> &'static str {
        "exponential"
    }

    fn numbers(&self) -> Vec<Millionths> {
        [self.amplitude, self.growth, self.z].concat()
    }

    fn check(&self) -> Result<(), ResponseError> {
        within("amplitude", &self.amplitude, [-1000, 1000], "amplitudes lie in -1000..=1000")?;
        within("growth", &self.growth, [-100, 100], "growths lie in -100..=100")?;
        within("z", &self.z, [-5, 5], "the argument lies in -5..=5")
    }
}
