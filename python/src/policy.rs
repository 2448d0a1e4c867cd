//! A policy whose environments are the caller's, for `dalean.EDPolicy`.

use dalean::policy::{
    Actions, EnvSpec, FloatDoor, Observations, PolicyExperiment, PolicyTurn, Shown, Taken,
};
use dalean::{Checkpointed, Config, Sources};
use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::types::{PyAny, PyBytes, PyDict};

use crate::arrays::{flags, reals, table, wholes};
use crate::errors::{Raised, wrong};
use crate::waits::{Held, Watch, backend};

#[derive(Debug, Clone)]
struct Made {
    experiment: PolicyExperiment,
    spec: EnvSpec,
    kernel: Option<String>,
    name: String,
}

impl Made {
    fn build(&self, threads: usize) -> Result<dalean::policy::PolicyLearner, Raised> {
        let PolicyExperiment { actor, critic, hardware, .. } = &self.experiment;
        dalean::weighed(&[actor, critic], hardware)?;
        let backend = backend(self.kernel.as_deref())?;
        let (experiment, spec) = (self.experiment.clone(), self.spec.clone());
        let mut made = dalean::policy::PolicyLearner::new(experiment, spec, backend)?;
        made.set_threads(threads)?;
        Ok(made)
    }
}

#[pyclass(module = "dalean._dalean")]
pub(crate) struct PolicyLearner {
    made: Made,
    learner: Held<dalean::policy::PolicyLearner>,
    door: FloatDoor,
    config: String,
}

impl PolicyLearner {
    /// What all environments show: numbers, or a pair of the lines that are on and where those of each end.
    fn observations(&self, what: &str, shown: &Bound<'_, PyAny>) -> PyResult<Observations> {
        let Shown::Sparse { lines, active: most } = self.made.spec.shown else {
            return Ok(self.door.observations(&reals(what, shown)?).map_err(Raised::from)?);
        };
        let pair = "give a pair: the lines that are on, rising in each environment, and where those of each end";
        let (on, stops) = shown
            .extract::<(Bound<'_, PyAny>, Bound<'_, PyAny>)>()
            .map_err(|_| wrong(what, "are no pair", pair))?;
        let ((on, _), (stops, _)) = (wholes(what, &on)?, wholes(what, &stops)?);
        let (mut active, mut ends, mut from) = (Vec::with_capacity(on.len()), vec![], 0);
        for (which, &stop) in stops.iter().enumerate() {
            let stop = usize::try_from(stop).ok().filter(|stop| (from..=on.len()).contains(stop));
            let Some(stop) = stop else {
                return Err(wrong(
                    what,
                    &format!("end at {} in environment {which}", stops[which]),
                    pair,
                ));
            };
            let of = &on[from..stop];
            if of.len() > most || !of.is_sorted_by(|a, b| a < b) {
                let found =
                    format!("are {} lines, or no rising ones, in environment {which}", of.len());
                return Err(wrong(what, &found, &format!("{pair}; {most} at most are on")));
            }
            for &line in of {
                let line = u32::try_from(line).ok().filter(|&line| (line as usize) < lines);
                let allowed = format!("there are {lines} lines, from 0");
                active.push(line.ok_or_else(|| wrong(what, "name another line", &allowed))?);
            }
            from = stop;
            ends.push(stop);
        }
        Ok(Observations { active, ends, ..Observations::default() })
    }

    /// The thing itself; in a child of a fork, with threads of its own.
    fn held(&mut self) -> Result<&mut dalean::policy::PolicyLearner, Raised> {
        let Self { made, learner, .. } = self;
        learner.mended(|lost, threads| {
            let kept = lost.checkpoint(&made.name);
            let mut again = made.build(threads)?;
            again.put_back(&made.name, &kept)?;
            Ok(again)
        })
    }
}

