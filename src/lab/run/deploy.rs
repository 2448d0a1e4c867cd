//! What a finished run knows on other chips of its kind, and after a time: the trained levels are loaded anew, left to drift and
//! read.
//!
//! ```text
//! chip 0      the one that learnt: its levels as they are, its faults
//! chip k > 0  another of its kind: seed k decides stuck cells, what loads leave, drift and noise; levels are loaded
//! after t     levels drift from the start of the law to t; with compensation, a factor a layer makes up for their sum
//! ```
//!
//! Every reading starts from the same counters, so chip k after t gives the same whatever was read before. Converter ranges, thresholds
//! and tables stay as they were learnt. See docs/MODEL.md, 3.13.

use std::path::Path;

use super::again::read_again;
use super::{Machine, RunError};
use crate::chip::engine::AllLevels;
use crate::chip::layer::{Listed, check_listed};
use crate::lab::config::{self, Config, ConfigError, Overlay, Sources};
use crate::lab::data::DataRoot;
use crate::lab::store::folder::{self, names};
use crate::lab::store::record::TestOutcome;
use crate::num::tables::DriftTables;

/// Which chips are read, and when.
///
/// ```
/// use dalean::deployment::{Deployment, deploy, summed_up};
/// use dalean::{Backend, Config, DataRoot, Machine, RunEvent, Sources};
///
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// let text = "data.set = \"xor\"\nnetwork.hidden = [4]\nlearning.epochs = 1";
/// let config = Config::load(&Sources { experiment: Some(("mine", text)), ..Sources::default() })?;
/// let folder = format!("dalean-example-chips-{}", std::process::id());
/// let (data, runs) = (DataRoot::new("data"), std::env::temp_dir().join(folder));
/// let machine = Machine::new(Backend::best(), 1)?;
/// let mut run = None;
/// dalean::train(&config, &data, &runs, machine, &mut |event| {
///     if let RunEvent::Started { folder, .. } = event {
///         run = Some(folder.to_owned());
///     }
///     true
/// })?;
///
/// // a tenth of the cells is stuck, on three other chips of the kind
/// let settings = vec!["hw.device.faults.stuck_any=0.1".to_owned()];
/// let asked = Deployment { chips: vec![1, 2, 3], settings, ..Deployment::default() };
/// let run = run.ok_or("every run has started")?;
/// let results = deploy(&run, &data, machine, &asked, &mut |_result| true)?;
/// let [summary] = &summed_up(&results)[..] else { return Err("they were read once".into()) };
/// assert_eq!((results.len(), summary.chips), (3, 3));
/// let median = summary.quantiles[2];
/// assert!(summary.least <= median && median <= summary.greatest);
/// # std::fs::remove_dir_all(&runs)?;
/// # Ok(())
/// # }
/// ```
#[derive(Debug, Clone, Default)]
pub struct Deployment {
    /// Seconds after programming; none: at once, without drift.
    pub after: Vec<f64>,
    /// Numbers of the chips.
    pub chips: Vec<u64>,
    /// Whether a factor a layer makes up for drift.
    pub compensated: bool,
    /// A hardware model whose `[device]` the chips have.
    pub device: Option<String>,
    /// Keys of `hw.device`, as `--set` takes them.
    pub settings: Vec<String>,
}

/// One reading of the test set, or of the final test of a policy.
#[derive(Debug, Clone, PartialEq)]
pub struct ChipResult {
    /// Number of the chip.
    pub chip: u64,
    /// Seconds after programming.
    pub after_s: Option<f64>,
    /// Accuracy as a fraction, or the mean return.
    pub score: f64,
}

/// What the chips of a deployment that were read at one moment came to.
#[derive(Debug, Clone, PartialEq)]
pub struct ChipSummary {
    /// Seconds after programming.
    pub after_s: Option<f64>,
    /// How many were read.
    pub chips: usize,
    /// Mean of their scores.
    pub mean: f64,
    /// Standard deviation; of several.
    pub sd: Option<f64>,
    /// Scores at the places 0.05, 0.25, 0.5, 0.75 and 0.95 among all in order.
    pub quantiles: [f64; 5],
    /// The least score.
    pub least: f64,
    /// The greatest.
    pub greatest: f64,
    /// The first chip that has the least.
    pub worst_chip: u64,
}

