//! Excitation over inhibition, in what is stored and in what flows.

use super::{Figure, multiples, span};
use crate::lab::report::RunView;
use crate::lab::report::chart::{Chart, Series};
use crate::lab::report::colour;
use crate::lab::report::number::ratio;
use crate::lab::report::scale::Axis;
use crate::lab::store::record::LayerRecord;

pub(super) fn draw(view: &RunView<'_>) -> Option<Figure> {
    let layers = view.layers();
    let curve = |layer: usize, pick: &dyn Fn(&LayerRecord) -> Option<f64>| {
        let points = view.epochs.iter().filter_map(|record| {
            let one = record.layers.iter().find(|one| one.layer == layer)?;
            Some((f64::from(record.epoch), pick(one)?))
        });
        points.collect::<Vec<_>>()
    };
    let mut stored = Vec::new();
    let mut flowing = Vec::new();
    for &layer in &layers {
        let hue = colour::layer(layer);
        let points = curve(layer, &|one| divide(one.levels[0], one.levels[1]));
        stored.push(Series::new(&format!("layer {layer}"), hue, points));
        for (stream, name) in ["p", "n"].into_iter().enumerate() {
            let points = curve(layer, &|one| {
                let [excite, inhibit] = one.currents[stream];
                divide(u64::try_from(excite).ok()?, u64::try_from(inhibit).ok()?)
            });
            let series = Series::new(&format!("layer {layer}\u{202f}{name}"), hue, points);
            flowing.push(series.dashed(stream == 1));
        }
    }
    let both = [(stored, "Stored: sums of levels"), (flowing, "Flowing: bank currents")];
    let (first, last) = span(view)?;
    let charts: Vec<_> = both
        .into_iter()
        .filter_map(|(mut series, heading)| {
            series.retain(|one| !one.points.is_empty());
            if series.is_empty() {
                return None;
            }
            let values = series.iter().flat_map(|one| &one.points).map(|point| point.1);
            let y = Axis::ratio(values, "E/I (log scale)");
            let mut chart = Chart::new(460.0, 300.0, 96.0, Axis::epochs(first, last), y);
            chart.rule(1.0, "balance");
            chart.series(&series, |value| ratio(Some(value)));
            Some((heading.to_string(), chart.finish(&format!("E/I over epochs. {heading}"))))
        })
        .collect();
    if charts.is_empty() {
        return None;
    }
    Some(Figure {
        id: "balance",
        title: "Excitation over inhibition",
        caption: "Left, what the cells hold: levels of excitatory over inhibitory pathways, layer by \
                  layer. Right, what the columns carry while the net is evaluated, by target stream \
                  (solid p, dashed n). At 1 the two sides cancel."
            .into(),
        body: multiples(charts.into_iter()),
        wide: true,
    })
}

/// A quotient that can be drawn on a log scale.
fn divide(above: u64, below: u64) -> Option<f64> {
    crate::lab::report::number::quotient(above, below).filter(|value| *value > 0.0)
}
