//! A network on a chip whose every operation is the caller's, for `dalean.Network`.

use std::collections::BTreeMap;

use dalean::deployment::{Deployment, Moment, moments};
use dalean::network::{DrivenBy, HiddenWords, NetworkPlace};
use dalean::{Checkpointed, Config, DrivenNetwork, Experiment, Sources, ledger_of};
use pyo3::prelude::*;
use pyo3::types::{PyAny, PyBytes};

use crate::arrays::{codes, rows, signed, table, two_phases, wholes};
use crate::errors::{Raised, of_chips, wrong};
use crate::waits::{Held, backend};

/// What a network is made of.
#[derive(Debug, Clone)]
struct Made {
    config: Config,
    experiment: Experiment,
    updates: u64,
    own: bool,
    kernel: Option<String>,
    /// What checkpoints of it belong to.
    name: String,
}

impl Made {
    fn build(&self, threads: usize) -> Result<DrivenNetwork, Raised> {
        let Experiment { seed, network, hardware, .. } = &self.experiment;
        let place = NetworkPlace { seed: *seed, first_layer: 0, updates: self.updates };
        let words = if self.own { HiddenWords::Own } else { HiddenWords::Routed };
        dalean::weighed(&[network], hardware)?;
        let backend = backend(self.kernel.as_deref())?;
        let mut made = DrivenNetwork::new(network, hardware, backend, place, words)?;
        made.set_threads(threads)?;
        Ok(made)
    }
}

/// Everything that came from outside, as one hash.
#[derive(Debug, Clone, Default)]
struct Told(blake3::Hasher);

impl Told {
    fn add(&mut self, operation: &str, bytes: &[u8]) {
        self.0.update(operation.as_bytes());
        self.0.update(&[0]);
        self.0.update(&(bytes.len() as u64).to_le_bytes());
        self.0.update(bytes);
    }

    fn words(&mut self, operation: &str, words: &[i16]) {
        let bytes: Vec<u8> = words.iter().flat_map(|word| word.to_le_bytes()).collect();
        self.add(operation, &bytes);
    }
}

/// Levels as they were loaded, before what loads leave, of arrays that were not written since: by layer and pathway.
type Asked = BTreeMap<(usize, String), Vec<u16>>;

/// A network that is on another chip for now.
#[derive(Debug)]
struct Away {
    kept: Vec<u8>,
    told: Told,
    asked: Asked,
    moments: Vec<Moment>,
    made_up: bool,
}

#[pyclass(module = "dalean._dalean", subclass)]
pub(crate) struct Network {
    made: Made,
    network: Held<DrivenNetwork>,
    config: String,
    told: Told,
    asked: Asked,
    away: Option<Away>,
}

impl Network {
    /// The thing itself; in a child of a fork, with threads of its own.
    fn held(&mut self) -> Result<&mut DrivenNetwork, Raised> {
        let Self { made, network, .. } = self;
        network.mended(|lost, threads| {
            let kept = lost.checkpoint(&made.name);
            let mut again = made.build(threads)?;
            again.put_back(&made.name, &kept)?;
            Ok(again)
        })
    }

    fn units(&self, layer: usize) -> Result<usize, Raised> {
        Ok(self.network.size(layer)?[1])
    }

    fn outputs(&self) -> Result<usize, Raised> {
        self.units(self.network.layers() - 1)
    }

    /// Codes of what is shown, and of how many samples.
    fn shown(&self, x: &Bound<'_, PyAny>) -> PyResult<(Vec<u8>, usize)> {
        let what = "numbers of x";
        let inputs = self.network.size(0).map_err(Raised::from)?[0];
        if self.signed() {
            let (numbers, shape) = signed(what, x, self.network.code_max())?;
            let samples = rows(what, &shape, inputs)?;
            return Ok((two_phases(&numbers, inputs), samples));
        }
        let (codes, shape) = codes(what, x, self.network.code_max())?;
        let samples = rows(what, &shape, inputs)?;
        Ok((codes, samples))
    }

    fn words(&self, x: &Bound<'_, PyAny>, width: usize) -> PyResult<Vec<i16>> {
        let (words, shape) = wholes("words", x)?;
        rows("words", &shape, width)?;
        let most = self.network.word_max();
        let word = |&word: &i64| {
            i16::try_from(word).map_err(|_| {
                let allowed = format!("words lie in -{most}..={most} on this chip");
                wrong("words", &format!("hold {word}"), &allowed)
            })
        };
        words.iter().map(word).collect()
    }
}

