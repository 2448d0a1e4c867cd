//! What events, parts and idling cost: physical numbers, each with its bounds and its source.
//!
//! ```text
//! [energy]
//! conversion_pj = { low = 1.0, typical = 1.6, high = 4.0, source = "...", kind = "measured" }
//! ```
//!
//! A key is the name of a quantity of [`QUANTITIES`] and a unit. The list is the only place that joins events of the
//! ledger to keys. Beside each quantity stands the interval in which a number of this kind can lie on any chip: it is
//! wide, and what lies outside is a slip of the unit, not an exotic device; and the settings that the number belongs to
//! ([`super::law`]). See docs/MODEL.md, 4.6.

use std::collections::BTreeMap;

use serde::de::{self, Deserializer};
use serde::{Deserialize, Serialize};

mod class;
mod list;
mod node;

pub use class::CostClass;
pub use list::QUANTITIES;

use super::ConfigError;
use super::check::wrong;
use super::file::{HardwareFile, NumberFile};
use super::law::{Law, Place, ScalesFile, Setting, Settings, kind_of, settings};
use crate::chip::hardware::Hardware;
use crate::chip::ledger::Event;

/// A table of a hardware model.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum CostTable {
    /// Joules an event.
    Energy,
    /// Watts.
    Power,
    /// Square metres.
    Area,
}

impl CostTable {
    /// Name in files.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Energy => "energy",
            Self::Power => "power",
            Self::Area => "area",
        }
    }

    /// Unit of its numbers.
    const fn unit(self) -> &'static str {
        match self {
            Self::Energy => "J",
            Self::Power => "W",
            Self::Area => "m2",
        }
    }

    /// Units of its keys, and what one is in joules, watts or square metres.
    pub(super) const fn units(self) -> &'static [(&'static str, f64)] {
        match self {
            Self::Energy => {
                &[("aj", 1e-18), ("fj", 1e-15), ("pj", 1e-12), ("nj", 1e-9), ("uj", 1e-6)]
            }
            Self::Power => &[("nw", 1e-9), ("uw", 1e-6), ("mw", 1e-3), ("w", 1.0)],
            Self::Area => &[("um2", 1e-12), ("mm2", 1e-6)],
        }
    }
}

/// What a quantity is counted by.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Per {
    /// An event of the ledger.
    Event(Event),
    /// The chip.
    Chip,
    /// A tile in use.
    Tile,
    /// A column of a bank of a tile in use.
    Column,
    /// A cell of the network.
    Cell,
    /// A row driver of a bank of a tile in use.
    Row,
    /// A converter of a tile in use.
    Converter,
}

impl Per {
    /// By what an event is priced: itself, or what a copy of an array shares with the first.
    pub(crate) const fn of(event: Event) -> Self {
        Self::Event(match event {
            Event::PulsesCopied => Event::PulsesAttempted,
            Event::LoadsCopied => Event::CellLoads,
            _ => event,
        })
    }
}

/// A kind of physical number.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Quantity {
    /// Where it is given.
    pub table: CostTable,
    /// Its key, without the unit.
    pub name: &'static str,
    /// What it is counted by.
    pub per: Per,
    /// Least and greatest credible number, in joules, watts or square metres.
    pub sane: [f64; 2],
    /// Why that interval.
    pub why: &'static str,
    /// Settings it belongs to, the first one first in importance: at another one the number is another.
    pub belongs: &'static [Setting],
}

impl Quantity {
    /// What it is and where it can lie, in words.
    #[must_use]
    pub fn about(&self) -> String {
        let (unit, per) = (self.table.unit(), self.per.text());
        let [least, most] = self.sane;
        format!("{per}; on any chip it lies in {least:e} to {most:e} {unit}: {}", self.why)
    }
}

impl Per {
    fn text(self) -> String {
        match self {
            Self::Event(event) => format!("An event `{}`", event.name()),
            Self::Chip => "The chip".into(),
            Self::Tile => "A tile in use".into(),
            Self::Column => "A column of a bank of a tile in use".into(),
            Self::Cell => "A cell of the network".into(),
            Self::Row => "A row driver of a bank of a tile in use".into(),
            Self::Converter => "A converter of a tile in use".into(),
        }
    }
}

