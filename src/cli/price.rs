//! `price`, `profile`.

use std::path::PathBuf;

use clap::Args;
use serde_json::json;

use super::{Done, Shared, configuration, known, say};
use crate::lab::config::{Config, Constants, absent_words};
use crate::lab::price::{Bill, Convention, EnergySplit, Group, Pieces, areas, bounds, prefixed};
use crate::lab::run::{self, Act, ModeUse, Profile, Repriced};

mod tables;

/// Assumed constants named in a table.
const NAMED: usize = 5;
/// Share of the total from which memory of digital sums is explained.
const SHOWN: f64 = 0.05;
/// What that memory is, and what does without.
const SUMS: &str = "a product is added to a 32-bit sum, 64 bits out and in; learning.mode = \"online\" or \"replay\" does without in dense layers";

#[derive(Debug, Args)]
pub(super) struct PriceArgs {
    /// Folder of a finished run
    #[arg(value_hint = clap::ValueHint::DirPath)]
    run: PathBuf,
    /// Constants of another hardware model: a built-in name or a file (several: side by side)
    #[arg(long, value_name = "FILE", value_parser = known::models(), hide_possible_values = true)]
    hw: Vec<String>,
    /// One JSON object a model on standard output
    #[arg(long)]
    json: bool,
    /// Print only totals
    #[arg(long, short)]
    quiet: bool,
}

#[derive(Debug, Args)]
pub(super) struct ProfileArgs {
    /// Experiment file [default: the built-in digits]
    file: Option<PathBuf>,
    /// Hardware model: a built-in name or a file
    #[arg(long, value_name = "FILE", value_parser = known::models(), hide_possible_values = true)]
    hw: Option<String>,
    /// Change a key, such as hw.timing.lanes=8 (repeatable)
    #[arg(long = "set", value_name = "KEY=VALUE")]
    settings: Vec<String>,
    /// Seed of all draws
    #[arg(long, value_name = "N")]
    seed: Option<u64>,
    #[command(flatten)]
    shared: Shared,
}

pub(super) fn price(args: &PriceArgs) -> Done {
    let priced = |hw: Option<&String>| run::reprice(&args.run, hw.map(String::as_str));
    let runs: Vec<Repriced> = match &*args.hw {
        [] => vec![priced(None)?],
        models => models.iter().map(|hw| priced(Some(hw))).collect::<Result<_, _>>()?,
    };
    if args.json {
        for run in &runs {
            say(&run.to_json(&args.run).to_string());
        }
        return Ok(());
    }
    match &*runs {
        [run] => show_price(run, args.quiet),
        runs => tables::side_by_side(runs),
    }
    if !args.quiet {
        say(&format!("{}: see the page of the run", absent_words(&runs[0].absent)));
    }
    Ok(())
}

fn show_price(run: &Repriced, quiet: bool) {
    let bill = run.bill();
    if !quiet {
        say(&format!("run on {}, constants of {}", run.made_on, run.priced_as));
        show_nodes(run.constants());
    }
    if !run.changes.is_empty() && !quiet {
        let keys: Vec<_> = run.changes.iter().map(|change| change.key).collect();
        say(&format!(
            "the chips differ in {}: what that touches is left out below; to count it, train on {}",
            keys.join(", "),
            run.priced_as
        ));
    }
    if let (Some(cycles), Some(seconds)) = (run.ledger.elapsed(), bill.seconds_total()) {
        say(&format!("time     {cycles} cycles, {}", prefixed(seconds, "s")));
    }
    if quiet {
        say(&format!("energy   {}", bill.total().words()));
        return;
    }
    show_energy(&bill, &run.pieces);
    for (heading, groups) in [
        ("by phase", bill.by_phase()),
        ("by operation", bill.by_operation()),
        ("by layer", bill.by_layer()),
        ("by pathway", bill.by_pathway()),
    ] {
        show_groups(heading, &groups, bill.total().joules[1]);
    }
    show_missing(&bill);
}

fn merge(object: &mut serde_json::Value, more: serde_json::Value) {
    if let (Some(object), serde_json::Value::Object(more)) = (object.as_object_mut(), more) {
        object.extend(more);
    }
}

