//! `train`, `eval`, `verify`.

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, OnceLock};

use clap::Args;
use serde_json::json;

use super::progress::Meter;
use super::{
    Done, Failure, Moved, Shared, configuration, deploy, environment, known, note, say, usage,
};
use crate::lab::config::absent_words;
use crate::lab::price::{EnergySplit, PerPiece};
use crate::lab::run::{self, Keeping, Machine, RunError, RunEvent, Trained, Verdict};
use crate::lab::runs;
use crate::lab::store::folder::FolderError;
use crate::lab::store::index::{INDEX, Store};
use crate::lab::store::record::{EpisodesRecord, EpochRecord, PolicyTest, TestOutcome, TestRecord};
use crate::lab::sweep::{self, Finding, Sampled};

#[derive(Debug, Args)]
pub(super) struct TrainArgs {
    /// Experiment file [default: the built-in digits]
    #[arg(value_hint = clap::ValueHint::FilePath)]
    file: Option<PathBuf>,
    /// Hardware model: a built-in name or a file
    #[arg(long, value_name = "FILE", value_parser = known::models(), hide_possible_values = true)]
    hw: Option<String>,
    /// Change a key, such as hw.cell.level_bits=4; KEY=default takes back what a file said (repeatable)
    #[arg(long = "set", value_name = "KEY=VALUE")]
    settings: Vec<String>,
    /// Seed of all draws
    #[arg(long, value_name = "N")]
    seed: Option<u64>,
    /// Folder that gets the run's folder [default: runs, or DALEAN_RUNS]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Keep what the environments of a policy show, an epoch a file, so that it can be done again without them
    #[arg(long, conflicts_with = "resume")]
    record: bool,
    /// Continue a run from its last finished epoch
    #[arg(long, value_name = "RUN", value_hint = clap::ValueHint::DirPath, conflicts_with_all = ["file", "hw", "settings", "seed", "out"])]
    resume: Option<PathBuf>,
    #[command(flatten)]
    moved: Moved,
    #[command(flatten)]
    shared: Shared,
}

#[derive(Debug, Args)]
pub(super) struct EvalArgs {
    /// Folder of a run
    #[arg(value_hint = clap::ValueHint::DirPath)]
    run: PathBuf,
    #[command(flatten)]
    deploy: deploy::DeployArgs,
    #[command(flatten)]
    moved: Moved,
    #[command(flatten)]
    shared: Shared,
}

#[derive(Debug, Args)]
pub(super) struct VerifyArgs {
    /// Folder of a run, or a store
    #[arg(value_hint = clap::ValueHint::DirPath)]
    run: PathBuf,
    /// Show a policy what was kept of its environments (train --record), and do not ask them
    #[arg(long, conflicts_with = "sample")]
    replay: bool,
    /// Compare only the first N epochs
    #[arg(long, value_name = "N", conflicts_with = "sample")]
    epochs: Option<u32>,
    /// A store: draw N of its finished runs and do them again
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    sample: Option<u32>,
    /// Which runs are drawn [default: from the clock, and printed]
    #[arg(long, value_name = "N", requires = "sample")]
    sample_seed: Option<u64>,
    #[command(flatten)]
    moved: Moved,
    #[command(flatten)]
    shared: Shared,
}

impl From<RunError> for Failure {
    fn from(error: RunError) -> Self {
        let code = match error {
            RunError::Stopped { .. } => 3,
            RunError::Config(_) | RunError::Network(_) => 2,
            _ => 1,
        };
        let meant = match &error {
            RunError::Folder(FolderError::Io { path, .. }) => runs::meant(path),
            _ => None,
        };
        let meant = meant.map(|run| format!(" Did you mean {}?", run.display()));
        Self { code, message: format!("{error}{}", meant.unwrap_or_default()) }
    }
}

/// Set when the user asks to stop; the run then ends after the batch in progress.
pub(super) fn stop_flag() -> Arc<AtomicBool> {
    let flag = Arc::new(AtomicBool::new(false));
    let set = Arc::clone(&flag);
    // a second request ends the process at once
    let _ = ctrlc::set_handler(move || {
        if set.swap(true, Ordering::SeqCst) {
            std::process::exit(3);
        }
    });
    flag
}

/// Asks whether the user wants to stop. Signals are caught from the first question on: before, while files are read and
/// networks built, there is nothing to keep, and a signal ends the program as it ends any other.
#[derive(Debug, Default)]
pub(super) struct Stop(OnceLock<Arc<AtomicBool>>);

impl Stop {
    pub(super) fn asked(&self) -> bool {
        self.0.get_or_init(stop_flag).load(Ordering::SeqCst)
    }
}

