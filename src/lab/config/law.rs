//! Settings that physical numbers belong to, and laws by which a number follows when a setting changes.
//!
//! ```text
//! conversion_pj = { low = 0.3, typical = 4.3, high = 34.5, scales = { adc_bits = "walden" }, ... }
//!
//! constant      the same whatever the setting                    linear        in proportion to it
//! walden        2^bits      (energy a conversion, quantisation)  schreier      4^bits    (energy a conversion, thermal noise)
//! comparators   2^bits - 1  (flash: energy and area)             steps         steps of the converter's kind
//! ```
//!
//! Which quantity belongs to which settings stands in [`super::quantity::QUANTITIES`]. A number stands for the settings of the
//! model that gives it, or for those that it says itself (`at`). A chip with another setting takes the number times
//! `law(setting) / law(stands for)`; without a law the number is not that chip's, and what it would price is not priced.
//! See docs/MODEL.md, 4.6.

use std::collections::BTreeMap;
use std::fmt;

use serde::{Deserialize, Serialize};

use super::file::{AdcFile, HardwareFile};
use super::quantity::Standing;
use crate::chip::hardware::{Adc, ConverterKind, Hardware, ReadTime};

/// Something of a chip that a physical number belongs to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Setting {
    /// Bits of a converter.
    AdcBits,
    /// Kind of a converter.
    Converter,
    /// Bits of a drive code.
    DriveBits,
    /// Bits a row driver applies at a time.
    DacBits,
    /// Nanoseconds of a slice or phase, settling and pulses.
    ReadNs,
    /// Nanoseconds of a pulse of a write.
    PulseNs,
    /// Levels of a cell's window.
    Levels,
    /// Rows of a tile.
    Rows,
    /// Columns of a tile.
    Columns,
    /// Bits of the table's index.
    LutBits,
    /// Bits of an error word.
    ErrorBits,
    /// Random bits of a rounding.
    DitherBits,
}

impl Setting {
    /// All of them.
    pub const EACH: &[Self] = &[
        Self::AdcBits,
        Self::Converter,
        Self::DriveBits,
        Self::DacBits,
        Self::ReadNs,
        Self::PulseNs,
        Self::Levels,
        Self::Rows,
        Self::Columns,
        Self::LutBits,
        Self::ErrorBits,
        Self::DitherBits,
    ];

    /// Name in files.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::AdcBits => "adc_bits",
            Self::Converter => "converter",
            Self::DriveBits => "drive_bits",
            Self::DacBits => "dac_bits",
            Self::ReadNs => "read_ns",
            Self::PulseNs => "pulse_ns",
            Self::Levels => "levels",
            Self::Rows => "rows",
            Self::Columns => "columns",
            Self::LutBits => "lut_bits",
            Self::ErrorBits => "error_bits",
            Self::DitherBits => "dither_bits",
        }
    }

    /// What a chip has.
    fn of(self, chip: &Hardware, kind: ConverterKind) -> SettingValue {
        let nanoseconds = |cycles: f64, khz: u64| SettingValue::Number(cycles * 1e6 / khz as f64);
        let untimed = || SettingValue::Word("untimed".into());
        let window = chip.cell.window;
        let number = match self {
            Self::AdcBits => match chip.adc {
                Adc::Finite { bits, .. } => bits.get().into(),
                Adc::Ideal => return SettingValue::Word("ideal".into()),
            },
            Self::Converter => return SettingValue::Word(kind.name().into()),
            Self::DriveBits => chip.drive.bits.get().into(),
            Self::DacBits => chip.drive.dac_bits.into(),
            Self::ReadNs => {
                return chip.timing.map_or_else(untimed, |timing| {
                    let read = ReadTime::new(chip, timing);
                    nanoseconds(read.arrays as f64 / read.slices as f64, timing.clock_khz)
                });
            }
            Self::PulseNs => {
                return chip.timing.map_or_else(untimed, |timing| {
                    nanoseconds(timing.pulse as f64, timing.clock_khz)
                });
            }
            Self::Levels => i64::from(window.ceiling()) - i64::from(window.floor()) + 1,
            Self::Rows => chip.tile.rows as i64,
            Self::Columns => chip.tile.columns as i64,
            Self::LutBits => chip.digital.lut_bits.get().into(),
            Self::ErrorBits => chip.digital.error_bits.get().into(),
            Self::DitherBits => chip.write.dither_bits.get().into(),
        };
        SettingValue::Whole(number)
    }
}

