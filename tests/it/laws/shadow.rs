//! A second chip beside the engine: plain `i64`, rows of rows, one cell after the other, nothing skipped.
//!
//! It shares with the engine the names of wirings and events, the activation tables and the random words, and
//! no arithmetic: rounding, sums, converters, gates, pulses and counts are written again from the specification.

use std::ops::Range;

use dalean::chip::device::Reference;
use dalean::chip::engine::{Calibration, Phase};
use dalean::chip::hardware::{Adc, AdcRange, Subtract};
use dalean::chip::layer::{self, Delivery, DrivenBy, LayerSpec};
use dalean::chip::ledger::{During, Event, Ledger};
use dalean::chip::population::{Polarity, Stream};
use dalean::learn::error::Centre;
use dalean::num::tables::{Activation, Lut, half_gaussian};

use super::choose::Net;
use super::fault::Fault;

mod currents;
mod flaws;
mod unit;
mod write;

/// `(v + 2^(s-1)) >> s`, in numbers so wide that nothing can wrap.
pub(crate) fn rsh(v: i64, s: u32) -> i64 {
    if s == 0 {
        return v;
    }
    let unit = 1i128 << s;
    i64::try_from((i128::from(v) + unit / 2).div_euclid(unit)).unwrap()
}

/// The symmetric range of `bits`, and whether it changed the value.
pub(crate) fn sat(v: i64, bits: u32) -> (i64, bool) {
    let rail = 2i64.pow(bits - 1) - 1;
    (v.clamp(-rail, rail), v.abs() > rail)
}

/// Rows of numbers.
pub(crate) type Table = Vec<Vec<i64>>;

/// One array: `[row][column]`.
#[derive(Debug, Clone)]
pub(crate) struct Array {
    /// Levels of cells that hold theirs.
    stuck: Vec<Vec<Option<i64>>>,
    pub(crate) level: Table,
    pub(crate) residual: Table,
    pub(crate) pruned: Vec<Vec<bool>>,
    pub(crate) writes: u64,
    /// The tile's digital accumulators.
    sums: Table,
}

/// One layer. What belongs to a stream is `[stream][sample][row or column]`.
#[derive(Debug, Clone)]
pub(crate) struct Side {
    pub(crate) spec: LayerSpec,
    delivery: Delivery,
    lut: Lut,
    rows: usize,
    pub(crate) arrays: Vec<Array>,
    pub(crate) adc_shifts: Vec<Vec<u32>>,
    /// Codes on the rail and all codes since ranges were looked at.
    pub(crate) rails: Vec<Vec<[u64; 2]>>,
    drives: [Table; 2],
    pub(crate) accumulators: [Table; 2],
    pub(crate) activity: [Table; 2],
    derivative: [Table; 2],
    gates: [Table; 2],
    pub(crate) backward: Vec<i64>,
    /// What cells let through, by array, as it was looked at last.
    through: Vec<currents::Through>,
}

/// The network, all its registers and what happened so far.
#[derive(Debug, Clone)]
pub(crate) struct Shadow {
    pub(crate) net: Net,
    fault: Option<Fault>,
    pub(crate) layers: Vec<Side>,
    samples: usize,
    /// Samples loaded so far, by phase.
    pub(crate) loaded: [u64; 3],
    /// Phase of the loaded samples, and samples of it before them.
    came: (Phase, u64),
    /// An absolute Gaussian.
    half_gaussian: Vec<u16>,
    /// Running means of the error unit.
    pub(crate) means: Vec<i64>,
    /// Samples written one by one since ranges were looked at.
    unlooked: u32,
    phase: Phase,
    pub(crate) ledgers: [Ledger; 3],
}

fn table(rows: usize, columns: usize, value: i64) -> Table {
    vec![vec![value; columns]; rows]
}