/// Where a number comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Kind {
    /// On silicon, or read from a cited source that did.
    Measured,
    /// Adjusted until a model met a published result.
    Fitted,
    /// A guess, a memory, or a number of another chip.
    Assumed,
}

/// How a number came to the setting that it prices.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Standing {
    /// The model gives it for this setting.
    Stated,
    /// The model gives it for another setting, and a law of the model brought it here: what law, from where to where.
    Scaled(String),
    /// The model gives it for another setting and says no law: what has changed. It prices nothing.
    NotHere(String),
}

/// A physical number of a model.
#[derive(Debug, Clone, PartialEq)]
pub struct Constant {
    /// What it is.
    pub quantity: &'static Quantity,
    /// Its key, with the unit.
    pub key: String,
    /// Low, typical and high on the chip, in joules, watts or square metres.
    pub value: [f64; 3],
    /// Where it comes from.
    pub source: String,
    /// How far to trust it. A number that was scaled is assumed, whatever it was.
    pub kind: Kind,
    /// The node it is of, in nanometres, where it says one.
    pub node_nm: Option<f64>,
    /// Whether it is a number of this setting.
    pub standing: Standing,
    /// As it was given.
    given: [f64; 3],
}

impl Constant {
    /// Which law brought it to this setting, if one did.
    #[must_use]
    pub fn scaled(&self) -> Option<&str> {
        match &self.standing {
            Standing::Scaled(law) => Some(law),
            Standing::Stated | Standing::NotHere(_) => None,
        }
    }

    /// Why it prices nothing here, if it does not.
    #[must_use]
    pub fn not_here(&self) -> Option<&str> {
        match &self.standing {
            Standing::NotHere(why) => Some(why),
            Standing::Stated | Standing::Scaled(_) => None,
        }
    }
}

impl Constant {
    /// What one unit of its key is in joules, watts or square metres.
    #[must_use]
    pub fn worth(&self) -> f64 {
        let ends = |unit: &str| self.key.rsplit('_').next() == Some(unit);
        let unit = self.quantity.table.units().iter().find(|(unit, _)| ends(unit));
        unit.map_or(1.0, |(_, worth)| *worth)
    }
}

/// The physical numbers of a model, in the order of [`QUANTITIES`].
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Constants(Vec<Constant>);

impl Constants {
    /// Checks the three tables of a model; `prefix` is put before keys in messages.
    ///
    /// # Errors
    /// When a number is incomplete, given twice, or its bounds are in the wrong order.
    pub(super) fn new(
        file: &HardwareFile,
        place: &Place<'_>,
        prefix: &str,
    ) -> Result<Self, ConfigError> {
        let mut all = Vec::new();
        for (table, name, number) in numbers(file) {
            let (quantity, unit) =
                parse(table, name).expect("keys were checked when they were read");
            let key = format!("{prefix}{}.{name}", table.name());
            let missing = |part: &str| {
                let allowed = "a physical number is { low, typical, high, source, kind }";
                wrong(&format!("{key}.{part}"), "is missing", allowed)
            };
            let bound = |part, value: Option<f64>| value.ok_or_else(|| missing(part));
            let low = bound("low", number.low)?;
            let typical = bound("typical", number.typical)?;
            let high = bound("high", number.high)?;
            if !(0.0 <= low && low <= typical && typical <= high && high.is_finite()) {
                let found = format!("has low {low}, typical {typical}, high {high}");
                return Err(wrong(&key, found, "it must be 0 <= low <= typical <= high"));
            }
            let source = number.source.as_deref().unwrap_or_default().trim();
            if source.is_empty() {
                let allowed = "every physical number says where it comes from";
                return Err(wrong(&format!("{key}.source"), "is missing", allowed));
            }
            let kind = match number.kind.as_deref() {
                Some("measured") => Kind::Measured,
                Some("fitted") => Kind::Fitted,
                Some("assumed") => Kind::Assumed,
                Some(other) => {
                    let allowed = "it is measured, fitted or assumed";
                    return Err(wrong(&format!("{key}.kind"), format!("is \"{other}\""), allowed));
                }
                None => return Err(missing("kind")),
            };
            let none = Settings::new();
            let at = number.at.as_ref().unwrap_or(&none);
            let scales = scales(quantity, number.scales.as_ref(), at, &key)?;
            let (factor, standing) = place.standing(quantity.belongs, at, &scales);
            let standing = match standing {
                Standing::NotHere(why) => {
                    Standing::NotHere(format!("{}.{name} {why}", table.name()))
                }
                here => here,
            };
            let given = [low, typical, high].map(|number| number * unit);
            let scaled = matches!(standing, Standing::Scaled(_));
            all.push(Constant {
                quantity,
                key: format!("{}.{name}", table.name()),
                value: given.map(|number| number * factor),
                source: source.into(),
                kind: if scaled { Kind::Assumed } else { kind },
                node_nm: number.node_nm.or(file.node_nm),
                standing,
                given,
            });
        }
        let place = |c: &Constant| QUANTITIES.iter().position(|q| q == c.quantity);
        all.sort_by_key(place);
        if let Some(twice) = all.windows(2).find(|two| two[0].quantity == two[1].quantity) {
            let found = format!("is given beside `{}`", twice[0].key);
            let allowed = "a quantity is given once, in one unit; remove one of the keys";
            return Err(wrong(&format!("{prefix}{}", twice[1].key), found, allowed));
        }
        Ok(Self(all))
    }

