//! `FWD`: currents, converters, accumulators, tables.
//!
//! ```text
//! ideal      acc = v_E - v_I                                  over all rows
//! finite     acc += d << (ash + s dac_bits)                    over slices s and row tiles
//! a, a'      table at index(acc);  next drive from a
//! columns    d[row] = (E - I) u+  -  (E - I) u-                two phases of unsigned gates
//! ```
//!
//! With ideal converters slices and tiles cannot change a sum, so the whole column is read at once. The
//! ledger counts slices and tiles all the same. See docs/MODEL.md, 2.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use std::borrow::Cow;
use std::ops::Range;

use rayon::prelude::*;

use super::Engine;
use crate::chip::crossbar::Crossbar;
use crate::chip::crossbar::kernel::Backend;
use crate::chip::crossbar::layout::{BLOCK_ROWS, PANEL_COLUMNS};
use crate::chip::hardware::{Adc, Hardware, Subtract};
use crate::chip::layer::{CHUNK_BLOCKS, Layer};
use crate::chip::ledger::{During, Event};
use crate::chip::periphery::{self, Converter};
use crate::chip::population::Stream;

/// Histogram of the least shifts at which conversions stay off the rail, and the greatest current, by slice.
pub(super) type Histogram = Vec<([u64; 64], i64)>;

/// How currents become numbers in one pass.
#[derive(Debug, Clone, Copy)]
pub(super) enum Mode {
    /// As the hardware says.
    Hardware,
    /// With ideal converters, remembering what finite ones would need.
    Probe,
}

/// Rows that are read together with one slice of their drives.
struct TileRead<'a> {
    slice: u32,
    blocks: Range<usize>,
    drives: Cow<'a, [u8]>,
}

/// What one panel's read counted.
#[derive(Default, Clone)]
struct Seen {
    saturated: [u64; 2],
    look_ups: u64,
    currents: [i64; 2],
    histogram: Histogram,
}

impl Seen {
    fn merge(mut self, other: Self) -> Self {
        for bank in 0..2 {
            self.saturated[bank] += other.saturated[bank];
            self.currents[bank] += other.currents[bank];
        }
        self.look_ups += other.look_ups;
        if self.histogram.is_empty() {
            self.histogram = other.histogram;
        } else {
            for (mine, theirs) in self.histogram.iter_mut().zip(other.histogram) {
                mine.0.iter_mut().zip(theirs.0).for_each(|(a, b)| *a += b);
                mine.1 = mine.1.max(theirs.1);
            }
        }
        self
    }
}

/// Slices and tiles of a batch of drives. With `whole`, the full code over all rows, in chunks that fit.
fn tile_reads<'a>(
    layer: &Layer,
    hardware: &Hardware,
    drives: &'a [u8],
    whole: bool,
) -> Vec<TileRead<'a>> {
    if whole {
        let blocks = layer.layout.blocks();
        let starts = (0..blocks).step_by(CHUNK_BLOCKS);
        let chunk = |start: usize| start..(start + CHUNK_BLOCKS).min(blocks);
        return starts
            .map(|s| TileRead { slice: 0, blocks: chunk(s), drives: Cow::Borrowed(drives) })
            .collect();
    }
    let stride = layer.layout.rows_padded();
    let (dac_bits, slices) = (hardware.dac_bits, hardware.slices());
    let mut reads = Vec::new();
    for slice in 0..slices {
        let sliced: Cow<'a, [u8]> = if slices == 1 {
            Cow::Borrowed(drives)
        } else {
            drives.iter().map(|&x| periphery::slice(x, slice, dac_bits)).collect()
        };
        for rows in layer.row_tiles(hardware) {
            let blocks = rows.start / BLOCK_ROWS..rows.end.div_ceil(BLOCK_ROWS);
            let ends_inside = rows.end < layer.layout.rows;
            let aligned = rows.start.is_multiple_of(BLOCK_ROWS)
                && (!ends_inside || rows.end.is_multiple_of(BLOCK_ROWS));
            let mut drives = sliced.clone();
            if !aligned {
                // a tile's edge lies inside a block: silence the rows of its neighbours
                for sample in drives.to_mut().chunks_exact_mut(stride) {
                    sample[blocks.start * BLOCK_ROWS..rows.start].fill(0);
                    sample[rows.end..blocks.end * BLOCK_ROWS].fill(0);
                }
            }
            debug_assert!(blocks.len() <= CHUNK_BLOCKS, "a converted tile is one chunk");
            reads.push(TileRead { slice, blocks, drives });
        }
    }
    reads
}

