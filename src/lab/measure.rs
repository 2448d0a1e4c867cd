//! A device from its own measurements: a table of pulses goes in, a hardware model that can be trained on comes out.
//!
//! ```text
//! read.rs     a table (CSV) to rows of pulses          settle.rs   mean steps, factors of devices, noise, in turns
//! cloud.rs    least squares                            kinds.rs    each kind of curve, fitted; which one is proposed
//! model.rs    the file                                 figure and messages: `lab::report`, `cli`
//! ```
//!
//! Conductances are taken as shares of the window that is the mean of the devices' least and greatest ones: their unit does not
//! matter. Floats are allowed, as nothing here is a result of the engine, but only `+ - * /` and pinned functions: the same table
//! gives the same file on every machine. See docs/MODEL.md, 3.14.

mod cloud;
mod kinds;
mod model;
mod read;
mod settle;

pub use kinds::KindFit;

use crate::chip::device::{CellSpread, DeviceSpec, PulseNoise};
use crate::lab::data::csv::CsvError;
use crate::num::fixed::Millionths;
use crate::num::tables::SpreadLaw;
use settle::{Scatter, Settled, deviation, deviations};

/// Devices of a table, at most.
const DEVICES_MAX: usize = 10_000;
/// Devices whose differences tell of others.
const DEVICES_MIN: usize = 3;
/// Pulses of each polarity, at least.
const PULSES_MIN: usize = 8;
/// Pulses of each polarity that end inside the window, at least.
const FREE_MIN: usize = 4;
/// Parts of the window that steps are first found in.
const PARTS: usize = 16;
/// What is too small for a file.
const LEAST: f64 = 5e-4;

/// Pulses between two reads of a device, and what was read behind them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pulse {
    /// Whether they were meant to raise the conductance.
    pub rises: bool,
    /// How many.
    pub count: u32,
    /// The conductance behind them.
    pub to: f64,
}

/// Pulses of a device that follow one another.
#[derive(Debug, Clone, PartialEq)]
pub struct PulseRow {
    /// Number of the device.
    pub device: usize,
    /// Its conductance before the first.
    pub start: f64,
    /// All of them.
    pub pulses: Vec<Pulse>,
}

/// What a table of pulses says of a device. Conductances are in windows, 0 the mean floor and 1 the mean ceiling, but for
/// [`MeasuredDevice::window`].
#[derive(Debug, Clone)]
pub struct MeasuredDevice {
    /// The table's name, without its folder.
    pub file: String,
    /// The first digits of the hash of its bytes.
    pub digest: String,
    /// What devices are called; one without a name where there is only one.
    pub devices: Vec<String>,
    /// Reads in all.
    pub reads: usize,
    /// Pulses up and down.
    pub pulses: [u64; 2],
    /// Mean floor and ceiling, in the table's unit.
    pub window: [f64; 2],
    /// Floor and ceiling of each device.
    pub ends: Vec<[f64; 2]>,
    /// Factors of each device's steps, up and down.
    pub factors: Vec<[f64; 2]>,
    /// Rows of pulses.
    pub rows: Vec<PulseRow>,
    /// Steps up and down at equally spaced places, whatever the kind.
    pub steps: [Vec<f64>; 2],
    /// All kinds, the proposed one first.
    pub kinds: Vec<KindFit>,
    /// The device as it is proposed.
    pub device: DeviceSpec,
    /// What a read seems to miss by.
    pub read_noise: f64,
    /// What was told from the table and not stated, and what is left out.
    pub said: Vec<String>,
}

