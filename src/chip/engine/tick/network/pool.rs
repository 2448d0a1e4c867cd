//! The stage that pools the codes of a layer, beat by beat: of a position that the pool puts out, as many columns a beat as
//! there are lanes.
//!
//! A sample waits until the one before it has left; samples of a layer come and go in order.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use std::collections::VecDeque;

use crate::chip::hardware::Timing;
use crate::chip::layer::{LayerSpec, Pool};
use crate::chip::population::Stream;

/// Codes of a stream of a sample.
#[derive(Debug)]
pub(super) struct Pooled {
    pub(super) stream: Stream,
    /// In the order y, x, channel: those that come, those that leave.
    from: Vec<u8>,
    pub(super) to: Vec<u8>,
    /// Codes looked at.
    pub(super) looked_at: u64,
}

#[derive(Debug)]
pub(super) struct Pooler {
    pool: Pool,
    beat: u64,
    lanes: usize,
    /// Columns of a tile: tiles side by side have lanes of their own.
    tile: usize,
    units: usize,
    /// Columns of the map that comes and of the one that leaves, and positions of the latter.
    across: [usize; 2],
    positions: usize,
    waiting: VecDeque<Vec<Pooled>>,
    /// The sample in the stage, and the cycles it has been there.
    now: Option<(Vec<Pooled>, u64)>,
}

impl Pooler {
    /// The stage behind a layer, if it has a pool.
    pub(super) fn new(timing: Timing, tile: usize, spec: &LayerSpec) -> Option<Self> {
        let shape = spec.convolution.filter(|_| spec.pool != Pool::None)?;
        let (map, side) = (shape.output(), spec.pool.side());
        Some(Self {
            pool: spec.pool,
            beat: timing.beat,
            lanes: usize::try_from(timing.lanes).expect("few"),
            tile,
            units: spec.units,
            across: [map[1], map[1] / side],
            positions: (map[0] / side) * (map[1] / side),
            waiting: VecDeque::new(),
            now: None,
        })
    }

    /// Bits that say which code of a square was the greatest, stored and fetched; 0 where that is not asked.
    pub(super) fn place_bits(&self) -> u64 {
        let places = self.pool.side() * self.pool.side();
        let bits = (0..).find(|&bits| 1 << bits >= places).expect("there is a power of two");
        if let Pool::Max { .. } = self.pool { 2 * bits } else { 0 }
    }

    /// The codes of a sample are there, by target stream.
    pub(super) fn take(&mut self, streams: Vec<(Stream, Vec<u8>)>) {
        let size = self.positions * self.units;
        let streams = streams.into_iter().map(|(stream, from)| Pooled {
            stream,
            from,
            to: vec![0; size],
            looked_at: 0,
        });
        self.waiting.push_back(streams.collect());
    }

    /// Takes the next sample for the cycle to come, if there is room.
    pub(super) fn start(&mut self) {
        if self.now.is_none() {
            self.now = self.waiting.pop_front().map(|streams| (streams, 0));
        }
    }

    /// A cycle of the stage; the sample that leaves it.
    pub(super) fn cycle(&mut self) -> Option<Vec<Pooled>> {
        let (mut streams, cycles) = self.now.take()?;
        let cycles = cycles + 1;
        if !cycles.is_multiple_of(self.beat) {
            self.now = Some((streams, cycles));
            return None;
        }
        let step = usize::try_from(cycles / self.beat).expect("few beats") - 1;
        let groups = self.units.min(self.tile).div_ceil(self.lanes);
        let (position, group) = (step / groups, step % groups);
        for channel in (0..self.units).filter(|c| c % self.tile / self.lanes == group) {
            streams.iter_mut().for_each(|stream| self.pool(stream, position, channel));
        }
        if step + 1 == self.positions * groups {
            return Some(streams);
        }
        self.now = Some((streams, cycles));
        None
    }

    /// A code that leaves, of the square it stands for.
    fn pool(&self, stream: &mut Pooled, position: usize, channel: usize) {
        let (side, [from, to]) = (self.pool.side(), self.across);
        let (top, left) = (position / to * side, position % to * side);
        let mut square = Vec::new();
        for y in top..top + side {
            for x in left..left + side {
                square.push(usize::from(stream.from[(y * from + x) * self.units + channel]));
            }
        }
        let (sum, most) = (square.iter().sum::<usize>(), square.iter().max());
        let code = match self.pool {
            Pool::Max { .. } => most.copied().expect("a square has codes"),
            _ => (2 * sum + side * side) / (2 * side * side),
        };
        stream.to[position * self.units + channel] = u8::try_from(code).expect("no code is more");
        stream.looked_at += square.len() as u64;
    }
}
