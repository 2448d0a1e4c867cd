//! Right answers over epochs, or returns of a policy: what the runs of a setting knew after each, their mean and its interval.

use std::collections::BTreeMap;

use serde_json::{Value, json};

use super::curves::{held_words, runs};
use super::paper::{COLUMN, sheet, short};
use super::settings::{Levels, Settings};
use super::statistics::{Summary, summary};
use crate::lab::report::chart::{Chart, wide};
use crate::lab::report::colour::hue;
use crate::lab::report::scale::Axis;

/// Runs whose records are read at most.
const RUNS_MAX: usize = 2000;
/// Epochs drawn at most; of more, every second, third, ..., and the last.
const EPOCHS_MAX: usize = 60;
/// Lines drawn on paper at most.
const LINES_MAX: usize = 8;

/// Right answers over epochs, or returns, by row of the table.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Learning {
    /// What the answers are, such as `validation accuracy`.
    pub label: String,
    /// Whether they are shares of a whole, shown in percent; returns are shown as they are.
    pub shares: bool,
    /// Epoch and share or return, in order; empty where a run has none or was not read.
    pub rows: Vec<Vec<(u32, f64)>>,
}

/// Rows whose records a page wants: all, or where they are too many those of settings that differ from the best one in
/// one axis at most.
#[must_use]
pub fn wanted(view: &super::SweepView<'_>) -> Vec<usize> {
    let settings = Settings::new(view);
    let all = view.table.len();
    if all <= RUNS_MAX {
        return (0..all).collect();
    }
    let measure = settings.measure(&view.figures.y);
    let best = measure.and_then(|measure| settings.best(measure)).map(|(rows, _)| rows[0]);
    let Some(best) = best else { return Vec::new() };
    let off = |row: usize| {
        settings.axes.iter().filter(|axis| axis.codes[row] != axis.codes[best]).count()
    };
    (0..all).filter(|&row| off(row) <= 1).take(RUNS_MAX).collect()
}

/// Epochs that are drawn: those that the runs have, thinned.
fn epochs(learning: &Learning) -> Vec<u32> {
    let mut all: Vec<u32> = learning.rows.iter().flatten().map(|(epoch, _)| *epoch).collect();
    all.sort_unstable();
    all.dedup();
    let stride = all.len().div_ceil(EPOCHS_MAX).max(1);
    // counted from the end, so that the last one is among them
    let mut kept: Vec<u32> = all.iter().rev().step_by(stride).copied().collect();
    kept.reverse();
    kept
}

/// Means of some rows at the epochs that are drawn; none where no row has it.
fn line(learning: &Learning, rows: &[usize], epochs: &[u32]) -> Vec<Option<Summary>> {
    let mut by_epoch: BTreeMap<u32, Vec<f64>> = BTreeMap::new();
    for (epoch, share) in rows.iter().filter_map(|&row| learning.rows.get(row)).flatten() {
        by_epoch.entry(*epoch).or_default().push(*share);
    }
    epochs.iter().map(|epoch| summary(by_epoch.get(epoch)?)).collect()
}

/// For the page: epochs, and means and half intervals by setting, `null` where nothing was read.
pub(super) fn data(settings: &Settings<'_>) -> Value {
    let learning = settings.view.learning;
    let epochs = epochs(learning);
    if epochs.is_empty() {
        return Value::Null;
    }
    let brief = |number: f64| format!("{number:.5}").parse::<f64>().ok();
    let of = |rows: &Vec<usize>| {
        let line = line(learning, rows, &epochs);
        line.iter().any(Option::is_some).then(|| {
            let n = line.iter().flatten().map(|one| one.n).max();
            let mean: Vec<_> = line.iter().map(|one| brief((*one)?.mean)).collect();
            let half: Vec<_> = line.iter().map(|one| brief((*one)?.half?)).collect();
            json!({"n": n, "mean": mean, "half": half})
        })
    };
    let all: Vec<_> = settings.groups.iter().map(of).collect();
    json!({"label": learning.label, "shares": learning.shares, "epochs": epochs, "settings": all})
}

