//! `ERR` and `UPD`: taps, gates, outer-product sums, programming.
//!
//! ```text
//! err      word of the unit's tap; more than one tap: sat_eb( rsh(sum, tap_shift) ); stream n receives -err
//! u        sat_8( rsh( err * a', error_bits ) )
//! pp, nn   + a_source (x) u_target         np, pn   - a_source (x) u_target
//! pulses   clamp( SR(sum * m, k), -d_max, +d_max );   level   clamp( level + pulses, floor, ceiling )
//! ```
//!
//! `a` is the drive code the layer was read with. See docs/MODEL.md, 3.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use std::ops::Range;

use rayon::prelude::*;

use super::{Engine, Write};
use crate::chip::crossbar::kernel::{self, WriteCounts};
use crate::chip::crossbar::layout::{HALF_COLUMNS, PANEL_COLUMNS};
use crate::chip::crossbar::{PanelMut, WriteRequest};
use crate::chip::ledger::{During, Event};
use crate::chip::periphery;
use crate::chip::population::{Polarity, Stream};
use crate::num::draw::{Place, Site};
use crate::num::fixed::{rsh, sat};

impl Engine {
    pub(super) fn error(&mut self, layer: usize, samples: Range<usize>, words: &[i16]) {
        let this = &self.layers[layer];
        let (taps, units, wiring) = (&this.taps, this.layout.columns, this.spec.wiring);
        assert_eq!(words.len(), samples.len() * taps.width, "a word a bus slot and sample");
        // sums are formed when they are programmed: what they are formed of must still be there
        let pending = self.registers[layer].pending;
        assert!(samples.is_empty() || samples.start >= pending, "sums wait to be programmed");
        let bits = self.hardware.error_bits;
        let (loaded, padded) = (self.samples, this.layout.columns_padded());
        let registers = &mut self.registers[layer];
        let (mut saturated_words, mut saturated_gates) = (0, [0; 2]);
        for &target in wiring.targets() {
            registers.gates[target.index()].resize(loaded * padded, 0);
        }
        let mut latched = vec![0i16; units];
        for (sample, words) in samples.clone().zip(words.chunks_exact(taps.width)) {
            let own = latched.iter_mut().zip(taps.words.chunks_exact(taps.per_unit));
            for (err, tapped) in own {
                *err = if let [word] = *tapped {
                    words[usize::from(word)]
                } else {
                    let sum = tapped.iter().map(|&w| i64::from(words[usize::from(w)])).sum();
                    let (err, saturated) = sat(rsh(sum, taps.shift), bits.get());
                    saturated_words += u64::from(saturated);
                    err as i16
                };
            }
            for &target in wiring.targets() {
                let t = target.index();
                let sign = if target == Stream::N { -1 } else { 1 };
                for (panel, latched) in latched.chunks(PANEL_COLUMNS).enumerate() {
                    let at = (panel * loaded + sample) * PANEL_COLUMNS;
                    let derivative = &registers.derivative[t][at..];
                    let gates = &mut registers.gates[t][at..at + PANEL_COLUMNS];
                    // columns beyond the last unit: registers of a batch of another size lay elsewhere
                    gates[latched.len()..].fill(0);
                    for (gate, (&err, &slope)) in
                        gates.iter_mut().zip(latched.iter().zip(derivative))
                    {
                        let (u, saturated) = periphery::gate(sign * err, slope, bits);
                        saturated_gates[t] += u64::from(saturated);
                        *gate = u;
                    }
                }
            }
        }
        let (width, count) = (taps.width as u64, samples.len() as u64);
        for &target in wiring.targets() {
            let code = Self::code_of(wiring, target);
            let during = During::Error;
            self.charge(layer, code, during, Event::BusWords, width * count);
            self.charge(layer, code, during, Event::Multiplies, units as u64 * count);
            let saturated = saturated_gates[target.index()];
            self.charge(layer, code, during, Event::SaturatedGates, saturated);
        }
        let code = Self::code_of(wiring, Stream::P);
        self.charge(layer, code, During::Error, Event::SaturatedErrors, saturated_words);
    }

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
        let stride = samples.len().next_multiple_of(4);
        let rows = self.layers[layer].layout.rows_padded();
        let wiring = self.layers[layer].spec.wiring;
        let sources = if layer == 0 { 1 } else { wiring.sources().len() };
        let drives: Vec<_> = wiring.sources()[..sources]
            .iter()
            .map(|&source| transpose(self.drives(layer, source), rows, &samples, stride))
            .collect();
        let gates: Vec<_> = wiring
            .pathways()
            .iter()
            .map(|p| self.pack_gates(layer, p.target, p.polarity, &samples, stride))
            .collect();
        let hardware = self.hardware;
        let base = kernel::Write {
            shift: shift + wiring.shift_extra(),
            mantissa: i32::try_from(self.mantissa).expect("1..=15"),
            negate: false,
            increment_max: i32::try_from(hardware.increment_max.get()).expect("1..=127"),
            floor: hardware.window.floor(),
            ceiling: hardware.window.ceiling(),
            residual_bits: hardware.residual_bits.get(),
        };
        let (backend, seed) = (self.backend, self.seed);
        let this = &mut self.layers[layer];
        let index = this.index;
        let request = |array: usize, count: u64| {
            let pathway = wiring.pathways()[array];
            let source = if layer == 0 { 0 } else { pathway.source.index() };
            WriteRequest {
                backend,
                drives: &drives[source],
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
            }
        };
        let panel_gates = 2 * HALF_COLUMNS * stride;
        let mut panels: Vec<(usize, PanelMut<'_>)> = Vec::new();
        for (at, array) in this.arrays.iter_mut().enumerate() {
            panels.extend(array.panels_mut().map(|panel| (at, panel)));
        }
        let writes = &this.writes;
        let counts: Vec<(usize, WriteCounts)> = panels
            .par_iter_mut()
            .map(|(array, panel)| {
                let gates = &gates[*array][panel.panel() * panel_gates..][..panel_gates];
                (*array, panel.write(&request(*array, writes[*array]), gates))
            })
            .collect();
        drop(panels);
        this.writes.iter_mut().for_each(|writes| *writes += 1);
        let cells = this.layout.cells() as u64;
        for pathway in wiring.pathways() {
            self.charge(layer, pathway.code, During::Update, Event::DeltaComputations, cells);
        }
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

    /// Gates of a target stream as the kernels take them, `[panel][2 halves][stride / 4][16][4]`; rectified when
    /// only potentiation is allowed.
    fn pack_gates(
        &self,
        layer: usize,
        target: Stream,
        polarity: Polarity,
        samples: &Range<usize>,
        stride: usize,
    ) -> Vec<i8> {
        let gates = &self.registers[layer].gates[target.index()];
        let panel_size = 2 * HALF_COLUMNS * stride;
        let mut packed = vec![0; self.layers[layer].layout.panels() * panel_size];
        if samples.is_empty() {
            return packed;
        }
        let panels = gates.chunks_exact(self.samples * PANEL_COLUMNS);
        for (gates, packed) in panels.zip(packed.chunks_exact_mut(panel_size)) {
            for (b, sample) in samples.clone().enumerate() {
                let row = &gates[sample * PANEL_COLUMNS..][..PANEL_COLUMNS];
                for (c, &gate) in row.iter().enumerate() {
                    let gate = match polarity {
                        _ if !self.potentiation_only => gate,
                        Polarity::Excites => gate.max(0),
                        Polarity::Inhibits => gate.min(0),
                    };
                    let half = c / HALF_COLUMNS * HALF_COLUMNS * stride;
                    packed[half + b / 4 * 64 + c % HALF_COLUMNS * 4 + b % 4] = gate;
                }
            }
        }
        packed
    }
}

/// Drives of some samples, `[row][stride]`, padded with 0.
fn transpose(drives: &[u8], rows: usize, samples: &Range<usize>, stride: usize) -> Vec<u8> {
    let mut out = vec![0; rows * stride];
    for first in (0..rows).step_by(64) {
        for (b, sample) in samples.clone().enumerate() {
            let codes = &drives[sample * rows + first..][..64];
            for (row, &code) in codes.iter().enumerate() {
                out[(first + row) * stride + b] = code;
            }
        }
    }
    out
}