fn stream(name: &str) -> PyResult<char> {
    let mut letters = name.chars();
    match (letters.next(), letters.next()) {
        (Some(letter @ ('p' | 'n')), None) => Ok(letter),
        _ => Err(wrong("stream", &format!("is {name:?}"), "streams are \"p\" and \"n\"")),
    }
}

#[pymethods]
impl Network {
    #[new]
    #[pyo3(signature = (name, text, hw, settings, seed, inputs, outputs, signed, own_words, updates, threads, kernel))]
    #[expect(clippy::too_many_arguments, reason = "the package gives all of them by name")]
    fn new(
        py: Python<'_>,
        name: &str,
        text: &str,
        hw: Option<String>,
        settings: Vec<String>,
        seed: Option<u64>,
        inputs: usize,
        outputs: usize,
        signed: bool,
        own_words: bool,
        updates: u64,
        threads: usize,
        kernel: Option<String>,
    ) -> PyResult<Self> {
        if !(1..=dalean::Machine::THREADS_MAX).contains(&threads) {
            return Err(wrong("threads", &format!("is {threads}"), "use 1 to 1024"));
        }
        let made = py.detach(|| -> Result<_, Raised> {
            let experiment = Some((name, text));
            let sources = Sources {
                experiment,
                hardware: hw.as_deref(),
                settings: &settings,
                seed,
                ..Sources::default()
            };
            let config = Config::load(&sources)?;
            // a single output tells two classes apart
            let mut experiment = config.experiment(inputs, outputs.max(2), None)?;
            if signed {
                experiment.network.layers[0].driven_by = DrivenBy::Signed;
            }
            let text = config.to_toml();
            let mut name = blake3::Hasher::new();
            name.update(text.as_bytes());
            name.update(format!("\n{inputs} {outputs} {own_words} {updates}").as_bytes());
            if signed {
                name.update(b" signed");
            }
            let name = name.finalize().to_hex().to_string();
            let made = Made { config, experiment, updates, own: own_words, kernel, name };
            let network = made.build(threads)?;
            Ok((made, network, text))
        })?;
        let (made, network, config) = made;
        let network = Held::new(network, threads);
        let (told, asked) = (Told::default(), Asked::new());
        Ok(Self { made, network, config, told, asked, away: None })
    }

    #[getter]
    fn config(&self) -> &str {
        &self.config
    }

    #[getter]
    fn key(&self) -> &str {
        &self.made.name
    }

    #[getter]
    fn layers(&self) -> usize {
        self.network.layers()
    }

    #[getter]
    fn code_max(&self) -> u8 {
        self.network.code_max()
    }

    #[getter]
    fn word_max(&self) -> i16 {
        self.network.word_max()
    }

    #[getter]
    fn level_bits(&self) -> u32 {
        self.made.experiment.hardware.cell.level_bits.get()
    }

    #[getter]
    fn window(&self) -> [u16; 2] {
        self.network.window()
    }

    #[getter]
    fn updates(&self) -> u64 {
        self.network.updates()
    }

    #[getter]
    fn signed(&self) -> bool {
        self.made.experiment.network.layers[0].driven_by == DrivenBy::Signed
    }

    #[getter]
    fn samples(&self) -> usize {
        self.network.samples()
    }

    #[getter]
    fn seed(&self) -> u64 {
        self.made.experiment.seed
    }

    fn size(&self, layer: usize) -> PyResult<[usize; 2]> {
        Ok(self.network.size(layer).map_err(Raised::from)?)
    }

