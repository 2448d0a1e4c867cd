//! Receptive fields, or filters of a convolution: what the p stream of the first layer listens to, `pp - np` of one column,
//! as an image.

use super::Figure;
use crate::lab::report::image::indexed;
use crate::lab::report::number::place;
use crate::lab::report::{Heat, RunView, Sight, colour};

/// Fields drawn at most.
const FIELDS_MAX: usize = 40;
/// Longest side of a field.
const SIDE_MAX: usize = 96;

pub(super) fn draw(view: &RunView<'_>) -> Option<Figure> {
    let first = view.heats.iter().map(|heat| heat.layer).min()?;
    let find =
        |name: &str| view.heats.iter().find(|heat| heat.layer == first && heat.pathway == name);
    if find("pp_i").is_some() {
        // a field of four arrays
        return None;
    }
    let (plus, minus, formula) = match (find("pp"), find("np")) {
        (Some(plus), Some(minus)) => (plus, minus, "pp − np"),
        _ => (find("e")?, find("i")?, "e − i"),
    };
    let cells = plus.rows.checked_mul(plus.columns)?;
    let sizes = [plus.levels.len(), minus.levels.len(), minus.rows * minus.columns];
    if plus.columns == 0 || sizes.iter().any(|&size| size != cells) {
        return None;
    }
    let (fields, [height, width]): (Vec<Vec<f64>>, _) = match view.window {
        Some(window) => {
            let fits = plus.rows.checked_sub(window.side * window.side * window.channels)?;
            if fits > 1 || window.side > SIDE_MAX {
                return None;
            }
            let size = [window.side, (window.side + 1) * window.colours() - 1];
            ((0..plus.columns).map(|column| filter(plus, minus, column, window)).collect(), size)
        }
        None => {
            let shape = shape(view, plus)?;
            let of = |column| field(plus, minus, column, shape);
            ((0..plus.columns).map(of).collect(), [shape.height, shape.width])
        }
    };

    // The strongest units, in the order of their columns.
    let strength = |field: &[f64]| field.iter().map(|value| value.abs()).sum::<f64>();
    let mut units: Vec<usize> = (0..fields.len()).collect();
    units.sort_by(|&a, &b| strength(&fields[b]).total_cmp(&strength(&fields[a])).then(a.cmp(&b)));
    units.truncate(FIELDS_MAX);
    units.sort_unstable();

    let palette = colour::signed();
    let tiles = units.iter().filter_map(|&unit| {
        let field = &fields[unit];
        let peak = field.iter().fold(0.0f64, |peak, value| peak.max(value.abs())).max(1.0);
        let indices: Vec<u8> =
            field.iter().map(|value| colour::signed_index(value / peak)).collect();
        let uri = indexed(width, height, &indices, &palette)?;
        Some(format!(
            "<div class=\"field\" data-tip=\"unit {unit}&#10;strongest difference {} levels\"><img \
             class=\"pixels\" alt=\"Receptive field of unit {unit}\" src=\"{uri}\"><span>{unit}</span></div>",
            place(peak)
        ))
    });
    let tiles: String = tiles.collect();
    let which = if fields.len() > FIELDS_MAX {
        format!("the {FIELDS_MAX} strongest of {} units", fields.len())
    } else {
        "all units".into()
    };
    let laid = match view.window {
        Some(window) => format!(
            "its windows of {height} × {height} pixels{}{}",
            if window.colours() > 1 { ", channel beside channel" } else { "" },
            if window.halves { ", what lies above the middle less what lies below" } else { "" }
        ),
        None => format!("rows laid out as {height} × {width} images"),
    };
    Some(Figure {
        id: "fields",
        title: if view.window.is_some() { "Filters" } else { "Receptive fields" },
        caption: format!(
            "Net effect {formula} of the inputs on {which} of the first layer, {laid}. <b class=\"swatch\" style=\"--hue:var(--pp)\">blue</b> excites, \
             <b class=\"swatch\" style=\"--hue:var(--np)\">orange</b> inhibits; each field has its own scale."
        ),
        body: format!("<div class=\"fields\">{tiles}</div>"),
        wide: true,
    })
}

