//! `hw import`: a device from measured pulses.

use std::io::Write;
use std::path::{Path, PathBuf};

use clap::Args;
use serde_json::json;

use super::super::{Done, Failure, say, usage};
use crate::chip::device::{CellSpread, PulseNoise};
use crate::lab::config::{device_names, model_names};
use crate::lab::measure::{KindFit, MeasuredDevice};
use crate::lab::report::device_figure;
use crate::lab::store::place::write_out;
use crate::num::fixed::Millionths;

#[derive(Debug, Args)]
pub(in crate::cli) struct ImportArgs {
    /// Table (CSV): a line a read, with columns `conductance`, `pulse`, `polarity` (up or down, ...) and `device`; the last
    /// three may be missing
    table: PathBuf,
    /// Model file to write; must not be there [default: NAME.toml]
    #[arg(long, short, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Name of the chip [default: that of the table]
    #[arg(long, value_name = "NAME")]
    name: Option<String>,
    /// Draw data and model as SVG
    #[arg(long, value_name = "FILE")]
    figure: Option<PathBuf>,
    /// One JSON object on standard output
    #[arg(long)]
    json: bool,
    /// Print only the name of the file
    #[arg(long, short)]
    quiet: bool,
}

pub(super) fn execute(args: &ImportArgs) -> Done {
    let place = args.table.display().to_string();
    #[expect(clippy::disallowed_methods, reason = "the table the user named")]
    let bytes = std::fs::read(&args.table).map_err(|error| {
        usage(&format!(
            "cannot read {place}: {error}; name a table, such as examples/devices/pulses.csv"
        ))
    })?;
    let name = name(args)?;
    let file = args.table.file_name().map_or_else(|| place.clone(), |n| n.to_string_lossy().into());
    let device = MeasuredDevice::new(&file, &bytes)
        .map_err(|error| Failure { code: 1, message: format!("{place} {error}") })?;
    let out = args.out.clone().unwrap_or_else(|| PathBuf::from(format!("{name}.toml")));
    let written = out.display().to_string();
    let made = std::fs::File::create_new(&out)
        .and_then(|mut file| file.write_all(device.hardware_toml(&name).as_bytes()));
    made.map_err(|error| {
        let message =
            format!("cannot write {written}: {error}; choose another with --out, or remove it");
        Failure { code: 1, message }
    })?;
    if let Some(figure) = &args.figure {
        write_out(figure, device_figure(&device).as_bytes()).map_err(|error| {
            let message = format!("cannot write {}: {error}", figure.display());
            Failure { code: 1, message }
        })?;
    }
    match (args.json, args.quiet) {
        (true, _) => say(&told(&device, &name, &written, args.figure.as_deref()).to_string()),
        (_, true) => say(&written),
        _ => show(&device, &written, args.figure.as_deref()),
    }
    Ok(())
}

/// What the chip is called.
fn name(args: &ImportArgs) -> Result<String, Failure> {
    let stem = |path: &Path| path.file_stem().map(|stem| stem.to_string_lossy().into_owned());
    let good = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '-';
    let name = match &args.name {
        Some(name) if !name.is_empty() && name.chars().all(good) => name.clone(),
        Some(name) => {
            let message = format!("--name is {name:?}; use letters, digits, `_` and `-`");
            return Err(usage(&message));
        }
        None => {
            let stem = args.out.as_deref().and_then(stem).or_else(|| stem(&args.table));
            let name = stem.unwrap_or_default();
            name.chars().map(|c| if good(c) { c } else { '_' }).collect()
        }
    };
    if name.is_empty() || model_names().contains(&&*name) || device_names().contains(&&*name) {
        let message =
            format!("{name:?} cannot be the name of your chip; choose another with --name");
        return Err(usage(&message));
    }
    Ok(name)
}

fn percent(share: f64) -> String {
    format!("{:.2} %", 100.0 * share)
}

fn of_millionths(share: Millionths) -> f64 {
    share.0 as f64 / 1e6
}

/// Five digits.
fn digits(value: f64) -> String {
    if value == 0.0 || (1e-3..1e6).contains(&value) {
        let text = format!("{value:.4}");
        return text.trim_end_matches('0').trim_end_matches('.').to_owned();
    }
    format!("{value:.4e}")
}