/// Puts results together, a summary a moment, in the order in which they were read.
#[must_use]
pub fn summed_up(results: &[ChipResult]) -> Vec<ChipSummary> {
    // by their bits, as there are numbers that do not equal themselves
    let time = |result: &ChipResult| result.after_s.map(f64::to_bits);
    let mut times = Vec::new();
    for result in results {
        if !times.contains(&time(result)) {
            times.push(time(result));
        }
    }
    let at = |bits: Option<u64>| {
        let of: Vec<&ChipResult> = results.iter().filter(|&one| time(one) == bits).collect();
        let mut scores: Vec<f64> = of.iter().map(|one| one.score).collect();
        scores.sort_by(f64::total_cmp);
        let n = scores.len() as f64;
        let mean = scores.iter().sum::<f64>() / n;
        let squares: f64 = scores.iter().map(|score| (score - mean).powi(2)).sum();
        // the first of several that are as bad
        let worst = of.iter().min_by(|a, b| a.score.total_cmp(&b.score)).expect("one was read");
        ChipSummary {
            after_s: bits.map(f64::from_bits),
            chips: scores.len(),
            mean,
            sd: (scores.len() > 1).then(|| (squares / (n - 1.0)).sqrt()),
            quantiles: [0.05, 0.25, 0.5, 0.75, 0.95].map(|place| quantile(&scores, place)),
            least: scores[0],
            greatest: scores[scores.len() - 1],
            worst_chip: worst.chip,
        }
    };
    times.into_iter().map(at).collect()
}

fn wrong(key: &str, found: &str, allowed: &str) -> ConfigError {
    let [key, found, allowed] = [key, found, allowed].map(str::to_owned);
    ConfigError::Value { key, found, allowed }
}

/// A moment after programming.
#[derive(Debug, Clone)]
pub struct Moment {
    /// Seconds; none: at once.
    pub after_s: Option<f64>,
    /// What time did to levels.
    pub drift: Option<DriftTables>,
}

/// The moments at which chips of the kind that a configuration names are read.
///
/// # Errors
/// When nothing of what is asked for varies from chip to chip, or with time.
pub fn moments(config: &Config, deployment: &Deployment) -> Result<Vec<Moment>, ConfigError> {
    let (hardware, drift) = (&config.hardware, config.drift);
    let others = deployment.chips.iter().any(|&chip| chip > 0);
    let spread = hardware.device.as_ref().map(|device| device.spread);
    let varies = !hardware.faults.is_none()
        || spread.is_some_and(|spread| spread.moves_window())
        || hardware.read_noise.is_some()
        || hardware.programming.is_some()
        || (drift.is_some() && !deployment.after.is_empty());
    if others && !varies {
        let allowed = "chips of this kind are all alike: give shares of hw.device.faults, hw.device.programming, \
                       hw.device.read_noise or the ends of hw.device.spread with --set or --hw, or --after with \
                       hw.device.drift";
        return Err(wrong("eval --samples", "asks for other chips", allowed));
    }
    if deployment.compensated && deployment.after.is_empty() {
        let allowed = "it makes up for drift: say with --after when chips are read";
        return Err(wrong("eval --compensate", "is given", allowed));
    }
    if deployment.after.is_empty() {
        return Ok(vec![Moment { after_s: None, drift: None }]);
    }
    let Some(drift) = drift else {
        let allowed = "give hw.device.drift with --set, or --hw with a model that has it, such as hw_models/own/pcm_drift.toml";
        return Err(wrong("hw.device.drift", "is missing", allowed));
    };
    let ends = [hardware.cell.window.ceiling(), hardware.level_greatest()];
    let at = |&seconds: &f64| {
        let tables = drift.after(seconds, ends).ok_or_else(|| {
            let found = format!("is {seconds} s");
            let start = drift.start_s();
            let allowed = format!("levels are of {start} s after programming: give that or more");
            wrong("eval --after", &found, &allowed)
        })?;
        Ok(Moment { after_s: Some(seconds), drift: Some(tables) })
    };
    deployment.after.iter().map(at).collect()
}

/// What a deployment names and a reading does not look at, in words.
///
/// # Errors
/// When the model cannot be read.
pub fn unread(deployment: &Deployment) -> Result<Option<String>, RunError> {
    let Some(model) = &deployment.device else { return Ok(None) };
    let own: toml::Table = config::load_model(model)?.text.parse().expect("a model that was read");
    let mut device = own.get("device").and_then(toml::Value::as_table).cloned().unwrap_or_default();
    let taken = without_pulses(&mut device);
    let tables = taken.iter().map(|name| format!("[device.{name}]")).collect::<Vec<_>>();
    Ok((!taken.is_empty()).then(|| {
        let tables = tables.join(" and ");
        format!("{tables} of {model}: what pulses do; eval gives none, so it is not looked at")
    }))
}

