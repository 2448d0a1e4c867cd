//! How many cells hold which level, before learning and after.

use super::{Figure, drawn_percent, hue, layer_heading, of_layer, same, swatch};
use crate::lab::report::RunView;
use crate::lab::report::chart::Chart;
use crate::lab::report::number::{count, escape, percent_of, quotient, ratio, size};
use crate::lab::report::scale::Axis;
use crate::lab::store::record::PathwayRecord;

pub(super) fn draw(view: &RunView<'_>) -> Option<Figure> {
    let (first, last) = (view.epochs.first()?, view.epochs.last()?);
    let mut body = String::new();
    for layer in view.layers() {
        // One pair of axes for the whole layer, cut where the last cell is.
        let all = || [first, last].into_iter().flat_map(move |record| of_layer(record, layer));
        let full = |one: &PathwayRecord| one.histogram.iter().rposition(|&cells| cells > 0);
        let bins = all().filter_map(full).max().map_or(1, |bin| bin + 1);
        let shares =
            all().flat_map(|one| one.histogram.iter().map(|&n| drawn_percent(n, one.cells)));
        let high = shares.fold(0.0, f64::max);
        let width = bin_width(view, layer, all().map(|one| one.histogram.len()).max().unwrap_or(1));
        let unit = if width.is_some() { "level" } else { "level bin" };
        let width = width.unwrap_or(1.0);

        let charts = of_layer(last, layer).map(|now| {
            let x = Axis::levels(size(bins) * width, unit);
            let y = Axis::root_percent(high * 1.04, "cells (root scale)");
            let mut chart = Chart::new(280.0, 215.0, 10.0, x, y);
            let edge = |bin: usize| size(bin) * width;
            for (bin, &cells) in now.histogram.iter().enumerate().take(bins) {
                let top = drawn_percent(cells, now.cells);
                let gap = if bins > 40 { 0.0 } else { 0.06 * width };
                chart.bar((edge(bin) + gap, edge(bin + 1) - gap), (0.0, top), hue(now), 0.85);
            }
            if let Some(then) = same(first, now).filter(|_| first.epoch != last.epoch) {
                let steps =
                    then.histogram.iter().enumerate().take(bins).flat_map(|(bin, &cells)| {
                        let top = drawn_percent(cells, then.cells);
                        [(edge(bin), top), (edge(bin + 1), top)]
                    });
                chart.line(&steps.collect::<Vec<_>>(), "var(--ink)", "line thin");
            }
            let tips = now.histogram.iter().enumerate().take(bins).map(|(bin, &cells)| {
                let before = same(first, now).and_then(|then| then.histogram.get(bin)).copied();
                let text = format!(
                    "{unit} {:.0}\nnow {} ({})\nat first {}",
                    edge(bin),
                    count(cells),
                    percent_of(cells, now.cells, 2),
                    before.map_or("–".into(), count)
                );
                (edge(bin) + width / 2.0, text)
            });
            chart.tips(&tips.collect::<Vec<_>>());
            let mean = ratio(quotient(now.levels, now.cells));
            let alt = format!("Levels of pathway {} of layer {layer}", escape(&now.pathway));
            let chart = chart.finish(&alt);
            format!(
                "<div class=\"multiple\"><h4>{} mean level {mean}</h4>{chart}</div>",
                swatch(now)
            )
        });
        body += &format!(
            "<h3>{}</h3><div class=\"multiples small\">{}</div>",
            layer_heading(view, layer),
            charts.collect::<String>()
        );
    }
    if body.is_empty() {
        return None;
    }
    Some(Figure {
        id: "histograms",
        title: "Levels",
        caption: format!(
            "Share of cells at each level: bars after epoch {}, the line before learning (epoch {}). The \
             vertical axis follows the square root so that rare levels stay visible.",
            last.epoch, first.epoch
        ),
        body,
        wide: true,
    })
}

/// Levels a bin, where the range of levels is known.
fn bin_width(view: &RunView<'_>, layer: usize, bins: usize) -> Option<f64> {
    let heat = view.heats.iter().find(|heat| heat.layer == layer).or(view.heats.first())?;
    Some((f64::from(heat.level_max) + 1.0) / size(bins.max(1)))
}
