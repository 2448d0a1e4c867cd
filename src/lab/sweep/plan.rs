//! From points to runs: every point resolved and checked before the first one runs.
#![expect(clippy::disallowed_types, reason = "an estimate of time asks the clock")]

use std::collections::BTreeMap;
use std::str::FromStr;
use std::sync::Arc;
use std::time::Instant;

use super::{Point, Sweep, SweepError};
use crate::lab::config::{self, Config, Overlay, Sources};
use crate::lab::data::{self, Data, DataRoot};
use crate::lab::run::{self, Machine, Memory, Prices, RunError, Session};
use crate::lab::store::address;
use crate::lab::store::index::{PointRecord, SweepRecord};
use crate::lab::store::record::DataRecord;

/// Runs whose speed is measured for an estimate.
const PROBES: usize = 8;
/// Updates measured of each.
const PROBE_UPDATES: u64 = 24;

/// One of several processes that share the runs of a sweep: `I/N`, from `1/N` to `N/N`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Shard {
    number: u32,
    of: u32,
}

impl FromStr for Shard {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let parts =
            text.split_once('/').and_then(|(a, b)| Some((a.parse().ok()?, b.parse().ok()?)));
        match parts {
            Some((number, of)) if (1..=of).contains(&number) => Ok(Self { number, of }),
            _ => Err("write it as I/N with I from 1 to N, such as 1/4".into()),
        }
    }
}

impl Shard {
    /// Whether a run is this process's: runs are dealt out in turn.
    #[must_use]
    pub fn has(self, run: usize) -> bool {
        run as u64 % u64::from(self.of) == u64::from(self.number - 1)
    }
}

/// A point and the run it needs.
#[derive(Debug, Clone)]
pub struct Planned {
    /// The point.
    pub point: Point,
    /// Key of its run, or why there can be none.
    pub key: Result<String, String>,
    /// What its run is priced with: constants are no part of a run, so points that share one may differ in them.
    pub prices: Option<Arc<Prices>>,
}

/// One run; several points may need it.
#[derive(Debug, Clone)]
pub struct PlannedRun {
    /// Its key.
    pub key: String,
    /// Passes over its data.
    pub epochs: u32,
    /// Its data, in [`SweepPlan::data`].
    pub data: usize,
    /// The first point that needs it, in [`SweepPlan::points`].
    pub point: usize,
    /// How long it takes, roughly: cells x samples.
    pub work: f64,
}

/// All runs of a sweep.
#[derive(Debug)]
pub struct SweepPlan {
    /// The sweep.
    pub sweep: Sweep,
    /// Points, by number.
    pub points: Vec<Planned>,
    /// Points before the filters.
    pub before: usize,
    /// Runs: those of the first seed first, so that a table is soon complete if not exact.
    pub tasks: Vec<PlannedRun>,
    /// Data sets.
    pub data: Vec<Data>,
    /// `--set`: what lies between the sweep's `base` and its axes.
    settings: Vec<toml::Table>,
}

/// Resolves every point. `settings` (`key=value`) lie between the sweep's `base` and its axes.
///
/// # Errors
/// When no point makes a run; a point that cannot is kept with the reason.
pub fn plan(sweep: Sweep, settings: &[String], root: &DataRoot) -> Result<SweepPlan, SweepError> {
    let (points, before) = sweep.points()?;
    let settings_tables =
        settings.iter().map(|text| config::setting_table(text)).collect::<Result<Vec<_>, _>>()?;
    let mut plan = SweepPlan {
        points: vec![],
        before,
        tasks: vec![],
        data: vec![],
        sweep,
        settings: settings_tables,
    };
    // each is read once, also when it cannot be
    let mut sources: BTreeMap<String, Result<usize, String>> = BTreeMap::new();
    let left = Memory::left();
    let mut first_error = None;
    let mut known = BTreeMap::new();
    let mut chips: BTreeMap<String, Arc<Prices>> = BTreeMap::new();
    for point in points {
        let resolved = resolve(&plan.sweep, &plan.settings, &point)
            .map_err(SweepError::from)
            .and_then(|config| {
                let source = config.source()?;
                let name = format!("{source:?}");
                let at = match sources.get(&name) {
                    Some(Ok(at)) => *at,
                    Some(Err(error)) => return Err(SweepError::Unread(error.clone())),
                    None => {
                        let loaded = data::load(&source, root);
                        let at = loaded.as_ref().map(|_| plan.data.len());
                        sources.insert(name, at.map_err(ToString::to_string));
                        plan.data.push(loaded?);
                        plan.data.len() - 1
                    }
                };
                let (key, work) = check(&config, &plan.data[at], left)?;
                Ok((config, at, key, work))
            });
        let mut prices = None;
        let key = match resolved {
            Ok((config, data, key, work)) => {
                let own = Prices::of(&config);
                let shared = chips.entry(own.fingerprint()).or_insert_with(|| Arc::new(own));
                prices = Some(Arc::clone(shared));
                if known.insert(key.clone(), ()).is_none() {
                    let task = PlannedRun {
                        key: key.clone(),
                        epochs: config.epochs,
                        data,
                        point: plan.points.len(),
                        work,
                    };
                    plan.tasks.push(task);
                }
                Ok(key)
            }
            Err(error) => {
                let text = error.to_string();
                first_error.get_or_insert(error);
                Err(text)
            }
        };
        plan.points.push(Planned { point, key, prices });
    }
    if let (Some(error), true) = (first_error, plan.tasks.is_empty()) {
        return Err(error);
    }
    let seeds = plan.sweep.seeds.clone();
    let rank = |task: &PlannedRun| {
        let seed = plan.points[task.point].point.seed;
        (seeds.iter().position(|one| Some(*one) == seed), task.point)
    };
    plan.tasks.sort_by_key(rank);
    for setting in settings {
        plan.sweep.text += &format!("\n# carried out with --set {}", setting.replace('\n', " "));
    }
    Ok(plan)
}

