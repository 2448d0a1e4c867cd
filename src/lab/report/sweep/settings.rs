//! The points of a sweep as settings: runs that differ in the seed alone belong together.

use std::collections::BTreeMap;

use super::measure::Measure;
use super::statistics::{Summary, front, summary};
use super::{ShownAxis, SweepView};
use crate::lab::report::number::{significant, size};
use crate::lab::table::{Column, Role};

/// Values told apart at most; of more, ranges.
const VALUES_MAX: usize = 40;
/// Ranges of the values of such an axis.
const RANGES: usize = 16;

/// One axis: its distinct values in order, and which of them each row has.
#[derive(Debug, Clone)]
pub(super) struct Levels<'a> {
    pub axis: &'a ShownAxis,
    /// Each value as text.
    pub texts: Vec<String>,
    /// Each value as a number, where all are.
    pub numbers: Option<Vec<f64>>,
    /// Place in `texts` by row.
    pub codes: Vec<Option<usize>>,
}

impl<'a> Levels<'a> {
    fn new(axis: &'a ShownAxis, column: &Column) -> Self {
        let rows = column.values.len();
        let mut found: BTreeMap<String, Option<f64>> = BTreeMap::new();
        let cells: Vec<_> = (0..rows).map(|row| column.values.text(row)).collect();
        for (row, cell) in cells.iter().enumerate() {
            if let Some(text) = cell {
                found.insert(text.clone(), column.values.number(row));
            }
        }
        let place = |text: &String| axis.order.iter().position(|known| known == text);
        let mut values: Vec<(String, Option<f64>)> = found.into_iter().collect();
        let numbers = !column.values.is_text() && values.iter().all(|(_, number)| number.is_some());
        values.sort_by(|a, b| match (numbers, a.1, b.1) {
            (true, Some(a), Some(b)) => a.total_cmp(&b),
            _ => {
                let key = |text| place(text).unwrap_or(usize::MAX);
                key(&a.0).cmp(&key(&b.0)).then(a.0.cmp(&b.0))
            }
        });
        let index: BTreeMap<&str, usize> =
            values.iter().enumerate().map(|(at, (text, _))| (text.as_str(), at)).collect();
        let codes = cells.iter().map(|cell| index.get(cell.as_deref()?).copied()).collect();
        let texts = values.iter().map(|(text, _)| text.clone()).collect();
        let numbers = numbers.then(|| values.iter().filter_map(|(_, number)| *number).collect());
        Self { axis, texts, numbers, codes }
    }

    /// Whether there is something to compare.
    pub(super) fn varies(&self) -> bool {
        self.texts.len() > 1
    }

    /// Whether it is drawn on a log scale.
    pub(super) fn log(&self) -> bool {
        let positive = |numbers: &Vec<f64>| numbers.iter().all(|number| *number > 0.0);
        self.axis.log && self.numbers.as_ref().is_some_and(positive)
    }

    /// Whether its values were drawn from a range.
    pub(super) fn drawn(&self) -> bool {
        self.numbers.is_some() && self.axis.order.is_empty() && self.texts.len() > 12
    }

    /// Whether its values are too many to be told apart, so that figures gather them by [`Levels::ranges`].
    pub(super) fn binned(&self) -> bool {
        self.drawn() || (self.numbers.is_some() && self.texts.len() > VALUES_MAX)
    }

    /// Ranges of equal width, by their ends; and which of them each value lies in.
    pub(super) fn ranges(&self) -> (Vec<[String; 2]>, Vec<usize>) {
        let numbers = self.numbers.as_deref().unwrap_or_default();
        let bend = |value: f64| if self.log() { value.ln() } else { value };
        let (Some(&low), Some(&high)) = (numbers.first(), numbers.last()) else {
            return (vec![], vec![]);
        };
        let (low, each) = (bend(low), (bend(high) - bend(low)) / size(RANGES));
        let edge = |at: usize| {
            let value = low + each * size(at);
            let value = if self.log() { value.exp() } else { value };
            significant(format!("{value:.2e}").parse().unwrap_or(value))
        };
        let texts = (0..RANGES).map(|at| [edge(at), edge(at + 1)]).collect();
        // A cast saturates, and sends what nothing divides to 0.
        let place = |value: &f64| (((bend(*value) - low) / each) as usize).min(RANGES - 1);
        (texts, numbers.iter().map(place).collect())
    }
}

/// The table of a sweep, sorted out.
#[derive(Debug, Clone)]
pub(super) struct Settings<'a> {
    pub view: &'a SweepView<'a>,
    /// Every axis that is in the table.
    pub axes: Vec<Levels<'a>>,
    /// Rows of each setting, in the order of the table.
    pub groups: Vec<Vec<usize>>,
}

impl<'a> Settings<'a> {
    pub(super) fn new(view: &'a SweepView<'a>) -> Self {
        let known =
            view.axes.iter().filter_map(|axis| Some((axis, view.table.column(&axis.name)?)));
        let axes: Vec<_> = known.map(|(axis, column)| Levels::new(axis, column)).collect();
        let mut places: BTreeMap<Vec<Option<usize>>, usize> = BTreeMap::new();
        let mut groups: Vec<Vec<usize>> = Vec::new();
        for row in 0..view.table.len() {
            let key = axes.iter().map(|axis| axis.codes[row]).collect();
            let next = groups.len();
            let place = *places.entry(key).or_insert(next);
            if place == next {
                groups.push(Vec::new());
            }
            groups[place].push(row);
        }
        Self { view, axes, groups }
    }

