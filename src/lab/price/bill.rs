//! Counts times constants, and what stands out in the sum.

use std::collections::BTreeMap;

use serde::Serialize;

use super::changes::Change;
use super::piece::{PerPiece, PieceKind, Pieces};
use super::plan::Footprint;
use super::total::{EnergySplit, EnergyTotal, Range};
use crate::chip::hardware::Hardware;
use crate::chip::ledger::{During, Event};
use crate::lab::config::{Constant, Constants, CostClass, CostTable, Kind, Per, QUANTITIES};
use crate::lab::store::ledger::{CountRecord, LedgerRecord};

/// Bits that an addition to a digital sum moves: 32 out, 32 in.
const SUM_BITS: u64 = 64;

/// Events of one place and what they cost.
#[derive(Debug, Clone, PartialEq)]
pub struct Line<'a> {
    /// Where, and how often.
    pub count: &'a CountRecord,
    /// Which quantity priced it: its name stands for the component.
    pub component: &'static str,
    /// What the component is of.
    pub class: CostClass,
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
    /// What the component is of.
    pub class: CostClass,
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
    /// An event, a part that idles, or `time`.
    pub what: String,
    /// How often it happened, where it was counted.
    pub count: Option<u64>,
    /// Why it has no price.
    pub why: String,
    /// What the energy is of that is missing; `None`: no energy is.
    #[serde(skip)]
    pub class: Option<CostClass>,
    /// Phases it is missing in.
    #[serde(skip)]
    pub phases: Vec<String>,
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
    /// Constants that a law of the model brought to this setting: key, and which law from where.
    pub scaled: Vec<(String, String)>,
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
    let (mut lines, mut missing) = (Vec::new(), Vec::new());
    for event in Event::ALL {
        let per = Per::of(event);
        let priced = QUANTITIES.iter().find(|q| q.per == per);
        let (Some(quantity), count) = (priced, ledger.total(event)) else { continue };
        if count == 0 {
            continue;
        }
        let touched: Vec<_> = changes.iter().filter(|c| c.touches(per)).map(|c| c.key).collect();
        let why = match constants.of(event) {
            _ if !touched.is_empty() => format!("the two chips differ in {}", touched.join(", ")),
            None => format!("the model has no energy.{}", quantity.name),
            Some(constant) => match constant.not_here() {
                Some(why) => why.to_owned(),
                None => {
                    let of_event = ledger.counts.iter().filter(|line| line.event == event.name());
                    lines.extend(of_event.map(|count| line(constant, count)));
                    continue;
                }
            },
        };
        missing.push(Missing {
            what: event.name().into(),
            count: Some(count),
            why,
            class: Some(quantity.class()),
            phases: phases_of(ledger, event),
        });
    }
    let seconds = seconds(ledger, hardware, changes).unwrap_or_else(|no_time| {
        missing.extend(no_time);
        None
    });
    let mut idle = Vec::new();
    for constant in constants.iter().filter(|c| c.quantity.table == CostTable::Power) {
        let why = match (&seconds, constant.not_here()) {
            (_, Some(why)) => why.to_owned(),
            (None, None) => "watts flow for seconds, and no time is known".into(),
            (Some(seconds), None) => {
                idle.push(idling(constant, plan.parts(constant.quantity.per, hardware), seconds));
                continue;
            }
        };
        missing.push(Missing {
            what: constant.quantity.name.into(),
            count: None,
            why,
            class: Some(constant.quantity.class()),
            phases: phases(ledger),
        });
    }
    let used = |key: &String| {
        lines.iter().any(|line| line.key == *key) || idle.iter().any(|idle| idle.key == *key)
    };
    let scaled = constants
        .iter()
        .filter_map(|constant| Some((constant.key.clone(), constant.scaled()?.to_owned())));
    let scaled = scaled.filter(|(key, _)| used(key)).collect();
    Bill { lines, idle, seconds, missing, scaled }
}

