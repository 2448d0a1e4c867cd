//! `[device.response]` and `[device.spread]`: from numbers to a checked device.

use serde::{Deserialize, Serialize};

use super::super::ConfigError;
use super::super::check::wrong;
use super::super::file::keys;
use crate::chip::device::{CellSpread, DeviceError, DeviceSpec, PulseNoise};
use crate::chip::hardware::Window;
use crate::num::fixed::Millionths;
use crate::num::tables::{
    ExponentialSteps, LinearSteps, MeasuredSteps, NeurosimSteps, Response, SoftBoundSteps,
    SpreadLaw, TableSteps,
};

keys! {
    /// `[device.response]`: what a pulse does to a cell.
    ResponseFile {
        /// How the step of a pulse depends on where the cell lies in its window.
        curve: String,
        /// Pulses of mean length across the window. Levels are the resolution that the cell is simulated with; rates count pulses.
        states: i64,
        /// Steps up, in mean steps: at the floor and at the ceiling (linear), at the floor alone (soft_bounds), at equally spaced places
        /// from the floor to the ceiling (table).
        up: Vec<f64>,
        /// Steps down, in mean steps: at the floor and at the ceiling (linear), at the ceiling alone (soft_bounds), at equally spaced places
        /// from the floor to the ceiling (table).
        down: Vec<f64>,
        /// Of steps up and down: how much the exponential part takes off the mean step.
        amplitude: Vec<f64>,
        /// Of steps up and down: how fast the exponential part grows.
        growth: Vec<f64>,
        /// The argument of the exponential part at the floor and at the ceiling.
        z: Vec<f64>,
        /// Nonlinearity labels of rising and of falling pulses, as MLP+NeuroSim has them.
        labels: Vec<f64>,
        /// Rows of three: where a cell lies, 0 to 1 of the window and rising, and its steps up and down in windows.
        points: Vec<[f64; 3]>,
        /// By which share steps up are longer than the curve says, and steps down shorter.
        asymmetry: f64,
        /// Standard deviation of a step from pulse to pulse.
        noise: f64,
        /// What that is a share of.
        noise_of: String,
        /// Standard deviation of what a write leaves beside the level that its pulses reached, in windows: reads see it, and the next pulse begins where pulses had left the cell.
        write_noise: f64,
        /// Where pulses are verified (`timing.verify`): pulses that a cell is given at most for each that is asked for. It gets no more once it has moved as far as pulses of mean length would take it, to half of one.
        tries: i64,
        /// Where the numbers come from.
        source: String,
        /// How far to trust the numbers.
        kind: String,
    }
    /// `[device.spread]`: how cells differ.
    SpreadFile {
        /// Standard deviation of the factor of a cell's steps, or of its logarithm.
        step: f64,
        /// The law of that factor, whose median is 1.
        step_law: String,
        /// Standard deviation of the share by which a cell's steps up are longer, and its steps down shorter.
        asymmetry: f64,
        /// Standard deviation of a cell's ceiling, in windows. What would lie beyond the levels there are lies on their end: leave room.
        ceiling: f64,
        /// Standard deviation of a cell's floor, in windows.
        floor: f64,
        /// Where the numbers come from.
        source: String,
        /// How far to trust the numbers.
        kind: String,
    }
}

/// Words of `curve`, and which numbers each has.
const CURVES: [(&str, &[&str]); 6] = [
    ("linear", &["up", "down"]),
    ("soft_bounds", &["up", "down"]),
    ("exponential", &["amplitude", "growth", "z"]),
    ("neurosim", &["labels"]),
    ("table", &["up", "down"]),
    ("measured", &["points"]),
];

type Key<'a> = &'a dyn Fn(&str) -> String;

/// A number with at most six places behind the point, as it is kept.
pub(super) fn millionths(key: &str, value: f64) -> Result<Millionths, ConfigError> {
    let fine = (value * 1e6).round();
    let close = (fine - value * 1e6).abs() <= 1e-9 * fine.abs().max(1.0);
    if !close || fine.abs() > 1e15 {
        let allowed = "it has at most six places behind the point, and is far below 10^9";
        return Err(wrong(key, format!("is {value}"), allowed));
    }
    Ok(Millionths(fine as i64))
}

