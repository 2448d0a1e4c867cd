//! Heat maps: every cell of every pathway, target streams down, source streams across.

use super::{Figure, layer_heading, of_layer};
use crate::lab::report::chart::Chart;
use crate::lab::report::image::{Grid, indexed, pool};
use crate::lab::report::number::{escape, percent_of, ratio, size};
use crate::lab::report::{Heat, RunView, colour};

/// Longest side of an embedded map; shorter where many are embedded.
const SIDE_MAX: usize = 256;
const SIDE_MAX_OF_MANY: usize = 200;
const MANY: usize = 12;

pub(super) fn draw(view: &RunView<'_>) -> Option<Figure> {
    let side = if view.heats.len() > MANY { SIDE_MAX_OF_MANY } else { SIDE_MAX };
    let mut layers: Vec<usize> = view.heats.iter().map(|heat| heat.layer).collect();
    layers.sort_unstable();
    layers.dedup();
    let mut body = String::new();
    for layer in layers {
        let order = ["pp", "np", "pn", "nn"];
        let rank = |heat: &Heat| order.iter().position(|name| *name == heat.pathway);
        let mut heats: Vec<&Heat> = view.heats.iter().filter(|heat| heat.layer == layer).collect();
        heats.sort_by_key(|heat| rank(heat).unwrap_or(order.len()));
        let maps: Vec<(&Heat, Grid)> = heats
            .into_iter()
            .filter_map(|heat| Some((heat, pool(&heat.levels, heat.rows, heat.columns, side)?)))
            .collect();
        let top = brightest(&maps);
        let tiles: String = maps.iter().map(|(heat, grid)| tile(view, heat, grid, top)).collect();
        if !tiles.is_empty() {
            body += &format!(
                "<div class=\"layer\"><h3>{}</h3><div class=\"quad\">{tiles}</div>{}</div>",
                layer_heading(view, layer),
                bar(top)
            );
        }
    }
    if body.is_empty() {
        return None;
    }
    Some(Figure {
        id: "maps",
        title: "The cells",
        caption: "Each map is one unsigned crossbar: sources down, targets across. Large arrays are shown \
                  as means of blocks of cells. One colour scale a layer, on the square root of the level, \
                  ending at the 99.9th percentile."
            .into(),
        body: format!("<div class=\"layers\">{body}</div>"),
        wide: true,
    })
}

/// The value that ends the scale: nearly all cells lie below it.
fn brightest(maps: &[(&Heat, Grid)]) -> f64 {
    let mut values: Vec<f64> = maps.iter().flat_map(|(_, grid)| grid.values.clone()).collect();
    values.sort_by(f64::total_cmp);
    let at = values.len().saturating_sub(1 + values.len() / 1000);
    values.get(at).copied().unwrap_or(1.0).max(1.0)
}

fn tile(view: &RunView<'_>, heat: &Heat, grid: &Grid, top: f64) -> String {
    // where every cell has its pixel, the pixel is its level, for the script to read; blocks of cells get 64 shades: no eye
    // tells more, and the file is a quarter smaller
    let whole = (grid.height, grid.width) == (heat.rows, heat.columns) && view.level_max <= 255;
    let part = |value: f64| (value / top).clamp(0.0, 1.0).sqrt();
    let map = colour::levels();
    let shade = |value: &f64| {
        let shade = colour::byte(63.0 * part(*value));
        if whole { colour::byte(*value) } else { shade << 2 | shade >> 4 }
    };
    let own: colour::Palette =
        std::array::from_fn(|level| map[usize::from(colour::byte(255.0 * part(level as f64)))]);
    let indices: Vec<u8> = grid.values.iter().map(shade).collect();
    let palette = if whole { &own } else { &map };
    let Some(uri) = indexed(grid.width, grid.height, &indices, palette) else {
        return String::new();
    };
    let blocks = [(heat.rows, grid.height), (heat.columns, grid.width)];
    let [down, across] = blocks.map(|(cells, pixels)| cells.div_ceil(pixels));
    let read = format!(
        "{{&quot;rows&quot;:{},&quot;columns&quot;:{},&quot;down&quot;:{down},&quot;across&quot;:{across},&quot;top&quot;:{}}}",
        heat.rows,
        heat.columns,
        if whole { 0.0 } else { top }
    );
    let record = view
        .last()
        .and_then(|last| of_layer(last, heat.layer).find(|one| one.pathway == heat.pathway));
    let name = escape(&heat.pathway);
    let excites = record.is_none_or(|one| one.excites);
    let sign = if excites { "excites" } else { "inhibits" };
    let floor = record
        .map(|one| format!(" · {} on floor", percent_of(one.floor, one.cells, 1)))
        .unwrap_or_default();
    let route = match heat.pathway.as_bytes() {
        [source @ (b'p' | b'n'), target @ (b'p' | b'n')] => {
            format!("{}\u{202f}→\u{202f}{} ", char::from(*source), char::from(*target))
        }
        _ => String::new(),
    };
    let shape = (size(heat.columns) / size(heat.rows)).clamp(0.85, 1.6);
    // Large pixels keep their edges; small ones are left to the viewer's smoothing.
    let class = if grid.width.max(grid.height) <= 128 { "pixels" } else { "smooth" };
    format!(
        "<div class=\"map\"><div class=\"map-name\"><b class=\"swatch\" style=\"--hue:{}\">{name}</b> \
         {route}{sign}</div><img class=\"{class}\" style=\"aspect-ratio:{shape:.3}\" \
         data-map=\"{read}\" alt=\"Levels of pathway {name} of layer {}\" src=\"{uri}\"><div class=\"map-note\">{} × {}{floor}</div></div>",
        colour::pathway(&heat.pathway, excites),
        heat.layer,
        heat.rows,
        heat.columns
    )
}

/// The colour scale, with values at the places the square root gives them.
fn bar(top: f64) -> String {
    let ticks = [0.0, 0.05, 0.2, 0.5, 1.0].map(|part: f64| {
        let value = part * top;
        let text = if top < 10.0 { ratio(Some(value)) } else { format!("{value:.0}") };
        (part.sqrt(), text)
    });
    Chart::scale(&ticks, "level")
}
