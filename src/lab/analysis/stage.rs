//! A layer as its registers have it: drives, slopes, and sums over what was read.

use std::ops::Range;

use super::gradient::square;
use crate::chip::engine::Engine;
use crate::chip::layer::{LayerSpec, Pool};
use crate::chip::population::{Pathway, Polarity, Stream};

/// What gates multiply drives by, by target stream: `[read][unit]`; empty where the layer has no such stream.
pub(super) type Deltas = [Vec<f64>; 2];

/// A full error word.
const FULL_WORD: f64 = 127.0;
/// The steepest slope.
const FULL_SLOPE: f64 = 255.0;

/// A number of things.
fn size(count: usize) -> f64 {
    count as f64
}

/// A layer and what was read.
#[derive(Debug)]
pub(super) struct Stage {
    /// Its shape.
    pub(super) spec: LayerSpec,
    /// Levels of its arrays, `[row][unit]`, in the order of the pathways.
    pub(super) levels: Vec<Vec<u16>>,
    /// Samples read.
    pub(super) samples: usize,
    /// Rows of an array, with a constant one.
    pub(super) rows: usize,
    /// Drive codes by set, `[sample][code]`.
    drives: [Vec<u8>; 2],
    /// Slopes by target, `[read][unit]`.
    slopes: [Vec<u8>; 2],
    /// Codes in front of a pool, where the greatest of them is asked for.
    maps: [Vec<u8>; 2],
    code_max: f64,
    centred: bool,
}

impl Stage {
    /// Takes what an engine has read last.
    pub(super) fn of(engine: &Engine, layer: usize) -> Self {
        let this = &engine.layers()[layer];
        let asked = matches!(this.spec.pool, Pool::Max { .. });
        let (sets, targets) = (this.spec.drive_sets(), this.spec.wiring.targets());
        let by = |there: &[Stream], of: &dyn Fn(Stream) -> Vec<u8>| {
            [Stream::P, Stream::N].map(|one| if there.contains(&one) { of(one) } else { vec![] })
        };
        Self {
            spec: this.spec.clone(),
            levels: this.arrays.iter().map(|array| array.levels().collect()).collect(),
            samples: engine.samples(),
            rows: this.layout.rows,
            drives: by(sets, &|set| engine.drive_codes(layer, set)),
            slopes: by(targets, &|target| engine.unit_slopes(layer, target)),
            maps: by(if asked { targets } else { &[] }, &|target| engine.unit_maps(layer, target)),
            code_max: f64::from(engine.hardware().drive.bits.code_max()),
            centred: this.requests.window_log2.is_some(),
        }
    }

    /// Cells of its arrays.
    pub(super) fn cells(&self) -> u64 {
        (self.levels.len() * self.rows * self.spec.units) as u64
    }

    /// Gates of what units hear, `[sample][unit]`: stream n hears the negative.
    pub(super) fn deltas(&self, heard: &[f64]) -> Deltas {
        let (units, positions) = (self.spec.units, self.spec.positions());
        [(Stream::P, 1.0), (Stream::N, -1.0)].map(|(target, sign)| {
            let slopes = self.slopes[target.index()].chunks_exact(units.max(1)).enumerate();
            let gates = slopes.flat_map(|(read, slopes)| {
                let heard = &heard[read / positions * units..][..units];
                heard.iter().zip(slopes).map(move |(word, &slope)| sign * word * f64::from(slope))
            });
            gates.collect()
        })
    }

    /// Gates of errors of what units hand on, by stream, `[sample][code]`: each position of a square hears the word of the
    /// square, or the first of its greatest codes does.
    pub(super) fn through(&self, errors: &Deltas) -> Deltas {
        let (units, positions, side) =
            (self.spec.units, self.spec.positions(), self.spec.pool.side());
        let [_, across] = self.spec.convolution.map_or([1, 1], |shape| shape.output());
        let [height, width] = self.spec.pooled();
        [Stream::P, Stream::N].map(|target| {
            let (slopes, maps) = (&self.slopes[target.index()], &self.maps[target.index()]);
            let mut gates = vec![0.0; slopes.len()];
            let words = errors[target.index()].chunks_exact(units.max(1)).enumerate();
            for (at, words) in words.take(if slopes.is_empty() { 0 } else { usize::MAX }) {
                let (sample, pixel) = (at / (height * width), at % (height * width));
                let corner = pixel / width * side * across + pixel % width * side;
                let places: Vec<usize> =
                    square(side, across).map(|step| sample * positions + corner + step).collect();
                for (unit, word) in words.iter().enumerate() {
                    let hears: &[usize] = match self.spec.pool {
                        Pool::Max { .. } => {
                            let code = |place: &usize| maps[place * units + unit];
                            let most = places.iter().map(code).max().unwrap_or(0);
                            let first = places.iter().position(|place| code(place) == most);
                            first.map_or(&[], |first| &places[first..=first])
                        }
                        _ => &places,
                    };
                    for place in hears {
                        let cell = place * units + unit;
                        gates[cell] = word * f64::from(slopes[cell]);
                    }
                }
            }
            gates
        })
    }

    /// Rows that are driven for a read, with what drives them.
    pub(super) fn row_drives(&self, set: Stream, read: usize, rows: &mut Vec<(usize, f64)>) {
        rows.clear();
        let inputs = self.spec.sample_inputs();
        let positions = self.spec.positions();
        let codes = &self.drives[set.index()][read / positions * inputs..][..inputs];
        self.taps(read % positions, |row, from| {
            let lit = codes[from].iter().enumerate().filter(|(_, code)| **code > 0);
            rows.extend(lit.map(|(at, &code)| (row + at, f64::from(code))));
        });
        if self.spec.constant_row {
            rows.push((self.spec.inputs, self.code_max));
        }
    }