    /// An axis by name.
    pub(super) fn axis(&self, name: &str) -> Option<&Levels<'a>> {
        self.axes.iter().find(|axis| axis.axis.name == name)
    }

    /// A result by name, if it has numbers.
    pub(super) fn measure(&self, name: &str) -> Option<Measure<'a>> {
        Measure::new(self.view.table.column(name)?)
    }

    /// Every result that has numbers.
    pub(super) fn measures(&self) -> Vec<Measure<'a>> {
        self.view.table.with_role(Role::Result).filter_map(Measure::new).collect()
    }

    /// The mean of each setting.
    pub(super) fn means(&self, measure: Measure<'_>) -> Vec<Option<f64>> {
        let mean = |rows: &Vec<usize>| Some(self.summary(measure, rows)?.mean);
        self.groups.iter().map(mean).collect()
    }

    /// Rows that have a result.
    pub(super) fn finished(&self) -> usize {
        let results: Vec<_> = self.view.table.with_role(Role::Result).collect();
        let done = |row: &usize| results.iter().any(|one| one.values.text(*row).is_some());
        (0..self.view.table.len()).filter(done).count()
    }

    /// Numbers of some rows.
    pub(super) fn summary(&self, measure: Measure<'_>, rows: &[usize]) -> Option<Summary> {
        let values = rows.iter().filter_map(|&row| measure.column.values.number(row));
        summary(&values.filter(|value| value.is_finite()).collect::<Vec<_>>())
    }

    /// What settings are chosen by where a result is asked for: the validation set in place of the test set, which is
    /// read and never chosen by; of policies, episodes after the last epoch in place of those of the final test.
    pub(super) fn chooser<'m>(&self, measure: Measure<'m>) -> Measure<'m>
    where
        'a: 'm,
    {
        let instead = match &*measure.column.name {
            "test_accuracy" => self.measure("validation_accuracy"),
            "return_mean" => self.measure("return_evaluated"),
            _ => None,
        };
        instead.filter(|other| other.ends.is_some()).unwrap_or(measure)
    }

    /// The setting with the best mean of its [`Settings::chooser`] among those with most runs, and the numbers of that.
    pub(super) fn best(&self, measure: Measure<'_>) -> Option<(&[usize], Summary)> {
        let measure = self.chooser(measure);
        let all: Vec<_> = self
            .groups
            .iter()
            .filter_map(|rows| Some((rows.as_slice(), self.summary(measure, rows)?)))
            .collect();
        let most = all.iter().map(|(_, summary)| summary.n).max()?;
        let worth = |summary: &Summary| if measure.less { -summary.mean } else { summary.mean };
        let full = all.into_iter().filter(|(_, summary)| summary.n == most);
        // The first of equals.
        full.reduce(|best, next| if worth(&next.1) > worth(&best.1) { next } else { best })
    }

    /// Settings that have a mean of it.
    pub(super) fn with_mean(&self, measure: Measure<'_>) -> usize {
        self.groups.iter().filter(|rows| self.summary(measure, rows).is_some()).count()
    }

    /// Axes that vary, are not `shown`, and the value each is held at: that of the best setting; none where it pools.
    pub(super) fn held(&self, measure: Measure<'_>, shown: &[&str]) -> Vec<Held<'_, 'a>> {
        let best = self.best(measure).and_then(|(rows, _)| rows.first().copied());
        let others = self.axes.iter().filter(|axis| axis.varies());
        let others = others.filter(|axis| !shown.contains(&axis.axis.name.as_str()));
        let value = |axis: &Levels<'_>| if axis.drawn() { None } else { axis.codes[best?] };
        others.map(|axis| (axis, value(axis))).collect()
    }

    /// Numbers of the rows that have these values and lie where the other axes are held; an axis that is not there
    /// has every value.
    pub(super) fn cell(
        &self,
        measure: Measure<'_>,
        held: &[Held<'_, 'a>],
        places: &[(Option<&Levels<'_>>, usize)],
    ) -> Option<Summary> {
        let has = |row: usize, axis: &Levels<'_>, at| axis.codes[row] == Some(at);
        let fits = |&row: &usize| {
            places.iter().all(|&(axis, at)| axis.is_none_or(|axis| has(row, axis, at)))
                && lies(held, row)
        };
        let rows: Vec<usize> = (0..self.view.table.len()).filter(fits).collect();
        self.summary(measure, &rows)
    }
}

/// An axis that is not shown, and the place of the value it is held at; none where it pools.
pub(super) type Held<'l, 'a> = (&'l Levels<'a>, Option<usize>);

/// Whether a row lies where axes are held.
pub(super) fn lies(held: &[Held<'_, '_>], row: usize) -> bool {
    held.iter().all(|(axis, value)| value.is_none() || axis.codes[row] == *value)
}

/// The settings that no other beats, by their means: less cost, and more value, or less where that is better. In order
/// of cost. A log axis has no place for a cost of 0, and a linear one would press the rest flat.
pub(super) fn front_of(
    (cost, costs): (Measure<'_>, &[Option<f64>]),
    (value, values): (Measure<'_>, &[Option<f64>]),
) -> Vec<usize> {
    let pair = |at: usize| Some((costs[at].filter(|&one| one > 0.0 || !cost.log)?, values[at]?));
    let there: Vec<usize> = (0..costs.len()).filter(|&at| pair(at).is_some()).collect();
    let points: Vec<(f64, f64)> = there.iter().filter_map(|&at| pair(at)).collect();
    front(&points, value.less).into_iter().map(|at| there[at]).collect()
}
