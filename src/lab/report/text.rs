//! The table at the end of `dalean train`: one line a pathway, at most 100 columns.

use std::fmt::Write as _;

use super::RunView;
use super::number::{quotient, short_with};
use crate::lab::config::absent_words;
use crate::lab::price::{Cost, PerPiece, prefixed};
use crate::lab::store::record::{EpisodesRecord, EpochRecord, PolicyOutcome, Score};
use crate::learn::statistics::PathwayRecord;

/// Heads of the columns and how wide the columns are.
const COLUMNS: [(&str, usize); 11] = [
    ("cells", 8),
    ("floor %", 7),
    ("zero %", 7),
    ("E/I", 6),
    ("pulses", 7),
    ("effective", 9),
    ("bounded %", 9),
    ("adc sat", 7),
    ("table", 6),
    ("error", 6),
    ("gate", 6),
];

/// What the columns mean, in their order.
const MEANINGS: [&str; COLUMNS.len()] = [
    "devices, each with an unsigned level",
    "cells at the lower end of the programming window, of the cells",
    "cells that store 0, of the cells (connection sparsity)",
    "sum of excitatory over sum of inhibitory levels of the layer",
    "pulses given over the whole training, after the bound",
    "pulses that moved their cell",
    "increments that the bound cut, of those that were not 0",
    "conversions while learning beyond the range of the converter",
    "look-ups at an end of the table",
    "error words cut by their width",
    "gates cut by their width",
];

/// What the columns of [`summary`] mean, a line each.
#[must_use]
pub fn words() -> String {
    let line = |((head, _), meaning): (&(&str, usize), &str)| format!("{head:<10} {meaning}\n");
    COLUMNS.iter().zip(MEANINGS).map(line).collect()
}

/// Events of the last four columns.
const SATURATED: [&str; 4] =
    ["saturated_conversions", "saturated_look_ups", "saturated_errors", "saturated_gates"];

/// Share of the energy from which the memory of digital sums is named.
const SHOWN: f64 = 0.05;

/// Cells, writes and saturations of every pathway in the final state, then accuracies and the state hash.
/// Pulses, bounds and saturations are those of the whole training; `-` stands where there is nothing to divide by.
#[must_use]
pub fn summary(view: &RunView<'_>) -> String {
    let mut out = String::new();
    let Some(last) = view.last() else {
        return "no epoch on record\n".into();
    };
    line(&mut out, "layer", COLUMNS.map(|(head, _)| head.into()));
    let mut layer = None;
    for one in &last.pathways {
        let first = layer != Some(one.layer);
        layer = Some(one.layer);
        let balance = last.layers.iter().find(|layer| layer.layer == one.layer && first);
        let name = format!(
            "{:<2} {}",
            if first { one.layer.to_string() } else { String::new() },
            one.pathway
        );
        line(&mut out, &name, cells(one, balance.map(|layer| layer.levels)));
    }
    line(&mut out, "all", totals(last));
    out.push('\n');
    accuracies(&mut out, view, last);
    if let Some(cost) = view.cost {
        chip(&mut out, cost);
    }
    if !view.absent.is_empty() {
        let _ = writeln!(out, "beside this {}: see the report", absent_words(view.absent));
    }
    let _ = writeln!(out, "state       {}", last.state_hash);
    out
}

/// Lines beside a result, one a text, cut between words at 100 columns.
#[must_use]
pub fn beside(name: &str, texts: &[String]) -> String {
    let mut out = String::new();
    for text in texts {
        let mut line = format!("{name:<11}");
        for word in text.split(' ') {
            if line.len() + 1 + word.len() > 100 && line.len() > 11 {
                let _ = writeln!(out, "{line}");
                line = " ".repeat(11);
            }
            let _ = write!(line, " {word}");
        }
        let _ = writeln!(out, "{line}");
    }
    out
}

fn line(out: &mut String, name: &str, cells: [String; COLUMNS.len()]) {
    let mut text = format!("{name:<6}");
    for (cell, (_, width)) in cells.iter().zip(COLUMNS) {
        let _ = write!(text, " {cell:>width$}");
    }
    out.push_str(text.trim_end());
    out.push('\n');
}

fn cells(one: &PathwayRecord, levels: Option<[u64; 2]>) -> [String; COLUMNS.len()] {
    let event = |name: &str| one.training.get(name).copied().unwrap_or(0);
    row([one.cells, one.floor, one.zero], levels, event)
}

fn totals(last: &EpochRecord) -> [String; COLUMNS.len()] {
    let sum = |pick: fn(&PathwayRecord) -> u64| last.pathways.iter().map(pick).sum();
    let event = |name: &str| {
        last.events.get("training").and_then(|events| events.get(name)).copied().unwrap_or(0)
    };
    row([sum(|one| one.cells), sum(|one| one.floor), sum(|one| one.zero)], None, event)
}

