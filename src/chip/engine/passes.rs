//! How long a write takes: rows of a tile one after the other, tiles side by side.
//!
//! ```text
//! row      2 + pass (passes+ + passes-)                             compute, set, reset, turn around
//! passes   P (unary), P > 0 (amplitude)                             P: most pulses of a cell, both banks
//!          sum_q ceil(active(q) / W)                                where only W cells can be pulsed at a time
//!          tries times that, of verified pulses of a device
//! ```
//!
//! The only place where numbers decide how long something takes. See docs/MODEL.md, 4.5.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use super::pulses::{Pulses, active};
use crate::chip::crossbar::Collect;
use crate::chip::hardware::{Hardware, PulseCode, Timing};
use crate::chip::layer::Layer;
use crate::chip::population::Stream;

/// What a write of a layer took.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Passes {
    /// Busy cycles of the slowest tile.
    pub(super) busy: u64,
    /// Passes of all tiles, by target stream.
    pub(super) by_target: [u64; 2],
}

/// What has to be collected of a write so that its time is known.
pub(super) fn collect(hardware: &Hardware) -> Collect {
    match hardware.timing {
        None => Collect::Nothing,
        Some(Timing { active_max: None, .. }) => {
            Collect::Peaks { tile_columns: hardware.tile.columns }
        }
        Some(_) => Collect::Pulses,
    }
}

impl Passes {
    /// Passes of a write, from its pulses.
    pub(super) fn new(
        hardware: &Hardware,
        timing: Timing,
        layer: &Layer,
        pulses: Option<&Pulses>,
    ) -> Self {
        let mut passes = Self { busy: 0, by_target: [0; 2] };
        // of verified pulses of a device all slots are waited for
        let answering = hardware.answering().filter(|_| timing.verify);
        let tries = answering.map_or(1, |device| u64::from(device.tries));
        // a row takes so long beside its pulses
        let beats = layer.requests.optimiser.beats();
        match pulses {
            None => {
                passes.add(timing, Stream::P, (layer.layout.rows.min(hardware.tile.rows), beats), 0)
            }
            Some(Pulses::Peaks(tiles)) => {
                for tile in tiles {
                    for rows in tile.peaks.rows.chunks(hardware.tile.rows) {
                        let peaks = rows.as_flattened().iter();
                        let sum: u32 = match timing.pulse_code {
                            PulseCode::Unary => peaks.map(|&peak| u32::from(peak)).sum(),
                            PulseCode::Amplitude => peaks.map(|&peak| u32::from(peak > 0)).sum(),
                        };
                        passes.add(
                            timing,
                            tile.target,
                            (rows.len(), beats),
                            tries * u64::from(sum),
                        );
                    }
                }
            }
            Some(Pulses::Every(arrays)) => {
                for (target, pair) in layer.spec.wiring.planes() {
                    let banks = pair.map(|at| &arrays[at][..]);
                    for first in (0..layer.layout.columns).step_by(hardware.tile.columns) {
                        let rows = limited(hardware, timing, layer, banks, first);
                        for rows in rows.chunks(hardware.tile.rows) {
                            passes.add(
                                timing,
                                target,
                                (rows.len(), beats),
                                tries * rows.iter().sum::<u64>(),
                            );
                        }
                    }
                }
            }
        }
        passes
    }

    /// Takes a tile along, given the passes of all its rows, each of which takes so many beats more to be computed.
    fn add(&mut self, timing: Timing, target: Stream, (rows, beats): (usize, u64), passes: u64) {
        let computed = timing.beat * beats * rows as u64;
        self.busy = self.busy.max(timing.rows(rows as u64, passes) + computed);
        self.by_target[target.index()] += passes;
    }
}

/// Passes of every row of a column of tiles that begins at column `first`, when few cells are pulsed at a time.
fn limited(
    hardware: &Hardware,
    timing: Timing,
    layer: &Layer,
    banks: [&[i8]; 2],
    first: usize,
) -> Vec<u64> {
    let columns = layer.layout.columns;
    let end = columns.min(first + hardware.tile.columns);
    let together = timing.active_max.expect("only called where there is a limit");
    let bound = u8::try_from(hardware.write.increment_max.get()).expect("1..=127");
    let row = |row: usize| {
        let cells =
            banks.into_iter().flat_map(|bank| &bank[row * columns + first..row * columns + end]);
        let turns = active(cells, bound);
        let turns = match timing.pulse_code {
            PulseCode::Unary => &turns[..],
            PulseCode::Amplitude => &turns[..1],
        };
        turns.iter().flatten().map(|&cells| u64::from(cells).div_ceil(together)).sum()
    };
    (0..layer.layout.rows).map(row).collect()
}