/// One panel of one target: banks, and the reads of their sources.
struct Banks<'a> {
    arrays: [&'a Crossbar; 2],
    reads: [&'a [TileRead<'a>]; 2],
    converters: Option<(Vec<Converter>, Subtract)>,
    dac_bits: u32,
    probe: Option<Converter>,
    slices: usize,
    columns: usize,
}

impl Banks<'_> {
    /// Reads a panel into `accumulators` (`[sample][32]`).
    fn read(&self, backend: Backend, panel: usize, accumulators: &mut [i64]) -> Seen {
        let mut seen = Seen::default();
        if self.probe.is_some() {
            seen.histogram = vec![([0; 64], 0); self.slices];
        }
        accumulators.fill(0);
        let live = (self.columns - panel * PANEL_COLUMNS).min(PANEL_COLUMNS);
        let mut currents = [vec![0; accumulators.len()], vec![0; accumulators.len()]];
        let mut scratch = Vec::new();
        for at in 0..self.reads[0].len() {
            let slice = self.reads[0][at].slice;
            for (bank, out) in currents.iter_mut().enumerate() {
                let read = &self.reads[bank][at];
                let blocks = read.blocks.clone();
                self.arrays[bank].read(backend, panel, blocks, &read.drives, out, &mut scratch);
                let live =
                    out.chunks_exact(PANEL_COLUMNS).map(|row| row[..live].iter().sum::<i64>());
                seen.currents[bank] += live.sum::<i64>() << (slice * self.dac_bits);
            }
            let [e, i] = &currents;
            let rows = accumulators.chunks_exact_mut(PANEL_COLUMNS);
            let pairs = e.chunks_exact(PANEL_COLUMNS).zip(i.chunks_exact(PANEL_COLUMNS));
            match (&self.converters, self.probe) {
                (Some((converters, subtract)), None) => {
                    let adc = converters[slice as usize];
                    let shift = adc.shift + slice * self.dac_bits;
                    for (row, (e, i)) in rows.zip(pairs) {
                        for c in 0..live {
                            let d = match subtract {
                                Subtract::Digital => {
                                    let (e, e_saturated) = adc.convert(e[c]);
                                    let (i, i_saturated) = adc.convert(i[c]);
                                    seen.saturated[0] += u64::from(e_saturated);
                                    seen.saturated[1] += u64::from(i_saturated);
                                    e - i
                                }
                                Subtract::Current => {
                                    let (d, saturated) = adc.convert(e[c] - i[c]);
                                    seen.saturated[0] += u64::from(saturated);
                                    d
                                }
                            };
                            row[c] += d << shift;
                        }
                    }
                }
                (_, probe) => {
                    let shift = slice * self.dac_bits;
                    for (row, (e, i)) in rows.zip(pairs) {
                        for c in 0..live {
                            row[c] += (e[c] - i[c]) << shift;
                        }
                        if let Some(adc) = probe {
                            let entry = &mut seen.histogram[slice as usize];
                            let mut note = |v: i64| {
                                entry.0[adc.least_shift(v) as usize] += 1;
                                entry.1 = entry.1.max(v.abs());
                            };
                            for c in 0..live {
                                if adc.min == 0 {
                                    note(e[c]);
                                    note(i[c]);
                                } else {
                                    note(e[c] - i[c]);
                                }
                            }
                        }
                    }
                }
            }
        }
        seen
    }
}

impl Engine {
    pub(super) fn forward(&mut self, layer: usize) {
        let _ = self.forward_in(layer, Mode::Hardware);
    }