    /// All of them.
    pub fn iter(&self) -> impl Iterator<Item = &Constant> {
        self.0.iter()
    }

    /// The number of a quantity, by table and name.
    #[must_use]
    pub fn get(&self, table: CostTable, name: &str) -> Option<&Constant> {
        self.0.iter().find(|c| c.quantity.table == table && c.quantity.name == name)
    }

    /// The number of an event.
    #[must_use]
    pub fn of(&self, event: Event) -> Option<&Constant> {
        let priced = Per::of(event);
        self.0.iter().find(|c| c.quantity.per == priced)
    }

    /// Numbers outside what any chip can have. 0 is never outside: a chip may lack the part.
    #[must_use]
    pub fn complaints(&self) -> Vec<String> {
        let outside = self.0.iter().filter(|c| {
            let [least, most] = c.quantity.sane;
            c.given.iter().any(|&value| value != 0.0 && !(least..=most).contains(&value))
        });
        let say = |c: &Constant| {
            let unit = c
                .quantity
                .table
                .units()
                .iter()
                .find(|(unit, _)| c.key.ends_with(&format!("_{unit}")));
            let (unit, worth) = unit.expect("a key ends in a unit");
            let [low, typical, high] = c.given.map(|value| value / worth);
            let [least, most] = c.quantity.sane.map(|value| value / worth);
            format!(
                "`{}` has low {low:.3e}, typical {typical:.3e}, high {high:.3e}; on any chip it lies in {least:.3e} to \
                 {most:.3e} {unit} ({}): is the unit right?",
                c.key, c.quantity.why
            )
        };
        outside.map(say).collect()
    }
}

/// Says of the numbers with these keys (`energy.hold_fj`) that they are for these settings, as far as they belong to them.
pub(super) fn stand_here(file: &mut HardwareFile, keys: &[String], here: &Settings) {
    let say = |table: CostTable, key: &str, number: &mut NumberFile| {
        let Some((quantity, _)) = parse(table, key) else { return };
        if keys.iter().any(|changed| *changed == format!("{}.{key}", table.name())) {
            let at = number.at.get_or_insert_default();
            let own = here.iter().filter(|(setting, _)| quantity.belongs.contains(setting));
            own.for_each(|(&setting, value)| _ = at.entry(setting).or_insert(value.clone()));
            if at.is_empty() {
                number.at = None;
            }
        }
    };
    let energies = file.energy.iter_mut().flatten();
    energies.for_each(|(key, number)| say(CostTable::Energy, &key.0, number));
    let powers = file.power.iter_mut().flatten();
    powers.for_each(|(key, number)| say(CostTable::Power, &key.0, number));
    let areas = file.area.iter_mut().flatten();
    areas.for_each(|(key, number)| say(CostTable::Area, &key.0, number));
}

