//! How long operations take, in closed form.
//!
//! What a chip does at the same time is fixed by rules, not by data; only how often a row is pulsed depends on
//! numbers. Operations in the order they are issued form *segments*, and segments follow one another:
//!
//! ```text
//! reads      FWD(rows) of successive layers, in a pipeline of layers and samples
//!                sum_l (1 + T_fwd(l)) + (B - 1) max_l (1 + again(l))
//!            a convolution is read in G = ceil(P / copies) turns a sample, back to back, in each at as many of its P
//!            positions as its array has copies:  1 + T_fwd + (G - 1) (1 + again), and G (1 + again);
//!            from its columns, in rounds, likewise; gates and sums are formed position by position beside the first copy
//!            a normalised layer is followed by a digital stage of its own, of 2 NG + 32 beats in both sums; one with a
//!            pool by one of NG beats a position that the pool puts out
//! rounds     ERR, FWD(columns), UPD(add), UPD(now), sample by sample in the order of the list; in a round a run of
//!            ERR with the same words is heard by all their layers at once, and a run of UPD on different layers
//!            goes side by side:  sum_b ( 1 + T_err + ... + 1 + max_l T_upd(l, b) ); words that the error unit forms for
//!            a layer are formed before its ERR, while nothing else happens
//! writes     UPD(write) on different layers side by side:  1 + max_l T_write(l)
//! loads      LOADW, a row a cycle
//! moves      of thresholds and steps after the writes, side by side:  max_l beat NG(l)
//! ```
//!
//! Where a later operation would see what an earlier one of another sample has still to do (a second UPD(now) of a
//! sample, a read from columns beside writes), a segment ends. Input drives are loaded while the chip works and take
//! no time of their own. `Tick` is the cycle-by-cycle twin. See docs/MODEL.md, 4.5.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use std::ops::Range;

use super::Write;
use crate::chip::hardware::timing::{Timing, tree_levels};
use crate::chip::hardware::{Hardware, ReadTime};
use crate::chip::layer::{Layer, Pool};
use crate::chip::ledger::{Cycles, During, Interval, Part};
use crate::chip::population::Stream;
use crate::num::tables::Activation;

/// A layer as time sees it.
#[derive(Debug, Clone, Copy)]
struct Shape {
    /// Greatest rows and columns of a tile.
    rows: u64,
    columns: u64,
    /// Levels of the trees over row tiles and over column tiles.
    levels: [u64; 2],
    /// Tiles.
    tiles: u64,
    /// Words on the bus, of a sample.
    words: u64,
    /// Cycles in which the error unit forms the words of a sample.
    form: u64,
    /// Reads of a sample, and turns in which its copies take them.
    positions: u64,
    turns: u64,
    /// Times that rows are driven for a read.
    phases: u64,
    /// Cycles of the stage behind it, which normalises or pools a sample and which no command begins; 0 where there is none.
    stage: u64,
}

impl Shape {
    /// Products of a sample.
    const fn drivings(self) -> u64 {
        self.positions * self.phases
    }
}

/// Layers whose commands of one kind run at the same time.
#[derive(Debug, Clone, Copy, Default)]
struct Run {
    layers: u64,
    longest: u64,
}

impl Run {
    const fn has(self, layer: usize) -> bool {
        self.layers >> layer & 1 == 1
    }

    fn join(&mut self, layer: usize, cycles: u64) {
        self.layers |= 1 << layer;
        self.longest = self.longest.max(cycles);
    }
}

/// What the samples of a round wait for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Doing {
    Nothing,
    Hearing,
    Adding,
    Writing,
}

#[derive(Debug, Clone, Copy)]
struct Round {
    doing: Doing,
    run: Run,
    passed: [u64; Interval::ALL.len()],
}

impl Round {
    const NEW: Self = Self {
        doing: Doing::Nothing,
        run: Run { layers: 0, longest: 0 },
        passed: [0; Interval::ALL.len()],
    };

    /// Ends the run in progress.
    fn close(&mut self) {
        let interval = match self.doing {
            Doing::Nothing => return,
            Doing::Hearing => Interval::Error,
            Doing::Adding => Interval::Accumulate,
            Doing::Writing => Interval::Program,
        };
        self.passed[interval as usize] += self.run.longest;
        self.doing = Doing::Nothing;
        self.run = Run::default();
    }

