//! Scales and axes: from values to places on the page, and round numbers to mark them with.
//!
//! ```text
//! place = start + (end - start) * (s(value) - s(from)) / (s(to) - s(from))      s = identity, log2, square root
//! ```

use super::number::{float, short, significant, size};
use crate::lab::price::prefixed;

/// The curve of a scale.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Curve {
    Linear,
    Log,
    Root,
    /// As linear, for whole numbers that stand for cells side by side.
    Cells,
}

/// Values `from ..= to` laid along a curve. Values outside are drawn at the nearer end.
#[derive(Debug, Clone, Copy)]
pub(super) struct Scale {
    pub curve: Curve,
    pub from: f64,
    pub to: f64,
}

impl Scale {
    fn bend(self, value: f64) -> f64 {
        let value = value.clamp(self.from, self.to);
        match self.curve {
            Curve::Linear | Curve::Cells => value,
            Curve::Log => value.max(f64::MIN_POSITIVE).log2(),
            Curve::Root => value.max(0.0).sqrt(),
        }
    }

    /// Where a value lies, 0 at `from` and 1 at `to`.
    pub(super) fn fraction(self, value: f64) -> f64 {
        let span = self.bend(self.to) - self.bend(self.from);
        if span > 0.0 { (self.bend(value) - self.bend(self.from)) / span } else { 0.5 }
    }
}

/// A scale with marks and a name.
#[derive(Debug, Clone)]
pub(super) struct Axis {
    pub scale: Scale,
    pub ticks: Vec<(f64, String)>,
    pub label: String,
}

/// Room for 0 below a log curve, as a part of it.
const ZERO_ROOM: f64 = 0.16;
/// Its name.
const ZERO: &str = "0";

/// The round step (1, 2 or 5 times a power of ten) that cuts `span` into about `parts`.
fn step(span: f64, parts: f64) -> f64 {
    let raw = (span / parts).max(1e-9);
    let power = 10f64.powf(raw.log10().floor());
    let lead = raw / power;
    let round = [1.0, 2.0, 5.0].into_iter().find(|&round| lead <= round).unwrap_or(10.0);
    round * power
}

/// The least and the greatest.
fn ends(values: impl Iterator<Item = f64>) -> Option<(f64, f64)> {
    values.map(|value| (value, value)).reduce(|(a, b), (c, d)| (a.min(c), b.max(d)))
}

fn multiples(from: f64, to: f64, step: f64) -> impl Iterator<Item = f64> {
    let first = (from / step - 1e-6).ceil();
    (0..200)
        .map(move |i| (first + float(i)) * step)
        .take_while(move |&tick| tick <= to + 1e-6 * step)
}

impl Axis {
    /// Epoch numbers.
    pub(super) fn epochs(first: u32, last: u32) -> Self {
        let (mut from, mut to) = (f64::from(first), f64::from(last));
        let step = step(to - from, 8.0).max(1.0);
        let ticks = multiples(from, to, step).map(|tick| (tick, format!("{tick:.0}"))).collect();
        if first == last {
            (from, to) = (from - 0.5, to + 0.5);
        }
        Self { scale: Scale { curve: Curve::Linear, from, to }, ticks, label: "epoch".into() }
    }

    /// Percentages (values 0 to 100), the ends moved out to round numbers.
    pub(super) fn percent(low: f64, high: f64, label: &str) -> Self {
        let (low, high) = (low.clamp(-100.0, 100.0), high.clamp(-100.0, 100.0));
        let step = step((high - low).max(0.02), 5.0);
        let from = (low / step + 1e-6).floor() * step;
        let mut to = (high / step - 1e-6).ceil() * step;
        if to <= from {
            to = from + step;
        }
        let digits = if step < 0.1 {
            2
        } else if step < 1.0 {
            1
        } else {
            0
        };
        let mark = |tick: f64| {
            let tick = if tick.abs() < step * 0.5 { 0.0 } else { tick.abs() };
            format!("{tick:.digits$}\u{202f}%")
        };
        let ticks = multiples(from, to, step).map(|tick| (tick, mark(tick))).collect();
        Self { scale: Scale { curve: Curve::Linear, from, to }, ticks, label: label.into() }
    }

    /// Shares from 0 % on a square-root curve, so that small ones stay visible.
    pub(super) fn root_percent(high: f64, label: &str) -> Self {
        let to = high.clamp(0.1, 100.0);
        let ticks = [0.0, 0.1, 1.0, 5.0, 10.0, 20.0, 40.0, 60.0, 80.0, 100.0];
        let mut last = f64::NEG_INFINITY;
        let mut kept = Vec::new();
        for tick in ticks {
            if tick <= to && tick.sqrt() - last >= 0.13 * to.sqrt() {
                last = tick.sqrt();
                kept.push((tick, format!("{tick}\u{202f}%")));
            }
        }
        let scale = Scale { curve: Curve::Root, from: 0.0, to };
        Self { scale, ticks: kept, label: label.into() }
    }