fn resolve(
    sweep: &Sweep,
    settings: &[toml::Table],
    point: &Point,
) -> Result<Config, config::ConfigError> {
    let axes = sweep.axes.iter().map(|axis| format!("axis `{}`", axis.name)).collect::<Vec<_>>();
    let base = Overlay { place: "base", table: &sweep.base };
    let settings = settings.iter().map(|table| Overlay { place: "--set", table });
    let axes =
        axes.iter().zip(&point.keys).map(|(place, table)| Overlay { place, table: table.as_ref() });
    let overlays: Vec<_> = std::iter::once(base).chain(settings).chain(axes).collect();
    let [name, text] = &sweep.experiment;
    let experiment = (!text.is_empty()).then_some((&**name, &**text));
    let seed = point.seed;
    config::load(&Sources { experiment, overlays: &overlays, seed, ..Sources::default() })
}

/// Checks that a configuration fits data and chip; the address of its run, and how much work it is.
fn check(config: &Config, data: &Data, left: Option<Memory>) -> Result<(String, f64), RunError> {
    let train = &data.split.train;
    let record = DataRecord::of(data);
    let networks = config.networks(record.features, record.classes, record.image)?;
    let layers: Vec<_> = networks.into_iter().flat_map(|network| network.layers).collect();
    run::weigh(&layers, &config.hardware, config.batch, left)?;
    let key =
        address::key(config.given(record.features, record.classes, record.image)?, &record.hash);
    let cells = |layer: &crate::chip::layer::LayerSpec| {
        let reads = layer.wiring.pathways().len() as f64 * layer.positions() as f64;
        reads * layer.inputs as f64 * layer.units as f64
    };
    // levels of more than a byte take about twice the time
    let planes = if config.hardware.cell.level_bits.get() > 8 { 2.0 } else { 1.0 };
    let samples = match &config.policy {
        None => train.len() as f64 * f64::from(config.epochs),
        Some(policy) => policy.work(),
    };
    Ok((key, layers.iter().map(cells).sum::<f64>() * planes * samples))
}

impl SweepPlan {
    /// The configuration of a run, resolved again: that of every point at once would take the memory of the runs.
    ///
    /// # Errors
    /// When a file that it names was changed since it was planned.
    pub fn config(&self, task: &PlannedRun) -> Result<Config, SweepError> {
        let config = resolve(&self.sweep, &self.settings, &self.points[task.point].point)?;
        match check(&config, &self.data[task.data], None)? {
            (key, _) if key == task.key => Ok(config),
            _ => Err(SweepError::Changed),
        }
    }

    /// As an index keeps it.
    #[must_use]
    pub fn records(&self) -> (SweepRecord, Vec<PointRecord>) {
        let Sweep { name, text, experiment, .. } = &self.sweep;
        let sweep = SweepRecord {
            name: name.clone(),
            text: text.clone(),
            experiment: experiment[1].clone(),
        };
        let points = self.points.iter().map(|planned| PointRecord {
            number: planned.point.number,
            seed: planned.point.seed,
            axes: serde_json::to_string(&planned.point.values).expect("values have a JSON form"),
            key: planned.key.clone().ok(),
            refused: planned.key.clone().err(),
        });
        (sweep, points.collect())
    }

    /// A point in words: `bits 4, rule ed, seed 1`.
    #[must_use]
    pub fn words(&self, point: usize) -> String {
        let point = &self.points[point].point;
        let axes = self.sweep.axes.iter().zip(&point.values);
        let mut words: Vec<_> =
            axes.map(|(axis, value)| format!("{} {value}", axis.name)).collect();
        words.extend(point.seed.map(|seed| format!("seed {seed}")));
        words.join(", ")
    }
}

/// How long runs would take.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Estimate {
    /// Seconds of one core for all of them.
    pub core_seconds: f64,
    /// Runs whose first updates were measured.
    pub probes: usize,
}

