//! `hw list`, `hw new`, `hw import`, `hw show`, `hw peak`, `hw check`.

use std::io::Write;
use std::path::{Path, PathBuf};

use clap::{Args, Subcommand};
use serde_json::json;

use super::{Done, Failure, known, say, usage};
use crate::chip::device::{CellSpread, PulseNoise};
use crate::chip::hardware::{Adc, AdcRange, Hardware, PulseCode, Subtract, Timing};
use crate::lab::config::{
    self, Config, Constant, CostTable, Model, Sources, Standing, absent_words, builtin_devices,
    builtin_models, device_names, load_model, model_names,
};
use crate::lab::price::{Convention, bounds, figures, peak, prefixed};

mod import;
mod modes;

/// Error words that `hw show` reckons with: those of ten classes.
const WORDS: u64 = 10;

#[derive(Debug, Subcommand)]
pub(super) enum HwCommand {
    /// Show the built-in models
    List {
        /// One JSON object a line on standard output, each with an `event`
        #[arg(long)]
        json: bool,
        /// Print only names
        #[arg(long, short)]
        quiet: bool,
    },
    /// Write a model file to begin with, every key explained; it is valid as it stands
    New {
        /// Name of the chip: NAME.toml is written, and must not be there
        name: PathBuf,
        /// One JSON object on standard output
        #[arg(long)]
        json: bool,
        /// Print only the name of the file
        #[arg(long, short)]
        quiet: bool,
    },
    /// Make a model of your device from a table of measured pulses: curve, states, noise, spread
    Import(import::ImportArgs),
    /// Show a model: its numbers, times and energies, then its text with sources
    Show {
        /// A built-in name or a file
        #[arg(value_parser = known::models(), hide_possible_values = true)]
        model: String,
        /// Change a key, such as hw.timing.lanes=8 (repeatable)
        #[arg(long = "set", value_name = "KEY=VALUE")]
        settings: Vec<String>,
        /// Print a model file that can be saved and used, with what --set changes
        #[arg(long, conflicts_with_all = ["json", "quiet"])]
        toml: bool,
        /// One JSON object on standard output
        #[arg(long)]
        json: bool,
        /// Leave out the text of the model
        #[arg(long, short)]
        quiet: bool,
    },
    /// The most a chip can read: operations a second of all its tiles, in any mode
    Peak(PeakArgs),
    /// Check a model file: keys, ranges, a source beside every number, units
    Check {
        /// A built-in name or a file
        #[arg(value_parser = known::models(), hide_possible_values = true)]
        model: String,
        /// One JSON object on standard output
        #[arg(long)]
        json: bool,
        /// Print nothing when it is valid
        #[arg(long, short)]
        quiet: bool,
    },
}

#[derive(Debug, Args)]
pub(super) struct PeakArgs {
    /// A built-in name or a file
    #[arg(value_parser = known::models(), hide_possible_values = true)]
    model: String,
    /// Change a key, such as hw.drive.phases=2 (repeatable)
    #[arg(long = "set", value_name = "KEY=VALUE")]
    settings: Vec<String>,
    /// Tiles that read [default: tile.count, or 1]
    #[arg(long, value_name = "N")]
    tiles: Option<u64>,
    /// Slices or phases of a read [default: those of the model]
    #[arg(long, value_name = "N")]
    slices: Option<u64>,
    /// Cells of a weight: 2 of a pair, 8 where a design joins eight
    #[arg(long, value_name = "N", default_value_t = 2)]
    cells: u64,
    /// Every way to use the chip that its model lists under [modes]
    #[arg(long, conflicts_with = "slices")]
    modes: bool,
    /// With --modes, widths of its converters: 8, or 3..10
    #[arg(long, value_name = "BITS", requires = "modes", value_parser = widths)]
    adc_bits: Option<Widths>,
    /// One JSON object on standard output
    #[arg(long)]
    json: bool,
}

/// Widths of a converter.
type Widths = Vec<i64>;

fn widths(text: &str) -> Result<Widths, String> {
    modes::widths(text)
}

