//! From a table of pulses to rows of pulses: which column holds what, and which way each pulse led.
//!
//! A line is a read of one device behind a pulse. Columns are known by their names; without a column of polarities rows are
//! told apart where the conductance turns by more than a third of what the device spans, or where pulses are counted anew.

use std::collections::BTreeMap;

use super::{MeasureError, Pulse, PulseRow};
use crate::lab::data::csv::{number_of, reader, shown, text_of};
use crate::lab::near;

/// Bytes of a table, at most.
const BYTES_MAX: u64 = 1 << 28;
/// Reads, at most.
const READS_MAX: usize = 4_000_000;
/// Pulses between two reads, at most.
const BETWEEN_MAX: i64 = 1_000_000;
/// A turn, as a share of what a device spans.
const TURN: f64 = 0.3;

/// What a column can hold, and how it is called then: letters and digits alone, in small letters, without a unit.
const COLUMNS: [(&str, &[&str]); 4] = [
    ("conductance", &["conductance", "g", "cond", "current", "i"]),
    ("pulse", &["pulse", "pulses", "pulsenumber", "pulseno", "pulseindex", "n", "number", "index"]),
    ("polarity", &["polarity", "direction", "sign", "phase", "operation", "type"]),
    ("device", &["device", "deviceid", "devicenumber", "cell", "cellid", "id", "sample"]),
];
/// Units that may stand behind the name of a conductance; only ratios count.
const UNITS: [&str; 20] = [
    "s",
    "ms",
    "us",
    "µs",
    "μs",
    "ns",
    "ps",
    "siemens",
    "millisiemens",
    "microsiemens",
    "nanosiemens",
    "a",
    "ma",
    "ua",
    "µa",
    "μa",
    "na",
    "pa",
    "amperes",
    "au",
];
const RISES: [&str; 14] = [
    "up",
    "u",
    "+",
    "potentiation",
    "potentiate",
    "pot",
    "p",
    "ltp",
    "set",
    "rise",
    "rising",
    "increase",
    "positive",
    "pos",
];
const FALLS: [&str; 14] = [
    "down",
    "d",
    "-",
    "depression",
    "depress",
    "dep",
    "n",
    "ltd",
    "reset",
    "fall",
    "falling",
    "decrease",
    "negative",
    "neg",
];

/// A line.
#[derive(Debug, Clone, Copy)]
struct Read {
    line: u64,
    pulse: Option<i64>,
    conductance: f64,
    /// Which way the pulse before it led; none where there was no pulse, or no column says so.
    rises: Option<bool>,
}

/// What a table holds.
#[derive(Debug)]
pub(super) struct Table {
    pub(super) devices: Vec<String>,
    pub(super) rows: Vec<PulseRow>,
    /// Least and greatest conductance of each device.
    pub(super) ends: Vec<[f64; 2]>,
    pub(super) reads: usize,
    /// What was told and not stated.
    pub(super) said: Vec<String>,
}

/// Where a table has what.
struct Places {
    names: Vec<String>,
    of: [Option<usize>; 4],
}

impl Places {
    fn column(&self, of: usize) -> String {
        self.of[of].map_or_else(String::new, |at| format!("{at} (`{}`)", self.names[at]))
    }
}

