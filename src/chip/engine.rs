//! The engine: five operations on tiles, the same for every task and rule.
//!
//! ```text
//! LOADW(row)             load a row of levels
//! LOADX(row)             put drive codes of data on the rows of the first layer
//! FWD(rows | columns)    read a layer, or read it backwards
//! ERR(words)             deliver error words over the bus; units latch their taps and form gates
//! UPD(now | add | write) now: accumulate one sample and program; add: accumulate; write: program and clear
//! ```
//!
//! An operation carries a range of samples, as so many repetitions. The numbers come from kernels; the counts
//! are those of the chip, which does not skip. A task only decides which numbers arrive and who computes the
//! error words. See docs/MODEL.md, 4.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use std::ops::Range;
use std::sync::Arc;

use aligned_vec::{AVec, CACHELINE_ALIGN};

use super::crossbar::Collect;
use super::crossbar::kernel::{Backend, ConvPlan, Team};
use super::crossbar::layout::BLOCK_ROWS;
use super::hardware::Hardware;
use super::layer::{DrivenBy, Layer, Readings};
use super::ledger::{Cycles, During, Event, Ledger, coded};
use super::population::{Stream, Wiring};
use crate::num::tables::{Gaussian, Scales};

mod calibrate;
mod columns;
mod conducting;
mod currents;
mod deploy;
#[cfg(test)]
mod devices;
mod each;
mod error;
mod forget;
mod forward;
mod homeostasis;
mod look;
mod mute;
mod noise;
mod normalise;
mod optimise;
#[cfg(test)]
mod pairs;
mod passes;
mod pulses;
mod read;
mod readout;
mod refresh;
mod schedule;
mod state;
mod tape;
pub mod tick;
mod track;
mod trains;
mod unit;
mod update;
mod window;
mod words;

use forward::Units;
use schedule::Schedule;

pub use calibrate::{CALIBRATION_SAMPLES, Calibration};
pub use deploy::AllLevels;
pub use pulses::{Pulses, TilePeaks, active};
pub use tape::{Recorded, UpdateStart};
pub use track::WritesDone;
pub use unit::{Centre, ErrorUnit};

/// Which side of a crossbar is driven.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Side {
    /// Rows are driven, columns are read.
    Rows,
    /// Columns are driven with gates, rows are read.
    Columns,
}

/// What an update does with its samples.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Write {
    /// Accumulate one sample and program.
    Now,
    /// Accumulate.
    Add,
    /// Program what was accumulated, and clear.
    Program,
}

/// One operation, with its numbers.
#[derive(Debug, Clone)]
pub enum Operation<'a> {
    /// `LOADW`: one row of one array.
    LoadWeights {
        /// Which layer.
        layer: usize,
        /// Which of its arrays.
        array: usize,
        /// Which row.
        row: usize,
        /// One level a column.
        levels: &'a [u16],
    },
    /// `LOADX`: drive codes of a batch, sample after sample.
    LoadDrives {
        /// `inputs` codes a sample.
        codes: &'a [u8],
    },
    /// `FWD` of all loaded samples.
    Forward {
        /// Which layer.
        layer: usize,
        /// Which side.
        side: Side,
    },
    /// `ERR` for some samples.
    Error {
        /// Which layer.
        layer: usize,
        /// Which of the loaded samples.
        samples: Range<usize>,
        /// Output words, as many a sample as the layer's delivery takes: its own words are formed of them, for stream
        /// p; stream n latches them negated.
        words: &'a [i16],
        /// Whether they are the words of the `ERR` before, which both layers hear at once.
        shared: bool,
    },
    /// `UPD` for some samples.
    Update {
        /// Which layer.
        layer: usize,
        /// Which field.
        write: Write,
        /// Which of the loaded samples (none for `Program`).
        samples: Range<usize>,
        /// The layer's shift k.
        shift: u32,
    },
}

impl Operation<'_> {
    /// The (operation, field) pair, as the instruction is written.
    #[must_use]
    pub const fn name(&self) -> &'static str {
        match self {
            Self::LoadWeights { .. } => "LOADW(row)",
            Self::LoadDrives { .. } => "LOADX(row)",
            Self::Forward { side: Side::Rows, .. } => "FWD(rows)",
            Self::Forward { side: Side::Columns, .. } => "FWD(columns)",
            Self::Error { .. } => "ERR(words)",
            Self::Update { write: Write::Now, .. } => "UPD(now)",
            Self::Update { write: Write::Add, .. } => "UPD(add)",
            Self::Update { write: Write::Program, .. } => "UPD(write)",
        }
    }
}

