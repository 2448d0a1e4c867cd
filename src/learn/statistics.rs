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

use crate::chip::crossbar::Crossbar;
use crate::chip::engine::Engine;
use crate::chip::hardware::Hardware;
use crate::chip::population::Polarity;

/// Bins of a level histogram; levels above 6 bits share bins evenly.
pub const BINS: usize = 64;

/// What the cells of one pathway look like.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PathwayStatistics {
    /// Layer with cells.
    pub layer: usize,
    /// Pathway code.
    pub code: u8,
    /// Pathway name.
    pub name: &'static str,
    /// Whether its current adds.
    pub excites: bool,
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
    /// Rows, columns and tiles whose cells all lie on the floor; then how many there are.
    pub idle: [[u64; 2]; 3],
    /// Cells by level, [`BINS`] bins or fewer.
    pub histogram: Vec<u64>,
}

/// Which cells lay on the floor when learning began, by layer and array, row-major.
pub type FloorMap = Vec<Vec<Vec<bool>>>;

/// Where the floor is now.
#[must_use]
pub fn floor_map(engine: &Engine) -> FloorMap {
    let floor = engine.hardware().window.floor();
    let of = |array: &Crossbar| array.levels().map(|level| level == floor).collect();
    engine.layers().iter().map(|layer| layer.arrays.iter().map(of).collect()).collect()
}

/// Statistics of every pathway, layer by layer, in code order.
#[must_use]
pub fn pathways(engine: &Engine, start: &FloorMap) -> Vec<PathwayStatistics> {
    let hardware = engine.hardware();
    let mut all = Vec::new();
    for (layer, start) in engine.layers().iter().zip(start) {
        let pathways = layer.spec.wiring.pathways();
        for ((array, pathway), start) in layer.arrays.iter().zip(pathways).zip(start) {
            let mut one = of(array, hardware, start);
            one.layer = usize::from(layer.index);
            one.code = pathway.code;
            one.name = pathway.name;
            one.excites = pathway.polarity == Polarity::Excites;
            all.push(one);
        }
    }
    all
}

fn of(array: &Crossbar, hardware: &Hardware, start: &[bool]) -> PathwayStatistics {
    let layout = array.layout();
    let bits = hardware.level_bits.get();
    let bin_shift = bits.saturating_sub(BINS.ilog2());
    let bins = BINS.min(1 << bits);
    let (tile_rows, tile_columns) = (hardware.tile_rows, hardware.tile_columns);
    let across = layout.columns.div_ceil(tile_columns);
    let mut rows = vec![true; layout.rows];
    let mut columns = vec![true; layout.columns];
    let mut tiles = vec![true; layout.rows.div_ceil(tile_rows) * across];
    let mut one = PathwayStatistics {
        layer: 0,
        code: 0,
        name: "",
        excites: false,
        cells: layout.cells() as u64,
        floor: 0,
        zero: 0,
        pruned: array.pruned().map_or(0, |bits| bits.count_ones() as u64),
        births: 0,
        deaths: 0,
        levels: 0,
        idle: [[0; 2]; 3],
        histogram: vec![0; bins],
    };
    for (i, (level, &was)) in array.levels().zip(start).enumerate() {
        let (row, column) = (i / layout.columns, i % layout.columns);
        let is = level == hardware.window.floor();
        one.floor += u64::from(is);
        one.zero += u64::from(level == 0);
        one.births += u64::from(was && !is);
        one.deaths += u64::from(is && !was);
        one.levels += u64::from(level);
        one.histogram[usize::from(level >> bin_shift)] += 1;
        if !is {
            rows[row] = false;
            columns[column] = false;
            tiles[row / tile_rows * across + column / tile_columns] = false;
        }
    }
    let count =
        |idle: &[bool]| [idle.iter().filter(|&&idle| idle).count() as u64, idle.len() as u64];
    one.idle = [count(&rows), count(&columns), count(&tiles)];
    one
}

/// Sum of excitatory and of inhibitory levels of one layer.
#[must_use]
pub fn balance(statistics: &[PathwayStatistics], layer: usize) -> [u64; 2] {
    let sum = |excites: bool| {
        let of_layer = statistics.iter().filter(|s| s.layer == layer && s.excites == excites);
        of_layer.map(|s| s.levels).sum()
    };
    [sum(true), sum(false)]
}
