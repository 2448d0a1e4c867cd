//! Marks of points and their spread: bands, whiskers, markers, keys.

use std::fmt::Write as _;

use super::{Chart, track};
use crate::lab::report::number::{place, size};

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
        let there = points.iter().map(|&(x, _, high)| (x, high));
        let back = points.iter().rev().map(|&(x, low, _)| (x, low));
        let d = track(there.chain(back).map(|(x, y)| (self.x(x), self.y(y))));
        let _ = write!(self.body, "<path class=\"band\" style=\"fill:{colour}\" d=\"{d}z\"/>");
    }

    /// A bar with ends, from one point to another along one of the axes.
    pub(in crate::lab::report) fn whisker(
        &mut self,
        from: (f64, f64),
        to: (f64, f64),
        colour: &str,
    ) {
        let [a, b] = [from, to].map(|(x, y)| (self.x(x), self.y(y)));
        let (dx, dy) = if from.0 == to.0 { (3.0, 0.0) } else { (0.0, 3.0) };
        let end = |(x, y): (f64, f64)| track([(x - dx, y - dy), (x + dx, y + dy)]);
        let d = format!("{}{}{}", track([a, b]), end(a), end(b));
        self.path("whisker", colour, 0, &d);
    }

    /// The marker of a number at a point.
    pub(in crate::lab::report) fn marker(
        &mut self,
        at: (f64, f64),
        number: usize,
        radius: f64,
        colour: &str,
        class: &str,
    ) {
        self.marker_at(self.x(at.0), self.y(at.1), number, radius, colour, class);
    }

    fn marker_at(&mut self, x: f64, y: f64, number: usize, r: f64, colour: &str, class: &str) {
        let shape = outline(number, x, y, r);
        let _ = write!(self.body, "{shape} class=\"{class}\" style=\"fill:{colour}\"/>");
    }

    /// Words above the left end of the frame.
    pub(in crate::lab::report) fn heading(&mut self, text: &str) {
        self.text("heading", self.left, self.top - 8.0, text);
    }

    /// A key right of the frame: its name, then number, colour and name of each entry; with lines through the markers,
    /// or without.
    pub(in crate::lab::report) fn key<'a>(
        &mut self,
        title: &str,
        entries: impl Iterator<Item = (usize, &'a str, String)>,
        lined: bool,
    ) {
        let left = self.width - self.right + 14.0;
        self.text("note", left, self.top + 14.0, title);
        for (entry, (number, colour, text)) in (1..).zip(entries) {
            let y = self.top + 10.0 + 19.0 * size(entry);
            let middle = if lined { left + 15.0 } else { left + 5.0 };
            if lined {
                self.path("line", colour, number, &track([(left, y), (left + 30.0, y)]));
            }
            self.marker_at(middle, y, number, 3.6, colour, "mark");
            self.text("tick", middle + if lined { 22.0 } else { 11.0 }, y + 4.0, &text);
        }
    }
}
