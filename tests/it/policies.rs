//! Policies through the whole program: trained, continued, verified, evaluated, priced, watched.

use std::path::Path;

use dalean::chip::crossbar::kernel::Backend;
use dalean::lab::config::{Config, Sources, load};
use dalean::lab::data::DataRoot;
use dalean::lab::run::{self, Keeping, Machine, RunError, RunEvent, Verdict};
use dalean::lab::store::record::{PolicyTest, TestOutcome};
use dalean::lab::store::stream;
use serde_json::Value;

use super::program::{dalean, finished, only_run, run as run_program};

/// A policy of two epochs: two carts, eight steps a rollout, three hidden units.
pub(crate) const TINY: &str = "
task = 'policy'
environment = { count = 2, horizon = 8, steps = 32, rollouts = 1 }
network = { hidden = [3] }
learning = { batch = 8 }
ppo = { passes = 2 }
evaluation = { episodes = 1, final_episodes = 2 }
hw.timing = { clock_mhz = 1000.0 }
";

fn config(settings: &[&str]) -> Config {
    let settings: Vec<String> = settings.iter().map(ToString::to_string).collect();
    let experiment = Some(("it", TINY));
    load(&Sources { experiment, settings: &settings, ..Sources::default() }).unwrap()
}

fn root() -> DataRoot {
    DataRoot::new("no such folder")
}

fn machine(backend: Backend, threads: usize) -> Machine {
    Machine::new(backend, threads).unwrap()
}

/// State hashes of a run, and its final test.
fn trained(config: &Config, out: &Path, machine: Machine) -> (Vec<String>, PolicyTest) {
    let made = run::train(config, &root(), out, machine, &mut |_| true).unwrap();
    let Some(TestOutcome::Policy(test)) = made.receipt.test else { panic!("a policy is tested") };
    (made.receipt.epoch_hashes, test)
}

#[test]
fn a_policy_is_the_same_on_every_back_end_and_any_number_of_threads() {
    let config = config(&[]);
    let mut all = Backend::available().into_iter().flat_map(|backend| [1, 3].map(|n| (backend, n)));
    let work = tempfile::tempdir().unwrap();
    let (backend, threads) = all.next().unwrap();
    let first = trained(&config, work.path(), machine(backend, threads));
    assert_eq!(first.0.len(), 3, "two epochs and the state before");
    for (backend, threads) in all {
        let other = trained(&config, work.path(), machine(backend, threads));
        assert_eq!(other, first, "{} {threads}", backend.name());
    }
}

#[test]
fn a_policy_that_was_stopped_goes_on_to_the_same_bits_and_is_verified() {
    for settings in [
        &["network.input=split"][..],
        &["network.input=signed"],
        &["network.activation=ramp", "network.threshold=true", "network.gain=tracking"],
        &["network.activation=ramp"],
    ] {
        stopped_and_verified(&config(&[&["environment.steps=48"], settings].concat()));
    }
}

fn stopped_and_verified(config: &Config) {
    let machine = machine(Backend::best(), 1);
    let work = tempfile::tempdir().unwrap();
    let whole = trained(config, &work.path().join("whole"), machine);
    // stopped inside the second epoch
    let part = work.path().join("part");
    let mut go_on = |event: RunEvent<'_>| !matches!(event, RunEvent::Batch(at) if at.epoch == 1);
    let stopped = run::train(config, &root(), &part, machine, &mut go_on);
    assert!(matches!(stopped, Err(RunError::Stopped { epoch: 1, .. })), "{stopped:?}");
    let folder = only_run(&part);
    let made = run::resume(&folder, &root(), machine, &mut |_| true).unwrap();
    assert_eq!(made.receipt.epoch_hashes, whole.0);
    assert_eq!(made.receipt.played(), Some(&whole.1));
    let verdict = run::verify(&folder, &root(), machine, None, &mut |_| true).unwrap();
    assert!(matches!(verdict, Verdict::Same { epochs: 4, test: true, .. }), "{verdict:?}");
    let (test, _) = run::evaluate(&folder, &root(), machine).unwrap();
    assert_eq!(test.policy(), Some(&whole.1));
}

