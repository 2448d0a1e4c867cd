//! Choices become operations, whatever the order; the engine and its shadow carry them out side by side.

use std::ops::Range;

use dalean::chip::crossbar::kernel::Backend;
use dalean::chip::engine::{Calibration, Engine, Operation, Phase, Side, Write, WritesDone};
use dalean::chip::hardware::{Adc, AdcRange, WriteScheme};
use dalean::chip::layer::{DrivenBy, Layer, WordSource};
use dalean::chip::ledger::Ledger;
use dalean::chip::population::Stream;
use dalean::learn::error::ErrorUnit;

use super::choose::{Choice, Net, Numbers};
use super::fault::Fault;
use super::shadow::{Shadow, Table};

/// An operation with numbers of its own.
#[derive(Debug, Clone)]
pub(crate) enum Op {
    Levels {
        layer: usize,
        array: usize,
        row: usize,
        levels: Vec<u16>,
    },
    Drives(Vec<u8>),
    Forward(usize),
    Backward(usize),
    Error {
        layer: usize,
        samples: Range<usize>,
        words: Vec<i16>,
        shared: bool,
    },
    Update {
        layer: usize,
        write: Write,
        samples: Range<usize>,
        shift: u32,
    },
    /// Errors of the loaded samples.
    Words(Vec<i32>),
    /// Writes are done, of a batch or of so many single samples.
    Written(Option<u32>),
    Calibrate(Vec<u8>),
    Charge(Phase),
}

/// What came of an operation that gives something.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Found {
    Nothing,
    Words(Vec<i16>),
    Ranges(Option<Calibration>),
}

/// What may come next: the order of operations that registers allow.
struct Script<'a> {
    net: &'a Net,
    numbers: Numbers,
    ops: Vec<Op>,
    samples: usize,
    /// Layers read since the samples were loaded.
    read: usize,
    /// By layer: whether it was read backwards since.
    columns: Vec<bool>,
    /// By layer and sample: whether gates were formed since the samples were loaded.
    gates: Vec<Vec<bool>>,
    /// Samples added and not yet written.
    pending: Vec<usize>,
    /// Whether ranges of converters are found.
    calibrates: bool,
}

/// A list of valid operations, from any list of choices.
pub(crate) fn script(net: &Net, choices: &[Choice]) -> Vec<Op> {
    script_of(net, choices, true)
}

/// The same; `calibrates`: whether ranges of converters are found on the way.
pub(crate) fn script_of(net: &Net, choices: &[Choice], calibrates: bool) -> Vec<Op> {
    let count = net.specs.len();
    let mut script = Script {
        net,
        numbers: Numbers(net.seed),
        ops: vec![],
        samples: 0,
        read: 0,
        columns: vec![false; count],
        gates: vec![vec![]; count],
        pending: vec![0; count],
        calibrates,
    };
    for layer in 0..count {
        for array in 0..net.specs[layer].wiring.pathways().len() {
            let style = script.numbers.within(0, 5);
            for row in 0..net.specs[layer].inputs + usize::from(net.specs[layer].constant_row) {
                script.levels(layer, array, row, style);
            }
        }
    }
    for choice in choices {
        script.numbers = Numbers(choice.seed);
        script.choose(choice.kind % 16);
    }
    script.ops
}

