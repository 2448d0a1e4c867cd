//! Births and deaths at the floor, as bars above and below zero.

use super::{drawn_percent, hue, of_layer, span};
use crate::lab::report::RunView;
use crate::lab::report::chart::Chart;
use crate::lab::report::number::{count, percent_of};
use crate::lab::report::scale::Axis;

/// A chart a layer, all on one vertical axis; none of a run without an update.
pub(super) fn charts(view: &RunView<'_>) -> Vec<Option<String>> {
    let Some((first, last)) = span(view).filter(|(first, last)| first != last) else {
        return Vec::new();
    };
    let layers = view.layers();
    let sums = |layer: usize| {
        view.epochs.iter().map(move |record| {
            let of = || of_layer(record, layer);
            let births = of().map(|one| one.births).sum::<u64>();
            let deaths = of().map(|one| one.deaths).sum::<u64>();
            (record, births, deaths, of().map(|one| one.cells).sum::<u64>())
        })
    };
    let all = || layers.iter().flat_map(|&layer| sums(layer));
    let high = all().map(|(_, births, _, cells)| drawn_percent(births, cells)).fold(0.5, f64::max);
    let low = all().map(|(_, _, deaths, cells)| drawn_percent(deaths, cells)).fold(0.5, f64::max);

    let half = 0.38 * f64::from(last - first) / view.epochs.len().max(2) as f64;
    let charts = layers.iter().map(|&layer| {
        let y = Axis::percent(-low, high, "deaths   |   births, of cells");
        let mut x = Axis::epochs(first, last);
        x.scale.from -= 2.0 * half;
        x.scale.to += 2.0 * half;
        let mut chart = Chart::new(372.0, 270.0, 100.0, x, y);
        let mut tips = Vec::new();
        for (record, births, deaths, cells) in sums(layer) {
            let epoch = f64::from(record.epoch);
            let across = (epoch - half, epoch + half);
            let (mut above, mut below) = (0, 0);
            for one in of_layer(record, layer) {
                let ends = |from: u64, more: u64| {
                    (drawn_percent(from, cells), drawn_percent(from + more, cells))
                };
                chart.bar(across, ends(above, one.births), (hue(one), 0.95), "");
                let (from, to) = ends(below, one.deaths);
                chart.bar(across, (-from, -to), (hue(one), 0.55), "");
                above += one.births;
                below += one.deaths;
            }
            tips.push((
                epoch,
                format!(
                    "epoch {}\nbirths {} ({})\ndeaths {} ({})",
                    record.epoch,
                    count(births),
                    percent_of(births, cells, 1),
                    count(deaths),
                    percent_of(deaths, cells, 1)
                ),
            ));
        }
        chart.rule(0.0, "");
        let end = sums(layer).next_back().into_iter();
        chart.beside(
            "",
            end.flat_map(|(_, births, deaths, cells)| {
                let half = |count: u64| drawn_percent(count, cells) / 2.0;
                [(half(births), "births", births), (-half(deaths), "deaths", deaths)].map(
                    |(at, name, count)| (at, format!("{name} {}", percent_of(count, cells, 1))),
                )
            }),
        );
        chart.tips(&tips);
        Some(chart.finish(&format!("Births and deaths in layer {layer} over epochs")))
    });
    charts.collect()
}
