//! Integer statistics of cells: the floor, sparsity, balance. Pairs of counts; division happens in reports.
//!
//! ```text
//! floor fraction        cells on the floor / cells
//! births, deaths        cells that left / reached the floor since the start
//! connection sparsity   cells at level 0 / cells                               (NeuroBench)
//! E/I                   sum of levels (pp + nn) / sum of levels (np + pn)
//! idle                  rows, columns or tiles whose cells all lie on the floor
//! ```
//!
//! See docs/GLOSSARY.md and docs/MODEL.md, 4.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use std::collections::BTreeMap;

use crate::chip::crossbar::Crossbar;
use crate::chip::engine::{Engine, Phase};
use crate::chip::hardware::Hardware;
use crate::chip::ledger::Event;
use crate::chip::population::Polarity;

/// Bins of a level histogram; levels above 6 bits share bins evenly.
pub const BINS: usize = 64;

/// Cells of one pathway of one layer (definitions: docs/GLOSSARY.md).
#[derive(Debug, Clone, PartialEq, Eq)]
#[cfg_attr(
    feature = "lab",
    derive(serde::Serialize, serde::Deserialize),
    serde(deny_unknown_fields)
)]
pub struct PathwayRecord {
    /// Layer, from 0 at the input.
    pub layer: usize,
    /// Name: `pp`, `np`, `nn`, `pn`, or `e`, `i` of a differential pair.
    pub pathway: String,
    /// Whether its current adds.
    pub excites: bool,
    /// Rows and columns.
    pub shape: [usize; 2],
    /// Cells.
    pub cells: u64,
    /// Cells on the floor.
    pub floor: u64,
    /// Cells at level 0.
    pub zero: u64,
    /// Cells gone for good (absorbing floors).
    pub pruned: u64,
    /// Cells that lay on the floor at the start and no longer do.
    pub births: u64,
    /// Cells that did not lie on the floor at the start and do now.
    pub deaths: u64,
    /// Sum of levels.
    pub levels: u64,
    /// `[idle, all]` rows, columns, tiles: idle ones have all their cells on the floor.
    pub idle: [[u64; 2]; 3],
    /// Cells by level, in equal bins ([`BINS`] or fewer).
    pub histogram: Vec<u64>,
    /// Events of the training ledger so far, by name (requested, bounded, pulses_attempted, ...).
    pub training: BTreeMap<String, u64>,
    /// Pulses that its cells were sent, where they wear out by them.
    #[cfg_attr(feature = "lab", serde(default, skip_serializing_if = "Option::is_none"))]
    pub wear: Option<WearRecord>,
}

/// Pulses that the cells of a pathway were sent, where they wear out by them.
#[derive(Debug, Clone, PartialEq, Eq)]
#[cfg_attr(
    feature = "lab",
    derive(serde::Serialize, serde::Deserialize),
    serde(deny_unknown_fields)
)]
pub struct WearRecord {
    /// Cells that are worn out.
    pub worn: u64,
    /// Pulses of the cell that was sent most.
    pub most: u64,
    /// Pulses of all cells.
    pub pulses: u64,
    /// Cells by pulses: none, 1, 2 to 3, 4 to 7, ... as far as there are some.
    pub histogram: Vec<u64>,
}

impl WearRecord {
    fn of(array: &Crossbar) -> Option<Self> {
        let mut this = Self { worn: 0, most: 0, pulses: 0, histogram: vec![] };
        for [spent, limit] in array.wear()? {
            this.worn += u64::from(spent >= limit);
            this.most = this.most.max(spent.into());
            this.pulses += u64::from(spent);
            let bin = (u32::BITS - spent.leading_zeros()) as usize;
            if this.histogram.len() <= bin {
                this.histogram.resize(bin + 1, 0);
            }
            this.histogram[bin] += 1;
        }
        Some(this)
    }
}

/// Which cells lay on the floor when learning began, by layer and array, row-major.
pub type FloorMap = Vec<Vec<Vec<bool>>>;

/// Where the floor is now.
#[must_use]
pub fn floor_map(engine: &Engine) -> FloorMap {
    let of = |array: &Crossbar| {
        array.levels().zip(array.floors()).map(|(level, floor)| level == floor).collect()
    };
    engine.layers().iter().map(|layer| layer.arrays.iter().map(of).collect()).collect()
}