/// Numbers of a curve, as many as a line holds.
fn numbers(kind: &KindFit) -> String {
    const SHOWN: usize = 6;
    let all = kind.response.numbers();
    let mut text: Vec<_> = all.iter().take(SHOWN).map(ToString::to_string).collect();
    if all.len() > SHOWN {
        text.push(format!("... {} in all", all.len()));
    }
    text.join(", ")
}

fn noise(noise: PulseNoise) -> String {
    match noise {
        PulseNoise::OfStep(share) => format!("{} of a step", percent(of_millionths(share))),
        PulseNoise::OfWindow(share) => format!("{} of the window", percent(of_millionths(share))),
        _ => "none".into(),
    }
}

fn spread(spread: &CellSpread) -> String {
    let parts = [
        ("steps", spread.step),
        ("asymmetry", spread.asymmetry),
        ("ceiling", spread.ceiling),
        ("floor", spread.floor),
    ];
    let parts: Vec<_> = parts
        .iter()
        .filter(|(_, share)| share.0 != 0)
        .map(|(name, share)| format!("{name} {}", percent(of_millionths(*share))))
        .collect();
    if parts.is_empty() { "none".into() } else { parts.join(", ") }
}

fn show(device: &MeasuredDevice, written: &str, figure: Option<&Path>) {
    let ratio =
        device.on_off().map_or("no ratio: the least is 0".into(), |r| format!("on/off {r:.2}"));
    let [least, most] = device.window.map(digits);
    say(&format!("{}, conductance {least} to {most} ({ratio})", device.source()));
    for said in &device.said {
        say(&format!("note     {said}"));
    }
    say(
        "\nkind          numbers  states  off by, of the window: a step   pulse by pulse   criterion",
    );
    let least = device.best().worth;
    for kind in &device.kinds {
        say(&format!(
            "{:12} {:>8} {:>7} {:>30} {:>16} {:>11.1}",
            kind.response.name(),
            kind.numbers,
            kind.states,
            percent(kind.step_rms),
            percent(kind.curve_rms),
            kind.worth - least,
        ));
    }
    let best = device.best();
    say(&format!("\nproposed {}", device.reason()));
    say(&format!("curve    {}: {}", best.response.name(), numbers(best)));
    say(&format!("states   {} pulses of mean length across the window", best.states));
    say(&format!("noise    {}", noise(device.device.noise)));
    if device.read_noise > 0.0 {
        say(&format!(
            "reads    miss by {} of the window, as it seems; not simulated",
            percent(device.read_noise)
        ));
    }
    say(&format!("spread   {}", spread(&device.device.spread)));
    if let Some(figure) = figure {
        say(&format!("figure   {}", figure.display()));
    }
    say(&format!(
        "\n{written}: your device on the periphery of the ideal chip\n\
         check    dalean hw check {written}\n\
         train    dalean train --hw {written}"
    ));
}

fn told(
    device: &MeasuredDevice,
    name: &str,
    written: &str,
    figure: Option<&Path>,
) -> serde_json::Value {
    let kind = |kind: &KindFit| {
        let numbers: Vec<_> = kind.response.numbers().into_iter().map(of_millionths).collect();
        json!({"curve": kind.response.name(), "numbers": numbers, "fitted": kind.numbers, "states": kind.states,
            "asymmetry": of_millionths(kind.asymmetry), "step_rms": kind.step_rms, "curve_rms": kind.curve_rms,
            "criterion": kind.worth})
    };
    let (of, share) = match device.device.noise {
        PulseNoise::OfStep(share) => (Some("step"), share),
        PulseNoise::OfWindow(share) => (Some("window"), share),
        _ => (None, Millionths(0)),
    };
    let CellSpread { step, asymmetry, ceiling, floor, .. } = device.device.spread;
    let [step, asymmetry, ceiling, floor] = [step, asymmetry, ceiling, floor].map(of_millionths);
    json!({"event": "done", "model": name, "file": written, "figure": figure.map(|f| f.display().to_string()),
        "devices": device.devices.len(), "reads": device.reads, "pulses": device.pulses,
        "conductance": device.window, "on_off": device.on_off(),
        "curve": device.best().response.name(), "states": device.best().states, "reason": device.reason(),
        "kinds": device.kinds.iter().map(kind).collect::<Vec<_>>(),
        "noise": of_millionths(share), "noise_of": of, "read_noise": device.read_noise,
        "spread": {"step": step, "asymmetry": asymmetry, "ceiling": ceiling, "floor": floor},
        "notes": device.said})
}
