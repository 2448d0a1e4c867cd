//! The figures of the page, in order. To add one: write a small file here, add one line to [`ALL`].

mod absent;
mod accuracy;
mod balance;
mod configuration;
mod confusion;
mod energy;
mod episode;
mod fields;
mod floor;
mod heat;
mod histogram;
mod inputs;
mod losses;
mod mistakes;
mod pathways;
mod returns;
mod saturation;
mod time;
mod timelines;
mod turnover;
mod wear;
mod writes;

use super::number::float;
use super::{RunView, colour};
use crate::lab::store::record::EpochRecord;
use crate::learn::statistics::PathwayRecord;

/// One figure: markup without its frame.
#[derive(Debug)]
pub(super) struct Figure {
    /// Anchor on the page.
    pub id: &'static str,
    /// Heading.
    pub title: &'static str,
    /// What to see, in a sentence or two; markup.
    pub caption: String,
    /// The drawing; markup.
    pub body: String,
    /// Whether it takes the whole width of the page.
    pub wide: bool,
}

/// Draws a figure, or nothing where the run has nothing to show.
pub(super) type Draw = for<'a, 'b> fn(&'a RunView<'b>) -> Option<Figure>;

/// The task that a figure belongs to; `None`: to all.
type Of = Option<&'static str>;

/// Figures of classification.
const CLASSIFY: Of = Some("classify");

/// Figures of policies.
const POLICY: Of = Some("policy");

/// All figures, in the order of the page, each with the task that it belongs to.
pub(super) const ALL: [(Of, Draw); 19] = [
    (CLASSIFY, accuracy::draw),
    (CLASSIFY, confusion::draw),
    (CLASSIFY, mistakes::draw),
    (POLICY, returns::draw),
    (POLICY, losses::draw),
    (POLICY, inputs::draw),
    (POLICY, episode::draw),
    (None, timelines::draw),
    (None, histogram::draw),
    (CLASSIFY, fields::draw),
    (None, heat::draw),
    (None, writes::draw),
    (None, wear::draw),
    (None, saturation::draw),
    (None, time::draw),
    (None, energy::draw),
    (None, pathways::draw),
    (None, absent::draw),
    (None, configuration::draw),
];

/// The figures of a run.
pub(super) fn of(view: &RunView<'_>) -> impl Iterator<Item = Figure> {
    let task = view.last().map(|record| record.outcome.task());
    let belongs = move |of: &Of| of.is_none_or(|of| task.is_none_or(|task| task == of));
    ALL.iter().filter(move |(of, _)| belongs(of)).filter_map(move |(_, draw)| draw(view))
}

/// Pathways of one layer in one record.
fn of_layer(record: &EpochRecord, layer: usize) -> impl Iterator<Item = &PathwayRecord> {
    record.pathways.iter().filter(move |pathway| pathway.layer == layer)
}

/// The same pathway in another record.
fn same<'a>(record: &'a EpochRecord, pathway: &PathwayRecord) -> Option<&'a PathwayRecord> {
    of_layer(record, pathway.layer).find(|other| other.pathway == pathway.pathway)
}

/// The colour of a pathway.
fn hue(pathway: &PathwayRecord) -> &'static str {
    colour::pathway(&pathway.pathway, pathway.excites)
}

/// Ledger total of a phase and event at the end of an epoch.
fn total(record: &EpochRecord, phase: &str, event: &str) -> u64 {
    record.events.get(phase).and_then(|events| events.get(event)).copied().unwrap_or(0)
}

/// What happened in each epoch: differences of the running totals.
fn per_epoch(view: &RunView<'_>, phase: &str, event: &str) -> Vec<(f64, u64)> {
    let pairs = view.epochs.windows(2);
    let difference = |pair: &[EpochRecord]| {
        let count = total(&pair[1], phase, event).saturating_sub(total(&pair[0], phase, event));
        (f64::from(pair[1].epoch), count)
    };
    pairs.map(difference).collect()
}

/// First and last epoch on record.
fn span(view: &RunView<'_>) -> Option<(u32, u32)> {
    Some((view.epochs.first()?.epoch, view.epochs.last()?.epoch))
}

/// `Layer 0 <small>784 → 512</small>`.
fn layer_heading(view: &RunView<'_>, layer: usize) -> String {
    let shape = view.last().and_then(|last| of_layer(last, layer).next()).map(|one| one.shape);
    match shape {
        Some([rows, columns]) => {
            format!("Layer {layer} <small>{rows}\u{202f}→\u{202f}{columns}</small>")
        }
        None => format!("Layer {layer}"),
    }
}

/// Percent of counts, 0 of nothing: for drawing, never for print.
fn drawn_percent(part: u64, whole: u64) -> f64 {
    if whole == 0 { 0.0 } else { 100.0 * float(part) / float(whole) }
}

/// A pathway's name in its colour.
fn swatch(pathway: &PathwayRecord) -> String {
    let name = super::number::escape(&pathway.pathway);
    format!("<b class=\"swatch\" style=\"--hue:{}\">{name}</b>", hue(pathway))
}
