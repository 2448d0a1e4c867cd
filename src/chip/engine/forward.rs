//! `FWD`: currents, converters, accumulators, tables.
//!
//! ```text
//! ideal      acc = v_E - v_I                                  over all rows
//! finite     acc += d << (ash + s dac_bits)                    over slices s and row tiles
//! a, a'      table at index(acc);  next drive from a         index(acc - rsh(T, 8)) of units that keep to a middle
//! readout    acc kept;  a' = 255;  y = acc_p - acc_n, or acc_p where there is no n
//! ```
//!
//! With ideal converters slices and tiles cannot change a sum, so the whole column is read at once. The
//! ledger counts slices and tiles all the same. See docs/MODEL.md, 2.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use std::ops::Range;

use aligned_vec::{AVec, avec};

use super::Engine;
use super::each::each;
use super::homeostasis::Middle;
use super::read::{Histogram, Mode, PanelPart, Reader, Seen};
use super::window::windows_of;
use crate::chip::crossbar::kernel::{HandOn, Image, Kernel, LookUp, Scratch, TOGETHER, Windows};
use crate::chip::crossbar::layout::{BLOCK_ROWS, PANEL_COLUMNS};
use crate::chip::hardware::{Adc, Hardware, Subtract};
use crate::chip::layer::Layer;
use crate::chip::ledger::{During, Event};
use crate::chip::periphery;
use crate::chip::population::{Pathway, Polarity, Stream};
use crate::num::fixed::DriveBits;
use crate::num::tables::Activation;

/// Reads of a convolution whose drives are gathered: three groups that are read together, and blocks of them lie so that half
/// the blocks meet in one half of the first cache, and half in the other.
const NEAR: usize = 3 * TOGETHER;

/// What the units of a layer do with their accumulators.
#[derive(Debug, Clone)]
pub(super) enum Units {
    /// They look them up.
    Table(LookUp),
    /// They look up how far from their middle they are, in steps that a read brings with it.
    Homeostatic(LookUp),
    /// They are normalised, stream by stream.
    Normalised(HandOn),
    /// They keep them, with slope 1: a readout.
    Kept,
}

impl Units {
    /// Those of a layer, which hand on activities or, with `drive_bits`, drive codes of the next layer.
    ///
    /// # Panics
    /// When units hand on what is no activity, or nothing is driven by what is normalised: the plan checks that.
    pub(super) fn new(layer: &Layer, drive_bits: Option<DriveBits>) -> Self {
        match (layer.spec.activation, drive_bits) {
            (Activation::Rms, Some(bits)) => Self::Normalised(HandOn::new(bits)),
            (Activation::Rms, None) => panic!("what is normalised drives a layer"),
            (Activation::Accumulator, None) => Self::Kept,
            (Activation::Accumulator, Some(_)) => panic!("what is read out drives no layer"),
            _ if layer.spec.homeostasis.is_on() => Self::Homeostatic(layer.look_up(drive_bits)),
            _ => Self::Table(layer.look_up(drive_bits)),
        }
    }
}

/// What one block of 64 units of a stream puts out.
struct Out<'a> {
    target: Stream,
    block: usize,
    /// What the units hand on, `[sample][64]`; empty where they hand on nothing.
    values: &'a mut [u8],
    derivatives: &'a mut [u8],
    /// Where they are kept.
    accumulators: Option<&'a mut [i64]>,
}

impl Engine {
    pub(super) fn forward(&mut self, layer: usize) {
        let _ = self.forward_in(layer, Mode::Hardware);
    }