    /// Rows of a window's position and the codes of a sample that drive them, run by run.
    pub(super) fn taps(&self, position: usize, mut run: impl FnMut(usize, Range<usize>)) {
        let Some(shape) = self.spec.convolution else {
            return run(0, 0..self.spec.inputs);
        };
        let [_, across] = shape.output();
        let (top, left) = (position / across * shape.stride, position % across * shape.stride);
        for tap in 0..shape.side * shape.side {
            let (y, x) = (top + tap / shape.side, left + tap % shape.side);
            let inside = |at: usize, size: usize| (shape.pad..size + shape.pad).contains(&at);
            if inside(y, shape.height) && inside(x, shape.width) {
                let pixel = (y - shape.pad) * shape.width + x - shape.pad;
                let first = pixel * shape.channels;
                run(tap * shape.channels, first..first + shape.channels);
            }
        }
    }

    /// Sums of drives and gates over all that was read, by set of drives and target.
    pub(super) fn sums(&self, deltas: &Deltas) -> Sums {
        let units = self.spec.units;
        let mut parts = Vec::new();
        for &set in self.spec.drive_sets() {
            for &target in self.spec.wiring.targets() {
                let here =
                    |way: &&Pathway| self.spec.drives_of(way.source) == set && way.target == target;
                let arrays = self.spec.wiring.pathways().iter().filter(here).count();
                if arrays == 0 {
                    continue;
                }
                let mut sums = vec![0.0; self.rows * units];
                let mut totals = vec![0.0; units];
                let mut rows = Vec::new();
                for (read, gates) in deltas[target.index()].chunks_exact(units).enumerate() {
                    if gates.iter().all(|&gate| gate == 0.0) {
                        continue;
                    }
                    totals.iter_mut().zip(gates).for_each(|(sum, gate)| *sum += gate);
                    self.row_drives(set, read, &mut rows);
                    for &(row, drive) in &rows {
                        let sums = &mut sums[row * units..(row + 1) * units];
                        sums.iter_mut().zip(gates).for_each(|(sum, gate)| *sum += drive * gate);
                    }
                }
                if self.centred {
                    let means = self.means(set);
                    for (sums, mean) in sums.chunks_exact_mut(units).zip(means.iter().cycle()) {
                        sums.iter_mut().zip(&totals).for_each(|(sum, total)| *sum -= mean * total);
                    }
                }
                parts.push((size(arrays), sums));
            }
        }
        Sums(parts)
    }

    /// Mean drive of each row, or of each channel of an image, which are rows in turn.
    fn means(&self, set: Stream) -> Vec<f64> {
        let lines = self.spec.convolution.map_or(self.spec.inputs, |shape| shape.channels);
        let mut means = vec![0.0; lines];
        let codes = &self.drives[set.index()];
        for codes in codes.chunks_exact(lines.max(1)) {
            means.iter_mut().zip(codes).for_each(|(mean, &code)| *mean += f64::from(code));
        }
        let count = size(codes.len() / lines.max(1)).max(1.0);
        means.iter_mut().for_each(|mean| *mean /= count);
        if self.spec.constant_row {
            // all rows once, then the constant one
            let rows = self.spec.inputs / lines.max(1);
            means = means.repeat(rows);
            means.push(self.code_max);
        }
        means
    }

    /// Root of the mean square of gates; 1 is a full word and the steepest slope.
    pub(super) fn root_mean_square(&self, deltas: &Deltas) -> f64 {
        let all = || deltas.iter().flatten();
        let squares: f64 = all().map(|gate| gate * gate).sum();
        (squares / size(all().count()).max(1.0)).sqrt() / (FULL_WORD * FULL_SLOPE)
    }

    /// Mean size of the sum of a cell, a read.
    pub(super) fn mean_size(&self, sums: &Sums) -> f64 {
        let reads = size(self.samples * self.spec.positions()).max(1.0);
        let (mut all, mut cells) = (0.0, 0.0);
        for (arrays, part) in &sums.0 {
            all += arrays * part.iter().map(|sum| sum.abs()).sum::<f64>();
            cells += arrays * size(part.len());
        }
        all / f64::max(cells, 1.0) / reads / (self.code_max * FULL_WORD * FULL_SLOPE)
    }

    /// An array that carries from a set of drives to a target, with its sign.
    pub(super) fn arrays(&self) -> impl Iterator<Item = (&Pathway, f64, &[u16])> {
        let ways = self.spec.wiring.pathways().iter().zip(&self.levels);
        ways.map(|(way, levels)| {
            let sign = if way.polarity == Polarity::Excites { 1.0 } else { -1.0 };
            (way, sign, &levels[..])
        })
    }
}

/// Sums of a layer: `[row][unit]` of each set of drives and target, with the number of arrays that they are for. An array's
/// sign is no matter to a scalar product.
#[derive(Debug)]
pub(super) struct Sums(pub(super) Vec<(f64, Vec<f64>)>);

impl Sums {
    /// Scalar product over all cells.
    fn product(&self, other: &Self) -> f64 {
        let parts = self.0.iter().zip(&other.0);
        parts
            .map(|((arrays, one), (_, two))| {
                arrays * one.iter().zip(two).map(|(a, b)| a * b).sum::<f64>()
            })
            .sum()
    }

    /// Cosine of the angle between both; `None` where one of them is nothing.
    pub(super) fn agreement(&self, other: &Self) -> Option<f64> {
        let lengths = (self.product(self) * other.product(other)).sqrt();
        (lengths > 0.0).then(|| self.product(other) / lengths)
    }
}