    fn pathways(&self, layer: usize) -> PyResult<Vec<&'static str>> {
        Ok(self.network.pathways(layer).map_err(Raised::from)?)
    }

    fn shift(&self, layer: usize) -> PyResult<u32> {
        Ok(self.network.shift(layer).map_err(Raised::from)?)
    }

    #[pyo3(signature = (x, learn = true))]
    fn read<'py>(
        &mut self,
        py: Python<'py>,
        x: &Bound<'py, PyAny>,
        learn: bool,
    ) -> PyResult<Bound<'py, PyAny>> {
        let (codes, samples) = self.shown(x)?;
        self.told.add(if learn { "read" } else { "look" }, &codes);
        let network = self.held()?;
        py.detach(|| network.read(&codes, learn)).map_err(Raised::from)?;
        let outputs = self.outputs()?;
        let last = self.network.layers() - 1;
        match self.network.codes(last, 'p') {
            Ok(activities) => table(py, activities, [samples, outputs]),
            Err(_) => self.accumulators(py, "p"),
        }
    }

    fn calibrate(&mut self, py: Python<'_>, x: &Bound<'_, PyAny>) -> PyResult<()> {
        let (codes, _) = self.shown(x)?;
        self.told.add("calibrate", &codes);
        let network = self.held()?;
        Ok(py.detach(|| network.calibrate(&codes)).map_err(Raised::from)?)
    }

    #[pyo3(signature = (layer, stream = "p"))]
    fn codes<'py>(
        &self,
        py: Python<'py>,
        layer: usize,
        stream: &str,
    ) -> PyResult<Bound<'py, PyAny>> {
        let codes = self.network.codes(layer, self::stream(stream)?).map_err(Raised::from)?;
        table(py, codes, [self.network.samples(), self.units(layer)?])
    }

    #[pyo3(signature = (layer, stream = "p"))]
    fn slopes<'py>(
        &self,
        py: Python<'py>,
        layer: usize,
        stream: &str,
    ) -> PyResult<Bound<'py, PyAny>> {
        let slopes = self.network.slopes(layer, self::stream(stream)?).map_err(Raised::from)?;
        table(py, slopes, [self.network.samples(), self.units(layer)?])
    }

    #[pyo3(signature = (layer, stream = "p"))]
    fn gates<'py>(
        &self,
        py: Python<'py>,
        layer: usize,
        stream: &str,
    ) -> PyResult<Bound<'py, PyAny>> {
        let gates = self.network.gates(layer, self::stream(stream)?).map_err(Raised::from)?;
        table(py, gates, [self.network.samples(), self.units(layer)?])
    }

    #[pyo3(signature = (stream = "p"))]
    fn accumulators<'py>(&self, py: Python<'py>, stream: &str) -> PyResult<Bound<'py, PyAny>> {
        let sums = self.network.accumulators(self::stream(stream)?).map_err(Raised::from)?;
        table(py, sums, [self.network.samples(), self.outputs()?])
    }

    fn error_words<'py>(
        &mut self,
        py: Python<'py>,
        errors: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let (errors, shape) = wholes("errors", errors)?;
        let outputs = self.outputs()?;
        let samples = rows("errors", &shape, outputs)?;
        let error = |&error: &i64| {
            i32::try_from(error)
                .map_err(|_| wrong("errors", &format!("hold {error}"), "an error fits 32 bits"))
        };
        let errors: Vec<i32> = errors.iter().map(error).collect::<PyResult<_>>()?;
        let bytes: Vec<u8> = errors.iter().flat_map(|error| error.to_le_bytes()).collect();
        self.told.add("errors", &bytes);
        let words = self.held()?.error_words(&errors).map_err(Raised::from)?;
        table(py, words, [samples, outputs])
    }

    #[pyo3(signature = (words, layer = None))]
    fn deliver(
        &mut self,
        py: Python<'_>,
        words: &Bound<'_, PyAny>,
        layer: Option<usize>,
    ) -> PyResult<()> {
        let width = match layer {
            Some(layer) => self.units(layer)?,
            None => self.outputs()?,
        };
        let words = self.words(words, width)?;
        self.told
            .words(&layer.map_or("deliver".into(), |layer| format!("deliver {layer}")), &words);
        let network = self.held()?;
        let done = py.detach(|| match layer {
            Some(layer) => network.deliver_to(layer, &words),
            None => network.deliver(&words),
        });
        Ok(done.map_err(Raised::from)?)
    }

    fn read_back<'py>(&mut self, py: Python<'py>, layer: usize) -> PyResult<Bound<'py, PyAny>> {
        self.told.add(&format!("back {layer}"), &[]);
        let network = self.held()?;
        let sums = py.detach(|| network.read_back(layer)).map_err(Raised::from)?;
        let inputs = self.network.size(layer).map_err(Raised::from)?[0];
        table(py, sums, [self.network.samples(), inputs])
    }

    #[pyo3(signature = (shifts = vec![]))]
    fn write(&mut self, py: Python<'_>, shifts: Vec<Option<u32>>) -> PyResult<()> {
        self.told.add(&format!("write {shifts:?}"), &[]);
        let network = self.held()?;
        py.detach(|| network.write(&shifts)).map_err(Raised::from)?;
        self.asked.clear();
        Ok(())
    }

    fn levels<'py>(
        &self,
        py: Python<'py>,
        layer: usize,
        pathway: &str,
    ) -> PyResult<Bound<'py, PyAny>> {
        let levels = self.network.levels(layer, pathway).map_err(Raised::from)?;
        table(py, levels, self.network.array_size(layer).map_err(Raised::from)?)
    }

    fn load(&mut self, layer: usize, pathway: &str, levels: &Bound<'_, PyAny>) -> PyResult<()> {
        let [rows, columns] = self.network.array_size(layer).map_err(Raised::from)?;
        let (levels, shape) = wholes("levels", levels)?;
        if shape != [rows, columns] {
            let found = format!("have the shape {shape:?}");
            return Err(wrong("levels", &found, &format!("give the shape [{rows}, {columns}]")));
        }
        let [floor, ceiling] = self.network.window();
        let level = |&level: &i64| {
            u16::try_from(level).map_err(|_| {
                let allowed = format!("levels lie in {floor}..={ceiling} on this chip");
                wrong("levels", &format!("hold {level}"), &allowed)
            })
        };
        let levels: Vec<u16> = levels.iter().map(level).collect::<PyResult<_>>()?;
        let bytes: Vec<u8> = levels.iter().flat_map(|level| level.to_le_bytes()).collect();
        self.told.add(&format!("load {layer} {pathway}"), &bytes);
        self.held()?.load(layer, pathway, &levels).map_err(Raised::from)?;
        self.asked.insert((layer, pathway.to_owned()), levels);
        Ok(())
    }

    /// Gets ready for other chips: what there is now is kept, and the moments are those at which each is read.
    fn leave(
        &mut self,
        chips: Vec<u64>,
        after: Vec<f64>,
        compensate: bool,
    ) -> PyResult<Vec<Option<f64>>> {
        if self.away.is_some() {
            let allowed =
                "what is read on a chip may not ask for others: call it when on_chips is done";
            return Err(wrong("on_chips", "is in progress", allowed));
        }
        let asked = Deployment { after, chips, compensated: compensate, ..Deployment::default() };
        let moments = moments(&self.made.config, &asked).map_err(of_chips)?;
        let name = self.made.name.clone();
        let kept = self.held()?.checkpoint(&name);
        let (told, asked) = (self.told.clone(), self.asked.clone());
        let times = moments.iter().map(|moment| moment.after_s).collect();
        self.away = Some(Away { kept, told, asked, moments, made_up: compensate });
        Ok(times)
    }

    /// Goes to chip `number`, 0 the one that it was made on, at a moment.
    fn onto(&mut self, py: Python<'_>, number: u64, moment: usize) -> PyResult<()> {
        let Self { made, network, away, .. } = self;
        let moment = away.as_ref().and_then(|away| Some((away, away.moments.get(moment)?)));
        let Some((away, Moment { drift, .. })) = moment else {
            return Err(wrong("onto", "has nowhere to go", "call on_chips"));
        };
        py.detach(|| -> Result<(), Raised> {
            let network = network.renew(|threads| made.build(threads))?;
            network.put_back(&made.name, &away.kept)?;
            if number > 0 {
                network.set_chip(number);
                for ((layer, pathway), levels) in &away.asked {
                    network.load(*layer, pathway, levels)?;
                }
            }
            if let Some(drift) = drift {
                network.age(drift, away.made_up);
            }
            Ok(())
        })?;
        Ok(())
    }

    /// Comes back to the chip that it was made on, as it was.
    fn home(&mut self, py: Python<'_>) -> PyResult<()> {
        let Some(Away { kept, told, asked, .. }) = self.away.take() else { return Ok(()) };
        (self.told, self.asked) = (told, asked);
        let Self { made, network, .. } = self;
        py.detach(|| -> Result<(), Raised> {
            let network = network.renew(|threads| made.build(threads))?;
            Ok(network.put_back(&made.name, &kept)?)
        })?;
        Ok(())
    }

    fn ledger_json(&mut self) -> PyResult<String> {
        Ok(ledger_of(self.held()?))
    }

    fn told_hash(&self) -> String {
        self.told.0.finalize().to_hex().to_string()
    }

    fn state_hash(&mut self, py: Python<'_>) -> PyResult<String> {
        let network = self.held()?;
        Ok(py.detach(|| network.state_hash()))
    }

    fn checkpoint<'py>(&mut self, py: Python<'py>) -> PyResult<Bound<'py, PyBytes>> {
        let name = self.made.name.clone();
        let network = self.held()?;
        let bytes = py.detach(|| network.checkpoint(&name));
        Ok(PyBytes::new(py, &bytes))
    }

    fn put_back(&mut self, py: Python<'_>, bytes: &[u8]) -> PyResult<()> {
        self.told.add("put back", bytes);
        let name = self.made.name.clone();
        let network = self.held()?;
        py.detach(|| network.put_back(&name, bytes)).map_err(Raised::from)?;
        self.asked.clear();
        Ok(())
    }
}
