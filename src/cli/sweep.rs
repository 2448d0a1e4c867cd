//! `sweep`: many runs from one file.

use std::path::PathBuf;
use std::sync::Mutex;
use std::time::Duration;

use clap::Args;
use serde_json::json;

use super::progress::{SweepMeter, clock};
use super::run::stop_flag;
use super::{Done, Failure, Shared, environment, say};
use crate::lab::run::{Keeping, Machine};
use crate::lab::store::index::Store;
use crate::lab::sweep::{
    self, Carried, Options, PlannedRun, Shard, Sweep, SweepError, SweepEvent, SweepPlan,
};

#[derive(Debug, Args)]
pub(super) struct SweepArgs {
    /// Sweep file
    file: PathBuf,
    /// Folder of all runs; finished ones are never run again [default: store, or DALEAN_STORE]
    #[arg(long, value_name = "DIR")]
    store: Option<PathBuf>,
    /// Show what would run and how long it takes, and run nothing
    #[arg(long)]
    dry_run: bool,
    /// Carry out only every N-th run, from the I-th on: for job arrays, each with the same or its own store
    #[arg(long, value_name = "I/N")]
    shard: Option<Shard>,
    /// Change a key of all points, such as learning.epochs=1 (repeatable); axes win
    #[arg(long = "set", value_name = "KEY=VALUE")]
    settings: Vec<String>,
    /// Keep the states of finished runs, for `eval` and for the levels in their reports
    #[arg(long)]
    keep_states: bool,
    /// Write the states of runs at work at most every N seconds: what a kill may cost
    #[arg(long, value_name = "N", default_value_t = 10)]
    checkpoint_seconds: u64,
    /// Replace a sweep of that name and other content in the store; its runs stay
    #[arg(long)]
    replace: bool,
    #[command(flatten)]
    shared: Shared,
}

impl From<SweepError> for Failure {
    fn from(error: SweepError) -> Self {
        let code = match error {
            SweepError::Config(_)
            | SweepError::Key { .. }
            | SweepError::Axis { .. }
            | SweepError::Filter { .. }
            | SweepError::Empty { .. } => 2,
            SweepError::Run(error) => return error.into(),
            _ => 1,
        };
        Self { code, message: error.to_string() }
    }
}

/// The store a command means.
pub(super) fn store_path(given: Option<&PathBuf>) -> PathBuf {
    let named = || environment("DALEAN_STORE").map(PathBuf::from);
    given.cloned().or_else(named).unwrap_or_else(|| PathBuf::from("store"))
}

