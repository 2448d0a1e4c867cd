//! What figures of many runs draw besides lines: bands, error bars, markers, cells, panels, keys.

use std::fmt::Write as _;

use super::Chart;
use crate::lab::report::number::{escape, place};

/// Strokes that tell lines apart without colour.
const DASHES: [&str; 8] = ["", "6 3", "2 3", "9 3 2 3", "12 4", "5 2", "2 2", "9 3 2 3 2 3"];

/// The dashes of the line of that number.
pub(in crate::lab::report) fn dashes(number: usize) -> &'static str {
    DASHES[number % DASHES.len()]
}

/// The outline of the marker of that number: circle, square, diamond, triangles, cross, saltire, pentagon.
fn outline(number: usize, x: f64, y: f64, r: f64) -> String {
    let corners: &[(f64, f64)] = match number % 8 {
        0 => {
            let [cx, cy, r] = [x, y, r].map(place);
            return format!("<circle cx=\"{cx}\" cy=\"{cy}\" r=\"{r}\"");
        }
        1 => &[(-0.88, -0.88), (0.88, -0.88), (0.88, 0.88), (-0.88, 0.88)],
        2 => &[(0.0, -1.3), (1.3, 0.0), (0.0, 1.3), (-1.3, 0.0)],
        3 => &[(0.0, -1.2), (1.1, 0.8), (-1.1, 0.8)],
        4 => &[(0.0, 1.2), (1.1, -0.8), (-1.1, -0.8)],
        5 => &[
            (-0.4, -1.2),
            (0.4, -1.2),
            (0.4, -0.4),
            (1.2, -0.4),
            (1.2, 0.4),
            (0.4, 0.4),
            (0.4, 1.2),
            (-0.4, 1.2),
            (-0.4, 0.4),
            (-1.2, 0.4),
            (-1.2, -0.4),
            (-0.4, -0.4),
        ],
        6 => &[
            (-1.1, -0.6),
            (-0.6, -1.1),
            (0.0, -0.5),
            (0.6, -1.1),
            (1.1, -0.6),
            (0.5, 0.0),
            (1.1, 0.6),
            (0.6, 1.1),
            (0.0, 0.5),
            (-0.6, 1.1),
            (-1.1, 0.6),
            (-0.5, 0.0),
        ],
        _ => &[(0.0, -1.1), (1.05, -0.34), (0.65, 0.9), (-0.65, 0.9), (-1.05, -0.34)],
    };
    let at = corners.iter().map(|(dx, dy)| format!("{} {}", place(x + r * dx), place(y + r * dy)));
    format!("<path d=\"M{}z\"", at.collect::<Vec<_>>().join("L"))
}

impl Chart {
    /// The area between two lines over the same abscissas: `(x, low, high)`.
    pub(in crate::lab::report) fn band(&mut self, points: &[(f64, f64, f64)], colour: &str) {
        if points.len() < 2 {
            return;
        }
        let there = points.iter().map(|&(x, _, high)| (x, high));
        let back = points.iter().rev().map(|&(x, low, _)| (x, low));
        let corner = |(x, y)| format!("{} {}", place(self.x(x)), place(self.y(y)));
        let path = there.chain(back).map(corner).collect::<Vec<_>>().join("L");
        let _ = write!(self.body, "<path fill=\"{colour}\" fill-opacity=\"0.16\" d=\"M{path}z\"/>");
    }

    /// A line with the dashes of a number.
    pub(in crate::lab::report) fn stroke(
        &mut self,
        points: &[(f64, f64)],
        colour: &str,
        dash: usize,
    ) {
        let path =
            points.iter().map(|&(x, y)| format!("{} {}", place(self.x(x)), place(self.y(y))));
        let path = path.collect::<Vec<_>>().join("L");
        let _ = write!(
            self.body,
            "<path fill=\"none\" stroke=\"{colour}\" stroke-width=\"1.8\" stroke-linejoin=\"round\" \
             stroke-dasharray=\"{}\" d=\"M{path}\"/>",
            if dashes(dash).is_empty() { "none" } else { dashes(dash) }
        );
    }

    /// From point to point by way of corners: along the abscissa first.
    pub(in crate::lab::report) fn steps(&mut self, points: &[(f64, f64)], colour: &str) {
        let mut corners: Vec<(f64, f64)> = Vec::new();
        for &(x, y) in points {
            if let Some(&(_, before)) = corners.last() {
                corners.push((x, before));
            }
            corners.push((x, y));
        }
        self.stroke(&corners, colour, 0);
    }

