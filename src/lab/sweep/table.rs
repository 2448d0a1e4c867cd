//! The results of a sweep as a table.

use super::axis::Value;
use super::row::{RESULTS, ResultColumn, ResultKind, Row};
use super::{Sweep, SweepError};
use crate::lab::config::EFFECTS;
use crate::lab::report::sweep::{Figures, Refused, ShownAxis};
use crate::lab::store::index::{Store, SweepRecord};
use crate::lab::table::{Column, ColumnUnit, Role, Table, Values};

/// Names of columns that are neither axes nor results.
pub(super) const NAMES: [&str; 9] =
    ["point", "seed", "status", "hardware", "state_hash", "data_hash", "key", "run", "report"];

/// What a store knows of a sweep.
#[derive(Debug)]
pub struct Results {
    /// The sweep.
    pub sweep: Sweep,
    /// One row a point.
    pub table: Table,
    /// Axes, as a report shows them.
    pub axes: Vec<ShownAxis>,
    /// What the figures show at first.
    pub figures: Figures,
    /// Points that cannot be run.
    pub refused: Vec<Refused>,
    /// What the chips of its runs leave out.
    pub not_simulated: Vec<String>,
    /// Points whose run is finished.
    pub finished: usize,
    /// Points whose run was finished, but whose folder is gone.
    pub lost: usize,
}

/// The sweep of that name; without a name, the only one.
///
/// # Errors
/// When there is none, or several and no name.
pub fn find(store: &Store, name: Option<&str>) -> Result<SweepRecord, SweepError> {
    let mut sweeps = store.sweeps()?;
    let known = match sweeps.len() {
        0 => "no sweeps yet".to_owned(),
        _ => sweeps.iter().map(|sweep| &*sweep.name).collect::<Vec<_>>().join(", "),
    };
    let at = match name {
        Some(name) => sweeps.iter().position(|sweep| sweep.name == name),
        None => (sweeps.len() == 1).then_some(0),
    };
    let store = store.path().into();
    let missing = || match name {
        Some(name) => SweepError::NoSweep { store, name: name.into(), known },
        None => SweepError::Several { store, known },
    };
    at.map(|at| sweeps.swap_remove(at)).ok_or_else(missing)
}

/// Reads the results of a sweep.
///
/// # Errors
/// When the index refuses, or was written by another program.
pub fn results(store: &Store, record: &SweepRecord) -> Result<Results, SweepError> {
    let SweepRecord { name, text, experiment } = record;
    let sweep = Sweep::parse(&format!("{name}.toml"), text, experiment)?;
    let damaged = |what: String| {
        SweepError::key(
            &format!("{}: {what}", store.path().display()),
            "cannot be read",
            "run `dalean store index` on it",
        )
    };
    let mut values: Vec<Vec<Value>> = Vec::new();
    let mut rows: Vec<Option<Row>> = Vec::new();
    let mut points = Vec::new();
    let mut lost = Vec::new();
    for (point, row) in store.points(name)? {
        // a row whose folder is gone can be checked by nobody
        let gone = |key: &String| row.is_some() && !store.has_folder(key);
        lost.push(point.key.as_ref().is_some_and(gone));
        let row = row.filter(|_| lost.last() == Some(&false));
        let axes: Vec<Value> = serde_json::from_str(&point.axes)
            .map_err(|error| damaged(format!("point {}: {error}", point.number)))?;
        if axes.len() != sweep.axes.len() {
            return Err(damaged(format!("point {} has {} axes", point.number, axes.len())));
        }
        let row = row.map(|row| serde_json::from_str(&row)).transpose();
        rows.push(row.map_err(|error| damaged(format!("point {}: {error}", point.number)))?);
        values.push(axes);
        points.push(point);
    }
    let words = |at: usize| {
        let axes = sweep.axes.iter().zip(&values[at]);
        let words: Vec<_> = axes.map(|(axis, value)| format!("{} {value}", axis.name)).collect();
        words.join(", ")
    };
    let mut columns = vec![Column {
        name: "point".into(),
        label: "point".into(),
        unit: ColumnUnit::Plain,
        role: Role::Name,
        values: Values::Whole(points.iter().map(|point| Some(point.number.into())).collect()),
    }];
    for (at, axis) in sweep.axes.iter().enumerate() {
        columns.push(Column {
            name: axis.name.clone(),
            label: axis.label.clone(),
            unit: ColumnUnit::Plain,
            role: Role::Axis,
            values: of_values(values.iter().map(|values| &values[at])),
        });
    }
    let seeds: Vec<Option<i64>> =
        points.iter().map(|point| point.seed.map(u64::cast_signed)).collect();
    if seeds.iter().any(Option::is_some) {
        let (name, label) = ("seed".into(), "seed".into());
        let values = Values::Whole(seeds);
        columns.push(Column { name, label, unit: ColumnUnit::Plain, role: Role::Seed, values });
    }
    columns.extend(result_columns(&rows));
    let text = |name: &str, label: &str, values| {
        let (name, label, values) = (name.to_owned(), label.to_owned(), Values::Text(values));
        Column { name, label, unit: ColumnUnit::Plain, role: Role::Name, values }
    };
    let status = points.iter().zip(&rows).zip(&lost).map(|((point, row), lost)| {
        let status = match (row, &point.refused) {
            (Some(_), _) => "finished",
            (None, _) if *lost => "lost",
            (None, Some(_)) => "refused",
            (None, None) => "planned",
        };
        Some(status.to_owned())
    });
    columns.push(text("status", "status", status.collect()));
    let of = |pick: fn(&Row) -> &String| {
        rows.iter().map(|row| row.as_ref().map(|row| pick(row).clone())).collect()
    };
    columns.push(text("hardware", "chip", of(|row| &row.hardware)));
    columns.push(text("state_hash", "state hash", of(|row| &row.state_hash)));
    columns.push(text("data_hash", "data hash", of(|row| &row.data_hash)));
    columns.push(text("key", "key", points.iter().map(|point| point.key.clone()).collect()));
    let run = points.iter().zip(&rows).map(|(point, row)| {
        let key = point.key.as_ref().filter(|_| row.is_some())?;
        Some(format!("{}/report.html", Store::place(key)))
    });
    columns.push(text("run", "report", run.collect()));
    let refused = points.iter().zip(&rows).enumerate().filter(|(_, (_, row))| row.is_none());
    let refused = refused.filter_map(|(at, (point, _))| {
        let why = point.refused.clone()?;
        Some(Refused { point: point.number as usize, what: words(at), why })
    });
    let refused = refused.collect();
    let not_simulated = left_out(rows.iter().flatten());
    let axes = sweep.axes.iter().zip(&columns[1..]).map(|(axis, column)| ShownAxis {
        name: axis.name.clone(),
        label: axis.label.clone(),
        number: !column.values.is_text(),
        log: axis.log,
        order: axis.list().iter().map(|choice| choice.value.to_string()).collect(),
    });
    let axes = axes.collect();
    let table = Table { columns };
    let has = |name: &str| {
        let column = table.column(name);
        column.is_some_and(|column| {
            (0..column.values.len()).any(|at| column.values.number(at).is_some())
        })
    };
    let costs = ["joules", "cycles", "pulses_attempted"].into_iter().find(|name| has(name));
    let cost = sweep.figures.cost.clone().or_else(|| costs.map(str::to_owned));
    let figures = Figures { cost, ..sweep.figures.clone() };
    let finished = rows.iter().flatten().count();
    let lost = lost.into_iter().filter(|lost| *lost).count();
    Ok(Results { sweep, table, axes, figures, refused, not_simulated, finished, lost })
}

