//! A network that is driven from outside: a caller says which codes arrive and which error words go out, and the chip does
//! the rest, operation by operation.
//!
//! ```text
//! read       LOADX, then FWD(rows) of every layer
//! deliver    ERR of every layer, as the rule has it; or of one layer, with words of its own
//! read_back  FWD(columns) of a layer
//! write      UPD of every layer that heard words
//! load       LOADW of every row of an array
//! ```
//!
//! It does what [`Driver`] does for a task, bit by bit, where the same words are delivered. Everything is checked before
//! anything moves: an error leaves all as it was. See docs/MODEL.md, 4.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

#[cfg(test)]
mod tests;

use super::driver::Driver;
use super::network::{HiddenWords, NetworkError, NetworkPlace, NetworkSpec};
use super::rule::UpdateMode;
use crate::chip::crossbar::kernel::Backend;
use crate::chip::engine::{Engine, Operation, Phase, Side};
use crate::chip::hardware::{Adc, Hardware};
use crate::chip::layer::{DrivenBy, LayerSpec};
use crate::chip::population::{Pathway, Stream, Wiring};
use crate::chip::state::{State, StateError, Visitor};
use crate::num::fixed::rail;
use crate::num::tables::DriftTables;

/// Samples read at a time, at most, or half as many of drives with a sign: a sum over a batch fits 32 bits.
pub const SAMPLES_MAX: usize = 65_536;
/// Greatest shift of a write.
const SHIFT_MAX: u32 = 30;

/// What is asked of a network that is driven from outside, and cannot be done.
///
/// See [`DrivenNetwork`](crate::DrivenNetwork).
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{place} {found}; {allowed}")]
#[non_exhaustive]
pub struct DriveError {
    /// Where.
    pub place: String,
    /// What was found.
    pub found: String,
    /// What is allowed, and what to try.
    pub allowed: String,
}

fn wrong<T>(
    place: impl Into<String>,
    found: impl Into<String>,
    allowed: impl Into<String>,
) -> Result<T, DriveError> {
    Err(DriveError { place: place.into(), found: found.into(), allowed: allowed.into() })
}

/// A network on a chip that is driven from outside.
///
/// ```
/// # #[cfg(not(feature = "lab"))] fn main() {}
/// # #[cfg(feature = "lab")]
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// use dalean::network::{HiddenWords, NetworkPlace};
/// use dalean::{Backend, Config, DrivenNetwork, Sources};
///
/// let text = "network.hidden = [8]\nlearning.batch = 2";
/// let config = Config::load(&Sources { experiment: Some(("mine", text)), ..Sources::default() })?;
/// let experiment = config.experiment(4, 3, None)?;
/// let (network, hardware) = (&experiment.network, &experiment.hardware);
/// let place = NetworkPlace { seed: 1, first_layer: 0, updates: 100 };
/// let mut chip = DrivenNetwork::new(network, hardware, Backend::best(), place, HiddenWords::Routed)?;
///
/// // two samples of four drive codes; the first is of class 0, the second of class 2
/// chip.read(&[255, 0, 255, 0, 0, 255, 0, 255], true)?;
/// let activities = chip.codes(1, 'p')?;
/// let wanted = [255, 0, 0, 0, 0, 255];
/// let errors: Vec<i32> =
///     wanted.iter().zip(&activities).map(|(want, &is)| want - i32::from(is)).collect();
/// let words = chip.error_words(&errors)?;
/// chip.deliver(&words)?;
/// chip.write(&[])?;
/// assert_eq!(chip.updates(), 1);
///
/// let error = chip.write(&[]).unwrap_err();
/// assert_eq!(error.to_string(), "write has nothing to write; deliver error words first");
/// # Ok(())
/// # }
/// ```
#[derive(Debug)]
pub struct DrivenNetwork {
    driver: Driver,
    words: HiddenWords,
    /// Whether what is loaded may be learnt from.
    learning: bool,
    /// Which layers heard words of the loaded samples that are not yet written.
    heard: Vec<bool>,
}