pub(super) fn train(args: &TrainArgs) -> Done {
    let shared = &args.shared;
    let machine = shared.machine()?;
    if args.resume.is_none() && args.moved.data.is_some() {
        return Err(usage(
            "--data says where the data of a run are that is continued (--resume); of a new run, say it with --set \
             data.train=FILE or in its file",
        ));
    }
    let stop = Stop::default();
    let config = match &args.resume {
        Some(_) => None,
        None => {
            Some(configuration(args.file.as_ref(), args.hw.as_deref(), &args.settings, args.seed)?)
        }
    };
    if args.record && config.as_ref().is_some_and(|config| config.policy.is_none()) {
        return Err(usage(
            "--record keeps what the environments of a policy show; examples lie in files already",
        ));
    }
    let (quiet, json) = (shared.quiet || shared.json, shared.json);
    let mut meter = Meter::new(quiet, 0);
    let mut folder = PathBuf::new();
    let mut on_event = |event: RunEvent<'_>| {
        match event {
            RunEvent::Started { folder: path, data, said, warnings, rates, epoch, epochs } => {
                folder = path.into();
                meter = Meter::new(quiet, epochs);
                if json {
                    let run = path.display().to_string();
                    say(&json!({"event": "started", "run": run, "data": data, "data_read": said, "epoch": epoch,
                        "epochs": epochs, "warnings": warnings, "rates": rates})
                    .to_string());
                } else if !quiet {
                    meter.line(data);
                    for line in said {
                        meter.line(&format!("data: {line}"));
                    }
                    meter.line(&format!(
                        "run {}  kernel {}  threads {}",
                        path.display(),
                        machine.backend().name(),
                        machine.threads()
                    ));
                    for rate in rates {
                        meter.line(&format!("rate of {rate}"));
                    }
                    if epoch > 0 {
                        meter.line(&format!("continuing after epoch {epoch}"));
                    }
                    for warning in warnings {
                        meter.line(&format!("warning: {warning}"));
                    }
                }
            }
            RunEvent::Batch(progress) => meter.batch(progress),
            RunEvent::Warning(warning) if json => {
                say(&json!({"event": "warning", "message": warning}).to_string());
            }
            RunEvent::Warning(warning) if quiet => note(&format!("warning: {warning}")),
            RunEvent::Warning(warning) => meter.line(&format!("warning: {warning}")),
            RunEvent::Epoch(record, seconds) => {
                meter.epoch(record, seconds);
                if json {
                    say(&json!({"event": "epoch", "record": record, "train_seconds": seconds})
                        .to_string());
                }
            }
        }
        !stop.asked()
    };
    let data = args.moved.root(shared.data_root());
    let outcome = match (&args.resume, &config) {
        (Some(path), _) => run::resume(path, &data, machine, &mut on_event),
        (None, Some(config)) => {
            let named = || environment("DALEAN_RUNS").map(PathBuf::from);
            let out = args.out.clone().or_else(named).unwrap_or_else(|| PathBuf::from("runs"));
            let keeping = if args.record { Keeping::STREAMS } else { Keeping::ALL };
            run::train_keeping(config, &data, &out, machine, keeping, &mut on_event)
        }
        (None, None) => unreachable!("a run is new or continued"),
    };
    meter.finish();
    let outcome = outcome?;
    if json {
        say(&done(&folder.display().to_string(), &outcome).to_string());
    } else if quiet {
        say(&result(&folder, &outcome));
    } else {
        say(&outcome.summary);
        say(&format!("report   {}", folder.join("report.html").display()));
        say(&format!("verify   dalean verify {}", folder.display()));
    }
    Ok(())
}

/// The result alone: the score of the test, or of the last validation, and where the run is.
fn result(folder: &Path, outcome: &Trained) -> String {
    let test = outcome.receipt.classified().map(|test| ("test", test.score));
    if let Some(test) = outcome.receipt.played() {
        return format!("return {}  {}", played(&test.episodes), folder.display());
    }
    let validation = || Some(("validation", outcome.records.last()?.validation()?));
    let score = test.or_else(validation).map_or_else(String::new, |(of, score)| {
        format!("{of} {:.2} % ({} of {})  ", 100.0 * score.fraction(), score.correct, score.total)
    });
    format!("{score}{}", folder.display())
}