pub(super) fn execute(command: &HwCommand) -> Done {
    match command {
        HwCommand::List { json, quiet } => {
            for Model { name, summary, .. } in builtin_models().into_iter().chain(builtin_devices())
            {
                say(&match (json, quiet) {
                    (true, _) => {
                        json!({"event": "model", "name": name, "summary": summary}).to_string()
                    }
                    (_, true) => name,
                    _ => format!("{name:14} {summary}"),
                });
            }
            Ok(())
        }
        HwCommand::New { name, json, quiet } => new(name, *json, *quiet),
        HwCommand::Import(args) => import::execute(args),
        HwCommand::Show { model, settings, toml, json, quiet } => {
            let given = load_model(model).map_err(|e| usage(&e.to_string()))?;
            let config = changed(model, settings)?;
            if *toml {
                say(saved(&given, &config, settings).trim_end());
            } else if *json {
                say(&model_json(&given, &config).to_string());
            } else {
                show(&given, &config, *quiet);
            }
            Ok(())
        }
        HwCommand::Peak(args) if args.modes => modes::show(args),
        HwCommand::Peak(args) => show_peak(args),
        HwCommand::Check { model, json, quiet } => check(model, *json, *quiet),
    }
}

/// Writes a model file to begin with; a file that is there stays.
fn new(name: &Path, json: bool, quiet: bool) -> Done {
    let chip = name.file_stem().and_then(|stem| stem.to_str()).unwrap_or_default();
    let good = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '-';
    if chip.is_empty() || !chip.chars().all(good) {
        let message = format!(
            "the name of the chip is {:?}; use letters, digits, `_` and `-`, such as `dalean hw new mychip`",
            name.display().to_string()
        );
        return Err(usage(&message));
    }
    if model_names().contains(&chip) || device_names().contains(&chip) {
        let message = format!("{chip} is a built-in model; give yours another name");
        return Err(usage(&message));
    }
    let path = name.with_extension("toml");
    let place = path.display().to_string();
    let made = std::fs::File::create_new(&path)
        .and_then(|mut file| file.write_all(config::template(chip).as_bytes()));
    made.map_err(|error| Failure {
        code: 1,
        message: format!("cannot write {place}: {error}; choose another name, or remove it"),
    })?;
    say(&match (json, quiet) {
        (true, _) => json!({"event": "done", "model": chip, "file": place}).to_string(),
        (_, true) => place,
        _ => format!(
            "{place}: a chip that is valid as it stands; replace what is not yours\n\
             check    dalean hw check {place}\n\
             train    dalean train --hw {place}"
        ),
    });
    Ok(())
}

fn check(name: &str, json: bool, quiet: bool) -> Done {
    let model = load_model(name).map_err(|e| usage(&e.to_string()))?;
    let complaints = model.constants.complaints();
    if !complaints.is_empty() {
        return Err(Failure { code: 1, message: complaints.join("\n") });
    }
    let numbers = model.constants.iter().count();
    let config = changed(name, &[])?;
    let (on_off, absent) = (on_off(&config.hardware), config.absent());
    if json {
        say(&json!({"event": "done", "model": model.name, "valid": true, "numbers": numbers,
            "on_off": on_off, "not_simulated": absent})
        .to_string());
    } else if !quiet {
        say(&format!(
            "{}: valid; every table has a source, {numbers} physical numbers lie where they can",
            model.name
        ));
        say(&format!("on/off {on_off}"));
        say(&format!("{}: dalean hw show {name}", absent_words(&absent)));
    }
    Ok(())
}

/// A model as a file: its own text, or with what was changed written out under a name of its own.
fn saved(model: &Model, config: &Config, settings: &[String]) -> String {
    if settings.is_empty() {
        return model.text.clone();
    }
    format!(
        "# {} with {}, by `dalean hw show`\n{}",
        model.name,
        settings.join(", "),
        config.hardware_toml(&format!("{}-changed", model.name), settings)
    )
}

fn model_json(model: &Model, config: &Config) -> serde_json::Value {
    let constants: Vec<_> = config
        .constants
        .iter()
        .map(|c| {
            json!({"key": c.key, "low": c.value[0], "typical": c.value[1], "high": c.value[2],
                "kind": c.kind, "source": c.source, "node_nm": c.node_nm,
                "class": c.quantity.class().name(), "scaled": c.scaled(),
                "not_priced_here": c.not_here()})
        })
        .collect();
    let times: Vec<_> = config
        .hardware
        .timing
        .iter()
        .flat_map(|_| figures(&config.hardware, WORDS))
        .map(|f| json!({"what": f.name, "cycles": f.cycles, "seconds": f.seconds}))
        .collect();
    let numbers: serde_json::Map<_, _> = numbers(&config.hardware)
        .into_iter()
        .map(|(name, value)| (name.to_owned(), json!(value)))
        .collect();
    json!({"event": "model", "name": model.name, "summary": model.summary, "numbers": numbers,
        "times": times, "constants": constants, "not_simulated": config.absent(),
        "toml": model.text})
}

