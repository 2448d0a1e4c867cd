//! A network that learns to tell examples apart, for `dalean.EDClassifier`.

use dalean::{Checkpointed, Config, Examples, Experiment, Sources};
use pyo3::prelude::*;
use pyo3::types::{PyAny, PyBytes};

use crate::arrays::{codes, rows, table, wholes};
use crate::errors::{Raised, wrong};
use crate::waits::{Held, Watch, backend};

#[derive(Debug, Clone)]
struct Made {
    experiment: Experiment,
    kernel: Option<String>,
    name: String,
}

impl Made {
    fn build(&self, train: &Examples, threads: usize) -> Result<dalean::Classifier, Raised> {
        dalean::weighed(&[&self.experiment.network], &self.experiment.hardware)?;
        let backend = backend(self.kernel.as_deref())?;
        let mut made = dalean::Classifier::new(self.experiment.clone(), train, backend)?;
        made.set_threads(threads)?;
        Ok(made)
    }
}

#[pyclass(module = "dalean._dalean")]
pub(crate) struct Classifier {
    made: Made,
    classifier: Held<dalean::Classifier>,
    features: usize,
    classes: usize,
    config: String,
}

impl Classifier {
    /// The thing itself; in a child of a fork, with threads of its own.
    fn held(&mut self) -> Result<&mut dalean::Classifier, Raised> {
        let Self { made, classifier, features, classes, .. } = self;
        classifier.mended(|lost, threads| {
            let kept = lost.checkpoint(&made.name);
            let one = nothing(*features, *classes)?;
            let mut again = made.build(&one, threads)?;
            again.put_back(&made.name, &kept)?;
            Ok(again)
        })
    }
}

/// An example of nothing, for a network whose state is put back.
fn nothing(features: usize, classes: usize) -> Result<Examples, Raised> {
    Ok(Examples::new(vec![0; features], vec![0], features, 255, classes)?)
}

fn examples(
    x: &Bound<'_, PyAny>,
    labels: Option<&Bound<'_, PyAny>>,
    features: usize,
    classes: usize,
) -> PyResult<Examples> {
    let (values, shape) = codes("numbers of X", x, 255)?;
    let samples = rows("numbers of X", &shape, features)?;
    let labels = match labels {
        None => vec![0; samples],
        Some(labels) => {
            let (labels, _) = wholes("y", labels)?;
            let label = |&label: &i64| {
                let label = u8::try_from(label).ok().filter(|&label| usize::from(label) < classes);
                label.ok_or_else(|| {
                    wrong("y", "holds a label that is no class", "labels are 0 to classes - 1")
                })
            };
            labels.iter().map(label).collect::<PyResult<_>>()?
        }
    };
    Ok(Examples::new(values, labels, features, 255, classes).map_err(Raised::from)?)
}

#[pymethods]
impl Classifier {
    /// From examples `x`, values of 0 to 255 `[sample][feature]`, and labels `y`; without them, a network to put a state into.
    #[new]
    #[pyo3(signature = (name, text, hw, settings, seed, features, classes, x, y, threads, kernel))]
    #[expect(clippy::too_many_arguments, reason = "the package gives all of them by name")]
    fn new(
        py: Python<'_>,
        name: &str,
        text: &str,
        hw: Option<String>,
        settings: Vec<String>,
        seed: Option<u64>,
        features: usize,
        classes: usize,
        x: Option<&Bound<'_, PyAny>>,
        y: Option<&Bound<'_, PyAny>>,
        threads: usize,
        kernel: Option<String>,
    ) -> PyResult<Self> {
        if !(1..=dalean::Machine::THREADS_MAX).contains(&threads) {
            return Err(wrong("threads", &format!("is {threads}"), "use 1 to 1024"));
        }
        let train = match x {
            Some(x) => examples(x, y, features, classes)?,
            None => nothing(features, classes)?,
        };
        let (made, classifier, config) = py.detach(|| -> Result<_, Raised> {
            let sources = Sources {
                experiment: Some((name, text)),
                hardware: hw.as_deref(),
                settings: &settings,
                seed,
                ..Sources::default()
            };
            let config = Config::load(&sources)?;
            let experiment = config.experiment(features, classes, None)?;
            let config = config.to_toml();
            let name = blake3::hash(format!("{config}\n{features} {classes}").as_bytes());
            let made = Made { experiment, kernel, name: name.to_hex().to_string() };
            let classifier = made.build(&train, threads)?;
            Ok((made, classifier, config))
        })?;
        let classifier = Held::new(classifier, threads);
        Ok(Self { made, classifier, features, classes, config })
    }

    #[getter]
    fn config(&self) -> &str {
        &self.config
    }

    #[getter]
    fn epoch(&self) -> u32 {
        self.classifier.epoch()
    }

    #[getter]
    fn epochs(&self) -> u32 {
        self.made.experiment.epochs
    }

    /// One pass over the examples: right answers given while learning.
    #[pyo3(signature = (callback = None))]
    fn learn(&mut self, py: Python<'_>, callback: Option<Py<PyAny>>) -> PyResult<u64> {
        let classifier = self.held()?;
        let mut watch = Watch::new(callback);
        let learnt = py.detach(|| {
            classifier.learn(&mut |at| {
                watch.go_on("batch", || {
                    vec![
                        ("epoch", f64::from(at.epoch)),
                        ("done", at.samples as f64),
                        ("total", at.samples_total as f64),
                        ("correct", at.correct as f64),
                    ]
                })
            })
        });
        match (watch.error, learnt) {
            (Some(error), _) => Err(error),
            (None, Ok(correct)) => Ok(correct),
            (None, Err(_)) => Err(wrong("learn", "has no epoch left", "raise learning.epochs")),
        }
    }

    /// Accumulators of the outputs, `[sample][output]`.
    fn outputs<'py>(
        &mut self,
        py: Python<'py>,
        x: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let examples = examples(x, None, self.features, self.classes)?;
        let samples = examples.len();
        let classifier = self.held()?;
        let outputs = py.detach(|| classifier.outputs(&examples)).map_err(Raised::from)?;
        let each = outputs.len() / samples.max(1);
        table(py, outputs, [samples, each])
    }

    fn state_hash(&mut self, py: Python<'_>) -> PyResult<String> {
        let classifier = self.held()?;
        Ok(py.detach(|| classifier.state_hash()))
    }

    fn checkpoint<'py>(&mut self, py: Python<'py>) -> PyResult<Bound<'py, PyBytes>> {
        let name = self.made.name.clone();
        let classifier = self.held()?;
        let bytes = py.detach(|| classifier.checkpoint(&name));
        Ok(PyBytes::new(py, &bytes))
    }

    fn put_back(&mut self, py: Python<'_>, bytes: &[u8]) -> PyResult<()> {
        let name = self.made.name.clone();
        let classifier = self.held()?;
        Ok(py.detach(|| classifier.put_back(&name, bytes)).map_err(Raised::from)?)
    }
}
