//! Confusion matrix: numbers for few classes, an image for many.

use std::fmt::Write as _;

use super::Figure;
use crate::lab::report::image::indexed;
use crate::lab::report::number::{count, escape, percent_of, place, quotient, size};
use crate::lab::report::{RunView, colour};

/// Above this many classes the counts no longer fit into their squares.
const CLASSES_WRITTEN: usize = 20;
/// Confusions named below the matrix.
const NAMED: usize = 6;

pub(super) fn draw(view: &RunView<'_>) -> Option<Figure> {
    let matrix = &view.receipt.test.as_ref()?.confusion;
    let classes = matrix.len();
    if classes == 0 || matrix.iter().any(|row| row.len() != classes) {
        return None;
    }
    let drawing = if classes <= CLASSES_WRITTEN { squares(view, matrix) } else { image(matrix)? };
    let test = view.receipt.test.as_ref()?;
    let most: String = test
        .confusions()
        .into_iter()
        .take(NAMED)
        .map(|(n, truth, guess)| {
            let of_class: u64 = matrix[truth].iter().sum();
            format!(
                "<li>{} <small>{n} of {}, {}</small></li>",
                pair(view, truth as u64, guess as u64),
                count(of_class),
                percent_of(n, of_class, 1)
            )
        })
        .collect();
    let most = if most.is_empty() {
        "<p>No wrong answer.</p>".into()
    } else {
        format!("<h4>Most often taken for another</h4><ol class=\"pairs\">{most}</ol>")
    };
    Some(Figure {
        id: "confusion",
        title: "Confusion matrix",
        caption:
            "Test set. Blue: share of the true class. Orange: mistakes, compared with the most \
                  frequent one."
                .into(),
        body: drawing + most.as_str(),
        wide: false,
    })
}

/// A confusion in words: true class, then the answer.
pub(super) fn pair(view: &RunView<'_>, truth: u64, guess: u64) -> String {
    format!(
        "<b><span class=\"right\">{}</span> → <span class=\"wrong\">{}</span></b>",
        escape(&view.class(truth)),
        escape(&view.class(guess))
    )
}