/// A number above 0; none is 0.
fn above(key: &str, value: Option<f64>, without: &str) -> Result<Millionths, ConfigError> {
    let Some(value) = value else { return Ok(Millionths(0)) };
    let kept = millionths(key, value)?;
    if kept.0 > 0 {
        return Ok(kept);
    }
    Err(wrong(key, format!("is {value}"), format!("it lies above 0; {without}")))
}

/// So many numbers, or those of a default.
fn numbers<const N: usize>(
    key: &str,
    given: Option<&Vec<f64>>,
    default: [Millionths; N],
) -> Result<[Millionths; N], ConfigError> {
    let allowed = format!("this curve has {N} of them");
    let Some(given) = given else { return Ok(default) };
    let Ok(given): Result<[f64; N], _> = given.as_slice().try_into() else {
        return Err(wrong(key, format!("has {} numbers", given.len()), allowed));
    };
    let mut all = [Millionths(0); N];
    for (to, value) in all.iter_mut().zip(given) {
        *to = millionths(key, value)?;
    }
    Ok(all)
}

/// The device of a chip with that window; `None` of ideal cells. `key` puts the place of a table before a name.
pub(super) fn resolve(
    response: Option<&ResponseFile>,
    spread: Option<&SpreadFile>,
    window: Window,
    key: Key<'_>,
) -> Result<Option<DeviceSpec>, ConfigError> {
    if response.is_none() && spread.is_none() {
        return Ok(None);
    }
    let ideal = ResponseFile::default();
    let file = response.unwrap_or(&ideal);
    let at = |name: &str| key(&format!("device.response.{name}"));
    let curve = file.curve.as_deref().unwrap_or("linear");
    let Some((_, own)) = CURVES.iter().find(|(name, _)| *name == curve) else {
        let names = CURVES.map(|(name, _)| name).join(", ");
        return Err(wrong(
            &at("curve"),
            format!("is \"{curve}\""),
            format!("it is one of {names}"),
        ));
    };
    let given = [
        ("up", file.up.is_some()),
        ("down", file.down.is_some()),
        ("amplitude", file.amplitude.is_some()),
        ("growth", file.growth.is_some()),
        ("z", file.z.is_some()),
        ("labels", file.labels.is_some()),
        ("points", file.points.is_some()),
    ];
    if let Some((name, _)) = given.iter().find(|(name, given)| *given && !own.contains(name)) {
        let allowed = format!("curve = \"{curve}\" has {}: remove the key", own.join(", "));
        return Err(wrong(&at(name), "is given", allowed));
    }
    let levels = u32::from(window.ceiling() - window.floor());
    let states = match file.states {
        None => levels,
        Some(states) => u32::try_from(states).map_err(|_| {
            let allowed = format!("it must lie in 1..={}", DeviceSpec::STATES_MAX);
            wrong(&at("states"), format!("is {states}"), allowed)
        })?,
    };
    let response = self::curve(file, curve, states, &at)?;
    let asymmetry =
        file.asymmetry.map_or(Ok(Millionths(0)), |a| millionths(&at("asymmetry"), a))?;
    let noise = above(&at("noise"), file.noise, "without the key there is none")?;
    let of = file.noise_of.as_deref();
    let noise = match of {
        Some(of) if noise.0 == 0 => {
            let allowed = "without device.response.noise there is none: give it, or remove the key";
            return Err(wrong(&at("noise_of"), format!("is \"{of}\""), allowed));
        }
        None if noise.0 == 0 => PulseNoise::Off,
        None | Some("step") => PulseNoise::OfStep(noise),
        Some("window") => PulseNoise::OfWindow(noise),
        Some(of) => {
            return Err(wrong(
                &at("noise_of"),
                format!("is \"{of}\""),
                "it is \"step\" or \"window\"",
            ));
        }
    };
    let device = DeviceSpec {
        response,
        states,
        asymmetry,
        noise,
        write_noise: above(&at("write_noise"), file.write_noise, "without the key there is none")?,
        tries: file.tries.map_or(Ok(DeviceSpec::TRIES), |tries| {
            u32::try_from(tries).map_err(|_| {
                let allowed = format!("it must lie in 1..={}", DeviceSpec::TRIES_MAX);
                wrong(&at("tries"), format!("is {tries}"), allowed)
            })
        })?,
        spread: spread.map_or(Ok(CellSpread::default()), |table| differences(table, key))?,
    };
    device
        .check()
        .map_err(|DeviceError { key: name, found, allowed }| wrong(&key(name), found, allowed))?;
    Ok(Some(device))
}

