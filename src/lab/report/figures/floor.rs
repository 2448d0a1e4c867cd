//! Cells on the floor over epochs, by pathway.

use super::{Figure, drawn_percent, hue, layer_heading, multiples, of_layer, same, span};
use crate::lab::report::RunView;
use crate::lab::report::chart::{Chart, Series};
use crate::lab::report::colour::dashed;
use crate::lab::report::scale::Axis;

pub(super) fn draw(view: &RunView<'_>) -> Option<Figure> {
    let (first, last) = span(view)?;
    let layers = view.layers();
    if layers.is_empty() {
        return None;
    }
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
    let charts = all.iter().map(|(layer, series)| {
        let y = Axis::percent(0.0, high, "cells on the floor");
        let mut chart = Chart::new(460.0, 290.0, 86.0, Axis::epochs(first, last), y);
        chart.series(series, |value| format!("{value:.1}\u{202f}%"));
        let alt = format!("Floor fraction of layer {layer} over epochs, by pathway");
        (layer_heading(view, *layer), chart.finish(&alt))
    });
    Some(Figure {
        id: "floor",
        title: "Floor fraction",
        caption: "Share of cells that rest on the floor of the programming window. \
                  Blue pathways excite, orange ones inhibit; dashed lines drive the n stream."
            .into(),
        body: multiples(charts),
        wide: true,
    })
}
