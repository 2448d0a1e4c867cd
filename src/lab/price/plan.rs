//! How much of a chip a network takes: tiles, columns, converters, drivers, cells.

use crate::chip::hardware::{Adc, Hardware, Subtract};
use crate::chip::layer::Layer;
use crate::lab::config::Per;
use crate::learn::statistics::PathwayRecord;

/// Arrays of one layer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LayerFootprint {
    /// Rows of an array.
    pub rows: u64,
    /// Columns of an array.
    pub columns: u64,
    /// Pairs of arrays: one a target or, where each pathway is a pair, two.
    pub targets: u64,
    /// How often each of them stands on the chip.
    pub copies: u64,
}

impl LayerFootprint {
    /// Cells of one copy.
    const fn cells(&self) -> u64 {
        2 * self.targets * self.rows * self.columns
    }
}

/// Arrays of a network.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Footprint {
    /// Layers, from the input.
    pub layers: Vec<LayerFootprint>,
}

impl Footprint {
    /// The plan of networks on a chip, layer by layer.
    #[must_use]
    pub fn of_layers<'a>(layers: impl Iterator<Item = &'a Layer>) -> Self {
        let layer = |layer: &Layer| LayerFootprint {
            rows: layer.layout.rows as u64,
            columns: layer.layout.columns as u64,
            targets: layer.spec.wiring.planes().count() as u64,
            copies: layer.spec.copies as u64,
        };
        Self { layers: layers.map(layer).collect() }
    }

    /// The plan of a run, from what it recorded of its pathways; `copies` of the arrays of each of its first layers.
    #[must_use]
    pub fn of_records(pathways: &[PathwayRecord], copies: &[usize]) -> Self {
        let mut layers: Vec<(LayerFootprint, u64)> = Vec::new();
        for one in pathways {
            let [rows, columns] = one.shape.map(|side| side as u64);
            if one.layer == layers.len() {
                layers.push((LayerFootprint { rows, columns, targets: 0, copies: 1 }, 0));
            }
            if let Some((_, arrays)) = layers.last_mut() {
                *arrays += 1;
            }
        }
        let copies = copies.iter().copied().chain(std::iter::repeat(1));
        let layers =
            layers.into_iter().zip(copies).map(|((layer, arrays), copies)| LayerFootprint {
                // a pair has two banks
                targets: arrays / 2,
                copies: copies as u64,
                ..layer
            });
        Self { layers: layers.collect() }
    }

    /// Physical tiles on a chip.
    #[must_use]
    pub fn tiles(&self, hardware: &Hardware) -> u64 {
        let (rows, columns) = (hardware.tile.rows as u64, hardware.tile.columns as u64);
        let of = |l: &LayerFootprint| {
            l.copies * l.targets * l.rows.div_ceil(rows) * l.columns.div_ceil(columns)
        };
        self.layers.iter().map(of).sum()
    }

    /// Cells on the chip.
    #[must_use]
    pub fn cells(&self) -> u64 {
        self.layers.iter().map(|l| l.copies * l.cells()).sum()
    }

    /// Cells of the network, whose copies hold the same.
    #[must_use]
    pub fn cells_apart(&self) -> u64 {
        self.layers.iter().map(LayerFootprint::cells).sum()
    }

    /// How many parts of a kind idle while the network runs; events do not idle.
    #[must_use]
    pub fn parts(&self, per: Per, hardware: &Hardware) -> u64 {
        let (rows, columns) = (hardware.tile.rows as u64, hardware.tile.columns as u64);
        let tiles = self.tiles(hardware);
        match per {
            Per::Event(_) => 0,
            Per::Chip => 1,
            Per::Tile => tiles,
            Per::Column => 2 * columns * tiles,
            Per::Cell => self.cells(),
            Per::Row => 2 * rows * tiles,
            Per::Converter => {
                let banks = match hardware.adc {
                    Adc::Finite { subtract: Subtract::Current, .. } => 1,
                    Adc::Finite { .. } | Adc::Ideal => 2,
                };
                let share = hardware.timing.map_or(1, |timing| timing.share);
                banks * columns.div_ceil(share) * tiles
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn copies_take_a_chip_and_hold_one_network() {
        let dense = LayerFootprint { rows: 300, columns: 10, targets: 1, copies: 1 };
        let window = LayerFootprint { rows: 54, columns: 60, targets: 2, copies: 16 };
        let plan = Footprint { layers: vec![window, dense] };
        let chip = Hardware::reference().with(|h| (h.tile.rows, h.tile.columns) = (256, 32));
        let chip = chip.unwrap();
        let cells = 2 * 2 * 54 * 60;
        assert_eq!((plan.cells(), plan.cells_apart()), (16 * cells + 6000, cells + 6000));
        assert_eq!(plan.tiles(&chip), 16 * 2 * 2 + 2);
        let all = |per| plan.parts(per, &chip);
        assert_eq!([all(Per::Tile), all(Per::Cell), all(Per::Chip)], [66, plan.cells(), 1]);
        assert_eq!([all(Per::Row), all(Per::Column)], [2 * 256 * 66, 2 * 32 * 66]);
    }
}
