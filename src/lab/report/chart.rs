//! Every drawing of this program that needs no script: run pages, figures for papers, what a sweep's page shows without
//! one. Inline SVG; its classes are those of chart.css, its colours those of page.css (`colour::on_white` for paper).
//!
//! ```text
//! chart.rs          frame, axes, lines, bars, texts          chart/series.rs   series with labels at their ends
//! chart/marks.rs    bands, whiskers, markers, keys           chart/margin.rs   bars beside the plot
//! chart/ramp.rs     the map of colours and its scale
//! ```

mod margin;
mod marks;
mod ramp;
mod series;

use std::fmt::Write as _;

use super::number::{escape, place, size};
use super::scale::{Axis, Curve};

pub(super) use ramp::ramp;
pub(super) use series::{Series, spark};

/// Points kept of one line; more would not be seen.
const POINTS_MAX: usize = 400;
/// Units that a letter takes, about.
const LETTER: f64 = 7.0;
/// Strokes that tell lines apart without colour.
const DASHES: [&str; 8] = ["", "6 3", "2 3", "9 3 2 3", "12 4", "5 2", "2 2", "9 3 2 3 2 3"];

/// Units that a text of ticks and keys takes, about.
pub(super) fn wide(text: &str) -> f64 {
    LETTER * size(text.chars().count())
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
    /// Whether names along the abscissa are too long to lie flat.
    turned: bool,
    /// What the pointer calls a place of the abscissa.
    unit: &'static str,
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
        let left = 30.0 + y.ticks.iter().map(|(_, text)| wide(text)).fold(LETTER, f64::max);
        let (bottom, body) = (42.0, String::new());
        let (turned, unit) = (false, "epoch");
        let mut chart = Self { width, height, left, right, top, bottom, x, y, turned, unit, body };
        let near = |pair: &[(f64, String)]| {
            let room = (chart.x(pair[1].0) - chart.x(pair[0].0)).abs();
            0.5 * (wide(&pair[0].1) + wide(&pair[1].1)) > room
        };
        if chart.x.ticks.windows(2).any(near) {
            let longest = chart.x.ticks.iter().map(|(_, text)| wide(text)).fold(0.0, f64::max);
            (chart.turned, chart.bottom) = (true, 30.0 + 0.8 * longest);
        }
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

    /// Calls places of the abscissa something else than epochs.
    pub(super) fn by(&mut self, unit: &'static str) -> &mut Self {
        self.unit = unit;
        self
    }

    /// Width and height of the frame inside the axes.
    pub(super) fn inside(&self) -> (f64, f64) {
        (self.width - self.left - self.right, self.base() - self.top)
    }

    fn axes(&mut self) {
        let (left, right, base) = (self.left, self.width - self.right, self.base());
        // cells show by themselves where they end
        let cells = self.y.scale.curve == Curve::Cells;
        for (tick, text) in self.y.ticks.clone() {
            let y = self.y(tick);
            if !cells {
                self.segment("grid", left, y, right, y);
            }
            self.text("tick end", left - 7.0, y + 4.0, &text);
        }
        for (tick, text) in self.x.ticks.clone() {
            let x = self.x(tick);
            if !cells {
                self.segment("axis", x, base, x, base + 4.0);
            }
            if self.turned {
                self.leaning("tick end", (x + 4.0, base + 13.0), -45, &text);
            } else {
                self.text("tick middle", x, base + 17.0, &text);
            }
        }
        if !cells {
            self.segment("axis", left, base, right, base);
        }
        if let Some(gap) = self.y.gap() {
            let y = self.y(gap);
            for y in [y - 2.5, y + 2.5] {
                self.segment("axis", left - 5.0, y + 2.5, left + 5.0, y - 2.5);
            }
        }
        let (x_label, y_label) = (self.x.label.clone(), self.y.label.clone());
        self.text("label middle", (left + right) / 2.0, self.height - 6.0, &x_label);
        self.leaning("label middle", (12.0, (self.top + base) / 2.0), -90, &y_label);
    }

    fn segment(&mut self, class: &str, x0: f64, y0: f64, x1: f64, y1: f64) {
        let d = track([(x0, y0), (x1, y1)]);
        let _ = write!(self.body, "<path class=\"{class}\" d=\"{d}\"/>");
    }

    fn text(&mut self, class: &str, x: f64, y: f64, text: &str) {
        let (x, y) = (place(x), place(y));
        let text = escape(text);
        let _ = write!(self.body, "<text class=\"{class}\" x=\"{x}\" y=\"{y}\">{text}</text>");
    }

    fn leaning(&mut self, class: &str, at: (f64, f64), degrees: i32, text: &str) {
        self.body += &leaning(class, at, degrees, text);
    }

    /// Words at a point, in a colour and size, in the middle of it.
    pub(super) fn words(&mut self, at: (f64, f64), colour: &str, font: f64, text: &str) {
        let [x, y] = [self.x(at.0), self.y(at.1) + 0.34 * font].map(place);
        let text = escape(text);
        let _ = write!(
            self.body,
            "<text class=\"middle\" style=\"fill:{colour};font-size:{font:.1}px\" x=\"{x}\" y=\"{y}\">{text}</text>"
        );
    }

    /// A line of places on the page.
    fn path(&mut self, class: &str, colour: &str, dash: usize, d: &str) {
        let dash = match DASHES[dash % DASHES.len()] {
            "" => String::new(),
            dash => format!(" stroke-dasharray=\"{dash}\""),
        };
        let _ = write!(
            self.body,
            "<path class=\"{class}\" style=\"stroke:{colour}\"{dash} d=\"{d}\"/>"
        );
    }

    /// A line through points, thinned where there are too many to see.
    pub(super) fn line(&mut self, points: &[(f64, f64)], colour: &str, class: &str, number: usize) {
        let stride = points.len().div_ceil(POINTS_MAX).max(1);
        let last = points.len().saturating_sub(1);
        let kept = points.iter().enumerate().filter(|(i, _)| i % stride == 0 || *i == last);
        let d = track(kept.map(|(_, &(x, y))| (self.x(x), self.y(y))));
        if points.len() > 1 {
            self.path(class, colour, number, &d);
        }
    }

    /// From point to point by way of corners: along the abscissa first.
    pub(super) fn steps(&mut self, points: &[(f64, f64)], colour: &str) {
        let corner = |pair: &[(f64, f64)]| [(pair[1].0, pair[0].1), pair[1]];
        let corners = points.windows(2).flat_map(corner);
        let all: Vec<_> = points.first().copied().into_iter().chain(corners).collect();
        self.line(&all, colour, "line", 0);
    }

    /// A named horizontal line.
    pub(super) fn rule(&mut self, value: f64, name: &str) {
        let y = self.y(value);
        self.segment("rule", self.left, y, self.width - self.right, y);
        self.text("note", self.left + 5.0, y - 5.0, name);
    }

    /// A filled rectangle between two values of each axis; with a tip it answers to the pointer.
    pub(super) fn bar(
        &mut self,
        x: (f64, f64),
        y: (f64, f64),
        (colour, opacity): (&str, f64),
        tip: &str,
    ) {
        let (x0, x1) = (self.x(x.0), self.x(x.1));
        let (y0, y1) = (self.y(y.0), self.y(y.1));
        let [left, top] = [x0.min(x1), y0.min(y1)].map(place);
        let [wide, high] = [(x1 - x0).abs(), (y1 - y0).abs()].map(place);
        let tip = if tip.is_empty() {
            String::new()
        } else {
            format!(" class=\"square\" data-tip=\"{}\"", escape(tip).replace('\n', "&#10;"))
        };
        let _ = write!(
            self.body,
            "<rect{tip} x=\"{left}\" y=\"{top}\" width=\"{wide}\" height=\"{high}\" \
             style=\"fill:{colour};fill-opacity:{opacity:.3}\"/>"
        );
    }

    /// Invisible bands that tell their text to the pointer.
    pub(super) fn tips(&mut self, tips: &[(f64, String)]) {
        let wide = (self.width - self.left - self.right) / size(tips.len().max(1));
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

    /// What has been drawn, moved to a place, as part of a larger picture.
    pub(super) fn part(self, x: f64, y: f64) -> String {
        format!("<g transform=\"translate({} {})\">{}</g>", place(x), place(y), self.body)
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

/// Straight from place to place.
fn track(places: impl IntoIterator<Item = (f64, f64)>) -> String {
    let mut d = String::new();
    for (x, y) in places {
        let pen = if d.is_empty() { 'M' } else { 'L' };
        let _ = write!(d, "{pen}{} {}", place(x), place(y));
    }
    d
}

/// A text turned around its anchor.
fn leaning(class: &str, (x, y): (f64, f64), degrees: i32, text: &str) -> String {
    let (x, y, text) = (place(x), place(y), escape(text));
    format!(
        "<text class=\"{class}\" transform=\"translate({x} {y}) rotate({degrees})\">{text}</text>"
    )
}
