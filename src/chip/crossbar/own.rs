//! What sets the cells of an array apart from one another, kept beside them as levels lie.
//!
//! It follows from the array's place: [`Crossbar::fit`] makes it, no checkpoint has it. See `chip::device`.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use std::sync::Arc;

use super::layout::{HALF_CELLS, Layout};
use super::{Crossbar, Half};
use crate::chip::device::{Device, OwnCell};
use crate::num::draw::Place;

/// The device of an array, and its cells.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct OwnCells {
    device: Arc<Device>,
    /// Factors of steps up and down, if cells differ in them.
    factors: Option<[Vec<u32>; 2]>,
    windows: Option<OwnWindows>,
}

/// Windows of cells that differ in them.
#[derive(Debug, Clone, PartialEq, Eq)]
struct OwnWindows {
    floor: Vec<u16>,
    ceiling: Vec<u16>,
}

/// What a half block of cells is made of.
#[derive(Debug, Clone, Copy)]
pub struct CellsMade<'a> {
    /// The device.
    pub device: &'a Device,
    /// Factors of steps up and down, if cells differ in them.
    pub factors: Option<[&'a Half<u32>; 2]>,
    /// Floors and ceilings, if cells differ in them.
    pub windows: Option<[&'a Half<u16>; 2]>,
}

impl CellsMade<'_> {
    /// A cell, in the order of levels.
    #[must_use]
    #[inline]
    pub fn cell(&self, at: usize) -> OwnCell {
        let nominal = self.device.nominal();
        let factors = self.factors.map_or(nominal.factors, |of| of.map(|factors| factors[at]));
        let Some(ends) = self.windows else {
            return OwnCell { factors, ..nominal };
        };
        let [floor, ceiling] = ends.map(|ends| ends[at]);
        OwnCell { factors, floor, ceiling, reach: self.device.reach(ceiling - floor) }
    }
}

impl OwnCells {
    /// Cells of an array at a place: seed, layer and pathway.
    fn new(device: Arc<Device>, layout: Layout, place: Place) -> Self {
        let nominal = device.nominal();
        let [steps, windows] = device.differs();
        let cells = layout.cells_padded();
        let mut factors = steps.then(|| nominal.factors.map(|factor| vec![factor; cells]));
        let mut windows = windows.then(|| OwnWindows {
            floor: vec![nominal.floor; cells],
            ceiling: vec![nominal.ceiling; cells],
        });
        if factors.is_some() || windows.is_some() {
            for column in 0..layout.columns {
                for group in 0..layout.rows.div_ceil(16) {
                    let drawn = [0, 1, 2, 3].map(|sub| {
                        let from = Device::place(place, sub);
                        match device.takes(sub as usize) {
                            true => from.quads(layout.rows, column, group),
                            false => [0; 16],
                        }
                    });
                    for row in group * 16..layout.rows.min(group * 16 + 16) {
                        let cell = device.cell(drawn.map(|words| words[row % 16]));
                        let at = layout.index(row, column);
                        if let Some(factors) = &mut factors {
                            [factors[0][at], factors[1][at]] = cell.factors;
                        }
                        if let Some(windows) = &mut windows {
                            windows.floor[at] = cell.floor;
                            windows.ceiling[at] = cell.ceiling;
                        }
                    }
                }
            }
        }
        Self { device, factors, windows }
    }

    /// Whether cells differ in their windows.
    pub(super) const fn windows_differ(&self) -> bool {
        self.windows.is_some()
    }

    /// The half block that begins at a place of the planes.
    pub(super) fn half(&self, at: usize) -> CellsMade<'_> {
        let factors = self.factors.as_ref();
        let windows = self.windows.as_ref();
        CellsMade {
            device: &self.device,
            factors: factors.map(|of| of.each_ref().map(|factors| half(factors, at))),
            windows: windows.map(|of| [half(&of.floor, at), half(&of.ceiling, at)]),
        }
    }
}

fn half<T>(plane: &[T], at: usize) -> &Half<T> {
    (&plane[at..at + HALF_CELLS]).try_into().expect("a half block has 1024 cells")
}

impl Crossbar {
    /// Makes the cells of this array of a device: `place` is its seed, layer and pathway. Levels are held to the cells' own
    /// windows from now on, and at once.
    pub fn fit(&mut self, device: Arc<Device>, place: Place) {
        self.own = Some(Box::new(OwnCells::new(device, self.layout, place)));
        let levels: Vec<u16> = self.levels().collect();
        for (row, levels) in levels.chunks_exact(self.layout.columns).enumerate() {
            self.load_row(row, levels);
        }
    }

    /// What sets a cell apart; `None` of ideal cells.
    #[must_use]
    pub fn own(&self, row: usize, column: usize) -> Option<OwnCell> {
        let at = self.layout.index(row, column);
        let own = self.own.as_ref()?;
        Some(own.half(at / HALF_CELLS * HALF_CELLS).cell(at % HALF_CELLS))
    }

    /// The least and the greatest level that a cell of this array can have.
    pub(super) fn reachable(&self) -> [u16; 2] {
        let [mut least, mut greatest] = [self.window.floor(), self.window.ceiling()];
        if let Some(windows) = self.own.as_ref().and_then(|own| own.windows.as_ref()) {
            least = windows.floor.iter().copied().fold(least, u16::min);
            greatest = windows.ceiling.iter().copied().fold(greatest, u16::max);
        }
        [least, greatest]
    }

    /// The floor of every cell, row-major.
    pub fn floors(&self) -> impl Iterator<Item = u16> {
        let Layout { rows, columns } = self.layout;
        let windows = self.own.as_ref().and_then(|own| own.windows.as_ref());
        let cells = (0..rows).flat_map(move |row| (0..columns).map(move |column| (row, column)));
        cells.map(move |(row, column)| {
            windows.map_or(self.window.floor(), |of| of.floor[self.layout.index(row, column)])
        })
    }
}
