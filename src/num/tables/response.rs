//! What a pulse does to a cell, by where the cell lies in its window: a table a polarity, in 256ths of a level.
//!
//! ```text
//! table[up][i]    = min( floor( 2^8 N (1 + a) up(i / N)   + 1/2 ), 2^8 N )        i = 0 .. N,  N = ceiling - floor
//! table[down][i]  = min( floor( 2^8 N (1 - a) down(i / N) + 1/2 ), 2^8 N )        a: the asymmetry of the device
//! ```
//!
//! `up(x)` and `down(x)` are the steps of a kind, in fractions of the window: how far a pulse moves a cell that lies at `x` of
//! it, computed in doubles: what lies within 2^-20 below a half is rounded up as the half is. They are not below 0, and none is longer than the window. `table` is rational and
//! rounded exactly. One kind is one file and a variant here. See docs/MODEL.md, 3.11.
#![expect(clippy::float_arithmetic, reason = "floats become integers here, at load only")]
#![deny(clippy::disallowed_types, clippy::disallowed_methods)]

mod exponential;
mod linear;
mod measured;
mod neurosim;
mod soft_bounds;
mod table;

pub use exponential::ExponentialSteps;
pub use linear::LinearSteps;
pub use measured::MeasuredSteps;
pub use neurosim::NeurosimSteps;
pub use soft_bounds::SoftBoundSteps;
pub use table::TableSteps;

use crate::num::fixed::Millionths;

/// Fractional bits of a step, which is counted in levels.
pub const STEP_BITS: u32 = 8;

/// How far a pulse moves a cell. [`Response::states`] is what its numbers are measured with.
///
/// ```
/// use dalean::hardware::{Millionths, Response, SoftBoundSteps};
///
/// let soft = Response::SoftBounds(SoftBoundSteps::default());
/// // 64 pulses across a window of 255 levels, symmetric: 2 of a mean step of 4 at the floor, none at the ceiling
/// let [up, down] = soft.table(255, 64, Millionths(0));
/// assert_eq!((up[0], up[255], down[0]), (2040, 0, 0));
/// ```
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub enum Response {
    /// A straight line from the floor to the ceiling; the same step everywhere by default.
    Linear(LinearSteps),
    /// Steps that shrink towards the end they lead to, and are none there.
    SoftBounds(SoftBoundSteps),
    /// Steps with an exponential part.
    Exponential(ExponentialSteps),
    /// Curves of conductance by nonlinearity labels.
    Neurosim(NeurosimSteps),
    /// Steps at equally spaced places, and lines between them.
    Table(TableSteps),
    /// Steps between given points.
    Measured(MeasuredSteps),
}

/// A number of a response that makes none.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ResponseError {
    /// What it is called.
    pub name: &'static str,
    /// What was found.
    pub found: String,
    /// What is allowed.
    pub allowed: &'static str,
}

/// Steps up and down, in fractions of the window, of a cell at `x` (0 to 1) of it.
type Steps<'a> = Box<dyn Fn(f64) -> [f64; 2] + 'a>;

/// What a table is made for.
#[derive(Debug, Clone, Copy)]
struct Exact {
    span: u16,
    states: u32,
    asymmetry: Millionths,
}

/// What every kind is.
trait Curve {
    /// Its steps; `mean` is the one of which as many as the device has states cross the window.
    fn steps(&self, mean: f64) -> Steps<'_>;

    /// Its table, where it is rational and needs no doubles.
    fn exact(&self, _: Exact) -> Option<[Vec<u32>; 2]> {
        None
    }

    /// What it is called.
    fn name(&self) -> &'static str;

    /// All its numbers, in an order that stays.
    fn numbers(&self) -> Vec<Millionths>;

    /// Whether its numbers are steps.
    fn check(&self) -> Result<(), ResponseError>;
}

impl Response {
    fn curve(&self) -> &dyn Curve {
        match self {
            Self::Linear(steps) => steps,
            Self::SoftBounds(steps) => steps,
            Self::Exponential(steps) => steps,
            Self::Neurosim(steps) => steps,
            Self::Table(steps) => steps,
            Self::Measured(steps) => steps,
        }
    }

    /// What its kind is called.
    #[must_use]
    pub fn name(&self) -> &'static str {
        self.curve().name()
    }

    /// All its numbers, in an order that stays.
    #[must_use]
    pub fn numbers(&self) -> Vec<Millionths> {
        self.curve().numbers()
    }

    /// Checks its numbers.
    ///
    /// # Errors
    /// When they give no step, or one below 0.
    pub fn check(&self) -> Result<(), ResponseError> {
        self.curve().check()
    }

    /// Steps up and down in fractions of the window, of a cell at `x` of it, as doubles: for fits and figures. What a chip does is
    /// [`Response::table`].
    ///
    /// # Panics
    /// When there is no state.
    pub(crate) fn steps(&self, states: u32) -> Steps<'_> {
        assert!(states > 0, "a window is crossed in some pulses");
        self.curve().steps(1.0 / f64::from(states))
    }

    /// Steps up and down in 256ths of a level, by level above the floor: `span + 1` each. `states` pulses of mean length cross
    /// the window; `asymmetry` makes steps up longer and steps down shorter, by that share.
    ///
    /// # Panics
    /// When there is no window or no state.
    #[must_use]
    pub fn table(&self, span: u16, states: u32, asymmetry: Millionths) -> [Vec<u32>; 2] {
        assert!(span > 0 && states > 0, "a window is crossed in some pulses");
        if let Some(table) = self.curve().exact(Exact { span, states, asymmetry }) {
            return table;
        }
        let (steps, whole) = (self.steps(states), f64::from(span));
        let entry = |step: f64| {
            let levels = step.clamp(0.0, 1.0) * whole;
            // a half that doubles miss by little is one
            let half = 0.5 + libm::exp2(-20.0);
            let fine = libm::floor(levels * libm::exp2(f64::from(STEP_BITS)) + half);
            #[expect(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "at most 2^8 windows of 2^12 levels"
            )]
            let fine = fine as u32;
            fine
        };
        let asymmetry = number(asymmetry);
        let both = (0..=span).map(|i| steps(f64::from(i) / whole));
        both.map(|[up, down]| (entry(up * (1.0 + asymmetry)), entry(down * (1.0 - asymmetry))))
            .unzip()
            .into()
    }
}

/// What millionths stand for.
fn number(millionths: Millionths) -> f64 {
    #[expect(clippy::cast_precision_loss, reason = "below 2^53 of them")]
    let count = millionths.0 as f64;
    count / 1e6
}

/// Numbers between two ends, or the first that is not.
fn within(
    name: &'static str,
    numbers: &[Millionths],
    [least, most]: [i64; 2],
    allowed: &'static str,
) -> Result<(), ResponseError> {
    let whole = |n: &&Millionths| !(least * 1_000_000..=most * 1_000_000).contains(&n.0);
    match numbers.iter().find(whole) {
        None => Ok(()),
        Some(number) => Err(ResponseError { name, found: format!("is {number}"), allowed }),
    }
}

#[cfg(test)]
mod tests;