impl Script<'_> {
    fn pick(&mut self, below: usize) -> usize {
        self.numbers.within(0, below as i64 - 1) as usize
    }

    fn levels(&mut self, layer: usize, array: usize, row: usize, style: i64) {
        let window = self.net.hardware.cell.window;
        let (floor, ceiling) = (i64::from(window.floor()), i64::from(window.ceiling()));
        let numbers = &mut self.numbers;
        let level = |_| match style {
            0 => floor,
            1 => ceiling,
            2 => numbers.within(floor, (floor + 2).min(ceiling)),
            _ => numbers.within(floor, ceiling),
        };
        let levels = (0..self.net.specs[layer].units).map(level).map(|v| v as u16).collect();
        self.ops.push(Op::Levels { layer, array, row, levels });
    }

    fn codes(&mut self) -> Vec<u8> {
        let most = (300_000 / self.net.cells()).clamp(1, 20);
        self.samples = 1 + self.pick(most);
        let inputs = self.net.specs[0].inputs;
        let greatest = (1i64 << self.net.hardware.drive.bits.get()) - 1;
        let (style, dark) = (self.pick(8), [4, 16, 32, 64][self.pick(4)]);
        let numbers = &mut self.numbers;
        let code = |at: usize| match style {
            0 => greatest,
            1 => 0,
            // rows that are dark in every sample: whole blocks, or parts of each
            2 | 4 if (at % inputs / dark).is_multiple_of(2) => 0,
            3 if numbers.within(0, 9) > 0 => 0,
            _ => numbers.within(0, greatest),
        };
        let codes: Vec<_> = (0..self.samples * inputs).map(code).map(|code| code as u8).collect();
        if self.net.specs[0].driven_by != DrivenBy::Signed {
            return codes;
        }
        let mut both = Vec::with_capacity(2 * codes.len());
        for row in codes.chunks_exact(inputs) {
            let below: Vec<_> = row.iter().map(|_| numbers.within(0, 1) == 1).collect();
            for side in [false, true] {
                let of = row.iter().zip(&below);
                both.extend(of.map(|(&code, &below)| if below == side { code } else { 0 }));
            }
        }
        both
    }

    fn loaded(&mut self) {
        self.read = 0;
        self.columns = vec![false; self.net.specs.len()];
        self.gates = vec![vec![false; self.samples]; self.net.specs.len()];
    }

    fn write_pending(&mut self, layer: usize) {
        if self.pending[layer] > 0 {
            self.program(layer);
        }
    }

    fn batch(&mut self) {
        (0..self.net.specs.len()).for_each(|layer| self.write_pending(layer));
        let codes = self.codes();
        self.ops.push(Op::Drives(codes));
        self.loaded();
    }

    /// Reads one layer whose drives are there.
    fn forward(&mut self, layer: usize) {
        if self.samples == 0 {
            self.batch();
        }
        let layer = layer.min(self.read);
        if layer + 1 < self.net.specs.len() {
            self.write_pending(layer + 1);
        }
        self.ops.push(Op::Forward(layer));
        self.read = self.read.max(layer + 1);
    }

    fn error(&mut self, layer: usize, all: bool) {
        while self.read <= layer {
            self.forward(self.read);
        }
        let delivery = &{ self.net }.deliveries[layer];
        if delivery.source == WordSource::Above && !self.columns[layer + 1] {
            self.columns(layer + 1);
        }
        let from = if all { 0 } else { self.pick(self.samples) };
        let to = if all { self.samples } else { from + self.pick(self.samples - from + 1) };
        if from < to && from < self.pending[layer] {
            self.program(layer);
        }
        let rail = (1i64 << (self.net.hardware.digital.error_bits.get() - 1)) - 1;
        let (width, direct) = (delivery.output_words(), delivery.is_direct());
        let style = self.pick(6);
        let numbers = &mut self.numbers;
        let word = |_| match style {
            0 => rail,
            1 => -rail,
            2 => 0,
            3 if numbers.within(0, 9) > 0 => 0,
            // wider than a bus: every clamp behind it is reached
            4 if direct => numbers.within(-1000, 1000),
            _ => numbers.within(-rail, rail),
        };
        let words = (0..(to - from) * width).map(word).map(|word| word as i16).collect();
        let shared = self.pick(2) == 1 && direct;
        self.ops.push(Op::Error { layer, samples: from..to, words, shared });
        self.gates[layer][from..to].fill(true);
    }

    /// Reads a layer backwards, once all its samples have gates.
    fn columns(&mut self, layer: usize) {
        if self.gates[layer].is_empty() || self.gates[layer].contains(&false) {
            self.error(layer, true);
        }
        self.ops.push(Op::Backward(layer));
        self.columns[layer] = true;
    }

    fn words(&mut self) {
        let outputs = self.net.specs.last().unwrap().units;
        let style = self.pick(3);
        let numbers = &mut self.numbers;
        let error = |at: usize| match style {
            0 => numbers.within(-255, 255) as i32,
            1 => 255 - 510 * (at as i32 % 2),
            _ => numbers.within(-40, 200) as i32,
        };
        let errors = (0..self.samples * outputs).map(error).collect();
        self.ops.push(Op::Words(errors));
    }

    fn written(&mut self) {
        let samples = if self.pick(2) == 0 { None } else { Some(1 + self.pick(70) as u32) };
        self.ops.push(Op::Written(samples));
    }

    /// A shift that often moves cells, and sometimes any.
    fn shift(&mut self) -> u32 {
        let shift =
            if self.pick(4) == 0 { self.numbers.within(0, 30) } else { self.numbers.within(6, 18) };
        shift as u32
    }

    fn program(&mut self, layer: usize) {
        if self.net.hardware.write.scheme != WriteScheme::Rounded {
            return self.now(layer);
        }
        let shift = self.shift();
        self.ops.push(Op::Update { layer, write: Write::Program, samples: 0..0, shift });
        self.pending[layer] = 0;
    }

    /// Adds some of the samples that come next and have gates.
    fn add(&mut self, layer: usize, all: bool) {
        if self.net.hardware.write.scheme != WriteScheme::Rounded {
            return self.now(layer);
        }
        let from = self.pending[layer];
        if !self.gates[layer].get(from).copied().unwrap_or(false) {
            if from > 0 || self.samples == 0 {
                return self.program(layer);
            }
            self.error(layer, true);
        }
        let ready = self.gates[layer][from..].iter().take_while(|ready| **ready).count();
        let to = from + if all { ready } else { 1 + self.pick(ready) };
        self.ops.push(Op::Update { layer, write: Write::Add, samples: from..to, shift: 0 });
        self.pending[layer] = to;
    }

    fn now(&mut self, layer: usize) {
        self.write_pending(layer);
        if self.samples == 0 || !self.gates[layer].iter().any(|ready| *ready) {
            self.error(layer, true);
        }
        let ready: Vec<usize> =
            (0..self.samples).filter(|&sample| self.gates[layer][sample]).collect();
        let sample = ready[self.pick(ready.len())];
        let shift = self.shift();
        self.ops.push(Op::Update { layer, write: Write::Now, samples: sample..sample + 1, shift });
    }

    fn choose(&mut self, kind: u8) {
        let count = self.net.specs.len();
        let layer = self.pick(count);
        match kind {
            0 => self.batch(),
            1 => self.forward(layer),
            2 => self.error(layer, false),
            3 => self.now(layer),
            4 => self.add(layer, false),
            5 => self.program(layer),
            6 => {
                let spec = &self.net.specs[layer];
                let rows = spec.inputs + usize::from(spec.constant_row);
                let arrays = spec.wiring.pathways().len();
                let (array, row, style) = (self.pick(arrays), self.pick(rows), self.pick(6));
                self.levels(layer, array, row, style as i64);
            }
            7 | 8
                if self.net.hardware.tile.transposed_read
                    && self.net.hardware.adc == Adc::Ideal
                    && self.net.specs[layer].wiring.pairs(Stream::P).len() == 1 =>
            {
                self.columns(layer);
            }
            9 if self.calibrates && self.net.hardware.adc != Adc::Ideal => {
                (0..count).for_each(|layer| self.write_pending(layer));
                let codes = self.codes();
                self.ops.push(Op::Calibrate(codes));
                self.loaded();
                self.read = count;
            }
            10 => {
                let phase = Phase::ALL[self.pick(3)];
                self.ops.push(Op::Charge(phase));
            }
            _ => {
                self.batch();
                (0..count).for_each(|layer| self.forward(layer));
                self.words();
                (0..count).for_each(|layer| self.error(layer, true));
                for layer in 0..count {
                    if kind == 11 {
                        self.now(layer);
                    } else {
                        self.add(layer, true);
                        self.program(layer);
                    }
                }
                self.written();
            }
        }
    }
}