fn actions<'py>(
    py: Python<'py>,
    actions: Actions<'_>,
    count: usize,
) -> PyResult<Bound<'py, PyAny>> {
    match actions {
        Actions::Discrete(choices) => {
            let choices = choices.iter().map(|&choice| i64::from(choice)).collect();
            Ok(PyArray1::<i64>::from_vec(py, choices).into_any())
        }
        values @ Actions::Continuous(_) => {
            let values: Vec<f32> =
                FloatDoor::actions(values).into_iter().map(|value| value as f32).collect();
            let each = values.len() / count.max(1);
            table(py, values, [count, each])
        }
    }
}

#[pymethods]
impl PolicyLearner {
    #[new]
    #[pyo3(signature = (name, text, hw, settings, seed, id, shown, active, discrete, taken, steps_max, threads, kernel))]
    #[expect(clippy::too_many_arguments, reason = "the package gives all of them by name")]
    fn new(
        py: Python<'_>,
        name: &str,
        text: &str,
        hw: Option<String>,
        settings: Vec<String>,
        seed: Option<u64>,
        id: String,
        shown: usize,
        active: Option<usize>,
        discrete: bool,
        taken: usize,
        steps_max: u32,
        threads: usize,
        kernel: Option<String>,
    ) -> PyResult<Self> {
        if !(1..=dalean::Machine::THREADS_MAX).contains(&threads) {
            return Err(wrong("threads", &format!("is {threads}"), "use 1 to 1024"));
        }
        if shown == 0 || taken == 0 {
            return Err(wrong(
                "an environment",
                "shows or takes nothing",
                "give at least 1 of each",
            ));
        }
        let spec = EnvSpec {
            id: id.into(),
            shown: match active {
                Some(active) => Shown::Sparse { lines: shown, active },
                None => Shown::Dense(shown),
            },
            taken: if discrete { Taken::Discrete(taken) } else { Taken::Continuous(taken) },
            steps_max,
            inputs: vec![("observation", shown)],
        };
        let (made, learner, config) = py.detach(|| -> Result<_, Raised> {
            let sources = Sources {
                experiment: Some((name, text)),
                hardware: hw.as_deref(),
                settings: &settings,
                seed,
                ..Sources::default()
            };
            let config = Config::load(&sources)?;
            let Some(experiment) = config.policy_experiment()? else {
                let error = wrong("`task`", "is \"classify\"", "say task = \"policy\"");
                return Err(error.into());
            };
            let experiment = experiment.facing(&spec);
            let config = config.to_toml();
            let name = blake3::hash(format!("{config}\n{spec:?}").as_bytes()).to_hex().to_string();
            let made = Made { experiment, spec, kernel, name };
            let learner = made.build(threads)?;
            Ok((made, learner, config))
        })?;
        let door = FloatDoor::new(&made.spec, made.experiment.environments as usize);
        Ok(Self { made, learner: Held::new(learner, threads), door, config })
    }

    #[getter]
    fn config(&self) -> &str {
        &self.config
    }

    #[getter]
    fn count(&self) -> u32 {
        self.made.experiment.environments
    }

    #[getter]
    fn epoch(&self) -> u32 {
        self.learner.epoch()
    }

    #[getter]
    fn epochs(&self) -> u32 {
        self.learner.epochs()
    }

    #[getter]
    fn steps(&self) -> u64 {
        self.learner.steps()
    }