impl DrivenNetwork {
    /// Builds the network with its initial levels. A place says of how many updates the training is, over which rates fall.
    ///
    /// # Errors
    /// When it does not fit together, not on the chip, or has convolutions.
    pub fn new(
        network: &NetworkSpec,
        hardware: &Hardware,
        backend: Backend,
        place: NetworkPlace,
        words: HiddenWords,
    ) -> Result<Self, NetworkError> {
        if network.layers.iter().any(|layer| layer.convolution.is_some()) {
            let allowed =
                "a network that is driven from outside is dense; leave network.channels out";
            return Err(NetworkError::misfit("network.channels", "is given", allowed));
        }
        let driver = network.build_hearing(hardware, backend, place, words)?;
        let heard = vec![false; network.layers.len()];
        Ok(Self { driver, words, learning: false, heard })
    }

    /// Shares large operations among so many threads from now on; no bit depends on it.
    ///
    /// # Errors
    /// When the system gives no threads.
    pub fn set_threads(&mut self, threads: usize) -> std::io::Result<()> {
        self.driver.engine_mut().set_threads(threads)
    }

    /// Layers.
    #[must_use]
    pub fn layers(&self) -> usize {
        self.heard.len()
    }

    fn engine(&self) -> &Engine {
        self.driver.engine()
    }

    fn spec(&self, layer: usize) -> Result<&LayerSpec, DriveError> {
        match self.engine().layers().get(layer) {
            Some(layer) => Ok(&layer.spec),
            None => wrong(
                "layer",
                format!("is {layer}"),
                format!("layers are numbered from 0 at the input to {}", self.layers() - 1),
            ),
        }
    }

    /// Rows that are driven from below, and units, of a layer.
    ///
    /// # Errors
    /// When there is no such layer.
    pub fn size(&self, layer: usize) -> Result<[usize; 2], DriveError> {
        let spec = self.spec(layer)?;
        Ok([spec.inputs, spec.units])
    }