/// Keys that only a pulse has to do with.
const UNREAD: [&str; 7] = [
    "hw.device.response",
    "hw.device.spread.step",
    "hw.device.spread.asymmetry",
    "hw.device.endurance",
    "hw.device.leakage",
    "hw.device.drift.update_s",
    "hw.device.drift.every",
];
/// Tables that only a pulse has to do with, the spread where it has no windows.
const PULSED: [&str; 4] = ["response", "spread", "endurance", "leakage"];

/// Takes the tables out that only pulses have to do with; their names.
fn without_pulses(device: &mut toml::Table) -> Vec<&'static str> {
    let windows =
        |spread: &toml::Value| ["ceiling", "floor"].iter().any(|key| spread.get(key).is_some());
    let read = device.get("spread").is_some_and(windows);
    let names = PULSED.into_iter().filter(|name| *name != "spread" || !read);
    names.filter(|name| device.remove(*name).is_some()).collect()
}

/// The chip of a run with another device.
fn chip(path: &Path, deployment: &Deployment) -> Result<Config, RunError> {
    for setting in &deployment.settings {
        if !setting.trim_start().starts_with("hw.device.") {
            let found = format!("is set by `{setting}`");
            let allowed = "eval changes what cells and reads do, hw.device.*; everything else is as it was learnt with";
            return Err(wrong("eval --set", &found, allowed).into());
        }
        if UNREAD.iter().any(|key| setting.trim_start().starts_with(key)) {
            let found = format!("is set by `{setting}`");
            let allowed = "eval gives no pulses, so what a pulse does changes nothing: remove it, or train with it";
            return Err(wrong("eval --set", &found, allowed).into());
        }
    }
    let text = folder::read_text(path, names::CONFIG)?;
    let name = path.join(names::CONFIG).display().to_string();
    let mut table = toml::Table::new();
    if let Some(model) = &deployment.device {
        let model_text = config::load_model(model)?.text;
        let mut own: toml::Table = model_text.parse().expect("a model that was read");
        config::anchor_map(&mut own, Path::new(model).parent().unwrap_or(Path::new("")));
        let Some(device) = own.remove("device") else {
            let allowed = "name a model with a table [device], such as hw_models/own/pcm_drift.toml, or use --set hw.device.KEY=VALUE";
            return Err(
                wrong("eval --hw", &format!("names {model}, which has none"), allowed).into()
            );
        };
        let mut device = device;
        if let Some(tables) = device.as_table_mut() {
            let taken = without_pulses(tables);
            if tables.is_empty() {
                let allowed = "eval gives no pulses, so that changes nothing: name a model that says what cells and reads do, or train with \
                               this one";
                let found =
                    format!("names {model}, whose [device] has {} alone", taken.join(" and "));
                return Err(wrong("eval --hw", &found, allowed).into());
            }
        }
        let hw = toml::Table::from_iter([("device".to_owned(), device)]);
        table.insert("hw".into(), toml::Value::Table(hw));
    }
    Ok(config::load(&Sources {
        experiment: Some((&name, &text)),
        overlays: &[Overlay { place: "eval --hw", table: &table }],
        settings: &deployment.settings,
        ..Sources::default()
    })?)
}