/// A model with some keys changed, as a run on it would have it.
fn changed(model: &str, settings: &[String]) -> Result<Config, Failure> {
    let sources = Sources { hardware: Some(model), settings, ..Sources::default() };
    config::load(&sources).map_err(|e| usage(&e.to_string()))
}

fn show(model: &Model, config: &Config, quiet: bool) {
    say(&format!("{}: {}\n", config.hardware_name, config.hardware_summary()));
    for (name, value) in numbers(&config.hardware) {
        say(&format!("  {name:16} {value}"));
    }
    if let Some(nodes) = config.constants.node_words() {
        say(&format!("  {:16} {nodes}", "node"));
    }
    if let Some(timing) = config.hardware.timing {
        say(&format!("  {:16} {}", "conversion", conversion_text(config, &timing)));
        say(&format!("  {:16} {}", "timing", timing_text(&timing)));
        say("\nOn a full tile, ten error words:");
        for figure in figures(&config.hardware, WORDS) {
            let time = prefixed(figure.seconds, "s");
            say(&format!("  {:28} {:>10} cycles  {time:>10}", figure.name, figure.cycles));
        }
    }
    for (table, heading, unit) in [
        (CostTable::Energy, "Joules an event, typical (low to high):", "J"),
        (CostTable::Power, "Watts, typical (low to high):", "W"),
        (CostTable::Area, "Areas, typical (low to high):", "m2"),
    ] {
        let constants: Vec<_> =
            config.constants.iter().filter(|c| c.quantity.table == table).collect();
        if !constants.is_empty() {
            say(&format!("\n{heading}"));
        }
        for constant in constants {
            say(&format!("  {:16} {}", constant.quantity.name, constant_text(constant, unit)));
        }
    }
    let absent = config.absent();
    say(&format!("\n{}:", absent_words(&absent)));
    for one in &absent {
        say(&format!("  {}: {}", one.name(), one.text()));
    }
    if !quiet {
        say(&format!("\n{}", model.text.trim_end()));
    }
}

fn constant_text(constant: &Constant, unit: &str) -> String {
    let kind = format!("{:?}", constant.kind).to_lowercase();
    let value = match unit {
        // a prefix on a square metre would be read wrongly
        "m2" => {
            let [low, typical, high] = constant.value.map(|area| (area * 1e15).round() / 1e3);
            format!("{typical} um2 ({low} to {high})")
        }
        _ => bounds(constant.value, unit),
    };
    let node = constant.node_nm.map_or_else(String::new, |node| format!(", {node} nm"));
    let standing = match &constant.standing {
        Standing::Stated => String::new(),
        Standing::Scaled(law) => format!(", by law: {law}"),
        Standing::NotHere(why) => return format!("not priced for this setting: {why}"),
    };
    format!("{value:36} {kind}{node}{standing}")
}

/// What a conversion takes, and why.
fn conversion_text(config: &Config, timing: &Timing) -> String {
    let kind = config.converter_kind();
    let steps = match config.hardware.adc {
        Adc::Finite { bits, .. } => kind.steps(bits.get()),
        Adc::Ideal => None,
    };
    let steps = steps.map_or_else(String::new, |steps| {
        format!(", {steps} steps of {}", timing.convert / steps.max(1))
    });
    let slices = timing.slices.iter().flat_map(|own| own.iter());
    let slices = slices.map(|slice| format!("{} + {}", slice.settle, slice.convert));
    let slices: Vec<_> = slices.collect();
    let slices = match slices.is_empty() {
        true => String::new(),
        false => format!("; by phase, settle + convert: {}", slices.join(", ")),
    };
    format!("{}: {} cycles{steps}{slices}", kind.name(), timing.convert)
}

fn timing_text(timing: &Timing) -> String {
    let pulses = match timing.pulse_code {
        PulseCode::Unary => "one pulse a level",
        PulseCode::Amplitude => "pulses of any height",
    };
    let verify = if timing.verify { ", each verified" } else { "" };
    format!(
        "{}; settle {}, convert {} x {} columns{}; {} lanes; {pulses} of {} cycles{verify}",
        prefixed(timing.clock_khz as f64 * 1000.0, "Hz"),
        timing.settle,
        timing.convert,
        timing.share,
        if timing.overlapped { ", overlapped" } else { "" },
        timing.lanes,
        timing.pulse,
    )
}