/// A setting's value.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(untagged, expecting = "a number or a word")]
pub enum SettingValue {
    /// A whole number.
    Whole(i64),
    /// Any other.
    Number(f64),
    /// A kind.
    Word(String),
}

impl SettingValue {
    fn number(&self) -> Option<f64> {
        match self {
            Self::Whole(whole) => Some(*whole as f64),
            Self::Number(number) => Some(*number),
            Self::Word(_) => None,
        }
    }

    /// Whether two are one: nanoseconds are quotients, and are compared as such.
    fn is(&self, other: &Self) -> bool {
        match (self.number(), other.number()) {
            (Some(a), Some(b)) => (a - b).abs() <= 1e-9 * a.abs().max(b.abs()),
            _ => self == other,
        }
    }
}

impl fmt::Display for SettingValue {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Whole(whole) => write!(f, "{whole}"),
            Self::Number(number) => write!(f, "{number}"),
            Self::Word(word) => f.write_str(word),
        }
    }
}

/// How a number follows a setting.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Law {
    /// It does not.
    Constant,
    /// In proportion.
    Linear,
    /// Doubles with each bit.
    Walden,
    /// Quadruples with each bit.
    Schreier,
    /// One less than a power of two.
    Comparators,
    /// Steps of a conversion.
    Steps,
}

impl Law {
    /// Name in files.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Constant => "constant",
            Self::Linear => "linear",
            Self::Walden => "walden",
            Self::Schreier => "schreier",
            Self::Comparators => "comparators",
            Self::Steps => "steps",
        }
    }

    /// What a number that stands for `from` is worth at `to`; `None` where the law says nothing of such settings.
    fn factor(self, from: &SettingValue, to: &SettingValue, kind: ConverterKind) -> Option<f64> {
        if self == Self::Constant {
            return Some(1.0);
        }
        let [from, to] = [from.number()?, to.number()?];
        let steps = |bits: f64| {
            let bits = Some(bits).filter(|bits| (1.0..=32.0).contains(bits))?;
            Some(kind.steps(bits as u32)? as f64)
        };
        let of = |at: f64| match self {
            Self::Constant => Some(1.0),
            Self::Linear => Some(at),
            Self::Walden => Some(at.exp2()),
            Self::Schreier => Some((2.0 * at).exp2()),
            Self::Comparators => Some(at.exp2() - 1.0),
            Self::Steps => steps(at),
        };
        Some(of(to)? / of(from)?).filter(|factor| factor.is_finite())
    }
}

/// `scales = "walden"`, the law of a quantity's first setting, or a table with a law a setting.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(
    untagged,
    expecting = "a law (constant, linear, walden, schreier, comparators, steps), or a table of laws by setting"
)]
pub enum ScalesFile {
    /// Of the first setting.
    First(Law),
    /// By setting.
    Each(BTreeMap<Setting, Law>),
}

/// Values of settings.
pub(super) type Settings = BTreeMap<Setting, SettingValue>;

/// Settings of a chip.
#[must_use]
pub(super) fn settings(chip: &Hardware, kind: ConverterKind) -> Settings {
    Setting::EACH.iter().map(|&setting| (setting, setting.of(chip, kind))).collect()
}

/// The kind of a file's converters.
pub(super) fn kind_of(file: &HardwareFile) -> ConverterKind {
    let word = match &file.adc {
        Some(AdcFile::Finite(table)) => table.converter.as_deref(),
        _ => None,
    };
    let of = |word| ConverterKind::NAMES.iter().find(|(name, _)| *name == word);
    word.and_then(of).map_or(ConverterKind::Fixed, |(_, kind)| *kind)
}

/// Everything that decides whether a number is a chip's.
pub(super) struct Place<'a> {
    /// Settings of the chip.
    pub(super) chip: &'a Settings,
    /// Settings of the model, where they are others.
    pub(super) model: &'a Settings,
    pub(super) kind: ConverterKind,
}

