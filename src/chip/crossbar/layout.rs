//! Where a cell lies in memory.
//!
//! ```text
//! panel   32 columns;  block  64 rows;  half  16 columns
//! bytes   [panel][block][half][16 groups of 4 rows][16 columns][4 rows]
//! ```
//!
//! One `[half]` is 1 KiB: 64 rows x 16 columns, the shape of an AMX tile, and four rows of 16 columns
//! are one 512-bit vector of 4-byte dot products. Rows are padded to 64, columns to 32; padding cells
//! lie on the floor, are driven with 0 and never counted. Layout is independent of how an array is cut into
//! tiles.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

/// Rows of a block.
pub const BLOCK_ROWS: usize = 64;
/// Columns of a panel.
pub const PANEL_COLUMNS: usize = 32;
/// Columns of a half panel.
pub const HALF_COLUMNS: usize = 16;
/// Cells of a half block: 64 rows x 16 columns.
pub const HALF_CELLS: usize = BLOCK_ROWS * HALF_COLUMNS;
/// Cells of a block of a panel.
pub const BLOCK_CELLS: usize = 2 * HALF_CELLS;

/// Size of a logical array and the place of its cells.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Layout {
    /// Input side.
    pub rows: usize,
    /// Output side.
    pub columns: usize,
}

impl Layout {
    /// Blocks of 64 rows, the last one padded.
    #[must_use]
    pub const fn blocks(self) -> usize {
        self.rows.div_ceil(BLOCK_ROWS)
    }

    /// Rows with padding: the stride of a sample's drives.
    #[must_use]
    pub const fn rows_padded(self) -> usize {
        self.blocks() * BLOCK_ROWS
    }

    /// Panels of 32 columns, the last one padded.
    #[must_use]
    pub const fn panels(self) -> usize {
        self.columns.div_ceil(PANEL_COLUMNS)
    }

    /// Columns with padding.
    #[must_use]
    pub const fn columns_padded(self) -> usize {
        self.panels() * PANEL_COLUMNS
    }

    /// Cells of one panel, padding included.
    #[must_use]
    pub const fn panel_cells(self) -> usize {
        self.blocks() * BLOCK_CELLS
    }

    /// Cells with padding.
    #[must_use]
    pub const fn cells_padded(self) -> usize {
        self.panels() * self.panel_cells()
    }

    /// Cells without padding.
    #[must_use]
    pub const fn cells(self) -> usize {
        self.rows * self.columns
    }

    /// Place of a cell.
    #[inline]
    #[must_use]
    pub const fn index(self, row: usize, column: usize) -> usize {
        let half = (column / PANEL_COLUMNS * self.blocks() + row / BLOCK_ROWS) * 2
            + column % PANEL_COLUMNS / HALF_COLUMNS;
        half * HALF_CELLS + in_half(row % BLOCK_ROWS, column % HALF_COLUMNS)
    }
}

/// Place of a cell inside its half block: `row` below 64, `column` below 16.
#[inline]
#[must_use]
pub const fn in_half(row: usize, column: usize) -> usize {
    row / 4 * 64 + column * 4 + row % 4
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_cell_has_one_place_inside_the_padded_array() {
        for (rows, columns) in [(1, 1), (64, 32), (65, 33), (70, 17), (784, 10)] {
            let layout = Layout { rows, columns };
            let mut seen = vec![false; layout.cells_padded()];
            for row in 0..rows {
                for column in 0..columns {
                    let place = &mut seen[layout.index(row, column)];
                    assert!(!*place, "two cells share a place");
                    *place = true;
                }
            }
        }
    }
}
