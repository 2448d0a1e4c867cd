//! Series: lines with dots, labels at their ends, and bands the pointer reads values from.

use std::fmt::Write as _;

use super::{Chart, POINTS_MAX, track};
use crate::lab::report::number::{escape, place, size};

/// Bands kept for the pointer.
const BANDS_MAX: usize = 120;
/// Lines with no more points than this show them as dots.
const DOTS_MAX: usize = 24;

/// One line, or one single mark.
#[derive(Debug, Clone)]
pub(in crate::lab::report) struct Series {
    pub name: String,
    pub colour: &'static str,
    /// Number of its dashes; 0 is solid.
    dash: usize,
    /// Drawn as a diamond, not as a line.
    mark: bool,
    /// Epoch and value, in order.
    pub points: Vec<(f64, f64)>,
}

impl Series {
    /// A plain line.
    pub(in crate::lab::report) fn new(
        name: &str,
        colour: &'static str,
        points: Vec<(f64, f64)>,
    ) -> Self {
        Self { name: name.into(), colour, dash: 0, mark: false, points }
    }

    /// The same, dashed or not.
    pub(in crate::lab::report) fn dashed(self, dashed: bool) -> Self {
        Self { dash: usize::from(dashed), ..self }
    }

    /// The same with the dashes of that number; 0 is solid.
    pub(in crate::lab::report) fn numbered(self, number: usize) -> Self {
        Self { dash: number, ..self }
    }

    /// The same as a single mark.
    pub(in crate::lab::report) fn marked(self) -> Self {
        Self { mark: true, ..self }
    }
}

/// A text in its colour, beside a place of the vertical axis.
struct End<'a> {
    y: f64,
    text: String,
    colour: &'a str,
}

impl Chart {
    /// Draws every series with its dots, the labels at the ends and the bands for the pointer.
    pub(in crate::lab::report) fn series(&mut self, all: &[Series], show: impl Fn(f64) -> String) {
        for one in all.iter().filter(|one| !one.mark) {
            self.line(&one.points, one.colour, "line", one.dash);
        }
        for one in all.iter().filter(|one| one.mark || one.points.len() <= DOTS_MAX) {
            let (shape, radius, class) = if one.mark { (2, 5.4, "mark") } else { (0, 2.6, "dot") };
            for &at in &one.points {
                self.marker(at, shape, radius, one.colour, class);
            }
        }
        let end = |one: &Series| {
            let &(_, value) = one.points.last()?;
            let text = format!("{} {}", one.name, show(value));
            Some(End { y: self.y(value), text, colour: one.colour })
        };
        let ends = all.iter().filter_map(end).collect();
        self.ends(ends);
        self.bands(all, show);
    }

    /// Labels right of the plot, in the colour of text, each beside a value; and a name over them.
    pub(in crate::lab::report) fn beside(
        &mut self,
        name: &str,
        labels: impl Iterator<Item = (f64, String)>,
    ) {
        self.text("note", self.width - self.right + 9.0, self.top - 8.0, name);
        let end = |(value, text)| End { y: self.y(value), text, colour: "var(--ink)" };
        let ends = labels.map(end).collect();
        self.ends(ends);
    }

    /// Labels right of the plot, pushed apart until none overlaps.
    fn ends(&mut self, mut ends: Vec<End<'_>>) {
        const GAP: f64 = 15.0;
        ends.sort_by(|a, b| a.y.total_cmp(&b.y));
        for i in 1..ends.len() {
            ends[i].y = ends[i].y.max(ends[i - 1].y + GAP);
        }
        let mut room = self.base() + 6.0;
        for end in ends.iter_mut().rev() {
            end.y = end.y.min(room);
            room = end.y - GAP;
        }
        let x = place(self.width - self.right + 9.0);
        for End { y, text, colour } in ends {
            let (y, text) = (place(y + 4.0), escape(&text));
            let _ = write!(
                self.body,
                "<text class=\"name\" style=\"fill:{colour}\" x=\"{x}\" y=\"{y}\">{text}</text>"
            );
        }
    }

    fn bands(&mut self, all: &[Series], show: impl Fn(f64) -> String) {
        let mut epochs: Vec<f64> = all.iter().flat_map(|one| &one.points).map(|p| p.0).collect();
        epochs.sort_by(f64::total_cmp);
        epochs.dedup();
        let stride = epochs.len().div_ceil(BANDS_MAX).max(1);
        let unit = self.unit;
        let bands = epochs.into_iter().step_by(stride).map(|epoch| {
            let values = all.iter().filter_map(|one| {
                let at = one.points.iter().find(|point| point.0 == epoch)?;
                Some(format!("\n{} {}", one.name, show(at.1)))
            });
            (epoch, format!("{unit} {epoch:.0}{}", values.collect::<String>()))
        });
        let bands: Vec<_> = bands.collect();
        self.tips(&bands);
    }
}

/// A line without axes, for tables.
pub(in crate::lab::report) fn spark(values: &[f64], colour: &str) -> String {
    const WIDTH: f64 = 110.0;
    const HEIGHT: f64 = 24.0;
    let high = values.iter().copied().fold(0.0, f64::max);
    let last = size(values.len().saturating_sub(1)).max(1.0);
    let stride = values.len().div_ceil(POINTS_MAX / 2).max(1);
    let at = |(i, value): (usize, &f64)| {
        let part = if high > 0.0 { value / high } else { 0.0 };
        (2.0 + size(i) / last * (WIDTH - 4.0), HEIGHT - 3.0 - part * (HEIGHT - 6.0))
    };
    let d = track(values.iter().enumerate().step_by(stride).map(at));
    format!(
        "<svg class=\"spark\" viewBox=\"0 0 {WIDTH} {HEIGHT}\" width=\"{WIDTH}\" height=\"{HEIGHT}\" \
         aria-hidden=\"true\"><path class=\"line\" style=\"stroke:{colour}\" d=\"{d}\"/></svg>"
    )
}