coded! {
    /// Which ledger is charged.
    Phase {
        /// Learning, initial loads included.
        Training = 0, "training";
        /// Finding converter ranges.
        Calibration = 1, "calibration";
        /// Reading validation or test samples.
        Evaluation = 2, "evaluation";
    }
}

/// Registers of a layer for the loaded samples, by name. Streams are indexed by [`Stream`]; what a layer does not
/// have stays empty. Units lie in blocks of 64, samples in a block: `[block][sample][64]`.
///
/// A layer whose units drive the next one hands their codes to its `drives`; the last one keeps `accumulators` and
/// `activities` of every target stream that it has, for whoever reads them out.
#[derive(Debug, Clone, Default)]
struct Registers {
    /// Drive codes by source stream; a set that both share lies at P.
    drives: [Lines<u8>; 2],
    /// Derivatives by target stream.
    derivatives: [Lines<u8>; 2],
    /// Gates by target stream, packed for an update: `[block][4 halves][stride / 4][16 units][4 samples]`.
    gates: [Lines<i8>; 2],
    /// Drives by source stream as an update takes them: `[block][64 rows][stride]`.
    turned: [Lines<u8>; 2],
    /// Codes of units by target stream, where a window, a pool or another order lies between them and what they drive.
    maps: [Lines<u8>; 2],
    /// What windows move over, by set of drives; or what goes in another order into a dense layer.
    images: [Lines<u8>; 2],
    /// Where the windows of a convolution lie in them.
    plan: Option<ConvPlan>,
    /// Sums by target stream, where units are normalised: they lie here until all of a stream are known.
    unscaled: [Lines<i32>; 2],
    /// What units that keep to a middle learnt from what was read last.
    readings: Readings,
    /// Accumulators by target stream, of the last layer.
    accumulators: [Vec<i64>; 2],
    /// Activities by target stream, of the last layer where it has some.
    activities: [Vec<u8>; 2],
    /// Row sums of the last transposed read, `[sample][rows]`.
    backward: Vec<i64>,
    /// Samples added and not yet programmed, and their shift.
    pending: usize,
    /// Sums of the last write, where they were kept: `[array][panel][half block]`.
    sums: Lines<i32>,
    /// Pulses of the last write, while they are collected.
    pulses: Option<Pulses>,
}

/// Numbers that start on a line of the processor's cache.
#[derive(Debug, Clone)]
struct Lines<T>(AVec<T>);

impl<T> Default for Lines<T> {
    fn default() -> Self {
        Self(AVec::new(CACHELINE_ALIGN))
    }
}

impl<T> std::ops::Deref for Lines<T> {
    type Target = AVec<T>;

    fn deref(&self) -> &AVec<T> {
        &self.0
    }
}

impl<T> std::ops::DerefMut for Lines<T> {
    fn deref_mut(&mut self) -> &mut AVec<T> {
        &mut self.0
    }
}

/// Sum of bank currents of a layer since they were last taken: of banks that excite and that inhibit, by target stream.
pub type Currents = [[i64; 2]; 2];