/// Reads a table.
pub(super) fn read(bytes: &[u8]) -> Result<Table, MeasureError> {
    let (text, separator) = text_of(bytes, BYTES_MAX)?;
    let mut lines = reader(&text, separator);
    let mut record = ::csv::ByteRecord::new();
    if !lines.read_byte_record(&mut record).map_err(broken)? {
        return Err(MeasureError::Empty);
    }
    let mut said = vec![];
    let places = places(&record, separator, &mut said)?;
    let mut devices: Vec<(String, Vec<Read>)> = vec![];
    let mut known = BTreeMap::new();
    let mut count = 0;
    while lines.read_byte_record(&mut record).map_err(broken)? {
        let line = record.position().map_or(0, ::csv::Position::line);
        if record.len() != places.names.len() {
            let (found, wanted) = (record.len(), places.names.len());
            return Err(MeasureError::Ragged { line, found, wanted });
        }
        count += 1;
        if count > READS_MAX {
            return Err(MeasureError::Large { limit: READS_MAX });
        }
        let name = places.of[3].map_or_else(String::new, |at| shown(&record[at]));
        let one = read_line(&record, line, &places, separator)?;
        let next = devices.len();
        let at = *known.entry(name.clone()).or_insert(next);
        if at == super::DEVICES_MAX {
            return Err(MeasureError::Devices { limit: super::DEVICES_MAX });
        }
        if at == next {
            devices.push((name, vec![]));
        }
        devices[at].1.push(one);
    }
    if count == 0 {
        return Err(MeasureError::Empty);
    }
    if places.of[1].is_none() {
        said.push("no column counts pulses: each line is one pulse after the line before".into());
    }
    if places.of[2].is_none() {
        said.push(
            "no column says which way a pulse led: it is told from where the conductance turns"
                .into(),
        );
    }
    let mut table = Table { devices: vec![], rows: vec![], ends: vec![], reads: count, said };
    for (device, (name, reads)) in devices.into_iter().enumerate() {
        let ends = reads.iter().map(|read| read.conductance);
        let ends = ends.fold([f64::MAX, f64::MIN], |[low, high], g| [low.min(g), high.max(g)]);
        if ends[1] <= ends[0] {
            let found = format!("{}", ends[0]);
            return Err(MeasureError::Still { device: called(&name), found });
        }
        let told = places.of[2].is_none().then(|| turns(&reads, TURN * (ends[1] - ends[0])));
        rows_of(device, &reads, told.as_deref(), &mut table.rows)
            .map_err(|(line, found)| MeasureError::Between { line, found, limit: BETWEEN_MAX })?;
        table.devices.push(name);
        table.ends.push(ends);
    }
    Ok(table)
}

fn broken(error: ::csv::Error) -> MeasureError {
    MeasureError::Table(error.into())
}

/// `device x`, or what there is without names.
pub(super) fn called(name: &str) -> String {
    if name.is_empty() { "the device".into() } else { format!("device `{name}`") }
}

/// Letters and digits of a name, in small letters, without what stands in brackets.
fn plain(name: &str) -> Vec<String> {
    let open = name.find(['(', '[']).unwrap_or(name.len());
    let words = name[..open].split(|c: char| !c.is_alphanumeric());
    words.filter(|word| !word.is_empty()).map(str::to_lowercase).collect()
}

/// Which columns there are.
fn places(
    header: &::csv::ByteRecord,
    separator: u8,
    said: &mut Vec<String>,
) -> Result<Places, MeasureError> {
    let names: Vec<String> = header.iter().map(shown).collect();
    if header.iter().all(|field| number_of(field, separator).is_some()) {
        return Err(MeasureError::Header { found: names.join(", ") });
    }
    let mut of = [None; 4];
    let mut unused = vec![];
    for (at, name) in names.iter().enumerate() {
        let mut words = plain(name);
        let whole = words.concat();
        if words.len() > 1 && words.last().is_some_and(|word| UNITS.contains(&&**word)) {
            words.pop();
        }
        let known = |words: &str| COLUMNS.iter().position(|(_, names)| names.contains(&words));
        let found = known(&whole).or_else(|| known(&words.concat()).filter(|&of| of == 0));
        match found {
            Some(found) if of[found].is_none() => of[found] = Some(at),
            Some(found) => {
                let first = of[found].map_or_else(String::new, |at: usize| names[at].clone());
                let what = COLUMNS[found].0;
                return Err(MeasureError::Twice { what, found: [first, name.clone()] });
            }
            None => unused.push(format!("`{name}`")),
        }
    }
    if of[0].is_none() {
        let known = COLUMNS[0].1.iter().copied();
        let near = names.iter().map(|name| near::hint(&plain(name).concat(), known.clone()));
        let hint = near.into_iter().find(|hint| !hint.is_empty()).unwrap_or_default();
        let names = names.iter().map(|name| format!("`{name}`")).collect::<Vec<_>>().join(", ");
        return Err(MeasureError::Conductance { names, hint });
    }
    if !unused.is_empty() {
        said.push(format!("columns that are not used: {}", unused.join(", ")));
    }
    Ok(Places { names, of })
}

