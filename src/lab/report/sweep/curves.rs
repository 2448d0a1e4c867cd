//! Mean of a result against an axis: a line and a band for each value of one axis, a panel for each of another.

use std::collections::BTreeSet;

use super::paper::{COLUMN, marks, sheet, short};
use super::settings::{Levels, Settings};
use super::statistics::Summary;
use crate::lab::report::chart::{Chart, wide};
use crate::lab::report::colour::hue;
use crate::lab::report::number::size;
use crate::lab::report::scale::Axis;
use crate::lab::table::ColumnUnit;

/// Lines and panels drawn at most.
const LINES_MAX: usize = 8;
const PANELS_MAX: usize = 6;

/// One line of one panel: places on the abscissa and what lies there.
#[derive(Debug, Clone)]
struct Line {
    panel: usize,
    series: usize,
    points: Vec<(usize, Summary)>,
}

/// The figure, or nothing where no run has finished.
pub(super) fn draw(settings: &Settings<'_>) -> Option<String> {
    let wanted = &settings.view.figures;
    let x = settings.axis(&wanted.x)?;
    let measure = settings.measure(&wanted.y)?;
    let named = |name: &Option<String>| settings.axis(name.as_ref()?);
    let (series, panel) = (named(&wanted.series), named(&wanted.panel));
    let shown: Vec<&str> = [Some(x), series, panel]
        .into_iter()
        .flatten()
        .map(|axis| axis.axis.name.as_str())
        .collect();
    let held = settings.held(measure, &shown);
    let pooled = held.iter().any(|(_, value)| value.is_none());
    let mut all: Vec<Line> = Vec::new();
    for panel_at in 0..panel.map_or(1, |axis| axis.texts.len()).min(PANELS_MAX) {
        for series_at in 0..series.map_or(1, |axis| axis.texts.len()).min(LINES_MAX) {
            let point = |x_at: usize| {
                let places = [(Some(x), x_at), (series, series_at), (panel, panel_at)];
                Some((x_at, settings.cell(measure, &held, &places)?))
            };
            // Drawn values would meet one run each.
            let points: Vec<_> =
                if x.drawn() { vec![] } else { (0..x.texts.len()).filter_map(point).collect() };
            if !points.is_empty() {
                all.push(Line { panel: panel_at, series: series_at, points });
            }
        }
    }
    if all.is_empty() {
        return None;
    }
    let fraction = measure.column.unit == ColumnUnit::Fraction;
    let framed = |at: Option<usize>| {
        range(all.iter().filter(|line| at.is_none_or(|at| line.panel == at)), pooled, fraction)
    };
    let whole = framed(None);
    let title = measure.title();
    let panels: Vec<usize> = {
        let mut panels: Vec<usize> = all.iter().map(|line| line.panel).collect();
        panels.dedup();
        panels
    };
    // Panels share a scale, unless one of them would be pressed flat by another.
    let span = |(low, high): (f64, f64)| high - low;
    let least = panels.iter().map(|&at| span(framed(Some(at)))).fold(f64::INFINITY, f64::min);
    let own_scale = panels.len() > 1 && 4.0 * least < span(whole);
    let key = series.map_or(8.0, |axis| {
        let texts = axis.texts.iter().take(LINES_MAX).map(|text| wide(&short(text)));
        texts.fold(wide(&short(&axis.axis.label)), f64::max) + 60.0
    });
    let across = panels.len().min(3);
    let width = if panels.len() > 1 { 2.0 * COLUMN } else { COLUMN };
    let (each, high_each) =
        ((width - key) / size(across), if panels.len() > 1 { 262.0 } else { 300.0 });
    let mut body = String::new();
    for (number, &panel_at) in panels.iter().enumerate() {
        let (first, last) = (number % across == 0, number + 1 == across.min(panels.len()));
        let right = if last { key } else { 10.0 };
        let (low, high) = if own_scale { framed(Some(panel_at)) } else { whole };
        let y_axis =
            Axis::round(low * measure.by, high * measure.by, if first { &title } else { "" });
        let abscissa = abscissa(x, each - 70.0);
        let size_each = [if last { each + key } else { each }, high_each];
        let mut chart = Chart::framed(
            size_each,
            [if panel.is_some() { 30.0 } else { 12.0 }, right],
            abscissa,
            y_axis,
        );
        if let Some(panel) = panel {
            chart.heading(&format!("{} {}", panel.axis.label, short(&panel.texts[panel_at])));
        }
        let own: Vec<&Line> = all.iter().filter(|line| line.panel == panel_at).collect();
        lines(&mut chart, &own, x, pooled, measure.by);
        if let (Some(series), true) = (series, last) {
            let kinds: BTreeSet<usize> = all.iter().map(|line| line.series).collect();
            let entry = |kind: usize| (kind, hue(kind), short(&series.texts[kind]));
            chart.key(&short(&series.axis.label), kinds.into_iter().map(entry), true);
        }
        body += &chart.part(size(number % across) * each, size(number / across) * high_each);
    }
    let down = panels.len().div_ceil(across);
    let says = format!(
        "{} against {}, means of {}{}{}",
        measure.column.label,
        x.axis.label,
        runs(all.iter().flat_map(|line| &line.points).map(|(_, point)| point.n)),
        held_words(&held, pooled),
        if own_scale { "; each panel has a scale of its own" } else { "" }
    );
    Some(sheet([width, size(down) * high_each + 4.0], &says, &body))
}