    /// Ratios around 1 on a log curve.
    pub(super) fn ratio(values: impl Iterator<Item = f64>, label: &str) -> Self {
        let (mut low, mut high) = (0.75f64, 1.5f64);
        for value in values.filter(|value| *value > 0.0 && value.is_finite()) {
            low = low.min(value);
            high = high.max(value);
        }
        let octaves = high.log2() - low.log2();
        let marks: Vec<f64> = if octaves > 7.0 {
            let stride = size((octaves / 7.0).ceil() as usize);
            multiples(low.log2(), high.log2(), stride).map(f64::exp2).collect()
        } else {
            (-10..10)
                .map(|power| f64::from(power).exp2())
                .flat_map(|one| if octaves > 3.5 { vec![one] } else { vec![one, 1.5 * one] })
                .filter(|&mark| mark >= low * 0.99 && mark <= high * 1.01)
                .collect()
        };
        let ticks = marks.into_iter().map(|mark| (mark, plain(mark))).collect();
        let scale = Scale { curve: Curve::Log, from: low * 0.94, to: high * 1.06 };
        Self { scale, ticks, label: label.into() }
    }

    /// Counts on a log curve; 0 has a place of its own below, where it occurs.
    pub(super) fn counts(values: impl Iterator<Item = f64>, label: &str) -> Self {
        let values: Vec<f64> = values.collect();
        let there = values.iter().copied().filter(|&value| value >= 1.0);
        let (low, high) = ends(there).unwrap_or((1.0, 1.0));
        let from = low.log10().floor();
        let to = high.log10().ceil().max(from + 1.0);
        let show = |count: f64| short(count.round() as u64);
        let axis = Self::log(10f64.powf(from), 10f64.powf(to), show, label);
        axis.with_zero(values.iter().any(|&value| value < 1.0))
    }

    /// Energies, given in picojoules, on a log curve that ends where they do; 0 as for counts.
    pub(super) fn picojoules(values: impl Iterator<Item = f64>, label: &str) -> Self {
        let values: Vec<f64> = values.collect();
        let there = values.iter().copied().filter(|&value| value > 0.0 && value.is_finite());
        let (low, high) = ends(there).unwrap_or((1.0, 1.0));
        let axis = Self::log(0.8 * low, 1.25 * high, |tick| round(1e-12 * tick), label);
        axis.with_zero(values.iter().any(|&value| value <= 0.0))
    }

    /// A log curve has no place for 0: it gets one below the curve, with its name and a gap in between.
    fn with_zero(mut self, there: bool) -> Self {
        if there {
            let decades = (self.scale.to / self.scale.from).log10();
            self.scale.from /= 10f64.powf(ZERO_ROOM * decades);
            self.ticks.insert(0, (self.scale.from, ZERO.into()));
        }
        self
    }

    /// Where the axis is broken: between 0 and the curve of a log scale.
    pub(super) fn gap(&self) -> Option<f64> {
        let (at, text) = self.ticks.first()?;
        let broken = self.scale.curve == Curve::Log && text == ZERO;
        broken.then(|| {
            at * 10f64.powf(0.5 * ZERO_ROOM * (self.scale.to / at).log10() / (1.0 + ZERO_ROOM))
        })
    }

    /// Positive numbers on a log curve.
    pub(super) fn powers(low: f64, high: f64, label: &str) -> Self {
        let show =
            |mark: f64| if mark >= 1e4 { short(mark.round() as u64) } else { significant(mark) };
        Self::log(low, high, show, label)
    }

    /// A log curve, marked at powers of ten and as many of their multiples as there is room for.
    fn log(from: f64, to: f64, show: impl Fn(f64) -> String, label: &str) -> Self {
        let decades = (to / from).log10();
        let leads: &[f64] = match decades {
            decades if decades > 4.0 => &[1.0],
            decades if decades > 2.0 => &[1.0, 3.0],
            decades if decades > 0.9 => &[1.0, 2.0, 5.0],
            _ => &[1.0, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0],
        };
        let powers = multiples(from.log10().floor(), to.log10(), (decades / 7.0).ceil().max(1.0));
        let marks = powers.flat_map(|power| leads.iter().map(move |lead| lead * 10f64.powf(power)));
        // powers of ten are not exact
        let inside = marks.filter(|mark| (from * 0.999_999..=to * 1.000_001).contains(mark));
        let ticks = inside.map(|mark| (mark, show(mark))).collect();
        Self { scale: Scale { curve: Curve::Log, from, to }, ticks, label: label.into() }
    }

    /// Given marks; `ends` are drawn a little inside the frame.
    pub(super) fn marked(
        ticks: Vec<(f64, String)>,
        ends: (f64, f64),
        log: bool,
        label: &str,
    ) -> Self {
        let (from, to) = ends;
        let (from, to) = if log {
            let room = (to / from).powf(0.03).max(1.01);
            (from / room, to * room)
        } else {
            let room = if to > from { 0.03 * (to - from) } else { 0.5 };
            (from - room, to + room)
        };
        let curve = if log { Curve::Log } else { Curve::Linear };
        Self { scale: Scale { curve, from, to }, ticks, label: label.into() }
    }