fn show_energy(bill: &Bill<'_>, pieces: &Pieces) {
    let total = bill.total();
    say(&format!("energy   {}", total.words()));
    show_split(&bill.split(None), total.joules[1]);
    if let Some(share) = bill.sums_share().filter(|&share| share >= SHOWN) {
        say(&format!("  {:.0} % is memory of the digital sums: {SUMS}", 100.0 * share));
    }
    // of a single one, the total is said above
    for one in bill.per_piece(pieces).into_iter().filter(|one| one.count > 1) {
        let time = one.seconds.map_or_else(String::new, |s| format!(", {}", prefixed(s, "s")));
        let (doing, total) = (one.doing(), one.total.words());
        say(&format!("to {doing}, the mean of {}: {total}{time}", one.count));
        show_split(&one.split, one.total.joules[1]);
    }
    show_groups("by component", &bill.by_component(), total.joules[1]);
    let (share, assumed) = bill.assumed();
    let named: Vec<_> = assumed
        .iter()
        .take(NAMED)
        .map(|one| format!("{} {:.1} %", one.key, 100.0 * one.share))
        .collect();
    if !named.is_empty() {
        say(&format!("{:.1} % leans on assumed constants: {}", 100.0 * share, named.join(", ")));
    }
}

/// Device, converter, digital, static.
fn show_split(split: &[EnergySplit], total: f64) {
    for EnergySplit { class, total: part } in split {
        let share = if total > 0.0 { 100.0 * part.joules[1] / total } else { 0.0 };
        say(&format!("  {:16} {share:>5.1} %  {}", class.name(), part.words()));
    }
}

fn show_groups(heading: &str, groups: &[Group], total: f64) {
    if groups.is_empty() {
        return;
    }
    say(&format!("{heading}:"));
    for group in groups {
        let share = if total > 0.0 { 100.0 * group.joules[1] / total } else { 0.0 };
        let joules = bounds(group.joules, "J");
        say(&format!("  {:16} {share:>5.1} %  {joules}", group.name.replace('_', " ")));
    }
}

fn show_missing(bill: &Bill<'_>) {
    for (key, law) in &bill.scaled {
        say(&format!("by law: {key}: {law}"));
    }
    for missing in &bill.missing {
        let count = missing.count.map_or_else(String::new, |count| format!(" ({count})"));
        say(&format!("no price: {}{count}: {}", missing.what, missing.why));
    }
}

pub(super) fn profile(args: &ProfileArgs) -> Done {
    let shared = &args.shared;
    let config = configuration(args.file.as_ref(), args.hw.as_deref(), &args.settings, args.seed)?;
    let profile = run::profile(&config, &shared.data_root(), shared.machine()?)?;
    if shared.json {
        say(&plan_json(&config, &profile).to_string());
        for act in &profile.acts {
            say(&act_json(&profile, act).to_string());
        }
        for mode in &profile.modes {
            say(&mode_json(&profile, mode).to_string());
        }
        say(&json!({"event": "not_simulated", "effects": config.absent()}).to_string());
        return Ok(());
    }
    let tiles = profile.plan.tiles(&profile.hardware);
    let [cells, apart] = [profile.plan.cells(), profile.plan.cells_apart()];
    let copies = match cells == apart {
        true => String::new(),
        false => format!(", copies of {apart} that hold the network"),
    };
    say(&format!(
        "{} on {}: {cells} cells on {tiles} tiles{copies}",
        config.data_name(),
        config.hardware_name
    ));
    show_nodes(&profile.constants);
    for (name, area) in areas(&profile.plan, &profile.hardware, &profile.constants) {
        let [low, typical, high] = area.map(|area| area * 1e6);
        say(&format!("area of {name}: {typical:.3} mm2 ({low:.3} to {high:.3})"));
    }
    if !shared.quiet {
        for warning in &profile.warnings {
            say(&format!("warning: {warning}"));
        }
    }
    for act in &profile.acts {
        show_act(&profile, act);
    }
    tables::modes(&profile);
    say(&format!("\n{}: see dalean hw show MODEL", absent_words(&config.absent())));
    Ok(())
}

fn mode_json(profile: &Profile, mode: &ModeUse) -> serde_json::Value {
    let mut object =
        json!({"event": "mode", "mode": mode.mode, "own": mode.own, "also": mode.also});
    let more = match &mode.act {
        Ok(act) => act_json(profile, act),
        Err(why) => json!({"refused": why}),
    };
    let event = object["event"].take();
    merge(&mut object, more);
    object["event"] = event;
    object
}

