//! A column of numbers as figures draw it: in which unit, on which scale, between which ends. The same on page and paper.

use crate::lab::report::number::count;
use crate::lab::report::scale;
use crate::lab::table::{Column, ColumnUnit};

/// Numbers that span more than this go on a log axis where they are a cost.
const LOG_FROM: f64 = 20.0;
const PREFIXES: [&str; 12] = ["a", "f", "p", "n", "µ", "m", "", "k", "M", "G", "T", "P"];
const COUNTS: [&str; 4] = ["", "thousands", "millions", "billions"];

/// A column and how to draw it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Measure<'a> {
    pub column: &'a Column,
    /// Whether less of it is better: costs, losses and errors.
    pub less: bool,
    /// Numbers are drawn times this.
    pub by: f64,
    /// What makes up for it, before the sign of the unit or in its place.
    prefix: &'static str,
    /// The least and the greatest; none where there is no number.
    pub ends: Option<(f64, f64)>,
    /// Whether a log axis suits it.
    pub log: bool,
}

impl<'a> Measure<'a> {
    /// None of words.
    pub(super) fn new(column: &'a Column) -> Option<Self> {
        if column.values.is_text() {
            return None;
        }
        let numbers = (0..column.values.len()).filter_map(|row| column.values.number(row));
        let (mut ends, mut paid) = (None, None);
        for number in numbers.filter(|number| number.is_finite()) {
            let widen = |(low, high): (f64, f64)| (number.min(low), number.max(high));
            ends = Some(widen(ends.unwrap_or((number, number))));
            if number > 0.0 {
                paid = Some(widen(paid.unwrap_or((number, number))));
            }
        }
        let lossy = ["loss", "error"].iter().any(|word| column.name.contains(word));
        let less = lossy || !matches!(column.unit, ColumnUnit::Plain | ColumnUnit::Fraction);
        let (least, most) = paid.unwrap_or((1.0, 1.0));
        // such that few digits stand before and after the point
        let middle = if most / least > 1e4 { (least * most).sqrt() } else { most };
        let thousands = (middle.log10() / 3.0 + 1e-12).floor();
        let (by, prefix) = match column.unit {
            ColumnUnit::Plain | ColumnUnit::SquareMillimetres => (1.0, ""),
            ColumnUnit::Fraction => (100.0, ""),
            ColumnUnit::Seconds if middle >= 7200.0 => (1.0 / 3600.0, "h"),
            ColumnUnit::Seconds if middle >= 120.0 => (1.0 / 60.0, "min"),
            ColumnUnit::Seconds | ColumnUnit::Joules => {
                let thousands = thousands.clamp(-6.0, 5.0);
                (1000f64.powf(-thousands), PREFIXES[(thousands + 6.0) as usize])
            }
            ColumnUnit::Count | ColumnUnit::Cycles if middle < 1e5 => (1.0, ""),
            ColumnUnit::Count | ColumnUnit::Cycles => {
                let thousands = thousands.clamp(1.0, 3.0);
                (1000f64.powf(-thousands), COUNTS[thousands as usize])
            }
        };
        Some(Self { column, less, by, prefix, ends, log: most / least > LOG_FROM })
    }

    /// The unit of what is drawn.
    pub(super) fn sign(&self) -> String {
        match self.column.unit {
            ColumnUnit::Count | ColumnUnit::Cycles if !self.prefix.is_empty() => self.prefix.into(),
            ColumnUnit::Seconds if ["min", "h"].contains(&self.prefix) => self.prefix.into(),
            unit => format!("{}{}", self.prefix, unit.sign()),
        }
    }

    /// The label with that unit.
    pub(super) fn title(&self) -> String {
        let (label, sign) = (&self.column.label, self.sign());
        if sign.is_empty() { label.clone() } else { format!("{label} ({sign})") }
    }

    /// Round numbers between the ends, and their names in the unit of what is drawn.
    pub(super) fn marks(&self, log: bool) -> Vec<(f64, String)> {
        let Some((low, high)) = self.ends else { return Vec::new() };
        let (low, high) = (low * self.by, high * self.by);
        let axis = if log && low > 0.0 {
            scale::Axis::powers(low, high, "")
        } else {
            scale::Axis::round(low, high, "")
        };
        let inside = axis.ticks.into_iter().filter(|(tick, _)| *tick <= high);
        let grouped = |tick: f64, text| if tick >= 1e4 { count(tick.round() as u64) } else { text };
        inside.map(|(tick, text)| (tick / self.by, grouped(tick, text))).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lab::table::{Role, Values};

    #[test]
    fn numbers_are_drawn_with_few_digits() {
        let cases = [
            (ColumnUnit::Joules, vec![2e-6, 5.9e-5], "x (µJ)", 1e6),
            (ColumnUnit::Joules, vec![1e-9, 1e-3], "x (µJ)", 1e6),
            (ColumnUnit::Seconds, vec![0.0], "x (s)", 1.0),
            (ColumnUnit::Seconds, vec![3.0, 400.0], "x (min)", 1.0 / 60.0),
            (ColumnUnit::Seconds, vec![9000.0], "x (h)", 1.0 / 3600.0),
            (ColumnUnit::Fraction, vec![0.5], "x (%)", 100.0),
            (ColumnUnit::Cycles, vec![1.0, 99_999.0], "x (cycles)", 1.0),
            (ColumnUnit::Count, vec![2e6, 3e7], "x (millions)", 1e-6),
            (ColumnUnit::Plain, vec![7e9], "x", 1.0),
            (ColumnUnit::Joules, vec![], "x (J)", 1.0),
        ];
        for (unit, numbers, title, by) in cases {
            let values = Values::Real(numbers.into_iter().map(Some).collect());
            let column =
                Column { name: "x".into(), label: "x".into(), unit, role: Role::Result, values };
            let measure = Measure::new(&column).unwrap();
            assert_eq!(measure.title(), title);
            assert!((measure.by / by - 1.0).abs() < 1e-9, "{title}: {}", measure.by);
            assert!(measure.marks(measure.log).len() < 13);
        }
    }
}
