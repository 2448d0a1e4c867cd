//! Returns of a policy over steps: while learning, and without learning after every epoch.

use super::Figure;
use crate::lab::report::RunView;
use crate::lab::report::chart::{Chart, Series};
use crate::lab::report::number::{count, significant};
use crate::lab::report::scale::Axis;
use crate::lab::store::record::PolicyOutcome;

/// What a policy says, epoch by epoch.
pub(super) fn outcomes<'a>(view: &'a RunView<'_>) -> impl Iterator<Item = &'a PolicyOutcome> {
    view.epochs.iter().filter_map(|record| record.policy())
}

/// Steps and a value of every epoch that has it.
pub(super) fn over_steps(
    view: &RunView<'_>,
    of: impl Fn(&PolicyOutcome) -> Option<f64>,
) -> Vec<(f64, f64)> {
    outcomes(view).filter_map(|one| Some((one.steps as f64, of(one)?))).collect()
}

/// Steps from the first to the last epoch.
pub(super) fn steps_axis(view: &RunView<'_>) -> Axis {
    let last = outcomes(view).last().map_or(0, |one| one.steps);
    Axis::round(0.0, (last as f64).max(1.0), "steps of all environments")
}

pub(super) fn draw(view: &RunView<'_>) -> Option<Figure> {
    let learning = over_steps(view, |one| one.episodic_return);
    let evaluated = over_steps(view, |one| one.evaluation.mean());
    let mut all = vec![
        Series::new("learning", "var(--c)", learning).dashed(true),
        Series::new("evaluated", "var(--a)", evaluated),
    ];
    let test = view.receipt.played();
    if let Some(mean) = test.and_then(|test| test.episodes.mean()) {
        let at = test.map_or(0.0, |test| test.steps as f64);
        all.push(Series::new("test", "var(--b)", vec![(at, mean)]).marked());
    }
    all.retain(|series| !series.points.is_empty());
    let values = || all.iter().flat_map(|one| &one.points).map(|point| point.1);
    let (low, high) = (values().fold(f64::MAX, f64::min), values().fold(f64::MIN, f64::max));
    if low > high {
        return None;
    }
    let room = (0.06 * (high - low)).max(0.5);
    let y = Axis::round(low - room, high + room, "return of an episode");
    let mut chart = Chart::new(760.0, 400.0, 170.0, steps_axis(view), y);
    chart.by("steps").series(&all, significant);
    let last = outcomes(view).last()?;
    let each = last.evaluation.episodes();
    let how = if last.evaluation.deterministic {
        "the likeliest action is taken"
    } else {
        "actions are drawn"
    };
    let tested = test.map_or_else(String::new, |test| {
        let episodes = &test.episodes;
        let range = episodes.return_range.map_or_else(String::new, |[mean, least, most]| {
            format!(
                ": mean <b>{}</b>, {} to {}",
                significant(mean),
                significant(least),
                significant(most)
            )
        });
        format!(
            " The mark is the final test of the last state, {} episodes{range}.",
            count(episodes.episodes())
        )
    });
    Some(Figure {
        id: "returns",
        title: "Returns",
        caption: format!(
            "Learning: mean return of the episodes that ended in an epoch, with actions drawn. Evaluated: mean of {each} \
             episodes after it, without learning; {how}.{tested}"
        ),
        body: chart.finish("Return of an episode over steps of all environments"),
        wide: true,
    })
}
