//! A result against what it costs: every setting a point, and the front that none beats.

use super::measure::Measure;
use super::paper::{COLUMN, sheet, short};
use super::settings::{Settings, front_of};
use crate::lab::report::chart::{Chart, wide};
use crate::lab::report::colour::hue;
use crate::lab::report::scale::Axis;
use crate::lab::table::ColumnUnit;

/// Pale points drawn at most, and kinds of points told apart.
const POINTS_MAX: usize = 1500;
const KINDS_MAX: usize = 8;

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
    let means = |measure: Measure<'_>| settings.means(measure);
    let end = |name: &str| settings.measure(&format!("{}_{name}", cost.column.name)).map(means);
    let (costs, values, ends) = (means(cost), means(value), [end("low"), end("high")]);
    let best = front_of((cost, &costs), (value, &values));
    let point = |at: usize| {
        let [low, high] = ends.each_ref().map(|end| end.as_ref().and_then(|end| end[at]));
        let kind = series.and_then(|axis| axis.codes[*settings.groups[at].first()?]).unwrap_or(0);
        let bounds = low.zip(high).map(<[_; 2]>::from);
        Some(Point { cost: costs[at]?, value: values[at]?, bounds, kind })
    };
    let points: Vec<Point> = (0..settings.groups.len()).filter_map(point).collect();
    let points: Vec<Point> =
        points.into_iter().filter(|point| point.cost > 0.0 || !cost.log).collect();
    let best: Vec<Point> = best.into_iter().filter_map(point).collect();
    let few = best.len() <= 24;

    let bounds = best.iter().filter(|_| few).filter_map(|point| point.bounds).flatten();
    let reach = points.iter().map(|point| point.cost).chain(bounds);
    let reach = reach.filter(|&cost_of| cost_of > 0.0 || !cost.log);
    let (low, high) = (reach.clone().reduce(f64::min)?, reach.reduce(f64::max)?);
    let (low, high) = (low * cost.by, high * cost.by);
    let x_axis = if cost.log {
        Axis::powers(low * 0.85, high * 1.18, &format!("{}, log scale", cost.title()))
    } else {
        let room = 0.04 * (high - low);
        let from = if low >= 0.0 { (low - room).max(0.0) } else { low - room };
        Axis::round(from, high + room, &cost.title())
    };
    let drawn = || points.iter().map(|point| point.value);
    let (y_low, y_top) = (drawn().reduce(f64::min)?, drawn().reduce(f64::max)?);
    let room = 0.05 * (y_top - y_low);
    let (mut from, mut to) = (y_low - room, y_top + room);
    if value.column.unit == ColumnUnit::Fraction {
        (from, to) = (from.max(0.0), to.min(1.0));
    }
    let y_axis = Axis::round(from * value.by, to * value.by, &value.title());

    let key = series.map_or(12.0, |axis| {
        let texts = axis.texts.iter().map(|text| wide(&short(text)));
        texts.fold(wide(&short(&axis.axis.label)), f64::max).max(wide("front")) + 60.0
    });
    let width = COLUMN + if series.is_some() { key - 12.0 } else { 0.0 };
    let mut chart = Chart::framed([width, 320.0], [12.0, key], x_axis, y_axis);
    let at = |point: &Point| (point.cost * cost.by, point.value * value.by);
    let stride = points.len().div_ceil(POINTS_MAX).max(1);
    for point in points.iter().step_by(stride) {
        chart.marker(at(point), point.kind, 2.8, hue(point.kind), "pale");
    }
    for point in best.iter().filter(|_| few) {
        if let Some(bounds) = point.bounds {
            let [from, to] = bounds.map(|end| (end * cost.by, point.value * value.by));
            chart.whisker(from, to, hue(point.kind));
        }
    }
    chart.steps(&best.iter().map(at).collect::<Vec<_>>(), "var(--ink)");
    for point in &best {
        chart.marker(at(point), point.kind, 3.6, hue(point.kind), "mark");
    }
    if let Some(series) = series {
        let entries = series.texts.iter().enumerate();
        let entries = entries.map(|(kind, text)| (kind, hue(kind), short(text)));
        chart.key(&short(&series.axis.label), entries, false);
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
