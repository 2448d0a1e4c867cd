//! `UPD(write)` of a layer whose sums are not asked for as they are: optimisers and centred updates.
//!
//! ```text
//! sums of all arrays  ->  means taken off  ->  Z, where the optimiser looks at the layer  ->  pulses  ->  means move on
//! second pass         beat (rows NG + ceil(log2(tiles)))            before the first pulse, where Z is formed
//! ```
//!
//! What is asked for, and what that remembers: `chip::layer::requests`. See docs/MODEL.md, 3.10.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

#[cfg(test)]
mod tests;

use std::borrow::Cow;

use super::Engine;
use super::each::each;
use super::update::{Array, Ready, SUM_BITS, strips};
use super::window::channel_sums;
use crate::chip::crossbar::kernel::{MEAN_BITS, SignLaw};
use crate::chip::crossbar::layout::{BLOCK_ROWS, PANEL_COLUMNS};
use crate::chip::crossbar::{
    Adam, Asks, Crossbar, Form, LongSums, Met, Momentum, SHORT_READS, Written,
};
use crate::chip::layer::requests::{dead_zone, first_mean, next_mean};
use crate::chip::layer::{Optimiser, Requests};
use crate::chip::ledger::{During, Event};
use crate::chip::population::Polarity;
use crate::num::fixed::log2_ceil;
use crate::num::tables::Scales;

/// So many reads are multiplied again in less time than their sums take to memory and back.
const FORMED_AGAIN: usize = 128;
/// So many reads have centred sums that a mantissa leaves in 32 bits: 256 x 4080 x 127 x 15 < 2^31 - 2^27.
const SUMMED_SHORT: usize = 256;
const _: () = assert!(SUMMED_SHORT * 4080 * 127 * 15 < (1 << 31) - (1 << 27));
/// Bits of the mean of a row.
const MEAN_WIDTH: u64 = 8 + MEAN_BITS as u64;

impl Engine {
    /// Sets what makes requests of the sums of each layer. What optimisers remember is forgotten.
    ///
    /// # Panics
    /// When there is not one a layer.
    pub fn set_optimisers(&mut self, optimisers: &[Optimiser]) {
        assert_eq!(optimisers.len(), self.layers.len(), "one optimiser a layer");
        for (layer, &optimiser) in self.layers.iter_mut().zip(optimisers) {
            layer.requests.set_optimiser(optimiser, layer.spec.wiring, layer.layout);
        }
        let any = optimisers.contains(&Optimiser::Rms);
        self.scales = any.then(Scales::new);
    }

    /// Sets which layers are centred, and with which window: that many samples, as a power of two, move a mean by what it is
    /// off. Means are forgotten.
    ///
    /// # Panics
    /// When there is not one a layer.
    pub fn set_centred(&mut self, windows_log2: &[Option<u32>]) {
        assert_eq!(windows_log2.len(), self.layers.len(), "one window a layer");
        for (layer, &window) in self.layers.iter_mut().zip(windows_log2) {
            layer.requests.set_window(window, &layer.spec, layer.layout.rows_padded());
        }
    }