    /// A bar with ends, from `low` to `high` along the ordinate.
    pub(in crate::lab::report) fn error_y(&mut self, x: f64, low: f64, high: f64, colour: &str) {
        let (x, low, high) = (self.x(x), self.y(low), self.y(high));
        let at = |x: f64, y: f64| format!("{} {}", place(x), place(y));
        let path = format!(
            "M{}L{}M{}L{}M{}L{}",
            at(x, low),
            at(x, high),
            at(x - 3.0, low),
            at(x + 3.0, low),
            at(x - 3.0, high),
            at(x + 3.0, high)
        );
        self.thin(&path, colour);
    }

    /// The same along the abscissa.
    pub(in crate::lab::report) fn error_x(&mut self, y: f64, low: f64, high: f64, colour: &str) {
        let (y, low, high) = (self.y(y), self.x(low), self.x(high));
        let at = |x: f64, y: f64| format!("{} {}", place(x), place(y));
        let path = format!(
            "M{}L{}M{}L{}M{}L{}",
            at(low, y),
            at(high, y),
            at(low, y - 3.0),
            at(low, y + 3.0),
            at(high, y - 3.0),
            at(high, y + 3.0)
        );
        self.thin(&path, colour);
    }

    fn thin(&mut self, path: &str, colour: &str) {
        let _ = write!(
            self.body,
            "<path fill=\"none\" stroke=\"{colour}\" stroke-opacity=\"0.6\" stroke-width=\"1\" d=\"{path}\"/>"
        );
    }

    /// The marker of a number at a point; pale ones have no outline.
    pub(in crate::lab::report) fn marker(
        &mut self,
        at: (f64, f64),
        number: usize,
        colour: &str,
        pale: bool,
    ) {
        let (x, y) = (self.x(at.0), self.y(at.1));
        let shape = outline(number, x, y, if pale { 2.8 } else { 3.6 });
        let how =
            if pale { "fill-opacity=\"0.35\"" } else { "stroke=\"#fff\" stroke-width=\"0.7\"" };
        let _ = write!(self.body, "{shape} fill=\"{colour}\" {how}/>");
    }

    /// Words at a point, in a colour, in the middle of it.
    pub(in crate::lab::report) fn words(&mut self, at: (f64, f64), colour: &str, text: &str) {
        let [x, y] = [self.x(at.0), self.y(at.1) + 4.0].map(place);
        let text = escape(text);
        let _ = write!(
            self.body,
            "<text class=\"middle\" style=\"fill:{colour}\" x=\"{x}\" y=\"{y}\">{text}</text>"
        );
    }

    /// Words above the left end of the frame.
    pub(in crate::lab::report) fn heading(&mut self, text: &str) {
        self.text("heading", self.left, self.top - 8.0, text);
    }

    /// Width of the frame inside the axes.
    pub(in crate::lab::report) fn inside(&self) -> (f64, f64) {
        (self.width - self.left - self.right, self.base() - self.top)
    }

    /// Words over a key, right of the frame.
    pub(in crate::lab::report) fn key_title(&mut self, text: &str) {
        self.text("note", self.width - self.right + 14.0, self.top + 14.0, text);
    }

    /// One entry of a key; `entry` counts from 1 on top. With a line through the marker, or without.
    pub(in crate::lab::report) fn key(
        &mut self,
        entry: usize,
        number: usize,
        colour: &str,
        text: &str,
        lined: bool,
    ) {
        let x = self.width - self.right + 14.0;
        let y = self.top + 10.0 + 19.0 * crate::lab::report::number::size(entry);
        let middle = if lined { x + 15.0 } else { x + 5.0 };
        if lined {
            let [left, right, middle] = [x, x + 30.0, y].map(place);
            let dash = if dashes(number).is_empty() { "none" } else { dashes(number) };
            let _ = write!(
                self.body,
                "<path fill=\"none\" stroke=\"{colour}\" stroke-width=\"1.8\" stroke-dasharray=\"{dash}\" \
                 d=\"M{left} {middle}L{right} {middle}\"/>"
            );
        }
        let shape = outline(number, middle, y, 3.6);
        let _ =
            write!(self.body, "{shape} fill=\"{colour}\" stroke=\"#fff\" stroke-width=\"0.7\"/>");
        self.text("tick", middle + if lined { 22.0 } else { 11.0 }, y + 4.0, text);
    }

    /// What has been drawn, moved to a place, as part of a larger picture.
    pub(in crate::lab::report) fn part(self, x: f64, y: f64) -> String {
        format!("<g transform=\"translate({} {})\">{}</g>", place(x), place(y), self.body)
    }
}
