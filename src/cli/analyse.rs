//! `analyse`.

use std::path::PathBuf;

use clap::Args;
use serde_json::json;

use super::progress::Meter;
use super::run::Stop;
use super::{Done, Moved, Shared, out, say};
use crate::lab::analysis::{Analysed, LayerAnalysis};
use crate::lab::report::analysis_page;
use crate::lab::run;

#[derive(Debug, Args)]
pub(super) struct AnalyseArgs {
    /// Folder of a run of examples with labels
    #[arg(value_hint = clap::ValueHint::DirPath)]
    run: PathBuf,
    /// Examples that are read, the first of those learnt from
    #[arg(long, value_name = "N", default_value_t = 64, value_parser = clap::value_parser!(u16).range(1..=256))]
    examples: u16,
    /// States to look at, such as 0,1,5: after so many epochs, learnt again where they are not kept [default: the state
    /// before the first update, and that of the result]
    #[arg(long, value_name = "EPOCHS", value_delimiter = ',')]
    at: Vec<u32>,
    /// Write a page with figures
    #[arg(long, value_name = "FILE", value_hint = clap::ValueHint::FilePath)]
    page: Option<PathBuf>,
    #[command(flatten)]
    moved: Moved,
    #[command(flatten)]
    shared: Shared,
}

pub(super) fn execute(args: &AnalyseArgs) -> Done {
    let shared = &args.shared;
    let stop = Stop::default();
    let mut meter = Meter::new(shared.quiet || shared.json, 0);
    let found = run::analyse(
        &args.run,
        &args.moved.root(shared.data_root()),
        shared.machine()?,
        usize::from(args.examples),
        &args.at,
        &mut |progress| {
            meter.batch(progress);
            !stop.asked()
        },
    );
    meter.finish();
    let found = found?;
    if let Some(file) = &args.page {
        let name = args.run.display().to_string();
        out::write(
            file,
            analysis_page(&name, args.examples, &found, env!("CARGO_PKG_VERSION")).as_bytes(),
        )?;
    }
    if shared.json {
        for state in &found {
            for layer in &state.layers {
                say(&record(state.epoch, layer).to_string());
            }
        }
        let done = json!({"event": "done", "run": args.run.display().to_string(), "examples": args.examples,
            "states": found.iter().map(|state| state.epoch).collect::<Vec<_>>()});
        say(&done.to_string());
        return Ok(());
    }
    found.iter().for_each(table);
    if !shared.quiet {
        say(
            "gate: root mean square, 1 is a full error word and the steepest slope; agreement: cosine with the gradient of the same errors",
        );
    }
    Ok(())
}

fn record(epoch: u32, layer: &LayerAnalysis) -> serde_json::Value {
    let routes =
        layer.routes.iter().map(|(name, agreement)| ((*name).to_owned(), json!(agreement)));
    json!({
        "event": "layer",
        "epoch": epoch,
        "layer": layer.layer,
        "cells": layer.cells,
        "gate_rms": layer.gate,
        "gradient_gate_rms": layer.gradient_gate,
        "update_mean": layer.update,
        "agreement": layer.agreement,
        "agreement_by_route": routes.collect::<serde_json::Map<_, _>>(),
    })
}

/// A table of the layers of a state.
fn table(state: &Analysed) {
    let names = state.layers.iter().find(|layer| !layer.routes.is_empty());
    let names: Vec<&str> =
        names.map_or_else(Vec::new, |layer| layer.routes.iter().map(|(name, _)| *name).collect());
    let heads: String = names.iter().map(|name| format!("  {name:>16}")).collect();
    say(&format!("after {} epochs", state.epoch));
    say(&format!("  layer      cells      gate    update  agreement{heads}"));
    let small = |value: Option<f64>| value.map_or("-".into(), |value| format!("{value:.2e}"));
    let cosine = |value: Option<f64>| value.map_or("-".into(), |value| format!("{value:.3}"));
    for layer in &state.layers {
        let routes =
            layer.routes.iter().map(|(_, agreement)| format!("  {:>16}", cosine(*agreement)));
        say(&format!(
            "  {:>5} {:>10} {:>9} {:>9}  {:>9}{}",
            layer.layer,
            layer.cells,
            small(layer.gate),
            small(layer.update),
            cosine(layer.agreement),
            routes.collect::<String>()
        ));
    }
}
