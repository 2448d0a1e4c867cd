//! Counts times constants, and what stands out in the sum.

use std::collections::BTreeMap;

use serde::Serialize;

use super::changes::Change;
use super::plan::Footprint;
use crate::chip::hardware::Hardware;
use crate::chip::ledger::Event;
use crate::lab::config::{Constants, CostTable, Kind, Per, QUANTITIES};
use crate::lab::store::ledger::{CountRecord, LedgerRecord};

/// Low, typical, high.
pub type Range = [f64; 3];

/// Events of one place and what they cost.
#[derive(Debug, Clone, PartialEq)]
pub struct Line<'a> {
    /// Where, and how often.
    pub count: &'a CountRecord,
    /// Which quantity priced it: its name stands for the component.
    pub component: &'static str,
    /// The key of the constant.
    pub key: String,
    /// How far to trust that constant.
    pub kind: Kind,
    /// Joules.
    pub joules: Range,
}

/// What a part takes while time passes.
#[derive(Debug, Clone, PartialEq)]
pub struct Idle {
    /// Which quantity: its name stands for the component.
    pub component: &'static str,
    /// The key of the constant.
    pub key: String,
    /// How far to trust that constant.
    pub kind: Kind,
    /// How many such parts.
    pub parts: u64,
    /// Watts of all of them.
    pub watts: Range,
    /// Joules by phase; empty when no time is known.
    pub joules: BTreeMap<String, Range>,
}

/// What could not be priced.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Missing {
    /// An event, or `static power`.
    pub what: String,
    /// How often it happened, where it was counted.
    pub count: Option<u64>,
    /// Why it has no price.
    pub why: String,
}

/// Joules of what belongs together.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Group {
    /// What it is.
    pub name: String,
    /// Joules: low, typical, high.
    pub joules: Range,
}

/// How much of the typical total leans on one constant.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Share {
    /// Its key.
    pub key: String,
    /// Part of the total, 0 to 1.
    pub share: f64,
    /// How far to trust it.
    pub kind: Kind,
}

/// What a ledger cost on a chip.
#[derive(Debug, Clone, PartialEq)]
pub struct Bill<'a> {
    /// Priced events.
    pub lines: Vec<Line<'a>>,
    /// Priced idling.
    pub idle: Vec<Idle>,
    /// Seconds by phase; `None` when no cycles were counted or they are not this chip's.
    pub seconds: Option<BTreeMap<String, f64>>,
    /// What has no price.
    pub missing: Vec<Missing>,
}

/// Prices a ledger. `changes` are the differences between the chip that made it and the one whose constants are
/// used: what they touch is left out and listed.
#[must_use]
pub fn price<'a>(
    ledger: &'a LedgerRecord,
    plan: &Footprint,
    hardware: &Hardware,
    constants: &Constants,
    changes: &[Change],
) -> Bill<'a> {
    let mut missing = Vec::new();
    let mut lines = Vec::new();
    for event in Event::ALL {
        let priced = QUANTITIES.iter().find(|q| q.per == Per::Event(event));
        let (Some(quantity), count) = (priced, ledger.total(event)) else { continue };
        if count == 0 {
            continue;
        }
        let touched: Vec<_> =
            changes.iter().filter(|c| c.events.contains(&event)).map(|c| c.key).collect();
        let lacks = |why: String| Missing { what: event.name().into(), count: Some(count), why };
        if !touched.is_empty() {
            missing.push(lacks(format!("the two chips differ in {}", touched.join(", "))));
            continue;
        }
        let Some(constant) = constants.of(event) else {
            missing.push(lacks(format!("the model has no energy.{}", quantity.name)));
            continue;
        };
        let of_event = ledger.counts.iter().filter(|line| line.event == event.name());
        lines.extend(of_event.map(|count| Line {
            count,
            component: quantity.name,
            key: constant.key.clone(),
            kind: constant.kind,
            joules: constant.value.map(|joules| joules * count.count as f64),
        }));
    }
    let slower: Vec<_> = changes.iter().filter(|c| c.time).map(|c| c.key).collect();
    let seconds = match (&ledger.cycles, hardware.timing) {
        (Some(phases), Some(timing)) if slower.is_empty() => {
            let hertz = timing.clock_khz as f64 * 1000.0;
            let seconds = phases.iter().map(|(name, c)| (name.clone(), c.elapsed as f64 / hertz));
            Some(seconds.collect::<BTreeMap<_, _>>())
        }
        (Some(_), Some(_)) => {
            let why = format!("the two chips differ in {}", slower.join(", "));
            missing.push(Missing { what: "time".into(), count: None, why });
            None
        }
        _ => {
            // how often rows are pulsed is known where pulses take time
            for what in ["time", Event::RowPulses.name()] {
                let why = "no cycles were counted: a model without [timing]".into();
                missing.push(Missing { what: what.into(), count: None, why });
            }
            None
        }
    };
    let powers = constants.iter().filter(|c| c.quantity.table == CostTable::Power);
    let idle: Vec<_> = powers
        .map(|constant| {
            let parts = plan.parts(constant.quantity.per, hardware);
            let watts = constant.value.map(|watts| watts * parts as f64);
            let phases = seconds.iter().flatten();
            let joules = phases.map(|(phase, s)| (phase.clone(), watts.map(|w| w * s)));
            Idle {
                component: constant.quantity.name,
                key: constant.key.clone(),
                kind: constant.kind,
                parts,
                watts,
                joules: joules.collect(),
            }
        })
        .collect();
    if !idle.is_empty() && seconds.is_none() {
        let why = "watts flow for seconds, and no time is known".into();
        missing.push(Missing { what: "static power".into(), count: None, why });
    }
    Bill { lines, idle, seconds, missing }
}