fn line<'a>(constant: &Constant, count: &'a CountRecord) -> Line<'a> {
    Line {
        count,
        component: constant.quantity.name,
        class: constant.quantity.class(),
        key: constant.key.clone(),
        kind: constant.kind,
        joules: constant.value.map(|joules| joules * count.count as f64),
    }
}

fn idling(constant: &Constant, parts: u64, seconds: &BTreeMap<String, f64>) -> Idle {
    let watts = constant.value.map(|watts| watts * parts as f64);
    let joules = seconds.iter().map(|(phase, s)| (phase.clone(), watts.map(|w| w * s)));
    Idle {
        component: constant.quantity.name,
        class: constant.quantity.class(),
        key: constant.key.clone(),
        kind: constant.kind,
        parts,
        watts,
        joules: joules.collect(),
    }
}

/// Seconds by phase, or what is missing because there are none.
fn seconds(
    ledger: &LedgerRecord,
    hardware: &Hardware,
    changes: &[Change],
) -> Result<Option<BTreeMap<String, f64>>, Vec<Missing>> {
    let lacks = |what: &str, why: &str, class, phases| {
        let (what, why) = (what.into(), why.into());
        Missing { what, count: None, why, class, phases }
    };
    let slower: Vec<_> = changes.iter().filter(|c| c.time).map(|c| c.key).collect();
    match (&ledger.cycles, hardware.timing) {
        (Some(phases), Some(timing)) if slower.is_empty() => {
            let hertz = timing.clock_khz as f64 * 1000.0;
            let seconds = phases.iter().map(|(name, c)| (name.clone(), c.elapsed as f64 / hertz));
            Ok(Some(seconds.collect()))
        }
        (Some(_), Some(_)) => {
            let why = format!("the two chips differ in {}", slower.join(", "));
            Err(vec![lacks("time", &why, None, vec![])])
        }
        _ => {
            let why = "no cycles were counted: a model without [timing]";
            let mut missing = vec![lacks("time", why, None, vec![])];
            // how often rows are pulsed is known where pulses take time
            let pulsed = phases_of(ledger, Event::PulsesAttempted);
            if !pulsed.is_empty() {
                let class = Some(CostClass::Device);
                missing.push(lacks(Event::RowPulses.name(), why, class, pulsed));
            }
            Err(missing)
        }
    }
}

/// Phases in which something happened.
fn phases(ledger: &LedgerRecord) -> Vec<String> {
    let mut phases: Vec<_> = ledger.counts.iter().map(|line| line.phase.clone()).collect();
    phases.sort();
    phases.dedup();
    phases
}

/// Phases in which an event happened.
fn phases_of(ledger: &LedgerRecord, event: Event) -> Vec<String> {
    let of_event = ledger.counts.iter().filter(|line| line.event == event.name() && line.count > 0);
    let mut phases: Vec<_> = of_event.map(|line| line.phase.clone()).collect();
    phases.sort();
    phases.dedup();
    phases
}

fn add(sum: &mut Range, joules: Range) {
    for (sum, joules) in sum.iter_mut().zip(joules) {
        *sum += joules;
    }
}