impl Shadow {
    pub(crate) fn new(net: &Net, fault: Option<Fault>) -> Self {
        let hw = &net.hardware;
        let floor = i64::from(hw.cell.window.floor());
        let layers = net.specs.iter().zip(&net.deliveries).enumerate();
        let layers = layers.map(|(at, (spec, delivery))| {
            let rows = spec.inputs + usize::from(spec.constant_row);
            let array = Array {
                stuck: vec![vec![None; spec.units]; rows],
                level: table(rows, spec.units, floor),
                residual: table(rows, spec.units, 0),
                pruned: vec![vec![false; spec.units]; rows],
                writes: 0,
                sums: table(rows, spec.units, 0),
            };
            let shifts = match hw.adc {
                Adc::Ideal => vec![],
                Adc::Finite { bits, subtract, range } => {
                    let slice = (1i64 << hw.drive.dac_bits.min(hw.drive.bits.get())) - 1;
                    let tallest = rows.min(hw.tile.rows) as i64;
                    let kept = hw.conductance.filter(|of| of.reference == Reference::None);
                    let least = kept.map_or(0, |of| i64::from(of.least));
                    let cell = 256 * i64::from(hw.cell.window.ceiling()) + least;
                    let worst = rsh(tallest * cell * slice, 8);
                    let sign = u32::from(subtract == Subtract::Current);
                    let rail = (1i64 << (bits.get() - sign)) - 1;
                    let shift = match range {
                        AdcRange::Shift(shift) => shift,
                        AdcRange::Tracking => net.tracks_from,
                        _ => (0..60).find(|&s| rsh(worst, s) <= rail).unwrap(),
                    };
                    let slices = hw.drive.bits.get().div_ceil(hw.drive.dac_bits) as usize;
                    vec![vec![shift; slices]; spec.wiring.targets().len()]
                }
                other => panic!("the shadow knows no {other:?}"),
            };
            let tracks = matches!(hw.adc, Adc::Finite { range: AdcRange::Tracking, .. });
            let rails = shifts.iter().filter(|_| tracks).map(|s: &Vec<u32>| vec![[0; 2]; s.len()]);
            let mut arrays = vec![array; spec.wiring.pathways().len()];
            for (array, pathway) in arrays.iter_mut().zip(spec.wiring.pathways()) {
                array.stick(net, at, pathway.code);
            }
            Side {
                rails: rails.collect(),
                spec: spec.clone(),
                delivery: delivery.clone(),
                lut: Lut::new(spec.activation, hw.digital.lut_bits, layer::unit(spec, hw)),
                rows,
                arrays,
                adc_shifts: shifts,
                drives: Default::default(),
                accumulators: Default::default(),
                activity: Default::default(),
                derivative: Default::default(),
                gates: Default::default(),
                backward: vec![],
                through: vec![],
            }
        });
        let ledger = Ledger::new(net.specs.len());
        let outputs = net.specs.last().unwrap().units;
        Self {
            net: net.clone(),
            fault,
            layers: layers.collect(),
            samples: 0,
            loaded: [0; 3],
            came: (Phase::Training, 0),
            half_gaussian: half_gaussian(),
            unlooked: 0,
            means: if net.centre == Centre::Running { vec![0; outputs] } else { vec![] },
            phase: Phase::Training,
            ledgers: [ledger.clone(), ledger.clone(), ledger],
        }
    }

    fn is(&self, fault: Fault) -> bool {
        self.fault == Some(fault)
    }

    fn count(&mut self, layer: usize, code: u8, during: During, event: Event, count: u64) {
        self.ledgers[self.phase as usize].add(layer, code, during, event, count);
    }

    fn code(&self, layer: usize, array: usize) -> u8 {
        self.layers[layer].spec.wiring.pathways()[array].code
    }

    /// Units are counted at their excitatory bank.
    fn unit_code(&self, layer: usize, target: Stream) -> u8 {
        self.code(layer, self.layers[layer].spec.wiring.banks(target)[0])
    }

    pub(crate) fn charge_to(&mut self, phase: Phase) {
        self.phase = phase;
    }

    pub(crate) fn load_weights(&mut self, layer: usize, array: usize, row: usize, levels: &[u16]) {
        let levels = &self.left(layer, array, row, levels);
        let moves = self.is(Fault::StuckCellIsLoaded);
        let Array { level, stuck, .. } = &mut self.layers[layer].arrays[array];
        for ((cell, stuck), &loaded) in level[row].iter_mut().zip(&stuck[row]).zip(levels) {
            *cell = stuck.filter(|_| !moves).unwrap_or(i64::from(loaded));
        }
        let (code, cells) = (self.code(layer, array), levels.len() as u64);
        self.count(layer, code, During::LoadWeights, Event::CellLoads, cells);
    }

