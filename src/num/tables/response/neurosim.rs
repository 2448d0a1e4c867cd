//! Curves of conductance by nonlinearity labels, as the tables of MLP+NeuroSim name devices.
//!
//! ```text
//! curve(p)  = (1 - e^(-p / A)) / (1 - e^(-1 / A))      p: pulses of an even row from end to end, 0 to 1;  A of the label's sign
//! label     = 10.1015 max over p of |curve(p) - p|     0 is the straight line;  A = 1.2627 / label where it is small
//! up(x)     = curve(p(x) + 1 / states) - x             the row of rising pulses, from where it passes x
//! down(x)   = x - curve'(p(x) - 1 / states)            the row of falling pulses walks its own curve backwards
//! ```
//!
//! A positive label of rising pulses, and a negative one of falling pulses, is a device whose first steps are long and last ones
//! short. `A` is found from the label by halving; the 10.1015 is what the published table of labels and `A` amounts to.
#![expect(clippy::float_arithmetic, reason = "floats become integers in the room above")]

use super::{Curve, ResponseError, Steps, number, within};
use crate::num::fixed::Millionths;

/// Labels of rising and of falling pulses.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct NeurosimSteps {
    /// Of rising pulses, then of falling ones.
    pub labels: [Millionths; 2],
}

/// A label over the greatest departure from the straight line.
const LABEL: f64 = 10.1015;
/// Below that, nothing departs from it.
const STRAIGHT: f64 = 1e-3;

/// `1 / A` of a label.
pub(super) fn bend(label: f64) -> f64 {
    if label.abs() < STRAIGHT {
        return 0.0;
    }
    let wanted = label.abs() / LABEL;
    let (mut low, mut high) = (1e-4, 1e3);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if departure(middle) < wanted {
            low = middle;
        } else {
            high = middle;
        }
    }
    if label < 0.0 { -low } else { low }
}

/// `max over p of curve(p) - p` for `1 / A = bend > 0`: where the slope is 1.
fn departure(bend: f64) -> f64 {
    let whole = -libm::expm1(-bend);
    // e^(-bend p) = whole / bend
    let left = whole / bend;
    (1.0 - left) / whole + libm::log(left) / bend
}

/// `curve(p)`.
fn curve(p: f64, bend: f64) -> f64 {
    if bend == 0.0 { p } else { libm::expm1(-p * bend) / libm::expm1(-bend) }
}

/// `p(x)`, its inverse.
fn place(x: f64, bend: f64) -> f64 {
    if bend == 0.0 { x } else { -libm::log1p(x * libm::expm1(-bend)) / bend }
}

impl Curve for NeurosimSteps {
    fn steps(&self, mean: f64) -> Steps<'_> {
        let [up, down] = self.labels.map(|label| bend(number(label)));
        Box::new(move |x| {
            [curve(place(x, up) + mean, up) - x, x - curve(place(x, down) - mean, down)]
        })
    }

    fn name(&self) -> &'static str {
        "neurosim"
    }

    fn numbers(&self) -> Vec<Millionths> {
        self.labels.to_vec()
    }

    fn check(&self) -> Result<(), ResponseError> {
        within("labels", &self.labels, [-9, 9], "labels of nonlinearity lie in -9..=9")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Pairs of label and A as the table of MLP+NeuroSim V3.0 gives them (documents/Nonlinearity-NormA.htm).
    #[test]
    fn a_label_stands_for_the_published_bend() {
        for (label, a) in [
            (0.01, 126.269),
            (0.1, 12.6258),
            (1.51, 0.8195),
            (1.6, 0.7714),
            (3.01, 0.3853),
            (4.51, 0.2266),
            (6.01, 0.1351),
            (7.51, 0.0702),
        ] {
            let found = 1.0 / bend(label);
            assert!((found / a - 1.0).abs() < 1e-3, "{label}: {found} for {a}");
            assert!((bend(-label) + bend(label)).abs() < 1e-12);
        }
    }

    #[test]
    fn rows_of_pulses_walk_their_curve_from_end_to_end() {
        for (label, states) in [(2.4, 97u32), (-4.88, 97), (0.0, 50), (1.75, 32)] {
            let steps = NeurosimSteps { labels: [Millionths((label * 1e6) as i64); 2] };
            let (mean, bend) = (1.0 / f64::from(states), bend(label));
            let steps = steps.steps(mean);
            let (mut up, mut down) = (0.0, 1.0);
            for pulse in 1..=states {
                up += steps(up)[0];
                down -= steps(down)[1];
                let p = f64::from(pulse) * mean;
                assert!((up - curve(p, bend)).abs() < 1e-9, "{label} {pulse}");
                assert!((down - curve(1.0 - p, bend)).abs() < 1e-9, "{label} {pulse}");
            }
        }
    }
}
