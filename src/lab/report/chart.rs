//! Line charts as inline SVG: axes, lines, bars, labels at the line ends, and bands the pointer reads values from.
//! Colours and type come from the page's style sheet.

mod margin;

use std::fmt::Write as _;

mod marks;

use super::number::{escape, place};
use super::scale::Axis;

/// Points kept of one line; more would not be seen.
const POINTS_MAX: usize = 400;
/// Bands kept for the pointer.
const BANDS_MAX: usize = 120;
/// Lines with no more points than this show them as dots.
const DOTS_MAX: usize = 24;

/// One line, or one single mark.
#[derive(Debug, Clone)]
pub(super) struct Series {
    pub name: String,
    pub colour: &'static str,
    pub dashed: bool,
    /// Drawn as a diamond, not as a line.
    pub mark: bool,
    /// Epoch and value, in order.
    pub points: Vec<(f64, f64)>,
}

impl Series {
    /// A plain line.
    pub(super) fn new(name: &str, colour: &'static str, points: Vec<(f64, f64)>) -> Self {
        Self { name: name.into(), colour, dashed: false, mark: false, points }
    }

    /// The same, dashed or not.
    pub(super) fn dashed(mut self, dashed: bool) -> Self {
        self.dashed = dashed;
        self
    }

    /// The same as a single mark.
    pub(super) fn marked(mut self) -> Self {
        self.mark = true;
        self
    }
}

/// A chart being drawn.
#[derive(Debug)]
pub(super) struct Chart {
    width: f64,
    height: f64,
    left: f64,
    right: f64,
    top: f64,
    bottom: f64,
    x: Axis,
    y: Axis,
    body: String,
}

impl Chart {
    /// Axes and grid; `right` units are left free for labels at the line ends.
    pub(super) fn new(width: f64, height: f64, right: f64, x: Axis, y: Axis) -> Self {
        Self::framed([width, height], [12.0, right], x, y)
    }

    /// The same with `[top, right]` units left free.
    pub(super) fn framed(
        [width, height]: [f64; 2],
        [top, right]: [f64; 2],
        x: Axis,
        y: Axis,
    ) -> Self {
        let digits = y.ticks.iter().map(|(_, text)| text.chars().count()).max().unwrap_or(1);
        let left = 30.0 + 6.9 * super::number::size(digits);
        let body = String::new();
        let mut chart = Self { width, height, left, right, top, bottom: 42.0, x, y, body };
        chart.axes();
        chart
    }

    fn x(&self, value: f64) -> f64 {
        self.left + self.x.scale.fraction(value) * (self.width - self.left - self.right)
    }

    fn y(&self, value: f64) -> f64 {
        let high = self.height - self.top - self.bottom;
        self.top + (1.0 - self.y.scale.fraction(value)) * high
    }

    fn base(&self) -> f64 {
        self.height - self.bottom
    }

    fn axes(&mut self) {
        let (left, right, base) = (self.left, self.width - self.right, self.base());
        for (tick, text) in self.y.ticks.clone() {
            let y = self.y(tick);
            self.segment("grid", left, y, right, y);
            self.text("tick end", left - 7.0, y + 4.0, &text);
        }
        for (tick, text) in self.x.ticks.clone() {
            let x = self.x(tick);
            self.segment("axis", x, base, x, base + 4.0);
            self.text("tick middle", x, base + 17.0, &text);
        }
        self.segment("axis", left, base, right, base);
        let (x_label, y_label) = (self.x.label.clone(), self.y.label.clone());
        self.text("label middle", (left + right) / 2.0, self.height - 6.0, &x_label);
        let middle = place((self.top + base) / 2.0);
        let _ = write!(
            self.body,
            "<text class=\"label middle\" transform=\"translate(12 {middle}) rotate(-90)\">{}</text>",
            escape(&y_label)
        );
    }