fn read_line(
    record: &::csv::ByteRecord,
    line: u64,
    places: &Places,
    separator: u8,
) -> Result<Read, MeasureError> {
    let wrong = |of: usize, allowed: &'static str| {
        let found = places.of[of].map_or_else(String::new, |at| shown(&record[at]));
        MeasureError::Field { line, column: places.column(of), found, allowed }
    };
    let number = |of: usize| places.of[of].map(|at| number_of(&record[at], separator));
    let conductance = match number(0).flatten() {
        Some(conductance) if conductance >= 0.0 => conductance,
        _ => return Err(wrong(0, "a conductance is a number, 0 or more, in any unit")),
    };
    let pulse = match number(1) {
        None => None,
        Some(Some(pulse)) if pulse.fract() == 0.0 && (0.0..=1e15).contains(&pulse) => {
            Some(pulse as i64)
        }
        Some(_) => return Err(wrong(1, "a pulse has a whole number, 0 or more")),
    };
    let rises = match places.of[2].map(|at| (shown(&record[at]), number_of(&record[at], separator)))
    {
        None => None,
        Some((_, Some(sign))) if sign > 0.0 => Some(true),
        Some((_, Some(sign))) if sign < 0.0 => Some(false),
        // a read before any pulse
        Some((_, Some(_))) => None,
        Some((word, None)) => match word.to_lowercase() {
            word if RISES.contains(&&*word) => Some(true),
            word if FALLS.contains(&&*word) => Some(false),
            word if word.is_empty() => None,
            _ => {
                let allowed = "a polarity is up or down, potentiation or depression, set or reset, + or -, 1 or -1; \
                               empty or 0 where there was no pulse";
                return Err(wrong(2, allowed));
            }
        },
    };
    Ok(Read { line, pulse, conductance, rises })
}

/// Whether pulses are counted anew at the read of that number.
fn anew(reads: &[Read], at: usize) -> bool {
    matches!((reads[at - 1].pulse, reads[at].pulse), (Some(before), Some(now)) if now <= before)
}

/// Which way the pulse before each read led, told from the conductance: it turns where it comes back by `turn`.
fn turns(reads: &[Read], turn: f64) -> Vec<bool> {
    let mut told = vec![];
    let starts = (1..reads.len()).filter(|&at| anew(reads, at));
    let starts: Vec<_> = [0].into_iter().chain(starts).chain([reads.len()]).collect();
    for run in starts.windows(2) {
        told.extend(turns_of_run(&reads[run[0]..run[1]], turn));
    }
    told
}

fn turns_of_run(reads: &[Read], turn: f64) -> Vec<bool> {
    let g = |at: usize| reads[at].conductance;
    let mut told = vec![true; reads.len()];
    // the last of the least and greatest since a turn, and which way it goes; up to `from` all is told
    let (mut low, mut high, mut rising, mut from) = (0, 0, None, 0);
    for at in 0..reads.len() {
        low = if g(at) <= g(low) { at } else { low };
        high = if g(at) >= g(high) { at } else { high };
        let (up, down) = (g(at) - g(low) >= turn, g(high) - g(at) >= turn);
        let end = match rising {
            None if up => low,
            None if down => high,
            Some(true) if down => high,
            Some(false) if up => low,
            _ => continue,
        };
        // behind an end that it left downward, it had risen
        told[from..=end].fill(end == high);
        rising = Some(end == low);
        (low, high, from) = if end == low { (low, at, end + 1) } else { (at, high, end + 1) };
    }
    let last = reads.len() - 1;
    let rises = rising.unwrap_or_else(|| g(last) >= g(0));
    told[from..].fill(rises);
    // the pulse before the first read of a run is of the run
    told[0] = *told.get(1).unwrap_or(&rises);
    told
}

/// Rows of one device: pulses that follow one another. The error is a line and how many pulses lie before it.
fn rows_of(
    device: usize,
    reads: &[Read],
    told: Option<&[bool]>,
    rows: &mut Vec<PulseRow>,
) -> Result<(), (u64, i64)> {
    let rises = |at: usize| told.map_or(reads[at].rises, |told| Some(told[at]));
    let mut row = PulseRow { device, start: reads[0].conductance, pulses: vec![] };
    for (at, read) in reads.iter().enumerate().skip(1) {
        let count = match (reads[at - 1].pulse, read.pulse) {
            (Some(before), Some(now)) if now > before => now - before,
            // another direction begins where the last one ended, another row of the same anywhere
            (Some(_), Some(now)) if rises(at) != rises(at - 1) => now,
            (Some(_), Some(_)) => 0,
            _ => 1,
        };
        if count > BETWEEN_MAX {
            return Err((read.line, count));
        }
        match rises(at) {
            Some(rises) if count > 0 => {
                let count = u32::try_from(count).expect("at most a million");
                row.pulses.push(Pulse { rises, count, to: read.conductance });
            }
            _ => {
                let next = PulseRow { device, start: read.conductance, pulses: vec![] };
                rows.extend(
                    Some(std::mem::replace(&mut row, next)).filter(|r| !r.pulses.is_empty()),
                );
            }
        }
    }
    rows.extend(Some(row).filter(|row| !row.pulses.is_empty()));
    Ok(())
}

#[cfg(test)]
#[path = "read_tests.rs"]
mod tests;