/// The axis whose values are the curves: that of the curves of the result, or its abscissa.
fn series<'s, 'a>(settings: &'s Settings<'a>) -> Option<&'s Levels<'a>> {
    let wanted = &settings.view.figures;
    let named = [wanted.series.as_ref(), Some(&wanted.x)].into_iter().flatten();
    named.filter_map(|name| settings.axis(name)).find(|axis| axis.varies() && !axis.drawn())
}

/// The figure, or nothing where no run has several epochs on record.
pub(super) fn draw(settings: &Settings<'_>) -> Option<String> {
    let learning = settings.view.learning;
    let epochs = epochs(learning);
    let (&first, &last) = (epochs.first()?, epochs.last()?);
    if first == last {
        return None;
    }
    let measure = settings.measure(&settings.view.figures.y)?;
    let series = series(settings);
    let shown: Vec<&str> = series.iter().map(|axis| axis.axis.name.as_str()).collect();
    let held = settings.held(measure, &shown);
    let fits = |row: usize, at: usize| {
        super::settings::lies(&held, row) && series.is_none_or(|axis| axis.codes[row] == Some(at))
    };
    let count = series.map_or(1, |axis| axis.texts.len());
    let lines: Vec<(usize, Vec<(f64, Summary)>)> = (0..count)
        .filter_map(|at| {
            let rows: Vec<usize> =
                (0..settings.view.table.len()).filter(|&row| fits(row, at)).collect();
            let line = line(learning, &rows, &epochs).into_iter().zip(&epochs);
            let points: Vec<_> =
                line.filter_map(|(one, &epoch)| Some((f64::from(epoch), one?))).collect();
            (!points.is_empty()).then_some((at, points))
        })
        .take(LINES_MAX)
        .collect();
    let by = if learning.shares { 100.0 } else { 1.0 };
    let ends = if learning.shares { (0.0, 100.0) } else { (f64::MIN, f64::MAX) };
    let values = || lines.iter().flat_map(|(_, points)| points).map(|(_, one)| by * one.mean);
    let (low, high) = (values().reduce(f64::min)?, values().reduce(f64::max)?);
    let key = series.map_or(12.0, |axis| {
        let texts = axis.texts.iter().take(LINES_MAX).map(|text| wide(&short(text)));
        texts.fold(wide(&short(&axis.axis.label)), f64::max) + 60.0
    });
    let width = COLUMN + key - 12.0;
    let unit = if learning.shares { " (%)" } else { "" };
    let title = format!("{}{unit}", learning.label);
    let y = Axis::round((low - 2.0).max(ends.0), (high + 2.0).min(ends.1), &title);
    let mut chart = Chart::framed([width, 300.0], [12.0, key], Axis::epochs(first, last), y);
    let pooled = held.iter().any(|(_, value)| value.is_none());
    for (at, points) in &lines {
        let band = points.iter().filter_map(|(epoch, one)| {
            let half = one.half.filter(|_| !pooled)?;
            let end = |value: f64| (by * value).clamp(ends.0, ends.1);
            Some((*epoch, end(one.mean - half), end(one.mean + half)))
        });
        let band: Vec<_> = band.collect();
        if band.len() > 1 {
            chart.band(&band, hue(*at));
        }
    }
    for (at, points) in &lines {
        let points: Vec<_> = points.iter().map(|(epoch, one)| (*epoch, by * one.mean)).collect();
        chart.line(&points, hue(*at), "line", *at);
    }
    if let Some(axis) = series {
        let entries = lines.iter().map(|(at, _)| (*at, hue(*at), short(&axis.texts[*at])));
        chart.key(&short(&axis.axis.label), entries, true);
    }
    let says = format!(
        "{} over epochs, means of {}{}",
        learning.label,
        runs(lines.iter().flat_map(|(_, points)| points).map(|(_, one)| one.n)),
        held_words(&held, pooled)
    );
    Some(sheet([width, 304.0], &says, &chart.part(0.0, 0.0)))
}
