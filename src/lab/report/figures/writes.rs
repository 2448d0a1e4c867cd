//! What learning asked of the cells and what came of it, epoch by epoch.

use super::{Figure, per_epoch, span, total};
use crate::lab::report::RunView;
use crate::lab::report::chart::{Chart, Series};
use crate::lab::report::number::{count, float, percent_of, short};
use crate::lab::report::scale::Axis;

const KINDS: [(&str, &str, &str, bool); 4] = [
    ("pulses_attempted", "attempted", "var(--d)", false),
    ("pulses_effective", "effective", "var(--a)", false),
    ("requested", "requested", "var(--c)", true),
    ("bounded", "bounded", "var(--b)", true),
];

pub(super) fn draw(view: &RunView<'_>) -> Option<Figure> {
    let (first, last) = span(view)?;
    let end = view.last()?;
    let series: Vec<Series> = KINDS
        .iter()
        .map(|&(event, name, hue, dashed)| {
            let counts = per_epoch(view, "training", event).into_iter();
            let points = counts.map(|(epoch, count)| (epoch, float(count))).collect();
            Series::new(name, hue, points).dashed(dashed)
        })
        .collect();
    if series.iter().all(|one| one.points.is_empty()) {
        return None;
    }
    let values = series.iter().flat_map(|one| &one.points).map(|point| point.1);
    let y = Axis::counts(values, "per epoch (log scale)");
    let start = series.iter().find_map(|one| one.points.first()).map_or(first, |p| p.0 as u32);
    let mut chart = Chart::new(480.0, 310.0, 122.0, Axis::epochs(start, last), y);
    chart.series(&series, |value| short(value as u64));

    let of = |event| total(end, "training", event);
    let rows = [
        ("Cells asked to change", "requested", None),
        ("of these, cut by the bound", "bounded", Some("requested")),
        ("Pulses attempted", "pulses_attempted", None),
        ("of these, effective", "pulses_effective", Some("pulses_attempted")),
    ];
    let rows = rows.map(|(text, event, whole)| {
        let share = whole.map(|whole| percent_of(of(event), of(whole), 1)).unwrap_or_default();
        format!(
            "<tr><th scope=\"row\">{text}</th><td>{}</td><td>{share}</td></tr>",
            count(of(event))
        )
    });
    let each = if end.updates > 0 {
        let each = float(of("pulses_attempted")) / float(end.updates);
        let each = if each < 100.0 { format!("{each:.1}") } else { count(each.round() as u64) };
        format!(" On average {each} pulses an update.")
    } else {
        String::new()
    };
    Some(Figure {
        id: "writes",
        title: "Writes",
        caption: format!(
            "Solid: pulses. Dashed: cells whose increment was not 0, and those whose increment the bound \
             cut. A pulse that finds its cell at the end of the window is attempted but not effective.{each}"
        ),
        body: format!(
            "{}<div class=\"scroll\"><table><thead><tr><th>Whole training</th><th>count</th>\
             <th>share</th></tr></thead><tbody>{}</tbody></table></div>",
            chart.finish("Writes per epoch"),
            rows.concat()
        ),
        wide: false,
    })
}