pub(crate) fn engine(net: &Net, backend: Backend) -> Engine {
    let layers = net.specs.iter().zip(&net.deliveries).zip(0u16..);
    let layers = layers.map(|((spec, delivery), index)| {
        Layer::new(index, spec.clone(), delivery.clone(), &net.hardware)
    });
    let mut engine = Engine::new(net.hardware.clone(), backend, net.seed, layers.collect());
    let mantissas: Vec<u32> = (0..net.specs.len()).map(|layer| net.mantissa_of(layer)).collect();
    engine.set_mantissas(&mantissas);
    engine.set_potentiation_only(net.potentiation_only);
    if matches!(net.hardware.adc, Adc::Finite { range: AdcRange::Tracking, .. }) {
        let layers = engine.layers_mut().iter_mut();
        layers.for_each(|l| l.adc_shifts.iter_mut().for_each(|s| s.fill(net.tracks_from)));
    }
    let outputs = net.specs.last().unwrap().units;
    let bits = net.hardware.digital.error_bits;
    engine.set_error_unit(ErrorUnit::new(net.centre, bits, outputs));
    engine
}

/// The operation of a choice, where it is one of the chip's.
pub(crate) fn operation(op: &Op) -> Option<Operation<'_>> {
    Some(match op {
        Op::Levels { layer, array, row, levels } => {
            Operation::LoadWeights { layer: *layer, array: *array, row: *row, levels }
        }
        Op::Drives(codes) => Operation::LoadDrives { codes },
        Op::Forward(layer) => Operation::Forward { layer: *layer, side: Side::Rows },
        Op::Backward(layer) => Operation::Forward { layer: *layer, side: Side::Columns },
        Op::Error { layer, samples, words, shared } => {
            Operation::Error { layer: *layer, samples: samples.clone(), words, shared: *shared }
        }
        Op::Update { layer, write, samples, shift } => Operation::Update {
            layer: *layer,
            write: *write,
            samples: samples.clone(),
            shift: *shift,
        },
        Op::Words(_) | Op::Written(_) | Op::Calibrate(_) | Op::Charge(_) => return None,
    })
}

