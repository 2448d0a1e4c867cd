//! What the page's script reads: JSON by column, words by number, safe inside a script element. With everything that
//! takes a computation: order and ranges of values, means and intervals of settings, fronts, scales and their marks.

use std::collections::BTreeMap;

use serde_json::{Map, Value, json};

use super::measure::Measure;
use super::paper::short;
use super::settings::{Levels, Settings, front_of};
use super::statistics::Summary;
use super::{heat, importance, learning, meaning};
use crate::lab::report::colour;
use crate::lab::table::{Column, ColumnUnit, Role, Values};

/// Values of an axis that are marked one by one.
const MARKS_MAX: usize = 12;

/// All that the script needs.
pub(super) fn data(settings: &Settings<'_>) -> String {
    let view = settings.view;
    let figures = &view.figures;
    let best = settings.measure(&figures.y).and_then(|measure| settings.best(measure));
    let best = best.and_then(|(rows, _)| settings.groups.iter().position(|group| group == rows));
    let mut setting = vec![0; view.table.len()];
    for (at, rows) in settings.groups.iter().enumerate() {
        rows.iter().for_each(|&row| setting[row] = at);
    }
    let all = json!({
        "name": view.name,
        "setting": setting,
        "columns": view.table.columns.iter().map(|one| column(settings, one)).collect::<Vec<_>>(),
        "axes": settings.axes.iter().map(|one| axis(settings, one)).collect::<Vec<_>>(),
        "fronts": fronts(settings),
        "figures": { "x": figures.x, "y": figures.y, "series": figures.series, "panel": figures.panel,
                     "heat": figures.heat, "cost": figures.cost },
        "best": best,
        "importance": important(settings),
        "learning": learning::data(settings),
        "shades": [heat::STEPS_MIN, heat::STEPS_MAX],
        "hues": colour::HUES.map(|hue| hue.trim_start_matches("var(--").trim_end_matches(')')),
        "ramp": colour::ramp(),
    });
    // `<` could end or hide the script element that holds this; the line separators end lines of old scripts.
    all.to_string()
        .replace('<', "\\u003c")
        .replace('\u{2028}', "\\u2028")
        .replace('\u{2029}', "\\u2029")
}

/// An axis: its values or ranges of them, and by setting which one it has, -1 for none.
fn axis(settings: &Settings<'_>, levels: &Levels<'_>) -> Value {
    let (own, binned) = (levels.axis, levels.binned());
    let (ranges, places) = if binned { levels.ranges() } else { Default::default() };
    let code = |rows: &Vec<usize>| {
        let code = levels.codes[*rows.first()?]?;
        Some(if binned { places[code] } else { code })
    };
    let codes = settings.groups.iter().map(|rows| code(rows).map_or(-1, |code| code as i64));
    let [texts, ticks]: [Vec<String>; 2] = if binned {
        let all = ranges.iter().map(|[from, to]| (format!("{from} – {to}"), from.clone()));
        <[_; 2]>::from(all.unzip())
    } else {
        [levels.texts.clone(), levels.texts.iter().map(|text| short(text)).collect()]
    };
    json!({ "name": own.name, "label": own.label, "log": levels.log(), "numeric": levels.numbers.is_some(),
            "binned": binned, "texts": texts, "ticks": ticks, "numbers": levels.numbers.as_ref().filter(|_| !binned),
            "codes": codes.collect::<Vec<_>>() })
}

/// By result, what explains its variance.
fn important(settings: &Settings<'_>) -> Value {
    let of = |measure: Measure<'_>| {
        let found = importance::importance(settings, measure)?;
        let part = |part: &importance::Part| json!({"name": part.name, "share": brief(part.share), "chance": part.chance.and_then(brief)});
        let parts: Vec<_> = found.parts.iter().map(part).collect();
        let all = json!({"parts": parts, "runs": found.runs, "balanced": found.balanced});
        Some((measure.column.name.clone(), all))
    };
    Value::Object(settings.measures().into_iter().filter_map(of).collect())
}

