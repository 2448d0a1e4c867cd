//! Excitation over inhibition, in what is stored and in what flows, by target stream.

use super::{of_layer, span};
use crate::lab::report::RunView;
use crate::lab::report::chart::{Chart, Series};
use crate::lab::report::colour::dashed;
use crate::lab::report::number::ratio;
use crate::lab::report::scale::Axis;
use crate::lab::store::record::EpochRecord;

/// A chart a layer, all on one vertical axis.
pub(super) fn charts(view: &RunView<'_>) -> Vec<Option<String>> {
    let Some((first, last)) = span(view) else { return Vec::new() };
    let all: Vec<_> = view.layers().into_iter().map(|layer| (layer, lines(view, layer))).collect();
    let values = || {
        let points = all.iter().flat_map(|(_, lines)| lines).flat_map(|one| &one.points);
        points.map(|point| point.1)
    };
    let chart = |(layer, lines): &(usize, Vec<Series>)| {
        if lines.is_empty() {
            return None;
        }
        let y = Axis::ratio(values(), "E/I (log scale)");
        let mut chart = Chart::new(372.0, 270.0, 104.0, Axis::epochs(first, last), y);
        chart.rule(1.0, "balance");
        chart.series(lines, |value| ratio(Some(value)));
        Some(chart.finish(&format!("Excitation over inhibition in layer {layer} over epochs")))
    };
    all.iter().map(chart).collect()
}

fn lines(view: &RunView<'_>, layer: usize) -> Vec<Series> {
    let paired = view.last().is_some_and(|last| of_layer(last, layer).all(|p| p.pathway.len() < 2));
    let kinds: [(&str, &str, Pick); 2] =
        [("stored", "var(--a)", stored), ("flowing", "var(--b)", flowing)];
    let mut lines = Vec::new();
    for (kind, hue, pick) in kinds {
        for (stream, name) in ["p", "n"].into_iter().enumerate() {
            let points = view.epochs.iter().filter_map(|record| {
                let [above, below] = pick(record, layer, stream)?;
                let value = super::super::number::quotient(above, below)?;
                (value > 0.0).then(|| (f64::from(record.epoch), value))
            });
            let points: Vec<_> = points.collect();
            let name = if paired { kind.into() } else { format!("{kind}\u{202f}{name}") };
            if !points.is_empty() {
                lines.push(Series::new(&name, hue, points).dashed(stream == 1));
            }
        }
    }
    lines
}

/// Excitation and inhibition that reach a stream of a layer.
type Pick = fn(&EpochRecord, usize, usize) -> Option<[u64; 2]>;

/// Sums of levels of the arrays that drive a stream.
fn stored(record: &EpochRecord, layer: usize, stream: usize) -> Option<[u64; 2]> {
    let sum = |excites: bool| {
        let arrays = of_layer(record, layer)
            .filter(|one| usize::from(dashed(&one.pathway)) == stream && one.excites == excites);
        arrays.fold(0u64, |sum, one| sum.saturating_add(one.levels))
    };
    Some([sum(true), sum(false)])
}

/// Sums of bank currents of a stream.
fn flowing(record: &EpochRecord, layer: usize, stream: usize) -> Option<[u64; 2]> {
    let one = record.layers.iter().find(|one| one.layer == layer)?;
    let [excite, inhibit] = one.currents[stream];
    Some([u64::try_from(excite).ok()?, u64::try_from(inhibit).ok()?])
}
