//! How operations are counted: stated beside every rate and every efficiency, the same for all commands.
//!
//! ```text
//! MACs         products of a cell and its drive / cells a weight
//! operations   MACs x operations a MAC
//! ```
//!
//! Published chips count a multiplication with its addition as one operation or as two, and a pair of cells as one
//! weight or as two. See docs/MODEL.md, 4.6.

use serde_json::{Value, json};

/// How operations are counted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Convention {
    /// Operations of a multiplication with its addition.
    pub operations_per_mac: u64,
    /// Cells that make a weight.
    pub cells_per_weight: u64,
}

impl Convention {
    /// Two operations a MAC, and a pair of cells, of the two banks of a tile, is a weight.
    pub const PAIRS: Self = Self { operations_per_mac: 2, cells_per_weight: 2 };

    /// The same with another number of cells a weight.
    #[must_use]
    pub const fn with_cells(cells_per_weight: u64) -> Self {
        Self { cells_per_weight, ..Self::PAIRS }
    }

    /// Multiplications with their additions, of products of single cells.
    #[must_use]
    pub fn macs(self, products: u64) -> f64 {
        products as f64 / self.cells_per_weight as f64
    }

    /// Operations, of products of single cells.
    #[must_use]
    pub fn operations(self, products: u64) -> f64 {
        self.operations_per_mac as f64 * self.macs(products)
    }

    /// In words.
    #[must_use]
    pub fn words(self) -> String {
        let Self { operations_per_mac: operations, cells_per_weight: cells } = self;
        let noun = if cells == 1 { "cell" } else { "cells" };
        format!("{operations} operations a MAC, {cells} {noun} a weight")
    }

    /// As a JSON object.
    #[must_use]
    pub fn to_json(self) -> Value {
        json!({"operations_per_mac": self.operations_per_mac,
            "cells_per_weight": self.cells_per_weight, "words": self.words()})
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pair_of_cells_is_a_weight_and_a_mac_two_operations() {
        assert_eq!(Convention::PAIRS, Convention::with_cells(2));
        assert_eq!((Convention::PAIRS.macs(12), Convention::PAIRS.operations(12)), (6.0, 12.0));
        let joined = Convention::with_cells(8);
        assert_eq!(
            (joined.operations(16), &*joined.words()),
            (4.0, "2 operations a MAC, 8 cells a weight")
        );
        assert!(Convention::with_cells(1).words().ends_with("1 cell a weight"));
    }
}