fn squares(view: &RunView<'_>, matrix: &[Vec<u64>]) -> String {
    const SIDE: f64 = 490.0;
    let classes = matrix.len();
    let names: Vec<String> =
        (0..classes).map(|class| short_name(&view.class(class as u64))).collect();
    let longest = names.iter().map(|name| name.chars().count()).max().unwrap_or(1);
    let upright = longest <= 4 || classes <= 4;
    let left = 32.0 + 7.0 * size(longest);
    let bottom = if upright { 42.0 } else { 30.0 + 5.6 * size(longest) };
    let right = 52.0;
    let cell = ((SIDE - left - right) / size(classes)).min(96.0);
    let top = 22.0;
    let (wide, high) = (left + right + cell * size(classes), top + bottom + cell * size(classes));
    let font = (cell * 0.36).clamp(7.5, 15.0);
    let at = |class: usize, start: f64| start + cell * (size(class) + 0.5);
    let shades = shades(matrix);
    let mut out = String::new();
    for (truth, row) in matrix.iter().enumerate() {
        let of_class: u64 = row.iter().sum();
        for (guess, &n) in row.iter().enumerate() {
            let hue = if truth == guess { "var(--pp)" } else { "var(--np)" };
            let shade = shades[truth][guess];
            let (x, y) = (left + cell * size(guess), top + cell * size(truth));
            let tip = format!(
                "true {}\nanswered {}\n{n} of {of_class} ({})",
                view.class(truth as u64),
                view.class(guess as u64),
                percent_of(n, of_class, 1)
            );
            let _ = write!(
                out,
                "<rect class=\"square\" x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\" \
                 style=\"fill:{hue};fill-opacity:{shade:.3}\" data-tip=\"{}\"/>",
                place(x + 1.0),
                place(y + 1.0),
                place(cell - 2.0),
                place(cell - 2.0),
                escape(&tip).replace('\n', "&#10;")
            );
            if n > 0 {
                let class = if truth == guess && shade > 0.55 { "on" } else { "off" };
                let _ = write!(
                    out,
                    "<text class=\"count middle {class}\" style=\"font-size:{font:.1}px\" x=\"{}\" \
                     y=\"{}\">{n}</text>",
                    place(at(guess, left)),
                    place(at(truth, top) + font * 0.36)
                );
            }
        }
        let (x, y) = (place(left - 8.0), place(at(truth, top) + 4.0));
        let _ = write!(
            out,
            "<text class=\"tick end\" x=\"{x}\" y=\"{y}\">{}</text><text class=\"tick\" x=\"{}\" \
             y=\"{y}\">{}</text>",
            escape(&names[truth]),
            place(wide - right + 6.0),
            percent_of(row[truth], of_class, 1)
        );
        let (x, y) = (at(truth, left), top + cell * size(classes) + 17.0);
        let name = escape(&names[truth]);
        let _ = if upright {
            let (x, y) = (place(x), place(y));
            write!(out, "<text class=\"tick middle\" x=\"{x}\" y=\"{y}\">{name}</text>")
        } else {
            let (x, y) = (place(x + 4.0), place(y - 4.0));
            let turn = format!("translate({x} {y}) rotate(-45)");
            write!(out, "<text class=\"tick end\" transform=\"{turn}\">{name}</text>")
        };
    }
    let middle = place(top + cell * size(classes) / 2.0);
    format!(
        "<svg class=\"chart\" viewBox=\"0 0 {} {}\" style=\"max-width:{}px\" role=\"img\" \
         aria-label=\"Confusion matrix\">{out}<text class=\"label middle\" x=\"{}\" y=\"{}\">answer</text>\
         <text class=\"label middle\" transform=\"translate(12 {middle}) rotate(-90)\">true class</text>\
         <text class=\"label end\" x=\"{}\" y=\"14\">recall</text></svg>",
        place(wide),
        place(high),
        place(wide * 1.15),
        place(left + cell * size(classes) / 2.0),
        place(high - 4.0),
        place(wide - 4.0)
    )
}

/// How strongly each square is coloured, 0 to 1: right answers by the share of their class, wrong ones on a
/// square root that ends at the most frequent confusion.
fn shades(matrix: &[Vec<u64>]) -> Vec<Vec<f64>> {
    let share = |row: &[u64], n: u64| quotient(n, row.iter().sum()).unwrap_or(0.0);
    let wrong = matrix.iter().enumerate().flat_map(|(truth, row)| {
        let others = row.iter().enumerate().filter(move |&(guess, _)| guess != truth);
        others.map(move |(_, &n)| share(row, n))
    });
    let most = wrong.fold(0.0, f64::max).max(f64::MIN_POSITIVE);
    let of_row = |(truth, row): (usize, &Vec<u64>)| {
        let shade = |(guess, &n): (usize, &u64)| {
            let share = share(row, n);
            if guess == truth { 0.92 * share } else { 0.7 * (share / most).sqrt() }
        };
        row.iter().enumerate().map(shade).collect()
    };
    matrix.iter().enumerate().map(of_row).collect()
}

fn image(matrix: &[Vec<u64>]) -> Option<String> {
    let classes = matrix.len();
    let mut indices = Vec::with_capacity(classes * classes);
    for (truth, row) in shades(matrix).iter().enumerate() {
        for (guess, shade) in row.iter().enumerate() {
            let shade = colour::byte(127.0 * shade);
            indices.push(if truth == guess { shade } else { 128 + shade });
        }
    }
    let uri = indexed(classes, classes, &indices, &colour::answers())?;
    Some(format!(
        "<div class=\"map\"><div class=\"map-note\">true class down, answer across: {classes} × {classes}\
         </div><img class=\"pixels\" style=\"aspect-ratio:1\" alt=\"Confusion matrix\" src=\"{uri}\"></div>"
    ))
}

fn short_name(name: &str) -> String {
    if name.chars().count() <= 12 {
        return name.into();
    }
    name.chars().take(11).chain(['…']).collect()
}