fn add(sum: &mut Range, joules: Range) {
    for (sum, joules) in sum.iter_mut().zip(joules) {
        *sum += joules;
    }
}

impl Bill<'_> {
    /// Joules of everything that has a price.
    #[must_use]
    pub fn total(&self) -> Range {
        let mut sum = [0.0; 3];
        self.lines.iter().for_each(|line| add(&mut sum, line.joules));
        self.idle.iter().flat_map(|i| i.joules.values()).for_each(|&joules| add(&mut sum, joules));
        sum
    }

    /// Seconds of all phases.
    #[must_use]
    pub fn seconds_total(&self) -> Option<f64> {
        self.seconds.as_ref().map(|phases| phases.values().sum())
    }

    /// Sums of lines of the same name, the greatest typical first; idling under `of_idle`'s name, if it has one.
    fn groups(
        &self,
        of_line: impl Fn(&Line<'_>) -> String,
        of_idle: impl Fn(&Idle, &str) -> Option<String>,
    ) -> Vec<Group> {
        let mut sums: BTreeMap<String, Range> = BTreeMap::new();
        for line in &self.lines {
            add(sums.entry(of_line(line)).or_default(), line.joules);
        }
        for idle in &self.idle {
            for (phase, &joules) in &idle.joules {
                if let Some(name) = of_idle(idle, phase) {
                    add(sums.entry(name).or_default(), joules);
                }
            }
        }
        let mut groups: Vec<_> =
            sums.into_iter().map(|(name, joules)| Group { name, joules }).collect();
        groups.sort_by(|a, b| b.joules[1].total_cmp(&a.joules[1]));
        groups
    }

    /// By component.
    #[must_use]
    pub fn by_component(&self) -> Vec<Group> {
        self.groups(|line| line.component.into(), |idle, _| Some(idle.component.into()))
    }

    /// By layer; idling belongs to no layer.
    #[must_use]
    pub fn by_layer(&self) -> Vec<Group> {
        let mut groups =
            self.groups(|line| format!("layer {}", line.count.layer), |_, _| Some("static".into()));
        groups.sort_by_key(|g| (g.name == "static", g.name.len(), g.name.clone()));
        groups
    }

    /// By pathway; what a target does for both of its banks is charged to its excitatory one.
    #[must_use]
    pub fn by_pathway(&self) -> Vec<Group> {
        self.groups(|line| line.count.pathway.clone(), |_, _| Some("static".into()))
    }

    /// By operation.
    #[must_use]
    pub fn by_operation(&self) -> Vec<Group> {
        self.groups(|line| line.count.operation.clone(), |_, _| Some("static".into()))
    }

    /// By phase.
    #[must_use]
    pub fn by_phase(&self) -> Vec<Group> {
        self.groups(|line| line.count.phase.clone(), |_, phase| Some(phase.into()))
    }

    /// How much of the typical total leans on each constant, the greatest first.
    #[must_use]
    pub fn shares(&self) -> Vec<Share> {
        let total = self.total()[1];
        let mut sums: BTreeMap<&str, (f64, Kind)> = BTreeMap::new();
        for line in &self.lines {
            sums.entry(&line.key).or_insert((0.0, line.kind)).0 += line.joules[1];
        }
        for idle in &self.idle {
            let joules: f64 = idle.joules.values().map(|joules| joules[1]).sum();
            sums.entry(&idle.key).or_insert((0.0, idle.kind)).0 += joules;
        }
        let share = |joules: f64| if total > 0.0 { joules / total } else { 0.0 };
        let shares = sums.into_iter().map(|(key, (joules, kind))| Share {
            key: key.into(),
            share: share(joules),
            kind,
        });
        let mut shares: Vec<_> = shares.collect();
        shares.sort_by(|a, b| b.share.total_cmp(&a.share));
        shares
    }

    /// The part of the typical total that leans on assumed constants, and these by share.
    #[must_use]
    pub fn assumed(&self) -> (f64, Vec<Share>) {
        let mut shares = self.shares();
        shares.retain(|share| share.kind == Kind::Assumed && share.share > 0.0);
        // parts of a whole, each rounded, may add up to a little more than it
        (shares.iter().map(|share| share.share).sum::<f64>().min(1.0), shares)
    }

    /// Everything as JSON: joules are `[low, typical, high]`.
    #[must_use]
    pub fn to_json(&self) -> serde_json::Value {
        let (assumed_share, assumed) = self.assumed();
        serde_json::json!({
            "joules": self.total(),
            "seconds": self.seconds_total(),
            "seconds_by_phase": self.seconds,
            "by_component": self.by_component(),
            "by_layer": self.by_layer(),
            "by_pathway": self.by_pathway(),
            "by_operation": self.by_operation(),
            "by_phase": self.by_phase(),
            "assumed_share": assumed_share,
            "assumed": assumed,
            "not_priced": self.missing,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lab::config::{self, Sources};
    use crate::lab::price::LayerFootprint;
    use crate::lab::store::ledger::CyclesRecord;

    fn line(phase: &str, layer: usize, event: &str, count: u64) -> CountRecord {
        CountRecord {
            phase: phase.into(),
            layer,
            pathway: "pp".into(),
            operation: "update".into(),
            event: event.into(),
            count,
        }
    }

    fn ledger() -> LedgerRecord {
        let elapsed = |elapsed| CyclesRecord { elapsed, stages: [].into(), layers: vec![] };
        LedgerRecord {
            counts: vec![
                line("training", 0, "conversions", 1000),
                line("training", 1, "holds", 500),
                line("evaluation", 1, "conversions", 3000),
                line("training", 0, "requested", 77),
                line("training", 0, "multiplies", 5),
            ],
            cycles: Some(
                [("training".into(), elapsed(2000)), ("evaluation".into(), elapsed(8000))].into(),
            ),
        }
    }

    /// An empty chip with two energies and a static power, at 1 MHz.
    fn chip() -> config::Config {
        let text = "
            [hw]
            name = \"x\"
            timing.clock_mhz = 1
            [hw.energy]
            conversion_pj = { low = 1, typical = 2, high = 4, source = \"s\", kind = \"assumed\" }
            hold_fj = { low = 0, typical = 4, high = 4, source = \"s\", kind = \"measured\" }
            [hw.power]
            tile_static_nw = { low = 1, typical = 1, high = 1, source = \"s\", kind = \"fitted\" }
        ";
        config::load(&Sources { experiment: Some(("x", text)), ..Sources::default() }).unwrap()
    }

    fn close(found: f64, wanted: f64) -> bool {
        (found - wanted).abs() <= 1e-9 * wanted.abs()
    }

    #[test]
    fn counts_times_constants_and_watts_times_seconds() {
        let (config, ledger) = (chip(), ledger());
        let plan =
            Footprint { layers: vec![LayerFootprint { rows: 300, columns: 256, targets: 1 }] };
        let bill = price(&ledger, &plan, &config.hardware, &config.constants, &[]);
        // 4000 conversions, 500 holds, two tiles for 10 ms
        let wanted = [4e-9 + 2e-11, 8e-9 + 2e-12 + 2e-11, 16e-9 + 2e-12 + 2e-11];
        for (found, wanted) in bill.total().into_iter().zip(wanted) {
            assert!(close(found, wanted), "{found} {wanted}");
        }
        assert!(close(bill.seconds_total().unwrap(), 0.01));
        let phases = bill.by_phase();
        assert_eq!(phases[0].name, "evaluation");
        assert!(close(phases[0].joules[1], 6e-9 + 1.6e-11));
        for groups in [bill.by_component(), bill.by_layer(), bill.by_operation(), bill.by_pathway()]
        {
            let sum: f64 = groups.iter().map(|group| group.joules[1]).sum();
            assert!(close(sum, bill.total()[1]), "{groups:?}");
        }
        let (share, assumed) = bill.assumed();
        assert!(close(share, 8e-9 / bill.total()[1]));
        assert_eq!(assumed[0].key, "energy.conversion_pj");
        // an action without a price is named; an outcome needs none
        let missing: Vec<_> = bill.missing.iter().map(|m| (&*m.what, m.count)).collect();
        assert_eq!(missing, [("multiplies", Some(5))]);
    }

    #[test]
    fn what_another_chip_would_do_otherwise_is_not_priced() {
        let (config, ledger) = (chip(), ledger());
        let change = Change { key: "tile.rows", events: &[Event::Holds], time: true };
        let plan = Footprint::default();
        let bill = price(&ledger, &plan, &config.hardware, &config.constants, &[change]);
        assert!(close(bill.total()[1], 8e-9) && bill.seconds.is_none());
        let whys = bill.missing.iter().map(|m| (&*m.what, m.why.contains("tile.rows")));
        let whys: Vec<_> = whys.collect();
        assert_eq!(
            whys,
            [("holds", true), ("multiplies", false), ("time", true), ("static power", false)]
        );
    }
}