/// The numbers of a file on its chip.
///
/// # Errors
/// As [`Constants::new`].
pub(super) fn constants_of(
    file: &HardwareFile,
    hardware: &Hardware,
    prefix: &str,
) -> Result<Constants, ConfigError> {
    let kind = kind_of(file);
    let (chip, none) = (settings(hardware, kind), Settings::new());
    let model = file.constants_for.as_ref().unwrap_or(&none);
    Constants::new(file, &Place { chip: &chip, model, kind }, prefix)
}

/// Laws by setting. One of a setting that the quantity does not belong to would mean nothing.
fn scales(
    quantity: &Quantity,
    given: Option<&ScalesFile>,
    at: &Settings,
    key: &str,
) -> Result<BTreeMap<Setting, Law>, ConfigError> {
    let names = || {
        let names: Vec<_> = quantity.belongs.iter().map(|setting| setting.name()).collect();
        if names.is_empty() {
            return "no setting: remove the key".into();
        }
        names.join(", ")
    };
    let laws = match given {
        None => BTreeMap::new(),
        Some(ScalesFile::Each(laws)) => laws.clone(),
        Some(ScalesFile::First(law)) => match quantity.belongs.first() {
            Some(first) => [(*first, *law)].into(),
            None => {
                let allowed = "its quantity belongs to no setting: remove the key";
                return Err(wrong(
                    &format!("{key}.scales"),
                    format!("is \"{}\"", law.name()),
                    allowed,
                ));
            }
        },
    };
    let (scaled, stood): (Vec<_>, Vec<_>) = (laws.keys().collect(), at.keys().collect());
    for (part, settings) in [("scales", scaled), ("at", stood)] {
        let other = settings.into_iter().find(|setting| !quantity.belongs.contains(setting));
        if let Some(other) = other {
            let found = format!("speaks of {}", other.name());
            let allowed = format!("`{}` belongs to {}", quantity.name, names());
            return Err(wrong(&format!("{key}.{part}"), found, allowed));
        }
    }
    Ok(laws)
}

/// Every number of a file with its table and key.
pub(super) fn numbers(file: &HardwareFile) -> Vec<(CostTable, &str, &NumberFile)> {
    let energy = file.energy.iter().flatten().map(|(key, n)| (CostTable::Energy, &*key.0, n));
    let power = file.power.iter().flatten().map(|(key, n)| (CostTable::Power, &*key.0, n));
    let area = file.area.iter().flatten().map(|(key, n)| (CostTable::Area, &*key.0, n));
    energy.chain(power).chain(area).collect()
}

/// Quantity and unit of a key.
fn parse(table: CostTable, key: &str) -> Option<(&'static Quantity, f64)> {
    let (name, unit) = key.rsplit_once('_')?;
    let &(_, worth) = table.units().iter().find(|(known, _)| *known == unit)?;
    let quantity = QUANTITIES.iter().find(|q| q.table == table && q.name == name)?;
    Some((quantity, worth))
}

fn read_key<'de, D: Deserializer<'de>>(
    table: CostTable,
    deserializer: D,
) -> Result<String, D::Error> {
    let key = String::deserialize(deserializer)?;
    if parse(table, &key).is_some() {
        return Ok(key);
    }
    let names = QUANTITIES.iter().filter(|q| q.table == table).map(|q| q.name);
    let units: Vec<_> = table.units().iter().map(|(unit, _)| format!("_{unit}")).collect();
    let names = names.collect::<Vec<_>>().join("`, `");
    let text = format!(
        "unknown field `{key}`, expected one of `{names}` with a unit, {}",
        units.join(", ")
    );
    Err(de::Error::custom(text))
}

macro_rules! keys_of {
    ($($name:ident $table:ident)*) => {$(
        /// A key of the table.
        #[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Serialize)]
        #[serde(transparent)]
        pub struct $name(String);

        impl<'de> Deserialize<'de> for $name {
            fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
                read_key(CostTable::$table, deserializer).map(Self)
            }
        }
    )*};
}

keys_of!(EnergyKey Energy PowerKey Power AreaKey Area);

#[cfg(test)]
mod tests;