    /// Cells side by side, some with a name; the first is number 0.
    pub(super) fn cells(count: usize, ticks: Vec<(f64, String)>, label: &str) -> Self {
        let scale = Scale { curve: Curve::Cells, from: -0.5, to: size(count) - 0.5 };
        Self { scale, ticks, label: label.into() }
    }

    /// Any numbers, with round marks; `low` and `high` stay where they are.
    pub(super) fn round(low: f64, high: f64, label: &str) -> Self {
        let high = if high > low { high } else { low + low.abs().max(1.0) };
        let step = step(high - low, 5.0);
        let show = |tick: f64| if tick.abs() < 0.5 * step { "0".into() } else { significant(tick) };
        let ticks = multiples(low, high, step).map(|tick| (tick, show(tick))).collect();
        Self {
            scale: Scale { curve: Curve::Linear, from: low, to: high },
            ticks,
            label: label.into(),
        }
    }

    /// Levels from 0.
    pub(super) fn levels(end: f64, label: &str) -> Self {
        let to = end.max(1.0);
        let step = step(to, 4.0).max(1.0);
        let ticks = multiples(0.0, to, step).map(|tick| (tick, format!("{tick:.0}"))).collect();
        let scale = Scale { curve: Curve::Linear, from: 0.0, to };
        Self { scale, ticks, label: label.into() }
    }
}

/// Joules at a mark, without the digits that a round number does not need.
pub(super) fn round(joules: f64) -> String {
    let text = prefixed(joules, "J");
    match text.split_once(' ') {
        Some((digits, unit)) if digits.contains('.') => {
            format!("{}\u{202f}{unit}", digits.trim_end_matches('0').trim_end_matches('.'))
        }
        _ => text.replace(' ', "\u{202f}"),
    }
}

fn plain(value: f64) -> String {
    let text = format!("{value:.3}");
    text.trim_end_matches('0').trim_end_matches('.').into()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ends_lie_at_the_ends_and_values_outside_stay_inside() {
        for curve in [Curve::Linear, Curve::Log, Curve::Root] {
            let scale = Scale { curve, from: 1.0, to: 16.0 };
            assert_eq!([0.0, 1.0, 16.0, 99.0].map(|v| scale.fraction(v)), [0.0, 0.0, 1.0, 1.0]);
        }
        assert_eq!(Scale { curve: Curve::Log, from: 1.0, to: 16.0 }.fraction(4.0), 0.5);
        assert_eq!(Scale { curve: Curve::Linear, from: 3.0, to: 3.0 }.fraction(3.0), 0.5);
    }

    #[test]
    fn zero_is_not_drawn_at_a_hundred_on_a_log_axis() {
        let axis = Axis::counts([0.0, 120.0, 5000.0].into_iter(), "");
        assert_eq!((axis.ticks[0].1.as_str(), axis.ticks[1].1.as_str()), ("0", "100"));
        let [zero, hundred, five] = [0.0, 100.0, 5000.0].map(|value| axis.scale.fraction(value));
        assert!(zero == 0.0 && (0.13..0.15).contains(&hundred) && five > 0.8, "{hundred} {five}");
        let gap = axis.scale.fraction(axis.gap().unwrap());
        assert!((0.05..hundred).contains(&gap), "{gap}");
        assert_eq!(Axis::counts([120.0, 5000.0].into_iter(), "").gap(), None);
        assert_eq!(Axis::epochs(0, 3).gap(), None, "0 of a straight axis is a number as others");
        assert!(Axis::picojoules([0.0, 7.0].into_iter(), "").gap().is_some());
    }

    #[test]
    fn marks_are_round_and_few_and_inside() {
        let axes = [
            Axis::epochs(0, 0),
            Axis::epochs(0, 1),
            Axis::epochs(0, 1000),
            Axis::percent(0.0, 0.0, ""),
            Axis::percent(97.31, 97.4, ""),
            Axis::percent(-60.0, 80.0, ""),
            Axis::root_percent(44.0, ""),
            Axis::ratio([0.0, f64::NAN].into_iter(), ""),
            Axis::ratio([1e-3, 3e4].into_iter(), ""),
            Axis::counts([0.0].into_iter(), ""),
            Axis::counts([1.0, 1e18].into_iter(), ""),
            Axis::picojoules([2.9e5, 3e5].into_iter(), ""),
            Axis::picojoules([1e-3, 1e9].into_iter(), ""),
            Axis::levels(0.0, ""),
            Axis::round(0.0, 0.0, ""),
            Axis::round(-0.4, 97.0, ""),
            Axis::powers(0.9, 3.3, ""),
            Axis::powers(1e-9, 2e7, ""),
            Axis::levels(255.0, ""),
        ];
        for axis in axes {
            assert!((1..=12).contains(&axis.ticks.len()), "{axis:?}");
            for (tick, _) in &axis.ticks {
                assert!(*tick >= axis.scale.from - 1e-9 && *tick <= axis.scale.to * 1.01 + 1e-9);
            }
        }
        let marks = Axis::percent(0.0, 47.0, "").ticks;
        assert_eq!(marks.iter().map(|(at, _)| *at).collect::<Vec<_>>()[..3], [0.0, 10.0, 20.0]);
    }
}