/// How the rows of the first layer lie in an image.
#[derive(Clone, Copy)]
struct Shape {
    height: usize,
    width: usize,
    channels: usize,
}

/// The shape of the pictures, or else a square; one more row may carry a bias.
fn shape(view: &RunView<'_>, heat: &Heat) -> Option<Shape> {
    let fits = |shape: &Shape| {
        let pixels = shape.height * shape.width * shape.channels;
        pixels > 0
            && (heat.rows == pixels || heat.rows == pixels + 1)
            && (3..=SIDE_MAX).contains(&shape.height)
            && (3..=SIDE_MAX).contains(&shape.width)
    };
    if let Some(picture) = view.pictures.first() {
        let (height, width, channels) = (picture.height, picture.width, picture.channels);
        return Some(Shape { height, width, channels }).filter(fits);
    }
    [1, 3].into_iter().find_map(|channels| {
        let side = (heat.rows / channels).isqrt();
        let whole = side * side * channels == heat.rows;
        Some(Shape { height: side, width: side, channels }).filter(|shape| whole && fits(shape))
    })
}

/// One column as an image, channels averaged.
fn field(plus: &Heat, minus: &Heat, column: usize, shape: Shape) -> Vec<f64> {
    let pixels = shape.height * shape.width;
    let net = |row: usize| {
        let cell = row * plus.columns + column;
        f64::from(plus.levels[cell]) - f64::from(minus.levels[cell])
    };
    let of_pixel = |pixel: usize| {
        let sum: f64 = (0..shape.channels).map(|channel| net(channel * pixels + pixel)).sum();
        sum / shape.channels as f64
    };
    (0..pixels).map(of_pixel).collect()
}

impl Sight {
    /// Channels that are drawn: halves are one.
    const fn colours(self) -> usize {
        if self.halves { self.channels / 2 } else { self.channels }
    }
}

/// One column of a window as an image: its channels beside one another, a column of nothing between.
fn filter(plus: &Heat, minus: &Heat, column: usize, window: Sight) -> Vec<f64> {
    let net = |row: usize| {
        let cell = row * plus.columns + column;
        f64::from(plus.levels[cell]) - f64::from(minus.levels[cell])
    };
    let of = |y: usize, x: usize, colour: usize| {
        let row = (y * window.side + x) * window.channels + colour;
        if window.halves { net(row) - net(row + window.colours()) } else { net(row) }
    };
    let mut pixels = Vec::new();
    for y in 0..window.side {
        for colour in 0..window.colours() {
            pixels.extend((colour > 0).then_some(0.0));
            pixels.extend((0..window.side).map(|x| of(y, x, colour)));
        }
    }
    pixels
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Level of a row of one column: 10 times its number, in a window of 2 x 2 pixels of two colours and their halves.
    #[test]
    fn a_filter_lies_pixel_by_pixel_with_its_channels_side_by_side() {
        let heat = |levels: Vec<u16>| Heat {
            layer: 0,
            pathway: "pp".into(),
            rows: 16,
            columns: 1,
            levels,
        };
        let (plus, minus) = (heat((0..16).map(|row| 10 * row).collect()), heat(vec![1; 16]));
        let window = Sight { side: 2, channels: 4, halves: false };
        let whole = filter(&plus, &minus, 0, window);
        assert_eq!(whole[..6], [-1.0, 39.0, 0.0, 9.0, 49.0, 0.0]);
        assert_eq!(whole.len(), 2 * (2 * 4 + 3));
        let halves = filter(&plus, &minus, 0, Sight { halves: true, ..window });
        // every second half of a pixel's channels lies 20 levels higher
        assert_eq!(halves, [-20.0, -20.0, 0.0, -20.0, -20.0, -20.0, -20.0, 0.0, -20.0, -20.0]);
    }
}
