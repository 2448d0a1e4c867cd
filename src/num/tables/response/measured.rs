//! Steps between given points: straight lines from one to the next.
#![expect(clippy::float_arithmetic, reason = "floats become integers in the room above")]

use super::{Curve, ResponseError, Steps, number};
use crate::num::fixed::Millionths;

/// Points of a response.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct MeasuredSteps {
    /// Where a cell lies, 0 at the floor to 1 at the ceiling and rising; its steps up and down. All in fractions of the window.
    pub points: Vec<[Millionths; 3]>,
}

impl Curve for MeasuredSteps {
    fn steps(&self, _: f64) -> Steps<'_> {
        let points: Vec<_> = self.points.iter().map(|point| point.map(number)).collect();
        Box::new(move |x| {
            let after = points.iter().position(|point| point[0] >= x);
            let after = after.unwrap_or(points.len() - 1).max(1);
            let (from, to) = (points[after - 1], points[after]);
            let part = (x - from[0]) / (to[0] - from[0]);
            [1, 2].map(|of| from[of] + (to[of] - from[of]) * part)
        })
    }

    fn name(&self) -> &'static str {
        "measured"
    }

    fn numbers(&self) -> Vec<Millionths> {
        self.points.as_flattened().to_vec()
    }

    fn check(&self) -> Result<(), ResponseError> {
        let wrong = |found: String, allowed| Err(ResponseError { name: "points", found, allowed });
        let rising = self.points.is_sorted_by(|a, b| a[0] < b[0]);
        let ends = [self.points.first(), self.points.last()];
        let ends = ends.map(|point| point.map(|point| point[0].0));
        if ends != [Some(0), Some(1_000_000)] || !rising {
            let found = format!("are {} rows", self.points.len());
            return wrong(found, "rows begin at 0, end at 1, and rise in their first number");
        }
        let inside = |step: &Millionths| (0..=1_000_000).contains(&step.0);
        match self.points.iter().flat_map(|point| &point[1..]).find(|step| !inside(step)) {
            None => Ok(()),
            Some(step) => wrong(format!("have a step of {step}"), "steps are 0 to 1 of the window"),
        }
    }
}
