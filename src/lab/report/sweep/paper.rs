//! Figures for papers: what the page shows at first, as stand-alone SVG on white, a column (90 mm) or a page (180 mm) wide.

use super::settings::{Levels, Settings};
use super::{SweepView, curves, heat, importance, learning, pareto};
use crate::lab::report::chart::wide;
use crate::lab::report::colour::on_white;
use crate::lab::report::number::{escape, place, significant, size};

/// Units of drawing across a column of a paper, and millimetres.
pub(super) const COLUMN: f64 = 480.0;
const COLUMN_MM: f64 = 90.0;

/// What paper has of its own: letters that any system has, and names that stand out.
const STYLE: &str = concat!(
    include_str!("../chart.css"),
    "svg text{font-family:sans-serif;font-size:13px}svg .label{font-size:14px;fill:var(--ink)}\
     .heading{fill:var(--ink);font-weight:bold}"
);

/// A figure as a file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct StaticFigure {
    /// What it shows: `curves`, `heat`, `pareto`, `learning`, `importance`.
    pub name: String,
    /// Stand-alone SVG.
    pub svg: String,
}

/// The figures of a sweep, as its file asks for them. One that has nothing to show is left out.
#[must_use]
pub fn figures(view: &SweepView<'_>) -> Vec<StaticFigure> {
    let settings = Settings::new(view);
    let all = [
        ("curves", curves::draw(&settings)),
        ("heat", heat::draw(&settings)),
        ("pareto", pareto::draw(&settings)),
        ("learning", learning::draw(&settings)),
        ("importance", importance::draw(&settings)),
    ];
    let drawn = all.into_iter().filter_map(|(name, svg)| Some((name, svg?)));
    drawn.map(|(name, svg)| StaticFigure { name: name.into(), svg }).collect()
}

/// A picture of `size` units that holds `body`; `says` in words what it shows.
pub(in crate::lab::report) fn sheet([width, height]: [f64; 2], says: &str, body: &str) -> String {
    // Letters of the upright title lean out to the left.
    let width = width + 10.0;
    let [wide, high] = [width, height].map(|units| place(units / COLUMN * COLUMN_MM));
    let [width, height] = [width, height].map(place);
    on_white(&format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{wide}mm\" height=\"{high}mm\" \
         viewBox=\"-6 0 {width} {height}\" role=\"img\" aria-label=\"{}\"><style>{STYLE}</style>\
         <rect x=\"-6\" width=\"{width}\" height=\"{height}\" fill=\"#fff\"/>{body}</svg>\n",
        escape(says)
    ))
}

/// The head of a text that is too long for a key.
pub(super) fn short(text: &str) -> String {
    cut(text, 22)
}

fn cut(text: &str, most: usize) -> String {
    if text.chars().count() <= most {
        return text.into();
    }
    text.chars().take(most.saturating_sub(1)).chain(['…']).collect()
}

/// Marks of an axis at its values, as many as there is room for in `room` units.
pub(super) fn marks(levels: &Levels<'_>, room: f64) -> Vec<(f64, String)> {
    let Some(numbers) = &levels.numbers else {
        // A cast saturates: without a limit of room, the head of the text.
        let each = room / size(levels.texts.len().max(1));
        let most = ((each / wide(" ")) as usize).clamp(4, 22);
        let texts = levels.texts.iter().map(|text| cut(text, most));
        return (0..).map(size).zip(texts).collect();
    };
    let bend = |value: f64| if levels.log() { value.log10() } else { value };
    let (Some(&first), Some(&last)) = (numbers.first(), numbers.last()) else { return Vec::new() };
    let span = if last > first { bend(last) - bend(first) } else { 1.0 };
    let mut end = f64::NEG_INFINITY;
    let mut kept = Vec::new();
    for &number in numbers {
        let text = significant(number);
        let centre = (bend(number) - bend(first)) / span * room;
        if centre - 0.5 * wide(&text) >= end {
            end = centre + 0.5 * wide(&text) + 7.0;
            kept.push((number, text));
        }
    }
    kept
}
