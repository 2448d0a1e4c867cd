//! Wrong answers, drawn: those of the most frequent confusions together, then the others.

use super::Figure;
use super::confusion::pair;
use crate::lab::report::image::{grey, rgb};
use crate::lab::report::number::{count, escape, percent_of};
use crate::lab::report::{Picture, RunView, colour};

/// Confusions drawn together.
const PAIRS: usize = 6;
/// Pictures of each.
const EACH: usize = 4;
/// Other pictures drawn at most: a row, or more where there are no confusions to draw.
const OTHERS: [usize; 2] = [12, 36];

pub(super) fn draw(view: &RunView<'_>) -> Option<Figure> {
    let confusions = view.receipt.classified().map(|test| test.confusions()).unwrap_or_default();
    let mut drawn: Vec<u64> = Vec::new();
    let mut pairs = String::new();
    let mut of_pairs = 0;
    for (n, truth, guess) in confusions.into_iter().take(PAIRS) {
        let of_class = view
            .receipt
            .classified()
            .into_iter()
            .flat_map(|test| test.confusion.get(truth))
            .flatten();
        let of_class: u64 = of_class.sum();
        let (truth, guess) = (truth as u64, guess as u64);
        let of_pair = view.pictures.iter().filter(|p| p.truth == truth && p.guess == guess);
        let mut tiles = String::new();
        for picture in of_pair.take(EACH) {
            tiles += &tile(view, picture, "").unwrap_or_default();
            drawn.push(picture.example);
        }
        if !tiles.is_empty() {
            of_pairs += 1;
            pairs += &format!(
                "<div class=\"pair\"><div class=\"pair-name\">{}<small>{} of {}, {}</small></div>{tiles}</div>",
                pair(view, truth, guess),
                count(n),
                count(of_class),
                percent_of(n, of_class, 1)
            );
        }
    }
    let others = view.pictures.iter().filter(|picture| !drawn.contains(&picture.example));
    let others: String = others
        .take(OTHERS[usize::from(pairs.is_empty())])
        .filter_map(|picture| tile(view, picture, &pair(view, picture.truth, picture.guess)))
        .collect();
    if pairs.is_empty() && others.is_empty() {
        return None;
    }
    let mut body = String::new();
    if !pairs.is_empty() {
        let most = match of_pairs {
            1 => "The most frequent confusion".into(),
            n => format!("The {n} most frequent confusions"),
        };
        body += &format!("<h3>{most}</h3><div class=\"pair-grid\">{pairs}</div>");
    }
    if !others.is_empty() {
        let heading = if pairs.is_empty() { "" } else { "<h3>Others</h3>" };
        body += &format!("{heading}<div class=\"mistakes\">{others}</div>");
    }
    Some(Figure {
        id: "mistakes",
        title: "Wrong answers",
        caption: "Test examples, <span class=\"right\">true class</span> → <span class=\"wrong\">answer</span>, with \
                  the number of the example. Of all wrong answers, those given with the greatest margin over the true \
                  class."
            .into(),
        body,
        wide: true,
    })
}

fn tile(view: &RunView<'_>, picture: &Picture, name: &str) -> Option<String> {
    let (truth, guess) = (view.class(picture.truth), view.class(picture.guess));
    let (truth, guess) = (escape(&truth), escape(&guess));
    Some(format!(
        "<div class=\"mistake\"><img class=\"pixels\" alt=\"Example {0}: {truth} taken for {guess}\" \
         src=\"{1}\">{name} <small>#{0}</small></div>",
        picture.example,
        uri(picture)?
    ))
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