pub(crate) fn execute(engine: &mut Engine, op: &Op) -> Found {
    match op {
        Op::Words(errors) => return Found::Words(engine.output_words(errors)),
        Op::Calibrate(codes) => return Found::Ranges(engine.calibrate(codes)),
        Op::Charge(phase) => engine.set_phase(*phase),
        Op::Written(None) => engine.written(WritesDone::Batch),
        Op::Written(Some(samples)) => {
            (0..*samples).for_each(|_| engine.written(WritesDone::Sample));
        }
        _ => engine.execute(&operation(op).expect("an operation of the chip")),
    }
    Found::Nothing
}

fn shadow_execute(shadow: &mut Shadow, pending: &mut [usize], op: &Op) -> Found {
    match op {
        Op::Levels { layer, array, row, levels } => {
            shadow.load_weights(*layer, *array, *row, levels);
        }
        Op::Drives(codes) => shadow.load_drives(codes),
        Op::Forward(layer) => shadow.forward(*layer),
        Op::Backward(layer) => shadow.forward_columns(*layer),
        Op::Error { layer, samples, words, .. } => shadow.error(*layer, samples.clone(), words),
        Op::Update { layer, write, samples, shift } => {
            let phases = shadow.phases(*layer);
            match write {
                Write::Add => shadow.move_bits(*layer, phases * samples.len() as u64, 0),
                Write::Program => shadow.move_bits(*layer, 1, 1),
                // two products are added up before they are written
                Write::Now if phases > 1 => shadow.move_bits(*layer, phases + 1, 1),
                Write::Now => shadow.move_bits(*layer, 0, 1),
            }
            if *write != Write::Program {
                shadow.add(*layer, samples.clone());
                pending[*layer] += samples.len();
            }
            if *write != Write::Add {
                let nothing = std::mem::take(&mut pending[*layer]) == 0;
                shadow.program(*layer, *shift, nothing);
            }
        }
        Op::Words(errors) => return Found::Words(shadow.output_words(errors)),
        Op::Calibrate(codes) => return Found::Ranges(shadow.calibrate(codes)),
        Op::Charge(phase) => shadow.charge_to(*phase),
        Op::Written(samples) => shadow.written(*samples),
    }
    Found::Nothing
}

/// Carries out `ops` on the shadow and on every back end, and compares them after each.
pub(crate) fn law(
    net: &Net,
    ops: &[Op],
    backends: &[Backend],
    fault: Option<Fault>,
) -> Result<(), String> {
    let mut shadow = Shadow::new(net, fault);
    let mut engines: Vec<Engine> = backends.iter().map(|&b| engine(net, b)).collect();
    let mut pending = vec![0; net.specs.len()];
    for (at, op) in ops.iter().enumerate() {
        let found = shadow_execute(&mut shadow, &mut pending, op);
        for engine in &mut engines {
            let name = engine.backend().name();
            let fail = |what: String| format!("{name} after operation {at}, {op:?}: {what}");
            let got = execute(engine, op);
            if got != found {
                return Err(fail(format!("{got:?}, but the law says {found:?}")));
            }
            if engine.error_unit().means() != shadow.means {
                return Err(fail("running means differ".into()));
            }
            compare_step(engine, &shadow, op).map_err(fail)?;
        }
    }
    for engine in &engines {
        (0..net.specs.len()).try_for_each(|layer| compare_cells(engine, &shadow, layer))?;
    }
    Ok(())
}