/// Statistics of every pathway, layer by layer, in code order.
#[must_use]
pub fn pathways(engine: &Engine, start: &FloorMap) -> Vec<PathwayRecord> {
    let ledger = engine.ledger(Phase::Training);
    let mut all = Vec::new();
    for (at, (layer, start)) in engine.layers().iter().zip(start).enumerate() {
        let pathways = layer.spec.wiring.pathways();
        for ((array, pathway), start) in layer.arrays.iter().zip(pathways).zip(start) {
            let events = Event::ALL.into_iter().filter_map(|event| {
                let count = ledger.of_pathway(at, pathway.code, event);
                (count > 0).then(|| (event.name().to_owned(), count))
            });
            all.push(PathwayRecord {
                layer: usize::from(layer.index),
                pathway: pathway.name.into(),
                excites: pathway.polarity == Polarity::Excites,
                training: events.collect(),
                ..of(array, engine.hardware(), start)
            });
        }
    }
    all
}

/// Of an array alone, whatever pathway it is.
fn of(array: &Crossbar, hardware: &Hardware, start: &[bool]) -> PathwayRecord {
    let layout = array.layout();
    let bits = hardware.cell.level_bits.get();
    let bin_shift = bits.saturating_sub(BINS.ilog2());
    let bins = BINS.min(1 << bits);
    let (tile_rows, tile_columns) = (hardware.tile.rows, hardware.tile.columns);
    let across = layout.columns.div_ceil(tile_columns);
    let mut rows = vec![true; layout.rows];
    let mut columns = vec![true; layout.columns];
    let mut tiles = vec![true; layout.rows.div_ceil(tile_rows) * across];
    let mut one = PathwayRecord {
        layer: 0,
        pathway: String::new(),
        excites: false,
        shape: [layout.rows, layout.columns],
        cells: layout.cells() as u64,
        floor: 0,
        zero: 0,
        pruned: array.pruned().map_or(0, |bits| bits.count_ones() as u64),
        births: 0,
        deaths: 0,
        levels: 0,
        idle: [[0; 2]; 3],
        histogram: vec![0; bins],
        training: BTreeMap::new(),
        wear: WearRecord::of(array),
    };
    // a cell may have a floor of its own
    let levels: Vec<_> = array.levels().zip(array.floors()).collect();
    let by_row = levels.chunks_exact(layout.columns).zip(start.chunks_exact(layout.columns));
    for (row, (levels, start)) in by_row.enumerate() {
        let parts = levels.chunks(tile_columns).zip(start.chunks(tile_columns));
        for (tile, (levels, start)) in parts.enumerate() {
            let mut idle = true;
            let columns = &mut columns[tile * tile_columns..];
            for ((&(level, floor), &was), column) in levels.iter().zip(start).zip(columns) {
                let is = level == floor;
                one.floor += u64::from(is);
                one.zero += u64::from(level == 0);
                one.births += u64::from(was && !is);
                one.deaths += u64::from(is && !was);
                one.levels += u64::from(level);
                one.histogram[usize::from(level >> bin_shift)] += 1;
                *column &= is;
                idle &= is;
            }
            rows[row] &= idle;
            tiles[row / tile_rows * across + tile] &= idle;
        }
    }
    let count =
        |idle: &[bool]| [idle.iter().filter(|&&idle| idle).count() as u64, idle.len() as u64];
    one.idle = [count(&rows), count(&columns), count(&tiles)];
    one
}

