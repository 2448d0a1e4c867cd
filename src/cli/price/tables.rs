//! Chips and modes side by side: a line each, time and energy and what the energy is split into.

use super::super::say;
use crate::chip::engine::Phase;
use crate::lab::config::CostClass;
use crate::lab::price::{EnergySplit, EnergyTotal, prefixed};
use crate::lab::run::{Profile, Repriced};

/// One line: name, cycles, seconds, energy, its split, and a remark.
struct Line<'a> {
    name: &'a str,
    cycles: Option<f64>,
    seconds: Option<f64>,
    total: EnergyTotal,
    split: Vec<EnergySplit>,
    remark: String,
}

/// Classes that any of the lines has, in their order.
fn classes(lines: &[Line<'_>]) -> Vec<CostClass> {
    let has = |class: &&CostClass| {
        lines.iter().any(|line| line.split.iter().any(|split| split.class == **class))
    };
    CostClass::EACH.iter().filter(has).copied().collect()
}

fn show(lines: &[Line<'_>]) {
    let classes = classes(lines);
    let width = lines.iter().map(|line| line.name.chars().count()).fold(10, usize::max);
    let mut head = format!("  {:width$}{:>12}{:>11}{:>12}", "", "cycles", "time", "energy");
    for class in &classes {
        head += &format!("{:>12}", class.name());
    }
    say(&head);
    for line in lines {
        let mut text = format!(
            "  {:width$}{:>12}{:>11}{:>12}",
            line.name,
            line.cycles.map_or_else(|| "-".into(), |cycles| format!("{cycles:.0}")),
            line.seconds.map_or_else(|| "-".into(), |seconds| prefixed(seconds, "s")),
            least(&line.total)
        );
        for class in &classes {
            let part = line.split.iter().find(|split| split.class == *class);
            text += &format!("{:>12}", part.map_or_else(|| "-".into(), |part| least(&part.total)));
        }
        say(format!("{text}  {}", line.remark).trim_end());
    }
}

/// Typical joules: `-` where nothing has a price, a bound where only some has.
fn least(total: &EnergyTotal) -> String {
    match (total.priced, total.whole()) {
        (0, _) => "-".into(),
        (_, Some(joules)) => prefixed(joules[1], "J"),
        (_, None) => format!(">= {}", prefixed(total.joules[1], "J")),
    }
}

/// The same batch in every mode of writing it, an image at a time.
pub(super) fn modes(profile: &Profile) {
    say("\nTHE SAME BATCH IN EVERY learning.mode, an image of it");
    let mut lines = Vec::new();
    for mode in &profile.modes {
        let Ok(act) = &mode.act else { continue };
        let each = profile.bill(act).per_piece(&act.pieces());
        let notes = [mode.own.then_some("this experiment"), mode.also];
        lines.extend(each.into_iter().map(|one| Line {
            name: mode.mode,
            cycles: act.cycles().map(|cycles| cycles.elapsed as f64 / act.samples as f64),
            seconds: one.seconds,
            total: one.total,
            split: one.split,
            remark: notes.iter().flatten().copied().collect::<Vec<_>>().join(", "),
        }));
    }
    show(&lines);
    for mode in &profile.modes {
        if let Err(why) = &mode.act {
            say(&format!("  {}: cannot be had here: {why}", mode.mode));
        }
    }
}

/// One run with the constants of several chips.
pub(super) fn side_by_side(runs: &[Repriced]) {
    for run in runs.iter().take(1) {
        say(&format!("run on {}, with the constants of", run.made_on));
    }
    let remark = |total: &EnergyTotal| total.priced_words().unwrap_or_default();
    let lines = runs.iter().map(|run| {
        let bill = run.bill();
        let (total, seconds) = (bill.total(), bill.seconds_total());
        Line {
            name: &run.priced_as,
            // cycles of another schedule are not this chip's
            cycles: seconds.and(run.ledger.elapsed()).map(|cycles| cycles as f64),
            seconds,
            split: bill.split(None),
            remark: remark(&total),
            total,
        }
    });
    show(&lines.collect::<Vec<_>>());
    for phase in [Phase::Training, Phase::Evaluation] {
        let each = runs.iter().filter_map(|run| {
            let each = run.bill().per_piece(&run.pieces).into_iter();
            Some((run, each.into_iter().find(|one| one.phase == phase.name())?))
        });
        let each: Vec<_> = each.collect();
        for (_, one) in each.iter().take(1) {
            say(&format!("to {}, the mean of {}:", one.doing(), one.count));
        }
        let lines = each.into_iter().map(|(run, one)| Line {
            name: &run.priced_as,
            cycles: None,
            seconds: one.seconds,
            remark: remark(&one.total),
            total: one.total,
            split: one.split,
        });
        let lines: Vec<_> = lines.collect();
        if !lines.is_empty() {
            show(&lines);
        }
    }
    for run in runs.iter().filter(|run| !run.changes.is_empty()) {
        let keys: Vec<_> = run.changes.iter().map(|change| change.key).collect();
        say(&format!(
            "{} differs in {}: what that touches is left out; to count it, train on {}",
            run.priced_as,
            keys.join(", "),
            run.priced_as
        ));
    }
}