    /// Reads a layer and loads the next one's drives. Returns histograms by target when probing.
    pub(super) fn forward_in(&mut self, layer: usize, mode: Mode) -> Vec<Histogram> {
        if self.samples == 0 {
            let wiring = self.layers[layer].spec.wiring;
            return vec![Histogram::new(); wiring.targets().len()];
        }
        self.make_room(layer);
        if let Units::Homeostatic(table) = &mut self.units[layer] {
            table.shift = u32::try_from(self.layers[layer].balance.shift()).unwrap_or(0);
        }
        self.look_through(layer);
        let notes = self.notes(layer, mode);
        let mut seen = match self.units[layer] {
            Units::Normalised(hand_on) => self.normalised(layer, mode, hand_on),
            Units::Table(_) | Units::Homeostatic(_) | Units::Kept => self.put_out(layer, mode),
        };
        self.note(layer, notes, &mut seen);
        self.hand_on(layer);
        self.load_constant(layer + 1);
        self.note_currents(layer);
        self.note_said(layer);
        self.charge_forward(layer);
        let samples = self.samples;
        self.time(|schedule, cycles| schedule.read(cycles, layer, samples));
        self.charge_seen(layer, seen)
    }

    /// Gives registers the sizes of what a read of the loaded samples puts out.
    fn make_room(&mut self, layer: usize) {
        let samples = self.reads(layer);
        let direct = self.hands_on_directly(layer);
        let this = &self.layers[layer];
        let size = this.layout.columns.div_ceil(BLOCK_ROWS) * samples * BLOCK_ROWS;
        let (head, tail) = self.registers.split_at_mut(layer + 1);
        let own = &mut head[layer];
        for &target in this.spec.wiring.targets() {
            let at = target.index();
            own.derivatives[at].resize(size, 0);
            match tail.first_mut() {
                Some(next) if !direct => {
                    assert!(next.pending == 0, "sums wait to be programmed");
                    own.maps[at].resize(size, 0);
                }
                Some(next) => {
                    assert!(next.pending == 0, "sums wait to be programmed");
                    let rows = self.layers[layer + 1].layout.rows_padded();
                    next.drives[at].resize(samples * rows, 0);
                }
                None => {
                    own.accumulators[at].resize(size, 0);
                    if !matches!(self.units[layer], Units::Kept) {
                        own.activities[at].resize(size, 0);
                    }
                }
            }
            if matches!(self.units[layer], Units::Normalised(_)) {
                own.unscaled[at].resize(size, 0);
            }
        }
    }

    /// Reads a layer whose units need nothing but their own accumulators. What was seen, by target.
    fn put_out(&mut self, layer: usize, mode: Mode) -> Vec<Seen> {
        if self.layers[layer].spec.convolution.is_some() {
            return self.put_out_near(layer, mode);
        }
        let samples = self.reads(layer);
        let notes = self.notes(layer, mode);
        let beside = self.beside(layer);
        let direct = self.hands_on_directly(layer);
        let (head, tail) = self.registers.split_at_mut(layer + 1);
        let own = &mut head[layer];
        let this = &self.layers[layer];
        let wiring = this.spec.wiring;
        let drives = |source: Stream| &own.drives[this.spec.drives_of(source).index()][..];
        let readers: Vec<_> = wiring
            .targets()
            .iter()
            .map(|&target| {
                let mode = (mode, beside.clone());
                Reader::new(this, &self.hardware, target, samples, mode, drives)
            })
            .collect();
        let mut values: [&mut [u8]; 2] = match tail.first_mut() {
            Some(next) if direct => next.drives.each_mut().map(|drives| &mut drives[..]),
            Some(_) => own.maps.each_mut().map(|map| &mut map[..]),
            None => own.activities.each_mut().map(|activities| &mut activities[..]),
        };
        // empty where a layer only hands on
        let mut accumulators =
            own.accumulators.each_mut().map(|kept| kept.chunks_mut(samples * BLOCK_ROWS));
        let mut outs: Vec<Vec<Out<'_>>> = Vec::new();
        let together = blocks_together(&self.hardware);
        let [p, n] = &mut own.derivatives;
        for (&target, derivatives) in wiring.targets().iter().zip([p, n]) {
            // empty where a layer is only read out
            let values = std::mem::take(&mut values[target.index()]);
            let mut values = values.chunks_mut(samples * BLOCK_ROWS);
            let chunks = derivatives.chunks_mut(samples * BLOCK_ROWS);
            for (block, derivatives) in chunks.enumerate() {
                let values = values.next().unwrap_or_default();
                let accumulators = accumulators[target.index()].next();
                let out = Out { target, block, values, derivatives, accumulators };
                match outs.last_mut() {
                    Some(last) if block % together > 0 => Vec::push(last, out),
                    _ => outs.push(vec![out]),
                }
            }
        }
        let middles = wiring.targets().iter().zip(&readers);
        let middles: Vec<_> =
            middles.map(|(&target, reader)| Middle::of(this, target, reader, notes)).collect();
        let units = &self.units[layer];
        let work = samples * this.layout.cells() * wiring.pathways().len();
        let blocks = this.layout.columns.div_ceil(BLOCK_ROWS);
        let parts = outs.into_iter().map(|outs| (outs[0].block, outs)).collect();
        let seen = each(&mut self.team, work, blocks, parts, |kernel, outs| {
            let target = outs[0].target.index();
            let units = (units, middles[target].as_ref());
            (target, put_out(kernel, &readers[target], units, samples, outs))
        });
        Seen::by_target(wiring, seen)
    }

