//! Rank-1 writes: rows and columns fire trains of pulses, and a cell is pulsed in every slot in which both fire.
//!
//! ```text
//! pulses   sign(column) #{ slots in which row and column fire }
//! level    clamp( level + pulses, floor, ceiling )
//! ```
//!
//! A train is a word with a bit a slot, so that slots of both are a bitwise and. See docs/MODEL.md, 3.9.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use bitvec::prelude::*;

use super::Crossbar;
use super::kernel::WriteCounts;

/// What a column fires, and in which direction it moves cells.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ColumnTrain {
    /// A bit a slot.
    pub slots: u64,
    /// Whether levels rise.
    pub rises: bool,
}

impl Crossbar {
    /// Pulses every cell where its row and its column fire.
    ///
    /// # Panics
    /// When there is not a train a row and a column.
    pub fn coincide(&mut self, rows: &[u64], columns: &[ColumnTrain]) -> WriteCounts {
        let layout = self.layout;
        assert_eq!((rows.len(), columns.len()), (layout.rows, layout.columns), "a train a line");
        let mut counts = WriteCounts::default();
        let (floor, ceiling) = (self.window.floor(), self.window.ceiling());
        for (row, &train) in rows.iter().enumerate().filter(|(_, train)| **train != 0) {
            for (column, fires) in columns.iter().enumerate() {
                let pulses = (train & fires.slots).count_ones();
                if pulses == 0 {
                    continue;
                }
                let pulses = u16::try_from(pulses).expect("a word has 64 bits");
                let at = layout.index(row, column);
                let gone = self.pruned.as_ref().is_some_and(|words| words.view_bits::<Lsb0>()[at]);
                let before = self.level(row, column);
                let after = match fires.rises {
                    _ if gone => before,
                    true => before.saturating_add(pulses).min(ceiling),
                    false => before.saturating_sub(pulses).max(floor),
                };
                let [low, high] = after.to_le_bytes();
                self.low[at] = low;
                if let Some(plane) = &mut self.high {
                    plane[at] = high;
                }
                if let Some(words) = &mut self.pruned
                    && after == floor
                {
                    words.view_bits_mut::<Lsb0>().set(at, true);
                }
                counts.requested += 1;
                counts.attempted += u64::from(pulses);
                counts.effective += u64::from(after.abs_diff(before));
            }
        }
        counts
    }
}