    /// Reads a layer and loads the next one's drives. Returns histograms by target when probing.
    pub(super) fn forward_in(&mut self, layer: usize, mode: Mode) -> Vec<Histogram> {
        let samples = self.samples;
        let padded = self.layers[layer].layout.columns_padded();
        let mut registers = std::mem::take(&mut self.registers[layer]);
        let wiring = self.layers[layer].spec.wiring;
        let mut histograms = Vec::new();
        let probing = matches!(mode, Mode::Probe);
        let whole = self.hardware.adc == Adc::Ideal;
        let seen = {
            let this = &self.layers[layer];
            let drives = |source: Stream| {
                let at = if layer == 0 { Stream::P } else { source };
                &registers.drives[at.index()]
            };
            let reads: Vec<_> = wiring
                .sources()
                .iter()
                .map(|&s| tile_reads(this, &self.hardware, drives(s), whole))
                .collect();
            let mut seen = Vec::new();
            for &target in wiring.targets() {
                let places = wiring.banks(target);
                let banks = Banks {
                    arrays: places.map(|at| &this.arrays[at]),
                    reads: places.map(|at| &reads[wiring.pathways()[at].source.index()][..]),
                    converters: converters(this, &self.hardware, target),
                    dac_bits: self.hardware.dac_bits,
                    probe: probing.then(|| probe(&self.hardware)).flatten(),
                    slices: self.hardware.slices() as usize,
                    columns: this.layout.columns,
                };
                let t = target.index();
                registers.accumulators[t].resize(samples * padded, 0);
                registers.activity[t].resize(samples * padded, 0);
                registers.derivative[t].resize(samples * padded, 0);
                let panel_size = samples * PANEL_COLUMNS;
                let (backend, lut, columns) = (self.backend, &this.lut, this.layout.columns);
                let total = registers.accumulators[t]
                    .par_chunks_mut(panel_size)
                    .zip(registers.activity[t].par_chunks_mut(panel_size))
                    .zip(registers.derivative[t].par_chunks_mut(panel_size))
                    .enumerate()
                    .map(|(panel, ((accumulators, activity), derivative))| {
                        let mut seen = banks.read(backend, panel, accumulators);
                        let live = (columns - panel * PANEL_COLUMNS).min(PANEL_COLUMNS);
                        let rows = accumulators.chunks_exact(PANEL_COLUMNS);
                        let out = activity
                            .chunks_exact_mut(PANEL_COLUMNS)
                            .zip(derivative.chunks_exact_mut(PANEL_COLUMNS));
                        for (accumulators, (activity, derivative)) in rows.zip(out) {
                            for c in 0..live {
                                let (at, saturated) = periphery::index(accumulators[c], lut);
                                seen.look_ups += u64::from(saturated);
                                activity[c] = lut.activity[at];
                                derivative[c] = lut.derivative[at];
                            }
                        }
                        seen
                    })
                    .reduce(Seen::default, Seen::merge);
                seen.push((target, total));
            }
            seen
        };
        self.registers[layer] = registers;
        for (target, seen) in seen {
            for bank in 0..2 {
                let code = wiring.pathways()[wiring.banks(target)[bank]].code;
                let saturated = seen.saturated[bank];
                self.charge_read(layer, code, Event::SaturatedConversions, saturated);
                self.currents[layer][target.index()][bank] += seen.currents[bank];
            }
            let code = Self::code_of(wiring, target);
            self.charge_read(layer, code, Event::SaturatedLookUps, seen.look_ups);
            histograms.push(seen.histogram);
        }
        self.charge_forward(layer);
        self.pass_on(layer);
        histograms
    }

    fn charge_read(&mut self, layer: usize, pathway: u8, event: Event, count: u64) {
        self.charge(layer, pathway, During::ForwardRows, event, count);
    }

    /// What the chip does for a read, by the plan: nothing here depends on the numbers read.
    fn charge_forward(&mut self, layer: usize) {
        let this = &self.layers[layer];
        let [down, across] = this.tiles(&self.hardware).map(|n| n as u64);
        let (rows, columns) = (this.layout.rows as u64, this.layout.columns as u64);
        let slices = u64::from(self.hardware.slices());
        let samples = self.samples as u64;
        let wiring = this.spec.wiring;
        let at_difference =
            matches!(self.hardware.adc, Adc::Finite { subtract: Subtract::Current, .. });
        for &target in wiring.targets() {
            for (bank, at) in wiring.banks(target).into_iter().enumerate() {
                let code = wiring.pathways()[at].code;
                let held = samples * columns * down * slices;
                let converted = if at_difference && bank == 1 { 0 } else { held };
                self.charge_read(layer, code, Event::DacSlices, samples * rows * across * slices);
                self.charge_read(layer, code, Event::CellReads, samples * rows * columns * slices);
                self.charge_read(layer, code, Event::Holds, held);
                self.charge_read(layer, code, Event::Conversions, converted);
                self.charge_read(layer, code, Event::ShiftAdds, converted);
            }
            let code = Self::code_of(wiring, target);
            self.charge_read(layer, code, Event::LookUps, samples * columns);
        }
    }

