//! Inputs of a policy, ranked by what the first layer of the actor has stored of them.

use super::{Figure, of_layer};
use crate::lab::report::chart::Chart;
use crate::lab::report::number::{count, percent};
use crate::lab::report::scale::Axis;
use crate::lab::report::{Heat, RunView};

/// Inputs that are drawn at most.
const SHOWN: usize = 24;

pub(super) fn draw(view: &RunView<'_>) -> Option<Figure> {
    let at = view.heats.iter().map(|heat| heat.layer).min()?;
    let first: Vec<&Heat> = view.heats.iter().filter(|heat| heat.layer == at).collect();
    let rows = first.first().map(|heat| heat.rows)?;
    let named = view.inputs;
    let of_rows: usize = named.iter().map(|input| input.rows).sum();
    if named.is_empty() || of_rows > rows {
        return None;
    }
    let of_row = |row: usize| -> u64 {
        let of_heat = |heat: &&Heat| -> u64 {
            let levels = heat.levels.get(row * heat.columns..(row + 1) * heat.columns);
            levels.into_iter().flatten().map(|&level| u64::from(level)).sum()
        };
        first.iter().map(of_heat).sum()
    };
    let mut row = 0;
    let mut ranked: Vec<(&str, u64, usize)> = Vec::new();
    for input in named {
        let sum = (row..row + input.rows).map(of_row).sum();
        ranked.push((&input.name, sum, input.rows));
        row += input.rows;
    }
    if row < rows {
        ranked.push(("constant row", (row..rows).map(of_row).sum(), rows - row));
    }
    let total: u64 = ranked.iter().map(|(_, sum, _)| sum).sum();
    ranked.sort_by_key(|&(_, sum, rows)| std::cmp::Reverse(sum / rows.max(1) as u64));
    let cut = ranked.len().saturating_sub(SHOWN);
    ranked.truncate(SHOWN);
    let mean = |sum: u64, rows: usize| sum as f64 / rows.max(1) as f64;
    let most = ranked.iter().map(|&(_, sum, rows)| mean(sum, rows)).fold(0.0, f64::max);
    let lines = ranked.len();
    let ticks = ranked.iter().rev().enumerate();
    let ticks = ticks.map(|(at, (name, ..))| (at as f64, (*name).to_owned())).collect();
    let y = Axis::cells(lines, ticks, "");
    let x = Axis::round(0.0, most, "sum of levels of a row");
    let high = 70.0 + 20.0 * lines as f64;
    let mut chart = Chart::new(760.0, high, 24.0, x, y);
    for (at, (name, sum, rows)) in ranked.iter().rev().enumerate() {
        let share = percent(*sum as f64 / (total as f64).max(1.0), 1);
        let tip = format!("{name}\n{} in {rows} rows\n{share} of all levels", count(*sum));
        let at = at as f64;
        chart.bar((0.0, mean(*sum, *rows)), (at - 0.38, at + 0.38), ("var(--a)", 0.85), &tip);
    }
    let more = if cut > 0 { format!(" {cut} more are left out.") } else { String::new() };
    let shape = view.last().and_then(|last| of_layer(last, at).next().map(|one| one.shape[1]));
    Some(Figure {
        id: "inputs",
        title: "Inputs",
        caption: format!(
            "What the {} units of the actor's first layer have stored, summed over both streams and pathways, of each row of \
             an input: synapses only take, so a row with many levels is one that much is made of.{more}",
            shape.unwrap_or(0)
        ),
        body: chart.finish("Inputs of the policy, ranked by the levels of their rows"),
        wide: true,
    })
}
