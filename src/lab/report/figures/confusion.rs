//! Confusion matrix: numbers for few classes, an image for many.

use super::Figure;
use crate::lab::report::chart::Chart;
use crate::lab::report::image::indexed;
use crate::lab::report::number::{count, escape, percent_of, quotient, size};
use crate::lab::report::scale::Axis;
use crate::lab::report::{RunView, colour};

/// Above this many classes the counts no longer fit into their squares.
const CLASSES_WRITTEN: usize = 20;
/// Confusions named below the matrix.
const NAMED: usize = 6;

pub(super) fn draw(view: &RunView<'_>) -> Option<Figure> {
    let matrix = &view.receipt.classified()?.confusion;
    let classes = matrix.len();
    if classes == 0 || matrix.iter().any(|row| row.len() != classes) {
        return None;
    }
    let drawing = if classes <= CLASSES_WRITTEN { squares(view, matrix) } else { image(matrix)? };
    let test = view.receipt.classified()?;
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
    let name = |class: usize| short_name(&view.class(class as u64));
    // the first class lies on top
    let down = |class: usize| size(classes - 1 - class);
    let frame = |side: [f64; 2]| {
        let x = (0..classes).map(|class| (size(class), name(class))).collect();
        let y = (0..classes).map(|class| (down(class), name(class))).collect();
        let axes = [(x, "answer"), (y, "true class")]
            .map(|(names, label)| Axis::cells(classes, names, label));
        let [x, y] = axes;
        Chart::framed(side, [22.0, 62.0], x, y)
    };
    let (wide, high) = frame([SIDE; 2]).inside();
    let cell = (wide / size(classes)).min(96.0);
    let grown = |inside: f64| SIDE - inside + cell * size(classes);
    let mut chart = frame([grown(wide), grown(high)]);
    let font = (cell * 0.36).clamp(7.5, 15.0);
    let reach = 0.5 - 1.0 / cell;
    let shades = shades(matrix);
    for (truth, row) in matrix.iter().enumerate() {
        let of_class: u64 = row.iter().sum();
        for (guess, &n) in row.iter().enumerate() {
            let (x, y, shade) = (size(guess), down(truth), shades[truth][guess]);
            let tip = format!(
                "true {}\nanswered {}\n{n} of {of_class} ({})",
                view.class(truth as u64),
                view.class(guess as u64),
                percent_of(n, of_class, 1)
            );
            let hue = if truth == guess { "var(--pp)" } else { "var(--np)" };
            chart.bar((x - reach, x + reach), (y - reach, y + reach), (hue, shade), &tip);
            if n > 0 {
                let ink = if truth == guess && shade > 0.55 { "#fff" } else { "var(--ink)" };
                chart.words((x, y), ink, font, &n.to_string());
            }
        }
    }
    let recall = |(truth, row): (usize, &Vec<u64>)| {
        (down(truth), percent_of(row[truth], row.iter().sum(), 1))
    };
    chart.beside("recall", matrix.iter().enumerate().map(recall));
    chart.finish("Confusion matrix")
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
