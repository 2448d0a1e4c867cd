//! The page of a sweep and its figures for papers.
//!
//! ```text
//! html(view)      one self-contained page: table, figures and the script that draws them; loads nothing
//! figures(view)   the same figures, as they are at first, as stand-alone SVG
//! png(svg)        such a figure as a picture of 300 dots an inch
//! ```
//!
//! Means and intervals of all settings, fronts of all pairs of results, scales and the order of values are computed here
//! and go to the page as data. Its script selects among them as a reader chooses, and draws. tests/it/browser.rs compares
//! what is drawn with the table.

mod against;
mod curves;
mod heat;
mod importance;
mod json;
mod learning;
mod library;
mod measure;
mod page;
mod paper;
mod pareto;
mod raster;
mod settings;
mod statistics;
mod text;

pub use learning::{Learning, wanted};
pub use page::html;
pub(super) use paper::sheet;
pub use paper::{StaticFigure, figures};
pub use raster::png;
pub use text::text;

/// Every setting against one of them and against what others reported, for the terminal; nothing where the sweep file asks
/// for none.
#[must_use]
pub fn compared(view: &SweepView<'_>) -> Option<String> {
    against::text(view)
}

use super::words;
use crate::lab::table::{Column, Role, Table};

/// Everything the page of a sweep shows. Nothing here opens a file or reads a clock.
#[derive(Debug, Clone)]
pub struct SweepView<'a> {
    /// Name of the sweep: letters, digits, `-`.
    pub name: &'a str,
    /// Heading of the page.
    pub title: &'a str,
    /// What it asks and what it shows: paragraphs of plain text, an empty line between them.
    pub about: &'a str,
    /// One row a planned point, axes first; rows of points that are not finished have no results. The column `run`
    /// (text, role `Name`) is the page-relative address of the run's own report.
    pub table: &'a Table,
    /// The axes, in the order of the sweep file.
    pub axes: &'a [ShownAxis],
    /// What the figures show unless the reader chooses otherwise.
    pub figures: Figures,
    /// Right answers over epochs, as far as they were read: see [`wanted`].
    pub learning: &'a Learning,
    /// Points that cannot be run, with the reason.
    pub refused: &'a [Refused],
    /// What runs on these chips leave out: `key = text`, from `[not_simulated]`.
    pub not_simulated: &'a [String],
    /// Version of this program.
    pub version: &'a str,
}

/// One axis of a sweep; its column in the table has the same name.
#[derive(Debug, Clone, PartialEq)]
pub struct ShownAxis {
    /// Name of the column.
    pub name: String,
    /// Words for people.
    pub label: String,
    /// Whether the values are numbers.
    pub number: bool,
    /// Whether steps between numbers are ratios.
    pub log: bool,
    /// Values as the sweep file orders them, as [`crate::lab::table::Values::text`] gives them; empty when numbers
    /// were drawn from a range.
    pub order: Vec<String>,
}

/// Which columns the figures show at first; each is the name of a column of the table.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Figures {
    /// Abscissa of the curves: an axis.
    pub x: String,
    /// Ordinate of the curves, colour of the heat map: a result.
    pub y: String,
    /// One curve each: an axis.
    pub series: Option<String>,
    /// One panel each: an axis.
    pub panel: Option<String>,
    /// The two axes of the heat map.
    pub heat: Option<[String; 2]>,
    /// What a Pareto front sets against `y`, less is better: a result.
    pub cost: Option<String>,
    /// The value of the abscissa that the others are compared with.
    pub baseline: Option<String>,
    /// What others reported.
    pub published: Vec<Published>,
}

/// What others reported of a setting.
#[derive(Debug, Clone, PartialEq)]
pub struct Published {
    /// Values of the abscissa, of the axis of the curves and of that of the panels; none is all of them.
    pub at: [Option<String>; 3],
    /// The mean of the ordinate, in the unit of the table.
    pub mean: f64,
    /// The standard deviation over runs.
    pub deviation: Option<f64>,
    /// How many runs.
    pub runs: Option<u32>,
    /// Who says so; may be empty.
    pub source: String,
}

/// A point that cannot be run.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Refused {
    /// Number of the point, from 1.
    pub point: usize,
    /// Axis values in words.
    pub what: String,
    /// Why.
    pub why: String,
}

/// What a column means, in a sentence or two.
#[must_use]
pub fn meaning(column: &Column) -> String {
    match (words::of_column(&column.name), column.role) {
        (Some(meaning), _) => meaning.into(),
        (None, Role::Axis) => "Varied by the sweep; the sweep file says which keys it sets.".into(),
        (None, _) => String::new(),
    }
}

#[cfg(test)]
mod tests;
