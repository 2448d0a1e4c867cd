//! What a cell conducts beside its level, and what wires leave of it.
//!
//! ```text
//! g   = 2^8 level + O            O = 2^8 ceiling / (on_off - 1), rounded: level 0 conducts too                  in 2^-8 levels
//! A   = sum_c' g[r][c'] (min(c, c') + 1)  +  sum_r' g[r'][c] (min(r, r') + 1)          of a tile; from drivers and amplifiers
//! s   = (A K) >> 40              K = 2^64 (segment / cell) / (2^8 ceiling + O), rounded                  24 fractional bits
//! e   = ((g << 24) + h div 2) div h,   h = 2^24 + s                                                           in 2^-8 levels
//! v   = rsh( sum_r x_s e, 8 )    less, with a reference column, rsh( sum_r x_s e[reference], 8 )
//! ```
//!
//! `s` is the voltage that wires take of a cell, over the cell's own, to first order in their resistance: drivers at column 0,
//! amplifiers at row 0, both without resistance, a segment a cell. What is left of a drive is divided by `1 + s` rather than taken off
//! as `1 - s`: the same to first order, and never below 0. `s` is a number of the levels alone, so currents stay linear in drives, and a
//! tile that is read from its columns has the same `e`. See docs/MODEL.md, 2.8.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use std::ops::Range;

/// Fractional bits of what a cell conducts, in levels.
pub const CONDUCTANCE_BITS: u32 = 8;
/// Fractional bits of `s`.
const DROP_BITS: u32 = 24;
/// Fractional bits of `K` beyond those of `s`.
const FINE_BITS: u32 = 40;

/// What a column is compared with.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Reference {
    /// With nothing: what cells conduct at level 0 stays in the sums.
    #[default]
    None,
    /// Each bank of a tile has a column of cells at level 0, whose current is taken off every other column's before it is converted.
    Column,
}

/// What a cell conducts at level 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Conductance {
    /// `O`: in 2^-8 of what a level adds.
    pub least: u32,
    /// What takes it off again.
    pub reference: Reference,
}

impl Conductance {
    /// Greatest `least`: ten times what the highest level of 12 bits adds.
    pub const LEAST_MAX: u32 = 10 * (4095 << CONDUCTANCE_BITS);
}

/// Resistance of the wires of a tile.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Wires {
    /// Resistance of the wire from one cell to the next over that of a cell at the ceiling, in 2^-48.
    pub segment: u64,
}

impl Wires {
    /// Fractional bits of a segment.
    pub const SEGMENT_BITS: u32 = 48;
    /// Greatest segment: that of a cell.
    pub const SEGMENT_MAX: u64 = 1 << Self::SEGMENT_BITS;
}

/// The law of a chip whose cells conduct something else than their level.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Conducting {
    /// `O`.
    least: u64,
    reference: Reference,
    /// `K`; 0 where wires have no resistance.
    drop: u64,
}

/// What the cells of a tile and of its reference column let through, row by row, in 2^-8 levels.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct LetThrough {
    /// `[row][column]`.
    pub cells: Vec<u32>,
    /// A row each; empty without a reference column.
    pub reference: Vec<u32>,
}

impl Conducting {
    /// That of a chip whose window ends at `ceiling`; `None` where a cell conducts its level.
    #[must_use]
    pub fn new(
        conductance: Option<Conductance>,
        wires: Option<Wires>,
        ceiling: u16,
    ) -> Option<Self> {
        if conductance.is_none() && wires.is_none() {
            return None;
        }
        let Conductance { least, reference } =
            conductance.unwrap_or(Conductance { least: 0, reference: Reference::None });
        let least = u64::from(least);
        let whole = u128::from((u64::from(ceiling) << CONDUCTANCE_BITS) + least);
        let fine = 64 - Wires::SEGMENT_BITS;
        let drop = wires.map_or(0, |wires| {
            let drop = ((u128::from(wires.segment) << fine) + whole / 2) / whole;
            u64::try_from(drop).expect("a segment is no more than a cell, which conducts a level")
        });
        Some(Self { least, reference, drop })
    }

    /// Whether currents are those of the levels after all: what level 0 conducts is taken off exactly, and wires take nothing.
    #[must_use]
    pub const fn is_exact(self) -> bool {
        self.drop == 0 && matches!(self.reference, Reference::Column)
    }

    /// Whether every cell conducts the same beside its level, and wires take nothing.
    #[must_use]
    pub const fn is_even(self) -> bool {
        self.drop == 0
    }

    /// Columns of cells that a bank of a tile has beside those in use.
    #[must_use]
    pub const fn reference_columns(self) -> u64 {
        matches!(self.reference, Reference::Column) as u64
    }

    /// `O`, in 2^-8 levels.
    #[must_use]
    pub const fn least(self) -> u64 {
        self.least
    }

    /// `g`.
    #[must_use]
    pub fn of_level(self, level: u16) -> u64 {
        (u64::from(level) << CONDUCTANCE_BITS) + self.least
    }

    /// `e` of a cell that conducts `g`, of the sum `A`.
    #[must_use]
    pub fn left(self, g: u64, along: u64) -> u32 {
        let drop = (u128::from(along) * u128::from(self.drop)) >> FINE_BITS;
        // of more than that nothing is left
        let whole = (1 << DROP_BITS) + u64::try_from(drop.min(1 << 62)).expect("62 bits");
        u32::try_from(((g << DROP_BITS) + whole / 2) / whole).expect("no more than g")
    }

