//! A network of tiles, cycle by cycle: what the engine's closed forms are compared with.
//!
//! All tiles of a layer work in step. Tiles above one another share the *head* of their columns, where an adder tree
//! brings their sums, lanes look them up and words become gates. A list of operations is cut into segments by the
//! rules of `schedule` and every segment is played: commands are offered when their layer is ready and what they need
//! is there, and cycles are counted one by one. See docs/MODEL.md, 4.5.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use std::ops::Range;

use super::super::{Operation, Phase, Recorded, Side, Write, WritesDone};
use super::tile::{BankEvents, Command, Tile, TileEvents};
use crate::chip::hardware::{Adc, AdcRange, Hardware, Timing};
use crate::chip::layer::Layer;
use crate::chip::ledger::{Cycles, During, Event, Interval, Ledger, Part};
use crate::chip::population::Stream;

mod balance;
mod layer;
mod normalise;
mod pipeline;
mod pool;
mod segment;
mod unit;
mod watch;

use layer::TickLayer;
use segment::Segment;
use unit::Unit;
use watch::Watch;
pub use watch::{PartSpan, Span, TileAt};

/// A network, its cycles and its counts.
#[derive(Debug)]
pub struct Network {
    timing: Timing,
    layers: Vec<TickLayer>,
    unit: Unit,
    /// Samples written one by one since ranges were looked at; `None` where converters do not track.
    unlooked: Option<u64>,
    samples: usize,
    /// Samples loaded so far, by phase.
    loaded: [u64; 3],
    phase: Phase,
    ledgers: [Ledger; 3],
    /// Cycles played so far.
    clock: u64,
    watch: Watch,
}

/// A command for one layer, of one sample where it has one.
#[derive(Debug, Clone, Copy)]
struct Order<'a> {
    layer: usize,
    command: Command<'a>,
    during: During,
    /// Output words of an `ERR`; while it is played, the words on the bus.
    words: &'a [i16],
}

impl Network {
    /// A network in the state of `layers`, whose tiles remember `slots` samples.
    ///
    /// # Panics
    /// When the hardware has no timing.
    #[must_use]
    pub fn new(hardware: &Hardware, seed: u64, layers: &[Layer], slots: usize) -> Self {
        let timing = hardware.timing.expect("time is counted on hardware that has it");
        let tracks = matches!(hardware.adc, Adc::Finite { range: AdcRange::Tracking, .. });
        let ledger = Ledger::with_cycles(layers.len());
        let layers =
            layers.iter().map(|layer| TickLayer::new(hardware, timing, seed, layer, slots));
        Self {
            timing,
            layers: layers.collect(),
            unit: Unit::new(hardware),
            unlooked: tracks.then_some(0),
            samples: 0,
            loaded: [0; 3],
            phase: Phase::Training,
            ledgers: [ledger.clone(), ledger.clone(), ledger],
            clock: 0,
            watch: Watch::default(),
        }
    }

    /// Sets the small factor of the rate of each layer and whether writes only potentiate.
    pub fn set_learning(&mut self, mantissas: &[u32], potentiation_only: bool) {
        for (layer, &mantissa) in self.layers.iter_mut().zip(mantissas) {
            let tiles = layer.all_tiles();
            tiles.for_each(|tile| tile.set_learning(mantissa.into(), potentiation_only));
        }
    }

    /// Takes over converter shifts.
    pub fn set_adc_shifts(&mut self, layers: &[Layer]) {
        let layers = self.layers.iter_mut().zip(layers);
        layers.for_each(|(tick, layer)| tick.set_adc_shifts(&layer.adc_shifts));
    }

    /// Converter shifts of a layer, by target stream and slice.
    #[must_use]
    pub fn adc_shifts(&self, layer: usize) -> &[Vec<u32>] {
        &self.layers[layer].adc_shifts
    }

    /// Takes over how many samples were written one by one since ranges were looked at.
    pub fn set_unlooked(&mut self, unlooked: u64) {
        self.unlooked = self.unlooked.map(|_| unlooked);
    }