/// A network on a chip.
#[derive(Debug)]
pub struct Engine {
    hardware: Hardware,
    backend: Backend,
    /// Threads that share large operations.
    team: Team,
    seed: u64,
    /// Of what makes this chip another than its like: stuck cells, noise.
    chip_seed: u64,
    /// Only potentiating pulses: excitatory arrays take positive gates, inhibitory ones negative gates.
    potentiation_only: bool,
    /// What is told of the pulses of a write.
    collect: Collect,
    /// Small factor of the rate of each layer.
    mantissas: Vec<u32>,
    /// Factors by powers of two, where an optimiser needs them.
    scales: Option<Scales>,
    unit: ErrorUnit,
    layers: Vec<Layer>,
    /// What units do with their accumulators, by layer.
    units: Vec<Units>,
    registers: Vec<Registers>,
    currents: Vec<Currents>,
    /// What layers said while they were evaluated.
    said: Vec<mute::Said>,
    /// Sums of levels of each row, by layer and array; forgotten when a level moves.
    row_sums: Vec<Option<Vec<Vec<i64>>>>,
    /// What cells let through, by layer, where that is not their level; forgotten when a level moves.
    through: Vec<Option<conducting::AllThrough>>,
    samples: usize,
    /// Samples that `LOADX` has brought since the start, by phase: state.
    loaded: [u64; 3],
    /// Phase of the loaded samples, and how many came in it before them.
    came: (Phase, u64),
    /// Gaussian numbers, where conversions or loads are noisy.
    gaussian: Option<Arc<Gaussian>>,
    /// Words of the cells for noisy loads, by layer and array, once they are drawn.
    load_words: Vec<Vec<Vec<[u16; 2]>>>,
    /// By layer: what makes up for drift, 12 fractional bits.
    factors: Vec<Option<i64>>,
    /// Samples written one by one since ranges of converters were last looked at: state where they track.
    unlooked: u64,
    phase: Phase,
    ledgers: [Ledger; 3],
    /// Counts cycles, on hardware that has a timing.
    schedule: Option<Schedule>,
    /// What was executed since drives were last loaded, while recording.
    tape: Option<Vec<Recorded>>,
    /// What there was before that.
    began: Option<Box<UpdateStart>>,
}

impl Engine {
    /// An engine over `layers`, whose sizes follow one another.
    ///
    /// # Panics
    /// When the layers do not follow one another: the plan checks that.
    #[must_use]
    pub fn new(hardware: Hardware, backend: Backend, seed: u64, mut layers: Vec<Layer>) -> Self {
        let joined = layers.windows(2).all(|pair| pair[1].spec.follows(&pair[0].spec));
        assert!(joined && !layers.is_empty(), "layers follow one another");
        assert!(layers[0].spec.driven_by.is_shared(), "data drive both streams alike");
        let signed = |layer: &Layer| layer.spec.driven_by == DrivenBy::Signed;
        assert!(!layers[1..].iter().any(signed), "only data have a sign");
        noise::make_cells(hardware.device(), &hardware, &mut layers, seed);
        let count = layers.len();
        let schedule = hardware.timing.map(|timing| Schedule::new(&hardware, timing, &layers));
        let ledger =
            if schedule.is_some() { Ledger::with_cycles(count) } else { Ledger::new(count) };
        let last = layers.len() - 1;
        let codes = |layer: usize| (layer < last).then_some(hardware.drive.bits);
        let units = layers.iter().zip(0..).map(|(l, at)| Units::new(l, codes(at))).collect();
        let collect = passes::collect(&hardware);
        let mut engine = Self {
            backend,
            team: Team::of_one(backend),
            seed,
            chip_seed: seed,
            potentiation_only: false,
            collect,
            mantissas: vec![1; count],
            scales: None,
            unit: ErrorUnit::new(
                Centre::None,
                hardware.digital.error_bits,
                layers[last].spec.units,
            ),
            registers: vec![Registers::default(); layers.len()],
            currents: vec![[[0; 2]; 2]; layers.len()],
            said: vec![mute::Said::default(); layers.len()],
            row_sums: vec![None; layers.len()],
            through: vec![None; layers.len()],
            units,
            layers,
            samples: 0,
            loaded: [0; 3],
            came: (Phase::Training, 0),
            gaussian: noise::gaussian_of(&hardware),
            load_words: vec![vec![]; count],
            factors: vec![None; count],
            unlooked: 0,
            phase: Phase::Training,
            ledgers: [ledger.clone(), ledger.clone(), ledger],
            schedule,
            tape: None,
            began: None,
            hardware,
        };
        engine.draw_faults();
        engine
    }

    /// Shares large operations among so many threads from now on; no bit depends on it. An engine starts with one.
    ///
    /// # Errors
    /// When the system gives no threads; the engine then keeps those it has.
    pub fn set_threads(&mut self, threads: usize) -> std::io::Result<()> {
        if threads != self.team.threads() {
            self.team = Team::new(self.backend, threads)?;
        }
        Ok(())
    }

    /// Restricts writes to potentiation (Kaneko's rule).
    pub const fn set_potentiation_only(&mut self, only: bool) {
        self.potentiation_only = only;
    }

