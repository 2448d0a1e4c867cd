//! Unsigned arrays of cells: storage, read, outer-product sums, programming.
//!
//! A [`Crossbar`] is one logical array, rows x columns, of levels in a window. It is stored as the
//! physical tile is read (see [`layout`]), and the loops that touch every cell live in [`kernel`]. Above 8
//! bits a level has two byte planes: `level = low + 256 high`.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use std::ops::Range;

use aligned_vec::{AVec, avec};
use bitvec::prelude::*;

use super::device::StuckCell;
use super::hardware::{FloorKind, Hardware, Window};

use kernel::{Cells, Drives, Half, Kernel};
use layout::{BLOCK_CELLS, BLOCK_ROWS, HALF_CELLS, HALF_COLUMNS, Layout, PANEL_COLUMNS};

mod form;
mod initial;
pub mod kernel;
pub mod layout;
mod memory;
mod optimise;
mod own;
mod pulses;
mod state;
mod stuck;
mod through;
mod trains;
mod words;
mod write;

pub use form::{Form, LongSums, Met, SHORT_READS};
pub use initial::{InitialLaw, initial_levels, initial_scale};
use memory::stamp_of;
pub use memory::{CellMemory, CellMemoryMut};
pub use optimise::{Adam, Asks, Momentum};
pub use own::{CellsMade, OwnCells};
pub use pulses::{Collect, Collected, RowPeaks};
pub use through::Through;
pub use trains::ColumnTrain;
pub use write::{WriteRequest, Written};

/// One logical array of cells and the digital state behind them.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Crossbar {
    layout: Layout,
    window: Window,
    /// Aligned to lines of the processor's cache, as tiles are loaded.
    low: AVec<u8>,
    high: Option<AVec<u8>>,
    residual: Option<Vec<u16>>,
    /// Which cells do not move: of absorbing floors those that are gone for good, and the stuck ones. [`Cells::GONE`], or 0.
    pruned: Option<Vec<u8>>,
    /// Whether the floor absorbs.
    absorbs: bool,
    /// Cells that hold their level, row by row.
    stuck: Vec<StuckCell>,
    /// What cells are made of, if they are not ideal.
    own: Option<Box<OwnCells>>,
    /// What they remember beside their level, if anything.
    memory: Option<Box<CellMemory>>,
}

/// The parts of some panels side by side that a write may change.
#[derive(Debug)]
pub struct StripMut<'a> {
    first: usize,
    layout: Layout,
    low: &'a mut [u8],
    high: Option<&'a mut [u8]>,
    residual: Option<&'a mut [u16]>,
    pruned: Option<&'a mut [u8]>,
    own: Option<&'a OwnCells>,
    memory: Option<CellMemoryMut<'a>>,
}

/// A half block of a byte plane.
struct HalfPart<'a> {
    /// Place of the byte in a level.
    shift: u32,
    /// First row and column.
    row: usize,
    column: usize,
    /// Columns that exist.
    live: usize,
    cells: &'a [u8],
}

impl Crossbar {
    /// Panels worth writing together: their gates and a block of drives stay in a processor's first cache.
    pub const STRIP_PANELS: usize = 4;

    /// An array with every cell on the floor.
    #[must_use]
    pub fn new(layout: Layout, hardware: &Hardware) -> Self {
        let cells = layout.cells_padded();
        let [low, high] = hardware.cell.window.floor().to_le_bytes();
        let wide = hardware.cell.level_bits.get() > 8;
        let absorbs = hardware.cell.floor_kind == FloorKind::Absorbing;
        Self {
            layout,
            window: hardware.cell.window,
            low: avec![low; cells],
            high: wide.then(|| avec![high; cells]),
            residual: (hardware.write.residual_bits.get() > 0).then(|| vec![0; cells]),
            pruned: absorbs.then(|| vec![0; cells]),
            absorbs,
            stuck: vec![],
            own: None,
            memory: None,
        }
    }

    /// Size and places.
    #[must_use]
    pub const fn layout(&self) -> Layout {
        self.layout
    }

    /// Its window.
    #[must_use]
    pub const fn window(&self) -> Window {
        self.window
    }

    /// The level of a cell.
    #[inline]
    #[must_use]
    pub fn level(&self, row: usize, column: usize) -> u16 {
        let at = self.layout.index(row, column);
        u16::from_le_bytes([self.low[at], self.high.as_ref().map_or(0, |high| high[at])])
    }

