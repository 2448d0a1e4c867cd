//! `UPD`: outer-product sums, programming.
//!
//! ```text
//! pp, nn   + a_source (x) u_target         np, pn   - a_source (x) u_target
//! pulses   clamp( SR(sum * m, k), -d_max, +d_max );   level   clamp( level + pulses, floor, ceiling )
//! ```
//!
//! `a` is the drive code the layer was read with. See docs/MODEL.md, 3.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use std::borrow::Cow;
use std::ops::Range;

use aligned_vec::AVec;

use super::each::{MOVE, each};
use super::error::{gates_of, packed_at, stride_of};
use super::passes::Passes;
use super::pulses::Pulses;
use super::window::windows_of;
use super::{Engine, Lines, Write};
use crate::chip::crossbar::kernel::{self, Image, WriteCounts};
use crate::chip::crossbar::layout::{BLOCK_ROWS, PANEL_COLUMNS};
use crate::chip::crossbar::{Collect, Crossbar, Met, StripMut, WriteRequest, Written};
use crate::chip::hardware::{DitherBits, DitherPattern, PulseCode, Timing, WriteScheme};
use crate::chip::ledger::{During, Event};
use crate::chip::population::{Polarity, Stream};
use crate::num::draw::{Place, Site};

impl Engine {
    pub(super) fn update(&mut self, layer: usize, write: Write, samples: Range<usize>, shift: u32) {
        let pending = &mut self.registers[layer].pending;
        match write {
            Write::Add => {
                assert_eq!(*pending, samples.start, "samples are added in order");
                *pending = samples.end;
                let reads = self.drivings_of(layer, &samples).len();
                self.charge_accumulate(layer, reads);
                // the sum of a cell is read and stored again
                self.charge_cells(layer, Event::SramBits, 2 * SUM_BITS * reads as u64);
                self.time(|schedule, cycles| schedule.add(cycles, layer, &samples));
            }
            Write::Program => {
                let rounded = self.hardware.write.scheme == WriteScheme::Rounded;
                assert!(rounded, "trains write one sample at a time");
                let added = std::mem::take(pending);
                self.program(layer, 0..added, shift);
                // read and cleared
                self.charge_cells(layer, Event::SramBits, 2 * SUM_BITS);
                self.charge_time(layer, write, &samples);
            }
            Write::Now => {
                let plain = self.layers[layer].requests.are_plain();
                assert!(plain, "optimisers and centred updates write a batch at once");
                assert!(*pending == 0 && samples.len() == 1, "now takes one sample");
                if let WriteScheme::Trains { slots_log2 } = self.hardware.write.scheme {
                    self.levels_moved(layer);
                    return self.write_trains(layer, samples.start, shift, slots_log2);
                }
                let reads = self.layers[layer].spec.drivings();
                self.charge_accumulate(layer, reads);
                if reads > 1 {
                    // sums of more than one product lie in memory until they are written
                    let sums = 2 * SUM_BITS * (reads as u64 + 1);
                    self.charge_cells(layer, Event::SramBits, sums);
                }
                self.program(layer, samples.clone(), shift);
                self.charge_time(layer, write, &samples);
            }
        }
    }

    /// Charges a write's time and what depends on it.
    fn charge_time(&mut self, layer: usize, write: Write, samples: &Range<usize>) {
        let Some(timing) = self.hardware.timing else { return };
        let pulses = self.take_pulses(layer);
        let passes = Passes::new(&self.hardware, timing, &self.layers[layer], pulses.as_ref());
        let (wiring, copies) = (self.layers[layer].spec.wiring, self.copies_of(layer));
        for &target in wiring.targets() {
            let code = Self::code_of(wiring, target);
            // drivers of every copy move
            let count = copies * passes.by_target[target.index()];
            self.charge(layer, code, During::Update, Event::RowPulses, count);
        }
        let looks = self.layers[layer].requests.optimiser.looks_at_layer();
        let busy = (looks, passes.busy);
        self.time(|schedule, cycles| schedule.program(cycles, layer, write, samples, busy));
    }

