//! A picture in the plot, and bars in the margin right of it that share its vertical axis.

use std::fmt::Write as _;

use super::{Chart, track};
use crate::lab::report::number::{escape, place};
use crate::lab::report::scale::Axis;

/// Space between the plot and its margin.
const GAP: f64 = 26.0;
/// Space that the text of a tick takes.
const TICK: f64 = 34.0;

impl Chart {
    /// A picture between two values of each axis, one pixel a cell.
    pub(in crate::lab::report) fn picture(&mut self, x: (f64, f64), y: (f64, f64), uri: &str) {
        let (left, right) = (self.x(x.0), self.x(x.1));
        let (base, top) = (self.y(y.0), self.y(y.1));
        let _ = write!(
            self.body,
            "<image class=\"pixels\" x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\" \
             preserveAspectRatio=\"none\" href=\"{uri}\"/>",
            place(left),
            place(top),
            place(right - left),
            place(base - top)
        );
    }

    /// Where a value of `axis` lies in the margin.
    fn across(&self, axis: &Axis, value: f64) -> f64 {
        let from = self.width - self.right + GAP;
        from + axis.scale.fraction(value) * (self.right - GAP - 14.0)
    }

    /// The axis of the margin.
    pub(in crate::lab::report) fn margin(&mut self, axis: &Axis) {
        let (base, top) = (self.base(), self.top);
        let mut free = f64::NEG_INFINITY;
        for (tick, text) in &axis.ticks {
            let x = self.across(axis, *tick);
            if x < free {
                continue;
            }
            free = x + TICK;
            self.segment("grid", x, top, x, base);
            self.text("tick middle", x, base + 17.0, text);
        }
        let from = self.across(axis, axis.scale.from);
        self.segment("axis", from, base, self.across(axis, axis.scale.to), base);
        let x = (from + self.across(axis, axis.scale.to)) / 2.0;
        self.text("label middle", x, self.height - 6.0, &axis.label);
    }

    /// Bars of the margin, each over an interval of the vertical axis.
    pub(in crate::lab::report) fn margin_bars(
        &mut self,
        axis: &Axis,
        bars: impl Iterator<Item = ((f64, f64), f64)>,
        colour: &str,
    ) {
        let from = self.across(axis, axis.scale.from);
        let left = place(from);
        let mut path = String::new();
        for ((low, high), value) in bars.filter(|(_, value)| *value > 0.0) {
            // at least wide enough to be seen
            let right = place(self.across(axis, value).max(from + 0.6));
            let (base, top) = (place(self.y(low)), place(self.y(high)));
            let _ = write!(path, "M{left} {base}H{right}V{top}H{left}z");
        }
        let _ = write!(
            self.body,
            "<path d=\"{path}\" fill=\"{colour}\" fill-opacity=\"0.85\" shape-rendering=\"crispEdges\"/>"
        );
    }

    /// A line through the margin: value, then place on the vertical axis.
    pub(in crate::lab::report) fn margin_line(&mut self, axis: &Axis, points: &[(f64, f64)]) {
        let d = track(points.iter().map(|&(value, y)| (self.across(axis, value), self.y(y))));
        if !d.is_empty() {
            self.path("line thin", "var(--ink)", 0, &d);
        }
    }

    /// Invisible bands of the margin that tell their text to the pointer.
    pub(in crate::lab::report) fn margin_tips(&mut self, tips: &[((f64, f64), String)]) {
        let x = self.width - self.right + GAP;
        for ((from, to), text) in tips {
            let (base, top) = (self.y(*from), self.y(*to));
            let _ = write!(
                self.body,
                "<rect class=\"tip\" x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\" data-tip=\"{}\"/>",
                place(x),
                place(top),
                place(self.right - GAP),
                place(base - top),
                escape(text).replace('\n', "&#10;")
            );
        }
    }
}
