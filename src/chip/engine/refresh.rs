//! Refresh of cells that only rise: what both cells of a pair hold is taken off both, by loading them.
//!
//! ```text
//! c = min( level_E - floor_E, level_I - floor_I )        cell by cell, of the two banks of a pair; floors of their own
//! LOADW of level_E - c and of level_I - c                rows in order, E then I, pair after pair, layer after layer
//! ```
//!
//! In a differential pair this takes nothing from what the pair stands for. Banks of two populations are driven by what their
//! own population hands on, so there a refresh changes what they add up to, unless both hand on alike. The loads are counted as
//! any others, and leave what loads of this chip leave; what is read to find `c` is not charged. See docs/MODEL.md, 3.15.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use super::{Engine, Operation};

impl Engine {
    /// Refreshes all arrays.
    pub fn refresh(&mut self) {
        for layer in 0..self.layers.len() {
            for (_, pair) in self.layers[layer].spec.wiring.planes() {
                self.refresh_pair(layer, pair);
            }
        }
    }

    fn refresh_pair(&mut self, layer: usize, pair: [usize; 2]) {
        let this = &self.layers[layer];
        let columns = this.layout.columns;
        let above = |array: usize| {
            let array = &this.arrays[array];
            array.levels().zip(array.floors()).map(|(level, floor)| level.saturating_sub(floor))
        };
        let common = above(pair[0]).zip(above(pair[1])).map(|(e, i)| e.min(i));
        let common: Vec<u16> = common.collect();
        for array in pair {
            let levels = self.layers[layer].arrays[array].levels().zip(&common);
            let levels: Vec<u16> = levels.map(|(level, c)| level - c).collect();
            for (row, levels) in levels.chunks_exact(columns).enumerate() {
                self.execute(&Operation::LoadWeights { layer, array, row, levels });
            }
        }
    }
}
