//! Where the joules go: training by component, epoch by epoch, and totals with their bounds.

use super::{Figure, per_epoch, span};
use crate::lab::price::prefixed;
use crate::lab::report::RunView;
use crate::lab::report::chart::{Chart, Series};
use crate::lab::report::number::{escape, float, percent};
use crate::lab::report::scale::Axis;

/// Components drawn as lines.
const LINES: usize = 4;
const HUES: [&str; LINES] = ["var(--a)", "var(--b)", "var(--c)", "var(--d)"];

pub(super) fn draw(view: &RunView<'_>) -> Option<Figure> {
    let (cost, (first, last)) = (view.cost?, span(view)?);
    let [low, typical, high] = cost.joules?;
    if cost.components.is_empty() {
        return None;
    }
    let events = cost.components.iter().filter_map(|group| {
        let each = cost.each.iter().find(|(_, component, _)| *component == group.name)?;
        Some((group.name.replace('_', " "), each.0, each.2))
    });
    let series: Vec<Series> = events
        .take(LINES)
        .zip(HUES)
        .map(|((name, event, joules), hue)| {
            let counts = per_epoch(view, "training", event).into_iter();
            let points = counts.map(|(epoch, count)| (epoch, 1e12 * joules * float(count)));
            Series::new(&name, hue, points.collect())
        })
        .collect();
    let drawn = if series.iter().all(|one| one.points.is_empty()) {
        String::new()
    } else {
        let values = series.iter().flat_map(|one| &one.points).map(|point| point.1);
        let y = Axis::counts(values, "picojoules per epoch (log scale)");
        let start = series.iter().find_map(|one| one.points.first()).map_or(first, |p| p.0 as u32);
        let mut chart = Chart::new(480.0, 310.0, 122.0, Axis::epochs(start, last), y);
        chart.series(&series, |value| prefixed(1e-12 * value, "J"));
        chart.finish("Energy of training per epoch")
    };
    let rows = cost.components.iter().map(|group| {
        let [low, middle, high] = group.joules.map(|joules| prefixed(joules, "J"));
        let share = if typical > 0.0 { percent(group.joules[1] / typical, 1) } else { "–".into() };
        format!(
            "<tr><th scope=\"row\">{}</th><td>{low}</td><td>{middle}</td><td>{high}</td><td>{share}</td></tr>",
            escape(&group.name.replace('_', " "))
        )
    });
    let rows: String = rows.collect();
    let [low, middle, high] = [low, typical, high].map(|joules| prefixed(joules, "J"));
    let missing: Vec<_> = cost.missing.iter().map(|missing| escape(&missing.what)).collect();
    let missing = match missing.is_empty() {
        true => String::new(),
        false => format!(" Without a price: {}.", missing.join(", ")),
    };
    Some(Figure {
        id: "energy",
        title: "Energy",
        caption: format!(
            "Counts of the ledger times constants of the hardware model: {middle} for the whole run, bounds {low} to \
             {high}; {} leans on assumed constants. The lines are training at typical constants, without static \
             power.{missing}",
            percent(cost.assumed_share, 0)
        ),
        body: format!(
            "{drawn}<div class=\"scroll\"><table><thead><tr><th>Whole run</th><th>low</th><th>typical</th><th>high</th>\
             <th>share</th></tr></thead><tbody>{rows}</tbody></table></div>"
        ),
        wide: false,
    })
}