/// Reads the test set of a run on the chips of a deployment; `each` is told every result and says whether to go on.
///
/// # Errors
/// When the run is damaged or its data is not the same, or when nothing of what is asked for varies on its chip.
pub fn deploy(
    path: &Path,
    data_root: &DataRoot,
    machine: Machine,
    deployment: &Deployment,
    each: &mut dyn FnMut(&ChipResult) -> bool,
) -> Result<Vec<ChipResult>, RunError> {
    let config = chip(path, deployment)?;
    let (hardware, moments) = (&config.hardware, moments(&config, deployment)?);
    let (mut session, _) = read_again(path, data_root, machine)?;
    let layers = session.engines().into_iter().flat_map(|engine| engine.layers());
    let layers = layers.map(|layer| (layer.index, &layer.spec));
    check_listed(&hardware.fault_map, layers, Listed::All)
        .map_err(|error| wrong(error.key, &error.found, &error.allowed))?;
    let copies = session.engines().into_iter().any(|engine| engine.has_copies());
    if copies && !deployment.after.is_empty() {
        let allowed = "cells drift each in its own way, so copies of an array would not stay alike: that is not simulated; take \
                       --after out, or learn with network.copies = 1";
        return Err(wrong("eval --after", "is given where arrays have copies", allowed).into());
    }
    let programming = hardware.programming;
    let levels: Vec<AllLevels> =
        session.engines().iter().map(|engine| engine.all_levels()).collect();
    let counters: Vec<[u64; 3]> =
        session.engines().iter().map(|engine| engine.all_loaded()).collect();
    let own = session.engines().iter().map(|engine| engine.chip_seed()).collect::<Vec<_>>();
    let mut results = Vec::new();
    for &number in &deployment.chips {
        for Moment { after_s, drift } in &moments {
            for (at, driver) in session.networks_mut().into_iter().enumerate() {
                let engine = driver.engine_mut();
                // the chip that learnt is loaded with what it holds, exactly
                let loads = programming.filter(|_| number > 0);
                let set = engine.set_device(hardware, loads);
                set.map_err(|error| wrong(error.key, &error.found, &error.allowed))?;
                engine.set_chip_seed(if number > 0 { number } else { own[at] });
                engine.load_all(&levels[at]);
                engine.set_loaded(counters[at]);
                if let Some(drift) = drift {
                    engine.age(drift, deployment.compensated);
                }
            }
            let hint = "there is nothing to evaluate on";
            let test = session.test()?.ok_or(RunError::Empty { part: "test", hint })?;
            let score = match &test {
                TestOutcome::Classify(test) => test.score.fraction(),
                TestOutcome::Policy(test) => test.episodes.mean().unwrap_or(f64::NAN),
            };
            let result = ChipResult { chip: number, after_s: *after_s, score };
            let go_on = each(&result);
            results.push(result);
            if !go_on {
                return Ok(results);
            }
        }
    }
    Ok(results)
}

/// A number's place among others in order, between those beside it: 0 is the least, 1 the greatest.
fn quantile(sorted: &[f64], place: f64) -> f64 {
    let last = sorted.len().saturating_sub(1);
    let at = place.clamp(0.0, 1.0) * last as f64;
    let (low, high) = (at.floor() as usize, at.ceil() as usize);
    let [a, b] = [low, high].map(|at| sorted.get(at).copied().unwrap_or(f64::NAN));
    a + (b - a) * (at - at.floor())
}

/// Seconds of a span such as `25s`, `1h`, `1d`, `1y` (365.25 days).
#[must_use]
pub fn seconds_of(span: &str) -> Option<f64> {
    let text = span.trim();
    let split = text.find(|c: char| c.is_ascii_alphabetic() && c != 'e').unwrap_or(text.len());
    let (number, unit) = text.split_at(split);
    let seconds = match unit {
        "s" | "" => 1.0,
        "min" => 60.0,
        "h" => 3600.0,
        "d" => 86_400.0,
        "y" => 31_557_600.0,
        _ => return None,
    };
    let number: f64 = number.trim().parse().ok()?;
    (number > 0.0 && number.is_finite()).then_some(number * seconds)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spans_have_units() {
        let found = ["25s", "3", "2 min", "1h", "1d", "1y", "1e3s"].map(seconds_of);
        let wanted = [25.0, 3.0, 120.0, 3600.0, 86_400.0, 31_557_600.0, 1000.0].map(Some);
        assert_eq!(found, wanted);
        assert_eq!(["", "d", "-1d", "1w", "1.2.3s", "infs"].map(seconds_of), [None; 6]);
    }

    #[test]
    fn summaries_are_of_a_moment_each_and_name_the_first_of_the_worst() {
        let of = |chip, after_s, score| ChipResult { chip, after_s, score };
        let (now, later) = (Some(1.0), Some(2.0));
        let results = [of(1, later, 0.5), of(1, now, 1.0), of(2, later, 0.25), of(3, later, 0.25)];
        let [two, one] = &summed_up(&results)[..] else { panic!("two moments") };
        assert_eq!((two.after_s, two.chips, two.worst_chip), (later, 3, 2));
        assert_eq!((two.least, two.greatest, two.quantiles[2]), (0.25, 0.5, 0.25));
        assert_eq!((one.after_s, one.chips, one.mean, one.sd), (now, 1, 1.0, None));
        assert!(summed_up(&[]).is_empty());
        assert_eq!(summed_up(&[of(1, Some(f64::NAN), f64::NAN)]).len(), 1);
    }

    #[test]
    fn quantiles_lie_between_the_numbers_beside_them() {
        let sorted = [1.0, 2.0, 4.0];
        let found = [0.0, 0.25, 0.5, 0.75, 1.0].map(|place| quantile(&sorted, place));
        assert_eq!(found, [1.0, 1.5, 2.0, 3.0, 4.0]);
        assert_eq!(quantile(&[7.0], 0.3), 7.0);
        assert!(quantile(&[], 0.5).is_nan());
    }
}
