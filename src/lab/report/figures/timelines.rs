//! Floor, E/I, births and deaths over epochs: a row a layer, so that one look compares them.

use super::{Figure, balance, floor, layer_heading, swatch, turnover};
use crate::lab::report::RunView;
use crate::lab::report::number::{percent_of, quotient};

pub(super) fn draw(view: &RunView<'_>) -> Option<Figure> {
    let layers = view.layers();
    if layers.is_empty() {
        return None;
    }
    let columns = [
        ("Floor fraction", floor::charts(view)),
        ("Excitation over inhibition", balance::charts(view)),
        ("Births and deaths at the floor", turnover::charts(view)),
    ];
    let mut body = legend(view);
    for (at, &layer) in layers.iter().enumerate() {
        let charts = columns.iter().filter_map(|(heading, charts)| {
            let chart = charts.get(at)?.as_ref()?;
            Some(format!("<div class=\"multiple\"><h4>{heading}</h4>{chart}</div>"))
        });
        body += &format!(
            "<h3>{}</h3><div class=\"multiples three\">{}</div>",
            layer_heading(view, layer),
            charts.collect::<String>()
        );
    }
    Some(Figure {
        id: "timelines",
        title: "Sparsity and balance over epochs",
        caption: format!(
            "<b>Floor fraction</b>: share of a pathway's cells that rest on the floor of the programming \
             window. {} <b>E/I</b>, by target stream (solid p, dashed n): what cells hold, levels of pp / np \
             and nn / pn, and what flows while the net is evaluated, excitatory / inhibitory bank currents; at \
             1 the two cancel. <b>Births</b> left the floor since the start, <b>deaths</b> reached it, as a share of \
             the layer's cells; a cell that came back counts in neither.",
            connection(view)
        ),
        body,
        wide: true,
    })
}

/// What connection sparsity is beside the floor fraction.
fn connection(view: &RunView<'_>) -> String {
    let Some(last) = view.last() else { return String::new() };
    if view.epochs.iter().flat_map(|record| &record.pathways).all(|one| one.zero == one.floor) {
        return "Connection sparsity, the share of cells at level 0, is the same here.".into();
    }
    let sum = |pick: fn(&crate::learn::statistics::PathwayRecord) -> u64| {
        last.pathways.iter().map(pick).sum::<u64>()
    };
    let (zero, cells) = (sum(|one| one.zero), sum(|one| one.cells));
    match quotient(zero, cells) {
        Some(_) => format!(
            "Connection sparsity, the share of cells at level 0, ends at {}.",
            percent_of(zero, cells, 1)
        ),
        None => String::new(),
    }
}

/// Pathways by colour.
fn legend(view: &RunView<'_>) -> String {
    let mut seen: Vec<&str> = Vec::new();
    let mut out = String::new();
    for one in view.last().into_iter().flat_map(|record| &record.pathways) {
        if !seen.contains(&one.pathway.as_str()) {
            seen.push(&one.pathway);
            let sign = if one.excites { "excites" } else { "inhibits" };
            let target = match one.pathway.trim_end_matches("_i") {
                "pp" | "np" => " p",
                "nn" | "pn" => " n, dashed",
                _ => "",
            };
            out += &format!("{} <span class=\"what-for\">{sign}{target}</span>", swatch(one));
        }
    }
    format!("<p class=\"legend\">{out}</p>")
}
