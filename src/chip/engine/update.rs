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

use super::each::each;
use super::error::{gates_of, stride_of};
use super::pulses::Pulses;
use super::{Engine, Write};
use crate::chip::crossbar::kernel::{self, Kernel, WriteCounts};
use crate::chip::crossbar::layout::{BLOCK_ROWS, PANEL_COLUMNS};
use crate::chip::crossbar::{Crossbar, StripMut, WriteRequest};
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
            }
            Write::Program => {
                let added = std::mem::take(pending);
                self.program(layer, 0..added, shift);
            }
            Write::Now => {
                assert!(*pending == 0 && samples.len() == 1, "now takes one sample");
                self.charge_accumulate(layer, 1);
                self.program(layer, samples, shift);
            }
        }
    }

    fn charge_accumulate(&mut self, layer: usize, samples: usize) {
        let this = &self.layers[layer];
        let cells = this.layout.cells() as u64 * samples as u64;
        for pathway in this.spec.wiring.pathways() {
            self.charge(layer, pathway.code, During::Update, Event::Accumulates, cells);
        }
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
                ] {
                    self.charge(layer, code, During::Update, event, count);
                }
            }
        }
        self.layers[layer].writes.iter_mut().for_each(|writes| *writes += 1);
        let cells = self.layers[layer].layout.cells() as u64;
        for pathway in wiring.pathways() {
            self.charge(layer, pathway.code, During::Update, Event::DeltaComputations, cells);
        }
    }

    fn program_some(
        &mut self,
        layer: usize,
        samples: &Range<usize>,
        shift: u32,
    ) -> Vec<(usize, WriteCounts)> {
        let wiring = self.layers[layer].spec.wiring;
        let stride = stride_of(samples.len());
        let sources = if layer == 0 { &[Stream::P][..] } else { wiring.sources() };
        // taken, so that cells can be written while they are read
        let mut kept = std::mem::take(&mut self.registers[layer].turned);
        let live: Vec<_> = sources
            .iter()
            .zip(&mut kept)
            .map(|(&source, turned)| self.turn(layer, source, samples, turned))
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
        let hardware = self.hardware;
        let base = kernel::Write {
            shift: shift + wiring.shift_extra(),
            mantissa: i32::try_from(self.mantissa).expect("1..=15"),
            negate: false,
            increment_max: i32::try_from(hardware.increment_max.get()).expect("1..=127"),
            groups: u16::MAX,
            floor: hardware.window.floor(),
            ceiling: hardware.window.ceiling(),
            residual_bits: hardware.residual_bits.get(),
        };
        let (backend, seed, collect) = (self.backend, self.seed, self.collect);
        let this = &mut self.layers[layer];
        let index = this.index;
        let request = |array: usize, count: u64| {
            let pathway = wiring.pathways()[array];
            let source = if layer == 0 { 0 } else { pathway.source.index() };
            WriteRequest {
                turned: &turned[source],
                stride,
                write: kernel::Write { negate: pathway.polarity == Polarity::Inhibits, ..base },
                dither_bits: hardware.dither_bits,
                dither_pattern: hardware.dither_pattern,
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
        let written = each(work, strips, |(array, mut strip)| {
            let panels = strip.panels();
            let gates = &gates[array][panels.start * panel_gates..panels.end * panel_gates];
            let kernel = Kernel::start(backend);
            let written = strip.write(&kernel, &request(array, writes[array]), gates);
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

    /// Turns the drives of some samples as an update takes them. Returns which blocks are driven at all.
    fn turn(
        &self,
        layer: usize,
        source: Stream,
        samples: &Range<usize>,
        turned: &mut AVec<u8>,
    ) -> Vec<bool> {
        let size = BLOCK_ROWS * stride_of(samples.len());
        let kernel = Kernel::start(self.backend);
        turned.resize(self.layers[layer].layout.blocks() * size, 0);
        let drives = self.drives(layer, source).chunks_exact(self.samples * BLOCK_ROWS);
        let blocks = drives.zip(turned.chunks_exact_mut(size));
        blocks
            .map(|(codes, turned)| {
                let codes = &codes[samples.start * BLOCK_ROWS..samples.end * BLOCK_ROWS];
                let live = codes.iter().any(|&code| code != 0);
                if live {
                    kernel.turn(codes, size / BLOCK_ROWS, turned);
                }
                live
            })
            .collect()
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
