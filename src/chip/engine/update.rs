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
use super::error::{gates_of, stride_of};
use super::passes::Passes;
use super::pulses::Pulses;
use super::{Engine, Write};
use crate::chip::crossbar::kernel::{self, WriteCounts};
use crate::chip::crossbar::layout::{BLOCK_ROWS, PANEL_COLUMNS};
use crate::chip::crossbar::{Crossbar, StripMut, WriteRequest};
use crate::chip::hardware::{PulseCode, Timing, WriteScheme};
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
                self.charge_accumulate(layer, samples.len());
                // the sum of a cell is read and stored again
                self.charge_cells(layer, Event::SramBits, 2 * SUM_BITS * samples.len() as u64);
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
                assert!(*pending == 0 && samples.len() == 1, "now takes one sample");
                if let WriteScheme::Trains { slots_log2 } = self.hardware.write.scheme {
                    self.row_sums[layer] = None;
                    return self.write_trains(layer, samples.start, shift, slots_log2);
                }
                self.charge_accumulate(layer, 1);
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
        let wiring = self.layers[layer].spec.wiring;
        for &target in wiring.targets() {
            let code = Self::code_of(wiring, target);
            let count = passes.by_target[target.index()];
            self.charge(layer, code, During::Update, Event::RowPulses, count);
        }
        self.time(|schedule, cycles| schedule.program(cycles, layer, write, samples, passes.busy));
    }

    /// Charges something of every cell of every array.
    fn charge_cells(&mut self, layer: usize, event: Event, each: u64) {
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
        let wiring = self.layers[layer].spec.wiring;
        self.row_sums[layer] = None;
        self.registers[layer].pulses = Pulses::none(self.collect, &self.layers[layer]);
        if !samples.is_empty() {
            let counts = self.program_some(layer, &samples, shift);
            for (array, counts) in counts {
                let code = wiring.pathways()[array].code;
                for (event, count) in [
                    (Event::Requested, counts.requested),
                    (Event::Bounded, counts.bounded),
                    (Event::PulsesAttempted, counts.attempted),
                    (Event::PulsesEffective, counts.effective),
                    (Event::VerifyReads, verified(self.hardware.timing, counts)),
                ] {
                    self.charge(layer, code, During::Update, event, count);
                }
            }
        }
        self.layers[layer].writes.iter_mut().for_each(|writes| *writes += 1);
        self.charge_cells(layer, Event::DeltaComputations, 1);
        let remainder = 2 * u64::from(self.hardware.write.residual_bits.get());
        self.charge_cells(layer, Event::SramBits, remainder);
    }

    fn program_some(
        &mut self,
        layer: usize,
        samples: &Range<usize>,
        shift: u32,
    ) -> Vec<(usize, WriteCounts)> {
        let wiring = self.layers[layer].spec.wiring;
        let stride = stride_of(samples.len());
        let sets = self.layers[layer].spec.drive_sets();
        // taken, so that cells can be written while they are read
        let mut kept = std::mem::take(&mut self.registers[layer].turned);
        let live: Vec<_> = sets
            .iter()
            .zip(&mut kept)
            .map(|(&set, turned)| self.turn(layer, set, samples, turned))
            .collect();
        let turned: Vec<Vec<_>> = kept
            .iter()
            .zip(&live)
            .map(|(turned, live)| {
                let blocks = turned.chunks_exact(BLOCK_ROWS * stride);
                blocks.zip(live).map(|(block, live)| live.then_some(block)).collect()
            })
            .collect();
        let registers = std::mem::take(&mut self.registers[layer].gates);
        let of = |target: Stream, polarity| {
            let gates = gates_of(&registers[target.index()], self.samples, samples);
            if self.potentiation_only { rectified(&gates, polarity) } else { gates }
        };
        let gates: Vec<_> =
            wiring.pathways().iter().map(|pathway| of(pathway.target, pathway.polarity)).collect();
        let (write, window) = (self.hardware.write.clone(), self.hardware.cell.window);
        let base = kernel::WriteLaw {
            shift: shift + wiring.shift_extra(),
            mantissa: i32::try_from(self.mantissas[layer]).expect("1..=15"),
            negate: false,
            increment_max: i32::try_from(write.increment_max.get()).expect("1..=127"),
            groups: u16::MAX,
            floor: window.floor(),
            ceiling: window.ceiling(),
            residual_bits: write.residual_bits.get(),
        };
        let (seed, collect) = (self.seed, self.collect);
        let this = &mut self.layers[layer];
        let (index, spec) = (this.index, this.spec.clone());
        let request = |array: usize, count: u64| {
            let pathway = wiring.pathways()[array];
            WriteRequest {
                turned: &turned[spec.drives_of(pathway.source).index()],
                stride,
                write: kernel::WriteLaw { negate: pathway.polarity == Polarity::Inhibits, ..base },
                dither_bits: write.dither_bits,
                dither_pattern: write.dither_pattern,
                place: Place {
                    seed,
                    site: Site::WriteDither,
                    layer: index,
                    pathway: pathway.code,
                    sub: 0,
                    count,
                },
                collect,
            }
        };
        let work = this.layout.cells() * this.arrays.len() * samples.len();
        let mut strips: Vec<(usize, StripMut<'_>)> = Vec::new();
        for (at, array) in this.arrays.iter_mut().enumerate() {
            strips.extend(array.strips_mut(Crossbar::STRIP_PANELS).map(|strip| (at, strip)));
        }
        let writes = &this.writes;
        let panel_gates = PANEL_COLUMNS * stride;
        let panels = this.layout.panels();
        let parts = strips.into_iter().map(|strip| (strip.1.panels().start, strip)).collect();
        let written = each(&mut self.team, work, panels, parts, |kernel, (array, mut strip)| {
            let panels = strip.panels();
            let gates = &gates[array][panels.start * panel_gates..panels.end * panel_gates];
            let written = strip.write(kernel, &request(array, writes[array]), gates);
            (array, panels.start * PANEL_COLUMNS, written)
        });
        drop((gates, turned));
        if let Some(pulses) = &mut self.registers[layer].pulses {
            for (array, first, part) in &written {
                pulses.merge(&self.layers[layer], *array, *first, &part.collected);
            }
        }
        self.registers[layer].turned = kept;
        self.registers[layer].gates = registers;
        written.into_iter().map(|(array, _, written)| (array, written.counts)).collect()
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
        let blocks = self.layers[layer].layout.blocks();
        turned.resize(blocks * size, 0);
        let drives = &self.registers[layer].drives[set.index()];
        let drives = drives.chunks_exact(self.samples * BLOCK_ROWS);
        let parts = drives.zip(turned.chunks_exact_mut(size)).enumerate().collect();
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

/// Bits of the sum of a cell in digital memory.
const SUM_BITS: u64 = 32;

/// Cells read after pulses to see what those did: one a pulse that was given.
fn verified(timing: Option<Timing>, counts: WriteCounts) -> u64 {
    match timing {
        Some(Timing { verify: true, pulse_code: PulseCode::Unary, .. }) => counts.attempted,
        Some(Timing { verify: true, pulse_code: PulseCode::Amplitude, .. }) => counts.requested,
        _ => 0,
    }
}

/// Gates that may only potentiate: excitatory arrays take positive ones, inhibitory arrays negative ones.
fn rectified(gates: &[i8], polarity: Polarity) -> Cow<'static, [i8]> {
    let gate = |&gate: &i8| match polarity {
        Polarity::Excites => gate.max(0),
        Polarity::Inhibits => gate.min(0),
    };
    gates.iter().map(gate).collect()
}