fn done(run: &str, outcome: &Trained) -> serde_json::Value {
    let (receipt, seconds) = (&outcome.receipt, outcome.timing.train_seconds());
    let last = outcome.records.last();
    let cost = &outcome.cost;
    let each: Vec<_> = cost.per_piece.iter().map(PerPiece::to_json).collect();
    let split: Vec<_> = cost.split.iter().map(EnergySplit::to_json).collect();
    let mut done = json!({
        "event": "done",
        "run": run,
        "notes": outcome.notes.iter().map(ToString::to_string).collect::<Vec<_>>(),
        "test_epoch": receipt.test.as_ref().map(TestOutcome::epoch),
        "state_hash": last.map(|record| record.state_hash.clone()),
        "epochs": last.map(|record| record.epoch),
        "cycles": cost.cycles,
        "simulated_seconds": cost.seconds,
        "joules": cost.energy.and_then(|energy| energy.whole()),
        "joules_at_least": cost.energy.and_then(|energy| energy.at_least()),
        "parts_priced": cost.energy.map(|energy| energy.priced),
        "parts": cost.energy.map(|energy| energy.parts),
        "by_class": split,
        PerPiece::list_key(&cost.per_piece): each,
        "not_simulated": outcome.absent,
        "joules_assumed_share": cost.energy.map(|_| cost.assumed_share),
        "train_seconds": seconds,
    });
    merge(&mut done, tested(receipt.test.as_ref(), last));
    let each = match last.and_then(EpochRecord::policy) {
        Some(outcome) => ("steps_per_second", outcome.steps),
        None => {
            let learnt = outcome.records.iter().filter_map(EpochRecord::train);
            ("images_per_second", learnt.map(|score| score.total).sum())
        }
    };
    done[each.0] = json!(each.1 as f64 / seconds.max(1e-9));
    done
}

/// Results under the names of their task.
fn tested(test: Option<&TestOutcome>, last: Option<&EpochRecord>) -> serde_json::Value {
    let policy = last.and_then(EpochRecord::policy);
    match (test, policy) {
        (Some(TestOutcome::Policy(test)), _) => json!({
            "return_mean": test.episodes.mean(),
            "return_range": test.episodes.return_range,
            "length_mean": test.episodes.length_mean,
            "episodes": test.episodes.episodes(),
            "deterministic": test.episodes.deterministic,
            "checkpoint": test.select,
            "steps": test.steps,
        }),
        (_, Some(outcome)) => json!({"return_mean": null, "steps": outcome.steps}),
        (test, None) => {
            let test = test.and_then(TestOutcome::classify);
            let mut object = json!({"test_accuracy": test.map(|test| test.score.fraction())});
            match last {
                // read again: nothing was learnt
                None => object["images_per_second"] = serde_json::Value::Null,
                Some(last) => {
                    let validation = last.validation().map(|score| score.fraction());
                    object["validation_accuracy"] = json!(validation);
                }
            }
            object
        }
    }
}

fn merge(object: &mut serde_json::Value, more: serde_json::Value) {
    if let (Some(object), serde_json::Value::Object(more)) = (object.as_object_mut(), more) {
        object.extend(more);
    }
}

/// `-180.21 (-331.00 to -1.20), 100 deterministic episodes`.
fn played(episodes: &EpisodesRecord) -> String {
    let range = episodes.return_range.map_or_else(
        || "of nothing".to_owned(),
        |[mean, least, most]| format!("{mean:.2} ({least:.2} to {most:.2})"),
    );
    format!("{range}, {} {} episodes", episodes.episodes(), episodes.played())
}

pub(super) fn eval(args: &EvalArgs) -> Done {
    let shared = &args.shared;
    if args.deploy.is_asked() {
        let root = args.moved.root(shared.data_root());
        let stop = Stop::default();
        return deploy::deploy(&args.deploy, &args.run, &root, (shared, &|| stop.asked()));
    }
    let (test, state_hash) =
        run::evaluate(&args.run, &args.moved.root(shared.data_root()), shared.machine()?)?;
    let absent = run::absent(&args.run)?;
    if shared.json {
        let mut done = json!({
            "event": "done",
            "run": args.run.display().to_string(),
            "state_hash": state_hash,
            "epochs": test.epoch(),
            "train_seconds": 0.0,
            "not_simulated": absent,
        });
        merge(&mut done, tested(Some(&test), None));
        say(&done.to_string());
    } else {
        let (result, why) = match &test {
            TestOutcome::Classify(TestRecord { select, score, .. }) => {
                let [right, all] = [score.correct, score.total];
                (format!("test {:.2} % ({right} of {all})", 100.0 * score.fraction()), select)
            }
            TestOutcome::Policy(PolicyTest { select, episodes, .. }) => {
                (format!("return {}", played(episodes)), select)
            }
        };
        say(&format!("{result}, state after epoch {} ({why}), {state_hash}", test.epoch()));
        if !shared.quiet {
            say(&format!("beside this {}: see the page of the run", absent_words(&absent)));
        }
    }
    Ok(())
}

