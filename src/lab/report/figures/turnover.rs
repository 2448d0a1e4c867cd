//! Births and deaths at the floor, as bars above and below zero.

use super::{Figure, drawn_percent, hue, layer_heading, multiples, of_layer, span};
use crate::lab::report::RunView;
use crate::lab::report::chart::Chart;
use crate::lab::report::number::{count, percent_of};
use crate::lab::report::scale::Axis;

pub(super) fn draw(view: &RunView<'_>) -> Option<Figure> {
    let (first, last) = span(view)?;
    let layers = view.layers();
    if layers.is_empty() || last == first {
        return None;
    }
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
        let y = Axis::percent(-low, high, "deaths   |   births");
        let mut x = Axis::epochs(first, last);
        x.scale.from -= 2.0 * half;
        x.scale.to += 2.0 * half;
        let mut chart = Chart::new(460.0, 300.0, 20.0, x, y);
        let mut tips = Vec::new();
        for (record, births, deaths, cells) in sums(layer) {
            let epoch = f64::from(record.epoch);
            let across = (epoch - half, epoch + half);
            let (mut above, mut below) = (0, 0);
            for one in of_layer(record, layer) {
                let ends = |from: u64, more: u64| {
                    (drawn_percent(from, cells), drawn_percent(from + more, cells))
                };
                chart.bar(across, ends(above, one.births), hue(one), 0.95);
                let (from, to) = ends(below, one.deaths);
                chart.bar(across, (-from, -to), hue(one), 0.55);
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
        chart.tips(&tips);
        (layer_heading(view, layer), chart.finish(&format!("Births and deaths of layer {layer}")))
    });
    let body = multiples(charts);
    let legend = view.last().map(|record| {
        let mut seen: Vec<&str> = Vec::new();
        let mut out = String::new();
        for one in &record.pathways {
            if !seen.contains(&one.pathway.as_str()) {
                seen.push(&one.pathway);
                out += &super::swatch(one);
            }
        }
        format!("<p class=\"legend\">{out}</p>")
    });
    Some(Figure {
        id: "turnover",
        title: "Births and deaths at the floor",
        caption:
            "Compared with the start, as a share of the layer's cells. Above zero: cells that left \
                  the floor. Below: cells that reached it."
                .into(),
        body: legend.unwrap_or_default() + body.as_str(),
        wide: true,
    })
}