    fn join(&mut self, doing: Doing, layer: usize, cycles: u64, apart: bool) {
        if apart || self.doing != doing || self.run.has(layer) {
            self.close();
            self.doing = doing;
        }
        self.run.join(layer, cycles);
    }
}

/// Makes a run of rounds begin at a sample; its place. Samples are at most as many as there are rounds.
fn split(rounds: &mut Vec<(usize, Round)>, sample: usize) -> usize {
    let mut start = 0;
    for at in 0..rounds.len() {
        let (count, round) = rounds[at];
        if sample == start {
            return at;
        }
        if sample < start + count {
            rounds[at].0 = sample - start;
            rounds.insert(at + 1, (start + count - sample, round));
            return at + 1;
        }
        start += count;
    }
    rounds.len()
}

#[derive(Debug, Clone)]
enum Segment {
    Nothing,
    Reads {
        next: usize,
        samples: u64,
        latency: u64,
        again: u64,
    },
    Rounds {
        /// Neighbouring samples whose rounds are alike: how many, and the round of each.
        rounds: Vec<(usize, Round)>,
        /// Whether something was read from its columns.
        columns: bool,
        /// By layer: samples written so far lie below; and the last one of any layer.
        written: Vec<usize>,
        last: usize,
    },
    Writes(Run),
}

/// The schedule of a network.
#[derive(Debug, Clone)]
pub(super) struct Schedule {
    timing: Timing,
    reads: ReadTime,
    shapes: Vec<Shape>,
    segment: Segment,
}

impl Schedule {
    pub(super) fn new(hardware: &Hardware, timing: Timing, layers: &[Layer]) -> Self {
        let shape = |layer: &Layer| {
            let [down, across] = layer.tiles(hardware).map(|n| n as u64);
            // the pairs of a target are added by the same tree
            let pairs = layer.spec.wiring.pairs(Stream::P).len() as u64;
            let columns = layer.layout.columns.min(hardware.tile.columns) as u64;
            let normalised = layer.spec.activation == Activation::Rms;
            let pooled = layer.spec.pooled().into_iter().product::<usize>() as u64;
            let planes = layer.spec.wiring.planes().count() as u64;
            Shape {
                rows: layer.layout.rows.min(hardware.tile.rows) as u64,
                columns,
                levels: [tree_levels(down * pairs), tree_levels(across)],
                tiles: planes * down * across,
                words: (layer.delivery.taps.width * layer.heard()) as u64,
                form: timing.form(layer.delivery.terms() as u64),
                positions: layer.spec.positions() as u64,
                turns: layer.spec.turns() as u64,
                phases: layer.spec.driven_by.phases() as u64,
                stage: match layer.spec.pool {
                    Pool::None if normalised => timing.normalise(columns),
                    Pool::None => 0,
                    _ => timing.pool(columns, pooled),
                },
            }
        };
        Self {
            timing,
            reads: ReadTime::new(hardware, timing),
            shapes: layers.iter().map(shape).collect(),
            segment: Segment::Nothing,
        }
    }

    /// `LOADW` of one row.
    pub(super) fn load(&mut self, cycles: &mut Cycles, layer: usize) {
        self.settle(cycles);
        cycles.pass(Interval::Load, self.timing.accept());
        cycles.occupy(layer, During::LoadWeights, self.timing.accept());
    }

    /// `FWD(rows)` of all samples of a layer.
    pub(super) fn read(&mut self, cycles: &mut Cycles, layer: usize, samples: usize) {
        if samples == 0 {
            return;
        }
        let (t, shape) = (self.timing, self.shapes[layer]);
        let joins = matches!(self.segment, Segment::Reads { next, .. } if next == layer);
        if !joins {
            self.settle(cycles);
            self.segment = Segment::Reads { next: layer, samples: 0, latency: 0, again: 0 };
        }
        let front = t.accept() + self.reads.again(shape.phases, shape.columns);
        let one = t.accept() + self.reads.read(shape.phases, shape.columns, shape.levels[0]);
        let one = one + (shape.turns - 1) * front;
        if let Segment::Reads { next, samples: count, latency, again } = &mut self.segment {
            *next = layer + 1;
            *count = samples as u64;
            *latency += one + shape.stage;
            *again = (*again).max(shape.turns * front).max(shape.stage);
        }
        let count = samples as u64 * shape.turns;
        cycles.occupy(layer, During::ForwardRows, count * front);
        self.engage_read(cycles, layer, [count, shape.phases], shape.columns, shape.levels[0]);
    }