    /// Charges something of every cell of every array.
    pub(super) fn charge_cells(&mut self, layer: usize, event: Event, each: u64) {
        let cells = self.layers[layer].layout.cells() as u64;
        for pathway in self.layers[layer].spec.wiring.pathways() {
            self.charge(layer, pathway.code, During::Update, event, cells * each);
        }
    }

    fn charge_accumulate(&mut self, layer: usize, samples: usize) {
        self.charge_cells(layer, Event::Accumulates, samples as u64);
    }

    /// Programs the sums over `samples` and counts one write of each array.
    fn program(&mut self, layer: usize, samples: Range<usize>, shift: u32) {
        let (wiring, copies) = (self.layers[layer].spec.wiring, self.copies_of(layer));
        self.levels_moved(layer);
        self.registers[layer].pulses = Pulses::none(self.collect, &self.layers[layer]);
        // words are moved by a write of nothing too
        let moves = self.layers[layer].requests.optimiser.memory().0 > 0;
        if !samples.is_empty() || moves {
            let counts = self.program_some(layer, &samples, shift);
            for (array, counts) in counts {
                let code = wiring.pathways()[array].code;
                for (event, count) in [
                    (Event::Requested, counts.requested),
                    (Event::Bounded, counts.bounded),
                    (Event::PulsesAttempted, counts.attempted),
                    (Event::PulsesEffective, counts.effective),
                    (Event::VerifyReads, copies * verified(self.hardware.timing, counts)),
                    (Event::PulsesCopied, (copies - 1) * counts.attempted),
                ] {
                    self.charge(layer, code, During::Update, event, count);
                }
            }
        }
        self.end_writes(layer);
        self.charge_cells(layer, Event::DeltaComputations, 1);
        let remainder = 2 * u64::from(self.hardware.write.residual_bits.get());
        self.charge_cells(layer, Event::SramBits, remainder);
        self.charge_requests(layer);
    }

    fn program_some(
        &mut self,
        layer: usize,
        samples: &Range<usize>,
        shift: u32,
    ) -> Vec<(usize, WriteCounts)> {
        let reads = &self.reads_of(layer, samples);
        let samples = &self.drivings_of(layer, samples);
        let stride = stride_of(samples.len());
        let sets = self.layers[layer].spec.drive_sets();
        let convolution = self.layers[layer].spec.convolution.is_some();
        // taken, so that cells can be written while they are read
        let mut kept = std::mem::take(&mut self.registers[layer].turned);
        let mut live: Vec<Vec<bool>> = vec![];
        if !convolution {
            let sets = sets.iter().zip(&mut kept);
            live.extend(sets.map(|(&set, turned)| self.turn(layer, set, samples, turned)));
        }
        let images = std::mem::take(&mut self.registers[layer].images);
        let registers = std::mem::take(&mut self.registers[layer].gates);
        let turned: Vec<Vec<_>> = kept
            .iter()
            .zip(&live)
            .map(|(turned, live)| {
                // of no samples, nothing
                let blocks = turned.chunks_exact((BLOCK_ROWS * stride).max(1));
                blocks.zip(live).map(|(block, live)| live.then_some(block)).collect()
            })
            .collect();
        let plan = self.registers[layer].plan.clone();
        let met = sets.iter().map(|&set| match (&plan, convolution && !samples.is_empty()) {
            (Some(plan), true) => {
                let image = Image::new(plan, &images[set.index()]);
                let windows = windows_of(&self.layers[layer].spec, &self.hardware, image);
                Met::Windows { windows, first: samples.start, count: samples.len() }
            }
            _ => Met::Turned(turned.get(set.index()).map_or(&[], |turned| &turned[..])),
        });
        let met = met.collect();
        let ready = self.ready(layer, reads, met, &registers, shift);
        let written = if self.layers[layer].requests.are_plain() {
            self.write_at_once(layer, &ready)
        } else {
            self.write_kept(layer, &ready, shift)
        };
        drop(ready);
        self.layers[layer].arrays.iter_mut().for_each(Crossbar::end_write);
        if let Some(pulses) = &mut self.registers[layer].pulses {
            for (array, first, part) in &written {
                pulses.merge(&self.layers[layer], *array, *first, &part.collected);
            }
        }
        self.registers[layer].turned = kept;
        self.registers[layer].images = images;
        self.registers[layer].gates = registers;
        written.into_iter().map(|(array, _, written)| (array, written.counts)).collect()
    }

