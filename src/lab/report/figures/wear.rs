//! Endurance: cells that are worn out over epochs, and how many pulses cells were sent.

use super::{Figure, drawn_percent, hue, layer_heading, of_layer, same, span, swatch};
use crate::lab::report::RunView;
use crate::lab::report::chart::{Chart, Series};
use crate::lab::report::colour::dashed;
use crate::lab::report::number::{count, percent_of, quotient, ratio, short};
use crate::lab::report::scale::Axis;
use crate::learn::statistics::{PathwayRecord, WearRecord};

pub(super) fn draw(view: &RunView<'_>) -> Option<Figure> {
    let (first, last) = span(view)?;
    let end = view.last()?;
    end.pathways.iter().find_map(|one| one.wear.as_ref())?;
    let mut body = String::new();
    for layer in view.layers() {
        let worn = worn(view, layer, (first, last));
        let pulses = pulses(view, layer);
        body += &format!(
            "<h3>{}</h3><div class=\"multiples\"><div class=\"multiple\"><h4>Worn out</h4>{worn}</div>\
             <div class=\"multiple\"><h4>Pulses a cell</h4>{pulses}</div></div>",
            layer_heading(view, layer)
        );
    }
    let rows = end.pathways.iter().filter_map(|one| Some(row(one, one.wear.as_ref()?)));
    let heads = ["pathway", "cells", "worn out", "share", "pulses a cell", "most"];
    let heads = heads.map(|head| format!("<th scope=\"col\">{head}</th>")).concat();
    body += &format!(
        "<div class=\"scroll\"><table class=\"stack\"><thead><tr>{heads}</tr></thead><tbody>{}</tbody></table></div>",
        rows.collect::<String>()
    );
    Some(Figure {
        id: "wear",
        title: "Endurance",
        caption: format!(
            "Left, cells that have taken all pulses they take, which no pulse moves any more. Right, how many pulses cells were sent \
             up to epoch {}, loads among them: cells between two powers of two.",
            end.epoch
        ),
        body,
        wide: true,
    })
}

/// Share of worn cells over epochs, a line a pathway.
fn worn(view: &RunView<'_>, layer: usize, (first, last): (u32, u32)) -> String {
    let pathways = view.last().into_iter().flat_map(move |record| of_layer(record, layer));
    let series: Vec<Series> = pathways
        .map(|pathway| {
            let points = view.epochs.iter().filter_map(|record| {
                let then = same(record, pathway)?;
                let worn = then.wear.as_ref()?.worn;
                Some((f64::from(record.epoch), drawn_percent(worn, then.cells)))
            });
            let series = Series::new(&pathway.pathway, hue(pathway), points.collect());
            series.dashed(dashed(&pathway.pathway))
        })
        .collect();
    let points = series.iter().flat_map(|one| &one.points);
    let high = points.map(|point| point.1).fold(1.0, f64::max);
    let y = Axis::percent(0.0, high, "cells worn out");
    let mut chart = Chart::new(480.0, 250.0, 74.0, Axis::epochs(first, last), y);
    chart.series(&series, |value| format!("{value:.1}\u{202f}%"));
    chart.finish(&format!("Worn cells of layer {layer} over epochs, by pathway"))
}

/// The smallest number of pulses in a bin.
fn least(bin: usize) -> u64 {
    if bin == 0 { 0 } else { 1 << (bin - 1) }
}

/// Cells by pulses at the end, pathways on one another.
fn pulses(view: &RunView<'_>, layer: usize) -> String {
    let all = || {
        let of = view.last().into_iter().flat_map(move |record| of_layer(record, layer));
        of.filter_map(|one| Some((one, one.wear.as_ref()?)))
    };
    let bins = all().map(|(_, wear)| wear.histogram.len()).max().unwrap_or(0);
    let cells: u64 = all().map(|(one, _)| one.cells).sum();
    let of = |wear: &WearRecord, bin: usize| wear.histogram.get(bin).copied().unwrap_or(0);
    let sums = (0..bins).map(|bin| all().map(|(_, wear)| of(wear, bin)).sum::<u64>());
    let high = sums.map(|sum| drawn_percent(sum, cells)).fold(1.0, f64::max);
    let ticks =
        (0..bins).map(|bin| (f64::from(u32::try_from(bin).unwrap_or(0)), short(least(bin))));
    let x = Axis::cells(bins, ticks.collect(), "pulses, at least");
    let mut chart = Chart::new(480.0, 250.0, 40.0, x, Axis::percent(0.0, high, "cells"));
    for bin in 0..bins {
        let at = f64::from(u32::try_from(bin).unwrap_or(0));
        let mut below = 0;
        for (one, wear) in all() {
            let cells_here = of(wear, bin);
            let ends = (drawn_percent(below, cells), drawn_percent(below + cells_here, cells));
            let tip = format!(
                "{}: {} cells ({})",
                one.pathway,
                count(cells_here),
                percent_of(cells_here, one.cells, 1)
            );
            if cells_here > 0 {
                chart.bar((at - 0.4, at + 0.4), ends, (hue(one), 0.95), &tip);
            }
            below += cells_here;
        }
    }
    chart.finish(&format!("Cells of layer {layer} by the pulses they were sent"))
}

fn row(one: &PathwayRecord, wear: &WearRecord) -> String {
    let cells = [
        count(one.cells),
        count(wear.worn),
        percent_of(wear.worn, one.cells, 1),
        ratio(quotient(wear.pulses, one.cells)),
        count(wear.most),
    ];
    let cells = cells.map(|cell| format!("<td>{cell}</td>")).concat();
    format!("<tr><th scope=\"row\">{} {}</th>{cells}</tr>", one.layer, swatch(one))
}
