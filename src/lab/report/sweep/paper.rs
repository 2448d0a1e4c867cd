//! Figures for papers.

use super::SweepView;

/// A figure as a file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct StaticFigure {
    /// What it shows: `curves`, `heat`, `pareto`.
    pub name: String,
    /// Stand-alone SVG.
    pub svg: String,
}

/// The figures.
#[must_use]
pub fn figures(_view: &SweepView<'_>) -> Vec<StaticFigure> {
    Vec::new()
}

/// A number with six significant digits at most.
pub(super) fn plain(value: f64) -> String {
    format!("{value}")
}