    fn segment(&mut self, class: &str, x0: f64, y0: f64, x1: f64, y1: f64) {
        let [x0, y0, x1, y1] = [x0, y0, x1, y1].map(place);
        let _ = write!(self.body, "<path class=\"{class}\" d=\"M{x0} {y0}L{x1} {y1}\"/>");
    }

    fn text(&mut self, class: &str, x: f64, y: f64, text: &str) {
        let (x, y) = (place(x), place(y));
        let text = escape(text);
        let _ = write!(self.body, "<text class=\"{class}\" x=\"{x}\" y=\"{y}\">{text}</text>");
    }

    /// A named horizontal line.
    pub(super) fn rule(&mut self, value: f64, name: &str) {
        let y = self.y(value);
        self.segment("rule", self.left, y, self.width - self.right, y);
        self.text("note", self.left + 5.0, y - 5.0, name);
    }

    /// A filled rectangle between two values of each axis.
    pub(super) fn bar(&mut self, x: (f64, f64), y: (f64, f64), colour: &str, opacity: f64) {
        let (x0, x1) = (self.x(x.0), self.x(x.1));
        let (y0, y1) = (self.y(y.0), self.y(y.1));
        let [left, top] = [x0.min(x1), y0.min(y1)].map(place);
        let [wide, high] = [(x1 - x0).abs(), (y1 - y0).abs()].map(place);
        let _ = write!(
            self.body,
            "<rect x=\"{left}\" y=\"{top}\" width=\"{wide}\" height=\"{high}\" fill=\"{colour}\" \
             fill-opacity=\"{opacity:.2}\"/>"
        );
    }

    /// A line through points, thinned where there are too many to see.
    pub(super) fn line(&mut self, points: &[(f64, f64)], colour: &str, class: &str) {
        let stride = points.len().div_ceil(POINTS_MAX).max(1);
        let last = points.len().saturating_sub(1);
        let mut path = String::new();
        for (i, &(x, y)) in points.iter().enumerate() {
            if i % stride == 0 || i == last {
                let pen = if path.is_empty() { 'M' } else { 'L' };
                let _ = write!(path, "{pen}{} {}", place(self.x(x)), place(self.y(y)));
            }
        }
        if points.len() > 1 {
            let _ = write!(
                self.body,
                "<path class=\"{class}\" style=\"stroke:{colour}\" d=\"{path}\"/>"
            );
        }
    }

    /// Draws every series with its dots, the labels at the ends and the bands for the pointer.
    pub(super) fn series(&mut self, all: &[Series], show: impl Fn(f64) -> String) {
        for one in all {
            if !one.mark {
                self.line(&one.points, one.colour, if one.dashed { "line dashed" } else { "line" });
            }
        }
        for one in all {
            if !one.mark && one.points.len() <= DOTS_MAX {
                for &(x, y) in &one.points {
                    self.dot(x, y, one.colour);
                }
            }
        }
        for one in all.iter().filter(|one| one.mark) {
            for &(x, y) in &one.points {
                let (x, y) = (self.x(x), self.y(y));
                let _ = write!(
                    self.body,
                    "<path class=\"mark\" style=\"fill:{}\" d=\"M{} {}l7 7l-7 7l-7 -7z\"/>",
                    one.colour,
                    place(x),
                    place(y - 7.0)
                );
            }
        }
        let ends: Vec<End> = all
            .iter()
            .filter_map(|one| {
                let &(_, value) = one.points.last()?;
                let text = format!("{} {}", one.name, show(value));
                Some(End { y: self.y(value), text, colour: one.colour })
            })
            .collect();
        self.ends(ends);
        self.bands(all, show);
    }

    fn dot(&mut self, x: f64, y: f64, colour: &str) {
        let (x, y) = (place(self.x(x)), place(self.y(y)));
        let _ = write!(
            self.body,
            "<circle class=\"dot\" style=\"fill:{colour}\" cx=\"{x}\" cy=\"{y}\" r=\"2.6\"/>"
        );
    }

