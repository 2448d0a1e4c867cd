//! Reads of layers in a pipeline: a layer takes a sample when the one below has handed it on; stages behind a layer, which no
//! command begins, take a sample each.
//!
//! A convolution is read once a position, read after read, or as many at a time as its arrays have copies; a sample is handed on after its last.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use std::ops::Range;

use super::pool::Pooler;
use super::{Command, Network, Span, TickLayer};
use crate::chip::engine::Phase;
use crate::chip::ledger::{During, Event, Interval};
use crate::chip::population::Stream;

impl Network {
    /// `FWD(rows)` of layers in a pipeline.
    pub(super) fn reads(&mut self, layers: Range<usize>, samples: usize) {
        let count = self.layers.len();
        let training = self.phase == Phase::Training;
        layers.clone().for_each(|layer| self.layers[layer].note(training));
        let positions: Vec<usize> = self.layers.iter().map(TickLayer::positions).collect();
        // reads that commands were given for, reads that lanes have seen, and samples that were handed on
        let (mut issued, mut seen, mut done) =
            (vec![0usize; count], vec![0usize; count], vec![0; count]);
        // cycles for which the next command has been offered
        let mut offered = vec![0; count];
        let mut started = vec![vec![]; count];
        let beat = self.timing.beat;
        while done[layers.end - 1] < samples {
            self.begin(Interval::Forward);
            for layer in layers.clone() {
                let command = Command::Forward { slot: issued[layer] };
                let sample = issued[layer] / positions[layer];
                let there = layer == layers.start || done[layer - 1] > sample;
                let offer = sample < samples && there && self.layers[layer].ready(&command);
                offered[layer] = if offer { offered[layer] + 1 } else { 0 };
                if offered[layer] == 1 && issued[layer].is_multiple_of(positions[layer]) {
                    started[layer].push(self.clock);
                }
                let given = (offered[layer] == beat).then_some(command);
                self.account(layer, During::ForwardRows, offer);
                self.layers[layer].cycle(given.as_ref(), &[]);
                if given.is_some() {
                    issued[layer] += self.layers[layer].together(issued[layer]);
                    offered[layer] = 0;
                }
            }
            self.end();
            for layer in layers.clone() {
                if self.leave_pool(layer, done[layer]) || self.leave_stage(layer, done[layer]) {
                    done[layer] += 1;
                }
                if self.layers[layer].looked_up() {
                    self.layers[layer].gather_units(seen[layer]);
                    seen[layer] += self.layers[layer].together(seen[layer]);
                    // the last read of a sample
                    if seen[layer].is_multiple_of(positions[layer]) {
                        let sample = seen[layer] / positions[layer] - 1;
                        done[layer] += usize::from(self.put_out(layer, sample));
                        let (start, end) = (started[layer][sample], self.clock);
                        let (layer, sample) = (Some(layer), Some(sample));
                        self.watch.span(Span { layer, name: "FWD(rows)", sample, start, end });
                    }
                }
                self.layers[layer].start_stages();
            }
        }
        for layer in layers {
            self.take_events(layer, During::ForwardRows, false);
            self.layers[layer].take_rails(training);
            self.layers[layer].gather_readings();
        }
    }

    /// `FWD(columns)` of a sample: read after read of its positions, in a pipeline.
    pub(super) fn columns(&mut self, layer: usize, sample: usize) {
        let start = self.clock;
        let (positions, beat) = (self.layers[layer].positions(), self.timing.beat);
        let during = During::ForwardColumns;
        self.layers[layer].set_up();
        let (mut issued, mut seen, mut offered, mut added) = (0, 0, 0, 0);
        while seen < positions {
            self.begin(Interval::Columns);
            let command = Command::Columns { slot: sample * positions + issued };
            let offer = issued < positions && self.layers[layer].ready(&command);
            offered = if offer { offered + 1 } else { 0 };
            let given = (offered == beat).then_some(command);
            self.account(layer, during, offer);
            self.layers[layer].cycle(given.as_ref(), &[]);
            if given.is_some() {
                issued += self.layers[layer].together(issued);
                offered = 0;
            }
            self.end();
            if self.layers[layer].looked_up() {
                let this = &mut self.layers[layer];
                let together = seen..seen + this.together(seen);
                for position in together.clone() {
                    added += this.keep_backward((sample, self.samples), position);
                }
                seen = together.end;
            }
        }
        let span = Span {
            layer: Some(layer),
            name: "FWD(columns)",
            sample: Some(sample),
            start,
            end: self.clock,
        };
        self.watch.span(span);
        self.take_events(layer, during, false);
        let this = &self.layers[layer];
        let code = this.unit_code(Stream::P);
        // a sum of a pixel is read and stored; what is handed down is kept as words
        let bits = 64 * added + 16 * this.sample_sums() as u64;
        self.charge(layer, code, during, Event::ShiftAdds, added);
        self.charge(layer, code, during, Event::SramBits, bits);
    }

    /// Lanes have seen all of a sample; true when it needs no stage behind them and is handed on.
    fn put_out(&mut self, layer: usize, sample: usize) -> bool {
        let this = &mut self.layers[layer];
        if this.normalise() || this.pool(sample) {
            return false;
        }
        self.hand_on(layer, sample);
        true
    }

    /// A cycle of the pool behind a layer, if it has one; true when a sample leaves it and is handed on.
    fn leave_pool(&mut self, layer: usize, sample: usize) -> bool {
        let pooler = self.layers[layer].pooler.as_mut();
        let Some(streams) = pooler.and_then(Pooler::cycle) else { return false };
        for pooled in streams {
            let code = self.layers[layer].unit_code(pooled.stream);
            // a code is stored and fetched
            let (count, bits) = (pooled.looked_at, 16 * pooled.looked_at);
            self.charge(layer, code, During::ForwardRows, Event::Pooled, count);
            self.charge(layer, code, During::ForwardRows, Event::SramBits, bits);
            self.layers[layer + 1].load_codes(Some(pooled.stream), sample, &pooled.to);
        }
        true
    }

    /// A cycle of the stage behind a layer that is normalised; true when a sample leaves it and is handed on.
    fn leave_stage(&mut self, layer: usize, sample: usize) -> bool {
        let stage = self.layers[layer].normaliser.as_mut();
        let Some(streams) = stage.and_then(|stage| stage.cycle()) else { return false };
        for (target, normal) in streams {
            self.layers[layer].set_units(target, sample, &normal);
            let code = self.layers[layer].unit_code(target);
            let [squares, roots, scalings, bounded] = normal.counts;
            // an accumulator is stored and fetched twice, activity and derivative are stored
            let bits = squares * (32 + 32) + scalings * (32 + 16);
            for (event, count) in [
                (Event::Squares, squares),
                (Event::Roots, roots),
                (Event::Scalings, scalings),
                (Event::SaturatedLookUps, bounded),
                (Event::SramBits, bits),
            ] {
                self.charge(layer, code, During::ForwardRows, event, count);
            }
        }
        self.hand_on(layer, sample);
        true
    }

    /// A sample's activities become drives of the next layer, or outputs.
    fn hand_on(&mut self, layer: usize, sample: usize) {
        let last = layer + 1 == self.layers.len();
        if last {
            self.layers[layer].keep_outputs(sample);
            return;
        }
        let (head, tail) = self.layers.split_at_mut(layer + 1);
        let streams = head[layer].targets();
        for stream in streams {
            let codes = head[layer].codes_of(stream, sample);
            tail[0].load_codes(Some(stream), sample, &codes);
        }
    }
}