    /// So many reads, each of which goes through all slices so many times.
    fn engage_read(
        &self,
        cycles: &mut Cycles,
        layer: usize,
        [reads, times]: [u64; 2],
        lines: u64,
        levels: u64,
    ) {
        let t = self.timing;
        cycles.engage(layer, Part::Arrays, reads * times * self.reads.arrays);
        cycles.engage(layer, Part::Converters, reads * times * self.reads.converters);
        cycles.engage(layer, Part::Tree, reads * t.beat * levels);
        cycles.engage(layer, Part::Lanes, reads * t.beat * t.groups(lines));
    }

    /// The error unit looks so many entries up, one a beat.
    pub(super) fn look_up_outputs(&mut self, cycles: &mut Cycles, look_ups: u64) {
        self.settle(cycles);
        cycles.pass(Interval::Centre, self.timing.beat * look_ups);
    }

    /// The error unit takes the mean over a batch.
    pub(super) fn centre(&mut self, cycles: &mut Cycles, samples: usize, words: usize) {
        self.settle(cycles);
        cycles.pass(Interval::Centre, self.timing.centre(samples as u64, words as u64));
    }

    /// The rounds in progress, or new ones.
    fn rounds(
        &mut self,
        cycles: &mut Cycles,
        samples: &Range<usize>,
    ) -> impl Iterator<Item = &mut Round> {
        if !matches!(self.segment, Segment::Rounds { .. }) {
            self.settle(cycles);
            let written = vec![0; self.shapes.len()];
            self.segment = Segment::Rounds { rounds: vec![], columns: false, written, last: 0 };
        }
        let Segment::Rounds { rounds, .. } = &mut self.segment else {
            unreachable!("just made");
        };
        let there: usize = rounds.iter().map(|(count, _)| count).sum();
        if there < samples.end {
            rounds.push((samples.end - there, Round::NEW));
        }
        let first = split(rounds, samples.start);
        let end = split(rounds, samples.end);
        rounds[first..end].iter_mut().map(|(_, round)| round)
    }

    /// `ERR`; `shared`: its words are those of the one before.
    pub(super) fn error(
        &mut self,
        cycles: &mut Cycles,
        layer: usize,
        samples: &Range<usize>,
        shared: bool,
    ) {
        if samples.is_empty() {
            return;
        }
        let (t, shape) = (self.timing, self.shapes[layer]);
        let one = t.accept() + t.error(shape.words, shape.columns, shape.positions);
        for round in self.rounds(cycles, samples) {
            if shape.form > 0 {
                round.close();
                round.passed[Interval::Error as usize] += shape.form;
            }
            round.join(Doing::Hearing, layer, one, !shared);
        }
        let count = samples.len() as u64;
        cycles.occupy(layer, During::Error, count * one);
        cycles.engage(layer, Part::Bus, count * t.beat * shape.words);
        let gates = count * shape.positions;
        cycles.engage(layer, Part::Multipliers, gates * t.beat * t.groups(shape.columns));
    }

    /// `FWD(columns)` of all samples: both phases, with all slices.
    pub(super) fn columns(&mut self, cycles: &mut Cycles, layer: usize, samples: usize) {
        if samples == 0 {
            return;
        }
        if matches!(&self.segment, Segment::Rounds { written, .. } if written.iter().any(|&w| w > 0))
        {
            self.settle(cycles);
        }
        let (t, shape) = (self.timing, self.shapes[layer]);
        let front = t.accept() + self.reads.again(2, shape.rows);
        let one = t.accept() + self.reads.read(2, shape.rows, shape.levels[1]);
        let one = one + (shape.turns - 1) * front;
        for round in self.rounds(cycles, &(0..samples)) {
            round.close();
            round.passed[Interval::Columns as usize] += one;
        }
        if let Segment::Rounds { columns, .. } = &mut self.segment {
            *columns = true;
        }
        let count = samples as u64 * shape.turns;
        cycles.occupy(layer, During::ForwardColumns, count * front);
        self.engage_read(cycles, layer, [count, 2], shape.rows, shape.levels[1]);
    }