/// Operations a second and a joule; a partial sum of joules has no such rate.
fn rates(act: &Act, bill: &Bill<'_>) -> (Option<f64>, Option<f64>) {
    let operations = act.operations(Convention::PAIRS);
    let rate = bill.seconds_total().filter(|&s| s > 0.0).map(|seconds| operations / seconds);
    let joules = bill.total().whole().map(|joules| joules[1]).filter(|&joules| joules > 0.0);
    (rate, joules.map(|joules| operations / joules))
}

/// Of which technology the constants are: sums of several nodes are those of no chip.
fn show_nodes(constants: &Constants) {
    if let Some(nodes) = constants.node_words() {
        say(&format!("node     {nodes}"));
    }
}

/// What the network takes of the chip.
fn plan_json(config: &Config, profile: &Profile) -> serde_json::Value {
    let Profile { plan, hardware, constants, .. } = profile;
    let areas = areas(plan, hardware, constants).into_iter();
    let areas: Vec<_> =
        areas.map(|(name, area)| json!({"name": name, "square_metres": area})).collect();
    json!({"event": "plan", "data": config.data_name(), "hardware": config.hardware_name,
        "cells": plan.cells(), "cells_apart": plan.cells_apart(), "tiles": plan.tiles(hardware), "areas": areas,
        "nodes": run::nodes_json(constants),
        "warnings": profile.warnings})
}

fn act_json(profile: &Profile, act: &Act) -> serde_json::Value {
    let bill = profile.bill(act);
    let (rate, efficiency) = rates(act, &bill);
    let macs = act.products.map(|products| Convention::PAIRS.macs(products));
    let stages: Vec<_> = act
        .stages()
        .into_iter()
        .map(|stage| {
            let critical = stage.critical.map(
                |(layer, part, used)| json!({"layer": layer, "part": part.name(), "used": used}),
            );
            json!({"stage": stage.stage.name(), "cycles": stage.cycles, "critical": critical})
        })
        .collect();
    let mut object = json!({"event": "profile", "act": act.name, "samples": act.samples,
        "convention": Convention::PAIRS.to_json(), "macs_read": macs[0], "macs_accumulated": macs[1],
        "operations_per_second": rate, "operations_per_joule": efficiency,
        "cycles": act.cycles(), "stages": stages});
    merge(&mut object, bill.to_json(&act.pieces()));
    object
}

fn show_act(profile: &Profile, act: &Act) {
    let bill = profile.bill(act);
    let samples =
        if act.samples == 1 { "1 sample".into() } else { format!("{} samples", act.samples) };
    say(&format!("\n{}, {samples}", act.name.to_uppercase()));
    if let (Some(cycles), Some(seconds)) = (act.cycles(), bill.seconds_total()) {
        let elapsed = cycles.elapsed.max(1) as f64;
        say(&format!("time     {} cycles, {}", cycles.elapsed, prefixed(seconds, "s")));
        for stage in act.stages() {
            let critical = stage.critical.map_or_else(String::new, |(layer, part, used)| {
                let share = 100.0 * used as f64 / stage.cycles as f64;
                format!("  layer {layer} {} work {share:.0} % of it", part.name())
            });
            let share = 100.0 * stage.cycles as f64 / elapsed;
            let line =
                format!("  {:16} {share:>5.1} %  {:>9} cycles", stage.stage.name(), stage.cycles);
            say(&format!("{line}{critical}"));
        }
        say("cycles at work, and share of the whole time:");
        for (layer, this) in cycles.layers.iter().enumerate() {
            let used = this.used.iter().filter(|(_, used)| **used > 0);
            let used = used.map(|(part, used)| {
                format!("{part} {used} ({:.0} %)", 100.0 * *used as f64 / elapsed)
            });
            say(&format!("  layer {layer:<10} {}", used.collect::<Vec<_>>().join(", ")));
        }
    }
    show_energy(&bill, &act.pieces());
    let (rate, efficiency) = rates(act, &bill);
    let [read, added] = act.products.map(|products| Convention::PAIRS.macs(products));
    let mut line = format!("MACs     {read} of reads, {added} of accumulation");
    for (value, unit) in [(rate, "TOPS"), (efficiency, "TOPS/W")] {
        if let Some(value) = value {
            line += &format!(", {:.4} {unit}", value / 1e12);
        }
    }
    say(&format!("{line} ({})", Convention::PAIRS.words()));
    show_missing(&bill);
}