    /// Loads the drives of the next layer with the activity of this one.
    fn pass_on(&mut self, layer: usize) {
        let Some(next) = self.layers.get(layer + 1) else { return };
        let stride = next.layout.rows_padded();
        let (units, bits) = (next.spec.inputs, self.hardware.drive_bits);
        let codes: [u8; 256] =
            std::array::from_fn(|a| periphery::drive(u8::try_from(a).expect("a byte"), bits));
        let samples = self.samples;
        let (head, tail) = self.registers.split_at_mut(layer + 1);
        assert!(tail[0].pending == 0, "sums wait to be programmed");
        for &source in next.spec.wiring.sources() {
            let activity = &head[layer].activity[source.index()];
            let drives = &mut tail[0].drives[source.index()];
            drives.resize(samples * stride, 0);
            for (panel, activity) in activity.chunks_exact(samples * PANEL_COLUMNS).enumerate() {
                let first = panel * PANEL_COLUMNS;
                let live = (units - first).min(PANEL_COLUMNS);
                let rows = drives.chunks_exact_mut(stride);
                for (drives, activity) in rows.zip(activity.chunks_exact(PANEL_COLUMNS)) {
                    for (drive, &a) in drives[first..first + live].iter_mut().zip(activity) {
                        *drive = codes[usize::from(a)];
                    }
                }
            }
            for drives in drives.chunks_exact_mut(stride) {
                if next.spec.constant_row {
                    drives[units] = bits.code_max();
                }
            }
        }
    }

    /// The transposed read: gates drive the columns, positive phase then negative phase.
    pub(super) fn forward_columns(&mut self, layer: usize) {
        let this = &self.layers[layer];
        let (layout, wiring) = (this.layout, this.spec.wiring);
        assert!(self.hardware.transposed_read, "only tiles with column drivers are read backwards");
        let samples = self.samples;
        let (stride, columns) = (layout.rows_padded(), layout.columns_padded());
        let mut sums = vec![0i64; samples * layout.rows];
        for phase in [1i8, -1] {
            let gates = &self.registers[layer].gates[Stream::P.index()];
            let mut drives = vec![0u8; samples * columns];
            for (panel, gates) in gates.chunks_exact(samples * PANEL_COLUMNS).enumerate() {
                for (sample, gates) in gates.chunks_exact(PANEL_COLUMNS).enumerate() {
                    let at = sample * columns + panel * PANEL_COLUMNS;
                    for (drive, &gate) in drives[at..].iter_mut().zip(gates) {
                        *drive = gate.saturating_mul(phase).max(0).unsigned_abs();
                    }
                }
            }
            for (bank, at) in wiring.banks(Stream::P).into_iter().enumerate() {
                let sign = i64::from(phase) * if bank == 0 { 1 } else { -1 };
                let currents = this.arrays[at].read_columns(self.backend, &drives);
                let rows = sums.chunks_exact_mut(layout.rows).zip(currents.chunks_exact(stride));
                for (sums, currents) in rows {
                    for (sum, &current) in sums.iter_mut().zip(currents) {
                        *sum += sign * current;
                    }
                }
            }
        }
        let inputs = this.spec.inputs;
        self.registers[layer].backward =
            sums.chunks_exact(layout.rows).flat_map(|row| row[..inputs].iter().copied()).collect();
        self.charge_columns(layer);
    }

    fn charge_columns(&mut self, layer: usize) {
        let this = &self.layers[layer];
        let [down, across] = this.tiles(&self.hardware).map(|n| n as u64);
        let (rows, columns) = (this.layout.rows as u64, this.layout.columns as u64);
        let reads = 2 * u64::from(self.hardware.slices()) * self.samples as u64;
        for at in this.spec.wiring.banks(Stream::P) {
            let code = self.layers[layer].spec.wiring.pathways()[at].code;
            let during = During::ForwardColumns;
            self.charge(layer, code, during, Event::DacSlices, columns * down * reads);
            self.charge(layer, code, during, Event::CellReads, rows * columns * reads);
            self.charge(layer, code, during, Event::Holds, rows * across * reads);
            self.charge(layer, code, during, Event::Conversions, rows * across * reads);
            self.charge(layer, code, during, Event::ShiftAdds, rows * across * reads);
        }
    }
}

fn converters(
    layer: &Layer,
    hardware: &Hardware,
    target: Stream,
) -> Option<(Vec<Converter>, Subtract)> {
    match hardware.adc {
        Adc::Ideal => None,
        Adc::Finite { bits, subtract, .. } => {
            let shifts = layer.adc_shifts[target.index()].iter();
            let converters = shifts.map(|&shift| Converter::new(bits, subtract, shift)).collect();
            Some((converters, subtract))
        }
    }
}

fn probe(hardware: &Hardware) -> Option<Converter> {
    match hardware.adc {
        Adc::Ideal => None,
        Adc::Finite { bits, subtract, .. } => Some(Converter::new(bits, subtract, 0)),
    }
}