    /// `UPD(add)`.
    pub(super) fn add(&mut self, cycles: &mut Cycles, layer: usize, samples: &Range<usize>) {
        if samples.is_empty() {
            return;
        }
        let (t, shape) = (self.timing, self.shapes[layer]);
        if matches!(&self.segment, Segment::Rounds { written, .. } if samples.start < written[layer])
        {
            self.settle(cycles);
        }
        let busy = shape.drivings() * t.accumulate(shape.rows, shape.columns);
        for round in self.rounds(cycles, samples) {
            round.join(Doing::Adding, layer, t.accept() + busy, false);
        }
        let count = samples.len() as u64;
        cycles.occupy(layer, During::Update, count * (t.accept() + busy));
        cycles.engage(layer, Part::Accumulators, count * busy);
    }

    /// `UPD(now)` of a sample or `UPD(write)`, whose slowest tile takes `busy` cycles; `looks`: after all sums of the layer
    /// were looked at.
    pub(super) fn program(
        &mut self,
        cycles: &mut Cycles,
        layer: usize,
        write: Write,
        samples: &Range<usize>,
        (looks, busy): (bool, u64),
    ) {
        let (t, shape) = (self.timing, self.shapes[layer]);
        let mut one = t.accept() + busy;
        if looks {
            one += t.look(shape.rows, shape.columns, shape.tiles);
            let squared = t.accumulate(shape.rows, shape.columns);
            cycles.engage(layer, Part::Accumulators, squared);
        }
        if write == Write::Now && shape.drivings() > 1 {
            // more products than one are added up before anything is written
            let added = shape.drivings() * t.accumulate(shape.rows, shape.columns);
            cycles.engage(layer, Part::Accumulators, added);
            one += added;
        }
        cycles.occupy(layer, During::Update, one);
        cycles.engage(layer, Part::Writers, busy);
        if write == Write::Program {
            if !matches!(&self.segment, Segment::Writes(run) if !run.has(layer)) {
                self.settle(cycles);
                self.segment = Segment::Writes(Run::default());
            }
            if let Segment::Writes(run) = &mut self.segment {
                run.join(layer, one);
            }
            return;
        }
        let sample = samples.start;
        let ends = |segment: &Segment| match segment {
            Segment::Rounds { columns, written, last, .. } => {
                *columns || sample < written[layer] || sample < *last
            }
            _ => false,
        };
        if ends(&self.segment) {
            self.settle(cycles);
        }
        for round in self.rounds(cycles, samples) {
            round.join(Doing::Writing, layer, one, false);
        }
        if let Segment::Rounds { written, last, .. } = &mut self.segment {
            written[layer] = sample + 1;
            *last = sample;
        }
    }

    /// Thresholds and steps of these layers move, after the writes.
    pub(super) fn balance(&mut self, cycles: &mut Cycles, layers: &[usize]) {
        self.settle(cycles);
        let mut longest = 0;
        for &layer in layers {
            let one = self.timing.beat * self.timing.groups(self.shapes[layer].columns);
            cycles.occupy(layer, During::Update, one);
            cycles.engage(layer, Part::Lanes, one);
            longest = longest.max(one);
        }
        cycles.pass(Interval::Program, longest);
    }

    /// Ends the segment in progress: its time has passed.
    pub(super) fn settle(&mut self, cycles: &mut Cycles) {
        match std::mem::replace(&mut self.segment, Segment::Nothing) {
            Segment::Nothing => {}
            Segment::Reads { samples, latency, again, .. } => {
                cycles.pass(Interval::Forward, latency + (samples - 1) * again);
            }
            Segment::Rounds { rounds, .. } => {
                for (count, mut round) in rounds {
                    round.close();
                    for (interval, passed) in Interval::ALL.into_iter().zip(round.passed) {
                        cycles.pass(interval, passed * count as u64);
                    }
                }
            }
            Segment::Writes(run) => cycles.pass(Interval::Program, run.longest),
        }
    }
}
