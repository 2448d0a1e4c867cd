//! Which pulses a write gave, for schedules whose time depends on them.
//!
//! ```text
//! pulses   after the bound, before the cell's window: what is attempted
//! peaks    P+ = max( 0, pulses ),  P- = max( 0, -pulses )      of a row, over the columns of a physical tile
//! ```
//!
//! A sum that is passed over as quiet gives no pulse. See docs/MODEL.md, 4.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use std::ops::Range;

use super::kernel::{Extremes, Half, Kernel, Pulsed};
use super::layout::{BLOCK_ROWS, HALF_CELLS, HALF_COLUMNS, Layout, in_half};

/// What a write tells of its pulses beside their counts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Collect {
    /// Nothing, and nothing is paid.
    Nothing,
    /// Peaks of each row.
    Peaks {
        /// Columns of a physical tile, at least 1.
        tile_columns: usize,
    },
    /// Every pulse. Slow.
    Pulses,
}

/// What was asked for by [`Collect`].
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Collected {
    /// Nothing.
    Nothing,
    /// Peaks by column tile that the written columns touch, left to right.
    Peaks(Vec<RowPeaks>),
    /// Pulses of the written columns, `[row][column]`.
    Pulses(Vec<i8>),
}

/// Most pulses of each row over columns of one physical tile.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RowPeaks {
    /// Column tile, from the left.
    pub tile: usize,
    /// `[P+, P-]` by row of the array.
    pub rows: Vec<[u8; 2]>,
}

impl RowPeaks {
    /// No pulses on `rows` rows.
    #[must_use]
    pub fn new(tile: usize, rows: usize) -> Self {
        Self { tile, rows: vec![[0; 2]; rows] }
    }

    /// Takes other columns of the same tile along.
    ///
    /// # Panics
    /// When they have another number of rows.
    pub fn merge(&mut self, other: &Self) {
        assert!(self.tile == other.tile, "peaks of one tile");
        assert_eq!(self.rows.len(), other.rows.len(), "peaks of the same rows");
        let rows = self.rows.as_flattened_mut().iter_mut();
        rows.zip(other.rows.as_flattened()).for_each(|(most, other)| *most = (*most).max(*other));
    }
}

/// Gathers the pulses of some columns, half block by half block, from left to right and block by block.
pub(super) struct Collector {
    layout: Layout,
    /// Columns that are written and exist.
    columns: Range<usize>,
    tile_columns: usize,
    /// Where the pulses of a half block go; nowhere if nobody asks.
    gathered: Option<Box<Gathered>>,
    collected: Collected,
}

/// Pulses on their way.
struct Gathered {
    /// Of half blocks that lie in one tile.
    extremes: Extremes,
    /// The block and the place of the tile in whose columns `extremes` were met.
    open: Option<(usize, usize)>,
    /// Of one half block.
    plane: Half<i8>,
}

impl Collector {
    /// `columns` start with a panel.
    pub(super) fn new(collect: Collect, layout: Layout, columns: Range<usize>) -> Self {
        let columns = columns.start..columns.end.min(layout.columns);
        let (collected, tile_columns) = match collect {
            Collect::Nothing => (Collected::Nothing, 0),
            Collect::Peaks { tile_columns } => {
                assert!(tile_columns > 0, "a tile has columns");
                let tiles = columns.start / tile_columns..columns.end.div_ceil(tile_columns);
                let peaks = tiles.map(|tile| RowPeaks::new(tile, layout.rows)).collect();
                (Collected::Peaks(peaks), tile_columns)
            }
            Collect::Pulses => (Collected::Pulses(vec![0; layout.rows * columns.len()]), 0),
        };
        let gathered = (collect != Collect::Nothing).then(|| {
            Box::new(Gathered { extremes: Extremes::new(), open: None, plane: [0; HALF_CELLS] })
        });
        Self { layout, columns, tile_columns, gathered, collected }
    }

    /// Places of the first and the last tile of a half block that starts at `column`.
    fn tiles_of(&self, column: usize) -> (usize, usize) {
        let last = (column + HALF_COLUMNS).min(self.columns.end) - 1;
        let first = self.columns.start / self.tile_columns;
        (column / self.tile_columns - first, last / self.tile_columns - first)
    }

    /// Where the pulses of a half block that starts at `column` go.
    pub(super) fn half(
        &mut self,
        kernel: &Kernel,
        (column, block): (usize, usize),
    ) -> Option<Pulsed<'_>> {
        self.gathered.as_ref()?;
        if matches!(self.collected, Collected::Peaks(_)) {
            let (first, last) = self.tiles_of(column);
            if first == last {
                self.open(kernel, (block, first));
                return self.gathered.as_mut().map(|g| Pulsed::Most(&mut g.extremes));
            }
        }
        self.gathered.as_mut().map(|g| Pulsed::Every(&mut g.plane))
    }

    /// Takes the pulses of a half block of which `groups` were programmed, where [`Collector::half`] kept all.
    pub(super) fn take(&mut self, kernel: &Kernel, (column, block): (usize, usize), groups: u16) {
        if self.gathered.is_none() {
            return;
        }
        let groups = (0..16).filter(|group| groups >> group & 1 == 1);
        if matches!(self.collected, Collected::Peaks(_)) {
            let (first, last) = self.tiles_of(column);
            for tile in first..last + usize::from(first < last) {
                self.open(kernel, (block, tile));
                let start = (self.columns.start / self.tile_columns + tile) * self.tile_columns;
                let from = start.saturating_sub(column);
                let to = (start + self.tile_columns - column).min(HALF_COLUMNS);
                let Gathered { extremes, plane, .. } =
                    &mut **self.gathered.as_mut().expect("asked");
                for group in groups.clone() {
                    let at = group * 64 + from * 4;
                    extremes.take(at, &plane[at..group * 64 + to * 4]);
                }
            }
        } else if let (Some(gathered), Collected::Pulses(all)) =
            (&self.gathered, &mut self.collected)
        {
            let (width, first) = (self.columns.len(), column - self.columns.start);
            let live = HALF_COLUMNS.min(width - first);
            for row in groups.flat_map(|group| group * 4..group * 4 + 4) {
                let logical = block * BLOCK_ROWS + row;
                if logical < self.layout.rows {
                    for (c, to) in all[logical * width + first..][..live].iter_mut().enumerate() {
                        *to = gathered.plane[in_half(row, c)];
                    }
                }
            }
        }
    }

    /// Makes the extremes ready for a tile and block, if they were met elsewhere before.
    fn open(&mut self, kernel: &Kernel, place: (usize, usize)) {
        if self.gathered.as_ref().is_some_and(|gathered| gathered.open != Some(place)) {
            self.close(kernel);
            self.gathered.as_mut().expect("somebody asks").open = Some(place);
        }
    }

    /// Ends the tile and block that is open.
    fn close(&mut self, kernel: &Kernel) {
        let Some(gathered) = &mut self.gathered else { return };
        let (Some((block, tile)), Collected::Peaks(tiles)) =
            (gathered.open.take(), &mut self.collected)
        else {
            return;
        };
        let peaks = kernel.peaks(&gathered.extremes);
        gathered.extremes.most.fill(0);
        gathered.extremes.least.fill(0);
        let rows = block * BLOCK_ROWS..self.layout.rows.min((block + 1) * BLOCK_ROWS);
        let live = rows.len();
        tiles[tile].rows[rows].copy_from_slice(&peaks[..live]);
    }

    /// What was asked for.
    pub(super) fn finish(mut self, kernel: &Kernel) -> Collected {
        self.close(kernel);
        self.collected
    }
}

#[cfg(test)]
mod tests;