    /// Sets the small factor of the rate of each layer, 1..=15.
    ///
    /// # Panics
    /// When there is not one a layer.
    pub fn set_mantissas(&mut self, mantissas: &[u32]) {
        assert!(mantissas.len() == self.layers.len(), "one mantissa a layer");
        self.mantissas = mantissas.to_vec();
    }

    /// Small factor of the rate of each layer.
    #[must_use]
    pub fn mantissas(&self) -> &[u32] {
        &self.mantissas
    }

    /// Whether writes only potentiate.
    #[must_use]
    pub const fn potentiation_only(&self) -> bool {
        self.potentiation_only
    }

    /// Charges what follows to `phase`.
    pub fn set_phase(&mut self, phase: Phase) {
        self.settle();
        self.phase = phase;
    }

    /// Ends what overlaps in time: the cycles of all operations so far are in the ledger.
    pub fn settle(&mut self) {
        self.time(Schedule::settle);
    }

    /// Counts cycles, if there is a timing.
    fn time(&mut self, count: impl FnOnce(&mut Schedule, &mut Cycles)) {
        let cycles = self.ledgers[self.phase as usize].cycles_mut();
        if let (Some(schedule), Some(cycles)) = (&mut self.schedule, cycles) {
            count(schedule, cycles);
        }
    }

    /// Starts recording operations, or stops and gives what was executed since the last [`Engine::begin_update`].
    pub fn record(&mut self, on: bool) -> Vec<Recorded> {
        std::mem::replace(&mut self.tape, on.then(Vec::new)).unwrap_or_default()
    }

    /// What was recorded before belongs to another update.
    pub fn begin_update(&mut self) {
        if let Some(tape) = &mut self.tape {
            tape.clear();
            let layers = self.layers.clone();
            let (unit, unlooked, loaded) = (self.unit.clone(), self.unlooked, self.loaded);
            self.began = Some(Box::new(UpdateStart { layers, unit, unlooked, loaded }));
        }
    }

    /// What there was when the update began that is recorded; nothing before the first one.
    #[must_use]
    pub fn update_start(&self) -> Option<&UpdateStart> {
        self.began.as_deref()
    }

    /// The chip.
    #[must_use]
    pub const fn hardware(&self) -> &Hardware {
        &self.hardware
    }

    /// The loops that run.
    #[must_use]
    pub const fn backend(&self) -> Backend {
        self.backend
    }

    /// The layers.
    #[must_use]
    pub fn layers(&self) -> &[Layer] {
        &self.layers
    }

    /// The layers, to restore a state. Registers are cleared.
    pub fn layers_mut(&mut self) -> &mut [Layer] {
        self.registers.fill(Registers::default());
        self.row_sums.fill(None);
        self.through.fill(None);
        self.samples = 0;
        &mut self.layers
    }

    /// A ledger.
    #[must_use]
    pub const fn ledger(&self, phase: Phase) -> &Ledger {
        &self.ledgers[phase as usize]
    }

    /// A ledger, to restore a state.
    pub const fn ledger_mut(&mut self, phase: Phase) -> &mut Ledger {
        &mut self.ledgers[phase as usize]
    }

    /// The phase that is charged.
    #[must_use]
    pub const fn phase(&self) -> Phase {
        self.phase
    }

    /// Samples loaded.
    #[must_use]
    pub const fn samples(&self) -> usize {
        self.samples
    }

    /// Samples that were loaded while a phase was charged, since the start.
    #[must_use]
    pub const fn samples_loaded(&self, phase: Phase) -> u64 {
        self.loaded[phase as usize]
    }

    /// Bank currents by layer since the last call, and starts over.
    pub fn take_currents(&mut self) -> Vec<Currents> {
        let zero = vec![[[0; 2]; 2]; self.layers.len()];
        std::mem::replace(&mut self.currents, zero)
    }

    /// Row sums of the last transposed read of `layer`, `[sample][inputs]`.
    #[must_use]
    pub fn backward(&self, layer: usize) -> &[i64] {
        &self.registers[layer].backward
    }

    /// Place of a unit in registers.
    const fn register_at(&self, sample: usize, unit: usize) -> usize {
        (unit / BLOCK_ROWS * self.samples + sample) * BLOCK_ROWS + unit % BLOCK_ROWS
    }

