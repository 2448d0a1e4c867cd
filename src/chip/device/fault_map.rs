//! Stuck cells of a list: a chip that was looked at, cell by cell.
//!
//! A listed cell is stuck where the list says, whatever the draws of [`super::Faults`] would have it, and on every chip that is read: a list
//! is of no seed. See docs/MODEL.md, 3.12.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use std::sync::Arc;

use super::StuckCell;

/// Where a listed cell is stuck.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum StuckAt {
    /// At a level.
    Level(u16),
    /// At the floor of the window.
    Floor,
    /// At its ceiling.
    Ceiling,
}

/// A cell of a list.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct ListedCell {
    /// Number of the layer.
    pub layer: u16,
    /// Code of the pathway.
    pub pathway: u8,
    /// Row of the logical array.
    pub row: u32,
    /// Column.
    pub column: u32,
    /// Where it is stuck.
    pub at: StuckAt,
}

/// A list of stuck cells, in order; none is twice in it.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct FaultMap(Arc<[ListedCell]>);

impl FaultMap {
    /// That of some cells, in any order. A cell that is listed twice is the error.
    ///
    /// # Errors
    /// When a cell is listed twice: that cell.
    pub fn new(mut cells: Vec<ListedCell>) -> Result<Self, ListedCell> {
        let place = |cell: &ListedCell| (cell.layer, cell.pathway, cell.row, cell.column);
        cells.sort_unstable();
        match cells.windows(2).find(|two| place(&two[0]) == place(&two[1])) {
            Some(two) => Err(two[1]),
            None => Ok(Self(cells.into())),
        }
    }

    /// Its cells.
    #[must_use]
    pub fn cells(&self) -> &[ListedCell] {
        &self.0
    }

    /// Whether it lists none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// The listed cells of an array whose window ends there, row by row.
    pub fn of_array(
        &self,
        (layer, pathway): (u16, u8),
        [floor, ceiling]: [u16; 2],
    ) -> impl Iterator<Item = StuckCell> {
        let of = move |cell: &&ListedCell| (cell.layer, cell.pathway) == (layer, pathway);
        self.0.iter().filter(of).map(move |&ListedCell { row, column, at, .. }| StuckCell {
            row,
            column,
            level: match at {
                StuckAt::Level(level) => level,
                StuckAt::Floor => floor,
                StuckAt::Ceiling => ceiling,
            },
        })
    }

    /// The stuck cells of an array: those drawn, and those listed in the place of any that were drawn where they are.
    #[must_use]
    pub fn over(
        &self,
        drawn: Vec<StuckCell>,
        array: (u16, u8),
        window: [u16; 2],
    ) -> Vec<StuckCell> {
        let listed: Vec<_> = self.of_array(array, window).collect();
        if listed.is_empty() {
            return drawn;
        }
        let place = |cell: &StuckCell| (cell.row, cell.column);
        let free = |cell: &StuckCell| listed.binary_search_by_key(&place(cell), place).is_err();
        let mut all: Vec<_> = drawn.into_iter().filter(free).collect();
        all.extend_from_slice(&listed);
        all.sort_unstable();
        all
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const WINDOW: [u16; 2] = [2, 14];

    fn cell(pathway: u8, row: u32, column: u32, at: StuckAt) -> ListedCell {
        ListedCell { layer: 1, pathway, row, column, at }
    }

    #[test]
    fn a_listed_cell_takes_the_place_of_a_drawn_one() {
        let cells = [
            cell(2, 5, 0, StuckAt::Ceiling),
            cell(2, 0, 7, StuckAt::Floor),
            cell(3, 0, 0, StuckAt::Level(9)),
        ];
        let map = FaultMap::new(cells.to_vec()).unwrap();
        let stuck = |[row, column, level]: [u32; 3]| StuckCell { row, column, level: level as u16 };
        let drawn = [[0, 7, 11], [1, 1, 12]].map(stuck).to_vec();
        let wanted = [[0, 7, 2], [1, 1, 12], [5, 0, 14]].map(stuck);
        assert_eq!(map.over(drawn.clone(), (1, 2), WINDOW), wanted);
        assert_eq!(map.over(drawn.clone(), (0, 2), WINDOW), drawn);
        assert_eq!(map.over(vec![], (1, 3), WINDOW), [stuck([0, 0, 9])]);
    }

    #[test]
    fn a_cell_that_is_listed_twice_is_told() {
        let twice = [cell(0, 3, 3, StuckAt::Ceiling), cell(0, 3, 3, StuckAt::Level(4))];
        assert_eq!(FaultMap::new(twice.to_vec()).unwrap_err(), twice[0]);
        assert!(FaultMap::default().is_empty());
    }
}
