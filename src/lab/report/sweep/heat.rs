//! Mean of a result over two axes, as coloured cells with their values.

use super::curves::{held_words, runs};
use super::paper::{COLUMN, marks, sheet, short};
use super::settings::{Levels, Settings, lies};
use crate::lab::report::chart::{Chart, ramp, wide};
use crate::lab::report::colour;
use crate::lab::report::number::size;
use crate::lab::report::scale::Axis;

/// Cells along an axis at most.
const CELLS_MAX: usize = 40;

/// The figure, or nothing where there are no two axes with a few values each.
pub(super) fn draw(settings: &Settings<'_>) -> Option<String> {
    let [x, y] = settings.view.figures.heat.as_ref()?;
    let (x, y) = (settings.axis(x)?, settings.axis(y)?);
    let measure = settings.measure(&settings.view.figures.y)?;
    let few = |axis: &Levels<'_>| (1..=CELLS_MAX).contains(&axis.texts.len());
    if x.axis.name == y.axis.name || !few(x) || !few(y) {
        return None;
    }
    let held = settings.held(measure, &[&x.axis.name, &y.axis.name]);
    let (across, down) = (x.texts.len(), y.texts.len());
    let mut cells: Vec<Vec<usize>> = vec![Vec::new(); across * down];
    for row in 0..settings.view.table.len() {
        if let (true, Some(i), Some(j)) = (lies(&held, row), x.codes[row], y.codes[row]) {
            cells[j * across + i].push(row);
        }
    }
    let cells: Vec<_> = cells.iter().map(|rows| settings.summary(measure, rows)).collect();
    let means: Vec<Option<f64>> = cells.iter().map(|cell| Some(cell.as_ref()?.mean)).collect();
    let low = means.iter().flatten().copied().reduce(f64::min)?;
    let high = means.iter().flatten().copied().reduce(f64::max)?;
    let part = |value: f64| if high > low { (value - low) / (high - low) } else { 0.5 };

    let width = if across > 8 { 2.0 * COLUMN } else { COLUMN };
    let names = y.texts.iter().map(|text| wide(&short(text))).fold(0.0, f64::max);
    let height = (size(down) * 30.0).clamp(90.0, 520.0) + 58.0;
    // Numbers rise; words read from the top.
    let lies = |j: usize| if y.numbers.is_some() { j } else { down - 1 - j };
    let on_axis = |levels: &Levels<'_>, from: &dyn Fn(usize) -> usize, room: f64| {
        let kept = marks(levels, room);
        let known = kept.into_iter().filter_map(|(value, text)| {
            let at = match &levels.numbers {
                Some(numbers) => numbers.iter().position(|number| *number == value)?,
                None => value as usize,
            };
            Some((size(from(at)), text))
        });
        known.collect::<Vec<_>>()
    };
    // of what rises evenly, every name has room
    const ALL: f64 = 1e9;
    let room = width - names - 130.0;
    let x_ticks = on_axis(x, &|at| at, if x.log() { ALL } else { room });
    let x_axis = Axis::cells(across, x_ticks, &x.axis.label);
    let y_axis = Axis::cells(down, on_axis(y, &lies, ALL), &y.axis.label);
    let mut chart = Chart::framed([width, height], [12.0, 96.0], x_axis, y_axis);
    let (inner, _) = chart.inside();
    let palette = colour::levels();
    let digits = digits(low.abs().max(high.abs()) * measure.by);
    for (at, mean) in means.iter().enumerate() {
        let Some(mean) = *mean else { continue };
        let [i, j] = [size(at % across), size(lies(at / across))];
        let [red, green, blue, _] = palette[usize::from(colour::byte(255.0 * part(mean)))];
        let fill = format!("rgb({red},{green},{blue})");
        chart.bar((i - 0.49, i + 0.49), (j - 0.48, j + 0.48), (&fill, 1.0), "");
        let text = format!("{:.digits$}", mean * measure.by).replace('-', "\u{2212}");
        if wide(&text) + 4.0 < inner / size(across) {
            let light = 0.3 * f64::from(red) + 0.59 * f64::from(green) + 0.11 * f64::from(blue);
            let ink = if light > 120.0 { "var(--ink)" } else { "#ffffff" };
            chart.words((i, j), ink, 13.0, &text);
        }
    }
    let (_, inside) = chart.inside();
    let pooled = held.iter().any(|(_, value)| value.is_none());
    let mut body = chart.part(0.0, 0.0);
    let tick = |(part, value): (f64, f64)| (part, format!("{:.digits$}", value * measure.by));
    let ticks = [(0.0, low), (0.5, 0.5 * (low + high)), (1.0, high)].map(tick);
    body += &ramp([width - 84.0, 12.0], [14.0, inside], &ticks, &measure.title());
    let says = format!(
        "{} by {} and {}, means of {}{}",
        measure.column.label,
        x.axis.label,
        y.axis.label,
        runs(cells.iter().flatten().map(|cell| cell.n)),
        held_words(&held, pooled)
    );
    Some(sheet([width, height + 2.0], &says, &body))
}

fn digits(greatest: f64) -> usize {
    match greatest {
        value if value >= 100.0 => 0,
        value if value >= 10.0 => 1,
        _ => 2,
    }
}