    /// Writes a layer in two passes over its sums.
    pub(super) fn write_kept(
        &mut self,
        layer: usize,
        ready: &Ready<'_>,
        shift: u32,
    ) -> Vec<(usize, usize, Written)> {
        let first = self.layers[layer].writes[0] == 0;
        let codes = self.layers[layer].requests.window_log2.map(|_| self.codes(layer, ready));
        let this = &mut self.layers[layer];
        // what a mean is taken over: samples, or the pixels below the windows of all of them
        let pixels = this.spec.convolution.map_or(1, |shape| shape.height * shape.width);
        let phases = this.spec.driven_by.phases();
        let samples = (ready.samples / this.spec.drivings() * pixels) as i64;
        let pixels_log2 = log2_ceil(pixels as u64);
        if let (Some(codes), true) = (&codes, first) {
            move_means(&mut this.requests.means, codes, |_, codes| first_mean(codes, samples));
        }
        let keep = this.spec.convolution.is_some() || ready.samples > FORMED_AGAIN;
        let mut kept = std::mem::take(&mut self.registers[layer].sums);
        let work = this.layout.cells() * this.arrays.len() * ready.samples;
        let panels = this.layout.panels();
        let (requests, layout) = (&this.requests, this.layout);
        let (window, optimiser) = (requests.window_log2, requests.optimiser);
        // what follows changes them
        let row_means = requests.by_row(&this.spec, layout.rows_padded()).map(Cow::into_owned);
        let form = |array: usize| {
            let Array { set, negate, .. } = ready.arrays[array];
            Form {
                means: window.map(|_| &row_means[set][..]),
                squares: looks_at(optimiser, negate),
                long: ready.samples > SHORT_READS,
                phases,
            }
        };
        let strip_cells = Crossbar::STRIP_PANELS * layout.panel_cells();
        let mut long: Vec<LongSums> = vec![];
        let mut squares = 0u128;
        if keep {
            kept.resize(ready.arrays.len() * layout.cells_padded(), 0);
            let sums = kept.chunks_exact_mut(layout.cells_padded());
            let sums = sums.flat_map(|array| array.chunks_mut(strip_cells));
            let parts = strips(&mut this.arrays).into_iter().zip(sums);
            let parts = parts.map(|((place, (array, strip)), sums)| (place, (array, strip, sums)));
            let formed = each(&mut self.team, work, panels, parts.collect(), |kernel, part| {
                let (array, strip, sums) = part;
                let gates = ready.gates(array, &strip);
                strip.form(kernel, &ready.request(array), gates, form(array), sums)
            });
            for (more, beyond) in formed {
                squares += more;
                long.push(beyond);
            }
        } else if optimiser.looks_at_layer() {
            let parts = strips(&mut this.arrays).into_iter();
            let parts = parts.filter(|(_, (array, _))| form(*array).squares).collect();
            let formed = each(&mut self.team, work, panels, parts, |kernel, (array, strip)| {
                let gates = ready.gates(array, &strip);
                strip.squares(kernel, &ready.request(array), gates, form(array))
            });
            squares = formed.into_iter().sum();
        }
        let finer = if window.is_some() { MEAN_BITS } else { 0 };
        let pairs = this.spec.wiring.shift_extra();
        let chance = shift + pairs;
        let (mut shift, mut scale) = (shift + pairs + finer, self.mantissas[layer]);
        let (mut least, mut silent) = (1u64, false);
        let Requests { followed, words, .. } = &mut this.requests;
        match optimiser {
            Optimiser::Plain | Optimiser::Sign { dead_zone: false } => {}
            Optimiser::Sign { dead_zone: true } => {
                let zone = dead_zone(squares, (layout.cells() * ready.arrays.len()) as u64);
                least = 1u64 << zone;
            }
            Optimiser::Rms => {
                let scales = self.scales.as_ref().expect("made with the optimiser");
                match followed.follow(squares, chance - pairs, scales) {
                    // centred sums have been squared as they are
                    Some(factor) => (scale, shift) = (factor.mantissa, factor.shift + pairs),
                    None => silent = true,
                }
            }
            Optimiser::Momentum { decay } => shift += decay,
            // fractional bits of the sums are rounded off before
            Optimiser::AdamFx { .. } => shift -= finer,
        }
        let strips_of = layout.cells_padded().div_ceil(strip_cells);
        let words = words.iter_mut().flat_map(|words| {
            let mut parts = words.each_mut().map(|words| words.chunks_mut(strip_cells));
            (0..strips_of).map(move |_| parts.each_mut().map(|p| p.next().unwrap_or_default()))
        });
        let parts = strips(&mut this.arrays).into_iter().zip(words).enumerate();
        let parts = parts.map(|(at, ((place, part), words))| (place, (at, part, words))).collect();
        let short = finer == 0 || ready.samples <= SUMMED_SHORT;
        let written = each(&mut self.team, work, panels, parts, |kernel, part| {
            let (at, (array, mut strip), [one, two]) = part;
            let mut request = ready.request(array);
            request.write.shift = shift;
            request.write.mantissa = i32::try_from(scale).expect("1..=15");
            let asks = match optimiser {
                _ if silent => Asks::Nothing,
                Optimiser::Plain | Optimiser::Rms if short && shift <= 31 => Asks::Narrow,
                Optimiser::Plain | Optimiser::Rms => Asks::Sums,
                Optimiser::Sign { .. } => {
                    let short = u32::try_from(least).unwrap_or(u32::MAX);
                    Asks::Signs(SignLaw::new(short, chance, request.write.negate), least)
                }
                Optimiser::Momentum { decay } => Asks::Momentum(Momentum { decay }, one),
                Optimiser::AdamFx { first_decay, second_decay } => {
                    let (begins, fraction) = (first, finer);
                    let adam = Adam { first_decay, second_decay, begins, fraction };
                    Asks::Adam(adam, [one, two])
                }
            };
            let first = strip.panels().start * PANEL_COLUMNS;
            let written = if keep {
                let from = array * layout.cells_padded() + first * layout.rows_padded();
                strip.write_kept(kernel, &request, (&kept[from..], &long[at]), asks)
            } else {
                let form = Form { squares: false, ..form(array) };
                let gates = ready.gates(array, &strip);
                strip.write_formed(kernel, &request, (gates, form), asks)
            };
            (array, first, written)
        });
        if let (Some(codes), Some(window), false) = (&codes, window, first) {
            let requests = &mut this.requests;
            let next = |mean, codes| next_mean(mean, codes, samples, window + pixels_log2);
            move_means(&mut requests.means, codes, next);
        }
        self.registers[layer].sums = kept;
        written
    }

