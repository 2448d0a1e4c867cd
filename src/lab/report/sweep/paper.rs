//! Figures for papers: what the page shows at first, as stand-alone SVG on white, a column (90 mm) or a page (180 mm) wide.

use super::settings::Settings;
use super::{SweepView, curves, heat, pareto};
use crate::lab::report::number::{escape, place, significant};
use crate::lab::table::Unit;

/// Units of drawing across a column of a paper, and millimetres.
pub(super) const COLUMN: f64 = 480.0;
const COLUMN_MM: f64 = 90.0;

/// Dark enough on white, and apart for every kind of colour vision (Okabe and Ito).
const HUES: [&str; 8] =
    ["#0072b2", "#d55e00", "#009e73", "#b5508b", "#56b4e9", "#b88a00", "#5d6b7a", "#131a22"];
pub(super) const INK: &str = "#131a22";

const STYLE: &str = "svg.paper text{font-family:sans-serif;font-size:13px;fill:#3a4450}\
    svg.paper .label{fill:#131a22;font-size:14px}svg.paper .heading{fill:#131a22;font-weight:bold}\
    svg.paper .middle{text-anchor:middle}svg.paper .end{text-anchor:end}\
    svg.paper .grid{stroke:#e4e8ec;stroke-width:1}svg.paper .axis{stroke:#56616f;stroke-width:1}";

/// A figure as a file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct StaticFigure {
    /// What it shows: `curves`, `heat`, `pareto`.
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
    ];
    let drawn = all.into_iter().filter_map(|(name, svg)| Some((name, svg?)));
    drawn.map(|(name, svg)| StaticFigure { name: name.into(), svg }).collect()
}

/// A picture of `size` units that holds `body`; `says` in words what it shows.
pub(super) fn sheet([width, height]: [f64; 2], says: &str, body: &str) -> String {
    // Letters of the upright title lean out to the left.
    let width = width + 10.0;
    let [wide, high] = [width, height].map(|units| place(units / COLUMN * COLUMN_MM));
    let [width, height] = [width, height].map(place);
    format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" class=\"paper\" width=\"{wide}mm\" height=\"{high}mm\" \
         viewBox=\"-6 0 {width} {height}\" role=\"img\" aria-label=\"{}\"><style>{STYLE}</style>\
         <rect x=\"-6\" width=\"{width}\" height=\"{height}\" fill=\"#fff\"/>{body}</svg>\n",
        escape(says)
    )
}

/// The colour of a curve.
pub(super) fn hue(number: usize) -> &'static str {
    HUES[number % HUES.len()]
}

/// Units that text of class `tick` takes, about.
pub(super) fn wide(text: &str) -> f64 {
    7.0 * crate::lab::report::number::size(text.chars().count())
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

/// How numbers are drawn: times `by`, in units of `sign`.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Drawn {
    pub by: f64,
    pub sign: String,
}

impl Drawn {
    /// Such that the greatest has few digits.
    pub(super) fn new(unit: Unit, greatest: f64) -> Self {
        const PREFIXES: [&str; 12] = ["a", "f", "p", "n", "µ", "m", "", "k", "M", "G", "T", "P"];
        let same = Self { by: 1.0, sign: unit.sign().into() };
        let thousands = (greatest.abs().log10() / 3.0 + 1e-12).floor();
        match unit {
            Unit::Plain => same,
            Unit::Fraction => Self { by: 100.0, ..same },
            _ if !thousands.is_finite() => same,
            Unit::Seconds | Unit::Joules => {
                let thousands = thousands.clamp(-6.0, 5.0);
                let prefix = PREFIXES[(thousands + 6.0) as usize];
                Self { by: 1000f64.powf(-thousands), sign: format!("{prefix}{}", unit.sign()) }
            }
            _ if greatest.abs() < 1e5 => same,
            Unit::Count | Unit::Cycles => {
                let name = match thousands as u8 {
                    0 | 1 => "thousands",
                    2 => "millions",
                    3 => "billions",
                    _ => return same,
                };
                Self { by: 1000f64.powf(-thousands), sign: name.into() }
            }
        }
    }

    /// A label with its unit.
    pub(super) fn title(&self, label: &str) -> String {
        if self.sign.is_empty() { label.into() } else { format!("{label} ({})", self.sign) }
    }
}

/// Marks of an axis at its values, as many as there is room for in `room` units.
pub(super) fn marks(levels: &super::settings::Levels<'_>, room: f64) -> Vec<(f64, String)> {
    let Some(numbers) = &levels.numbers else {
        // A cast saturates: without a limit of room, the head of the text.
        let each = room / crate::lab::report::number::size(levels.texts.len().max(1));
        let most = ((each / wide(" ")) as usize).clamp(4, 22);
        let texts = levels.texts.iter().map(|text| cut(text, most));
        return (0..).map(crate::lab::report::number::size).zip(texts).collect();
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