    /// Makes the parts of a write ready, from turned drives and packed gates.
    fn ready<'a>(
        &self,
        layer: usize,
        reads: &Range<usize>,
        met: Vec<Met<'a>>,
        registers: &'a [Lines<i8>; 2],
        shift: u32,
    ) -> Ready<'a> {
        let this = &self.layers[layer];
        let (wiring, phases) = (this.spec.wiring, this.spec.driven_by.phases());
        let of = |target: Stream, polarity| {
            let gates = gates_of(&registers[target.index()], self.reads(layer), reads);
            let gates = if phases > 1 { both_ways(&gates, reads.len()) } else { gates };
            if self.potentiation_only { rectified(&gates, polarity) } else { gates }
        };
        let gates =
            wiring.pathways().iter().map(|pathway| of(pathway.target, pathway.polarity)).collect();
        let (write, window) = (&self.hardware.write, self.hardware.cell.window);
        let law = kernel::WriteLaw {
            shift: shift + wiring.shift_extra(),
            mantissa: i32::try_from(self.mantissas[layer]).expect("1..=15"),
            negate: false,
            increment_max: i32::try_from(write.increment_max.get()).expect("1..=127"),
            groups: u16::MAX,
            floor: window.floor(),
            ceiling: window.ceiling(),
            residual_bits: write.residual_bits.get(),
        };
        let arrays = wiring.pathways().iter().zip(&this.writes);
        let arrays = arrays.map(|(pathway, &count)| Array {
            set: this.spec.drives_of(pathway.source).index(),
            negate: pathway.polarity == Polarity::Inhibits,
            place: Place {
                seed: self.seed,
                site: Site::WriteDither,
                layer: this.index,
                pathway: pathway.code,
                sub: 0,
                count,
            },
        });
        Ready {
            samples: phases * reads.len(),
            stride: stride_of(phases * reads.len()),
            met,
            gates,
            law,
            dither: (write.dither_bits, write.dither_pattern),
            collect: self.collect,
            arrays: arrays.collect(),
        }
    }

    /// Writes strip by strip, all steps at once. Gives what came of each: its array, its first column, counts.
    fn write_at_once(&mut self, layer: usize, ready: &Ready<'_>) -> Vec<(usize, usize, Written)> {
        let this = &mut self.layers[layer];
        let work = this.layout.cells() * this.arrays.len() * ready.samples;
        let panels = this.layout.panels();
        let parts = strips(&mut this.arrays);
        each(&mut self.team, work, panels, parts, |kernel, (array, mut strip)| {
            let written = strip.write(kernel, &ready.request(array), ready.gates(array, &strip));
            (array, strip.panels().start * PANEL_COLUMNS, written)
        })
    }

    /// Turns a set of drives of some samples as an update takes it. Returns which blocks are driven at all.
    fn turn(
        &mut self,
        layer: usize,
        set: Stream,
        samples: &Range<usize>,
        turned: &mut AVec<u8>,
    ) -> Vec<bool> {
        let size = BLOCK_ROWS * stride_of(samples.len());
        let (blocks, reads) = (self.layers[layer].layout.blocks(), self.drivings(layer));
        turned.resize(blocks * size, 0);
        let drives = &self.registers[layer].drives[set.index()];
        let drives = drives.chunks_exact((reads * BLOCK_ROWS).max(1));
        let turned = turned.chunks_exact_mut(size.max(1));
        let parts = drives.zip(turned).enumerate().collect();
        each(&mut self.team, blocks * size * MOVE, blocks, parts, |kernel, (codes, turned)| {
            let codes = &codes[samples.start * BLOCK_ROWS..samples.end * BLOCK_ROWS];
            let live = kernel::is_driven(codes);
            if live {
                kernel.turn(codes, size / BLOCK_ROWS, turned);
            }
            live
        })
    }
}

