//! Mean of a result over two axes, as coloured cells with their values.
//!
//! ```text
//! step of colour = median over cells of their 95 % interval, mean - half to mean + half
//! ```
//!
//! Cells of one colour differ by less than chance lets the mean of one cell wander. The colours stand for [`STEPS_MIN`]
//! steps at least, so that noise never reaches from one end of the map to the other. Where no cell has an interval, or the
//! interval is too small to see, colours go from least to greatest without steps.

use super::curves::{held_words, runs};
use super::paper::{COLUMN, marks, sheet, short};
use super::settings::{Levels, Settings, lies};
use super::statistics::Summary;
use crate::lab::report::chart::{Chart, ramp, wide};
use crate::lab::report::colour;
use crate::lab::report::number::size;
use crate::lab::report::scale::Axis;

/// Cells along an axis at most.
const CELLS_MAX: usize = 40;

/// Steps that the whole map of colours stands for, at least; and at most, for more are not told apart.
pub(super) const STEPS_MIN: usize = 6;
pub(super) const STEPS_MAX: usize = 24;

/// The colours of a heat map: from where to where, and in how many steps, none where they go without.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Shades {
    pub low: f64,
    pub high: f64,
    pub steps: Option<usize>,
    /// The interval that one step is.
    pub step: f64,
}

impl Shades {
    /// Of cells with these means and intervals.
    pub(super) fn of(cells: &[Summary]) -> Option<Self> {
        let means = || cells.iter().map(|cell| cell.mean);
        let (low, high) = (means().reduce(f64::min)?, means().reduce(f64::max)?);
        let mut wide: Vec<f64> = cells.iter().filter_map(|cell| Some(2.0 * cell.half?)).collect();
        wide.sort_by(f64::total_cmp);
        let step = wide.get(wide.len() / 2).copied().unwrap_or(0.0);
        let plain = Self { low, high, steps: None, step: 0.0 };
        if step <= 0.0 || (high - low) / step > size(STEPS_MAX) {
            return Some(plain);
        }
        let steps = (((high - low) / step).ceil() as usize).clamp(1, STEPS_MAX).max(STEPS_MIN);
        let (middle, reach) = (0.5 * (low + high), 0.5 * size(steps) * step);
        Some(Self { low: middle - reach, high: middle + reach, steps: Some(steps), step })
    }

    /// The place of a value in the map of colours, 0 to 1: the middle of its step.
    pub(super) fn place(&self, value: f64) -> f64 {
        if self.high <= self.low {
            return 0.5;
        }
        let part = ((value - self.low) / (self.high - self.low)).clamp(0.0, 1.0);
        match self.steps {
            None => part,
            Some(steps) => {
                let at = (part * size(steps)).floor().min(size(steps - 1));
                (at + 0.5) / size(steps)
            }
        }
    }
}

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
    let pooled = held.iter().any(|(_, value)| value.is_none());
    // settings that are pooled are no repetitions: their spread is no measure of chance
    let known: Vec<Summary> = cells
        .iter()
        .flatten()
        .map(|cell| Summary { half: cell.half.filter(|_| !pooled), ..*cell })
        .collect();
    let shades = Shades::of(&known)?;
    let (low, high) = (shades.low, shades.high);

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
        let [red, green, blue, _] = palette[usize::from(colour::byte(255.0 * shades.place(mean)))];
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
    let mut body = chart.part(0.0, 0.0);
    let tick = |(part, value): (f64, f64)| (part, format!("{:.digits$}", value * measure.by));
    let ticks = [(0.0, low), (0.5, 0.5 * (low + high)), (1.0, high)].map(tick);
    body += &ramp([width - 84.0, 12.0], [14.0, inside], &ticks, &measure.title(), shades.steps);
    let says = format!(
        "{} by {} and {}, means of {}{}{}",
        measure.column.label,
        x.axis.label,
        y.axis.label,
        runs(cells.iter().flatten().map(|cell| cell.n)),
        held_words(&held, pooled),
        if shades.steps.is_some() { "; a step of colour is the interval of a cell" } else { "" }
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

#[cfg(test)]
mod tests {
    use super::*;

    fn cell(mean: f64, half: Option<f64>) -> Summary {
        Summary { n: 3, mean, deviation: None, half, low: mean, high: mean }
    }

    #[test]
    fn noise_never_reaches_from_one_end_of_the_colours_to_the_other() {
        // all within one interval of another: one or two of six steps
        let flat = [0.960, 0.962, 0.964, 0.961].map(|mean| cell(mean, Some(0.004)));
        let shades = Shades::of(&flat).unwrap();
        assert_eq!(shades.steps, Some(STEPS_MIN));
        let places = flat.map(|one| shades.place(one.mean));
        let (low, high) = (
            places.iter().copied().fold(1.0, f64::min),
            places.iter().copied().fold(0.0, f64::max),
        );
        assert!(high - low < 0.17, "{places:?}");
        // what differs by many intervals uses them all
        let steep = [0.1, 0.5, 0.96].map(|mean| cell(mean, Some(0.02)));
        let shades = Shades::of(&steep).unwrap();
        assert!(shades.steps.is_some_and(|steps| steps > 20));
        assert!(shades.place(0.1) < 0.05 && shades.place(0.96) > 0.95);
        // a step is the interval
        let width = (shades.high - shades.low) / shades.steps.unwrap() as f64;
        assert!((width - 0.04).abs() < 1e-9, "{width}");
    }

    #[test]
    fn without_an_interval_colours_have_no_steps() {
        let shades = Shades::of(&[cell(0.1, None), cell(0.2, None)]).unwrap();
        assert_eq!((shades.steps, shades.place(0.1), shades.place(0.2)), (None, 0.0, 1.0));
        assert_eq!(Shades::of(&[cell(0.3, Some(0.0))]).unwrap().place(0.3), 0.5);
        assert_eq!(Shades::of(&[]), None);
    }
}
