//! The map of colours, and the values that its places stand for.

use super::{leaning, wide};
use crate::lab::report::colour;
use crate::lab::report::number::{escape, place, size};

/// The colours at `[x, y]`, `[wide, high]` units large: upright where higher than wide. Ticks lie between 0 and 1.
pub(in crate::lab::report) fn ramp(
    [x, y]: [f64; 2],
    [across, high]: [f64; 2],
    ticks: &[(f64, String)],
    title: &str,
    steps: Option<usize>,
) -> String {
    let upright = high > across;
    let colours = colour::ramp();
    let stop =
        |part: f64, colour: &str| format!("<stop offset=\"{part:.3}\" stop-color=\"{colour}\"/>");
    let stops: String = match steps {
        None => {
            let part = |at| size(at) / size(colours.len() - 1);
            colours.iter().enumerate().map(|(at, colour)| stop(part(at), colour)).collect()
        }
        Some(steps) => {
            let palette = colour::levels();
            let both = |at: usize| {
                let [from, to] = [at, at + 1].map(|at| size(at) / size(steps));
                let [red, green, blue, _] = palette[usize::from(colour::byte(127.5 * (from + to)))];
                let colour = format!("#{red:02x}{green:02x}{blue:02x}");
                [stop(from, &colour), stop(to, &colour)].concat()
            };
            (0..steps).map(both).collect()
        }
    };
    // one for each scale of a page: a colour that is hidden elsewhere would be hidden here too
    let id: String = title.chars().filter(char::is_ascii_alphanumeric).collect();
    let way = if upright { "x2=\"0\" y1=\"1\"" } else { "" };
    let mut out = format!(
        "<linearGradient id=\"ramp-{id}\" {way}>{stops}</linearGradient><rect x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\" \
         fill=\"url(#ramp-{id})\"/>",
        place(x),
        place(y),
        place(across),
        place(high)
    );
    for (part, text) in ticks {
        let (class, x, y) = if upright {
            ("tick", x + across + 5.0, y + high * (1.0 - part) + 4.0)
        } else {
            ("tick middle", x + across * part, y + high + 16.0)
        };
        let (x, y, text) = (place(x), place(y), escape(text));
        out += &format!("<text class=\"{class}\" x=\"{x}\" y=\"{y}\">{text}</text>");
    }
    if upright {
        let widest = ticks.iter().map(|(_, text)| wide(text)).fold(0.0, f64::max);
        let at = (x + across + widest + 22.0, y + 0.5 * high);
        out += &leaning("label middle", at, -90, title);
    } else {
        let (x, y, title) = (place(x + 0.5 * across), place(y + high + 31.0), escape(title));
        out += &format!("<text class=\"label middle\" x=\"{x}\" y=\"{y}\">{title}</text>");
    }
    out
}

impl super::Chart {
    /// Nothing but the colours, as a picture of its own.
    pub(in crate::lab::report) fn scale(ticks: &[(f64, String)], title: &str) -> String {
        const WIDTH: f64 = 420.0;
        format!(
            "<svg class=\"chart bar\" viewBox=\"0 0 {WIDTH} 48\" role=\"img\" aria-label=\"Colour scale: {}\">{}</svg>",
            escape(title),
            ramp([10.0, 2.0], [WIDTH - 20.0, 12.0], ticks, title, None)
        )
    }
}
