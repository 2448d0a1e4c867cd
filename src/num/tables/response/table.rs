//! A table: straight lines between steps at equally spaced places, up and down each with a row of its own, in whole numbers.
//!
//! ```text
//! p         = i (K - 1),  j = min(p div N, K - 2),  f = p - j N            i = 0 .. N,  K rows of steps, from the floor to the ceiling
//! up(i / N) = m ( u_j (N - f) + u_(j+1) f ) / N                            m the mean step, down alike
//! ```
//!
//! Of two steps it is the straight line of the kind `linear`.
#![expect(clippy::float_arithmetic, reason = "reports and fits ask for steps between levels")]

use super::{Curve, Exact, ResponseError, STEP_BITS, Steps, number, within};
use crate::num::fixed::{Millionths, narrow};

/// Steps at equally spaced places of the window, the floor first and the ceiling last, in mean steps.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TableSteps {
    /// Of steps up.
    pub up: Vec<Millionths>,
    /// Of steps down, as many.
    pub down: Vec<Millionths>,
}

impl TableSteps {
    /// Fewest steps of a row.
    pub const STEPS_MIN: usize = 2;
    /// Most.
    pub const STEPS_MAX: usize = 64;
}

impl Curve for TableSteps {
    fn steps(&self, mean: f64) -> Steps<'_> {
        let rows = [&self.up, &self.down];
        let rows = rows.map(|row| row.iter().map(|&step| number(step)).collect::<Vec<_>>());
        Box::new(move |x| {
            [&rows[0], &rows[1]].map(|row| {
                let last = row.len() - 1;
                #[expect(clippy::cast_precision_loss, reason = "at most 64 places")]
                let along = x.clamp(0.0, 1.0) * last as f64;
                #[expect(
                    clippy::cast_possible_truncation,
                    clippy::cast_sign_loss,
                    reason = "a place of the row"
                )]
                let at = (along as usize).min(last - 1);
                #[expect(clippy::cast_precision_loss, reason = "at most 64 places")]
                let part = along - at as f64;
                mean * (row[at] + (row[at + 1] - row[at]) * part)
            })
        })
    }

    fn exact(&self, Exact { span, states, asymmetry }: Exact) -> Option<[Vec<u32>; 2]> {
        let (whole, longest) = (i128::from(span), i128::from(span) << STEP_BITS);
        // millionths of millionths of a mean step
        let one = 1_000_000 * 1_000_000 * i128::from(states);
        let rows = [(&self.up, asymmetry.0), (&self.down, -asymmetry.0)].map(|(row, lean)| {
            let share = 1_000_000 + i128::from(lean);
            let last = row.len() - 1;
            let entry = |i: u16| {
                let place = usize::from(i) * last;
                let at = (place / usize::from(span)).min(last - 1);
                let after = i128::try_from(place - at * usize::from(span)).expect("a place");
                let [from, to] = [row[at], row[at + 1]].map(|step| i128::from(step.0));
                // 2^8 N times the share, over N: the window is no part of it
                let fine = (share * (from * (whole - after) + to * after)) << STEP_BITS;
                let rounded = (2 * fine + one).div_euclid(2 * one);
                narrow(rounded.clamp(0, longest), "at most 2^8 windows of 2^12 levels")
            };
            (0..=span).map(entry).collect()
        });
        Some(rows)
    }

    fn name(&self) -> &'static str {
        "table"
    }

    fn numbers(&self) -> Vec<Millionths> {
        [&self.up[..], &self.down].concat()
    }

    fn check(&self) -> Result<(), ResponseError> {
        let sizes = [self.up.len(), self.down.len()];
        if sizes[0] != sizes[1] || !(Self::STEPS_MIN..=Self::STEPS_MAX).contains(&sizes[0]) {
            let found = format!("has {} steps, and `down` {}", sizes[0], sizes[1]);
            let allowed = "both rows have as many steps, 2 to 64";
            return Err(ResponseError { name: "up", found, allowed });
        }
        let allowed = "steps are 0 to 1000 mean steps";
        within("up", &self.up, [0, 1000], allowed)?;
        within("down", &self.down, [0, 1000], allowed)
    }
}
