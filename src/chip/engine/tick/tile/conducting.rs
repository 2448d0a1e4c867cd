//! What cells of a tile let through where that is not their level: term by term from the equations of docs/MODEL.md, 2.8.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use super::{Tile, Way};
use crate::chip::device::{CONDUCTANCE_BITS, Conducting};
use crate::num::fixed::rsh;

/// Levels, and what they let through: `[row][column]`, the reference column last.
#[derive(Debug, Clone, Default)]
pub(super) struct Through {
    levels: Vec<u16>,
    cells: Vec<i64>,
}

impl Tile {
    /// Columns of cells in use, a reference column among them.
    fn wide(&self, law: Conducting) -> usize {
        self.config.columns + usize::from(law.reference_columns() > 0)
    }

    /// Looks at the levels of a bank again, if one has moved.
    fn look_through(&mut self, law: Conducting, bank: usize) {
        if self.through[bank].levels == self.level[bank] {
            return;
        }
        let (rows, wide) = (self.config.rows, self.wide(law));
        let g = |row: usize, column: usize| match column {
            column if column < self.config.columns => {
                law.of_level(self.level[bank][row * self.size.columns + column])
            }
            _ => law.least(),
        };
        let shared = |a: usize, b: usize| a.min(b) as u64 + 1;
        let mut cells = Vec::with_capacity(rows * wide);
        for (row, column) in (0..rows).flat_map(|row| (0..wide).map(move |c| (row, c))) {
            let mut along = 0;
            if !law.is_even() {
                along += (0..wide).map(|c| g(row, c) * shared(c, column)).sum::<u64>();
                along += (0..rows).map(|r| g(r, column) * shared(r, row)).sum::<u64>();
            }
            cells.push(law.left(g(row, column), along).into());
        }
        self.through[bank] = Through { levels: self.level[bank].clone(), cells };
    }

    /// The current of a line of a bank, in levels.
    pub(super) fn current(&mut self, law: Conducting, bank: usize, way: Way, line: usize) -> i64 {
        self.look_through(law, bank);
        let (rows, columns, wide) = (self.config.rows, self.config.columns, self.wide(law));
        let cell = |row: usize, column: usize| self.through[bank].cells[row * wide + column];
        let down = |column: usize| -> i64 {
            let sum: i64 = (0..rows).map(|row| cell(row, column) * self.row_part(bank, row)).sum();
            rsh(sum, CONDUCTANCE_BITS)
        };
        match way {
            Way::Rows if wide > columns => down(line) - down(columns),
            Way::Rows => down(line),
            Way::Columns => {
                let part = |column: usize| cell(line, column) * self.column_part(column);
                rsh((0..columns).map(part).sum::<i64>(), CONDUCTANCE_BITS)
            }
        }
    }
}
