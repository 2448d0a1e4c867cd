//! The curves of a sweep as a table for the terminal: a line a value of the abscissa, a column a curve.

use std::fmt::Write as _;

use super::curves::{held_words, runs};
use super::paper::short;
use super::settings::{Levels, Settings};
use super::statistics::Summary;
use super::{SweepView, meaning};

/// Lines and columns at most: what a terminal shows at once.
const LINES_MAX: usize = 40;
const COLUMNS_MAX: usize = 8;

/// The table, or nothing where no run has finished or the abscissa was drawn from a range.
#[must_use]
pub fn text(view: &SweepView<'_>) -> Option<String> {
    let settings = Settings::new(view);
    let wanted = &view.figures;
    let x = settings.axis(&wanted.x).filter(|x| !x.drawn())?;
    let measure = settings.measure(&wanted.y)?;
    let named = |name: &Option<String>| settings.axis(name.as_ref()?).filter(|axis| !axis.drawn());
    let (panel, series) = (named(&wanted.panel), named(&wanted.series));
    let shown: Vec<&str> =
        [Some(x), series, panel].into_iter().flatten().map(|axis| &*axis.axis.name).collect();
    let held = settings.held(measure, &shown);
    let places = |axis: Option<&Levels<'_>>| 0..axis.map_or(1, |axis| axis.texts.len());
    let columns: Vec<[usize; 2]> =
        places(panel).flat_map(|p| places(series).map(move |s| [p, s])).collect();
    let cell = |x_at: usize, [panel_at, series_at]: [usize; 2]| {
        let places = [(Some(x), x_at), (series, series_at), (panel, panel_at)];
        settings.cell(measure, &held, &places)
    };
    let lines: Vec<Vec<Option<Summary>>> = (0..x.texts.len().min(LINES_MAX))
        .map(|at| columns.iter().take(COLUMNS_MAX).map(|&column| cell(at, column)).collect())
        .collect();
    let all = || lines.iter().flatten().flatten();
    all().next()?;
    let pooled = held.iter().any(|(_, value)| value.is_none());
    let mut out = format!(
        "{} against {}, mean of {}{}\n",
        measure.title(),
        x.axis.label,
        runs(all().map(|one| one.n)),
        held_words(&held, pooled)
    );
    let name = |axis: Option<&Levels<'_>>, at: usize| axis.map(|axis| short(&axis.texts[at]));
    let heads = columns.iter().take(COLUMNS_MAX).map(|&[p, s]| {
        let words: Vec<_> = [name(panel, p), name(series, s)].into_iter().flatten().collect();
        if words.is_empty() { measure.column.label.clone() } else { words.join(" ") }
    });
    let heads: Vec<String> = heads.collect();
    let first = x.texts.iter().chain([&x.axis.label]).map(|text| text.chars().count()).max()?;
    let wide = |head: &String| head.chars().count().max(13);
    let _ = write!(out, "{:>first$}", x.axis.label);
    for head in &heads {
        let _ = write!(out, "  {head:>width$}", width = wide(head));
    }
    for (at, line) in lines.iter().enumerate() {
        let _ = write!(out, "\n{:>first$}", x.texts[at]);
        for (one, head) in line.iter().zip(&heads) {
            let text = one.as_ref().map_or("-".into(), |one| {
                let half = one.half.filter(|_| !pooled);
                let half = half.map(|half| format!(" ±{:.2}", half * measure.by));
                format!("{:.2}{}", one.mean * measure.by, half.unwrap_or_default())
            });
            let _ = write!(out, "  {text:>width$}", width = wide(head));
        }
    }
    let explained = [Some(x), series, panel].into_iter().flatten().map(|axis| &axis.axis.label);
    let explained = explained.chain([&measure.column.label]).map(|label| label.chars().count());
    let width = explained.max().unwrap_or(first);
    let mut explain = |head: &str, words: &str| {
        if !words.is_empty() {
            let _ = write!(out, "\n{head:>width$}  {words}");
        }
    };
    explain(&measure.column.label, &meaning(measure.column));
    let half = all().any(|one| one.half.is_some()) && !pooled;
    if half {
        explain("±", "half of the 95 % interval of the mean over seeds (Student's t)");
    }
    for axis in [Some(x), series, panel].into_iter().flatten() {
        if let Some(column) = view.table.column(&axis.axis.name) {
            explain(&axis.axis.label, &meaning(column));
        }
    }
    let left = (columns.len() - heads.len(), x.texts.len() - lines.len());
    if left != (0, 0) {
        let _ = write!(out, "\n{} columns and {} lines more are on the page", left.0, left.1);
    }
    Some(out)
}