fn compare_step(engine: &Engine, shadow: &Shadow, op: &Op) -> Result<(), String> {
    for (phase, want) in Phase::ALL.into_iter().zip(&shadow.ledgers) {
        compare_ledgers(engine.ledger(phase), want)?;
        let (got, want) = (engine.samples_loaded(phase), shadow.loaded[phase as usize]);
        if got != want {
            return Err(format!("{got} samples were loaded in {phase:?}, not {want}"));
        }
    }
    let last = shadow.layers.len() - 1;
    match op {
        Op::Forward(layer) if *layer == last => compare_outputs(engine, shadow),
        Op::Calibrate(_) => compare_outputs(engine, shadow),
        Op::Backward(layer) if engine.backward(*layer) != shadow.layers[*layer].backward => {
            Err("row sums differ".into())
        }
        Op::Written(_) => (0..=last).try_for_each(|layer| compare_cells(engine, shadow, layer)),
        Op::Update { layer, .. } | Op::Levels { layer, .. } => {
            compare_cells(engine, shadow, *layer)
        }
        _ => Ok(()),
    }
}

pub(crate) fn compare_ledgers(got: &Ledger, want: &Ledger) -> Result<(), String> {
    if got == want {
        return Ok(());
    }
    if got.cycles() != want.cycles() {
        return Err(format!("{:?}, but the law says {:?}", got.cycles(), want.cycles()));
    }
    let entry = |(layer, code, during, event, count)| {
        format!("layer {layer} code {code} {during:?} {event:?} {count}")
    };
    let lines = |ledger: &Ledger| ledger.entries().map(entry).collect::<Vec<_>>();
    let (got, want) = (lines(got), lines(want));
    let only = |these: &[String], those: &[String]| -> Vec<String> {
        these.iter().filter(|line| !those.contains(line)).cloned().collect()
    };
    Err(format!("counts {:?}, but the law says {:?}", only(&got, &want), only(&want, &got)))
}

fn compare_outputs(engine: &Engine, shadow: &Shadow) -> Result<(), String> {
    let layer = shadow.layers.last().unwrap();
    for &stream in layer.spec.wiring.targets() {
        let (sums, activity) =
            (&layer.accumulators[stream.index()], &layer.activity[stream.index()]);
        for (sample, (sums, activity)) in sums.iter().zip(activity).enumerate() {
            for (unit, want) in sums.iter().zip(activity).enumerate() {
                let got = engine.output(stream, sample, unit);
                if (&got.0, &i64::from(got.1)) != want {
                    let what = format!("{stream:?} {sample}, {unit}");
                    return Err(format!("output of {what} is {got:?}, not {want:?}"));
                }
            }
        }
    }
    Ok(())
}

fn compare_cells(engine: &Engine, shadow: &Shadow, layer: usize) -> Result<(), String> {
    let (got, want) = (&engine.layers()[layer], &shadow.layers[layer]);
    let window = shadow.net.hardware.cell.window;
    let flat = |table: &Table| -> Vec<i64> { table.concat() };
    for (at, (array, want)) in got.arrays.iter().zip(&want.arrays).enumerate() {
        let levels: Vec<i64> = array.levels().map(i64::from).collect();
        let inside =
            |v: &i64| (i64::from(window.floor())..=i64::from(window.ceiling())).contains(v);
        if !levels.iter().all(inside) {
            return Err(format!("layer {layer} array {at}: a level left the window"));
        }
        if levels != flat(&want.level) {
            let cell = levels.iter().zip(flat(&want.level)).position(|(a, b)| *a != b);
            return Err(format!("layer {layer} array {at}: the level of cell {cell:?} differs"));
        }
        let left =
            array.residuals().map(|left| left.into_iter().map(i64::from).collect::<Vec<_>>());
        if left.is_some_and(|left| left != flat(&want.residual)) {
            return Err(format!("layer {layer} array {at}: remainders differ"));
        }
        let gone = array.pruned().map(|bits| bits.iter().by_vals().collect::<Vec<_>>());
        if gone.is_some_and(|gone| gone != want.pruned.concat()) {
            return Err(format!("layer {layer} array {at}: pruned cells differ"));
        }
        if got.writes[at] != want.writes {
            return Err(format!("layer {layer} array {at}: write counts differ"));
        }
    }
    if got.adc_shifts != want.adc_shifts || got.rails != want.rails {
        return Err(format!("layer {layer}: converter shifts, or what they follow, differ"));
    }
    Ok(())
}