    /// Executes one operation.
    ///
    /// # Panics
    /// When the numbers do not have the shape the operation says: tasks and rules are our own code.
    pub fn execute(&mut self, operation: &Operation<'_>) {
        if let Some(tape) = &mut self.tape {
            tape.push(Recorded::new(operation));
        }
        match *operation {
            Operation::LoadWeights { layer, array, row, levels } => {
                self.load_weights(layer, array, row, levels);
            }
            Operation::LoadDrives { codes } => {
                self.settle();
                self.load_drives(codes);
            }
            Operation::Forward { layer, side: Side::Rows } => self.forward(layer),
            Operation::Forward { layer, side: Side::Columns } => self.forward_columns(layer),
            Operation::Error { layer, ref samples, words, shared } => {
                let direct = self.layers[layer].delivery.is_direct();
                assert!(direct || !shared, "formed words are heard by one layer");
                let words = self.layer_words(layer, samples, words);
                self.error(layer, samples.clone(), &words);
                self.time(|schedule, cycles| schedule.error(cycles, layer, samples, shared));
            }
            Operation::Update { layer, write, ref samples, shift } => {
                self.update(layer, write, samples.clone(), shift);
            }
        }
    }

    fn load_drives(&mut self, codes: &[u8]) {
        let layer = &self.layers[0];
        let (inputs, blocks) = (layer.spec.sample_inputs(), layer.layout.blocks());
        let (rows, phases) = (layer.spec.inputs, layer.spec.driven_by.phases());
        assert!(codes.len().is_multiple_of(inputs), "codes come in whole samples");
        assert!(self.registers.iter().all(|r| r.pending == 0), "sums wait to be programmed");
        let greatest = codes.iter().fold(0, |most, &code| most.max(code));
        assert!(greatest <= self.hardware.drive.bits.code_max(), "codes have `drive_bits` bits");
        self.samples = codes.len() / inputs;
        let samples = self.samples;
        self.came = (self.phase, self.loaded[self.phase as usize]);
        self.loaded[self.phase as usize] += samples as u64;
        if let Some(shape) = layer.spec.convolution {
            self.load_image(shape, codes);
        } else {
            let drives = &mut self.registers[0].drives[Stream::P.index()];
            if phases > 1 {
                let mut halves = codes.chunks_exact(inputs).map(|codes| codes.split_at(rows));
                let one_side = |(above, below): (&[u8], &[u8])| {
                    above.iter().zip(below).all(|(&above, &below)| above == 0 || below == 0)
                };
                assert!(halves.all(one_side), "a number lies above 0 or below");
            }
            drives.resize(blocks * samples * phases * BLOCK_ROWS, 0);
            window::flatten(&mut self.team, codes, samples * phases, rows, drives);
        }
        self.load_constant(0);
    }

    /// Drives the constant row of a layer, if it has one, in every stream.
    fn load_constant(&mut self, layer: usize) {
        let Some(this) = self.layers.get(layer).filter(|this| this.spec.constant_row) else {
            return;
        };
        let (inputs, code) = (this.spec.inputs, self.hardware.drive.bits.code_max());
        let (block, row) = (inputs / BLOCK_ROWS, inputs % BLOCK_ROWS);
        let (size, phases) = (self.drivings(layer) * BLOCK_ROWS, this.spec.driven_by.phases());
        for drives in &mut self.registers[layer].drives {
            if let Some(drives) = drives.get_mut(block * size..(block + 1) * size) {
                for (driving, sample) in drives.chunks_exact_mut(BLOCK_ROWS).enumerate() {
                    // a block of its own may hold what another batch left
                    sample[row..].fill(0);
                    // what is constant lies above 0
                    sample[row] = if driving % phases == 0 { code } else { 0 };
                }
            }
        }
    }

    /// Drives of a source stream of a layer.
    fn drives(&self, layer: usize, source: Stream) -> &[u8] {
        let set = self.layers[layer].spec.drives_of(source);
        &self.registers[layer].drives[set.index()]
    }

    fn charge(&mut self, layer: usize, pathway: u8, during: During, event: Event, count: u64) {
        self.ledgers[self.phase as usize].add(layer, pathway, during, event, count);
    }

    /// Code of the pathway that carries a target's excitatory bank: units are charged there.
    const fn code_of(wiring: Wiring, target: Stream) -> u8 {
        wiring.pathways()[wiring.pairs(target)[0][0]].code
    }
}