    /// What the cells of a tile let through, of levels row by row. The reference column lies behind the columns in use.
    #[must_use]
    pub fn tile(self, levels: &[u16], columns: usize) -> LetThrough {
        let rows = levels.len() / columns;
        let wide = columns + usize::from(self.reference == Reference::Column);
        let mut g: Vec<u64> = Vec::with_capacity(rows * wide);
        for levels in levels.chunks_exact(columns) {
            g.extend(levels.iter().map(|&level| self.of_level(level)));
            g.resize(g.len() + wide - columns, self.least);
        }
        if self.drop > 0 {
            let mut along = vec![0; rows * wide];
            for (g, along) in g.chunks_exact(wide).zip(along.chunks_exact_mut(wide)) {
                along_row(g, along);
            }
            along_columns(&g, wide, &mut along);
            for (g, along) in g.iter_mut().zip(along) {
                *g = self.left(*g, along).into();
            }
        }
        let narrow = |g: &u64| u32::try_from(*g).expect("no more than a cell conducts");
        let of = |range: Range<usize>| {
            g.chunks_exact(wide).flat_map(move |row| row[range.clone()].iter().map(narrow))
        };
        LetThrough { cells: of(0..columns).collect(), reference: of(columns..wide).collect() }
    }
}

/// Adds `sum_c' g[c'] (min(c, c') + 1)` to every place of a row: from one place to the next it grows by all that lies behind.
fn along_row(g: &[u64], along: &mut [u64]) {
    let mut behind: u64 = g.iter().sum();
    let mut sum = 0;
    for (g, along) in g.iter().zip(along) {
        sum += behind;
        behind -= g;
        *along += sum;
    }
}

/// The same down all columns.
fn along_columns(g: &[u64], wide: usize, along: &mut [u64]) {
    let mut behind = vec![0; wide];
    for g in g.chunks_exact(wide) {
        behind.iter_mut().zip(g).for_each(|(behind, g)| *behind += g);
    }
    let mut sum = vec![0; wide];
    for (g, along) in g.chunks_exact(wide).zip(along.chunks_exact_mut(wide)) {
        for column in 0..wide {
            sum[column] += behind[column];
            behind[column] -= g[column];
            along[column] += sum[column];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn wires(segment: u64) -> Option<Wires> {
        Some(Wires { segment })
    }

    proptest! {
        /// The running sums are the sums of the law, whose terms are shared segments.
        #[test]
        fn running_sums_are_sums_over_shared_segments(
            rows in 1usize..=9,
            columns in 1usize..=9,
            levels in prop::collection::vec(0u16..=4095, 81),
            least in 0u32..=100_000,
            column: bool,
            segment in prop_oneof![1u64..=1 << 30, Just(Wires::SEGMENT_MAX)],
        ) {
            let reference = if column { Reference::Column } else { Reference::None };
            let conductance = Some(Conductance { least, reference });
            let law = Conducting::new(conductance, wires(segment), 4095).unwrap();
            let levels = &levels[..rows * columns];
            let through = law.tile(levels, columns);
            let g = |r: usize, c: usize| match c {
                c if c < columns => law.of_level(levels[r * columns + c]),
                _ => least.into(),
            };
            let wide = columns + usize::from(column);
            for (r, c) in (0..rows).flat_map(|r| (0..wide).map(move |c| (r, c))) {
                let shared = |a: usize, b: usize| a.min(b) as u64 + 1;
                let row: u64 = (0..wide).map(|other| g(r, other) * shared(c, other)).sum();
                let down: u64 = (0..rows).map(|other| g(other, c) * shared(r, other)).sum();
                let e = law.left(g(r, c), row + down);
                prop_assert!(u64::from(e) <= g(r, c));
                let found =
                    if c < columns { through.cells[r * columns + c] } else { through.reference[r] };
                prop_assert_eq!(found, e);
            }
        }
    }

    #[test]
    fn a_single_cell_in_series_with_its_two_segments_is_exact() {
        // 255 levels are one cell's conductance; each segment has a hundredth of its resistance: 1 / 1.02 of it is left
        let law = Conducting::new(None, wires(Wires::SEGMENT_MAX / 100), 255).unwrap();
        assert_eq!(law.tile(&[255], 1).cells, [255 * 256 * 100 / 102]);
        // what conducts less loses less: 1 / (1 + 0.02 x 100 / 255)
        assert_eq!(law.tile(&[100], 1).cells, [(25_600 * 25_500 + 12_850) / 25_700]);
    }

    #[test]
    fn a_reference_column_takes_off_what_level_0_conducts() {
        let of = |reference| {
            let conductance = Some(Conductance { least: 7000, reference });
            Conducting::new(conductance, None, 255).unwrap()
        };
        assert!(of(Reference::Column).is_exact() && !of(Reference::None).is_exact());
        let through = of(Reference::Column).tile(&[0, 3, 255, 1], 2);
        assert_eq!(through.reference, [7000, 7000]);
        assert_eq!(through.cells, [7000, 7000 + 768, 7000 + 65_280, 7256]);
        assert!(of(Reference::None).tile(&[0], 1).reference.is_empty());
        assert_eq!(Conducting::new(None, None, 255), None);
    }

    #[test]
    fn the_widest_tile_of_the_greatest_cells_fits_its_numbers() {
        let least = Conductance::LEAST_MAX;
        let conductance = Some(Conductance { least, reference: Reference::None });
        for ceiling in [1, 4095] {
            let law = Conducting::new(conductance, wires(Wires::SEGMENT_MAX), ceiling).unwrap();
            let g = law.of_level(4095);
            let side: u64 = 1 << 15;
            let e = law.left(g, g * side * (side + 1));
            assert!(u64::from(e) <= g);
        }
        // a segment as long as a cell, and cells of one level
        let law = Conducting::new(None, wires(Wires::SEGMENT_MAX), 1).unwrap();
        assert_eq!(law.left(law.of_level(4095), law.of_level(4095) << 31), 0);
    }
}