/// `n = 2 to 3 runs`.
pub(super) fn runs(counts: impl Iterator<Item = usize> + Clone) -> String {
    let (least, most) = (counts.clone().min().unwrap_or(0), counts.max().unwrap_or(0));
    if least == most { format!("n = {most} runs") } else { format!("n = {least} to {most} runs") }
}

/// What is held where, for the words of a figure.
pub(super) fn held_words(held: &[(&Levels<'_>, Option<usize>)], pooled: bool) -> String {
    let mut words = if pooled {
        " with the range of pooled settings".to_owned()
    } else {
        " with 95 % confidence intervals".to_owned()
    };
    for (axis, value) in held {
        match value {
            Some(at) => words += &format!("; {} = {}", axis.axis.label, axis.texts[*at]),
            None => words += &format!("; {} pooled", axis.axis.label),
        }
    }
    words
}

/// Ends of the ordinate: those of the means, stretched by intervals by no more than 0.6 of it.
fn range<'a>(
    all: impl Iterator<Item = &'a Line> + Clone,
    pooled: bool,
    fraction: bool,
) -> (f64, f64) {
    let points = || all.clone().flat_map(|line| &line.points).map(|(_, point)| point);
    let low = points().map(|point| point.mean).fold(f64::INFINITY, f64::min);
    let high = points().map(|point| point.mean).fold(f64::NEG_INFINITY, f64::max);
    let span = if high > low { high - low } else { (high.abs() * 0.1).max(1e-12) };
    let bands = || points().filter_map(|point| ends(point, pooled));
    let from = bands().map(|band| band.0).fold(low, f64::min).max(low - 0.6 * span) - 0.05 * span;
    let to = bands().map(|band| band.1).fold(high, f64::max).min(high + 0.6 * span) + 0.05 * span;
    if fraction {
        (from.max(0.0), to.min(1.0))
    } else {
        (if low >= 0.0 { from.max(0.0) } else { from }, to)
    }
}

/// The interval of a point, or the range where settings are pooled.
fn ends(point: &Summary, pooled: bool) -> Option<(f64, f64)> {
    if pooled {
        return (point.n > 1).then_some((point.low, point.high));
    }
    point.half.map(|half| (point.mean - half, point.mean + half))
}

fn abscissa(x: &Levels<'_>, room: f64) -> Axis {
    let marks = marks(x, room);
    let ends = match &x.numbers {
        Some(numbers) => (numbers[0], numbers[numbers.len() - 1]),
        None => (-0.4, size(x.texts.len()) - 0.6),
    };
    Axis::marked(marks, ends, x.log(), &x.axis.label)
}

fn lines(chart: &mut Chart, own: &[&Line], x: &Levels<'_>, pooled: bool, by: f64) {
    let many = size(own.len());
    let place = |line: usize, at: usize| match &x.numbers {
        Some(numbers) => numbers[at],
        // Words have no distance: their points stand side by side and are not joined.
        None => size(at) + ((size(line) + 0.5) / many - 0.5) * 0.5,
    };
    for (number, line) in own.iter().enumerate() {
        let colour = hue(line.series);
        let banded = |(at, point): &(usize, Summary)| {
            let (low, high) = ends(point, pooled)?;
            Some((place(number, *at), low * by, high * by))
        };
        // Neighbours that have an interval share a band.
        for run in line.points.chunk_by(|a, b| banded(a).is_some() == banded(b).is_some()) {
            let run: Vec<_> = run.iter().filter_map(banded).collect();
            if x.numbers.is_some() && run.len() > 1 {
                chart.band(&run, colour);
            } else {
                for (at, low, high) in run {
                    chart.whisker((at, low), (at, high), colour);
                }
            }
        }
    }
    for (number, line) in own.iter().enumerate() {
        let points: Vec<_> =
            line.points.iter().map(|(at, point)| (place(number, *at), point.mean * by)).collect();
        if x.numbers.is_some() && points.len() > 1 {
            chart.line(&points, hue(line.series), "line", line.series);
        }
        for at in points {
            chart.marker(at, line.series, 3.6, hue(line.series), "mark");
        }
    }
}
