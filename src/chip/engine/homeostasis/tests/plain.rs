//! What layers that keep to a middle come to, by plain loops.

use super::Net;
use crate::chip::layer::homeostasis::{first_shift, first_threshold, moved, shifted, stepped};
use crate::chip::layer::{Gain, Homeostasis, Layer, Readings};
use crate::chip::periphery;
use crate::chip::population::{Polarity, Stream};
use crate::num::fixed::rsh;

/// What a layer remembers, and what it does, by plain loops.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Plain {
    pub(super) law: Homeostasis,
    bits: u32,
    thresholds: [Vec<i64>; 2],
    shift: i32,
    variance: i64,
}

impl Plain {
    pub(super) fn of(layer: &Layer) -> Self {
        let b = &layer.balance;
        Self {
            law: b.law(),
            bits: layer.lut.activity.len().ilog2(),
            thresholds: [Stream::P, Stream::N].map(|stream| b.thresholds(stream).to_vec()),
            shift: b.shift(),
            variance: b.variance(),
        }
    }

    /// `d` of accumulators `[stream][sample][unit]`.
    fn left(&self, sums: &[Vec<Vec<i64>>; 2]) -> [Vec<Vec<i64>>; 2] {
        std::array::from_fn(|stream| {
            let off = |(unit, &sum): (usize, &i64)| {
                sum - self.thresholds[stream].get(unit).map_or(0, |&t| rsh(t, 8))
            };
            sums[stream].iter().map(|sums| sums.iter().enumerate().map(off).collect()).collect()
        })
    }

    fn indices(&self, sums: &[Vec<Vec<i64>>; 2]) -> (Vec<Vec<Vec<i64>>>, u64) {
        let half = 1i64 << (self.bits - 1);
        let mut ends = 0;
        let mut index = |d: &i64| {
            let i = shifted(*d, self.shift);
            ends += u64::from(i < -half || i >= half);
            i.clamp(-half, half - 1)
        };
        let left = self.left(sums);
        let of = left.iter().map(|stream| {
            stream.iter().map(|sums| sums.iter().map(&mut index).collect()).collect()
        });
        (of.collect(), ends)
    }

    fn readings(&self, sums: &[Vec<Vec<i64>>; 2], samples: usize) -> Readings {
        let total = |stream: usize| {
            let units = sums[stream].first().map_or(0, Vec::len);
            (0..units).map(|unit| sums[stream].iter().map(|sums| sums[unit]).sum()).collect()
        };
        let indices = self.indices(sums).0;
        let left = self.left(sums);
        Readings {
            reads: samples as u64,
            sums: [total(0), total(1)],
            squares: indices.iter().flatten().flatten().map(|i| (i * i) as u64).sum(),
            deviations: left.iter().flatten().flatten().map(|d| (d * d) as u128).sum(),
        }
    }

    fn units(sums: &[Vec<Vec<i64>>; 2]) -> i64 {
        sums.iter().map(|stream| stream.first().map_or(0, Vec::len) as i64).sum()
    }

    fn calibrate(&mut self, sums: &[Vec<Vec<i64>>; 2], samples: usize) {
        let readings = self.readings(sums, samples);
        for (thresholds, sums) in self.thresholds.iter_mut().zip(&readings.sums) {
            for (threshold, &sum) in thresholds.iter_mut().zip(sums) {
                *threshold = first_threshold(sum, samples as u64);
            }
        }
        let spread = match self.law.gain {
            Gain::Table => return,
            Gain::Fixed { spread } => spread as i32,
            Gain::Tracking => 0,
        };
        let deviations = self.readings(sums, samples).deviations;
        let count = samples as u64 * Self::units(sums) as u64;
        self.shift = (first_shift(deviations, count, self.bits) + spread).min(47);
        if self.law.gain == Gain::Tracking {
            self.variance = ((self.readings(sums, samples).squares << 4) / samples as u64) as i64;
        }
    }

    pub(super) fn written(&mut self, sums: &[Vec<Vec<i64>>; 2], samples: usize) {
        let readings = self.readings(sums, samples);
        for (thresholds, sums) in self.thresholds.iter_mut().zip(&readings.sums) {
            for (threshold, &sum) in thresholds.iter_mut().zip(sums) {
                *threshold = moved(*threshold, sum << 8, samples as i64, self.law.window_log2);
            }
        }
        if self.law.gain == Gain::Tracking {
            let squares = (readings.squares << 4) as i64;
            let variance = moved(self.variance, squares, samples as i64, self.law.window_log2);
            (self.shift, self.variance) =
                stepped(self.shift, variance, Self::units(sums), self.bits);
        }
    }
}

/// Accumulators of a layer, `[stream][sample][unit]`, of drives that lie likewise.
fn sums(net: &Net, at: usize, drives: &[Vec<Vec<i64>>; 2]) -> [Vec<Vec<i64>>; 2] {
    let mut sums = [vec![], vec![]];
    for &target in net.wiring.targets() {
        sums[target.index()] = vec![vec![0; net.sides[at + 1]]; net.samples];
    }
    for (array, pathway) in net.wiring.pathways().iter().enumerate() {
        let sign = if pathway.polarity == Polarity::Excites { 1 } else { -1 };
        for (sample, sums) in sums[pathway.target.index()].iter_mut().enumerate() {
            for (row, &x) in drives[pathway.source.index()][sample].iter().enumerate() {
                for (column, sum) in sums.iter_mut().enumerate() {
                    *sum += sign * x * i64::from(net.level(at, array, row, column));
                }
            }
        }
    }
    sums
}

/// Slopes of a layer by stream, read and unit, ends that were hit, and sums by stream, read and unit.
pub(super) type Seen = (Vec<Vec<Vec<u8>>>, u64, [Vec<Vec<i64>>; 2]);

/// Reads a batch; every hidden layer is moved or calibrated by `then` before its units are looked up.
pub(super) fn plain_read(
    net: &Net,
    layers: &[Layer],
    codes: &[u8],
    states: &mut [Plain],
    calibrates: bool,
) -> Vec<Seen> {
    let bits = net.hardware.drive.bits;
    let drive: Vec<Vec<i64>> = codes
        .chunks(net.sides[0])
        .map(|codes| codes.iter().map(|&code| code.into()).collect())
        .collect();
    let mut drives = [drive.clone(), drive];
    let mut all = vec![];
    for (at, state) in states.iter_mut().enumerate() {
        let sums = sums(net, at, &drives);
        if calibrates {
            state.calibrate(&sums, net.samples);
        }
        let (indices, ends) = state.indices(&sums);
        let half = 1i64 << (state.bits - 1);
        let lut = &layers[at].lut;
        let mut slopes = vec![];
        for (stream, indices) in indices.into_iter().enumerate() {
            let place = |i: &i64| (i + half) as usize;
            drives[stream] = indices
                .iter()
                .map(|row| {
                    let code = |i| periphery::drive(lut.activity[place(i)], bits);
                    row.iter().map(code).map(i64::from).collect()
                })
                .collect();
            let slope = |row: &Vec<i64>| row.iter().map(|i| lut.derivative[place(i)]).collect();
            slopes.push(indices.iter().map(slope).collect());
        }
        all.push((slopes, ends, sums));
    }
    all
}
