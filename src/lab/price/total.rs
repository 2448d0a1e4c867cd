//! A sum of joules that knows whether it is all of them, and what it is split into.
//!
//! ```text
//! whole     every part that did something has a price       12.3 nJ (4.10 nJ to 40.2 nJ)
//! partial   some have none                                   at least 12.3 nJ (...), 12 of 15 parts priced
//! ```
//!
//! A part is a component that an event or idling names. A partial sum is a bound from below and is never given where a
//! total is asked for: no efficiency follows from it. See docs/MODEL.md, 4.6.

use serde_json::{Map, Value, json};

use super::unit::bounds;
use crate::lab::config::CostClass;

/// Low, typical, high.
pub type Range = [f64; 3];

/// Joules of parts that have a price, and how many have.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct EnergyTotal {
    /// Joules of the priced parts.
    pub joules: Range,
    /// Parts with a price.
    pub priced: usize,
    /// Parts that did something.
    pub parts: usize,
}

impl EnergyTotal {
    /// Joules, if every part has a price.
    #[must_use]
    pub fn whole(&self) -> Option<Range> {
        (self.priced == self.parts).then_some(self.joules)
    }

    /// Joules that it takes at least, if some parts have a price and some have none.
    #[must_use]
    pub fn at_least(&self) -> Option<Range> {
        (0 < self.priced && self.priced < self.parts).then_some(self.joules)
    }

    /// The same of one of `count`.
    #[must_use]
    pub fn each(self, count: u64) -> Self {
        Self { joules: self.joules.map(|joules| joules / count as f64), ..self }
    }

    /// How many parts have a price, where not all have.
    #[must_use]
    pub fn priced_words(&self) -> Option<String> {
        let Self { priced, parts, .. } = self;
        (priced < parts).then(|| format!("{priced} of {parts} parts priced"))
    }

    /// For people.
    #[must_use]
    pub fn words(&self) -> String {
        match (self.priced, self.priced_words()) {
            (0, Some(_)) => "not priced".into(),
            (0, None) => "nothing to price".into(),
            (_, Some(parts)) => format!("at least {}, {parts}", bounds(self.joules, "J")),
            (_, None) => bounds(self.joules, "J"),
        }
    }

    /// Keys of a JSON object: `joules` is the whole and nothing else.
    #[must_use]
    pub fn to_json(&self) -> Map<String, Value> {
        [
            ("joules", json!(self.whole())),
            ("joules_at_least", json!(self.at_least())),
            ("parts_priced", json!(self.priced)),
            ("parts", json!(self.parts)),
        ]
        .map(|(key, value)| (key.to_owned(), value))
        .into_iter()
        .collect()
    }
}

/// What a class takes of a total.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EnergySplit {
    /// Which class.
    pub class: CostClass,
    /// Its part.
    pub total: EnergyTotal,
}

impl EnergySplit {
    /// As a JSON object.
    #[must_use]
    pub fn to_json(&self) -> Value {
        let mut object = self.total.to_json();
        object.insert("name".into(), self.class.name().into());
        object.into()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_partial_sum_is_never_given_as_a_total() {
        let total = |priced, parts| EnergyTotal { joules: [1e-9, 2e-9, 4e-9], priced, parts };
        let whole = total(3, 3);
        assert_eq!(whole.words(), "2.00 nJ (1.00 nJ to 4.00 nJ)");
        assert_eq!((whole.whole(), whole.at_least()), (Some(whole.joules), None));
        let part = total(2, 3);
        let words = "at least 2.00 nJ (1.00 nJ to 4.00 nJ), 2 of 3 parts priced";
        assert_eq!(part.words(), words);
        assert_eq!((part.whole(), part.at_least()), (None, Some(part.joules)));
        assert_eq!(part.to_json()["joules"], Value::Null);
        let none = EnergyTotal { parts: 3, ..EnergyTotal::default() };
        assert_eq!(none.words(), "not priced");
        assert_eq!(EnergyTotal::default().words(), "nothing to price");
        assert_eq!((none.whole(), none.at_least()), (None, None));
        assert_eq!(whole.each(4).joules, [0.25e-9, 0.5e-9, 1e-9]);
    }
}
