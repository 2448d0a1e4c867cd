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
    /// Targets: two arrays each.
    pub targets: u64,
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
            targets: layer.spec.wiring.targets().len() as u64,
        };
        Self { layers: layers.map(layer).collect() }
    }

    /// The plan of a run, from what it recorded of its pathways.
    #[must_use]
    pub fn of_records(pathways: &[PathwayRecord]) -> Self {
        let mut layers: Vec<(LayerFootprint, u64)> = Vec::new();
        for one in pathways {
            let [rows, columns] = one.shape.map(|side| side as u64);
            if one.layer == layers.len() {
                layers.push((LayerFootprint { rows, columns, targets: 0 }, 0));
            }
            if let Some((_, arrays)) = layers.last_mut() {
                *arrays += 1;
            }
        }
        let layers = layers.into_iter().map(|(layer, arrays)| LayerFootprint {
            // a target has two banks
            targets: arrays / 2,
            ..layer
        });
        Self { layers: layers.collect() }
    }

    /// Physical tiles on a chip.
    #[must_use]
    pub fn tiles(&self, hardware: &Hardware) -> u64 {
        let (rows, columns) = (hardware.tile.rows as u64, hardware.tile.columns as u64);
        let of =
            |l: &LayerFootprint| l.targets * l.rows.div_ceil(rows) * l.columns.div_ceil(columns);
        self.layers.iter().map(of).sum()
    }

    /// Cells of the network.
    #[must_use]
    pub fn cells(&self) -> u64 {
        self.layers.iter().map(|l| 2 * l.targets * l.rows * l.columns).sum()
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