/// Why a table says nothing of a device.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum MeasureError {
    /// No text, or no table.
    #[error(transparent)]
    Table(#[from] CsvError),
    /// No line.
    #[error(
        "holds no reads; it has a line of names, such as `device,pulse,polarity,conductance`, and a line a read"
    )]
    Empty,
    /// No names.
    #[error(
        "line 1 holds numbers ({found}) and no names; name the columns there, such as `pulse,conductance` or \
         `device,pulse,polarity,conductance`"
    )]
    Header {
        /// Start of the line.
        found: String,
    },
    /// No conductance.
    #[error(
        "line 1 names no conductance, only {names}; call its column `conductance`, `g` or `current`, with or without a \
         unit{hint}"
    )]
    Conductance {
        /// Names found.
        names: String,
        /// What may have been meant.
        hint: String,
    },
    /// Two columns of one meaning.
    #[error("line 1 has two columns for a {what}, `{}` and `{}`; rename one of them", .found[0], .found[1])]
    Twice {
        /// Of what.
        what: &'static str,
        /// Both names.
        found: [String; 2],
    },
    /// A line of another length.
    #[error("line {line} has {found} fields, but line 1 names {wanted} columns")]
    Ragged {
        /// Line, from 1.
        line: u64,
        /// Fields found.
        found: usize,
        /// Columns.
        wanted: usize,
    },
    /// A field that cannot be what its column is.
    #[error("line {line}, column {column} holds `{found}`; {allowed}")]
    Field {
        /// Line, from 1.
        line: u64,
        /// Column, from 0, and its name.
        column: String,
        /// Start of the field.
        found: String,
        /// What is allowed.
        allowed: &'static str,
    },
    /// Too many lines.
    #[error("has more than {limit} reads; keep some of its devices or cycles")]
    Large {
        /// Most reads.
        limit: usize,
    },
    /// Too many devices.
    #[error("has more than {limit} devices; keep some of them")]
    Devices {
        /// Most devices.
        limit: usize,
    },
    /// Too many pulses between two reads.
    #[error(
        "line {line} lies {found} pulses behind the read before it, at most {limit} are followed; is the column of pulses right?"
    )]
    Between {
        /// Line, from 1.
        line: u64,
        /// Pulses found.
        found: i64,
        /// Most pulses.
        limit: i64,
    },
    /// One conductance.
    #[error(
        "{device} has the same conductance in every line, {found}: nothing moves it; take it out"
    )]
    Still {
        /// Which.
        device: String,
        /// Its conductance.
        found: String,
    },
    /// Too few pulses one way.
    #[error(
        "has {} pulses up and {} down, but at least {PULSES_MIN} of each are needed: a synapse that learns goes both \
         ways. Without a column `polarity`, pulses are told by where the conductance turns", .found[0], .found[1]
    )]
    OneWay {
        /// Pulses up and down.
        found: [usize; 2],
    },
    /// Pulses that reach the ends at once.
    #[error(
        "has {} pulses up and {} down that move the conductance and end inside its window, but at least {FREE_MIN} of each \
         are needed: how far a pulse leads is not seen where the window ends", .free[0], .free[1]
    )]
    Ends {
        /// Pulses up and down.
        free: [usize; 2],
    },
    /// Pulses that move the wrong way.
    #[error(
        "pulses {way} move the conductance the other way on the mean; exchange the words of the column `polarity`"
    )]
    Backwards {
        /// Which.
        way: &'static str,
    },
}

/// Counts as floats.
fn size(count: usize) -> f64 {
    count as f64
}

impl MeasuredDevice {
    /// Reads a table of pulses called `file` and fits every kind of device to it.
    ///
    /// # Errors
    /// When it is no such table, or says too little.
    pub fn new(file: &str, bytes: &[u8]) -> Result<Self, MeasureError> {
        let read::Table { devices, mut rows, ends, reads, mut said } = read::read(bytes)?;
        let mean = |of: usize| ends.iter().map(|ends| ends[of]).sum::<f64>() / size(ends.len());
        let window = [mean(0), mean(1)];
        let share = |g: f64| (g - window[0]) / (window[1] - window[0]);
        let ends: Vec<_> = ends.into_iter().map(|ends| ends.map(share)).collect();
        for row in &mut rows {
            row.start = share(row.start);
            row.pulses.iter_mut().for_each(|pulse| pulse.to = share(pulse.to));
        }
        let points = settle::points(&rows, &ends);
        let of = |side: usize| points.iter().filter(move |point| point.side == side);
        let found = [0, 1].map(|side| of(side).count());
        if found.iter().any(|count| *count < PULSES_MIN) {
            return Err(MeasureError::OneWay { found });
        }
        for (side, way) in [(0, "up"), (1, "down")] {
            if of(side).map(|point| point.y * point.count).sum::<f64>() <= 0.0 {
                return Err(MeasureError::Backwards { way });
            }
        }
        let pulses = [0, 1].map(|side| of(side).map(|point| point.count as u64).sum());
        let parts = PARTS.min(found[0].min(found[1]) / 4).max(2);
        let mut settled = Settled::new(points, &ends, parts);
        let of = |side: usize| settled.points.iter().filter(move |p| p.free && p.side == side);
        let free = [0, 1].map(|side| of(side).count());
        if free.iter().any(|free| *free < FREE_MIN) || settled.mean.is_nan() || settled.mean <= 0.0
        {
            return Err(MeasureError::Ends { free });
        }
        let kinds = kinds::all(&settled, &rows, &ends);
        let best = &kinds[0];
        let steps = best.steps();
        settled.scatter = settled.scatter_about(|side, x| steps(x)[side], size(best.numbers));
        drop(steps);
        let device = DeviceSpec {
            response: best.response.clone(),
            states: best.states,
            asymmetry: best.asymmetry,
            noise: noise(&settled.scatter),
            write_noise: Millionths(0),
            tries: DeviceSpec::TRIES,
            spread: spread(&settled, &ends, &mut said),
        };
        let read_noise = settled.scatter.read;
        let (steps, factors) = (settled.rows, settled.factors);
        let digest = blake3::hash(bytes).to_hex()[..12].to_owned();
        let file = file.chars().map(|c| if c.is_control() { '?' } else { c }).collect();
        Ok(Self {
            file,
            digest,
            devices,
            reads,
            pulses,
            window,
            ends,
            factors,
            rows,
            steps,
            kinds,
            device,
            read_noise,
            said,
        })
    }

