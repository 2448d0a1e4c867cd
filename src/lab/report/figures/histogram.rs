//! How many cells hold which level: epoch by epoch as a picture, and in its margin before learning and after.

use super::{Figure, drawn_percent, hue, layer_heading, of_layer, same, swatch};
use crate::lab::report::chart::Chart;
use crate::lab::report::image::indexed;
use crate::lab::report::number::{escape, percent_of, quotient, ratio, size};
use crate::lab::report::scale::{Axis, Curve, Scale};
use crate::lab::report::{RunView, colour};
use crate::lab::store::record::EpochRecord;
use crate::learn::statistics::PathwayRecord;

/// Epochs drawn at most; of more, every second, third, ...
const EPOCHS_MAX: usize = 200;
/// Bands of the margin that tell their numbers.
const TIPS_MAX: usize = 16;

pub(super) fn draw(view: &RunView<'_>) -> Option<Figure> {
    let (first, last) = (view.epochs.first()?, view.epochs.last()?);
    let mut body = String::new();
    for layer in view.layers() {
        let scale = LevelScale::of(view, layer);
        // One margin for the whole layer.
        let ends = [first, last].into_iter().flat_map(|record| of_layer(record, layer));
        let shares =
            ends.flat_map(|one| one.histogram.iter().map(|&n| drawn_percent(n, one.cells)));
        let high = shares.fold(0.0, f64::max);
        let charts = of_layer(last, layer).map(|now| {
            let mean = ratio(quotient(now.levels, now.cells));
            format!(
                "<div class=\"multiple\"><h4>{} mean level {mean}</h4>{}</div>",
                swatch(now),
                chart(view, now, &scale, high)
            )
        });
        body += &format!(
            "<h3>{}</h3><div class=\"multiples\">{}</div>",
            layer_heading(view, layer),
            charts.collect::<String>()
        );
    }
    if body.is_empty() {
        return None;
    }
    body += &bar();
    Some(Figure {
        id: "levels",
        title: "Levels over epochs",
        caption: format!(
            "Left, the share of a pathway's cells at each level after every epoch, and the mean level as a line. \
             Right, the same after epoch {} as bars, with a line for epoch {}; its axis follows the square root so \
             that rare levels stay visible.",
            last.epoch, first.epoch
        ),
        body,
        wide: true,
    })
}

/// The vertical axis of a layer: bins up to the highest that any epoch used.
struct LevelScale {
    bins: usize,
    /// Levels a bin.
    width: f64,
}

impl LevelScale {
    fn of(view: &RunView<'_>, layer: usize) -> Self {
        let all = || view.epochs.iter().flat_map(move |record| of_layer(record, layer));
        let full = |one: &PathwayRecord| one.histogram.iter().rposition(|&cells| cells > 0);
        let bins = all().filter_map(full).max().map_or(1, |bin| bin + 1);
        let binned = all().map(|one| one.histogram.len()).max().unwrap_or(1).max(1);
        Self { bins, width: (f64::from(view.level_max) + 1.0) / size(binned) }
    }

    fn edge(&self, bin: usize) -> f64 {
        size(bin) * self.width
    }
}

fn chart(view: &RunView<'_>, now: &PathwayRecord, scale: &LevelScale, high: f64) -> String {
    let stride = view.epochs.len().div_ceil(EPOCHS_MAX).max(1);
    // counted from the end, so that the last epoch is among them
    let mut records: Vec<&EpochRecord> = view.epochs.iter().rev().step_by(stride).collect();
    records.reverse();
    let arrays: Vec<(&EpochRecord, &PathwayRecord)> =
        records.iter().filter_map(|&record| Some((record, same(record, now)?))).collect();
    let (from, to) = match (arrays.first(), arrays.last()) {
        (Some((first, _)), Some((last, _))) => (first.epoch, last.epoch),
        _ => return String::new(),
    };
    let half = 0.5 * size(stride);
    let mut x = Axis::epochs(from, to);
    x.scale =
        Scale { curve: Curve::Linear, from: f64::from(from) - half, to: f64::from(to) + half };
    let top = scale.edge(scale.bins);
    let mut chart = Chart::new(540.0, 250.0, 184.0, x, Axis::levels(top, "level"));
    if let Some(uri) = strip(&arrays, scale.bins) {
        chart.picture((f64::from(from) - half, f64::from(to) + half), (0.0, top), &uri);
    }
    let means: Vec<(f64, f64)> = arrays
        .iter()
        .filter_map(|(record, one)| {
            // a level is drawn from its own number to the next
            Some((f64::from(record.epoch), quotient(one.levels, one.cells)? + 0.5))
        })
        .collect();
    chart.line(&means, "var(--card)", "line casing", 0);
    chart.line(&means, "var(--ink)", "line thin", 0);
    chart.tips(&tips(&arrays));
    margin(&mut chart, view, now, scale, high);
    let alt =
        format!("Levels of pathway {} of layer {} over epochs", escape(&now.pathway), now.layer);
    chart.finish(&alt)
}