    fn with_constant(&self, layer: usize, mut row: Vec<i64>) -> Vec<i64> {
        if self.layers[layer].spec.constant_row {
            let dark = self.is(Fault::ConstantRowDark);
            row.push(if dark { 0 } else { (1 << self.net.hardware.drive.bits.get()) - 1 });
        }
        row
    }

    /// Times that rows are driven for a read: numbers with a sign are told above 0, then below.
    pub(crate) fn phases(&self, layer: usize) -> u64 {
        if self.layers[layer].spec.driven_by == DrivenBy::Signed { 2 } else { 1 }
    }

    pub(crate) fn load_drives(&mut self, codes: &[u8]) {
        let inputs = self.layers[0].spec.inputs;
        let number = |row: &[u8], at: usize| match row.get(inputs + at) {
            Some(&below) => i64::from(row[at]) - i64::from(below),
            None => i64::from(row[at]),
        };
        let rows = codes.chunks_exact(inputs * self.phases(0) as usize);
        let rows: Table = rows.map(|row| (0..inputs).map(|at| number(row, at)).collect()).collect();
        self.samples = rows.len();
        self.came = (self.phase, self.loaded[self.phase as usize]);
        self.loaded[self.phase as usize] += rows.len() as u64;
        let rows: Table = rows.into_iter().map(|row| self.with_constant(0, row)).collect();
        self.layers[0].drives = [rows.clone(), rows];
    }

    /// Rows of each tile of a column, from the top.
    fn row_tiles(&self, layer: usize) -> Vec<Range<usize>> {
        let (rows, step) = (self.layers[layer].rows, self.net.hardware.tile.rows);
        (0..rows.div_ceil(step)).map(|t| t * step..rows.min((t + 1) * step)).collect()
    }

    /// Reads a layer and drives the next one.
    pub(crate) fn forward(&mut self, layer: usize) {
        for &target in self.layers[layer].spec.wiring.targets() {
            self.read(layer, target, false);
        }
        self.count_read(layer);
        self.pass_on(layer);
    }

    /// Currents of both banks in one column, one tile and one slice.
    fn current(
        &self,
        layer: usize,
        bank: usize,
        at: [usize; 2],
        rows: Range<usize>,
        (phase, s): (u64, u32),
    ) -> i64 {
        let this = &self.layers[layer];
        let [sample, column] = at;
        let source = this.spec.wiring.pathways()[bank].source;
        let drives = &this.drives[source.index()][sample];
        let mask = (1i64 << self.net.hardware.drive.dac_bits) - 1;
        let whole = self.is_whole();
        let mut rows = rows;
        if self.is(Fault::TileEdgeLost) && rows.end < this.rows {
            rows.end -= 1;
        }
        let part = |row: usize| {
            let code = if phase == 0 { drives[row].max(0) } else { (-drives[row]).max(0) };
            let slice = (code >> (s * self.net.hardware.drive.dac_bits)) & mask;
            if whole { code } else { slice }
        };
        if self.conducts() {
            return self.let_through((layer, bank), column, rows, part);
        }
        rows.map(|row| this.arrays[bank].level[row][column] * part(row)).sum()
    }

    /// Whether all rows may be driven at once by whole codes.
    fn is_whole(&self) -> bool {
        let hw = &self.net.hardware;
        hw.adc == Adc::Ideal && hw.read_noise.is_none() && !self.conducts()
    }