#[test]
fn a_policy_is_done_again_from_what_was_kept_of_its_environments_and_from_nothing_else() {
    let machine = machine(Backend::best(), 1);
    let work = tempfile::tempdir().unwrap();
    for (settings, name) in [(&[][..], "one"), (&["environment.id=Foray-v0"], "two")] {
        let out = work.path().join(name);
        let config = config(settings);
        run::train_keeping(&config, &root(), &out, machine, Keeping::STREAMS, &mut |_| true)
            .unwrap();
        let folder = only_run(&out);
        let replayed = || run::replay(&folder, &root(), machine, None, &mut |_| true);
        assert!(matches!(replayed().unwrap(), Verdict::Same { epochs: 3, test: true, .. }));
        // what was shown decides what comes out
        let file = folder.join("stream-00002.safetensors");
        let kept = std::fs::read(&file).unwrap();
        let mut record = stream::read(&kept).unwrap();
        record.training.rewards[3] ^= 1 << 16;
        std::fs::write(&file, stream::write(&record)).unwrap();
        let other = replayed().unwrap();
        assert!(matches!(other, Verdict::Different { .. }), "{other:?}");
        record = stream::read(&kept).unwrap();
        record.training.entries.pop();
        std::fs::write(&file, stream::write(&record)).unwrap();
        assert!(matches!(replayed(), Err(RunError::Environment(_))), "a stream that ends");
        std::fs::write(&file, &kept[..kept.len() / 2]).unwrap();
        assert!(replayed().is_err(), "half a file");
    }
}

#[test]
fn a_seed_and_an_environment_make_another_policy() {
    let work = tempfile::tempdir().unwrap();
    let machine = machine(Backend::best(), 1);
    let of = |settings: &[&str]| trained(&config(settings), work.path(), machine).0;
    let mut all = vec![
        of(&[]),
        of(&["seed=2"]),
        of(&["learning.centred=false"]),
        of(&["learning.dead_zone=false"]),
        of(&["learning.rule=dfa"]),
        of(&["ppo.gamma=0.5"]),
        of(&["environment.id=Pendulum-v1"]),
        of(&["network.input=offset"]),
        of(&["network.input=signed"]),
        of(&["learning.control=frozen_hidden"]),
        of(&["learning.control=same_sign_hidden"]),
        of(&["learning.control=same_sign"]),
        of(&["environment.id=Pendulum-v1", "ppo.noise_steps=3"]),
        of(&["network.activation=ramp"]),
        of(&["network.activation=ramp", "network.gain_spread=1"]),
        of(&["network.activation=ramp", "network.threshold=true"]),
        of(&["network.activation=ramp", "network.gain=tracking", "network.homeostasis_window=8"]),
        of(&["network.activation=relu"]),
        of(&["network.activation=relu", "network.threshold=true"]),
        of(&["learning.optimiser=momentum", "learning.rate=30"]),
        of(&["learning.optimiser=momentum", "learning.rate=30", "learning.momentum_shift=1"]),
        of(&["learning.optimiser=adam_fx", "learning.rate=0.02"]),
        of(&["learning.optimiser=adam_fx", "learning.rate=0.02", "learning.adam_shifts=[1,4]"]),
    ];
    let all_before = all.len();
    all.sort();
    all.dedup_by_key(|hashes| hashes.last().cloned());
    assert_eq!(all.len(), all_before, "each of these matters");
}

/// What the program prints, as JSON lines.
fn lines(text: &str) -> Vec<Value> {
    text.lines().map(|line| serde_json::from_str(line).unwrap()).collect()
}

