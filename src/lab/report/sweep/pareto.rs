//! A result against what it costs: every setting a point, and the front that none beats.

use super::paper::{COLUMN, Drawn, INK, hue, sheet, short, wide};
use super::settings::Settings;
use super::statistics::front;
use crate::lab::report::chart::Chart;
use crate::lab::report::scale::Axis;
use crate::lab::table::{Column, Unit};

/// Pale points drawn at most, and kinds of points told apart.
const POINTS_MAX: usize = 1500;
const KINDS_MAX: usize = 8;
/// A cost that spans more than this goes on a log axis.
const LOG_FROM: f64 = 20.0;

/// A setting: its cost and value, bounds of the cost, and its kind.
struct Point {
    cost: f64,
    value: f64,
    bounds: Option<[f64; 2]>,
    kind: usize,
}

/// The figure, or nothing without a cost.
pub(super) fn draw(settings: &Settings<'_>) -> Option<String> {
    let wanted = &settings.view.figures;
    let value = settings.measure(&wanted.y)?;
    let cost = settings.measure(wanted.cost.as_ref()?)?;
    let series = wanted.series.as_ref().and_then(|name| settings.axis(name));
    let series = series.filter(|axis| axis.texts.len() <= KINDS_MAX);
    let end = |name: &str| settings.view.table.column(&format!("{}_{name}", cost.column.name));
    let ends: Option<[&Column; 2]> = end("low").zip(end("high")).map(<[_; 2]>::from);
    let point = |rows: &Vec<usize>| {
        let both = |row: &&usize| {
            value.column.values.number(**row).is_some()
                && cost.column.values.number(**row).is_some()
        };
        let rows: Vec<usize> = rows.iter().filter(both).copied().collect();
        let of = |measure| settings.summary(measure, &rows);
        let mean = |column: &Column| {
            let numbers: Option<Vec<f64>> =
                rows.iter().map(|&row| column.values.number(row)).collect();
            Some(super::statistics::summary(&numbers?)?.mean)
        };
        let bounds = ends.and_then(|[low, high]| Some([mean(low)?, mean(high)?]));
        let kind = series.and_then(|axis| axis.codes[*rows.first()?]).unwrap_or(0);
        let (cost, value) = (of(cost)?, of(value)?);
        Some(Point { cost: cost.mean, value: value.mean, bounds, kind })
    };
    let mut points: Vec<Point> = settings.groups.iter().filter_map(point).collect();
    // A log axis has no place for 0, and a linear one would press the rest flat.
    let paid = || points.iter().map(|point| point.cost).filter(|&cost| cost > 0.0);
    let spread = paid().reduce(f64::max).zip(paid().reduce(f64::min));
    if spread.is_some_and(|(most, least)| most / least > LOG_FROM) {
        points.retain(|point| point.cost > 0.0);
    }
    let pairs: Vec<(f64, f64)> = points.iter().map(|point| (point.cost, point.value)).collect();
    let best = front(&pairs, value.less);
    let few = best.len() <= 24;

    let shown = points.iter().enumerate().filter(|(at, _)| few && best.contains(at));
    let bounds = shown.filter_map(|(_, point)| point.bounds).flatten();
    let costs = || pairs.iter().map(|pair| pair.0);
    let low = costs().chain(bounds.clone()).reduce(f64::min)?;
    let high = costs().chain(bounds).reduce(f64::max)?;
    let log = low > 0.0 && high / low > LOG_FROM;
    let counted = matches!(cost.column.unit, Unit::Count | Unit::Cycles);
    let x_scale = match (log, counted) {
        // powers of ten are named one by one
        (true, true) => Drawn { by: 1.0, sign: String::new() },
        (true, false) => Drawn::new(cost.column.unit, (low * high).sqrt()),
        (false, _) => Drawn::new(cost.column.unit, high),
    };
    let x_title = x_scale.title(&cost.column.label);
    let (low, high) = (low * x_scale.by, high * x_scale.by);
    let x_axis = if log {
        Axis::powers(low * 0.85, high * 1.18, &format!("{x_title}, log scale"))
    } else {
        Axis::round(
            (low - 0.04 * (high - low)).max(if low >= 0.0 { 0.0 } else { f64::MIN }),
            high + 0.04 * (high - low),
            &x_title,
        )
    };
    let y_top = pairs.iter().map(|pair| pair.1).reduce(f64::max)?;
    let y_low = pairs.iter().map(|pair| pair.1).reduce(f64::min)?;
    let y_scale = Drawn::new(value.column.unit, y_top.abs().max(y_low.abs()));
    let room = 0.05 * (y_top - y_low);
    let (mut from, mut to) = (y_low - room, y_top + room);
    if value.column.unit == Unit::Fraction {
        (from, to) = (from.max(0.0), to.min(1.0));
    }
    let y_axis =
        Axis::round(from * y_scale.by, to * y_scale.by, &y_scale.title(&value.column.label));

    let key = series.map_or(12.0, |axis| {
        let texts = axis.texts.iter().map(|text| wide(&short(text)));
        texts.fold(wide(&short(&axis.axis.label)), f64::max).max(wide("front")) + 60.0
    });
    let width = COLUMN + if series.is_some() { key - 12.0 } else { 0.0 };
    let mut chart = Chart::framed([width, 320.0], [12.0, key], x_axis, y_axis);
    let at = |point: &Point| (point.cost * x_scale.by, point.value * y_scale.by);
    let stride = points.len().div_ceil(POINTS_MAX).max(1);
    for point in points.iter().step_by(stride) {
        chart.marker(at(point), point.kind, hue(point.kind), true);
    }
    for point in best.iter().map(|&at| &points[at]).filter(|_| few) {
        if let Some([low, high]) = point.bounds {
            chart.error_x(
                point.value * y_scale.by,
                low * x_scale.by,
                high * x_scale.by,
                hue(point.kind),
            );
        }
    }
    let corners: Vec<_> = best.iter().map(|&one| at(&points[one])).collect();
    chart.steps(&corners, INK);
    for &one in &best {
        chart.marker(at(&points[one]), points[one].kind, hue(points[one].kind), false);
    }
    if let Some(series) = series {
        chart.key_title(&short(&series.axis.label));
        for (kind, text) in series.texts.iter().enumerate() {
            chart.key(kind + 1, kind, hue(kind), &short(text), false);
        }
    }
    let says = format!(
        "{} against {}: {} settings, {} of them on the Pareto front",
        value.column.label,
        cost.column.label,
        points.len(),
        best.len()
    );
    Some(sheet([width, 324.0], &says, &chart.part(0.0, 0.0)))
}
