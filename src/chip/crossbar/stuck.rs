//! Stuck cells of an array: they hold their level through loads and writes.
//!
//! To a kernel a stuck cell is one that is gone: it takes pulses, its remainder moves on as that of any cell, and its level
//! stays. Where the floor absorbs, the marks of both lie in one plane; where it does not, what a write marked is taken back
//! after it. A function of the place, no state. See docs/MODEL.md, 3.12.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use super::kernel::Cells;
use super::{Crossbar, StuckCell};

impl Crossbar {
    /// Sets which cells hold which level, row by row, and brings them there.
    ///
    /// # Panics
    /// When a cell or its level lies outside, or cells are out of order.
    pub fn set_stuck(&mut self, stuck: Vec<StuckCell>) {
        let (layout, window) = (self.layout, self.window);
        let inside = |cell: &StuckCell| {
            (cell.row as usize) < layout.rows
                && (cell.column as usize) < layout.columns
                && (window.floor()..=window.ceiling()).contains(&cell.level)
        };
        assert!(stuck.iter().all(inside), "a stuck cell lies in the array and its window");
        assert!(stuck.is_sorted(), "stuck cells are given row by row");
        if let Some(pruned) = self.pruned.as_mut().filter(|_| self.absorbs) {
            for cell in &self.stuck {
                pruned[layout.index(cell.row as usize, cell.column as usize)] = 0;
            }
        }
        if !self.absorbs {
            let some = !stuck.is_empty() || self.wears();
            self.pruned = some.then(|| vec![0; layout.cells_padded()]);
        }
        self.stuck = stuck;
        (0..layout.rows).for_each(|row| self.hold_row(row));
        self.mark_stuck();
    }

    /// Cells that hold their level, row by row.
    #[must_use]
    pub fn stuck(&self) -> &[StuckCell] {
        &self.stuck
    }

    /// Moves every cell that is not stuck, to where its number row by row and its level say. Levels may leave the window, which is
    /// one of programming.
    pub(crate) fn move_all(&mut self, to: impl Fn(usize, u16) -> u16) {
        let layout = self.layout;
        for (cell, level) in self.levels().enumerate() {
            self.put(cell / layout.columns, cell % layout.columns, to(cell, level));
        }
        (0..layout.rows).for_each(|row| self.hold_row(row));
    }

    /// Stuck cells of a row get their levels back.
    pub(super) fn hold_row(&mut self, row: usize) {
        if self.stuck.is_empty() {
            return;
        }
        let from = self.stuck.partition_point(|cell| (cell.row as usize) < row);
        let to = self.stuck.partition_point(|cell| (cell.row as usize) <= row);
        for at in from..to {
            let StuckCell { column, level, .. } = self.stuck[at];
            self.put(row, column as usize, level);
        }
    }

    /// Marks stuck and worn cells so that no write moves them.
    pub(super) fn mark_stuck(&mut self) {
        self.mark_worn();
        let Some(pruned) = &mut self.pruned else { return };
        for cell in &self.stuck {
            pruned[self.layout.index(cell.row as usize, cell.column as usize)] = Cells::GONE;
        }
    }

    /// After a write: a cell that came to rest on a floor that does not absorb is as free as before.
    pub(crate) fn end_write(&mut self) {
        if self.absorbs || (self.stuck.is_empty() && !self.wears()) {
            return;
        }
        if let Some(pruned) = &mut self.pruned {
            pruned.fill(0);
        }
        self.mark_stuck();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::chip::crossbar::layout::Layout;
    use crate::chip::hardware::{FloorKind, Hardware};

    fn array(floor_kind: FloorKind) -> Crossbar {
        let hardware = Hardware::reference().with(|h| h.cell.floor_kind = floor_kind).unwrap();
        Crossbar::new(Layout { rows: 70, columns: 40 }, &hardware)
    }

    fn cells() -> Vec<StuckCell> {
        [[0, 0, 7], [0, 39, 255], [69, 5, 0]]
            .map(|[row, column, level]| StuckCell { row, column, level: level as u16 })
            .to_vec()
    }

    #[test]
    fn a_stuck_cell_holds_its_level_through_loads_and_restored_marks() {
        for kind in [FloorKind::Recoverable, FloorKind::Absorbing] {
            let mut array = array(kind);
            array.set_stuck(cells());
            for row in 0..70 {
                array.load_row(row, &[100; 40]);
            }
            assert_eq!([array.level(0, 0), array.level(0, 39), array.level(69, 5)], [7, 255, 0]);
            assert_eq!([array.level(0, 1), array.level(69, 4)], [100, 100]);
            assert_eq!(array.pruned().is_some(), kind == FloorKind::Absorbing);
            if let Some(mut gone) = array.pruned() {
                assert!(gone.not_any(), "a stuck cell is not a pruned one");
                gone.set(69 * 40 + 5, true);
                gone.set(1, true);
                array.load_pruned(&gone);
                let ones: Vec<_> = array.pruned().unwrap().iter_ones().collect();
                assert_eq!(ones, [1]);
            }
            array.set_stuck(vec![]);
            array.load_row(0, &[3; 40]);
            assert_eq!(array.level(0, 0), 3);
        }
    }
}