/// The curve of a name; what is not said of it makes every step the mean one.
fn curve(
    file: &ResponseFile,
    name: &str,
    states: u32,
    at: Key<'_>,
) -> Result<Response, ConfigError> {
    let (none, one) = (Millionths(0), Millionths::ONE);
    Ok(match name {
        "soft_bounds" => {
            let SoftBoundSteps { up, down } = SoftBoundSteps::default();
            let [up] = numbers(&at("up"), file.up.as_ref(), [up])?;
            let [down] = numbers(&at("down"), file.down.as_ref(), [down])?;
            Response::SoftBounds(SoftBoundSteps { up, down })
        }
        "exponential" => Response::Exponential(ExponentialSteps {
            amplitude: numbers(&at("amplitude"), file.amplitude.as_ref(), [none; 2])?,
            growth: numbers(&at("growth"), file.growth.as_ref(), [one; 2])?,
            z: numbers(&at("z"), file.z.as_ref(), [none, one])?,
        }),
        "neurosim" => Response::Neurosim(NeurosimSteps {
            labels: numbers(&at("labels"), file.labels.as_ref(), [none; 2])?,
        }),
        "table" => {
            let row = |name: &str, given: Option<&Vec<f64>>| {
                let given = given.map_or(&[1.0, 1.0][..], Vec::as_slice);
                given.iter().map(|&step| millionths(&at(name), step)).collect::<Result<_, _>>()
            };
            Response::Table(TableSteps {
                up: row("up", file.up.as_ref())?,
                down: row("down", file.down.as_ref())?,
            })
        }
        "measured" => {
            let mean = Millionths(1_000_000 / i64::from(states.max(1)));
            let Some(rows) = &file.points else {
                let points = [none, one].map(|x| [x, mean, mean]).into();
                return Ok(Response::Measured(MeasuredSteps { points }));
            };
            let row = |row: &[f64; 3]| -> Result<_, ConfigError> {
                Ok([
                    millionths(&at("points"), row[0])?,
                    millionths(&at("points"), row[1])?,
                    millionths(&at("points"), row[2])?,
                ])
            };
            Response::Measured(MeasuredSteps {
                points: rows.iter().map(row).collect::<Result<_, _>>()?,
            })
        }
        _ => {
            let LinearSteps { up, down } = LinearSteps::default();
            Response::Linear(LinearSteps {
                up: numbers(&at("up"), file.up.as_ref(), up)?,
                down: numbers(&at("down"), file.down.as_ref(), down)?,
            })
        }
    })
}

/// How cells differ.
fn differences(table: &SpreadFile, key: Key<'_>) -> Result<CellSpread, ConfigError> {
    let at = |name: &str| key(&format!("device.spread.{name}"));
    let share = |name: &str, value: Option<f64>| {
        above(&at(name), value, "without the key cells do not differ in it")
    };
    let step = share("step", table.step)?;
    let step_law = match table.step_law.as_deref() {
        Some(law) if table.step.is_none() => {
            let allowed =
                "without device.spread.step there is no such factor: give it, or remove the key";
            return Err(wrong(&at("step_law"), format!("is \"{law}\""), allowed));
        }
        None | Some("normal") => SpreadLaw::Normal,
        Some("log_normal") => SpreadLaw::LogNormal,
        Some(law) => {
            let allowed = "it is \"normal\" or \"log_normal\"";
            return Err(wrong(&at("step_law"), format!("is \"{law}\""), allowed));
        }
    };
    let spread = CellSpread {
        step_law,
        step,
        asymmetry: share("asymmetry", table.asymmetry)?,
        ceiling: share("ceiling", table.ceiling)?,
        floor: share("floor", table.floor)?,
    };
    if spread == (CellSpread { step_law, ..CellSpread::default() }) {
        let allowed = "give step, asymmetry, ceiling or floor, or take the table out";
        return Err(wrong(&key("device.spread"), "says nothing", allowed));
    }
    Ok(spread)
}