    /// Loads a row of levels; stuck cells keep theirs. Cells with a window of their own take them as far as that goes.
    ///
    /// # Panics
    /// When a level lies outside the window: levels are checked at the door.
    pub fn load_row(&mut self, row: usize, levels: &[u16]) {
        assert_eq!(levels.len(), self.layout.columns, "a row has one level a column");
        let differ = self.own.as_ref().is_some_and(|own| own.windows_differ());
        for (column, &level) in levels.iter().enumerate() {
            let own = self.own(row, column);
            // a level of another chip may lie beyond what any cell of this one has
            let [floor, ceiling] = match own {
                Some(_) if differ => [0, u16::MAX],
                _ => [self.window.floor(), self.window.ceiling()],
            };
            assert!((floor..=ceiling).contains(&level), "level {level} lies outside the window");
            let level = own.map_or(level, |own| level.clamp(own.floor, own.ceiling));
            self.put(row, column, level);
        }
        self.hold_row(row);
    }

    /// Puts a level into a cell.
    fn put(&mut self, row: usize, column: usize, level: u16) {
        let at = self.layout.index(row, column);
        let [low, high] = level.to_le_bytes();
        self.low[at] = low;
        if let Some(plane) = &mut self.high {
            plane[at] = high;
        }
        self.leave(at, level);
    }

    /// The levels, row-major.
    pub fn levels(&self) -> impl Iterator<Item = u16> + use<> {
        let Layout { rows, columns } = self.layout;
        let mut levels = vec![0; rows * columns];
        for HalfPart { shift, row, column, live, cells } in self.parts() {
            for (group, cells) in cells.as_chunks::<64>().0.iter().enumerate() {
                for r in 0..rows.saturating_sub(row + group * 4).min(4) {
                    let to = &mut levels[(row + group * 4 + r) * columns + column..][..live];
                    let cells = cells.as_chunks::<4>().0;
                    to.iter_mut().zip(cells).for_each(|(to, of)| *to |= u16::from(of[r]) << shift);
                }
            }
        }
        levels.into_iter()
    }

    /// Sums of the levels of each row.
    #[must_use]
    pub fn row_sums(&self) -> Vec<i64> {
        let mut sums = vec![0; self.layout.rows_padded()];
        for HalfPart { shift, row, live, cells, .. } in self.parts() {
            for (group, cells) in cells.as_chunks::<64>().0.iter().enumerate() {
                let mut rows = [0u16; 4];
                for cells in &cells.as_chunks::<4>().0[..live] {
                    rows.iter_mut().zip(cells).for_each(|(row, &low)| *row += u16::from(low));
                }
                let to = &mut sums[row + group * 4..][..4];
                to.iter_mut().zip(rows).for_each(|(sum, row)| *sum += i64::from(row) << shift);
            }
        }
        sums
    }

