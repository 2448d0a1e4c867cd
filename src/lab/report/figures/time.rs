//! Where the cycles go: phases, stages of training, parts of layers.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use super::Figure;
use crate::chip::ledger::{During, Part};
use crate::lab::price::{prefixed, stages};
use crate::lab::report::RunView;
use crate::lab::report::number::{count, escape, float, percent_of, place, quotient, share, short};
use crate::lab::store::ledger::{CyclesRecord, LayerCycles};

/// The phase that is taken apart.
const TRAINING: &str = "training";

pub(super) fn draw(view: &RunView<'_>) -> Option<Figure> {
    let (ledger, cost) = (view.ledger?, view.cost?);
    let (phases, elapsed, seconds) = (ledger.cycles.as_ref()?, ledger.elapsed()?, cost.seconds?);
    if elapsed == 0 {
        return None;
    }
    let time = |cycles: u64| prefixed(seconds * float(cycles) / float(elapsed), "s");
    let mut by_phase: Vec<(&String, &CyclesRecord)> =
        phases.iter().filter(|(_, cycles)| cycles.elapsed > 0).collect();
    by_phase.sort_by_key(|(_, cycles)| std::cmp::Reverse(cycles.elapsed));
    let rows: String = by_phase
        .iter()
        .map(|(name, cycles)| row(&escape(name), cycles.elapsed, elapsed, &time, ""))
        .collect();
    let phases_table = table("Phase", "of the run", "", &rows);
    let (mut busy, mut below) = (String::new(), String::new());
    let mut each = String::new();
    if let Some(training) = phases.get(TRAINING).filter(|training| training.elapsed > 0) {
        let rows: String = stages(training)
            .into_iter()
            .map(|stage| {
                let critical = stage.critical.map_or_else(String::new, |(layer, part, used)| {
                    let share = percent_of(used.min(stage.cycles), stage.cycles, 0);
                    format!("{} of layer {layer}, {share}", part.name())
                });
                row(stage.stage.name(), stage.cycles, training.elapsed, &time, &critical)
            })
            .collect();
        let names = During::ALL.map(|during| during.name());
        busy = matrix("A layer is busy with", training, &names, &|layer| &layer.busy);
        below = table("Stage of training", "of training", "most at work, of the stage", &rows);
        let names = Part::ALL.map(|part| part.name());
        below += &matrix("Parts of a layer at work", training, &names, &|layer| &layer.used);
        if let Some(updates) = view.last().map(|last| last.updates).filter(|&updates| updates > 0) {
            let cycles = training.elapsed / updates;
            each = format!(
                " One update takes {} cycles, {}, on average.",
                count(cycles),
                time(cycles)
            );
        }
    }
    Some(Figure {
        id: "time",
        title: "Time on the chip",
        caption: format!(
            "The run took <b>{}</b>, {} cycles, the final test aside.{each} Stages follow one another and add up. Layers \
             work side by side: a layer is busy from the acceptance of a command until it is done, a part is at work for a \
             share of the time that passes (its utilisation).",
            prefixed(seconds, "s"),
            short(elapsed)
        ),
        body: format!(
            "<div class=\"halves\"><div>{phases_table}</div><div>{busy}</div></div>{below}"
        ),
        wide: true,
    })
}

fn table(what: &str, whole: &str, more: &str, rows: &str) -> String {
    let more =
        if more.is_empty() { String::new() } else { format!("<th scope=\"col\">{more}</th>") };
    format!(
        "<div class=\"scroll\"><table class=\"meters\"><thead><tr><th scope=\"col\">{what}</th>\
         <th scope=\"col\" colspan=\"2\">{whole}</th><th scope=\"col\">cycles</th><th scope=\"col\">time</th>{more}</tr>\
         </thead><tbody>{rows}</tbody></table></div>"
    )
}

fn row(name: &str, part: u64, whole: u64, time: &dyn Fn(u64) -> String, more: &str) -> String {
    let fraction = quotient(part, whole).unwrap_or(0.0);
    let more = if more.is_empty() { String::new() } else { format!("<td>{more}</td>") };
    format!(
        "<tr><th scope=\"row\">{name}</th><td class=\"meter\"><i style=\"width:{}%\"></i></td><td>{}</td><td>{}</td>\
         <td>{}</td>{more}</tr>",
        place(100.0 * fraction),
        share(fraction),
        short(part),
        time(part)
    )
}

/// Layers down, shares of the time of training; columns in which nothing happened are left out.
fn matrix(
    heading: &str,
    training: &CyclesRecord,
    names: &[&str],
    of: &dyn Fn(&LayerCycles) -> &BTreeMap<String, u64>,
) -> String {
    let of = |layer: &LayerCycles, name: &str| of(layer).get(name).copied().unwrap_or(0);
    let names: Vec<&str> = names
        .iter()
        .copied()
        .filter(|name| training.layers.iter().any(|layer| of(layer, name) > 0))
        .collect();
    if names.is_empty() {
        return String::new();
    }
    let heads =
        names.iter().map(|name| format!("<th scope=\"col\">{}</th>", name.replace('_', " ")));
    let mut rows = String::new();
    for (at, layer) in training.layers.iter().enumerate() {
        let _ = write!(rows, "<tr><th scope=\"row\">layer {at}</th>");
        for name in &names {
            let part = quotient(of(layer, name), training.elapsed).unwrap_or(0.0);
            let text = if part > 0.0 { share(part) } else { "–".into() };
            let _ = write!(
                rows,
                "<td class=\"shade\" style=\"--share:{}%\">{text}</td>",
                place(60.0 * part.min(1.0))
            );
        }
        rows += "</tr>";
    }
    format!(
        "<h4>{heading}, of the time of training</h4><div class=\"scroll\"><table class=\"matrix\"><thead><tr><th></th>{}</tr></thead>\
         <tbody>{rows}</tbody></table></div>",
        heads.collect::<String>()
    )
}