    /// Takes over how many samples were loaded so far, by phase.
    pub const fn set_loaded(&mut self, loaded: [u64; 3]) {
        self.loaded = loaded;
    }

    /// Writes are done: thresholds and steps move and, where converters track, ranges are looked at after those of a batch, or
    /// of 64 samples.
    pub fn written(&mut self, written: WritesDone) {
        self.balance();
        let Some(unlooked) = &mut self.unlooked else { return };
        *unlooked += u64::from(written == WritesDone::Sample);
        if written == WritesDone::Batch || *unlooked == 64 {
            *unlooked = 0;
            self.layers.iter_mut().for_each(TickLayer::look);
        }
    }

    /// Charges what follows to `phase`.
    pub const fn set_phase(&mut self, phase: Phase) {
        self.phase = phase;
    }

    /// A ledger.
    #[must_use]
    pub const fn ledger(&self, phase: Phase) -> &Ledger {
        &self.ledgers[phase as usize]
    }

    /// Levels of an array, row by row.
    #[must_use]
    pub fn levels(&self, layer: usize, array: usize) -> Vec<u16> {
        self.layers[layer].levels(array)
    }

    /// Which cells of an array are gone, row by row.
    #[must_use]
    pub fn pruned(&self, layer: usize, array: usize) -> Vec<bool> {
        self.layers[layer].pruned(array)
    }

    /// Remainders of an array, row by row.
    #[must_use]
    pub fn residuals(&self, layer: usize, array: usize) -> Vec<i64> {
        self.layers[layer].residuals(array)
    }

    /// Of each cell of an array, row by row: pulses that it was sent, what those left, and in which write.
    #[must_use]
    pub fn memories(&self, layer: usize, array: usize) -> Vec<(u32, u16, u64)> {
        self.layers[layer].memories(array)
    }

    /// What `rms` follows in a layer, and how often its factor was held.
    #[must_use]
    pub fn followed(&self, layer: usize) -> [i64; 2] {
        self.layers[layer].followed()
    }

    /// A word, 0 or 1, of an optimiser of every cell of an array, row by row.
    #[must_use]
    pub fn words(&self, layer: usize, array: usize, word: usize) -> Vec<i64> {
        self.layers[layer].words(array, word)
    }

    /// Mean drives of the rows of a set of drives, with 4 fractional bits; none where updates are not centred.
    #[must_use]
    pub fn row_means(&self, layer: usize, set: Stream) -> &[i64] {
        self.layers[layer].row_means(set)
    }

    /// Accumulator and activity of a unit of the last layer, of one of its target streams.
    #[must_use]
    pub fn output(&self, target: Stream, sample: usize, unit: usize) -> (i64, u8) {
        let last = self.layers.last().expect("a network has layers");
        last.outputs[target.index()][sample * last.columns + unit]
    }

    /// Row sums of the last transposed read, `[sample][inputs]`.
    #[must_use]
    pub fn backward(&self, layer: usize) -> &[i64] {
        &self.layers[layer].backward
    }

    /// Starts keeping what every layer, and every part of its tiles, did when.
    pub fn keep_spans(&mut self) {
        let tiles = self.layers.iter().map(|layer| layer.tiles.len());
        self.watch.keep_spans(tiles);
    }

    /// What was kept since the last call.
    pub fn take_spans(&mut self) -> Vec<Span> {
        self.watch.take_spans()
    }

    /// What parts were at since the last call, in no order.
    pub fn take_parts(&mut self) -> Vec<PartSpan> {
        self.watch.take_parts()
    }

    /// Shows a tile at the end of every cycle. Nothing happens when there is no such tile: see [`Network::grid`].
    pub fn watch_tile(&mut self, at: TileAt, look: impl FnMut(u64, &Tile) + 'static) {
        self.watch.tile(at, Box::new(look));
    }