    /// Reads one target stream. Returns the currents every converter saw, by slice, when `probe` reads with
    /// ideal converters.
    fn read(&mut self, layer: usize, target: Stream, probe: bool) -> Vec<Vec<i64>> {
        self.look_through(layer);
        let hw = self.net.hardware.clone();
        let (units, t) = (self.layers[layer].spec.units, target.index());
        let pairs = self.layers[layer].spec.wiring.pairs(target);
        let (tiles, phases) = (self.row_tiles(layer), self.phases(layer));
        let slices =
            if self.is_whole() { 1 } else { hw.drive.bits.get().div_ceil(hw.drive.dac_bits) };
        let mut seen = vec![vec![]; slices as usize];
        let (mut accumulators, mut saturated, mut look_ups) =
            (vec![], vec![[0; 2]; pairs.len()], 0);
        let mut rails = vec![[0; 2]; slices as usize];
        for sample in 0..self.samples {
            let mut row = vec![];
            for column in 0..units {
                let mut acc = 0;
                let reads = tiles.iter().enumerate();
                let reads = reads.flat_map(|tile| (0..slices).map(move |s| (tile, s)));
                let reads = reads.flat_map(|read| (0..pairs.len()).map(move |pair| (read, pair)));
                let reads = reads.flat_map(|read| (0..phases).map(move |phase| (read, phase)));
                for ((((number, tile), s), pair), phase) in reads {
                    let (at, banks, saturated) =
                        ([sample, column], pairs[pair], &mut saturated[pair]);
                    let driven = (phase, s);
                    let [e, i] = [0, 1].map(|which| {
                        let current = self.current(layer, banks[which], at, tile.clone(), driven);
                        let once =
                            matches!(hw.adc, Adc::Finite { subtract: Subtract::Current, .. });
                        if once && which == 1 {
                            return current;
                        }
                        let code = self.code(layer, banks[which]);
                        let phase = u32::try_from(phase).unwrap();
                        let sub = s + (phase << 8);
                        let place = (layer, code, sub);
                        current + self.noise(place, sample, [tiles.len(), number, column])
                    });
                    let weight =
                        if self.is(Fault::SliceShiftMissing) { 0 } else { s * hw.drive.dac_bits };
                    let d = match hw.adc {
                        Adc::Finite { bits, subtract, .. } if !probe => {
                            let ash = self.layers[layer].adc_shifts[t][s as usize];
                            let bits = bits.get();
                            let [on_rail, codes] = &mut rails[s as usize];
                            let d = match subtract {
                                Subtract::Digital => {
                                    let max = (1 << bits) - 1;
                                    let e = self.convert(e, ash, 0, max, &mut saturated[0]);
                                    let i = self.convert(i, ash, 0, max, &mut saturated[1]);
                                    *on_rail += u64::from(e == max) + u64::from(i == max);
                                    *codes += 2;
                                    e - i
                                }
                                Subtract::Current => {
                                    let half = 1 << (bits - 1);
                                    let min = -half;
                                    let d =
                                        self.convert(e - i, ash, min, half - 1, &mut saturated[0]);
                                    let least = d == min && !self.is(Fault::LeastCodeIsNoRail);
                                    *on_rail += u64::from(d == half - 1 || least);
                                    *codes += 1;
                                    d
                                }
                            };
                            d << ash
                        }
                        Adc::Finite { subtract: Subtract::Digital, .. } => {
                            seen[s as usize].extend([e, i]);
                            e - i
                        }
                        _ => {
                            seen[s as usize].push(e - i);
                            e - i
                        }
                    };
                    let adds = phase == 0 || self.is(Fault::BelowAdds);
                    let d = if adds { d } else { -d };
                    acc += (if self.is(Fault::SubtractSwapped) { -d } else { d }) << weight;
                }
                row.push(acc);
            }
            accumulators.push(row);
        }
        let counts = self.phase == Phase::Training || self.is(Fault::EvaluationIsTracked);
        if let Some(sums) = self.layers[layer].rails.get_mut(t).filter(|_| counts) {
            let both = sums.iter_mut().flatten().zip(rails.into_iter().flatten());
            both.for_each(|(sum, more)| *sum += more);
        }
        let lut = &self.layers[layer].lut;
        let half = 1i64 << (hw.digital.lut_bits.get() - 1);
        let look = |acc: i64, saturated: &mut u64| {
            let exact =
                if self.is(Fault::IndexTruncates) { acc >> lut.shift } else { rsh(acc, lut.shift) };
            *saturated += u64::from(exact < -half || exact >= half);
            (exact.clamp(-half, half - 1) + half) as usize
        };
        let (mut activity, mut derivative): (Table, Table) = (vec![], vec![]);
        for row in &accumulators {
            match self.layers[layer].spec.activation {
                Activation::Accumulator => {
                    activity.push(vec![0; row.len()]);
                    derivative.push(vec![255; row.len()]);
                    continue;
                }
                Activation::Rms => {
                    let codes = normalised(row).into_iter();
                    look_ups += codes.clone().filter(|&code| code > 255).count() as u64;
                    activity.push(codes.map(|code| code.min(255)).collect());
                    derivative.push(row.iter().map(|&acc| 255 * i64::from(acc > 0)).collect());
                    continue;
                }
                _ => {}
            }
            let places: Vec<_> = row.iter().map(|&acc| look(acc, &mut look_ups)).collect();
            activity.push(places.iter().map(|&at| i64::from(lut.activity[at])).collect());
            derivative.push(places.iter().map(|&at| i64::from(lut.derivative[at])).collect());
        }
        let this = &mut self.layers[layer];
        this.accumulators[t] = accumulators;
        this.activity[t] = activity;
        this.derivative[t] = derivative;
        let banks = pairs.as_flattened().iter();
        for (&bank, saturated) in banks.zip(saturated.into_iter().flatten()) {
            let code = self.code(layer, bank);
            self.count(layer, code, During::ForwardRows, Event::SaturatedConversions, saturated);
        }
        let code = self.unit_code(layer, target);
        self.count(layer, code, During::ForwardRows, Event::SaturatedLookUps, look_ups);
        seen
    }