impl Place<'_> {
    /// What a number that belongs to some settings is worth on the chip: a factor, and why.
    pub(super) fn standing(
        &self,
        belongs: &[Setting],
        at: &Settings,
        scales: &BTreeMap<Setting, Law>,
    ) -> (f64, Standing) {
        let (mut factor, mut said) = (1.0, Vec::new());
        for setting in belongs {
            let to = &self.chip[setting];
            let model = self.model.get(setting).unwrap_or(to);
            let from = at.get(setting).unwrap_or(model);
            // a lossless converter has no bits: its own number is a guess for what there is not
            let lossless = to.number().is_none() && model.is(to);
            if from.is(to) || lossless {
                continue;
            }
            let name = setting.name();
            let Some(law) = scales.get(setting) else {
                let why = format!("is for {name} {from}, and no law says what it is at {to}");
                return (1.0, Standing::NotHere(why));
            };
            let Some(times) = law.factor(from, to, self.kind) else {
                let why = format!(
                    "is for {name} {from}, and its law {} says nothing of {to}",
                    law.name()
                );
                return (1.0, Standing::NotHere(why));
            };
            factor *= times;
            said.push(format!("{}, {name} {from} to {to}: x {}", law.name(), rounded(times)));
        }
        if said.is_empty() {
            return (1.0, Standing::Stated);
        }
        (factor, Standing::Scaled(said.join("; ")))
    }
}

/// Four digits are enough to read.
fn rounded(number: f64) -> String {
    let digits = if number >= 100.0 {
        0
    } else if number >= 1.0 {
        3
    } else {
        6
    };
    let text = format!("{number:.digits$}");
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').into() } else { text }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn whole(number: i64) -> SettingValue {
        SettingValue::Whole(number)
    }

    #[test]
    fn a_law_says_what_a_number_is_worth_elsewhere() {
        let factor = |law: Law, from, to| law.factor(&whole(from), &whole(to), ConverterKind::Sar);
        assert_eq!(factor(Law::Walden, 6, 8), Some(4.0));
        assert_eq!(factor(Law::Walden, 8, 4), Some(1.0 / 16.0));
        assert_eq!(factor(Law::Schreier, 6, 8), Some(16.0));
        assert_eq!(factor(Law::Comparators, 1, 4), Some(15.0));
        assert_eq!(factor(Law::Linear, 128, 256), Some(2.0));
        assert_eq!(factor(Law::Steps, 6, 13), Some(2.0));
        assert_eq!(factor(Law::Constant, 6, 13), Some(1.0));
        let ramp = Law::Steps.factor(&whole(6), &whole(8), ConverterKind::Ramp);
        assert_eq!(ramp, Some(4.0));
        // whoever is given its cycles has no steps, and no law of numbers speaks of words
        assert_eq!(Law::Steps.factor(&whole(6), &whole(8), ConverterKind::Fixed), None);
        let ideal = SettingValue::Word("ideal".into());
        assert_eq!(Law::Walden.factor(&whole(6), &ideal, ConverterKind::Sar), None);
    }

    #[test]
    fn a_number_follows_its_laws_or_is_not_the_chips() {
        let settings = |bits: i64, rows: i64| -> Settings {
            [(Setting::AdcBits, whole(bits)), (Setting::Rows, whole(rows))].into()
        };
        let (model, chip) = (settings(6, 128), settings(8, 64));
        let place = Place { chip: &chip, model: &model, kind: ConverterKind::Sar };
        let none = Settings::new();
        let bits = [(Setting::AdcBits, Law::Walden)].into();
        let both = [(Setting::AdcBits, Law::Walden), (Setting::Rows, Law::Linear)].into();
        assert_eq!(place.standing(&[], &none, &bits), (1.0, Standing::Stated));
        let (factor, standing) = place.standing(&[Setting::AdcBits], &none, &bits);
        let said = "walden, adc_bits 6 to 8: x 4".to_owned();
        assert_eq!((factor, standing), (4.0, Standing::Scaled(said)));
        let belongs = [Setting::AdcBits, Setting::Rows];
        assert_eq!(place.standing(&belongs, &none, &both).0, 2.0);
        let (_, standing) = place.standing(&belongs, &none, &bits);
        let why = "is for rows 128, and no law says what it is at 64".to_owned();
        assert_eq!(standing, Standing::NotHere(why));
        // a number may say itself what it stands for
        let at = [(Setting::AdcBits, whole(8))].into();
        assert_eq!(place.standing(&[Setting::AdcBits], &at, &bits), (1.0, Standing::Stated));
    }

    #[test]
    fn settings_are_named_in_files_as_they_are_in_messages() {
        for setting in Setting::EACH {
            let text = format!("{{ \"{}\": \"linear\" }}", setting.name());
            let read: BTreeMap<Setting, Law> = serde_json::from_str(&text).unwrap();
            assert_eq!(read, [(*setting, Law::Linear)].into());
        }
    }
}