#[test]
fn every_command_knows_a_policy() {
    let work = tempfile::tempdir().unwrap();
    let file = work.path().join("tiny.toml");
    std::fs::write(&file, TINY).unwrap();
    let out = work.path().join("runs");
    let (folder, done) =
        finished(dalean().arg("train").arg(&file).args(["--json", "--out"]).arg(&out));
    assert_eq!(folder.file_name().unwrap(), only_run(&out).file_name().unwrap());
    assert!(done["return_mean"].as_f64().is_some_and(|mean| mean >= 1.0), "{done}");
    assert_eq!((&done["episodes"], &done["steps"]), (&2.into(), &32.into()));
    assert!(done["test_accuracy"].is_null() && done["images_per_second"].is_null(), "{done}");
    let each = done["per_act"].as_array().unwrap();
    assert!(each.iter().any(|one| one["updates"] == 8), "{done}");
    assert!(each.iter().any(|one| one["decisions"].as_u64() > Some(0)), "{done}");

    let ran = |words: &[&str]| {
        let ran = run_program(dalean().args(words).arg(&folder));
        assert_eq!(ran.code, Some(0), "{words:?} {ran:?}");
        ran
    };
    let eval = ran(&["eval", "--json"]).last();
    assert_eq!((&eval["return_mean"], &eval["epochs"]), (&done["return_mean"], &2.into()));
    assert_eq!(ran(&["verify", "--json"]).last()["verified"], true);
    let price = ran(&["price", "--json"]).last();
    assert_eq!(price["per_act"], done["per_act"]);
    let listed = lines(&run_program(dalean().args(["runs", "--json"]).arg(&out)).stdout);
    assert_eq!(listed[0]["return_mean"], done["return_mean"]);
    let page = std::fs::read_to_string(folder.join("report.html")).unwrap();
    for id in ["returns", "losses", "inputs", "episode", "timelines", "energy"] {
        assert!(page.contains(&format!("id=\"{id}\"")), "{id}");
    }
    let ran_again = ran(&["report", "--json"]).last();
    assert_eq!(ran_again["event"], "report");
    let metrics = std::fs::read_to_string(folder.join("metrics.jsonl")).unwrap();
    let record = &lines(&metrics)[2]["outcome"];
    for name in ["charts/global_step", "losses/policy_loss", "losses/clipfrac", "losses/entropy"] {
        assert!(record[name].is_number(), "{name} in {record}");
    }

    let svg = work.path().join("film.svg");
    let watched = run_program(
        dalean().args(["watch", "--json", "--episode", "1", "--svg"]).arg(&svg).arg(&folder),
    );
    let watched = lines(&watched.stdout);
    let (done, steps) = watched.split_last().unwrap();
    assert_eq!(done["steps"], steps.len());
    assert_eq!(steps.last().unwrap()["return"], done["return"]);
    assert!(std::fs::read_to_string(&svg).unwrap().starts_with("<svg "));
    let plain = run_program(dalean().args(["watch", "--steps", "3"]).arg(&folder));
    assert!(plain.stdout.contains("3 steps"), "{plain:?}");

    let profile = run_program(dalean().args(["profile", "--json"]).arg(&file));
    let acts: Vec<Value> =
        lines(&profile.stdout).into_iter().filter(|line| line["event"] == "profile").collect();
    assert_eq!(acts.iter().map(|act| &act["act"]).collect::<Vec<_>>(), ["update", "decision"]);
    let vcd = work.path().join("wave.vcd");
    let trace = run_program(dalean().arg("trace").arg(&file).arg("--vcd").arg(&vcd));
    assert_eq!(trace.code, Some(0), "{trace:?}");
}

#[test]
fn keys_of_one_task_are_refused_in_the_other_and_say_what_to_use() {
    for (settings, key, hint) in [
        (&["data.set=xor"][..], "data", "environment.id"),
        (&["learning.epochs=3"], "learning.epochs", "environment.steps"),
        (&["network.outputs=3"], "network.outputs", "environment"),
        (&["learning.centre=batch"], "learning.centre", "none"),
        (&["network.readout=p"], "network.readout", "p-n"),
        (&["learning.rule=kaneko"], "learning.rule", "ed"),
        (&["es.pairs=3"], "es", "rule = \"es\""),
        (&["ppo.log_sigma=0"], "ppo.log_sigma", "actions"),
        (&["network.critic_hidden=[3, 3]"], "network.critic_hidden", "as many"),
        (&["learning.rule=es", "learning.rate=1"], "ppo", "[es]"),
        (&["ppo.noise_steps=2"], "ppo.noise_steps", "actions"),
        (&["learning.momentum_shift=2"], "learning.momentum_shift", "optimiser = \"momentum\""),
        (
            &["learning.optimiser=momentum", "learning.momentum_shift=9"],
            "learning.momentum_shift",
            "1..=8",
        ),
        (&["learning.adam_shifts=[3, 8]"], "learning.adam_shifts", "optimiser = \"adam_fx\""),
        (
            &["learning.optimiser=adam_fx", "learning.adam_shifts=[3, 0]"],
            "learning.adam_shifts",
            "1..=8",
        ),
        (&["learning.control=frozen"], "learning.control", "frozen_hidden"),
        (&["environment.id=CartPole-v2"], "environment.id", "did you mean \"CartPole-v1\"?"),
        (&["ppo.gamma=1.5"], "ppo.gamma", "0..=1"),
        (&["network.input=offset", "network.bias=none"], "network.input", "input_row"),
        (&["network.homeostasis_window=512"], "network.homeostasis_window", "network.threshold"),
        (&["network.gain_spread=1"], "network.gain_spread", "fixed"),
        (&["network.threshold=true", "network.hidden=[]"], "network.threshold", "no hidden layer"),
        (&["task=classify"], "environment", "task = \"policy\""),
    ] {
        let settings: Vec<String> = settings.iter().map(ToString::to_string).collect();
        let experiment = Some(("it", TINY));
        let found = load(&Sources { experiment, settings: &settings, ..Sources::default() });
        let error = found.err().map(|error| error.to_string()).unwrap_or_default();
        assert!(
            error.starts_with(&format!("`{key}`")) && error.contains(hint),
            "{settings:?}: {error}"
        );
    }
}

