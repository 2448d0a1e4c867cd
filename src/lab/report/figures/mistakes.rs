//! Wrong answers, drawn.

use super::Figure;
use crate::lab::report::image::{grey, rgb};
use crate::lab::report::number::escape;
use crate::lab::report::{Picture, RunView, colour};

/// Pictures drawn at most.
const PICTURES_MAX: usize = 48;

pub(super) fn draw(view: &RunView<'_>) -> Option<Figure> {
    let tiles = view.pictures.iter().take(PICTURES_MAX).filter_map(|picture| {
        let (truth, guess) = (view.class(picture.truth), view.class(picture.guess));
        let (truth, guess) = (escape(&truth), escape(&guess));
        Some(format!(
            "<div class=\"mistake\"><img class=\"pixels\" alt=\"Example {0}: {truth} taken for {guess}\" \
             src=\"{1}\"><div><span class=\"right\">{truth}</span> → <span class=\"wrong\">{guess}</span>\
             </div><small>#{0}</small></div>",
            picture.example,
            uri(picture)?
        ))
    });
    let tiles: String = tiles.collect();
    if tiles.is_empty() {
        return None;
    }
    Some(Figure {
        id: "mistakes",
        title: "Wrong answers",
        caption: "Test examples answered wrongly with the greatest margin: \
                  <span class=\"right\">true class</span> → <span class=\"wrong\">answer</span>, and the \
                  number of the example."
            .into(),
        body: format!("<div class=\"mistakes\">{tiles}</div>"),
        wide: true,
    })
}

fn uri(picture: &Picture) -> Option<String> {
    let pixels = picture.height.checked_mul(picture.width)?;
    if picture.values.len() != pixels.checked_mul(picture.channels)? || picture.full_scale == 0 {
        return None;
    }
    let bright = |value: u8| colour::byte(255.0 * f64::from(value) / f64::from(picture.full_scale));
    match picture.channels {
        3 => {
            let planes =
                |pixel| [0, 1, 2].map(|plane| bright(picture.values[plane * pixels + pixel]));
            let values: Vec<u8> = (0..pixels).flat_map(planes).collect();
            rgb(picture.width, picture.height, &values)
        }
        _ => {
            let values: Vec<u8> = picture.values.iter().take(pixels).map(|&v| bright(v)).collect();
            grey(picture.width, picture.height, &values)
        }
    }
}
