//! The stage that normalises the streams of a layer, beat by beat: squares of as many columns a beat as there are lanes, 32
//! beats for a division, a root and a reciprocal, then codes of as many columns a beat.
//!
//! A sample waits until the one before it has left; samples of a layer come and go in order.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use std::collections::VecDeque;

use crate::chip::population::Stream;

/// What a stream of a sample comes to.
#[derive(Debug, Clone, Default)]
pub(super) struct Normal {
    sums: Vec<i64>,
    squares: u128,
    root: u128,
    /// Activity and derivative of each unit.
    pub(super) units: Vec<(u8, u8)>,
    /// Squares, roots and scalings made, and codes bounded.
    pub(super) counts: [u64; 4],
}

/// A sample in the stage.
#[derive(Debug)]
struct Work {
    /// By target stream.
    streams: Vec<(Stream, Normal)>,
    /// Cycles it has been there.
    cycles: u64,
}

#[derive(Debug)]
pub(super) struct Normaliser {
    beat: u64,
    lanes: usize,
    /// Columns of a tile: tiles side by side have lanes of their own.
    tile: usize,
    waiting: VecDeque<Vec<(Stream, Normal)>>,
    now: Option<Work>,
}

impl Normaliser {
    pub(super) fn new(beat: u64, lanes: usize, tile: usize) -> Self {
        Self { beat, lanes, tile, waiting: VecDeque::new(), now: None }
    }

    /// The accumulators of a sample are there, by target stream.
    pub(super) fn take(&mut self, streams: Vec<(Stream, Vec<i64>)>) {
        let units = |sums: &Vec<i64>| vec![(0, 0); sums.len()];
        let streams = streams.into_iter().map(|(stream, sums)| {
            (stream, Normal { units: units(&sums), sums, ..Normal::default() })
        });
        self.waiting.push_back(streams.collect());
    }

    /// Takes the next sample for the cycle to come, if there is room.
    pub(super) fn start(&mut self) {
        if self.now.is_none() {
            self.now = self.waiting.pop_front().map(|streams| Work { streams, cycles: 0 });
        }
    }

    /// A cycle of the stage; the sample that leaves it.
    pub(super) fn cycle(&mut self) -> Option<Vec<(Stream, Normal)>> {
        let work = self.now.as_mut()?;
        work.cycles += 1;
        if !work.cycles.is_multiple_of(self.beat) {
            return None;
        }
        let step = usize::try_from(work.cycles / self.beat).expect("few beats") - 1;
        let widest = work.streams[0].1.sums.len().min(self.tile);
        let groups = widest.div_ceil(self.lanes);
        for (_, normal) in &mut work.streams {
            for column in 0..normal.sums.len() {
                let group = column % self.tile / self.lanes;
                if step == group {
                    normal.square(column);
                } else if step == groups + 32 + group {
                    normal.scale(column);
                }
            }
            if step + 1 == groups + 32 {
                normal.root();
            }
        }
        let ends = step + 1 == 2 * groups + 32;
        if ends { self.now.take().map(|work| work.streams) } else { None }
    }
}

impl Normal {
    fn square(&mut self, column: usize) {
        let sum = u128::try_from(self.sums[column]).unwrap_or(0);
        self.squares += sum * sum;
        self.counts[0] += 1;
    }

    /// Greatest `m` whose square is no more than the mean, bit by bit; at least 1.
    fn root(&mut self) {
        let mean = self.squares / self.sums.len() as u128;
        let mut root = 0;
        for bit in (0..63).rev() {
            let more: u128 = root | 1 << bit;
            if more * more <= mean {
                root = more;
            }
        }
        self.root = root.max(1);
        self.counts[1] += 1;
    }

    fn scale(&mut self, column: usize) {
        let sum = self.sums[column];
        let reciprocal = (1 << 45) / self.root;
        let half = 1 << 39;
        let code = (u128::try_from(sum).unwrap_or(0) * reciprocal + half) >> 40;
        let bounded = u8::try_from(code);
        self.counts[2] += 1;
        self.counts[3] += u64::from(bounded.is_err());
        self.units[column] = (bounded.unwrap_or(255), if sum > 0 { 255 } else { 0 });
    }
}