    /// Sums of the drive codes of each row, padded, by set of drives.
    fn codes(&mut self, layer: usize, ready: &Ready<'_>) -> [Vec<i64>; 2] {
        let mut codes = [vec![], vec![]];
        let spec = &self.layers[layer].spec;
        let sets = spec.drive_sets();
        if let Some(shape) = spec.convolution {
            let samples = ready.samples / shape.positions();
            if samples == 0 {
                // a write of nothing
                let rows = shape.channels + usize::from(spec.constant_row);
                sets.iter().for_each(|set| codes[set.index()] = vec![0; rows]);
                return codes;
            }
            assert!(samples == self.samples, "means are taken of all that is loaded");
            let pixels = (samples * shape.height * shape.width) as i64;
            let constant = pixels * i64::from(self.hardware.drive.bits.code_max());
            for (set, met) in sets.iter().zip(&ready.met) {
                if let Met::Windows { windows, .. } = met {
                    codes[set.index()] = channel_sums(windows.image().codes(), shape.channels);
                }
                codes[set.index()].extend(spec.constant_row.then_some(constant));
            }
            return codes;
        }
        let signed = spec.driven_by.phases() > 1;
        let turned = ready.met.iter().flat_map(|met| match met {
            Met::Turned(turned) => *turned,
            Met::Windows { .. } => unreachable!("a dense layer has no windows"),
        });
        let blocks: Vec<_> = turned.copied().collect();
        let sums = self.team.alone(blocks, |kernel, block| {
            let of = |turned| match signed {
                true => signed_totals(turned, ready.stride),
                false => kernel.drive_totals(turned, ready.stride).map(i64::from),
            };
            block.map_or([0; BLOCK_ROWS], of)
        });
        let rows = sums.chunks((sums.len() / sets.len()).max(1));
        for (set, rows) in sets.iter().zip(rows) {
            codes[set.index()].extend(rows.as_flattened());
        }
        codes
    }

    /// Charges what optimisers and centring do at a write.
    pub(super) fn charge_requests(&mut self, layer: usize) {
        let this = &self.layers[layer];
        let requests = &this.requests;
        if requests.are_plain() {
            return;
        }
        let (optimiser, centred) = (requests.optimiser, requests.window_log2.is_some());
        let (rows, spec) = (this.layout.rows as u64, this.spec.clone());
        let cells = this.layout.cells() as u64;
        if optimiser != Optimiser::Plain {
            self.charge_cells(layer, Event::OptimiserSteps, 1);
            // words are read and stored again
            self.charge_cells(layer, Event::SramBits, 2 * u64::from(optimiser.memory().1));
        }
        for pathway in spec.wiring.pathways() {
            if looks_at(optimiser, pathway.polarity == Polarity::Inhibits) {
                let during = During::Update;
                self.charge(layer, pathway.code, during, Event::SumSquares, cells);
                self.charge(layer, pathway.code, during, Event::SramBits, SUM_BITS * cells);
            }
        }
        if !centred {
            return;
        }
        // codes with a sign have means with one
        let width = MEAN_WIDTH + u64::from(spec.driven_by.phases() > 1);
        let mut means = |code, count| {
            self.charge(layer, code, During::Update, Event::RowMeans, count);
            self.charge(layer, code, During::Update, Event::SramBits, width * count);
        };
        // used by every array in each pass that sees it, and kept once a set of drives, or a channel of it
        let constant = usize::from(spec.constant_row);
        let kept = spec.convolution.map_or(rows, |shape| (shape.channels + constant) as u64);
        let pathways = spec.wiring.pathways();
        for pathway in pathways {
            let looks = looks_at(optimiser, pathway.polarity == Polarity::Inhibits);
            means(pathway.code, rows * (1 + u64::from(looks)));
        }
        for &set in spec.drive_sets() {
            let first = pathways.iter().find(|pathway| spec.drives_of(pathway.source) == set);
            means(first.expect("drives drive an array").code, kept);
        }
    }
}

/// Sums of the codes of rows that are turned, `[64 rows][stride]`: of every two, the second lies below 0.
fn signed_totals(turned: &[u8], stride: usize) -> [i64; BLOCK_ROWS] {
    let mut totals = [0; BLOCK_ROWS];
    for (total, codes) in totals.iter_mut().zip(turned.chunks_exact(stride)) {
        let codes = codes.as_chunks::<2>().0.iter();
        *total = codes.map(|&[above, below]| i64::from(above) - i64::from(below)).sum();
    }
    totals
}

/// Whether an optimiser squares the sums of an array, which inhibits or excites.
const fn looks_at(optimiser: Optimiser, inhibits: bool) -> bool {
    optimiser.looks_at_layer() && (!inhibits || optimiser.looks_at_all())
}

/// Gives every mean another value, of what it is and of the sum of the codes of its row.
fn move_means(means: &mut [Vec<i32>; 2], codes: &[Vec<i64>; 2], to: impl Fn(i64, i64) -> i64) {
    for (means, codes) in means.iter_mut().zip(codes) {
        for (mean, &codes) in means.iter_mut().zip(codes) {
            *mean = i32::try_from(to((*mean).into(), codes)).expect("a mean of codes");
        }
    }
}