fn show_peak(args: &PeakArgs) -> Done {
    let config = changed(&args.model, &args.settings)?;
    let hardware = &config.hardware;
    let tiles = args.tiles.or(hardware.tile.count_max.map(|n| n as u64)).unwrap_or(1);
    let slices = args.slices.unwrap_or_else(|| u64::from(hardware.slices()));
    for (name, value) in [("--tiles", tiles), ("--slices", slices), ("--cells", args.cells)] {
        if !(1..=1 << 30).contains(&value) {
            return Err(usage(&format!("{name} is {value}, but must lie in 1..={}", 1 << 30)));
        }
    }
    let convention = Convention::with_cells(args.cells);
    let Some(peak) = peak(hardware, tiles, slices, convention) else {
        let message = "the model has no [timing]: give it at least hw.timing.clock_mhz";
        return Err(usage(message));
    };
    if args.json {
        let rate = |(figure, rate): &(crate::lab::price::Figure, f64)| json!({"cycles": figure.cycles, "seconds": figure.seconds, "operations_per_second": rate});
        say(&json!({"event": "peak", "model": config.hardware_name, "tiles": tiles,
            "slices": slices, "convention": convention.to_json(), "macs": peak.macs,
            "alone": rate(&peak.alone), "back_to_back": rate(&peak.back_to_back)})
        .to_string());
        return Ok(());
    }
    say(&format!(
        "{}: {tiles} tiles, {slices} slices, {} MACs a read ({})",
        config.hardware_name,
        peak.macs,
        convention.words()
    ));
    for (name, (figure, rate)) in
        [("one read after the other", &peak.alone), ("back to back", &peak.back_to_back)]
    {
        let time = prefixed(figure.seconds, "s");
        say(&format!(
            "  {name:26} {:>8} cycles {time:>10}  {:.4} TOPS",
            figure.cycles,
            rate / 1e12
        ));
    }
    Ok(())
}

/// What the floor of a cell is as a ratio of conductances.
fn on_off(hardware: &Hardware) -> String {
    let window = hardware.cell.window;
    let (floor, ceiling) = (window.floor(), window.ceiling());
    if floor > 0 {
        let ratio = f64::from(ceiling) / f64::from(floor);
        return format!("{ratio:.1} to 1: hw.cell.ceiling over hw.cell.floor");
    }
    // the nearest floor of ten to one that a cell can have
    let tenth = (u32::from(ceiling) + 5) / 10;
    match tenth {
        0 => "without end: level 0 conducts nothing".into(),
        floor => format!(
            "without end: level 0 conducts nothing; {:.1} to 1 with hw.cell.floor = {floor}",
            f64::from(ceiling) / f64::from(floor)
        ),
    }
}

/// What a pulse does to cells that are not ideal.
fn pulse(hardware: &Hardware) -> Option<String> {
    let device = hardware.device.as_ref()?;
    let curve = device.response.name().replace('_', " ");
    let noise = match device.noise {
        PulseNoise::Off => String::new(),
        PulseNoise::OfStep(share) => format!(", noise {share} of a step"),
        PulseNoise::OfWindow(share) => format!(", noise {share} of the window"),
    };
    let differ = if device.spread == CellSpread::default() { "" } else { ", cells differ" };
    Some(format!("{curve}, {} across the window{noise}{differ}", device.states))
}

fn numbers(hardware: &Hardware) -> Vec<(&'static str, String)> {
    let h = hardware;
    let converter = match h.adc {
        Adc::Ideal => "lossless".into(),
        Adc::Finite { bits, subtract, range } => {
            let range = match range {
                AdcRange::Shift(shift) => format!("step 2^{shift}"),
                AdcRange::Full => "full range".into(),
                AdcRange::Tracking => "tracking".into(),
                AdcRange::Calibrated { headroom, .. } => format!("calibrated + {headroom}"),
            };
            let each = match subtract {
                Subtract::Digital => "each bank",
                Subtract::Current => "the difference of the banks",
            };
            format!("{} bits, {range}, {each}", bits.get())
        }
    };
    let window = (h.cell.window.floor(), h.cell.window.ceiling());
    let mut all = vec![
        ("cell", format!("{} bits, levels {}..={}", h.cell.level_bits.get(), window.0, window.1)),
        ("on/off", on_off(h)),
        ("tile", format!("{} x {} cells a bank", h.tile.rows, h.tile.columns)),
        (
            "drive",
            format!("{} bits, {} slices of {}", h.drive.bits.get(), h.slices(), h.drive.dac_bits),
        ),
        ("converter", converter),
        ("activation table", format!("{} entries", 1u32 << h.digital.lut_bits.get())),
        ("error word", format!("{} bits", h.digital.error_bits.get())),
        ("write", format!("at most {} pulses a cell", h.write.increment_max.get())),
        ("remainder", format!("{} bits", h.write.residual_bits.get())),
    ];
    all.extend(pulse(h).map(|text| ("pulse", text)));
    all
}