    /// Half blocks of both byte planes.
    fn parts(&self) -> impl Iterator<Item = HalfPart<'_>> {
        let planes = [(Some(&self.low), 0), (self.high.as_ref(), 8)];
        let planes = planes.into_iter().filter_map(|(plane, shift)| Some((plane?, shift)));
        let (blocks, columns) = (self.layout.blocks(), self.layout.columns);
        planes.flat_map(move |(plane, shift)| {
            plane.chunks_exact(HALF_CELLS).enumerate().filter_map(move |(at, cells)| {
                let column = at / 2 / blocks * PANEL_COLUMNS + at % 2 * HALF_COLUMNS;
                let live = columns.saturating_sub(column).min(HALF_COLUMNS);
                let row = at / 2 % blocks * BLOCK_ROWS;
                (live > 0).then_some(HalfPart { shift, row, column, live, cells })
            })
        })
    }

    /// The remainders behind the cells, row-major; `None` when the array has none.
    #[must_use]
    pub fn residuals(&self) -> Option<Vec<u16>> {
        let Layout { rows, columns } = self.layout;
        let cells = (0..rows).flat_map(|row| (0..columns).map(move |column| (row, column)));
        self.residual
            .as_ref()
            .map(|residual| cells.map(|(r, c)| residual[self.layout.index(r, c)]).collect())
    }

    /// Which cells are gone for good, row-major; `None` unless the floor absorbs. A stuck or worn cell is none of them.
    #[must_use]
    pub fn pruned(&self) -> Option<BitVec<u8, Lsb0>> {
        let Layout { rows, columns } = self.layout;
        let cells = (0..rows).flat_map(|row| (0..columns).map(move |column| (row, column)));
        let pruned = self.pruned.as_ref().filter(|_| self.absorbs)?;
        let mut gone: BitVec<u8, Lsb0> =
            cells.map(|(r, c)| pruned[self.layout.index(r, c)] != 0).collect();
        for cell in &self.stuck {
            gone.set(cell.row as usize * columns + cell.column as usize, false);
        }
        for (cell, [spent, limit]) in self.wear().into_iter().flatten().enumerate() {
            if spent >= limit {
                gone.set(cell, false);
            }
        }
        Some(gone)
    }

    /// Restores the remainders, row-major.
    ///
    /// # Panics
    /// When the array has none or the number differs.
    pub fn load_residuals(&mut self, values: &[u16]) {
        let layout = self.layout;
        let residual = self.residual.as_mut().expect("only arrays with a remainder load one");
        assert_eq!(values.len(), layout.cells(), "one remainder a cell");
        for (i, &value) in values.iter().enumerate() {
            residual[layout.index(i / layout.columns, i % layout.columns)] = value;
        }
    }

    /// Restores which cells are gone for good, row-major.
    ///
    /// # Panics
    /// When the floor does not absorb or the number differs.
    pub fn load_pruned(&mut self, values: &BitSlice<u8, Lsb0>) {
        let layout = self.layout;
        assert!(self.absorbs, "only absorbing floors load pruned cells");
        let pruned = self.pruned.as_mut().expect("made with the array");
        assert_eq!(values.len(), layout.cells(), "one bit a cell");
        for (i, gone) in values.iter().by_vals().enumerate() {
            let at = layout.index(i / layout.columns, i % layout.columns);
            pruned[at] = if gone { Cells::GONE } else { 0 };
        }
        self.mark_stuck();
    }

    /// Low bytes of the levels of some blocks of a panel.
    #[must_use]
    pub fn low(&self, panel: usize, blocks: Range<usize>) -> &[u8] {
        self.plane(&self.low, panel, blocks)
    }

    /// High bytes, of levels above 8 bits.
    #[must_use]
    pub fn high(&self, panel: usize, blocks: Range<usize>) -> Option<&[u8]> {
        self.high.as_ref().map(|high| self.plane(high, panel, blocks))
    }

    fn plane<'a>(&self, plane: &'a [u8], panel: usize, blocks: Range<usize>) -> &'a [u8] {
        let first = panel * self.layout.panel_cells();
        &plane[first + blocks.start * BLOCK_CELLS..first + blocks.end * BLOCK_CELLS]
    }

    /// The transposed read: sums of every row over all columns, `[sample][rows padded]`, are put into `sums` and handed
    /// to `take` with the place of their byte in a level: `sum 2^place`, once a byte plane. `gates` are signed bytes that
    /// lie as drives do, by column.
    pub fn read_columns(
        &self,
        kernel: &Kernel,
        gates: Drives<'_>,
        sums: &mut Vec<i32>,
        mut take: impl FnMut(&[i32], u32),
    ) {
        let layout = self.layout;
        sums.resize(gates.samples() * layout.rows_padded(), 0);
        kernel.read_columns(&self.low, layout, gates, sums);
        take(sums, 0);
        if let Some(high) = &self.high {
            kernel.read_columns(high, layout, gates, sums);
            take(sums, 8);
        }
    }

    /// The array cut into strips of so many panels that can be written side by side.
    pub fn strips_mut(&mut self, panels: usize) -> impl Iterator<Item = StripMut<'_>> {
        let layout = self.layout;
        let cells = panels * layout.panel_cells();
        let mut low = self.low.chunks_mut(cells);
        let mut high = self.high.as_mut().map(|plane| plane.chunks_mut(cells));
        let mut residual = self.residual.as_mut().map(|plane| plane.chunks_mut(cells));
        let mut pruned = self.pruned.as_mut().map(|plane| plane.chunks_mut(cells));
        let own = self.own.as_deref();
        let absorbs = self.absorbs;
        let mut memory = self.memory.as_mut().map(|memory| memory.strips(cells, absorbs));
        (0..layout.panels()).step_by(panels).map(move |first| StripMut {
            first,
            layout,
            low: low.next().expect("one chunk a strip"),
            high: high.as_mut().map(|chunks| chunks.next().expect("one chunk a strip")),
            residual: residual.as_mut().map(|chunks| chunks.next().expect("one chunk a strip")),
            pruned: pruned.as_mut().map(|chunks| chunks.next().expect("one chunk a strip")),
            own,
            memory: memory.as_mut().map(|strips| strips.next().expect("one a strip")),
        })
    }
}
