//! What the cells of an array let through, as byte planes that kernels read, where that is not their level.
//!
//! ```text
//! e = sum_p 2^(8 p) plane_p                      in 2^-8 levels, by the law of `chip::device`, tile by tile
//! v = rsh( sum_p 2^(8 p) read(plane_p), 8 )
//! ```
//!
//! It follows from the levels: made again when one has moved and the array is read. See docs/MODEL.md, 2.8.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use std::ops::Range;

use aligned_vec::{AVec, avec};

use super::Crossbar;
use super::layout::{BLOCK_CELLS, Layout};
use crate::chip::device::Conducting;

/// Byte planes of an array, and what its reference columns let through.
#[derive(Debug, Clone)]
pub struct Through {
    layout: Layout,
    /// The low bytes first; as many as the greatest number needs.
    planes: Vec<AVec<u8>>,
    /// By tile across and row; empty without reference columns.
    reference: Vec<Vec<u32>>,
}

impl Through {
    /// That of an array, cut into tiles of so many rows and columns.
    #[must_use]
    pub fn new(array: &Crossbar, law: Conducting, [high, wide]: [usize; 2]) -> Self {
        let layout = array.layout();
        let Layout { rows, columns } = layout;
        let levels: Vec<u16> = array.levels().collect();
        let mut planes: Vec<AVec<u8>> = vec![];
        let mut reference = vec![vec![]; columns.div_ceil(wide)];
        let mut of_tile = Vec::new();
        for top in (0..rows).step_by(high) {
            let bottom = (top + high).min(rows);
            for (across, left) in (0..columns).step_by(wide).enumerate() {
                let right = (left + wide).min(columns);
                of_tile.clear();
                for row in top..bottom {
                    of_tile.extend_from_slice(&levels[row * columns + left..row * columns + right]);
                }
                let tile = law.tile(&of_tile, right - left);
                reference[across].extend(tile.reference);
                for (row, cells) in (top..).zip(tile.cells.chunks_exact(right - left)) {
                    for (column, e) in (left..).zip(cells) {
                        let at = layout.index(row, column);
                        for (place, byte) in e.to_le_bytes().into_iter().enumerate() {
                            if byte == 0 {
                                continue;
                            }
                            while planes.len() <= place {
                                planes.push(avec![0; layout.cells_padded()]);
                            }
                            planes[place][at] = byte;
                        }
                    }
                }
            }
        }
        reference.retain(|rows| !rows.is_empty());
        Self { layout, planes, reference }
    }

    /// Some blocks of a panel of every plane, the low bytes first.
    pub fn planes(&self, panel: usize, blocks: Range<usize>) -> impl Iterator<Item = &[u8]> {
        let first = panel * self.layout.panel_cells();
        let cells = first + blocks.start * BLOCK_CELLS..first + blocks.end * BLOCK_CELLS;
        self.planes.iter().map(move |plane| &plane[cells.clone()])
    }

    /// What a cell lets through.
    #[must_use]
    pub fn cell(&self, row: usize, column: usize) -> u32 {
        let at = self.layout.index(row, column);
        let bytes =
            self.planes.iter().zip(0..).map(|(plane, place)| u32::from(plane[at]) << (8 * place));
        bytes.sum()
    }

    /// What the reference column of each tile across lets through, by row of the array; none without reference columns.
    #[must_use]
    pub fn reference(&self) -> &[Vec<u32>] {
        &self.reference
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::chip::device::{Conductance, Reference, Wires};
    use crate::chip::hardware::Hardware;

    /// Fails when a tile has its neighbour's wires, or a plane is one short.
    #[test]
    fn every_tile_has_its_own_wires() {
        let layout = Layout { rows: 70, columns: 40 };
        let mut array = Crossbar::new(layout, &Hardware::reference());
        let levels: Vec<u16> = (0..70 * 40).map(|at| (at * 37 % 256) as u16).collect();
        for (row, levels) in levels.chunks_exact(40).enumerate() {
            array.load_row(row, levels);
        }
        let conductance = Some(Conductance { least: 1 << 16, reference: Reference::Column });
        let wires = Some(Wires { segment: Wires::SEGMENT_MAX / 10_000 });
        let law = Conducting::new(conductance, wires, 255).unwrap();
        let through = Through::new(&array, law, [32, 24]);
        assert_eq!((through.planes.len(), through.reference().len()), (3, 2));
        // the last tile: rows 64 to 69, columns 24 to 39
        let own: Vec<u16> =
            (64..70).flat_map(|row| levels[row * 40 + 24..][..16].to_vec()).collect();
        let tile = law.tile(&own, 16);
        for (at, &e) in tile.cells.iter().enumerate() {
            assert_eq!(through.cell(64 + at / 16, 24 + at % 16), e);
        }
        assert_eq!(&through.reference()[1][64..], tile.reference);
        let planes: Vec<_> = through.planes(1, 1..2).collect();
        let at = layout.index(64, 32) - layout.panel_cells() - BLOCK_CELLS;
        let bytes = planes.iter().map(|plane| plane[at]).chain([0]).collect::<Vec<_>>();
        assert_eq!(u32::from_le_bytes(bytes.try_into().unwrap()), through.cell(64, 32));
    }
}
