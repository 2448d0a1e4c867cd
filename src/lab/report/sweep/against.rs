//! Every setting against one of them, and against what others reported: means, deviations, Welch's test. For terminal and
//! page: both get the same cells.
//!
//! ```text
//! less B        mean - mean of the baseline, among settings that share all other values
//! t, d, p       Welch's test of the two, [`super::statistics::welch`]
//! published     mean and deviation as others give them; less it, and the same test where they say deviation and runs
//! ```

use super::measure::Measure;
use super::settings::{Held, Levels, Settings};
use super::statistics::{Side, Summary, Welch, welch};
use super::{Published, SweepView};
use crate::lab::report::number::{count, escape};
use crate::lab::table::ColumnUnit;

/// Lines at most.
const LINES_MAX: usize = 100;

/// The table, as words.
#[derive(Debug, PartialEq, Eq)]
pub(super) struct Against {
    pub title: String,
    pub heads: Vec<String>,
    pub lines: Vec<Vec<String>>,
    /// Columns of words, which stand to the left.
    pub words: usize,
    pub notes: Vec<String>,
}

/// Where a line lies: abscissa, curves, panels.
type Place<'l, 'a> = [(Option<&'l Levels<'a>>, usize); 3];

/// The table; nothing where the sweep file asks for none, or nothing has finished.
pub(super) fn against(settings: &Settings<'_>) -> Option<Against> {
    let wanted = &settings.view.figures;
    if wanted.baseline.is_none() && wanted.published.is_empty() {
        return None;
    }
    let x = settings.axis(&wanted.x).filter(|x| !x.drawn())?;
    let measure = settings.measure(&wanted.y)?;
    let named = |name: &Option<String>| settings.axis(name.as_ref()?).filter(|axis| !axis.drawn());
    let (series, panel) = (named(&wanted.series), named(&wanted.panel));
    let shown = [panel, series, Some(x)].into_iter().flatten();
    let names: Vec<&str> = shown.clone().map(|axis| &*axis.axis.name).collect();
    let held = settings.held(measure, &names);
    let base = wanted.baseline.as_ref().and_then(|of| x.texts.iter().position(|text| text == of));
    let tests = Tests { settings, measure, held: &held, base };
    let places = |axis: Option<&Levels<'_>>| 0..axis.map_or(1, |axis| axis.texts.len());
    let all = places(panel).flat_map(|p| places(series).map(move |s| (p, s)));
    let all = all.flat_map(|(p, s)| (0..x.texts.len()).map(move |at| (p, s, at)));
    let lines: Vec<Vec<String>> = all
        .filter_map(|(p, s, at)| tests.line([(Some(x), at), (series, s), (panel, p)]))
        .take(LINES_MAX)
        .collect();
    if lines.is_empty() {
        return None;
    }
    let mut heads: Vec<String> = shown.map(|axis| axis.axis.label.clone()).collect();
    let words = heads.len();
    heads.extend(["runs", "mean", "deviation", "epochs", "cells"].map(str::to_owned));
    let mut notes = vec!["deviation: of runs that differ in the seed alone".to_owned()];
    if let Some(base) = base {
        let name = &x.texts[base];
        heads.push(format!("less {name}"));
        heads.extend(["t", "d", "p"].map(str::to_owned));
        notes.push(format!(
            "t, d, p: Welch's test against {name}: standard errors, degrees of freedom, the chance of such a difference \
             between equal means"
        ));
    }
    if !wanted.published.is_empty() {
        heads.extend(["published", "less it", "p of that"].map(str::to_owned));
        let mut sources: Vec<&str> = wanted.published.iter().map(|one| &*one.source).collect();
        sources.retain(|source| !source.is_empty());
        sources.dedup();
        if !sources.is_empty() {
            notes.push(format!("published: {}", sources.join("; ")));
        }
    }
    notes.extend(held_note(&held));
    Some(Against { title: measure.title(), heads, lines, words, notes })
}

fn held_note(held: &[Held<'_, '_>]) -> Option<String> {
    let words: Vec<String> = held
        .iter()
        .map(|(axis, value)| match value {
            Some(at) => format!("{} {}", axis.axis.label, axis.texts[*at]),
            None => format!("all of {}", axis.axis.label),
        })
        .collect();
    (!words.is_empty()).then(|| format!("held: {}", words.join(", ")))
}

struct Tests<'l, 'a> {
    settings: &'l Settings<'a>,
    measure: Measure<'l>,
    held: &'l [Held<'l, 'a>],
    base: Option<usize>,
}