    fn convert(&self, v: i64, ash: u32, min: i64, max: i64, saturated: &mut u64) -> i64 {
        let steps = if self.is(Fault::ConverterTruncates) { v >> ash } else { rsh(v, ash) };
        let max = if self.is(Fault::RailOffByOne) { max - 1 } else { max };
        let code = steps.clamp(min, max);
        *saturated += u64::from(code != steps || (self.is(Fault::RailCounts) && code == max));
        code
    }

    /// What one read of all loaded samples costs, tile by tile.
    fn count_read(&mut self, layer: usize) {
        let hw = self.net.hardware.clone();
        let wiring = self.layers[layer].spec.wiring;
        let (rows, columns) = (self.layers[layer].rows, self.layers[layer].spec.units);
        let slices = u64::from(hw.drive.bits.get().div_ceil(hw.drive.dac_bits));
        let current = matches!(hw.adc, Adc::Finite { subtract: Subtract::Current, .. });
        let times = self.samples as u64 * slices * self.phases(layer);
        for &target in wiring.targets() {
            for (bank, &at) in wiring.banks(target).iter().enumerate() {
                let code = self.code(layer, at);
                for (high, wide) in tile_sizes(rows, columns, hw.tile.rows, hw.tile.columns) {
                    let converted = if current && bank % 2 == 1 { 0 } else { wide };
                    let reference = hw.conductance.map(|of| of.reference);
                    let beside = u64::from(reference == Some(Reference::Column));
                    for (event, count) in [
                        (Event::SramBits, high * u64::from(hw.drive.dac_bits)),
                        (Event::DacSlices, high),
                        (Event::CellReads, high * (wide + beside)),
                        (Event::Holds, wide),
                        (Event::Conversions, converted),
                        (Event::ShiftAdds, converted),
                    ] {
                        self.count(layer, code, During::ForwardRows, event, times * count);
                    }
                }
            }
            let (code, units) = (self.unit_code(layer, target), (self.samples * columns) as u64);
            let counts: &[(Event, u64)] = match self.layers[layer].spec.activation {
                Activation::Accumulator => &[],
                Activation::Rms => &[
                    (Event::Squares, units),
                    (Event::Roots, self.samples as u64),
                    (Event::Scalings, units),
                    (Event::SramBits, 112 * units),
                ],
                _ => &[(Event::LookUps, units), (Event::SramBits, 32 * units)],
            };
            for &(event, count) in counts {
                self.count(layer, code, During::ForwardRows, event, count);
            }
        }
    }

