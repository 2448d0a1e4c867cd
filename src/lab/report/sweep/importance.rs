//! How much of the variance of a result each axis explains.
//!
//! ```text
//! share of an axis = sum over its values of n (mean of the runs with that value - mean)^2 / sum over runs of (x - mean)^2
//! seeds            = sum over runs of (x - mean of its setting)^2                         / the same
//! together         = 1 - all of these                 what axes explain only together, where every setting was run equally often
//! chance           = (values - 1) / (runs - 1)        what an axis without any effect is expected to explain
//! ```
//!
//! Values drawn from a range count as the ranges of [`Levels::ranges`]. Where settings are missing, or were run unequally
//! often, or were drawn, axes are not independent of one another: shares may overlap, and there is no remainder.

use super::measure::Measure;
use super::paper::{COLUMN, sheet, short};
use super::settings::{Levels, Settings};
use crate::lab::report::chart::{Chart, wide};
use crate::lab::report::colour::hue;
use crate::lab::report::number::{percent, size};
use crate::lab::report::scale::Axis;

/// Axes drawn at most.
const AXES_MAX: usize = 10;

/// What explains how much.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Part {
    /// Axis, or what else.
    pub name: String,
    /// Of the variance, 0 to 1.
    pub share: f64,
    /// What would be expected of an axis that does nothing.
    pub chance: Option<f64>,
}

/// The variance of a result, taken apart.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Importance {
    /// Axes, the most important first, then seeds and what axes do together.
    pub parts: Vec<Part>,
    /// Runs that have the result.
    pub runs: usize,
    /// Whether every setting was run equally often, so that the parts add up.
    pub balanced: bool,
}

/// None where fewer than three runs have the result, where it is the same in all, or where no axis varies.
pub(super) fn importance(settings: &Settings<'_>, measure: Measure<'_>) -> Option<Importance> {
    let number = |row: usize| measure.column.values.number(row).filter(|x| x.is_finite());
    let rows: Vec<(usize, f64)> =
        (0..settings.view.table.len()).filter_map(|row| Some((row, number(row)?))).collect();
    let axes: Vec<&Levels<'_>> = settings.axes.iter().filter(|axis| axis.varies()).collect();
    if rows.len() < 3 || axes.is_empty() {
        return None;
    }
    let mean = rows.iter().map(|(_, x)| x).sum::<f64>() / size(rows.len());
    let whole: f64 = rows.iter().map(|(_, x)| (x - mean).powi(2)).sum();
    if whole <= f64::EPSILON * rows.len() as f64 * mean * mean {
        return None;
    }
    // sums of squares between the groups of a code
    let between = |codes: &dyn Fn(usize) -> Option<usize>| {
        let mut groups: Vec<(usize, f64)> = Vec::new();
        for &(row, x) in &rows {
            let Some(code) = codes(row) else { continue };
            if groups.len() <= code {
                groups.resize(code + 1, (0, 0.0));
            }
            groups[code].0 += 1;
            groups[code].1 += x;
        }
        groups.retain(|(n, _)| *n > 0);
        let of = |(n, sum): &(usize, f64)| size(*n) * (sum / size(*n) - mean).powi(2);
        (groups.iter().map(of).sum::<f64>(), groups)
    };
    let mut parts: Vec<Part> = axes
        .iter()
        .map(|axis| {
            let places =
                if axis.binned() { axis.ranges().1 } else { (0..axis.texts.len()).collect() };
            let (squares, groups) = between(&|row| Some(places[axis.codes[row]?]));
            let chance = size(groups.len() - 1) / size(rows.len() - 1);
            let name = axis.axis.label.clone();
            Part { name, share: squares / whole, chance: Some(chance.min(1.0)) }
        })
        .collect();
    parts.sort_by(|a, b| b.share.total_cmp(&a.share));
    parts.truncate(AXES_MAX);

    let mut setting = vec![0; settings.view.table.len()];
    for (at, group) in settings.groups.iter().enumerate() {
        group.iter().for_each(|&row| setting[row] = at);
    }
    let (squares, counts) = between(&|row| Some(setting[row]));
    let each = counts.first().map_or(0, |(n, _)| *n);
    let all: usize = axes.iter().map(|axis| axis.texts.len()).product();
    let balanced = counts.len() == all
        && counts.iter().all(|(n, _)| *n == each)
        && !axes.iter().any(|axis| axis.binned());
    let repeated = counts.iter().any(|(n, _)| *n > 1);
    let seeds = 1.0 - squares / whole;
    if repeated {
        parts.push(Part { name: "seeds".into(), share: seeds.max(0.0), chance: None });
    }
    if balanced && axes.len() > 1 {
        let rest = 1.0 - parts.iter().map(|part| part.share).sum::<f64>();
        parts.push(Part { name: "axes together".into(), share: rest.max(0.0), chance: None });
    }
    Some(Importance { parts, runs: rows.len(), balanced })
}

/// The figure, or nothing where no axis explains anything.
pub(super) fn draw(settings: &Settings<'_>) -> Option<String> {
    let measure = settings.measure(&settings.view.figures.y)?;
    let found = importance(settings, measure)?;
    let count = found.parts.len();
    let high = found.parts.iter().map(|part| part.share).fold(0.0, f64::max);
    let down = |at: usize| size(count - 1 - at);
    let names = found.parts.iter().enumerate();
    let names = names.map(|(at, part)| (down(at), short(&part.name))).collect();
    let x =
        Axis::percent(0.0, 100.0 * high, &format!("of the variance of {}", measure.column.label));
    let height = 74.0 + 28.0 * size(count);
    let right = wide("100.0 %") + 18.0;
    let mut chart =
        Chart::framed([COLUMN, height], [12.0, right], x, Axis::cells(count, names, ""));
    for (at, part) in found.parts.iter().enumerate() {
        let y = down(at);
        let colour = if part.chance.is_some() { hue(0) } else { "var(--c)" };
        chart.bar((0.0, 100.0 * part.share), (y - 0.33, y + 0.33), (colour, 1.0), "");
        if let Some(chance) = part.chance.filter(|chance| *chance <= high) {
            chart.whisker((100.0 * chance, y - 0.42), (100.0 * chance, y + 0.42), "var(--ink)");
        }
    }
    let labels = found.parts.iter().enumerate();
    chart.beside("", labels.map(|(at, part)| (down(at), percent(part.share, 1))));
    let says = format!(
        "Share of the variance of {} over {} runs that each axis explains; marks: what chance alone would explain",
        measure.column.label, found.runs
    );
    Some(sheet([COLUMN, height + 4.0], &says, &chart.part(0.0, 0.0)))
}