impl<'a> Tests<'_, 'a> {
    fn cell(&self, name: &str, place: &Place<'_, 'a>) -> Option<Summary> {
        self.settings.cell(self.settings.measure(name)?, self.held, place)
    }

    /// A line; nothing where no run has finished.
    fn line(&self, place: Place<'_, 'a>) -> Option<Vec<String>> {
        let found = self.settings.cell(self.measure, self.held, &place)?;
        let [x, series, panel] = place;
        let mut cells: Vec<String> = [panel, series, x]
            .into_iter()
            .filter_map(|(axis, at)| Some(axis?.texts[at].clone()))
            .collect();
        cells.push(found.n.to_string());
        cells.push(self.number(found.mean));
        cells.push(found.deviation.map_or_else(none, |deviation| self.number(deviation)));
        for name in ["epochs", "cells"] {
            cells.push(self.cell(name, &place).map_or_else(none, |one| between(&one)));
        }
        let figures = &self.settings.view.figures;
        if let Some(base) = self.base {
            let other = [(x.0, base), series, panel];
            let of = self.settings.cell(self.measure, self.held, &other).filter(|_| x.1 != base);
            cells.push(of.map_or_else(none, |of| self.signed(found.mean - of.mean)));
            let test = of.and_then(|of| welch(side(&found)?, side(&of)?));
            cells.extend(test.map_or_else(|| [none(), none(), none()], words));
        }
        if !figures.published.is_empty() {
            cells.extend(self.published(&found, &place));
        }
        Some(cells)
    }

    fn published(&self, found: &Summary, place: &Place<'_, 'a>) -> [String; 3] {
        let fits = |one: &&Published| {
            one.at.iter().zip(place).all(|(wanted, (axis, at))| {
                wanted
                    .as_ref()
                    .is_none_or(|wanted| axis.is_some_and(|axis| axis.texts[*at] == *wanted))
            })
        };
        let Some(one) = self.settings.view.figures.published.iter().find(fits) else {
            return [none(), none(), none()];
        };
        let deviation = one.deviation.map(|deviation| format!(" ±{}", self.number(deviation)));
        let theirs = one.deviation.zip(one.runs);
        let theirs = theirs.map(|(deviation, runs)| (one.mean, deviation, runs as usize));
        let test = theirs.and_then(|theirs| welch(side(found)?, theirs));
        [
            format!("{}{}", self.number(one.mean), deviation.unwrap_or_default()),
            self.signed(found.mean - one.mean),
            test.map_or_else(none, |test| chance(test.p)),
        ]
    }

    fn number(&self, value: f64) -> String {
        let places = if self.measure.column.unit == ColumnUnit::Plain { 3 } else { 2 };
        format!("{:.places$}", value * self.measure.by)
    }

    fn signed(&self, value: f64) -> String {
        let text = self.number(value);
        if text.starts_with('-') { text } else { format!("+{text}") }
    }
}

fn none() -> String {
    "-".into()
}

fn side(of: &Summary) -> Option<Side> {
    Some((of.mean, of.deviation?, of.n))
}

fn words(test: Welch) -> [String; 3] {
    [format!("{:.2}", test.t), format!("{:.1}", test.degrees), chance(test.p)]
}

fn chance(p: f64) -> String {
    if p < 0.001 { "<0.001".into() } else { format!("{p:.3}") }
}

/// A whole number that runs share, or the least and the greatest.
fn between(of: &Summary) -> String {
    let [low, high] = [of.low, of.high].map(|value| count(value.round() as u64));
    if low == high { low } else { format!("{low}..{high}") }
}

/// For the terminal.
pub(super) fn text(view: &SweepView<'_>) -> Option<String> {
    let table = against(&Settings::new(view))?;
    let widths: Vec<usize> = (0..table.heads.len())
        .map(|at| {
            let cells = table.lines.iter().map(|line| &line[at]).chain([&table.heads[at]]);
            cells.map(|cell| cell.chars().count()).max().unwrap_or(0)
        })
        .collect();
    let row = |cells: &[String]| {
        let padded: Vec<String> = cells
            .iter()
            .zip(&widths)
            .enumerate()
            .map(|(at, (cell, &width))| {
                if at < table.words { format!("{cell:<width$}") } else { format!("{cell:>width$}") }
            })
            .collect();
        padded.join("  ").trim_end().to_owned()
    };
    let mut out = vec![table.title.clone(), row(&table.heads)];
    out.extend(table.lines.iter().map(|line| row(line)));
    out.extend(table.notes.clone());
    Some(out.join("\n"))
}

/// For the page: a card of its own; empty where there is no table.
pub(super) fn card(settings: &Settings<'_>, number: usize) -> String {
    let Some(table) = against(settings) else { return String::new() };
    let cells = |tag: &str, cells: &[String]| -> String {
        let one = |(at, cell): (usize, &String)| {
            let cell = escape(cell);
            if at < table.words {
                format!("<th style=\"text-align:left\">{cell}</th>")
            } else {
                format!("<{tag}>{cell}</{tag}>")
            }
        };
        cells.iter().enumerate().map(one).collect()
    };
    let lines: String =
        table.lines.iter().map(|line| format!("<tr>{}</tr>", cells("td", line))).collect();
    let notes: String = table
        .notes
        .iter()
        .map(|note| format!("<p class=\"caption\">{}</p>", escape(note)))
        .collect();
    format!(
        "<section class=\"card wide\" id=\"against\"><div class=\"top\"><h2><span>{number}</span>Compared</h2></div>\
         <p>{}</p><div class=\"scroll\"><table><thead><tr>{}</tr></thead><tbody>{lines}</tbody></table></div>{notes}\
         </section>\n",
        escape(&table.title),
        cells("th", &table.heads)
    )
}