fn row(
    [cells, floor, zero]: [u64; 3],
    levels: Option<[u64; 2]>,
    event: impl Fn(&str) -> u64,
) -> [String; COLUMNS.len()] {
    let short = |count| short_with(count, "");
    let balance = levels.map_or_else(String::new, |[excite, inhibit]| {
        quotient(excite, inhibit).map_or("-".into(), |ratio| format!("{ratio:.2}"))
    });
    let [adc, table, error, gate] = SATURATED.map(|name| short(event(name)));
    [
        short(cells),
        percent(floor, cells),
        percent(zero, cells),
        balance,
        short(event("pulses_attempted")),
        short(event("pulses_effective")),
        percent(event("bounded"), event("requested")),
        adc,
        table,
        error,
        gate,
    ]
}

/// Cycles, seconds and joules of the run on its chip, what they are split into, and what an image takes.
fn chip(out: &mut String, cost: &Cost) {
    let mut lines = Vec::new();
    let mut first = Vec::new();
    if let (Some(cycles), Some(seconds)) = (cost.cycles, cost.seconds) {
        first.push(format!("{} cycles, {}", short_with(cycles, " "), prefixed(seconds, "s")));
    }
    if let Some(energy) = cost.energy {
        first.push(energy.words());
    }
    lines.push(first.join(", "));
    if let Some(energy) = cost.energy.filter(|energy| energy.joules[1] > 0.0) {
        let share = |joules: f64| format!("{:.0} %", 100.0 * joules / energy.joules[1]);
        let split = cost.split.iter().map(|split| {
            let least = if split.total.whole().is_none() { "at least " } else { "" };
            format!("{} {least}{}", split.class.name(), share(split.total.joules[1]))
        });
        let assumed = format!("{:.0} % assumed", 100.0 * cost.assumed_share);
        lines.push(split.chain([assumed]).collect::<Vec<_>>().join(", "));
    }
    if let Some(share) = cost.sums_share.filter(|&share| share >= SHOWN) {
        lines.push(format!(
            "{:.0} % is memory of sums, 64 bits a product; online or replay spares it in dense layers",
            100.0 * share
        ));
    }
    let images: Vec<_> = cost.per_piece.iter().map(image).filter(|one| !one.is_empty()).collect();
    lines.push(images.join("; "));
    let missing: Vec<_> = cost.missing.iter().map(|missing| &*missing.what).collect();
    if cost.energy.is_some() && !missing.is_empty() {
        lines.push(format!("without a price: {}", missing.join(", ")));
    }
    let heads = std::iter::once("on the chip").chain(std::iter::repeat(""));
    for (head, text) in heads.zip(lines.iter().filter(|text| !text.is_empty())) {
        let _ = writeln!(out, "{head:<11} {text}");
    }
}

/// `to learn from an image 1.20 uJ, 24.1 us`.
fn image(one: &PerPiece) -> String {
    let mut parts = Vec::new();
    if one.total.priced > 0 {
        let least = if one.total.whole().is_none() { "at least " } else { "" };
        parts.push(format!("{least}{}", prefixed(one.total.joules[1], "J")));
    }
    parts.extend(one.seconds.map(|seconds| prefixed(seconds, "s")));
    if parts.is_empty() {
        String::new()
    } else {
        format!("to {} {}", one.doing(), parts.join(", "))
    }
}

/// Returns of a policy: while learning, without, and of the final test.
fn returns(out: &mut String, view: &RunView<'_>, last: &PolicyOutcome) {
    let mut line = |name: &str, mean: Option<f64>, note: &str| {
        if let Some(mean) = mean {
            let _ = writeln!(out, "{name:<11} {mean:>9.2}  {note}");
        }
    };
    let episodes = |all: &EpisodesRecord| {
        let range = all
            .return_range
            .map_or_else(String::new, |[_, least, most]| format!(", {least:.2} to {most:.2}"));
        format!("mean of {} {} episodes{range}", all.episodes(), all.played())
    };
    let note = format!("mean of {} episodes while learning in the last epoch", last.returns.count);
    line("learning", last.episodic_return, &note);
    line("evaluated", last.evaluation.mean(), &episodes(&last.evaluation));
    if let Some(test) = view.receipt.played() {
        let note = format!(
            "{}; {} state, after epoch {} and {} steps",
            episodes(&test.episodes),
            test.select,
            test.epoch,
            test.steps
        );
        line("test", test.episodes.mean(), &note);
    }
}

fn percent(part: u64, whole: u64) -> String {
    quotient(part, whole).map_or("-".into(), |share| format!("{:.1}", 100.0 * share))
}

fn accuracies(out: &mut String, view: &RunView<'_>, last: &EpochRecord) {
    let mut score = |name: &str, score: Option<Score>, note: &str| {
        if let Some(score) = score {
            let accuracy = quotient(score.correct, score.total)
                .map_or("-".into(), |share| format!("{:.2} %", 100.0 * share));
            let _ = writeln!(
                out,
                "{name:<11} {accuracy:>8}  {} of {} right, {note}",
                score.correct, score.total
            );
        }
    };
    if let Some(outcome) = last.policy() {
        returns(out, view, outcome);
        return;
    }
    score("train", last.train(), &format!("while learning in epoch {}", last.epoch));
    score("validation", last.validation(), &format!("after epoch {}", last.epoch));
    if let Some(test) = view.receipt.classified() {
        let why = test.select.replace('_', " ");
        score("test", Some(test.score), &format!("after epoch {} ({why})", test.epoch));
    }
}