    fn pass_on(&mut self, layer: usize) {
        if layer + 1 == self.layers.len() {
            return;
        }
        let bits = self.net.hardware.drive.bits.get();
        let shared = self.layers[layer + 1].spec.driven_by == DrivenBy::Shared;
        for stream in 0..2 {
            let code = |&a: &i64| {
                let round =
                    if self.is(Fault::DriveTruncates) { a >> (8 - bits) } else { rsh(a, 8 - bits) };
                round.min((1 << bits) - 1)
            };
            let from = if shared { 0 } else { stream };
            let rows = self.layers[layer].activity[from].iter();
            let rows: Table = rows.map(|row| row.iter().map(code).collect()).collect();
            let rows = rows.into_iter().map(|row| self.with_constant(layer + 1, row)).collect();
            self.layers[layer + 1].drives[stream] = rows;
        }
    }

    /// Reads the samples with ideal converters and sets the shifts: at most one conversion in 1,024 on the rail.
    pub(crate) fn calibrate(&mut self, codes: &[u8]) -> Option<Calibration> {
        let Adc::Finite { bits, subtract, range } = self.net.hardware.adc else { return None };
        let phase = std::mem::replace(&mut self.phase, Phase::Calibration);
        self.load_drives(codes);
        let mut found = Calibration { shifts: vec![], code_max: vec![] };
        for layer in 0..self.layers.len() {
            let mut code_max = 0;
            for (t, &target) in self.layers[layer].spec.wiring.targets().iter().enumerate() {
                for (s, seen) in self.read(layer, target, true).into_iter().enumerate() {
                    let on_rail = |shift: u32| {
                        let code = |v: i64| rsh(v, shift);
                        let half = 1i64 << (bits.get() - 1);
                        let rails = |v: &&i64| match subtract {
                            Subtract::Digital => code(**v) >= 2 * half - 1,
                            Subtract::Current => code(**v) >= half - 1 || code(**v) <= -half,
                        };
                        seen.iter().filter(rails).count()
                    };
                    let headroom = match range {
                        AdcRange::Calibrated { headroom, .. } => Some(headroom),
                        AdcRange::Tracking => Some(1),
                        _ => None,
                    };
                    if let Some(headroom) = headroom {
                        let least = (0..64).find(|&s| on_rail(s) * 1024 <= seen.len()).unwrap();
                        let least =
                            least - u32::from(self.is(Fault::CalibrationOneLower) && least > 0);
                        let headroom = if self.is(Fault::HeadroomForgotten) { 0 } else { headroom };
                        self.layers[layer].adc_shifts[t][s] = least + headroom;
                    }
                    let shift = self.layers[layer].adc_shifts[t][s];
                    let greatest = seen.iter().map(|v| v.abs()).max().unwrap_or(0);
                    code_max = code_max.max(rsh(greatest, shift));
                }
            }
            self.count_read(layer);
            self.pass_on(layer);
            found.shifts.push(self.layers[layer].adc_shifts.clone());
            found.code_max.push(code_max);
        }
        self.phase = phase;
        Some(found)
    }
}

/// Rows and columns of every tile.
fn tile_sizes(rows: usize, columns: usize, high: usize, wide: usize) -> Vec<(u64, u64)> {
    let parts = |all: usize, part: usize| -> Vec<u64> {
        (0..all.div_ceil(part)).map(|t| part.min(all - t * part) as u64).collect()
    };
    let across = parts(columns, wide);
    parts(rows, high).into_iter().flat_map(|h| across.iter().map(move |&w| (h, w))).collect()
}

/// What a pathway's polarity does to a sum.
const fn sign(polarity: Polarity) -> i64 {
    match polarity {
        Polarity::Excites => 1,
        Polarity::Inhibits => -1,
    }
}

/// Codes of a normalised stream before they are bounded.
fn normalised(accumulators: &[i64]) -> Vec<i64> {
    let v: Vec<u128> = accumulators.iter().map(|&acc| acc.max(0) as u128).collect();
    let mean = v.iter().map(|v| v * v).sum::<u128>() / v.len() as u128;
    let reciprocal = (1 << 45) / mean.isqrt().max(1);
    v.iter().map(|v| ((v * reciprocal + (1 << 39)) >> 40) as i64).collect()
}