/// Everything that a write of a layer is made of, but its cells.
pub(super) struct Ready<'a> {
    /// Products of a cell: reads, or drivings of rows where drives have a sign.
    pub(super) samples: usize,
    pub(super) stride: usize,
    /// By set of drives.
    pub(super) met: Vec<Met<'a>>,
    /// By array.
    gates: Vec<Cow<'a, [i8]>>,
    law: kernel::WriteLaw,
    dither: (DitherBits, DitherPattern),
    collect: Collect,
    pub(super) arrays: Vec<Array>,
}

/// What a write of a layer has of one array.
pub(super) struct Array {
    /// Whose drives are on its rows.
    pub(super) set: usize,
    /// Whether it inhibits.
    pub(super) negate: bool,
    place: Place,
}

impl Ready<'_> {
    /// How an array is written.
    pub(super) fn request(&self, array: usize) -> WriteRequest<'_> {
        let Array { set, negate, place } = self.arrays[array];
        WriteRequest {
            met: self.met[set],
            stride: self.stride,
            write: kernel::WriteLaw { negate, ..self.law },
            dither_bits: self.dither.0,
            dither_pattern: self.dither.1,
            place,
            collect: self.collect,
        }
    }

    /// Gates of the columns of a strip of an array.
    pub(super) fn gates(&self, array: usize, strip: &StripMut<'_>) -> &[i8] {
        let (panels, size) = (strip.panels(), PANEL_COLUMNS * self.stride);
        &self.gates[array][panels.start * size..panels.end * size]
    }
}

/// All arrays of a layer in strips, each with its array and beside the first of its panels.
pub(super) fn strips(arrays: &mut [Crossbar]) -> Vec<(usize, (usize, StripMut<'_>))> {
    let mut all = Vec::new();
    for (at, array) in arrays.iter_mut().enumerate() {
        let strips = array.strips_mut(Crossbar::STRIP_PANELS);
        all.extend(strips.map(|strip| (strip.panels().start, (at, strip))));
    }
    all
}

/// Bits of the sum of a cell in digital memory.
pub(super) const SUM_BITS: u64 = 32;

/// Cells read after pulses to see what those did: one a pulse that was given.
fn verified(timing: Option<Timing>, counts: WriteCounts) -> u64 {
    match timing {
        Some(Timing { verify: true, pulse_code: PulseCode::Unary, .. }) => counts.attempted,
        Some(Timing { verify: true, pulse_code: PulseCode::Amplitude, .. }) => counts.requested,
        _ => 0,
    }
}

/// Gates of so many reads as drives with a sign meet them: as they are, then, for what lies below 0, turned round.
fn both_ways(gates: &[i8], reads: usize) -> Cow<'static, [i8]> {
    let (from, to) = (stride_of(reads), stride_of(2 * reads));
    let units = gates.len().checked_div(from).unwrap_or(0);
    let mut out = vec![0; units * to];
    for unit in 0..units {
        for read in 0..reads {
            let gate = gates[packed_at(from, read, unit)];
            out[packed_at(to, 2 * read, unit)] = gate;
            out[packed_at(to, 2 * read + 1, unit)] = -gate;
        }
    }
    Cow::Owned(out)
}

/// Gates that may only potentiate: excitatory arrays take positive ones, inhibitory arrays negative ones.
fn rectified(gates: &[i8], polarity: Polarity) -> Cow<'static, [i8]> {
    let gate = |&gate: &i8| match polarity {
        Polarity::Excites => gate.max(0),
        Polarity::Inhibits => gate.min(0),
    };
    gates.iter().map(gate).collect()
}
