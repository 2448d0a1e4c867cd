//! Rank-1 writes: rows and columns fire trains of pulses, and a cell is pulsed in every slot in which both fire.
//!
//! ```text
//! pulses   sign(column) #{ slots in which row and column fire }
//! ```
//!
//! Levels take these pulses as they take all others: see `kernel::levels`. A train is a word with a bit a slot, so that
//! slots of both are a bitwise and. See docs/MODEL.md, 3.9.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use super::Crossbar;
use super::kernel::{Backend, Cells, Ends, Half, Kernel, WriteCounts};
use super::layout::{BLOCK_ROWS, HALF_CELLS, HALF_COLUMNS, in_half};
use crate::num::draw::Place;

/// What a column fires, and in which direction it moves cells.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ColumnTrain {
    /// A bit a slot.
    pub slots: u64,
    /// Whether levels rise.
    pub rises: bool,
}

impl Crossbar {
    /// Pulses every cell where its row and its column fire. `place` is that of the write.
    ///
    /// # Panics
    /// When there is not a train a row and a column.
    pub fn coincide(&mut self, rows: &[u64], columns: &[ColumnTrain], place: Place) -> WriteCounts {
        let layout = self.layout;
        assert_eq!((rows.len(), columns.len()), (layout.rows, layout.columns), "a train a line");
        // nothing is verified and no remainder is kept: that is what makes such a write fast on a chip
        let [floor, ceiling] = [self.window.floor(), self.window.ceiling()];
        let ends = Ends { floor, ceiling, residual_bits: 0 };
        let law = Kernel::start(Backend::Scalar);
        let mut counts = WriteCounts::default();
        for mut strip in self.strips_mut(layout.panels()) {
            let mut answers = strip.answers(place);
            for (half, columns) in columns.chunks(HALF_COLUMNS).enumerate() {
                for (block, rows) in rows.chunks(BLOCK_ROWS).enumerate() {
                    let mut pulses = [0; HALF_CELLS];
                    let groups = coincidences(rows, columns, &mut pulses, &mut counts);
                    let answering = strip.answering(half, block, answers.as_deref_mut());
                    let cells = Cells { residual: None, answering, ..strip.half(half, block) };
                    counts.effective += law.levels(cells, &pulses, ends, groups);
                }
            }
        }
        counts
    }
}

/// The pulses of a half block. Returns the groups of four rows that have some, a bit each.
fn coincidences(
    rows: &[u64],
    columns: &[ColumnTrain],
    pulses: &mut Half<i8>,
    counts: &mut WriteCounts,
) -> u16 {
    let mut groups = 0;
    for (row, &train) in rows.iter().enumerate().filter(|(_, train)| **train != 0) {
        for (column, fires) in columns.iter().enumerate() {
            let slots = (train & fires.slots).count_ones();
            if slots > 0 {
                let size = i8::try_from(slots).expect("a word has 64 bits");
                pulses[in_half(row, column)] = if fires.rises { size } else { -size };
                groups |= 1 << (row / 4);
                counts.requested += 1;
                counts.attempted += u64::from(slots);
            }
        }
    }
    groups
}
