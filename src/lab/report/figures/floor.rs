//! Cells on the floor over epochs, by pathway.

use super::{drawn_percent, hue, of_layer, same, span};
use crate::lab::report::RunView;
use crate::lab::report::chart::{Chart, Series};
use crate::lab::report::colour::dashed;
use crate::lab::report::scale::Axis;

/// A chart a layer, all on one vertical axis.
pub(super) fn charts(view: &RunView<'_>) -> Vec<Option<String>> {
    let Some((first, last)) = span(view) else { return Vec::new() };
    let layers = view.layers();
    let of = |layer: usize| -> Vec<Series> {
        let pathways = view.last().into_iter().flat_map(move |record| of_layer(record, layer));
        pathways
            .map(|pathway| {
                let points = view.epochs.iter().filter_map(|record| {
                    let then = same(record, pathway)?;
                    Some((f64::from(record.epoch), drawn_percent(then.floor, then.cells)))
                });
                let series = Series::new(&pathway.pathway, hue(pathway), points.collect());
                series.dashed(dashed(&pathway.pathway))
            })
            .collect()
    };
    let all: Vec<_> = layers.iter().map(|&layer| (layer, of(layer))).collect();
    let high = all.iter().flat_map(|(_, series)| series).flat_map(|one| &one.points);
    let high = high.map(|point| point.1).fold(1.0, f64::max);
    let chart = |(layer, series): &(usize, Vec<Series>)| {
        let y = Axis::percent(0.0, high, "cells on the floor");
        let mut chart = Chart::new(372.0, 270.0, 74.0, Axis::epochs(first, last), y);
        chart.series(series, |value| format!("{value:.1}\u{202f}%"));
        chart.finish(&format!("Floor fraction of layer {layer} over epochs, by pathway"))
    };
    all.iter().map(|one| Some(chart(one))).collect()
}