/// For each cost and each result the settings that no other beats.
fn fronts(settings: &Settings<'_>) -> Value {
    let measures = settings.measures();
    let all: Vec<_> = measures.iter().map(|&one| (one, settings.means(one))).collect();
    let name = |one: &Measure<'_>| one.column.name.clone();
    let of_cost = |(cost, costs): &(Measure<'_>, Vec<Option<f64>>)| {
        let others = all.iter().filter(|(value, _)| name(value) != name(cost));
        let front = |(value, values): &(Measure<'_>, Vec<Option<f64>>)| {
            (name(value), json!(front_of((*cost, costs), (*value, values))))
        };
        (name(cost), Value::Object(others.map(front).collect()))
    };
    Value::Object(all.iter().map(of_cost).collect())
}

fn column(settings: &Settings<'_>, column: &Column) -> Value {
    let unit = match column.unit {
        ColumnUnit::Plain => "plain",
        ColumnUnit::Fraction => "fraction",
        ColumnUnit::Count => "count",
        ColumnUnit::Cycles => "cycles",
        ColumnUnit::Seconds => "seconds",
        ColumnUnit::Joules => "joules",
        ColumnUnit::SquareMillimetres => "mm2",
    };
    let role = match column.role {
        Role::Axis => "axis",
        Role::Seed => "seed",
        Role::Result => "result",
        Role::Name => "name",
    };
    let named = json!({ "name": column.name, "label": column.label, "unit": unit, "role": role,
                        "meaning": meaning(column) });
    let Value::Object(mut out) = named else { unreachable!("braces make an object") };
    match &column.values {
        // A script's numbers are exact to 2^53; greater ones go as words.
        Values::Whole(values)
            if values.iter().flatten().any(|value| value.unsigned_abs() > 1 << 53) =>
        {
            let words = values.iter().map(|value| value.map(|value| value.to_string()));
            words_of(&mut out, &words.collect::<Vec<_>>());
        }
        Values::Whole(values) => numbers_of(&mut out, settings, column, json!(values)),
        // What is no number becomes null.
        Values::Real(values) => numbers_of(&mut out, settings, column, json!(values)),
        Values::Text(values) => words_of(&mut out, values),
    }
    Value::Object(out)
}

fn numbers_of(out: &mut Map<String, Value>, settings: &Settings<'_>, column: &Column, all: Value) {
    let mut put = |key: &str, value: Value| out.insert(key.into(), value);
    put("values", all);
    let Some(measure) = Measure::new(column) else { return };
    let axis = settings.axis(&column.name);
    let log = axis.map_or(measure.log, Levels::log);
    let few = axis.filter(|axis| axis.texts.len() <= MARKS_MAX);
    let own = few.and_then(|axis| Some((axis.numbers.as_ref()?, &axis.texts)));
    let marks = match own {
        Some((numbers, texts)) => numbers.iter().copied().zip(texts.iter().cloned()).collect(),
        None => measure.marks(log),
    };
    put("less", json!(measure.less));
    put("by", json!(measure.by));
    put("sign", json!(measure.sign()));
    put("title", json!(measure.title()));
    put("log", json!(log));
    put("ends", json!(measure.ends));
    put("marks", json!(marks));
    // Of one run each, the cells say it.
    if column.role == Role::Result && settings.groups.len() < settings.view.table.len() {
        let all = settings.groups.iter().map(|rows| settings.summary(measure, rows));
        let all: Vec<Option<Summary>> = all.collect();
        put("n", json!(all.iter().map(|one| one.map_or(0, |one| one.n)).collect::<Vec<_>>()));
        let brief = |pick: fn(Summary) -> Option<f64>| {
            json!(all.iter().map(|one| brief(pick((*one)?)?)).collect::<Vec<_>>())
        };
        put("mean", brief(|one| Some(one.mean)));
        put("half", brief(|one| one.half));
    }
}

/// Ten digits: more than anyone sees.
fn brief(number: f64) -> Option<f64> {
    format!("{number:.9e}").parse().ok()
}

/// Distinct words in order of appearance, and the number of each cell's word; -1 for none.
fn words_of(out: &mut Map<String, Value>, cells: &[Option<String>]) {
    let mut words: Vec<&str> = Vec::new();
    let mut known: BTreeMap<&str, i64> = BTreeMap::new();
    let mut codes = Vec::with_capacity(cells.len());
    for word in cells.iter().map(Option::as_deref) {
        codes.push(word.map_or(-1, |word| {
            *known.entry(word).or_insert_with(|| {
                words.push(word);
                words.len() as i64 - 1
            })
        }));
    }
    out.insert("words".into(), json!(words));
    out.insert("codes".into(), json!(codes));
}