#[test]
fn what_cannot_be_taken_away_is_refused() {
    for (settings, words) in [
        (&["network.hidden=[]", "learning.control=frozen_hidden"][..], "no hidden layer"),
        (&["network.hidden=[]", "learning.control=same_sign_hidden"], "no hidden layer"),
        (&["learning.rule=dfa", "learning.control=same_sign"], "no layer has a stream n"),
    ] {
        let error = config(settings).policy_experiment().unwrap_err().to_string();
        assert!(error.starts_with("`learning.control`") && error.contains(words), "{error}");
    }
    // outputs have a stream n too
    assert!(
        config(&["network.hidden=[]", "learning.control=same_sign"]).policy_experiment().is_ok()
    );
}

#[test]
fn middles_that_do_not_fit_are_refused() {
    for (settings, key, words) in [
        (&["network.threshold=true"][..], "network.threshold", "normalised"),
        (&["network.gain=fixed"], "network.gain", "normalised"),
        (&["network.activation=ramp", "network.gain=table"], "network.gain", "deviations"),
        (&["network.activation=relu", "network.gain=tracking"], "network.gain", "no ramp"),
        (
            &["network.activation=ramp", "network.threshold=true", "network.homeostasis_window=4"],
            "network.homeostasis_window",
            "holds a batch",
        ),
        (&["network.activation=ramp", "network.input=signed"], "network.input", "signed"),
    ] {
        let error = config(settings).policy_experiment().unwrap_err().to_string();
        assert!(error.starts_with(&format!("`{key}`")) && error.contains(words), "{error}");
    }
    let of = |settings: &[&str]| {
        let text = "task = 'policy'\nlearning = { rule = 'es' }\nnetwork = { activation = 'ramp' }";
        let settings: Vec<String> = settings.iter().map(ToString::to_string).collect();
        let experiment = Some(("es", text));
        let config = load(&Sources { experiment, settings: &settings, ..Sources::default() });
        config.unwrap().policy_experiment().map(drop).map_err(|error| error.to_string())
    };
    assert_eq!(of(&[]), Ok(()));
    for setting in ["network.threshold=true", "network.gain=tracking"] {
        let error = of(&[setting]).unwrap_err();
        assert!(error.contains("evolution loads"), "{error}");
    }
}

#[test]
fn rules_of_one_stream_of_pairs_are_pulsed_twice_as_often_by_default() {
    for (settings, rate) in [
        (&["learning.rule=ed"][..], "0.25"),
        (&["learning.rule=ed_non_dalean"], "0.25"),
        (&["learning.rule=dfa"], "0.5"),
        (&["learning.rule=bp", "hw.tile.transposed_read=true"], "0.5"),
        (&["learning.rule=dfa", "learning.optimiser=rms"], "0.002"),
        (&["learning.rule=dfa", "learning.rate=0.125"], "0.125"),
    ] {
        let text = config(settings).to_toml();
        assert!(text.lines().any(|line| line == format!("rate = {rate}")), "{settings:?} {text}");
    }
}

#[test]
fn a_resolved_policy_resolves_to_itself() {
    for settings in [
        &[][..],
        &["environment.id=Pendulum-v1", "learning.optimiser=plain"],
        &["network.activation=ramp", "network.threshold=true"],
    ] {
        let first = config(settings);
        let text = first.to_toml();
        let again = load(&Sources { experiment: Some(("it", &text)), ..Sources::default() });
        let again = again.unwrap();
        assert_eq!(again.to_toml(), text);
        assert_eq!(again.policy_experiment().unwrap(), first.policy_experiment().unwrap());
    }
}