    /// Pairs of banks (one a target stream), tiles down and tiles across of a layer.
    #[must_use]
    pub fn grid(&self, layer: usize) -> [usize; 3] {
        self.layers[layer].grid()
    }

    fn cycles(&mut self) -> &mut Cycles {
        self.ledgers[self.phase as usize].cycles_mut().expect("made with cycles")
    }

    /// A cycle of the whole chip begins.
    fn begin(&mut self, interval: Interval) {
        self.cycles().pass(interval, 1);
    }

    /// It has ended.
    fn end(&mut self) {
        self.clock += 1;
        self.watch.look(self.clock, &self.layers);
    }

    /// Plays what an engine has recorded.
    pub fn play_tape(&mut self, tape: &[Recorded]) {
        let between = |recorded: &Recorded| recorded.operation().is_none();
        for stretch in tape.split_inclusive(between) {
            let operations: Vec<_> = stretch.iter().filter_map(Recorded::operation).collect();
            self.run(&operations);
            match stretch.last() {
                Some(Recorded::Words { errors }) => _ = self.output_words(errors),
                Some(&Recorded::Written(written)) => self.written(written),
                _ => {}
            }
        }
    }

    /// Executes operations that follow one another without a pause.
    pub fn run(&mut self, operations: &[Operation<'_>]) {
        for segment in segment::cut(operations, self.samples, self.layers[0].sample_inputs()) {
            match segment {
                Segment::LoadDrives { codes } => {
                    self.samples = codes.len() / self.layers[0].sample_inputs();
                    let phase = self.phase as usize;
                    for layer in &mut self.layers {
                        layer.count_reads(self.phase, self.loaded[phase]);
                    }
                    self.loaded[phase] += self.samples as u64;
                    self.layers[0].load_inputs(codes);
                }
                Segment::LoadWeights { layer, array, row, levels } => {
                    let left = self.layers[layer].programmed(array, row, levels);
                    let code = self.layers[layer].load_row(array, row, &left);
                    self.layers[layer].count_loads(array, row);
                    let (during, count) = (During::LoadWeights, levels.len() as u64);
                    self.charge(layer, code, during, Event::CellLoads, count);
                    let others = self.layers[layer].copies() as u64 - 1;
                    self.charge(layer, code, during, Event::LoadsCopied, others * count);
                    for _ in 0..self.timing.beat {
                        self.begin(Interval::Load);
                        self.cycles().occupy(layer, During::LoadWeights, 1);
                        self.end();
                    }
                }
                Segment::Reads { layers, samples } => self.reads(layers, samples),
                Segment::Rounds(operations) => self.rounds(&operations),
                Segment::Writes(writes) => {
                    let order = |&(layer, shift): &(usize, u32)| Order {
                        layer,
                        command: Command::Write { shift },
                        during: During::Update,
                        words: &[],
                    };
                    let orders: Vec<_> = writes.iter().map(order).collect();
                    self.play(&orders, Interval::Program);
                    for order in orders {
                        let bits = self.layers[order.layer].mean_bits();
                        let counts = self.layers[order.layer].mean_counts();
                        for (code, count) in counts {
                            let charged =
                                [(Event::RowMeans, count), (Event::SramBits, bits * count)];
                            for (event, count) in charged {
                                self.charge(order.layer, code, During::Update, event, count);
                            }
                        }
                        self.layers[order.layer].written();
                    }
                }
            }
        }
    }

    fn charge(&mut self, layer: usize, code: u8, during: During, event: Event, count: u64) {
        self.ledgers[self.phase as usize].add(layer, code, during, event, count);
    }

    /// ERR, FWD(columns), UPD(add), UPD(now), sample by sample.
    fn rounds(&mut self, operations: &[&Operation<'_>]) {
        let range = |operation: &Operation<'_>| match operation {
            Operation::Error { samples, .. } | Operation::Update { samples, .. } => samples.clone(),
            _ => 0..self.samples,
        };
        let ranges: Vec<Range<usize>> = operations.iter().map(|o| range(o)).collect();
        let end = ranges.iter().map(|range| range.end).max().unwrap_or(0);
        for sample in 0..end {
            let here = operations.iter().zip(&ranges).filter(|(_, range)| range.contains(&sample));
            let mut orders: Vec<(Order<'_>, Interval, bool)> = Vec::new();
            for (operation, range) in here {
                let order = self.order(operation, range, sample);
                let (_, interval, apart) = order;
                let same = orders.last().is_some_and(|last| last.1 == interval);
                let again = orders.iter().any(|other| other.0.layer == order.0.layer);
                if !orders.is_empty() && (!same || again || apart) {
                    self.play_in_round(&orders, sample);
                    orders.clear();
                }
                orders.push(order);
            }
            if !orders.is_empty() {
                self.play_in_round(&orders, sample);
            }
        }
    }

    /// The command of an operation for one sample; true when nothing runs beside what came before.
    fn order<'a>(
        &self,
        operation: &Operation<'a>,
        range: &Range<usize>,
        sample: usize,
    ) -> (Order<'a>, Interval, bool) {
        let slot = sample;
        match *operation {
            Operation::Error { layer, words, shared, .. } => {
                let width = self.layers[layer].delivery.output_words();
                let words = &words[(sample - range.start) * width..][..width];
                let command = Command::Error { slot };
                (Order { layer, command, during: During::Error, words }, Interval::Error, !shared)
            }
            Operation::Forward { layer, side: Side::Columns } => {
                let command = Command::Columns { slot };
                let during = During::ForwardColumns;
                (Order { layer, command, during, words: &[] }, Interval::Columns, true)
            }
            Operation::Update { layer, write, shift, .. } => {
                let (command, interval) = match write {
                    Write::Now => (Command::Now { slot, shift }, Interval::Program),
                    _ => (Command::Add { slot }, Interval::Accumulate),
                };
                (Order { layer, command, during: During::Update, words: &[] }, interval, false)
            }
            _ => unreachable!("only operations of a round"),
        }
    }

    fn play_in_round(&mut self, orders: &[(Order<'_>, Interval, bool)], sample: usize) {
        let interval = orders[0].1;
        if let Command::Columns { .. } = orders[0].0.command {
            return self.columns(orders[0].0.layer, sample);
        }
        let formed: Vec<Vec<i16>> =
            orders.iter().map(|(order, ..)| self.layer_words(order, sample)).collect();
        let plain = orders.iter().zip(&formed);
        let plain: Vec<_> = plain.map(|((order, ..), words)| Order { words, ..*order }).collect();
        self.play(&plain, interval);
        for order in &plain {
            let layer = &mut self.layers[order.layer];
            match order.command {
                Command::Error { slot } => layer.share_gates(slot),
                Command::Now { .. } => layer.written(),
                _ => {}
            }
        }
    }

    /// Commands of different layers, accepted together; until the last of them is done.
    fn play(&mut self, orders: &[Order<'_>], interval: Interval) {
        let start = self.clock;
        for offered in 1..=self.timing.beat {
            self.begin(interval);
            for order in orders {
                let given = (offered == self.timing.beat).then_some(order.command);
                let layer = &mut self.layers[order.layer];
                assert!(layer.ready(&order.command), "segments begin on idle tiles");
                layer.cycle(given.as_ref(), order.words);
                self.cycles().occupy(order.layer, order.during, 1);
            }
            self.end();
        }
        let mut ends = vec![None; orders.len()];
        while orders.iter().any(|order| !self.layers[order.layer].idle()) {
            self.begin(interval);
            for order in orders {
                self.account(order.layer, order.during, false);
                self.layers[order.layer].cycle(None, order.words);
            }
            self.end();
            for (order, end) in orders.iter().zip(&mut ends) {
                if end.is_none() && self.layers[order.layer].idle() {
                    *end = Some(self.clock);
                }
            }
        }
        for (order, end) in orders.iter().zip(ends) {
            let (name, sample) = order.command.name();
            let end = end.unwrap_or(self.clock);
            self.watch.span(Span { layer: Some(order.layer), name, sample, start, end });
        }
        for order in orders {
            let now = matches!(order.command, Command::Now { .. });
            self.take_events(order.layer, order.during, now);
        }
    }

    /// Notes what a layer and its parts do in the cycle that begins.
    fn account(&mut self, layer: usize, during: During, offered: bool) {
        let at_work = self.layers[layer].at_work();
        self.watch.parts(self.clock, layer, &self.layers[layer]);
        let busy = offered || self.layers[layer].busy(during);
        let cycles = self.cycles();
        if busy {
            cycles.occupy(layer, during, 1);
        }
        for (part, count) in Part::ALL.into_iter().zip(at_work) {
            cycles.engage(layer, part, count);
        }
    }

    /// Moves what tiles have counted into the ledger.
    fn take_events(&mut self, layer: usize, during: During, now: bool) {
        let taken = self.layers[layer].take_events();
        for (plane, (target, banks, events)) in taken.into_iter().enumerate() {
            let codes = self.layers[layer].codes(plane);
            for (code, e) in codes.into_iter().zip(banks) {
                for (event, count) in self.bank_counts(layer, &e, during, now) {
                    self.charge(layer, code, during, event, count);
                }
            }
            let code = self.layers[layer].unit_code(target);
            for (event, count) in self.counts(&events) {
                self.charge(layer, code, during, event, count);
            }
            if target == Stream::P {
                self.charge(layer, code, during, Event::SaturatedErrors, events.saturated_errors);
            }
        }
    }

    fn bank_counts(
        &self,
        layer: usize,
        e: &BankEvents,
        during: During,
        now: bool,
    ) -> Vec<(Event, u64)> {
        let hardware = self.layers[layer].memory;
        let updating = during == During::Update;
        // a product of its own is written as it is formed
        let alone = now && self.layers[layer].products() == 1;
        let sums = if updating && !alone { 64 * (e.accumulates + e.delta_computations) } else { 0 };
        let rests = 2 * hardware.residual_bits * e.delta_computations;
        let words = 2 * hardware.word_bits * e.optimiser_steps;
        let looked = 32 * e.sum_squares;
        // every slice that is driven comes out of a memory, of codes or of gates
        let drives = hardware.dac_bits * e.dac_slices;
        vec![
            (Event::DacSlices, e.dac_slices),
            (Event::CellReads, e.cell_reads),
            (Event::Holds, e.holds),
            (Event::Conversions, e.conversions),
            (Event::ShiftAdds, e.shift_adds),
            (Event::Accumulates, e.accumulates),
            (Event::DeltaComputations, e.delta_computations),
            (Event::Requested, e.requested),
            (Event::Bounded, e.bounded),
            (Event::PulsesAttempted, e.pulses_attempted),
            (Event::PulsesEffective, e.pulses_effective),
            (Event::PulsesCopied, e.pulses_copied),
            (Event::SaturatedConversions, e.saturated_conversions),
            (Event::VerifyReads, e.verify_reads),
            (Event::SumSquares, e.sum_squares),
            (Event::OptimiserSteps, e.optimiser_steps),
            (Event::SramBits, drives + sums + rests + looked + words),
        ]
    }

    fn counts(&self, e: &TileEvents) -> [(Event, u64); 9] {
        [
            (Event::LookUps, e.look_ups),
            (Event::SaturatedLookUps, e.saturated_look_ups),
            (Event::BusWords, e.bus_words),
            (Event::Multiplies, e.multiplies),
            (Event::SaturatedGates, e.saturated_gates),
            (Event::RowPulses, e.row_pulses),
            (Event::ThresholdSubtractions, e.threshold_subtractions),
            (Event::StatisticAdds, e.statistic_adds),
            (Event::SramBits, 32 * e.look_ups + 8 * e.multiplies),
        ]
    }
}

#[cfg(test)]
mod tests;
