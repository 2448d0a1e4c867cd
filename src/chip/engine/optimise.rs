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

use super::Engine;
use super::each::each;
use super::update::{Ready, SUM_BITS, strips};
use crate::chip::crossbar::kernel::{MEAN_BITS, SignLaw, joined};
use crate::chip::crossbar::layout::{BLOCK_ROWS, PANEL_COLUMNS};
use crate::chip::crossbar::{Asks, Crossbar, Form, Written};
use crate::chip::layer::Optimiser;
use crate::chip::layer::requests::{dead_zone, first_mean, next_mean};
use crate::chip::ledger::{During, Event};

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
            layer.requests.optimiser = optimiser;
        }
    }

    /// Sets which layers are centred, and with which window: that many samples, as a power of two, move a mean by what it is
    /// off. Means are forgotten.
    ///
    /// # Panics
    /// When there is not one a layer.
    pub fn set_centred(&mut self, windows_log2: &[Option<u32>]) {
        assert_eq!(windows_log2.len(), self.layers.len(), "one window a layer");
        for (layer, &window) in self.layers.iter_mut().zip(windows_log2) {
            let (sets, rows) = (layer.spec.drive_sets(), layer.layout.rows_padded());
            layer.requests.set_window(window, sets, rows);
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
        let samples = ready.samples as i64;
        if let (Some(codes), true) = (&codes, first) {
            move_means(&mut this.requests.means, codes, |_, codes| first_mean(codes, samples));
        }
        let mut kept = std::mem::take(&mut self.registers[layer].sums);
        let work = this.layout.cells() * this.arrays.len() * ready.samples;
        let panels = this.layout.panels();
        let (requests, layout) = (&this.requests, this.layout);
        let parts = strips(&mut this.arrays);
        let strip_cells = Crossbar::STRIP_PANELS * layout.panel_cells();
        kept.resize(ready.arrays.len() * layout.cells_padded(), 0);
        let sums = kept.chunks_exact_mut(layout.cells_padded());
        let sums = sums.flat_map(|array| array.chunks_mut(strip_cells));
        let parts = parts.into_iter().zip(sums);
        let parts = parts.map(|((place, (array, strip)), sums)| (place, (array, strip, sums)));
        let formed = each(&mut self.team, work, panels, parts.collect(), |kernel, part| {
            let (array, strip, sums) = part;
            let means = requests.window_log2.map(|_| &requests.means[ready.arrays[array].set][..]);
            let form = Form { means, squares: requests.optimiser.looks_at_layer() };
            let gates = ready.gates(array, &strip);
            let squares = strip.form(kernel, &ready.request(array), gates, form, sums);
            (strip.panels().start, (array, strip, &*sums), squares)
        });
        let squares: u128 = formed.iter().map(|(.., squares)| joined(*squares)).sum();
        let cells = (layout.cells() * ready.arrays.len()) as u64;
        let least = match requests.optimiser {
            Optimiser::Sign { dead_zone: true } => 1 << dead_zone(squares, cells),
            Optimiser::Sign { dead_zone: false } | Optimiser::Plain => 1,
        };
        let pulse_shift = shift + this.spec.wiring.shift_extra();
        let asks = |negate| match requests.optimiser {
            Optimiser::Sign { .. } => Asks::Signs(SignLaw::new(least, pulse_shift, negate)),
            Optimiser::Plain => Asks::Rounded,
        };
        let finer = if requests.window_log2.is_some() { MEAN_BITS } else { 0 };
        let parts = formed.into_iter().map(|(place, part, _)| (place, part)).collect();
        let written =
            each(&mut self.team, work, panels, parts, |kernel, (array, mut strip, sums)| {
                let mut request = ready.request(array);
                request.write.shift += finer;
                let asks = asks(request.write.negate);
                let written = strip.write_kept(kernel, &request, sums, asks);
                (array, strip.panels().start * PANEL_COLUMNS, written)
            });
        if let (Some(codes), Some(window), false) = (&codes, requests.window_log2, first) {
            let requests = &mut self.layers[layer].requests;
            let next = |mean, codes| next_mean(mean, codes, samples, window);
            move_means(&mut requests.means, codes, next);
        }
        self.registers[layer].sums = kept;
        written
    }

    /// Sums of the drive codes of each row, padded, by set of drives.
    fn codes(&self, layer: usize, ready: &Ready<'_>) -> [Vec<i64>; 2] {
        let mut codes = [vec![], vec![]];
        for (set, turned) in self.layers[layer].spec.drive_sets().iter().zip(&ready.turned) {
            for block in turned {
                let row = |row: &[u8]| -> i64 {
                    row.iter().map(|&code| u32::from(code)).sum::<u32>().into()
                };
                match block {
                    Some(rows) => {
                        codes[set.index()].extend(rows.chunks_exact(ready.stride).map(row))
                    }
                    None => codes[set.index()].extend([0; BLOCK_ROWS]),
                }
            }
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
        let looks = optimiser.looks_at_layer();
        if optimiser != Optimiser::Plain {
            self.charge_cells(layer, Event::OptimiserSteps, 1);
        }
        if looks {
            self.charge_cells(layer, Event::SumSquares, 1);
            self.charge_cells(layer, Event::SramBits, SUM_BITS);
        }
        if !centred {
            return;
        }
        let mut means = |code, count| {
            self.charge(layer, code, During::Update, Event::RowMeans, count);
            self.charge(layer, code, During::Update, Event::SramBits, MEAN_WIDTH * count);
        };
        // used by every array in each pass, and kept once a set of drives
        let pathways = spec.wiring.pathways();
        pathways.iter().for_each(|pathway| means(pathway.code, rows * (1 + u64::from(looks))));
        for &set in spec.drive_sets() {
            let first = pathways.iter().find(|pathway| spec.drives_of(pathway.source) == set);
            means(first.expect("drives drive an array").code, rows);
        }
    }
}

/// Gives every mean another value, of what it is and of the sum of the codes of its row.
fn move_means(means: &mut [Vec<i32>; 2], codes: &[Vec<i64>; 2], to: impl Fn(i64, i64) -> i64) {
    for (means, codes) in means.iter_mut().zip(codes) {
        for (mean, &codes) in means.iter_mut().zip(codes) {
            *mean = i32::try_from(to((*mean).into(), codes)).expect("a mean of codes");
        }
    }
}