    /// Names of the arrays of a layer, in their order, such as `pp`.
    ///
    /// # Errors
    /// When there is no such layer.
    pub fn pathways(&self, layer: usize) -> Result<Vec<&'static str>, DriveError> {
        Ok(self.spec(layer)?.wiring.pathways().iter().map(|pathway| pathway.name).collect())
    }

    /// Greatest drive code of an input.
    #[must_use]
    pub fn code_max(&self) -> u8 {
        self.engine().hardware().drive.bits.code_max()
    }

    /// Greatest error word; the least is its negative.
    #[must_use]
    pub fn word_max(&self) -> i16 {
        rail(self.engine().hardware().digital.error_bits.get()) as i16
    }

    /// Samples loaded.
    #[must_use]
    pub fn samples(&self) -> usize {
        self.engine().samples()
    }

    /// Updates done.
    #[must_use]
    pub const fn updates(&self) -> u64 {
        self.driver.updates()
    }

    /// What becomes of the units' sums: the shift of the next write of a layer.
    ///
    /// # Errors
    /// When there is no such layer.
    pub fn shift(&self, layer: usize) -> Result<u32, DriveError> {
        let _ = self.spec(layer)?;
        Ok(self.driver.shift(layer))
    }

    fn codes_fit(&self, codes: &[u8]) -> Result<(), DriveError> {
        let spec = &self.engine().layers()[0].spec;
        let (inputs, rows, most) = (spec.sample_inputs(), spec.inputs, self.code_max());
        if codes.is_empty() || !codes.len().is_multiple_of(inputs) {
            let found = format!("has {} codes", codes.len());
            return wrong("a read", found, format!("a sample has {inputs}; give whole samples"));
        }
        let samples_max = SAMPLES_MAX / spec.driven_by.phases();
        if codes.len() / inputs > samples_max {
            let found = format!("has {} samples", codes.len() / inputs);
            return wrong("a read", found, format!("give {samples_max} at most at a time"));
        }
        if let Some(at) = codes.iter().position(|&code| code > most) {
            let found = format!("has the code {} on row {}", codes[at], at % inputs % rows);
            let place = format!("sample {}", at / inputs);
            return wrong(place, found, format!("drive codes lie in 0..={most} on this chip"));
        }
        let both = |sample: &[u8]| {
            let (above, below) = sample.split_at(rows);
            above.iter().zip(below).any(|(&above, &below)| above > 0 && below > 0)
        };
        if let Some(at) = codes.chunks_exact(inputs).position(both) {
            let (found, allowed) = ("has two codes on a row", "a number lies above 0 or below");
            return wrong(format!("sample {at}"), found, allowed);
        }
        Ok(())
    }

    /// Reads drive codes, `[sample][input]`, through all layers; of drives with a sign a sample has the codes of what lies above 0, then of
    /// what lies below. What is read to learn from is charged to training, else to evaluation.
    ///
    /// # Errors
    /// When these are no whole samples of codes.
    pub fn read(&mut self, codes: &[u8], learning: bool) -> Result<(), DriveError> {
        self.codes_fit(codes)?;
        if learning && self.driver.mode() == UpdateMode::Online {
            let samples = codes.len() / self.engine().layers()[0].spec.sample_inputs();
            if samples > 1 {
                let allowed =
                    "learning.mode = \"online\" writes after every sample: read one at a time";
                return wrong("a read", format!("has {samples} samples"), allowed);
            }
        }
        let phase = if learning { Phase::Training } else { Phase::Evaluation };
        let engine = self.driver.engine_mut();
        if engine.phase() != phase {
            engine.set_phase(phase);
        }
        self.heard.fill(false);
        self.learning = learning;
        self.driver.read(codes);
        Ok(())
    }

    /// Reads up to 256 samples to find ranges of finite converters, charged to calibration; of a chip with ideal ones nothing
    /// happens.
    ///
    /// # Errors
    /// As [`DrivenNetwork::read`].
    pub fn calibrate(&mut self, codes: &[u8]) -> Result<(), DriveError> {
        self.codes_fit(codes)?;
        self.forget();
        let _ = self.driver.engine_mut().calibrate(codes);
        self.forget();
        Ok(())
    }

    /// Nothing is loaded that could be learnt from.
    fn forget(&mut self) {
        self.heard.fill(false);
        self.learning = false;
    }

    fn stream(&self, layer: usize, stream: char) -> Result<Stream, DriveError> {
        let targets = self.spec(layer)?.wiring.targets();
        let asked = match stream {
            'p' => Some(Stream::P),
            'n' => Some(Stream::N),
            _ => None,
        };
        match asked.filter(|asked| targets.contains(asked)) {
            Some(_) if self.samples() == 0 => {
                wrong("what units put out", "is not there", "read something first")
            }
            Some(stream) => Ok(stream),
            None => {
                let has = if targets.len() == 1 { "'p' alone" } else { "'p' and 'n'" };
                wrong("stream", format!("is '{stream}'"), format!("layer {layer} has {has}"))
            }
        }
    }

    /// What units put out, `[sample][unit]`: drive codes of the layer above, or activities of the last layer.
    ///
    /// # Errors
    /// When there is no such layer or stream, nothing was read, or the last layer has no activities.
    pub fn codes(&self, layer: usize, stream: char) -> Result<Vec<u8>, DriveError> {
        let target = self.stream(layer, stream)?;
        let codes = self.engine().unit_codes(layer, target);
        if codes.is_empty() {
            return wrong(
                "the last layer",
                "keeps accumulators and has no activities",
                "ask for those",
            );
        }
        Ok(codes)
    }

    /// Derivatives of units, `[sample][unit]`, 255 at the peak.
    ///
    /// # Errors
    /// When there is no such layer or stream, or nothing was read.
    pub fn slopes(&self, layer: usize, stream: char) -> Result<Vec<u8>, DriveError> {
        let target = self.stream(layer, stream)?;
        Ok(self.engine().unit_slopes(layer, target))
    }

    /// Gates of units, `[sample][unit]`: what an update multiplies drives by.
    ///
    /// # Errors
    /// When there is no such layer or stream, or it heard nothing since it was read.
    pub fn gates(&self, layer: usize, stream: char) -> Result<Vec<i8>, DriveError> {
        let target = self.stream(layer, stream)?;
        if !self.heard[layer] {
            return wrong(format!("layer {layer}"), "has no gates", "deliver error words first");
        }
        let gates = self.engine().unit_gates(layer, target);
        if gates.is_empty() {
            return wrong(
                format!("layer {layer}"),
                "has no gates",
                "it is frozen and hears nothing",
            );
        }
        Ok(gates)
    }

    /// Accumulators of the last layer, `[sample][unit]`.
    ///
    /// # Errors
    /// When it has no such stream, or nothing was read.
    pub fn accumulators(&self, stream: char) -> Result<Vec<i64>, DriveError> {
        let last = self.layers() - 1;
        let target = self.stream(last, stream)?;
        let units = self.engine().layers()[last].spec.units;
        let of = |sample| (0..units).map(move |unit| self.engine().output(target, sample, unit).0);
        Ok((0..self.samples()).flat_map(of).collect())
    }

    fn may_learn(&self, call: &str) -> Result<(), DriveError> {
        if self.learning && self.samples() > 0 {
            return Ok(());
        }
        wrong(call, "has nothing to learn from", "read samples with learning on first")
    }

    /// Output words of errors, `[sample][output]`, by the chip's error unit: it centres, rounds and bounds. An error of 255 is
    /// that of a unit that is 0 and should be 1.
    ///
    /// # Errors
    /// When it is not one an output and loaded sample, or one is greater than a unit takes.
    pub fn error_words(&mut self, errors: &[i32]) -> Result<Vec<i16>, DriveError> {
        /// What sums of a batch bound for certain.
        const MOST: u32 = 1 << 24;
        self.may_learn("error_words")?;
        let outputs = self.engine().layers()[self.layers() - 1].spec.units;
        let wanted = self.samples() * outputs;
        if errors.len() != wanted {
            let found = format!("are {} numbers", errors.len());
            let allowed = format!("{} samples of {outputs} outputs have {wanted}", self.samples());
            return wrong("errors", found, allowed);
        }
        if let Some(error) = errors.iter().find(|error| error.unsigned_abs() > MOST) {
            return wrong("an error", format!("is {error}"), format!("{MOST} is the most"));
        }
        // a running mean is one of errors of activities
        let running = !self.engine().error_unit().means().is_empty();
        if let Some(error) = errors.iter().find(|error| running && error.unsigned_abs() > 255) {
            let allowed = "where the centre runs, errors lie in -255..=255";
            return wrong("an error", format!("is {error}"), allowed);
        }
        Ok(self.driver.engine_mut().output_words(errors))
    }

    fn words_fit(&self, call: &str, width: usize, words: &[i16]) -> Result<(), DriveError> {
        self.may_learn(call)?;
        let (samples, most) = (self.samples(), self.word_max());
        if words.len() != samples * width {
            let found = format!("has {} words", words.len());
            let allowed = format!("{samples} samples of {width} words have {}", samples * width);
            return wrong(call, found, allowed);
        }
        match words.iter().find(|word| word.unsigned_abs() > most.unsigned_abs()) {
            Some(word) => {
                let allowed = format!("words lie in -{most}..={most} on this chip");
                wrong(call, format!("has the word {word}"), allowed)
            }
            None => Ok(()),
        }
    }

    /// Delivers output words, `[sample][output]`, to every layer, as rule and route have it: stream p hears them, stream n
    /// their negatives. A positive word asks for more.
    ///
    /// # Errors
    /// When these are no words of the loaded samples, or hidden layers hear words of their own.
    pub fn deliver(&mut self, words: &[i16]) -> Result<(), DriveError> {
        if self.words == HiddenWords::Own && self.layers() > 1 {
            let allowed =
                "say to which layer: hidden layers of this network hear words of their own";
            return wrong("deliver", "is to all layers", allowed);
        }
        self.words_fit("deliver", self.engine().layers()[self.layers() - 1].spec.units, words)?;
        self.driver.deliver(words);
        self.heard.fill(true);
        Ok(())
    }

    /// Delivers words of its own to a layer, `[sample][unit]`.
    ///
    /// # Errors
    /// When these are no words of the loaded samples and the layer's units, or hidden layers hear routed words.
    pub fn deliver_to(&mut self, layer: usize, words: &[i16]) -> Result<(), DriveError> {
        let units = self.spec(layer)?.units;
        if self.words == HiddenWords::Routed && self.layers() > 1 {
            let allowed = "hidden layers of this network hear the words of the output: deliver to all, or build it with \
                           words of their own";
            return wrong("deliver", format!("is to layer {layer} alone"), allowed);
        }
        self.words_fit("deliver", units, words)?;
        let samples = 0..self.samples();
        let operation = Operation::Error { layer, samples, words, shared: false };
        self.driver.engine_mut().execute(&operation);
        self.heard[layer] = true;
        Ok(())
    }

    /// Reads a layer from its columns, driven with its gates: for each row `sum (E - I) u`, `[sample][input]`.
    ///
    /// # Errors
    /// When the chip or the network has no transposed read, or the layer heard nothing.
    pub fn read_back(&mut self, layer: usize) -> Result<Vec<i64>, DriveError> {
        let spec = self.spec(layer)?;
        let hardware = self.engine().hardware();
        let place = format!("layer {layer}");
        if spec.driven_by == DrivenBy::Signed {
            let found = "has drives with a sign and is not read from its columns";
            return wrong(place, found, "ask for the layers above it");
        }
        if spec.wiring != Wiring::Single {
            let allowed =
                "arrays of differential pairs are: build it with rule = \"bp\" or \"dfa\"";
            return wrong(place, "is not read from its columns", allowed);
        }
        if !hardware.tile.transposed_read || hardware.adc != Adc::Ideal {
            let allowed = "that takes hw.tile.transposed_read = true and hw.adc = \"ideal\"";
            return wrong("the chip", "reads no array from its columns", allowed);
        }
        self.may_learn("read_back")?;
        if !self.heard[layer] {
            return wrong(place, "has no gates to be driven with", "deliver error words first");
        }
        self.driver.engine_mut().execute(&Operation::Forward { layer, side: Side::Columns });
        Ok(self.engine().backward(layer).to_vec())
    }

    /// Writes every layer that heard words, and ends the update. A shift says how many bits are rounded off the sums of a
    /// layer, a smaller one writes more; without one, that of the network's rate holds.
    ///
    /// # Errors
    /// When nothing was heard, or a shift has no layer or lies above 30.
    pub fn write(&mut self, shifts: &[Option<u32>]) -> Result<(), DriveError> {
        if !self.heard.contains(&true) {
            return wrong("write", "has nothing to write", "deliver error words first");
        }
        if shifts.len() > self.layers() {
            let found = format!("has {} shifts", shifts.len());
            return wrong("write", found, format!("there are {} layers", self.layers()));
        }
        if let Some(shift) = shifts.iter().flatten().find(|&&shift| shift > SHIFT_MAX) {
            return wrong(
                "write",
                format!("has the shift {shift}"),
                format!("use 0..={SHIFT_MAX}"),
            );
        }
        let none = vec![false; self.layers()];
        let heard = std::mem::replace(&mut self.heard, none);
        let of = |driver: &Driver, layer: usize| {
            let given = shifts.get(layer).copied().flatten();
            heard[layer].then(|| given.unwrap_or_else(|| driver.shift(layer)))
        };
        self.driver.write(of);
        self.driver.end_update();
        // a batch is learnt from once
        self.learning = false;
        Ok(())
    }

    fn array(&self, layer: usize, pathway: &str) -> Result<usize, DriveError> {
        let pathways = self.spec(layer)?.wiring.pathways();
        let names = || pathways.iter().map(|pathway| pathway.name).collect::<Vec<_>>().join(", ");
        let named = |one: &Pathway| one.name == pathway;
        match pathways.iter().position(named) {
            Some(at) => Ok(at),
            None => {
                let allowed = format!("layer {layer} has {}", names());
                wrong("pathway", format!("is {pathway:?}"), allowed)
            }
        }
    }

    /// Rows and columns of the arrays of a layer: a constant row is the last one.
    ///
    /// # Errors
    /// When there is no such layer.
    pub fn array_size(&self, layer: usize) -> Result<[usize; 2], DriveError> {
        let _ = self.spec(layer)?;
        let layout = self.engine().layers()[layer].layout;
        Ok([layout.rows, layout.columns])
    }

    /// Least and greatest level of a cell.
    #[must_use]
    pub fn window(&self) -> [u16; 2] {
        let window = self.engine().hardware().cell.window;
        [window.floor(), window.ceiling()]
    }

    /// Levels of an array, `[row][column]`.
    ///
    /// # Errors
    /// When there is no such array.
    pub fn levels(&self, layer: usize, pathway: &str) -> Result<Vec<u16>, DriveError> {
        let array = self.array(layer, pathway)?;
        Ok(self.engine().layers()[layer].arrays[array].levels().collect())
    }

    /// Loads levels into an array, row by row; charged as loads are. What was read is forgotten.
    ///
    /// # Errors
    /// When there is no such array, or this is not one level of the window a cell.
    pub fn load(&mut self, layer: usize, pathway: &str, levels: &[u16]) -> Result<(), DriveError> {
        let array = self.array(layer, pathway)?;
        let [rows, columns] = self.array_size(layer)?;
        let [floor, ceiling] = self.window();
        let place = || format!("layer {layer}, {pathway}");
        if levels.len() != rows * columns {
            let found = format!("is given {} levels", levels.len());
            return wrong(place(), found, format!("it has {rows} rows of {columns} cells"));
        }
        if let Some(at) = levels.iter().position(|level| !(floor..=ceiling).contains(level)) {
            let found = format!("is given the level {} in row {}", levels[at], at / columns);
            return wrong(
                place(),
                found,
                format!("levels lie in {floor}..={ceiling} on this chip"),
            );
        }
        self.forget();
        for (row, levels) in levels.chunks_exact(columns).enumerate() {
            let load = Operation::LoadWeights { layer, array, row, levels };
            self.driver.engine_mut().execute(&load);
        }
        Ok(())
    }

    /// Makes it chip `number` of its kind and loads its levels into that one: the number is the seed of which cells are stuck, how windows
    /// differ, what loads leave and what reads are off by. What was read is forgotten.
    pub fn set_chip(&mut self, number: u64) {
        self.forget();
        let engine = self.driver.engine_mut();
        let levels = engine.all_levels();
        engine.set_chip_seed(number);
        engine.load_all(&levels);
    }

    /// Lets levels drift, copies of an array as the first of them; with `made_up`, a factor a layer makes up for it. What was read is forgotten.
    pub fn age(&mut self, drift: &DriftTables, made_up: bool) {
        self.forget();
        self.driver.engine_mut().age(drift, made_up);
    }

    /// Learning in progress, with its chip.
    #[cfg(feature = "lab")]
    pub(crate) const fn driver(&self) -> &Driver {
        &self.driver
    }
}

impl State for DrivenNetwork {
    fn visit(&mut self, visitor: &mut dyn Visitor) -> Result<(), StateError> {
        // registers are no state, and whoever looks at it clears them
        self.forget();
        self.driver.visit(visitor)
    }
}