pub(super) fn execute(args: &SweepArgs) -> Done {
    let shared = &args.shared;
    let machine = shared.machine()?;
    let path = store_path(args.store.as_ref());
    let plan = sweep::plan(Sweep::read(&args.file)?, &args.settings, &shared.data_root())?;
    if args.dry_run {
        return dry_run(args, &plan, machine, &path);
    }
    announce(shared, &plan, &path);
    let mut store = Store::open(&path).map_err(SweepError::from)?;
    let stop = stop_flag();
    let every = Duration::from_secs(args.checkpoint_seconds);
    let keeping = Keeping { states: args.keep_states, every, streams: false };
    let options = Options {
        backend: machine.backend(),
        jobs: machine.threads(),
        keeping,
        shard: args.shard,
        replace: args.replace,
    };
    let meter = Mutex::new(SweepMeter::new(shared.quiet || shared.json));
    let on_event = |event: SweepEvent<'_>| {
        let mut meter = meter.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        tell(&mut meter, &plan, &event);
        if shared.json {
            tell_json(&plan, &event);
        }
    };
    let carried = sweep::carry_out(&plan, &mut store, options, &stop, &on_event);
    let seconds = meter.lock().unwrap_or_else(std::sync::PoisonError::into_inner).finish();
    let Carried { runs, finished, failed } = carried?;
    let name = &plan.sweep.name;
    let record = sweep::find(&store, Some(name))?;
    let made = sweep::report(&store, &record, true)?;
    let page = made.page;
    if shared.json {
        say(&json!({"event": "done", "sweep": name, "store": path.display().to_string(),
            "points": plan.points.len(), "runs": runs, "finished": finished, "failed": failed,
            "seconds": seconds, "page": page.display().to_string(),
            "not_simulated": made.not_simulated})
        .to_string());
    } else {
        made.text.iter().filter(|_| !shared.quiet).for_each(|text| say(&format!("{text}\n")));
        say(&format!(
            "{name}: {finished} of {runs} runs finished{} in {}",
            if failed > 0 { format!(", {failed} failed") } else { String::new() },
            clock(Duration::from_secs_f64(seconds)),
        ));
        let mut effects: Vec<_> =
            made.not_simulated.iter().filter_map(|text| text.split(" = ").next()).collect();
        effects.dedup();
        if !effects.is_empty() {
            let count = effects.len();
            say(&format!(
                "beside   {count} effects of real chips are not simulated: see the report"
            ));
        }
        say(&format!("report   {}", page.display()));
        say(&format!("table    dalean export {} --sweep {name}", path.display()));
    }
    if failed > 0 {
        let message = format!("{failed} runs failed; the report of the sweep says why");
        return Err(Failure { code: 1, message });
    }
    if finished < runs {
        let message = format!(
            "stopped: {finished} of {runs} runs are finished; give the same command again to go on"
        );
        return Err(Failure { code: 3, message });
    }
    Ok(())
}

/// What the sweep is, in a few lines.
fn announce(shared: &Shared, plan: &SweepPlan, path: &std::path::Path) {
    let sweep = &plan.sweep;
    let refused = plan.points.iter().filter(|planned| planned.key.is_err()).count();
    if shared.json {
        let axes: Vec<_> = sweep.axes.iter().map(|axis| &axis.name).collect();
        say(&json!({"event": "planned", "sweep": sweep.name, "store": path.display().to_string(),
            "axes": axes, "seeds": sweep.seeds, "points": plan.points.len(),
            "filtered": plan.before - plan.points.len(), "refused": refused,
            "runs": plan.tasks.len()})
        .to_string());
    } else if !shared.quiet {
        tell!("{}", describe(plan));
        for data in &plan.data {
            tell!("{}", data.description);
            data.said.iter().for_each(|line| tell!("data: {line}"));
        }
        let first = plan.points.iter().position(|planned| planned.key.is_err());
        if let Some(first) = first
            && let Err(why) = &plan.points[first].key
        {
            let others =
                if refused > 1 { format!(" (and {} more)", refused - 1) } else { String::new() };
            tell!("warning: point {} ({}) cannot run{others}: {why}", first + 1, plan.words(first));
        }
        tell!("store {}", path.display());
    }
}

/// `level-bits: 216 points = 12 level_bits x 2 rounding x 3 rule x 3 seeds, 216 runs`.
fn describe(plan: &SweepPlan) -> String {
    let sweep = &plan.sweep;
    let mut parts: Vec<String> = match sweep.sample {
        None => {
            let size = |axis: &sweep::Axis| format!("{} {}", axis.list().len(), axis.name);
            sweep.axes.iter().map(size).collect()
        }
        Some(sample) => {
            let names: Vec<_> = sweep.axes.iter().map(|axis| &*axis.name).collect();
            let method = if sample.latin_hypercube { "Latin hypercube" } else { "random" };
            vec![format!("{} {method} points of {}", sample.points, names.join(", "))]
        }
    };
    if !sweep.seeds.is_empty() {
        parts.push(format!("{} seeds", sweep.seeds.len()));
    }
    let filtered = plan.before - plan.points.len();
    let filtered = if filtered > 0 { format!(" less {filtered} filtered") } else { String::new() };
    let runs = plan.tasks.len();
    format!(
        "{}: {} points = {}{filtered}, {runs} runs",
        sweep.name,
        plan.points.len(),
        parts.join(" x ")
    )
}

