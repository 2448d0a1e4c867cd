//! Stuck cells: they hold one level, whatever is loaded or written.
//!
//! ```text
//! w = 32-bit word of the cell at site 16, sub 0                                         v: the same at sub 1
//! level = floor                                       w < F
//!         ceiling                                     F <= w < F + C                    F, C, A = floor(2^32 share + 1/2)
//!         floor + ((v (ceiling - floor + 1)) >> 32)   F + C <= w < F + C + A
//!         free                                        else
//! ```
//!
//! Cells are numbered on the logical array, so tiles cannot move a fault. To a write a stuck cell is one that was pruned: it
//! takes pulses and does not move; to statistics it is none. See docs/MODEL.md, 3.12.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use crate::num::draw::{Place, Site, below};

/// How often something is so, of 2^32.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default)]
pub struct Chance(u64);

impl Chance {
    /// Never.
    pub const NEVER: Self = Self(0);

    /// So often of 2^32; at most always.
    #[must_use]
    pub const fn new(of_2_32: u64) -> Option<Self> {
        if of_2_32 <= 1 << 32 { Some(Self(of_2_32)) } else { None }
    }

    /// Of 2^32.
    #[must_use]
    pub const fn get(self) -> u64 {
        self.0
    }
}

/// Which shares of the cells are stuck where.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Faults {
    /// At the floor.
    pub floor: Chance,
    /// At the ceiling.
    pub ceiling: Chance,
    /// At any level of the window, each as often as any other.
    pub any: Chance,
}

/// A cell that holds its level.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct StuckCell {
    /// Row of the logical array.
    pub row: u32,
    /// Column.
    pub column: u32,
    /// Its level.
    pub level: u16,
}

impl Faults {
    /// No cell is stuck.
    pub const NONE: Self =
        Self { floor: Chance::NEVER, ceiling: Chance::NEVER, any: Chance::NEVER };

    /// Whether no cell is stuck.
    #[must_use]
    pub fn is_none(self) -> bool {
        self == Self::NONE
    }

    /// Share of all cells that are stuck, of 2^32; more than that is no share.
    #[must_use]
    pub const fn total(self) -> u64 {
        self.floor.0 + self.ceiling.0 + self.any.0
    }

    /// Where a cell of these words is stuck.
    fn level(self, [w, v]: [u32; 2], [floor, ceiling]: [u16; 2]) -> Option<u16> {
        let w = u64::from(w);
        let at_floor = self.floor.0;
        let at_ceiling = at_floor + self.ceiling.0;
        match w {
            w if w < at_floor => Some(floor),
            w if w < at_ceiling => Some(ceiling),
            w if w < at_ceiling + self.any.0 => {
                let above = below(v, u32::from(ceiling - floor) + 1);
                Some(floor + u16::try_from(above).expect("inside the window"))
            }
            _ => None,
        }
    }

    /// The level at which a cell of an array of so many rows is stuck: the law.
    #[must_use]
    pub fn stuck_at(
        self,
        place: Place,
        window: [u16; 2],
        rows: usize,
        [row, column]: [usize; 2],
    ) -> Option<u16> {
        let word = |sub| Place { site: Site::StuckCell, sub, count: 0, ..place };
        let words = [0, 1].map(|sub| word(sub).whole(rows, row, column));
        self.level(words, window)
    }

    /// The stuck cells of an array, row by row. Of `place` the seed, the layer and the pathway count; `window` is its floor and
    /// ceiling.
    ///
    /// # Panics
    /// When the array has more rows or columns than places have.
    #[must_use]
    pub fn stuck(
        self,
        place: Place,
        window: [u16; 2],
        [rows, columns]: [usize; 2],
    ) -> Vec<StuckCell> {
        if self.is_none() {
            return vec![];
        }
        let place = |sub| Place { site: Site::StuckCell, sub, count: 0, ..place };
        let mut words = [0, 1].map(|_| vec![0; rows.div_ceil(16) * 64]);
        let mut all = Vec::new();
        for column in 0..columns {
            place(0).columns(rows, column..column + 1, 4, &mut words[0]);
            if self.any > Chance::NEVER {
                place(1).columns(rows, column..column + 1, 4, &mut words[1]);
            }
            let [w, v] = words.each_ref().map(|bytes| bytes.as_chunks::<4>().0);
            for (row, (w, v)) in w.iter().zip(v).take(rows).enumerate() {
                let words = [w, v].map(|bytes| u32::from_le_bytes(*bytes));
                let narrow = |at: usize| u32::try_from(at).expect("sides have 16 bits");
                if let Some(level) = self.level(words, window) {
                    let (row, column) = (narrow(row), narrow(column));
                    all.push(StuckCell { row, column, level });
                }
            }
        }
        all.sort_unstable();
        all
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn place(seed: u64, layer: u16, pathway: u8) -> Place {
        Place { seed, site: Site::StuckCell, layer, pathway, sub: 0, count: 0 }
    }

    const SIZE: [usize; 2] = [400, 250];
    const WINDOW: [u16; 2] = [2, 14];

    fn faults() -> Faults {
        let share = |of_100: u64| Chance::new((of_100 << 32) / 100).unwrap();
        Faults { floor: share(2), ceiling: share(1), any: share(10) }
    }

    #[test]
    fn all_cells_of_an_array_are_those_of_the_law_for_one() {
        for size in [[1, 1], [15, 3], [16, 2], [17, 5], [70, 4]] {
            let all = faults().stuck(place(9, 3, 5), WINDOW, size);
            let law = (0..size[0]).flat_map(|row| (0..size[1]).map(move |column| [row, column]));
            let law = law.filter_map(|[row, column]| {
                let level = faults().stuck_at(place(9, 3, 5), WINDOW, size[0], [row, column])?;
                Some(StuckCell { row: row as u32, column: column as u32, level })
            });
            assert!(law.eq(all), "{size:?}");
        }
        assert!(Faults::NONE.stuck(place(1, 0, 0), WINDOW, SIZE).is_empty());
        let always = Faults { any: Chance::new(1 << 32).unwrap(), ..Faults::NONE };
        assert_eq!(always.stuck(place(1, 0, 0), WINDOW, [7, 9]).len(), 63);
        assert_eq!(Chance::new((1 << 32) + 1), None);
    }
}
