//! Thresholds and steps of tables after the writes, a group of the lanes a beat.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use super::super::tile::TileBalance;
use super::{Event, Interval, Network, Span, TickLayer};
use crate::chip::layer::{Gain, Layer};
use crate::chip::ledger::{During, Part};
use crate::chip::population::Stream;
use crate::num::fixed::log2_ceil;

/// What a layer whose units keep to a middle has beside its tiles.
#[derive(Debug)]
pub(super) struct Balancing {
    /// Reads that move a mean by what it is off, as a power of two.
    window_log2: u32,
    lut_bits: u32,
    /// Units of all target streams.
    units: i128,
    threshold: bool,
    gain: bool,
    /// `V`, where the gain tracks.
    variance: Option<i64>,
}

impl Balancing {
    pub(super) fn of(layer: &Layer, lut_bits: u32) -> Option<Self> {
        let law = layer.spec.homeostasis;
        let lanes = layer.spec.wiring.targets().len() * layer.spec.units;
        law.is_on().then(|| Self {
            window_log2: law.window_log2 + log2_ceil(layer.spec.positions() as u64),
            lut_bits,
            units: lanes as i128,
            threshold: law.threshold,
            gain: law.gain != Gain::Table,
            variance: (law.gain == Gain::Tracking).then_some(layer.balance.variance()),
        })
    }

    const fn moves(&self) -> bool {
        self.threshold || self.variance.is_some()
    }
}

/// Registers of the columns of a tile, at its place in a layer.
pub(super) fn registers(
    layer: &Layer,
    target: Stream,
    columns: std::ops::Range<usize>,
) -> Option<TileBalance> {
    let (law, balance) = (layer.spec.homeostasis, &layer.balance);
    law.is_on().then(|| TileBalance {
        thresholds: match law.threshold {
            true => balance.thresholds(target)[columns].to_vec(),
            false => vec![],
        },
        shift: balance.shift(),
        tracks: law.gain == Gain::Tracking,
    })
}

impl TickLayer {
    /// Tiles that have lanes of a target, from left to right.
    fn head_tiles(&self, target: Stream) -> Vec<usize> {
        let first = self.at_head(target);
        (first..first + self.grid()[2]).collect()
    }

    /// Tiles whose lanes have a group of columns.
    fn tiles_with(&self, group: usize) -> Vec<usize> {
        let heads = self.targets().into_iter().flat_map(|target| self.head_tiles(target));
        heads.filter(|&tile| self.tiles[tile].has_group(group)).collect()
    }

    /// Whether its units look up in steps that follow what they read.
    pub(super) fn has_gain(&self) -> bool {
        self.balancing.as_ref().is_some_and(|balancing| balancing.gain)
    }

    /// The reads that come are added up, or are not.
    pub(super) fn note(&mut self, on: bool) {
        self.set_up();
        if self.balancing.is_some() {
            self.all_tiles().for_each(|tile| tile.note(on));
        }
    }

    /// Thresholds of a stream, by column.
    pub(super) fn thresholds(&self, target: Stream) -> Vec<i64> {
        let heads = self.head_tiles(target).into_iter();
        let of = |at: usize| self.tiles[at].balance().map(|own| own.thresholds.clone());
        heads.filter_map(of).flatten().collect()
    }

    /// Shift of the table, and the variance that it follows.
    pub(super) fn step(&self) -> (i32, Option<i64>) {
        let shift = self.tiles[0].balance().map_or(0, |own| own.shift);
        (shift, self.balancing.as_ref().and_then(|balancing| balancing.variance))
    }

    fn move_group(&mut self, group: usize) {
        let window = self.balancing.as_ref().expect("a layer that moves").window_log2;
        for target in self.targets() {
            for tile in self.head_tiles(target) {
                self.tiles[tile].move_thresholds(group, window);
            }
        }
    }

    /// Looks at the squares of all units, once.
    fn move_step(&mut self) {
        let (mut squares, mut reads) = (0, 0);
        for target in self.targets() {
            for tile in self.head_tiles(target) {
                let readings = self.tiles[tile].readings();
                squares += readings.squares;
                reads = readings.reads;
            }
        }
        let (mut shift, _) = self.step();
        let balancing = self.balancing.as_mut().expect("a layer that moves");
        if let Some(variance) = &mut balancing.variance {
            let off = i64::try_from(squares << 4).expect("the plan proves it") - reads * *variance;
            *variance += (off + ((1 << balancing.window_log2) >> 1)) >> balancing.window_log2;
            // 2^(lut_bits - 3) indices a deviation and 4 fractional bits: twice that, or 3/8 of it
            let nominal = balancing.units << (2 * balancing.lut_bits - 2);
            let seen = i128::from(*variance);
            if seen >= 2 * nominal && shift < 47 {
                shift += 1;
                *variance /= 4;
            } else if 8 * seen < 3 * nominal && shift > -8 {
                shift -= 1;
                *variance *= 4;
            }
        }
        self.tiles.iter_mut().for_each(|tile| tile.set_step(shift));
    }
}

impl Network {
    /// Thresholds of a layer, by unit of a target stream, with 8 fractional bits; none where it has none.
    #[must_use]
    pub fn thresholds(&self, layer: usize, target: Stream) -> Vec<i64> {
        self.layers[layer].thresholds(target)
    }

    /// Shift of the table of a layer that keeps to a middle, and the variance that it follows, if it does.
    #[must_use]
    pub fn table_step(&self, layer: usize) -> (i32, Option<i64>) {
        self.layers[layer].step()
    }

    /// Writes are done: layers that keep to a middle move, side by side.
    pub(super) fn balance(&mut self) {
        let moves = |layer: &TickLayer| layer.balancing.as_ref().is_some_and(Balancing::moves);
        let moving: Vec<_> = (0..self.layers.len()).filter(|&at| moves(&self.layers[at])).collect();
        let (beat, lanes) = (self.timing.beat, self.timing.lanes);
        let lasts: Vec<u64> = moving
            .iter()
            .map(|&at| beat * (self.layers[at].widest() as u64).div_ceil(lanes))
            .collect();
        let start = self.clock;
        for cycle in 0..lasts.iter().max().copied().unwrap_or(0) {
            self.begin(Interval::Program);
            for (&layer, &last) in moving.iter().zip(&lasts) {
                if cycle >= last {
                    continue;
                }
                self.cycles().occupy(layer, During::Update, 1);
                self.cycles().engage(layer, Part::Lanes, 1);
                let group = usize::try_from(cycle / beat).expect("few groups");
                for tile in self.layers[layer].tiles_with(group) {
                    self.watch.part(self.clock, [layer, tile], Part::Lanes, [None; 2]);
                }
                if (cycle + 1).is_multiple_of(beat) {
                    self.layers[layer].move_group(group);
                }
            }
            self.end();
        }
        for (&layer, &last) in moving.iter().zip(&lasts) {
            self.layers[layer].move_step();
            if self.layers[layer].balancing.as_ref().is_some_and(|of| of.threshold) {
                for target in self.layers[layer].targets() {
                    let code = self.layers[layer].unit_code(target);
                    // a sum of 64 bits is fetched and stored, of every copy
                    let (units, copies) = (self.layers[layer].columns, self.layers[layer].copies());
                    let bits = 2 * 64 * (units * copies) as u64;
                    self.charge(layer, code, During::Update, Event::SramBits, bits);
                }
            }
            let span =
                Span { layer: Some(layer), name: "moves", sample: None, start, end: start + last };
            self.watch.span(span);
        }
    }
}