    /// The proposed kind.
    #[must_use]
    pub fn best(&self) -> &KindFit {
        &self.kinds[0]
    }

    /// Least over greatest conductance of the window, where that is above 0.
    #[must_use]
    pub fn on_off(&self) -> Option<f64> {
        (self.window[0] > 0.0).then(|| self.window[1] / self.window[0])
    }

    /// Why the first kind is proposed, in words.
    #[must_use]
    pub fn reason(&self) -> String {
        let best = self.best();
        let name = best.response.name();
        let least = self.kinds.iter().min_by(|a, b| a.worth.total_cmp(&b.worth));
        let alike: Vec<_> = self.kinds[1..].iter().filter(|kind| kind.near).collect();
        match least {
            Some(least) if least.response != best.response => format!(
                "{name}: within 3 % of a step of {}, whose criterion is the least, with {} numbers in place of {}",
                least.response.name(),
                best.numbers,
                least.numbers,
            ),
            _ if alike.is_empty() => {
                format!(
                    "{name}: its criterion is the least, and no other kind comes within 3 % of a step of it"
                )
            }
            _ => {
                let names: Vec<_> = alike.iter().map(|kind| kind.response.name()).collect();
                format!(
                    "{name}: its criterion is the least; as near to 3 % of a step, but with more numbers: {}",
                    names.join(", ")
                )
            }
        }
    }
}

/// A share that a file can say; what is too small is none.
fn share(value: f64, most: f64) -> Millionths {
    if value < LEAST { Millionths(0) } else { kinds::millionths(value, [0.0, most]) }
}

fn noise(scatter: &Scatter) -> PulseNoise {
    let most = if scatter.of_step { 100.0 } else { 1.0 };
    match kinds::millionths(scatter.share, [0.0, most]) {
        Millionths(0) => PulseNoise::Off,
        share if scatter.of_step => PulseNoise::OfStep(share),
        share => PulseNoise::OfWindow(share),
    }
}

/// What devices differ by; what is known of it too little is said.
fn spread(settled: &Settled, ends: &[[f64; 2]], said: &mut Vec<String>) -> CellSpread {
    let none = CellSpread::default();
    if ends.len() < DEVICES_MIN {
        let count = if ends.len() == 1 { "one device says" } else { "two devices say" };
        said.push(format!(
            "{count} nothing of how cells differ: without `device.spread` all are alike"
        ));
        return none;
    }
    let wide = settled.is_wide();
    let logarithms = |of: &[f64; 2]| libm::log(0.5 * (of[0] + of[1]));
    let [plain, lean] = deviations(&settled.factors);
    let step = if wide { deviation(settled.factors.iter().map(logarithms)) } else { plain };
    // the factors themselves are only known so well
    let unknown = settled.unknown();
    let real = |sd: f64| libm::sqrt((sd * sd - unknown).max(0.0));
    let of_ends = |at: usize| deviation(ends.iter().map(|ends| ends[at]));
    CellSpread {
        step_law: if wide { SpreadLaw::LogNormal } else { SpreadLaw::Normal },
        step: share(real(step), 2.0),
        asymmetry: share(real(lean), 1.0),
        ceiling: share(of_ends(1), 1.0),
        floor: share(of_ends(0), 1.0),
    }
}

#[cfg(test)]
mod tests;
