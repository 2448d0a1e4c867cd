//! Whether a layer says anything while it is evaluated: a layer whose units put out the same whatever is shown reads
//! nothing, or nothing but rails.
//!
//! ```text
//! mute = of all samples of an evaluation, of which there are two at least, no activity of a unit differs
//! ```
//!
//! Of a layer that is read out, no accumulator.
//!
//! Looked at until the first difference, which is nearly always in the first two samples.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use super::forward::Units;
use super::{Engine, Phase};
use crate::chip::crossbar::layout::BLOCK_ROWS;

/// What a layer said since someone asked.
#[derive(Debug, Clone, Default)]
pub(super) struct Said {
    /// What its units put out for the first sample, by target stream: `[block][64]`.
    first: [Vec<i64>; 2],
    samples: u64,
    differs: bool,
}

impl Engine {
    pub(super) fn note_said(&mut self, layer: usize) {
        if self.phase != Phase::Evaluation || self.said[layer].differs {
            return;
        }
        let (samples, units) = (self.samples, self.layers[layer].layout.columns);
        let positions = self.layers[layer].spec.positions();
        let direct = self.hands_on_directly(layer);
        let said = &mut self.said[layer];
        let (head, tail) = self.registers.split_at(layer + 1);
        for &target in self.layers[layer].spec.wiring.targets() {
            let (at, first) = (target.index(), &mut said.first[target.index()]);
            said.differs |= match (tail.first(), &self.units[layer]) {
                (Some(_), _) if !direct => {
                    differs_somewhere(first, &head[layer].maps[at], [samples, positions, units])
                }
                (Some(next), _) => differs(first, &next.drives[at], samples, units),
                (None, Units::Kept) => {
                    differs(first, &head[layer].accumulators[at], samples, units)
                }
                (None, _) => differs(first, &head[layer].activities[at], samples, units),
            };
        }
        said.samples += samples as u64;
    }

    /// Which layers were mute in the evaluations since the last call, and starts over.
    pub fn take_mute(&mut self) -> Vec<bool> {
        let fresh = vec![Said::default(); self.layers.len()];
        let said = std::mem::replace(&mut self.said, fresh);
        said.iter().map(|said| said.samples > 1 && !said.differs).collect()
    }
}

/// Whether a map differs from the first one anywhere: `[block][sample][position][64]`.
fn differs_somewhere(
    first: &mut Vec<i64>,
    all: &[u8],
    [samples, positions, units]: [usize; 3],
) -> bool {
    let mut differs = false;
    let size = positions * BLOCK_ROWS;
    let mut from = 0;
    for (block, maps) in all.chunks_exact(samples * size).enumerate() {
        let live = (units - block * BLOCK_ROWS).min(BLOCK_ROWS);
        for map in maps.chunks_exact(size) {
            let codes = map.chunks_exact(BLOCK_ROWS).flat_map(|codes| &codes[..live]);
            let codes = codes.map(|&code| i64::from(code));
            if first.len() == from {
                first.extend(codes.clone());
            }
            differs |= !codes.eq(first[from..from + positions * live].iter().copied());
            if differs {
                return true;
            }
        }
        from += positions * live;
    }
    differs
}

/// Whether a sample differs from the first one, which is noted where there is none yet: `[block][sample][64]`.
fn differs<T: Copy + Into<i64>>(
    first: &mut Vec<i64>,
    all: &[T],
    samples: usize,
    units: usize,
) -> bool {
    let known = !first.is_empty();
    let mut differs = false;
    // units alone: what lies behind them, a constant row, is no activity
    for (block, from) in (0..units).step_by(BLOCK_ROWS).enumerate() {
        let live = (units - from).min(BLOCK_ROWS);
        let rows = all[block * samples * BLOCK_ROWS..].chunks(BLOCK_ROWS).take(samples);
        for row in rows {
            let row = row[..live].iter().map(|&value| value.into());
            if first.len() == from {
                first.extend(row.clone());
            }
            differs |= !row.eq(first[from..from + live].iter().copied());
        }
    }
    debug_assert!(known || first.len() == units, "one activity a unit");
    differs
}
