//! Accuracy over epochs.

use super::{Figure, span};
use crate::lab::report::RunView;
use crate::lab::report::chart::{Chart, Series};
use crate::lab::report::number::percent;
use crate::lab::report::scale::Axis;
use crate::lab::store::record::Score;

pub(super) fn draw(view: &RunView<'_>) -> Option<Figure> {
    let (first, last) = span(view)?;
    let curve = |pick: fn(&crate::lab::store::record::EpochRecord) -> Option<Score>| {
        let scores = view.epochs.iter().filter_map(|record| {
            let score = pick(record).filter(|score| score.total > 0)?;
            Some((f64::from(record.epoch), 100.0 * score.fraction()))
        });
        scores.collect::<Vec<_>>()
    };
    let mut all = vec![
        Series::new("train", "var(--c)", curve(|record| record.train())).dashed(true),
        Series::new("validation", "var(--a)", curve(|record| record.validation())),
    ];
    if let Some(test) = view.receipt.classified() {
        let at = (f64::from(test.epoch), 100.0 * test.score.fraction());
        all.push(Series::new("test", "var(--b)", vec![at]).marked());
    }
    all.retain(|series| !series.points.is_empty());
    if all.is_empty() {
        return None;
    }

    // Chance level before learning would squeeze everything else: it goes into the caption.
    let learned = |point: &&(f64, f64)| point.0 > 0.0 || last == 0;
    let values = || all.iter().flat_map(|one| &one.points).filter(learned).map(|point| point.1);
    let low = values().fold(100.0, f64::min);
    let high = values().fold(0.0, f64::max);
    let mut from = first;
    if last > 0 && first == 0 {
        all.iter_mut().for_each(|one| one.points.retain(|point| point.0 > 0.0));
        from = view.epochs.iter().map(|record| record.epoch).find(|&epoch| epoch > 0).unwrap_or(0);
    }
    let room = ((high - low) * 0.08).max(0.2);
    let y = Axis::percent((low - room).max(0.0), (high + room).min(100.0), "accuracy");
    let mut chart = Chart::new(480.0, 500.0, 140.0, Axis::epochs(from, last), y);
    chart.series(&all, |value| format!("{value:.2}\u{202f}%"));

    let best = view
        .epochs
        .iter()
        .filter_map(|record| Some((record.validation().filter(|score| score.total > 0)?, record)))
        .min_by(|(a, _), (b, _)| b.fraction().total_cmp(&a.fraction()));
    let mut caption = match best {
        Some((score, record)) => format!(
            "Validation peaks at <b>{}</b> in epoch {}.",
            percent(score.fraction(), 2),
            record.epoch
        ),
        None => "No validation split.".into(),
    };
    let start = view.epochs.first().filter(|record| record.epoch == 0 && last > 0);
    if let Some(score) =
        start.and_then(|record| record.validation()).filter(|score| score.total > 0)
    {
        caption += &format!(" Before the first update it was {}.", percent(score.fraction(), 2));
    }
    caption += " Train: answers given while learning.";
    let body = chart.finish("Accuracy over epochs");
    Some(Figure { id: "accuracy", title: "Accuracy", caption, body, wide: false })
}
