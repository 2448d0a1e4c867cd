//! The table as the page's script reads it: JSON by column, words by number, safe inside a script element.

use std::collections::BTreeMap;

use serde_json::{Value, json};

use super::settings::{Settings, less_is_better};
use super::statistics::{SOLVED, student};
use crate::lab::table::{Column, Role, Unit, Values};

/// All that the script needs.
pub(super) fn data(settings: &Settings<'_>) -> String {
    let view = settings.view;
    let figures = &view.figures;
    let axes: Vec<Value> = settings
        .axes
        .iter()
        .map(|axis| {
            let own = axis.axis;
            json!({ "name": own.name, "label": own.label, "log": own.log, "order": own.order,
                    "drawn": axis.drawn() })
        })
        .collect();
    let columns: Vec<Value> = view.table.columns.iter().map(column).collect();
    let best = settings.measure(&figures.y).and_then(|measure| settings.best(measure));
    let all = json!({
        "name": view.name,
        "rows": view.table.len(),
        "columns": columns,
        "axes": axes,
        "figures": { "x": figures.x, "y": figures.y, "series": figures.series, "panel": figures.panel,
                     "heat": figures.heat, "cost": figures.cost },
        "best": best.and_then(|(rows, _)| rows.first().copied()),
        "student": (1..=SOLVED).map(student).collect::<Vec<_>>(),
    });
    // `<` could end or hide the script element that holds this; the line separators end lines of old scripts.
    all.to_string()
        .replace('<', "\\u003c")
        .replace('\u{2028}', "\\u2028")
        .replace('\u{2029}', "\\u2029")
}

fn column(column: &Column) -> Value {
    let unit = match column.unit {
        Unit::Plain => "plain",
        Unit::Fraction => "fraction",
        Unit::Count => "count",
        Unit::Cycles => "cycles",
        Unit::Seconds => "seconds",
        Unit::Joules => "joules",
    };
    let role = match column.role {
        Role::Axis => "axis",
        Role::Seed => "seed",
        Role::Result => "result",
        Role::Name => "name",
    };
    let mut out = json!({ "name": column.name, "label": column.label, "unit": unit, "role": role,
                          "less": less_is_better(column) });
    match &column.values {
        // A script's numbers are exact to 2^53; greater ones go as words.
        Values::Whole(values)
            if values.iter().flatten().any(|value| value.unsigned_abs() > 1 << 53) =>
        {
            let words = values.iter().map(|value| value.map(|value| value.to_string()));
            let words: Vec<_> = words.collect();
            put(&mut out, &words);
        }
        Values::Whole(values) => out["values"] = json!(values),
        // What is no number becomes null.
        Values::Real(values) => out["values"] = json!(values),
        Values::Text(values) => put(&mut out, values),
    }
    out
}

fn put(out: &mut Value, cells: &[Option<String>]) {
    let (words, codes) = coded(cells);
    out["words"] = json!(words);
    out["codes"] = json!(codes);
}

/// Distinct words in order of appearance, and the number of each cell's word; -1 for none.
fn coded(values: &[Option<String>]) -> (Vec<&str>, Vec<i64>) {
    let mut words = Vec::new();
    let mut known: BTreeMap<&str, i64> = BTreeMap::new();
    let mut codes = Vec::with_capacity(values.len());
    for value in values {
        let code = value.as_deref().map(|word| {
            *known.entry(word).or_insert_with(|| {
                words.push(word);
                words.len() as i64 - 1
            })
        });
        codes.push(code.unwrap_or(-1));
    }
    (words, codes)
}