    /// Labels right of the plot, in the colour of text, each beside a value.
    pub(super) fn beside(&mut self, labels: impl Iterator<Item = (f64, String)>) {
        let end = |(value, text)| End { y: self.y(value), text, colour: "var(--ink)" };
        let ends = labels.map(end).collect();
        self.ends(ends);
    }

    /// Labels right of the plot, pushed apart until none overlaps.
    fn ends(&mut self, mut ends: Vec<End>) {
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
        for end in ends {
            let (y, text) = (place(end.y + 4.0), escape(&end.text));
            let _ = write!(
                self.body,
                "<text class=\"name\" style=\"fill:{}\" x=\"{x}\" y=\"{y}\">{text}</text>",
                end.colour
            );
        }
    }

    fn bands(&mut self, all: &[Series], show: impl Fn(f64) -> String) {
        let mut epochs: Vec<f64> = all.iter().flat_map(|one| &one.points).map(|p| p.0).collect();
        epochs.sort_by(f64::total_cmp);
        epochs.dedup();
        let stride = epochs.len().div_ceil(BANDS_MAX).max(1);
        let bands = epochs.into_iter().step_by(stride).map(|epoch| {
            let values = all.iter().filter_map(|one| {
                let at = one.points.iter().find(|point| point.0 == epoch)?;
                Some(format!("\n{} {}", one.name, show(at.1)))
            });
            (epoch, format!("epoch {epoch:.0}{}", values.collect::<String>()))
        });
        let bands: Vec<_> = bands.collect();
        self.tips(&bands);
    }

    /// Invisible bands that tell their text to the pointer.
    pub(super) fn tips(&mut self, tips: &[(f64, String)]) {
        let wide = (self.width - self.left - self.right) / super::number::size(tips.len().max(1));
        let high = place(self.base() - self.top);
        for (at, text) in tips {
            let x = place(self.x(*at) - wide / 2.0);
            let _ = write!(
                self.body,
                "<rect class=\"tip\" x=\"{x}\" y=\"{}\" width=\"{}\" height=\"{high}\" data-tip=\"{}\"/>",
                place(self.top),
                place(wide),
                escape(text).replace('\n', "&#10;")
            );
        }
    }

    /// The picture. `alt` says in words what it shows.
    pub(super) fn finish(self, alt: &str) -> String {
        let (wide, high) = (place(self.width), place(self.height));
        format!(
            "<svg class=\"chart\" viewBox=\"0 0 {wide} {high}\" style=\"max-width:{}px\" role=\"img\" \
             aria-label=\"{}\">{}</svg>",
            place(self.width * 1.3),
            escape(alt),
            self.body
        )
    }
}

struct End {
    y: f64,
    text: String,
    colour: &'static str,
}

/// A line without axes, for tables.
pub(super) fn spark(values: &[f64], colour: &str) -> String {
    const WIDTH: f64 = 110.0;
    const HEIGHT: f64 = 24.0;
    let high = values.iter().copied().fold(0.0, f64::max);
    let last = super::number::size(values.len().saturating_sub(1)).max(1.0);
    let stride = values.len().div_ceil(POINTS_MAX / 2).max(1);
    let mut path = String::new();
    for (i, value) in values.iter().enumerate().step_by(stride) {
        let x = 2.0 + super::number::size(i) / last * (WIDTH - 4.0);
        let y = HEIGHT - 3.0 - if high > 0.0 { value / high } else { 0.0 } * (HEIGHT - 6.0);
        let pen = if path.is_empty() { 'M' } else { 'L' };
        let _ = write!(path, "{pen}{} {}", place(x), place(y));
    }
    if path.is_empty() {
        path.push_str("M0 0");
    }
    format!(
        "<svg class=\"spark\" viewBox=\"0 0 {WIDTH} {HEIGHT}\" width=\"{WIDTH}\" height=\"{HEIGHT}\" \
         aria-hidden=\"true\"><path class=\"line\" style=\"stroke:{colour}\" d=\"{path}\"/></svg>"
    )
}