/// Sum of excitatory and of inhibitory levels of one layer.
#[must_use]
pub fn balance(pathways: &[PathwayRecord], layer: usize) -> [u64; 2] {
    let sum = |excites: bool| {
        let of_layer = pathways.iter().filter(|s| s.layer == layer && s.excites == excites);
        of_layer.map(|s| s.levels).sum()
    };
    [sum(true), sum(false)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::chip::crossbar::kernel::Backend;
    use crate::chip::crossbar::layout::Layout;
    use crate::chip::hardware::{FloorKind, Window};
    use crate::chip::layer::{DrivenBy, Homeostasis, InitialLevels, Layer, LayerSpec, Pool, Taps};
    use crate::chip::population::Wiring;
    use crate::num::fixed::LevelBits;
    use crate::num::tables::Activation;
    use bitvec::prelude::*;

    /// Tiles of 2 x 2, window from `floor` to the greatest level, an absorbing floor.
    fn hardware(level_bits: i64, floor: i64) -> Hardware {
        let level_bits = LevelBits::new(level_bits).unwrap();
        Hardware::reference()
            .with(|h| {
                h.cell.level_bits = level_bits;
                h.cell.window =
                    Window::new(floor, i64::from(level_bits.level_max()), level_bits).unwrap();
                h.cell.floor_kind = FloorKind::Absorbing;
                h.tile.rows = 2;
                h.tile.columns = 2;
                h.tile.transposed_read = false;
            })
            .unwrap()
    }

    fn array(hardware: &Hardware, rows: &[&[u16]]) -> Crossbar {
        let layout = Layout { rows: rows.len(), columns: rows[0].len() };
        let mut array = Crossbar::new(layout, hardware);
        rows.iter().enumerate().for_each(|(row, levels)| array.load_row(row, levels));
        array
    }

    #[test]
    fn cells_are_counted_by_where_they_lie_and_where_they_came_from() {
        let hardware = hardware(8, 0);
        let mut array = array(&hardware, &[&[0, 0, 7], &[0, 0, 0], &[0, 9, 255]]);
        array.load_pruned(bits![u8, Lsb0; 1, 0, 0, 1, 0, 0, 0, 0, 0]);
        // at the start, the first five lay on the floor, and so did the last
        let start = [true, true, true, true, true, false, false, false, true];
        let one = of(&array, &hardware, &start);
        assert_eq!((one.cells, one.floor, one.zero, one.pruned), (9, 6, 6, 2));
        assert_eq!((one.births, one.deaths, one.levels), (2, 2, 271));
        // one row and one column; of the four tiles, the one at the top left
        assert_eq!(one.idle, [[1, 3], [1, 3], [1, 4]]);
        let mut histogram = vec![0; 64];
        (histogram[0], histogram[1], histogram[2], histogram[63]) = (6, 1, 1, 1);
        assert_eq!(one.histogram, histogram);
    }

    #[test]
    fn tiles_are_numbered_row_by_row() {
        let hardware = hardware(8, 0);
        // five columns are three tiles across; the cells that are up lie in the first and the last tile
        // of the upper row of tiles, and in the middle one of the lower
        let rows: [&[u16]; 3] = [&[1, 0, 0, 0, 1], &[0; 5], &[0, 0, 0, 1, 0]];
        let one = of(&array(&hardware, &rows), &hardware, &[true; 15]);
        assert_eq!(one.idle, [[1, 3], [2, 5], [3, 6]]);
        assert_eq!((one.births, one.deaths), (3, 0));
    }

    #[test]
    fn the_floor_need_not_be_level_0_and_few_bits_have_few_bins() {
        let hardware = hardware(2, 1);
        let one = of(&array(&hardware, &[&[1, 2], &[3, 1]]), &hardware, &[false; 4]);
        assert_eq!((one.floor, one.zero, one.deaths, one.levels), (2, 0, 2, 7));
        assert_eq!(one.histogram, [0, 2, 1, 1]);
        assert_eq!(one.pruned, 0);
    }

    #[test]
    fn pathways_are_listed_by_layer_and_balance_adds_them_by_polarity() {
        let hardware = hardware(4, 0);
        let spec = |wiring| LayerSpec {
            inputs: 2,
            units: 2,
            wiring,
            driven_by: if wiring == Wiring::Dual { DrivenBy::Shared } else { DrivenBy::Streams },
            activation: Activation::Relu,
            weight_max_log2: 0,
            initial: InitialLevels::Uniform { gain_64ths: [64, 64] },
            constant_row: false,
            convolution: None,
            copies: 1,
            pool: Pool::None,
            homeostasis: Homeostasis::OFF,
        };
        let layers = [Wiring::Dual, Wiring::DualReadout].into_iter().zip(0u16..);
        let layers = layers
            .map(|(wiring, index)| Layer::new(index, spec(wiring), Taps::identity(2), &hardware));
        let layers = layers.collect();
        let mut engine = Engine::new(hardware, Backend::Scalar, 1, layers);
        let start = floor_map(&engine);
        assert!(start.iter().flatten().flatten().all(|on| *on));
        for (layer, of_layer) in engine.layers_mut().iter_mut().enumerate() {
            for (at, array) in of_layer.arrays.iter_mut().enumerate() {
                array.load_row(0, &[1 << at, u16::try_from(layer).unwrap()]);
            }
        }
        assert_eq!(floor_map(&engine)[1][0], [false, false, true, true]);
        let all = pathways(&engine, &start);
        let names: Vec<_> = all.iter().map(|s| (s.layer, s.pathway.as_str(), s.excites)).collect();
        assert_eq!(
            names,
            [
                (0, "pp", true),
                (0, "np", false),
                (0, "nn", true),
                (0, "pn", false),
                (1, "pp", true),
                (1, "np", false)
            ]
        );
        assert_eq!((all[0].births, all[4].births), (1, 2));
        assert_eq!((balance(&all, 0), balance(&all, 1)), ([1 + 4, 2 + 8], [1 + 1, 2 + 1]));
    }
}