/// What real chips do and the runs did not, `key = text`: each effect of the program's list, and after it what models say
/// of theirs; then what only models name.
fn left_out<'a>(rows: impl Iterator<Item = &'a Row> + Clone) -> Vec<String> {
    let mut of_models: Vec<&String> = rows.clone().flat_map(|row| &row.not_simulated).collect();
    of_models.sort();
    of_models.dedup();
    let has = |key: &str| rows.clone().any(|row| row.absent.iter().any(|absent| absent == key));
    let mut all = Vec::new();
    for effect in EFFECTS.iter().filter(|effect| has(effect.key)) {
        all.push(format!("{} = {}", effect.key, effect.instead));
        let of_effect = format!("{} = ", effect.key);
        let (mine, others): (Vec<_>, Vec<_>) =
            of_models.into_iter().partition(|text| text.starts_with(&of_effect));
        all.extend(mine.into_iter().cloned());
        of_models = others;
    }
    all.extend(of_models.into_iter().cloned());
    all
}

/// Whole numbers if all are, else numbers if all are, else words.
fn of_values<'a>(values: impl Iterator<Item = &'a Value> + Clone) -> Values {
    if values.clone().all(|value| matches!(value, Value::Whole(_))) {
        let whole =
            |value: &Value| if let Value::Whole(value) = value { Some(*value) } else { None };
        Values::Whole(values.map(whole).collect())
    } else if values.clone().all(|value| value.number().is_some()) {
        Values::Real(values.map(Value::number).collect())
    } else {
        Values::Text(values.map(|value| Some(value.to_string())).collect())
    }
}

/// A column a result; those of a task that no finished run is of are left out.
fn result_columns(rows: &[Option<Row>]) -> impl Iterator<Item = Column> {
    let tasks: Vec<&str> = RESULTS
        .iter()
        .filter(|column| rows.iter().flatten().any(|row| row.results.contains_key(column.name)))
        .filter_map(|column| column.task)
        .collect();
    let shown = move |column: &&ResultColumn| {
        column.task.is_none_or(|task| tasks.is_empty() || tasks.contains(&task))
    };
    RESULTS.iter().filter(shown).map(move |column| {
        let cells =
            rows.iter().map(|row| row.as_ref().and_then(|row| row.results.get(column.name)));
        let values = if column.kind == ResultKind::Whole {
            Values::Whole(cells.map(|cell| cell.and_then(serde_json::Value::as_i64)).collect())
        } else {
            Values::Real(cells.map(|cell| cell.and_then(serde_json::Value::as_f64)).collect())
        };
        let (name, label) = (column.name.into(), column.label.into());
        Column { name, label, unit: column.unit, role: Role::Result, values }
    })
}