/// Measures the first updates of a few runs.
///
/// # Errors
/// When a run cannot be started.
pub fn estimate(
    plan: &SweepPlan,
    tasks: &[&PlannedRun],
    machine: Machine,
) -> Result<Estimate, SweepError> {
    let probes = PROBES.min(tasks.len());
    let (mut seconds, mut work) = (0.0, 0.0);
    for probe in 0..probes {
        let task = tasks[(2 * probe + 1) * tasks.len() / (2 * probes)];
        let data = &plan.data[task.data];
        let started = Instant::now();
        let mut session = Session::new(&plan.config(task)?, data.clone(), machine)?;
        let start = started.elapsed().as_secs_f64();
        let (samples, updates) = session.epoch_size();
        let measured = PROBE_UPDATES.min(updates);
        let started = Instant::now();
        session.updates(measured)?;
        let update = started.elapsed().as_secs_f64() / measured as f64;
        let epochs = f64::from(task.epochs);
        // reading without learning takes about a third
        let split = &data.split;
        let read = split.validation.len() as f64 * (epochs + 1.0) + split.test.len() as f64;
        let reads = read / samples as f64 * updates as f64 / 3.0;
        seconds += start + update * (updates as f64 * epochs + reads);
        work += task.work;
    }
    let all: f64 = tasks.iter().map(|task| task.work).sum();
    let core_seconds = if work > 0.0 { seconds / work * all } else { 0.0 };
    Ok(Estimate { core_seconds, probes })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shards_deal_out_every_run_once() {
        let shards: Vec<Shard> = ["1/3", "2/3", "3/3"].map(|text| text.parse().unwrap()).into();
        for run in 0..20 {
            assert_eq!(shards.iter().filter(|shard| shard.has(run)).count(), 1);
        }
        for text in ["0/3", "4/3", "1", "a/b", "1/0", ""] {
            assert!(text.parse::<Shard>().is_err(), "{text}");
        }
    }

    fn planned(text: &str, settings: &[&str]) -> Result<SweepPlan, String> {
        let sweep = Sweep::parse("s.toml", text, "").map_err(|e| e.to_string())?;
        let settings: Vec<String> = settings.iter().map(ToString::to_string).collect();
        plan(sweep, &settings, &DataRoot::new("data")).map_err(|e| e.to_string())
    }

    const BITS: &str = "seeds = 2\nbase.data.set = 'xor'\n[[axis]]\nkey = 'hw.cell.level_bits'\nvalues = [2, 4, 44]\n";

    #[test]
    fn points_that_cannot_run_are_refused_and_the_rest_goes_on() {
        let plan = planned(BITS, &["learning.epochs=3"]).unwrap();
        assert_eq!((plan.points.len(), plan.tasks.len()), (6, 4));
        let why = plan.points[4].key.clone().unwrap_err();
        assert!(why.contains("hw.cell.level_bits") && why.contains("44"), "{why}");
        assert!(plan.tasks.iter().all(|task| task.epochs == 3));
        // the first seed comes first
        let order: Vec<_> = plan.tasks.iter().map(|task| plan.words(task.point)).collect();
        assert_eq!(order[1], "level_bits 4, seed 1");
        assert_eq!(order[2], "level_bits 2, seed 2");
    }

    #[test]
    fn one_impossible_point_does_not_end_a_sweep() {
        // data that are not there, a layer that no memory holds, and a rate that no shift stands for
        let text = "base.data.set = 'xor'\n[[axis]]\nname = 'what'\n[[axis.case]]\nname = 'good'\n[[axis.case]]\n\
                    name = 'data'\nset.data.set = 'mnist'\n[[axis.case]]\nname = 'memory'\n\
                    set.network.hidden = [65535, 65535, 65535, 65535]\n[[axis.case]]\nname = 'rate'\nset.learning.rate = 1e-5\n";
        let plan = planned(text, &[]).unwrap();
        assert_eq!((plan.points.len(), plan.tasks.len()), (4, 1));
        let why = |at: usize| plan.points[at].key.clone().unwrap_err();
        assert!(why(1).contains("data fetch mnist"), "{}", why(1));
        assert!(why(2).contains("of memory"), "{}", why(2));
        assert!(why(3).contains("learning.rate"), "{}", why(3));
        // and what was resolved once is resolved again as the same
        assert_eq!(plan.config(&plan.tasks[0]).unwrap().epochs, plan.tasks[0].epochs);
    }

    #[test]
    fn a_key_that_nobody_knows_stops_the_sweep() {
        let text = "base.data.set = 'xor'\n[[axis]]\nkey = 'hw.cell.level_bit'\nvalues = [2]\n";
        let error = planned(text, &[]).unwrap_err();
        assert!(error.contains("axis `level_bit`") && error.contains("unknown field"), "{error}");
    }

    #[test]
    fn points_with_one_configuration_share_a_run() {
        let text = "base.data.set = 'xor'\n[[axis]]\nname = 'a'\n[[axis.case]]\nname = 1\n[[axis.case]]\nname = 2\n";
        let plan = planned(text, &[]).unwrap();
        assert_eq!((plan.points.len(), plan.tasks.len()), (2, 1));
        assert_eq!(plan.points[0].key, plan.points[1].key);
    }
}