pub(super) fn verify(args: &VerifyArgs) -> Done {
    let shared = &args.shared;
    let stop = Stop::default();
    let machine = shared.machine()?;
    if let Some(count) = args.sample {
        return sample(args, count as usize, machine, &stop);
    }
    if args.run.join(INDEX).is_file() {
        let store = args.run.display();
        return Err(usage(&format!(
            "{store} is a store; say with --sample N how many of its runs are done again"
        )));
    }
    let mut meter = Meter::new(shared.quiet || shared.json, 0);
    let again = if args.replay { run::replay } else { run::verify };
    let verdict = again(
        &args.run,
        &args.moved.root(shared.data_root()),
        machine,
        args.epochs,
        &mut |progress| {
            meter.batch(progress);
            !stop.asked()
        },
    );
    meter.finish();
    match verdict? {
        Verdict::Same { epochs, state_hash, test, unchecked } => {
            if shared.json {
                say(&json!({"event": "done", "verified": true, "epochs": epochs.saturating_sub(1),
                    "state_hash": state_hash, "test": test, "unchecked": unchecked})
                .to_string());
            } else {
                let test = if test { ", the test result" } else { "" };
                say(&format!(
                    "verified: {epochs} records{test} and all that was compared are the same, up to state {state_hash}"
                ));
                say(&format!("not compared: {}", unchecked.join(", ")));
            }
            Ok(())
        }
        Verdict::Different { what, wanted, found } => Err(Failure {
            code: 4,
            message: format!("{what} differs: the run says {wanted}, doing it again gives {found}"),
        }),
    }
}

/// Does some runs of a store again.
fn sample(args: &VerifyArgs, count: usize, machine: Machine, stop: &Stop) -> Done {
    let shared = &args.shared;
    let store = Store::existing(&args.run)?;
    // whoever made the store shall not know which runs will be looked at
    let seed = args.sample_seed.unwrap_or_else(super::progress::moment);
    let quiet = shared.quiet || shared.json;
    let meter = Mutex::new(Meter::new(quiet, 0));
    let meter = || meter.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
    let (mut same, mut busy) = (0, 0);
    let mut wrong = Vec::new();
    let mut on_run = |number: usize, sampled: &Sampled| {
        std::mem::replace(&mut *meter(), Meter::new(quiet, 0)).finish();
        let key = &sampled.key;
        let (text, code) = match &sampled.finding {
            Finding::Done(Verdict::Same { epochs, state_hash, .. }) => {
                same += 1;
                if shared.json {
                    say(&json!({"event": "run", "key": key, "verified": true, "state_hash": state_hash})
                        .to_string());
                } else if !shared.quiet {
                    say(&format!("{number:>4}/{count}  {key}  {epochs} records are the same"));
                }
                return;
            }
            Finding::Busy => {
                busy += 1;
                return;
            }
            Finding::Done(Verdict::Different { what, wanted, found }) => (
                format!("{what} differs: its folder says {wanted}, doing it again gives {found}"),
                4,
            ),
            Finding::Index { column, index, folder } => (
                format!("`{column}` differs: the index says {index}, its folder gives {folder}"),
                4,
            ),
            Finding::Address { found } => {
                (format!("the folder of that name holds the run {found}"), 4)
            }
            Finding::Broken(why) => (format!("it cannot be done again: {why}"), 1),
        };
        let text = format!("run {key}: {text}");
        if shared.json {
            say(&json!({"event": "run", "key": key, "verified": false, "message": text})
                .to_string());
        }
        note(&text);
        wrong.push(code);
    };
    let mut go_on = |progress| {
        meter().batch(progress);
        !stop.asked()
    };
    let root = args.moved.root(shared.data_root());
    let runs = sweep::sample(&store, count, seed, &root, machine, &mut on_run, &mut go_on)?;
    if let Some(code) = wrong.iter().max() {
        let message = format!("{} of {runs} runs do not hold, as said above", wrong.len());
        return Err(Failure { code: *code, message });
    }
    if busy > 0 {
        note(&format!("warning: {busy} runs were left out: other processes are at them"));
    }
    let again = format!("--sample {count} --sample-seed {seed}");
    if shared.json {
        say(&json!({"event": "done", "verified": true, "runs": runs, "sample_seed": seed})
            .to_string());
    } else {
        say(&format!("verified: {same} runs drawn with {again} give the same bits"));
    }
    Ok(())
}
