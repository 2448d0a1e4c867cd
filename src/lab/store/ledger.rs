//! The ledger as a file: counts by phase, layer, pathway, operation and event, and cycles by phase.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::chip::engine::{Engine, Phase};
use crate::chip::ledger::{Cycles, During, Event, Interval, Ledger, Part};

/// Everything that was counted.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LedgerRecord {
    /// What happened, in the order of the ledger; counts of 0 are left out.
    pub counts: Vec<CountRecord>,
    /// How long it took, by phase; `null` when the hardware model has no timing.
    #[serde(deserialize_with = "Option::deserialize")]
    pub cycles: Option<BTreeMap<String, CyclesRecord>>,
}

/// How often one thing happened.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CountRecord {
    /// `training`, `calibration`, `evaluation`.
    pub phase: String,
    /// Layer, from 0 at the input.
    pub layer: usize,
    /// Name of the pathway.
    pub pathway: String,
    /// Name of the operation.
    pub operation: String,
    /// Name of the event.
    pub event: String,
    /// How often.
    pub count: u64,
}

/// Cycles of a phase (docs/MODEL.md, 4.5).
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CyclesRecord {
    /// From start to end.
    pub elapsed: u64,
    /// The same by interval; intervals do not overlap.
    pub stages: BTreeMap<String, u64>,
    /// Layer by layer; layers work side by side.
    pub layers: Vec<LayerCycles>,
}

/// Cycles of a layer.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LayerCycles {
    /// Busy, by operation.
    pub busy: BTreeMap<String, u64>,
    /// At work, by part.
    pub used: BTreeMap<String, u64>,
}

impl From<&Cycles> for CyclesRecord {
    fn from(cycles: &Cycles) -> Self {
        let stages =
            Interval::ALL.map(|interval| (interval.name().to_owned(), cycles.interval(interval)));
        let layers = (0..cycles.layers()).map(|layer| LayerCycles {
            busy: During::ALL.map(|d| (d.name().to_owned(), cycles.busy(layer, d))).into(),
            used: Part::ALL.map(|p| (p.name().to_owned(), cycles.used(layer, p))).into(),
        });
        Self { elapsed: cycles.elapsed(), stages: stages.into(), layers: layers.collect() }
    }
}

impl CyclesRecord {
    /// Takes the cycles of another network along, whose layers follow.
    fn join(&mut self, other: Self) {
        self.elapsed += other.elapsed;
        for (stage, cycles) in other.stages {
            *self.stages.entry(stage).or_default() += cycles;
        }
        self.layers.extend(other.layers);
    }
}

impl LedgerRecord {
    /// All ledgers of engines whose layers are numbered through.
    #[must_use]
    pub fn of(engines: &[&Engine]) -> Self {
        let mut record = Self::default();
        for phase in Phase::ALL {
            engines.iter().for_each(|engine| record.add(engine, phase, None));
        }
        record
    }

    /// What came to one ledger of each engine since they stood at `before`.
    #[must_use]
    pub fn since(engines: &[&Engine], phase: Phase, before: &[Ledger]) -> Self {
        let mut record = Self::default();
        engines.iter().zip(before).for_each(|(engine, b)| record.add(engine, phase, Some(b)));
        record
    }

    fn add(&mut self, engine: &Engine, phase: Phase, before: Option<&Ledger>) {
        let ledger = engine.ledger(phase);
        for (layer, code, during, event, count) in ledger.entries() {
            let count = count - before.map_or(0, |ledger| ledger.get(layer, code, during, event));
            if count == 0 {
                continue;
            }
            let this = &engine.layers()[layer];
            let (layer, pathways) = (usize::from(this.index), this.spec.wiring.pathways());
            let name = pathways.iter().find(|p| p.code == code).map_or("-", |p| p.name);
            self.counts.push(CountRecord {
                phase: phase.name().into(),
                layer,
                pathway: name.into(),
                operation: during.name().into(),
                event: event.name().into(),
                count,
            });
        }
        let Some(cycles) = ledger.cycles() else { return };
        let passed = match before.and_then(Ledger::cycles) {
            None => cycles.clone(),
            Some(before) => cycles.since(before),
        };
        let passed = CyclesRecord::from(&passed);
        let phases = self.cycles.get_or_insert_default();
        match phases.get_mut(phase.name()) {
            // networks take turns: a chip does one thing at a time
            Some(before) => before.join(passed),
            None => drop(phases.insert(phase.name().into(), passed)),
        }
    }

    /// Events of one name over everything.
    #[must_use]
    pub fn total(&self, event: Event) -> u64 {
        let of_event = self.counts.iter().filter(|line| line.event == event.name());
        // a file may say anything
        of_event.fold(0, |sum, line| sum.saturating_add(line.count))
    }

    /// Cycles of all phases from start to end; `None` when no cycles were counted.
    #[must_use]
    pub fn elapsed(&self) -> Option<u64> {
        let phases = self.cycles.as_ref()?;
        Some(phases.values().fold(0, |sum: u64, cycles| sum.saturating_add(cycles.elapsed)))
    }

    /// The file's text.
    ///
    /// # Panics
    /// Never: counts have a JSON form.
    #[must_use]
    pub fn to_json(&self) -> String {
        let mut text = serde_json::to_string_pretty(self).expect("counts have a JSON form");
        text.push('\n');
        text
    }

    /// Reads the file's text.
    ///
    /// # Errors
    /// What is wrong with it: also an event that this program does not know.
    pub fn parse(text: &str) -> Result<Self, String> {
        let record: Self = serde_json::from_str(text).map_err(|e| e.to_string())?;
        let known = |line: &&CountRecord| Event::ALL.iter().any(|e| e.name() == line.event);
        match record.counts.iter().find(|line| !known(line)) {
            Some(line) => Err(format!("there is no event `{}`", line.event)),
            None => Ok(record),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_record_comes_back_from_its_text() {
        let mut cycles = Cycles::new(1);
        cycles.pass(Interval::Forward, 9);
        cycles.engage(0, Part::Lanes, 4);
        let line = CountRecord {
            phase: "training".into(),
            layer: 0,
            pathway: "pp".into(),
            operation: "update".into(),
            event: "holds".into(),
            count: 3,
        };
        let phases = BTreeMap::from([("training".to_owned(), CyclesRecord::from(&cycles))]);
        let record = LedgerRecord { counts: vec![line], cycles: Some(phases) };
        assert_eq!(LedgerRecord::parse(&record.to_json()), Ok(record.clone()));
        assert_eq!((record.total(Event::Holds), record.elapsed()), (3, Some(9)));
        let error = LedgerRecord::parse(&record.to_json().replace("holds", "folds")).unwrap_err();
        assert!(error.contains("no event `folds`"), "{error}");
    }
}