    /// What it waits for: `("begin", None)`, `("act", actions)`, `("learn", None)`, `("done", None)`.
    fn turn<'py>(
        &mut self,
        py: Python<'py>,
    ) -> PyResult<(&'static str, Option<Bound<'py, PyAny>>)> {
        let count = self.count() as usize;
        let learner = self.held()?;
        Ok(match py.detach(|| learner.turn()) {
            PolicyTurn::Begin => ("begin", None),
            PolicyTurn::Act(taken) => ("act", Some(actions(py, taken, count)?)),
            PolicyTurn::Learn => ("learn", None),
            _ => ("done", None),
        })
    }

    fn begin(&mut self, shown: &Bound<'_, PyAny>) -> PyResult<()> {
        let shown = self.observations("observations", shown)?;
        Ok(self.held()?.begin(&shown).map_err(Raised::from)?)
    }

    #[pyo3(signature = (next, rewards, terminated, truncated, reached = None, idle = None))]
    fn take(
        &mut self,
        py: Python<'_>,
        next: &Bound<'_, PyAny>,
        rewards: &Bound<'_, PyAny>,
        terminated: &Bound<'_, PyAny>,
        truncated: &Bound<'_, PyAny>,
        reached: Option<&Bound<'_, PyAny>>,
        idle: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<()> {
        let next = self.observations("observations", next)?;
        let last = |reached| self.observations("final observations", reached);
        let reached = reached.map(last).transpose()?;
        let rewards = reals("rewards", rewards)?;
        let (over, stop) = (flags("terminated", terminated)?, flags("truncated", truncated)?);
        let idle = idle.map_or(Ok(vec![]), |idle| flags("idle", idle))?;
        let outcomes =
            self.door.came(next, reached, &rewards, [&over, &stop]).map_err(Raised::from)?;
        let learner = self.held()?;
        Ok(py.detach(|| learner.take_idle(&outcomes, &idle)).map_err(Raised::from)?)
    }

    /// Learns from a full rollout: what came of the epoch, if that was its last one.
    fn learn<'py>(&mut self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyDict>>> {
        let learner = self.held()?;
        let mut watch = Watch::new(None);
        let learnt = py.detach(|| learner.learn(&mut |_| watch.go_on("update", Vec::new)));
        if let Some(error) = watch.error {
            return Err(error);
        }
        let Some(epoch) = learnt.map_err(Raised::from)? else { return Ok(None) };
        let told = PyDict::new(py);
        let (returns, lengths) = (epoch.returns, epoch.lengths);
        told.set_item("steps", epoch.steps)?;
        told.set_item("episodes", returns.count)?;
        let mean = |sum: i64, count: u64, bits: i32| {
            (count > 0).then(|| sum as f64 / f64::powi(2.0, bits) / count as f64)
        };
        told.set_item("return_mean", mean(returns.sum, returns.count, 16))?;
        told.set_item("length_mean", mean(lengths.sum, lengths.count as u64, 0))?;
        let (entropy, kl) = (epoch.entropy, epoch.approx_kl);
        told.set_item("entropy", mean(entropy.sum, entropy.count, 20))?;
        told.set_item("approx_kl", mean(kl.sum, kl.count, 20))?;
        Ok(Some(told))
    }

    /// What it does in step number `step` of episodes that are not learnt from.
    fn answer<'py>(
        &mut self,
        py: Python<'py>,
        shown: &Bound<'py, PyAny>,
        step: u64,
    ) -> PyResult<Bound<'py, PyAny>> {
        let shown = self.observations("observations", shown)?;
        let count = self.count() as usize;
        let learner = self.held()?;
        let taken = py.detach(|| learner.answer(&shown, step)).map_err(Raised::from)?;
        actions(py, taken, count)
    }

    fn state_hash(&mut self, py: Python<'_>) -> PyResult<String> {
        let learner = self.held()?;
        Ok(py.detach(|| learner.state_hash()))
    }

    fn checkpoint<'py>(&mut self, py: Python<'py>) -> PyResult<Bound<'py, PyBytes>> {
        let name = self.made.name.clone();
        let learner = self.held()?;
        let bytes = py.detach(|| learner.checkpoint(&name));
        Ok(PyBytes::new(py, &bytes))
    }

    fn put_back(&mut self, py: Python<'_>, bytes: &[u8]) -> PyResult<()> {
        let name = self.made.name.clone();
        let learner = self.held()?;
        Ok(py.detach(|| learner.put_back(&name, bytes)).map_err(Raised::from)?)
    }
}