/// Epochs across, bins down from the highest.
fn strip(arrays: &[(&EpochRecord, &PathwayRecord)], bins: usize) -> Option<String> {
    let mut indices = Vec::with_capacity(bins * arrays.len());
    for bin in (0..bins).rev() {
        for (_, one) in arrays {
            let cells = one.histogram.get(bin).copied().unwrap_or(0);
            indices.push(colour::share_index(quotient(cells, one.cells).unwrap_or(0.0)));
        }
    }
    indexed(arrays.len(), bins, &indices, &colour::shares())
}

fn tips(arrays: &[(&EpochRecord, &PathwayRecord)]) -> Vec<(f64, String)> {
    let tip = |(record, one): &(&EpochRecord, &PathwayRecord)| {
        let text = format!(
            "epoch {}\nmean level {}\non the floor {}",
            record.epoch,
            ratio(quotient(one.levels, one.cells)),
            percent_of(one.floor, one.cells, 1)
        );
        (f64::from(record.epoch), text)
    };
    arrays.iter().map(tip).collect()
}

/// The last epoch as bars, the first as a line.
fn margin(
    chart: &mut Chart,
    view: &RunView<'_>,
    now: &PathwayRecord,
    scale: &LevelScale,
    high: f64,
) {
    let axis = Axis::root_percent(high * 1.04, "cells (root scale)");
    chart.margin(&axis);
    let share = |one: &PathwayRecord, bin: usize| {
        drawn_percent(one.histogram.get(bin).copied().unwrap_or(0), one.cells)
    };
    let gap = if scale.bins > 40 { 0.0 } else { 0.06 * scale.width };
    let bars = (0..scale.bins)
        .map(|bin| ((scale.edge(bin) + gap, scale.edge(bin + 1) - gap), share(now, bin)));
    chart.margin_bars(&axis, bars, hue(now));
    let first =
        view.epochs.first().filter(|first| view.last().map(|r| r.epoch) != Some(first.epoch));
    let then = first.and_then(|first| same(first, now));
    if let Some(then) = then {
        let steps = (0..scale.bins).flat_map(|bin| {
            [(share(then, bin), scale.edge(bin)), (share(then, bin), scale.edge(bin + 1))]
        });
        chart.margin_line(&axis, &steps.collect::<Vec<_>>());
    }
    let each = scale.bins.div_ceil(TIPS_MAX).max(1);
    let tips = (0..scale.bins).step_by(each).map(|from| {
        let to = (from + each).min(scale.bins);
        let sum = |one: &PathwayRecord| one.histogram.iter().take(to).skip(from).sum::<u64>();
        let before = then.map_or("–".into(), |then| percent_of(sum(then), then.cells, 2));
        let (low, end) = (scale.edge(from), scale.edge(to));
        let ends = if end - low > 1.0 {
            format!("s {low:.0} to {:.0}", end - 1.0)
        } else {
            format!(" {low:.0}")
        };
        let text =
            format!("level{ends}\nnow {}\nat first {before}", percent_of(sum(now), now.cells, 2));
        ((low, end), text)
    });
    chart.margin_tips(&tips.collect::<Vec<_>>());
}

/// The colour scale of shares.
fn bar() -> String {
    let ticks = ["0.01", "0.1", "1", "10", "100"].into_iter().enumerate();
    let ticks = ticks.map(|(at, text)| (size(at) / 4.0, format!("{text}\u{202f}%")));
    Chart::scale(&ticks.collect::<Vec<_>>(), "share of the pathway's cells, empty where none")
}