    /// The same of a convolution, which is read so often that its drives would leave the second cache: all its units read some
    /// positions, and then the next. The arrays of a convolution are small.
    fn put_out_near(&mut self, layer: usize, mode: Mode) -> Vec<Seen> {
        let reads = self.reads(layer);
        let notes = self.notes(layer, mode);
        let beside = self.beside(layer);
        let direct = self.hands_on_directly(layer);
        let (head, tail) = self.registers.split_at_mut(layer + 1);
        let own = &mut head[layer];
        let (this, hardware) = (&self.layers[layer], &self.hardware);
        let wiring = this.spec.wiring;
        let mut values: [&mut [u8]; 2] = match tail.first_mut() {
            Some(next) if direct => next.drives.each_mut().map(|drives| &mut drives[..]),
            Some(_) => own.maps.each_mut().map(|map| &mut map[..]),
            None => own.activities.each_mut().map(|activities| &mut activities[..]),
        };
        let mut kept = own.accumulators.each_mut().map(|kept| &mut kept[..]);
        let starts = (0..reads).step_by(NEAR);
        let mut parts: Vec<(Range<usize>, Vec<Out<'_>>)> =
            starts.map(|start| (start..(start + NEAR).min(reads), vec![])).collect();
        for (&target, derivatives) in wiring.targets().iter().zip(&mut own.derivatives) {
            // empty where a layer only hands on, or is only read out
            let mut values =
                std::mem::take(&mut values[target.index()]).chunks_mut(reads * BLOCK_ROWS);
            let mut kept = std::mem::take(&mut kept[target.index()]).chunks_mut(reads * BLOCK_ROWS);
            let blocks = derivatives.chunks_mut(reads * BLOCK_ROWS).enumerate();
            for (block, derivatives) in blocks {
                let mut values = values.next().unwrap_or_default().chunks_mut(NEAR * BLOCK_ROWS);
                let mut kept = kept.next().unwrap_or_default().chunks_mut(NEAR * BLOCK_ROWS);
                let derivatives = derivatives.chunks_mut(NEAR * BLOCK_ROWS);
                for ((_, outs), derivatives) in parts.iter_mut().zip(derivatives) {
                    let values = values.next().unwrap_or_default();
                    let accumulators = kept.next();
                    outs.push(Out { target, block, values, derivatives, accumulators });
                }
            }
        }
        let units = &self.units[layer];
        let plan = own.plan.as_ref().expect("windows lie where samples are loaded");
        let met = |&set: &Stream| Image::new(plan, &own.images[set.index()]);
        let met = this.spec.drive_sets().iter().map(met);
        let windows: Vec<_> = met.map(|image| windows_of(&this.spec, hardware, image)).collect();
        let blocks = this.layout.blocks();
        let work = reads * this.layout.cells() * wiring.pathways().len();
        let places = parts.len();
        let seen = each(&mut self.team, work, places, parts.into_iter().enumerate().collect(), {
            |kernel, (some, outs): (Range<usize>, _)| {
                let near = windows.iter().map(|windows| gathered(windows, blocks, &some));
                let near: Vec<_> = near.collect();
                let drives = |source: Stream| &near[this.spec.drives_of(source).index()][..];
                let samples = some.len();
                let reader = |&target| {
                    let mode = (mode, beside.starting_at(some.start));
                    let mut reader = Reader::new(this, hardware, target, samples, mode, drives);
                    reader.prepare(kernel);
                    let middle = Middle::of(this, target, &reader, notes);
                    (Seen::new(&reader), reader, middle)
                };
                let mut readers: Vec<_> = wiring.targets().iter().map(reader).collect();
                put_out_all(kernel, units, samples, outs, &mut readers);
                let seen = readers.into_iter().map(|(seen, ..)| seen);
                wiring.targets().iter().map(|target| target.index()).zip(seen).collect::<Vec<_>>()
            }
        });
        Seen::by_target(wiring, seen.into_iter().flatten().collect())
    }

    /// Charges what depended on the numbers read.
    fn charge_seen(&mut self, layer: usize, seen: Vec<Seen>) -> Vec<Histogram> {
        let wiring = self.layers[layer].spec.wiring;
        let mut histograms = Vec::new();
        for (&target, seen) in wiring.targets().iter().zip(seen) {
            for (&at, saturated) in wiring.banks(target).iter().zip(seen.saturated) {
                let code = wiring.pathways()[at].code;
                self.charge_read(layer, code, Event::SaturatedConversions, saturated);
            }
            let code = Self::code_of(wiring, target);
            self.charge_read(layer, code, Event::SaturatedLookUps, seen.look_ups);
            self.count_rails(layer, target, &seen.reached);
            histograms.push(seen.histogram);
        }
        histograms
    }

    pub(super) fn charge_read(&mut self, layer: usize, pathway: u8, event: Event, count: u64) {
        self.charge(layer, pathway, During::ForwardRows, event, count);
    }

    /// What the chip does for a read, by the plan: nothing here depends on the numbers read.
    fn charge_forward(&mut self, layer: usize) {
        let this = &self.layers[layer];
        let [down, across] = this.tiles(&self.hardware).map(|n| n as u64);
        let (rows, columns) = (this.layout.rows as u64, this.layout.columns as u64);
        let slices = u64::from(self.hardware.slices()) * this.spec.driven_by.phases() as u64;
        let samples = self.reads(layer) as u64;
        let dac_bits = u64::from(self.hardware.drive.dac_bits);
        let wiring = this.spec.wiring;
        let reference = self.reference_columns(layer);
        let at_difference =
            matches!(self.hardware.adc, Adc::Finite { subtract: Subtract::Current, .. });
        for &target in wiring.targets() {
            for &at in wiring.banks(target) {
                let Pathway { code, polarity, .. } = wiring.pathways()[at];
                let held = samples * columns * down * slices;
                let beside = at_difference && polarity == Polarity::Inhibits;
                let converted = if beside { 0 } else { held };
                let driven = samples * rows * across * slices;
                self.charge_read(layer, code, Event::DacSlices, driven);
                self.charge_read(layer, code, Event::SramBits, driven * dac_bits);
                let read = samples * rows * (columns + reference) * slices;
                self.charge_read(layer, code, Event::CellReads, read);
                self.charge_read(layer, code, Event::Holds, held);
                self.charge_read(layer, code, Event::Conversions, converted);
                self.charge_read(layer, code, Event::ShiftAdds, converted);
            }
            let code = Self::code_of(wiring, target);
            match self.units[layer] {
                Units::Table(_) | Units::Homeostatic(_) => {
                    self.charge_read(layer, code, Event::LookUps, samples * columns);
                    // an entry of the table, then activity and derivative
                    self.charge_read(layer, code, Event::SramBits, samples * columns * 32);
                }
                Units::Normalised(_) => self.charge_normalised(layer, code, samples, columns),
                Units::Kept => {}
            }
        }
    }
}

/// Blocks of units read together: where each drive is cut into many slices that are converted, the slices of a few
/// samples are more than the cells of these blocks, and stay near.
fn blocks_together(hardware: &Hardware) -> usize {
    let cut = hardware.adc != Adc::Ideal && hardware.slices() > 2;
    if cut { 4 } else { 1 }
}

/// Reads some blocks of 64 units and looks them up, some samples at a time: all panels, while their drives are near.
fn put_out(
    kernel: &Kernel,
    reader: &Reader<'_>,
    (units, middle): (&Units, Option<&Middle>),
    samples: usize,
    mut outs: Vec<Out<'_>>,
) -> Seen {
    let mut seen = Seen::new(reader);
    let mut scratch = Scratch::new();
    let mut sums = [0; Scratch::SUMS];
    for start in (0..samples).step_by(TOGETHER) {
        let group = start..(start + TOGETHER).min(samples);
        for out in &mut outs {
            let units = (units, middle);
            put_out_group(kernel, reader, units, out, &group, (&mut scratch, &mut sums), &mut seen);
        }
    }
    seen
}

/// Reads all units of all targets and looks them up, some samples at a time. What is seen, the reader and the middle of a target
/// stand at its number.
fn put_out_all(
    kernel: &Kernel,
    units: &Units,
    samples: usize,
    mut outs: Vec<Out<'_>>,
    readers: &mut [(Seen, Reader<'_>, Option<Middle>)],
) {
    let mut scratch = Scratch::new();
    let mut sums = [0; Scratch::SUMS];
    for start in (0..samples).step_by(TOGETHER) {
        let group = start..(start + TOGETHER).min(samples);
        for out in &mut outs {
            let (seen, reader, middle) = &mut readers[out.target.index()];
            let (units, scratch) = ((units, middle.as_ref()), (&mut scratch, &mut sums));
            put_out_group(kernel, reader, units, out, &group, scratch, seen);
        }
    }
}

/// Drives of some reads, `[block][read][64]`.
fn gathered(windows: &Windows<'_>, blocks: usize, some: &Range<usize>) -> AVec<u8> {
    let mut near = avec![0; blocks * some.len() * BLOCK_ROWS];
    windows.assemble(0..blocks, some.clone(), &mut Vec::new(), &mut near);
    near
}

/// Reads the two panels of a block for a group of samples.
fn put_out_group(
    kernel: &Kernel,
    reader: &Reader<'_>,
    (units, middle): (&Units, Option<&Middle>),
    out: &mut Out<'_>,
    group: &Range<usize>,
    (scratch, sums): (&mut Scratch, &mut [i32; Scratch::SUMS]),
    seen: &mut Seen,
) {
    let cells = group.len() * PANEL_COLUMNS;
    for half in 0..2 {
        let (panel, from) = (2 * out.block + half, half * PANEL_COLUMNS);
        let live = reader.columns.saturating_sub(panel * PANEL_COLUMNS).min(PANEL_COLUMNS);
        let at = group.start * BLOCK_ROWS + from;
        let derivatives = &mut out.derivatives[at..];
        let values = out.values.get_mut(at..).unwrap_or_default();
        if live == 0 {
            for rows in [values, derivatives] {
                let rows = rows.chunks_mut(BLOCK_ROWS).take(group.len());
                rows.for_each(|row| row[..PANEL_COLUMNS].fill(0));
            }
            continue;
        }
        let part = PanelPart { panel, live, samples: group.clone() };
        let kept = out.accumulators.as_deref_mut().map(|all| &mut all[at..]);
        if reader.is_narrow() {
            let sums = &mut sums[..cells];
            reader.read_narrow(kernel, &part, scratch, sums, seen);
            match units {
                Units::Table(table) => {
                    seen.look_ups += kernel.look_up(sums, table, live, values, derivatives);
                }
                Units::Homeostatic(table) => {
                    let middle = middle.expect("made with the read");
                    if middle.is_narrow() && kept.is_some() {
                        middle.take_off(kernel, (panel, live), table.shift, sums, seen);
                        seen.look_ups += kernel.look_up(sums, table, live, values, derivatives);
                    } else if middle.is_narrow() {
                        let out = (values, derivatives);
                        middle.put_out(kernel, (panel, live), (table, sums), out, seen);
                    } else {
                        let mut wide = [0; Scratch::SUMS];
                        wide.iter_mut().zip(&*sums).for_each(|(wide, &sum)| *wide = sum.into());
                        let wide = &mut wide[..cells];
                        middle.take_off_wide((panel, live), table.shift, wide, seen);
                        look_up_wide(wide, table, live, [values, derivatives], seen);
                    }
                }
                _ => slope_one(derivatives, live, group.len()),
            }
            keep(kept, sums);
        } else {
            let mut sums = [0; Scratch::SUMS];
            let sums = &mut sums[..cells];
            reader.read_wide(kernel, &part, sums, seen);
            match units {
                Units::Table(table) => {
                    look_up_wide(sums, table, live, [values, derivatives], seen);
                }
                Units::Homeostatic(table) => {
                    let middle = middle.expect("made with the read");
                    middle.take_off_wide((panel, live), table.shift, sums, seen);
                    look_up_wide(sums, table, live, [values, derivatives], seen);
                }
                _ => slope_one(derivatives, live, group.len()),
            }
            keep(kept, sums);
        }
    }
}

/// Slopes of a panel's units that are read out, `[sample][64]`.
fn slope_one(derivatives: &mut [u8], live: usize, samples: usize) {
    let slopes: [u8; PANEL_COLUMNS] = std::array::from_fn(|c| if c < live { 255 } else { 0 });
    for row in derivatives.chunks_mut(BLOCK_ROWS).take(samples) {
        row[..PANEL_COLUMNS].copy_from_slice(&slopes);
    }
}

/// Looks up accumulators (`[sample][32]`) of any size; values and derivatives lie `[sample][64]`.
fn look_up_wide(
    sums: &[i64],
    table: &LookUp,
    live: usize,
    [values, derivatives]: [&mut [u8]; 2],
    seen: &mut Seen,
) {
    let half = (table.entries.len() / 2) as i64;
    for (sample, sums) in sums.chunks_exact(PANEL_COLUMNS).enumerate() {
        for (column, &sum) in sums.iter().enumerate() {
            let (index, saturated) = periphery::index(sum, table.shift, half);
            let entry = if column < live { table.entries[index] } else { 0 };
            let at = sample * BLOCK_ROWS + column;
            [values[at], derivatives[at], ..] = entry.to_le_bytes();
            seen.look_ups += u64::from(column < live && saturated);
        }
    }
}

/// Keeps a panel's accumulators, `[sample][64]`.
fn keep<T: Copy + Into<i64>>(kept: Option<&mut [i64]>, sums: &[T]) {
    let Some(kept) = kept else { return };
    let rows = kept.chunks_mut(BLOCK_ROWS).zip(sums.as_chunks::<PANEL_COLUMNS>().0);
    for (kept, sums) in rows {
        kept.iter_mut().zip(sums).for_each(|(kept, &sum)| *kept = sum.into());
    }
}
