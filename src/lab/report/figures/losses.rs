//! What becomes of updates of a policy over steps: losses, entropy, divergence, clipped ratios, explained variance.

use super::Figure;
use super::returns::{over_steps, steps_axis};
use crate::lab::report::RunView;
use crate::lab::report::chart::{Chart, Series};
use crate::lab::report::number::significant;
use crate::lab::report::scale::Axis;
use crate::lab::store::record::PolicyOutcome;

/// A small chart: name, colour, what it shows.
type Small = (&'static str, &'static str, fn(&PolicyOutcome) -> Option<f64>);

const SMALL: [Small; 6] = [
    ("policy loss", "var(--a)", |one| one.mean_policy_loss),
    ("value loss", "var(--b)", |one| one.mean_value_loss),
    ("entropy", "var(--c)", |one| one.mean_entropy),
    ("divergence", "var(--a)", |one| one.mean_approx_kl),
    ("clipped ratios", "var(--b)", |one| one.clipfrac),
    ("explained variance", "var(--c)", |one| one.explained_variance),
];

pub(super) fn draw(view: &RunView<'_>) -> Option<Figure> {
    let mut body = String::new();
    for (name, hue, of) in SMALL {
        let points = over_steps(view, of);
        let values = || points.iter().map(|point| point.1);
        let (low, high) = (values().fold(f64::MAX, f64::min), values().fold(f64::MIN, f64::max));
        if low > high {
            continue;
        }
        let room = (0.08 * (high - low)).max(1e-4 * high.abs().max(1e-3));
        let y = Axis::round(low - room, high + room, name);
        let mut chart = Chart::new(372.0, 220.0, 64.0, steps_axis(view), y);
        let series = Series::new("", hue, points);
        chart.by("steps").series(&[series], significant);
        body += &format!("<div>{}</div>", chart.finish(&format!("{name} over steps")));
    }
    if body.is_empty() {
        return None;
    }
    Some(Figure {
        id: "losses",
        title: "Updates",
        caption: "Means over all steps that an epoch learnt from. Policy loss: minus the clipped objective. Value loss: half \
                  of the squared error in standard units. Divergence: (r - 1) - ln r of the ratio r between the policy that \
                  learns and the one that acted. Clipped ratios: steps whose ratio went too far to count. Explained \
                  variance: what the critic knows of the returns of the last rollout, at most 1."
            .into(),
        body: format!("<div class=\"halves\">{body}</div>"),
        wide: true,
    })
}