impl Bill<'_> {
    /// Joules of everything that has a price, and how much has.
    #[must_use]
    pub fn total(&self) -> EnergyTotal {
        self.sum(None, None)
    }

    /// The same of one phase.
    #[must_use]
    pub fn of_phase(&self, phase: &str) -> EnergyTotal {
        self.sum(None, Some(phase))
    }

    /// The total, or that of a phase, by class: device, converter, digital, and static where there is such a thing.
    #[must_use]
    pub fn split(&self, phase: Option<&str>) -> Vec<EnergySplit> {
        let classes = CostClass::EACH.iter();
        let split =
            classes.map(|&class| EnergySplit { class, total: self.sum(Some(class), phase) });
        split.filter(|split| split.total.parts > 0).collect()
    }

    /// What an image, an update or a decision takes, phase by phase.
    #[must_use]
    pub fn per_piece(&self, pieces: &Pieces) -> Vec<PerPiece> {
        let of = |(phase, kind, count): (&str, PieceKind, u64)| PerPiece {
            phase: phase.into(),
            kind,
            count,
            total: self.of_phase(phase).each(count),
            split: self
                .split(Some(phase))
                .into_iter()
                .map(|split| EnergySplit { total: split.total.each(count), ..split })
                .collect(),
            seconds: self.seconds.as_ref().and_then(|all| Some(all.get(phase)? / count as f64)),
        };
        pieces.phases().map(of).collect()
    }

    fn sum(&self, class: Option<CostClass>, phase: Option<&str>) -> EnergyTotal {
        let of_class = |found: CostClass| class.is_none_or(|class| class == found);
        let of_phase = |found: &str| phase.is_none_or(|phase| phase == found);
        let mut joules = [0.0; 3];
        let mut priced = Vec::new();
        for line in &self.lines {
            if of_class(line.class) && of_phase(&line.count.phase) {
                add(&mut joules, line.joules);
                priced.push(line.component);
            }
        }
        for idle in self.idle.iter().filter(|idle| of_class(idle.class)) {
            for (_, &each) in idle.joules.iter().filter(|(phase, _)| of_phase(phase)) {
                add(&mut joules, each);
                priced.push(idle.component);
            }
        }
        priced.sort_unstable();
        priced.dedup();
        let missing = self.missing.iter().filter(|missing| {
            let lost = phase.is_none() || missing.phases.iter().any(|found| of_phase(found));
            lost && missing.class.is_some_and(of_class)
        });
        EnergyTotal { joules, priced: priced.len(), parts: priced.len() + missing.count() }
    }

    /// The part of the typical total that goes into the memory of digital sums, where every product is added to one
    /// (`mode = "accumulate"`): a sum of 32 bits out and in again, 64 bits a product.
    #[must_use]
    pub fn sums_share(&self) -> Option<f64> {
        let update = |event: Event| {
            let lines = self.lines.iter().filter(move |line| {
                line.count.event == event.name() && line.count.operation == During::Update.name()
            });
            lines.fold((0, 0.0), |(count, joules): (u64, f64), line| {
                (count.saturating_add(line.count.count), joules + line.joules[1])
            })
        };
        let (bits, joules) = update(Event::SramBits);
        let (products, _) = update(Event::Accumulates);
        let total = self.total().joules[1];
        let added = products > 0 && bits >= SUM_BITS.saturating_mul(products);
        (added && total > 0.0).then(|| joules / total)
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
        let total = self.total().joules[1];
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

    /// Everything as JSON: joules are `[low, typical, high]`. What is only part of a total is `joules_at_least`.
    #[must_use]
    pub fn to_json(&self, pieces: &Pieces) -> serde_json::Value {
        let (assumed_share, assumed) = self.assumed();
        let split: Vec<_> = self.split(None).iter().map(EnergySplit::to_json).collect();
        let each: Vec<_> = self.per_piece(pieces).iter().map(PerPiece::to_json).collect();
        let scaled =
            self.scaled.iter().map(|(key, law)| serde_json::json!({"key": key, "law": law}));
        let mut all = serde_json::json!({
            "seconds": self.seconds_total(),
            "seconds_by_phase": self.seconds,
            "by_class": split,
            pieces.key(): each,
            "by_component": self.by_component(),
            "by_layer": self.by_layer(),
            "by_pathway": self.by_pathway(),
            "by_operation": self.by_operation(),
            "by_phase": self.by_phase(),
            "memory_of_sums_share": self.sums_share(),
            "assumed_share": assumed_share,
            "assumed": assumed,
            "scaled": scaled.collect::<Vec<_>>(),
            "not_priced": self.missing,
        });
        if let Some(object) = all.as_object_mut() {
            object.extend(self.total().to_json());
        }
        all
    }
}

#[cfg(test)]
mod tests;