fn dry_run(args: &SweepArgs, plan: &SweepPlan, machine: Machine, path: &std::path::Path) -> Done {
    let shared = &args.shared;
    announce(shared, plan, path);
    let mine = |at: &usize| args.shard.is_none_or(|shard| shard.has(*at));
    let tasks = (0..plan.tasks.len()).filter(mine).map(|at| &plan.tasks[at]);
    let tasks: Vec<&PlannedRun> = tasks.collect();
    let store = Store::existing(path).ok();
    let finished = |task: &&PlannedRun| {
        store
            .as_ref()
            .is_some_and(|store| store.is_finished(&task.key).is_ok_and(|finished| finished))
    };
    let all = tasks.len();
    let todo: Vec<&PlannedRun> = tasks.into_iter().filter(|task| !finished(task)).collect();
    let one = Machine::new(machine.backend(), 1)?;
    let estimate = sweep::estimate(plan, &todo, one)?;
    let jobs = machine.threads().min(todo.len()).max(1);
    let seconds = estimate.core_seconds / jobs as f64;
    if shared.json {
        say(&json!({"event": "done", "dry_run": true, "sweep": plan.sweep.name,
            "points": plan.points.len(), "runs": all, "finished": all - todo.len(),
            "todo": todo.len(), "jobs": jobs, "core_seconds": estimate.core_seconds,
            "seconds": seconds, "probes": estimate.probes})
        .to_string());
    } else {
        let shard = if args.shard.is_some() { " in this shard" } else { "" };
        say(&format!("{all} runs{shard}: {} finished, {} to do", all - todo.len(), todo.len()));
        say(&format!(
            "about {} with {jobs} at a time ({} core hours); the first updates of {} runs were measured",
            clock(Duration::from_secs_f64(seconds)),
            (estimate.core_seconds / 36.0).round() / 100.0,
            estimate.probes,
        ));
    }
    Ok(())
}

fn tell(meter: &mut SweepMeter, plan: &SweepPlan, event: &SweepEvent<'_>) {
    match event {
        SweepEvent::Started { finished, todo, work } => meter.start(*finished, *todo, *work),
        SweepEvent::Work(work) => meter.work(*work),
        SweepEvent::Finished { task, row, seconds, elsewhere, .. } => {
            let figure = &plan.sweep.figures.y;
            let value = row.results.get(figure).and_then(serde_json::Value::as_f64);
            let value = value.map_or_else(|| "-".into(), |value| format!("{value:.4}"));
            let took = if *elsewhere { "elsewhere".into() } else { format!("{seconds:.1} s") };
            meter.finished(&format!("{}  {figure} {value}  {took}", plan.words(task.point)));
        }
        SweepEvent::Failed { task, error } => {
            meter.line(&format!("failed: {}: {error}", plan.words(task.point)));
        }
        SweepEvent::Waiting { runs } => {
            meter.line(&format!("waiting for {runs} runs that other processes are at"));
        }
    }
}

fn tell_json(plan: &SweepPlan, event: &SweepEvent<'_>) {
    let line = match event {
        SweepEvent::Work(_) => return,
        SweepEvent::Started { finished, todo, .. } => {
            json!({"event": "started", "finished": finished, "todo": todo})
        }
        SweepEvent::Finished { task, row, seconds, elsewhere, finished } => {
            let point = &plan.points[task.point].point;
            json!({"event": "run", "key": task.key, "point": point.number, "values": point.values,
                "seed": point.seed, "results": row.results, "state_hash": row.state_hash,
                "seconds": seconds, "elsewhere": elsewhere, "finished": finished})
        }
        SweepEvent::Failed { task, error } => {
            json!({"event": "failed", "key": task.key, "what": plan.words(task.point), "message": error})
        }
        SweepEvent::Waiting { runs } => json!({"event": "waiting", "runs": runs}),
    };
    say(&line.to_string());
}
