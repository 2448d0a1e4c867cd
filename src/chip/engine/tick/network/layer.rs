//! The tiles of a layer, in step.
//!
//! ```text
//! tiles[(plane * down + tile row) * across + tile column]        a plane is a pair of banks of a target
//! ```
//!
//! A target's first plane has the heads of its columns: what all its planes read is added up there. Of arrays that stand on the chip
//! more than once these are the tiles of the first copy; the others are in `copies`.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use std::ops::Range;
use std::sync::Arc;

use super::super::tile::{Command, Memories, Tile, TileSize};
use super::balance::Balancing;
use super::normalise::{Normal, Normaliser};
use super::pool::Pooler;
use crate::chip::hardware::timing::tree_levels;
use crate::chip::hardware::{DitherPattern, Hardware, Timing, WriteScheme};
use crate::chip::layer::{Delivery, DrivenBy, Layer, Optimiser};
use crate::chip::ledger::{During, Part};
use crate::chip::population::{Stream, Wiring};
use crate::num::fixed::DriveBits;
use crate::num::tables::{Activation, Gaussian};

mod build;
mod copies;
mod draws;
mod noise;
mod optimise;
mod ranges;
mod window;

use build::config;

/// Widths that decide how many bits a memory moves.
#[derive(Debug, Clone, Copy)]
pub(super) struct Memory {
    pub(super) dac_bits: u64,
    pub(super) residual_bits: u64,
    /// Of all words that an optimiser keeps of a cell.
    pub(super) word_bits: u64,
}

#[derive(Debug)]
pub(super) struct TickLayer {
    pub(super) tiles: Vec<Tile>,
    pub(super) inputs: usize,
    /// What moves over the image below, if something does.
    window: window::Window,
    pub(super) columns: usize,
    pub(super) delivery: Delivery,
    pub(super) weight_max_log2: i32,
    /// What words that come back through its rows are multiplied by where it has a gain, as a power of two.
    pub(super) evened: i64,
    pub(super) memory: Memory,
    /// Accumulator and activity by target stream and sample, of what was read last.
    pub(super) outputs: [Vec<(i64, u8)>; 2],
    /// The stage behind it, where its units are normalised, and where their codes are pooled.
    pub(super) normaliser: Option<Normaliser>,
    pub(super) pooler: Option<Pooler>,
    /// What it has beside its tiles, where its units keep to a middle.
    pub(super) balancing: Option<Balancing>,
    pub(super) backward: Vec<i64>,
    /// Converter shifts, and codes on the rail and all codes since they were looked at, by target stream and slice.
    pub(super) adc_shifts: Vec<Vec<u32>>,
    pub(super) rails: Vec<Vec<[u64; 2]>>,
    index: u16,
    wiring: Wiring,
    planes: Vec<(Stream, [usize; 2])>,
    driven_by: DrivenBy,
    constant_row: bool,
    rows: usize,
    /// Tiles down and across, and the size of one.
    grid: [usize; 2],
    tile: [usize; 2],
    drive_bits: DriveBits,
    dither: (u32, DitherPattern),
    slots_log2: u32,
    seed: u64,
    /// Gaussian numbers and the standard deviation of a conversion, where conversions are noisy.
    noise: Option<(Arc<Gaussian>, i64)>,
    /// What loads leave, where they are noisy.
    programming: Option<noise::Loads>,
    /// Writes of every array so far.
    writes: u64,
    /// On their way through the tree.
    tree: Vec<copies::InTree>,
    /// Copies of all tiles beside the first.
    beside: Vec<copies::ArrayCopy>,
    /// Cycles through the tree over rows and over columns.
    delay: [u64; 2],
    /// Requests of whole batches.
    batch: optimise::Batch,
}

impl TickLayer {
    pub(super) fn new(
        hardware: &Hardware,
        timing: Timing,
        seed: u64,
        layer: &Layer,
        slots: usize,
    ) -> Self {
        let grid = layer.tiles(hardware);
        let tile = [hardware.tile.rows, hardware.tile.columns];
        let (rows, columns) = (layer.layout.rows, layer.layout.columns);
        let wiring = layer.spec.wiring;
        let added = [grid[0] * wiring.pairs(Stream::P).len(), grid[1]];
        let mut this = Self {
            tiles: vec![],
            inputs: layer.spec.inputs,
            window: window::Window::new(&layer.spec, slots),
            columns,
            delivery: layer.delivery.clone(),
            weight_max_log2: layer.spec.weight_max_log2,
            evened: window::evened(&layer.spec),
            memory: Memory {
                dac_bits: hardware.drive.dac_bits.into(),
                residual_bits: hardware.write.residual_bits.get().into(),
                word_bits: match layer.requests.optimiser {
                    Optimiser::Momentum { decay } => u64::from(33 + decay),
                    Optimiser::AdamFx { first_decay, second_decay } => {
                        u64::from(84 + first_decay + second_decay)
                    }
                    _ => 0,
                },
            },
            outputs: [vec![(0, 0); slots * columns], vec![(0, 0); slots * columns]],
            normaliser: (layer.spec.activation == Activation::Rms).then(|| {
                let lanes = usize::try_from(timing.lanes).expect("few");
                Normaliser::new(timing.beat, lanes, hardware.tile.columns)
            }),
            pooler: Pooler::new(timing, hardware.tile.columns, &layer.spec),
            balancing: Balancing::of(layer, hardware.digital.lut_bits.get()),
            backward: vec![],
            adc_shifts: layer.adc_shifts.clone(),
            rails: layer.rails.clone(),
            index: layer.index,
            wiring,
            planes: wiring.planes().collect(),
            driven_by: layer.spec.driven_by,
            constant_row: layer.spec.constant_row,
            rows,
            grid,
            tile,
            drive_bits: hardware.drive.bits,
            dither: (draws::bits(hardware, layer), hardware.write.dither_pattern),
            slots_log2: match hardware.write.scheme {
                WriteScheme::Rounded => 0,
                WriteScheme::Trains { slots_log2 } => slots_log2,
            },
            seed,
            noise: noise::of(hardware),
            programming: noise::loads(hardware),
            writes: layer.writes.first().copied().unwrap_or(0),
            tree: vec![],
            beside: vec![],
            delay: added.map(|tiles| timing.beat * tree_levels(tiles as u64)),
            batch: optimise::Batch::new(timing, layer, grid),
        };
        let slots = slots * this.products();
        let lut = layer.lut.activity.iter().zip(&layer.lut.derivative);
        let table: Vec<[u8; 2]> = lut.map(|(&a, &slope)| [a, slope]).collect();
        for (target, _) in wiring.planes() {
            for down in 0..grid[0] {
                for across in 0..grid[1] {
                    let (rows, columns) = (this.tile_rows(down), this.tile_columns(across));
                    let size =
                        TileSize { rows: rows.len(), columns: columns.len(), slots, tree_max: 0 };
                    let config = config(hardware, timing, layer, target, &rows, &columns);
                    this.tiles.push(Tile::new(size, config, table.clone()));
                }
            }
        }
        this.fit(hardware);
        this.stick(hardware);
        this.load_state(layer);
        this.load_words(layer);
        this.copy(layer.spec.copies);
        this
    }

    fn load_state(&mut self, layer: &Layer) {
        for (at, array) in layer.arrays.iter().enumerate() {
            let levels: Vec<u16> = array.levels().collect();
            for (row, levels) in levels.chunks_exact(self.columns).enumerate() {
                self.load_row(at, row, levels);
            }
            let gone = array.pruned();
            let left = array.residuals();
            let (wear, beside, stamps) = (array.wear(), array.left(), array.stamps());
            for cell in 0..levels.len() {
                let (tile, bank, row, column) = self.cell(at, cell);
                let spent = wear.as_ref().map(|wear| wear[cell][0]);
                let beside = beside.as_ref().map(|beside| beside[cell]);
                let stamp = stamps.as_ref().map(|stamps| stamps[cell]);
                self.tiles[tile].recall(bank, [row, column], (spent, beside, stamp));
                let gone = gone.as_ref().is_some_and(|gone| gone[cell]);
                let left = left.as_ref().map_or(0, |left| i64::from(left[cell]));
                self.tiles[tile].restore(bank, row, column, gone, left);
            }
        }
    }

    /// Logical rows of a row of tiles.
    fn tile_rows(&self, down: usize) -> Range<usize> {
        down * self.tile[0]..((down + 1) * self.tile[0]).min(self.rows)
    }

    fn tile_columns(&self, across: usize) -> Range<usize> {
        across * self.tile[1]..((across + 1) * self.tile[1]).min(self.columns)
    }

    /// Tile of a plane at a place of the grid.
    const fn at(&self, plane: usize, down: usize, across: usize) -> usize {
        (plane * self.grid[0] + down) * self.grid[1] + across
    }

    /// Plane of a tile.
    const fn plane(&self, tile: usize) -> usize {
        tile / (self.grid[0] * self.grid[1])
    }

    /// The plane that has the heads of a target's columns.
    fn heads(&self, target: Stream) -> usize {
        self.planes.iter().position(|plane| plane.0 == target).expect("targets have banks")
    }

    /// The first tile that has lanes of a target; those of the other columns follow it.
    pub(super) fn at_head(&self, target: Stream) -> usize {
        self.at(self.heads(target), 0, 0)
    }

    /// Columns of the widest tile.
    pub(super) fn widest(&self) -> usize {
        self.columns.min(self.tile[1])
    }

    /// Planes, tiles down, tiles across.
    pub(super) fn grid(&self) -> [usize; 3] {
        [self.planes.len(), self.grid[0], self.grid[1]]
    }

    /// The tile at a place of the grid, if there is one.
    pub(super) fn tile_at(&self, at: &super::TileAt) -> Option<&Tile> {
        let [planes, downs, acrosses] = self.grid();
        let inside = at.target < planes && at.down < downs && at.across < acrosses;
        inside.then(|| &self.tiles[(at.target * downs + at.down) * acrosses + at.across])
    }

    /// Plane and bank of an array.
    fn bank(&self, array: usize) -> (usize, usize) {
        let plane = self.planes.iter().position(|plane| plane.1.contains(&array));
        let plane = plane.expect("every array is a bank");
        (plane, usize::from(self.planes[plane].1[1] == array))
    }

    /// Tile, bank, row and column of a cell of an array.
    fn cell(&self, array: usize, cell: usize) -> (usize, usize, usize, usize) {
        let (row, column) = (cell / self.columns, cell % self.columns);
        let (plane, bank) = self.bank(array);
        let tile = self.at(plane, row / self.tile[0], column / self.tile[1]);
        (tile, bank, row % self.tile[0], column % self.tile[1])
    }

    fn cells<T>(&self, array: usize, of: impl Fn(&Tile, usize, usize, usize) -> T) -> Vec<T> {
        let one = |cell| {
            let (tile, bank, row, column) = self.cell(array, cell);
            of(&self.tiles[tile], bank, row, column)
        };
        (0..self.rows * self.columns).map(one).collect()
    }

    pub(super) fn levels(&self, array: usize) -> Vec<u16> {
        self.cells(array, Tile::level)
    }

    pub(super) fn pruned(&self, array: usize) -> Vec<bool> {
        self.cells(array, Tile::is_pruned)
    }

    pub(super) fn residuals(&self, array: usize) -> Vec<i64> {
        self.cells(array, Tile::residual)
    }

    /// What cells remember.
    pub(super) fn memories(&self, array: usize) -> Vec<Memories> {
        self.cells(array, Tile::remembers)
    }

    /// An operation has loaded a row.
    pub(super) fn count_loads(&mut self, array: usize, row: usize) {
        for column in 0..self.columns {
            let (tile, bank, row, column) = self.cell(array, row * self.columns + column);
            let writes = self.writes;
            self.tiles[tile].count_load(bank, [row, column], writes);
            self.likes(tile).for_each(|other| other.count_load(bank, [row, column], writes));
        }
    }

    pub(super) fn targets(&self) -> Vec<Stream> {
        self.wiring.targets().to_vec()
    }

    /// Pathway codes of the banks of a plane.
    pub(super) fn codes(&self, plane: usize) -> [u8; 2] {
        self.planes[plane].1.map(|at| self.wiring.pathways()[at].code)
    }

    /// The code at which the units of a target are counted.
    pub(super) fn unit_code(&self, target: Stream) -> u8 {
        self.codes(self.heads(target))[0]
    }

    /// Loads a row of an array; the code of its pathway.
    pub(super) fn load_row(&mut self, array: usize, row: usize, levels: &[u16]) -> u8 {
        for (column, &level) in levels.iter().enumerate() {
            let (tile, bank, row, column) = self.cell(array, row * self.columns + column);
            self.tiles[tile].load_level(bank, row, column, level);
            self.likes(tile).for_each(|other| other.load_level(bank, row, column, level));
        }
        self.wiring.pathways()[array].code
    }

    /// Source of the rows of a bank.
    fn source(&self, plane: usize, bank: usize) -> Stream {
        self.wiring.pathways()[self.planes[plane].1[bank]].source
    }

    /// Puts a drive code on a row of every bank that `stream` drives: of all of them where they share their drives,
    /// or where no stream is named.
    fn load_drive(&mut self, stream: Option<Stream>, slot: usize, row: usize, code: u8) {
        let shared = self.driven_by.is_shared();
        for plane in 0..self.planes.len() {
            for bank in 0..2 {
                if stream.is_some_and(|stream| !shared && stream != self.source(plane, bank)) {
                    continue;
                }
                for across in 0..self.grid[1] {
                    let tile = self.at(plane, row / self.tile[0], across);
                    let row = row % self.tile[0];
                    self.tiles[tile].load_drive(bank, slot, row, code);
                    self.likes(tile).for_each(|other| other.load_drive(bank, slot, row, code));
                }
            }
        }
    }

    /// Activities of a stream.
    pub(super) fn values(&self, target: Stream, slot: usize) -> Vec<u8> {
        let value = |column| {
            let head = &self.tiles[self.at(self.heads(target), 0, column / self.tile[1])];
            head.value(slot, column % self.tile[1])
        };
        (0..self.columns).map(value).collect()
    }

    /// Accumulators that lanes have just seen.
    fn sums(&self, target: Stream) -> Vec<i64> {
        let sum = |column| {
            let head = &self.tiles[self.at(self.heads(target), 0, column / self.tile[1])];
            head.out(column % self.tile[1])
        };
        (0..self.columns).map(sum).collect()
    }

    /// Hands the accumulators that lanes have just seen to the stage behind, if there is one.
    pub(super) fn normalise(&mut self) -> bool {
        let sums = self.targets().into_iter().map(|target| (target, self.sums(target))).collect();
        self.normaliser.as_mut().map(|stage| stage.take(sums)).is_some()
    }

    /// Hands the codes of a sample to the pool behind, if there is one.
    pub(super) fn pool(&mut self, sample: usize) -> bool {
        let codes = |&stream: &Stream| (stream, self.codes_of(stream, sample));
        let codes = self.targets().iter().map(codes).collect();
        self.pooler.as_mut().map(|pooler| pooler.take(codes)).is_some()
    }

    /// Bits that a pool of the greatest remembers of a code that leaves it, where errors come back through it.
    pub(super) fn place_bits(&self) -> u64 {
        self.pooler.as_ref().map_or(0, Pooler::place_bits)
    }

    /// What stages behind take for the cycle to come.
    pub(super) fn start_stages(&mut self) {
        if let Some(stage) = &mut self.normaliser {
            stage.start();
        }
        if let Some(pooler) = &mut self.pooler {
            pooler.start();
        }
    }

    /// What the stage behind made of a stream of a sample.
    pub(super) fn set_units(&mut self, target: Stream, slot: usize, normal: &Normal) {
        for (column, &unit) in normal.units.iter().enumerate() {
            let head = self.at(self.heads(target), 0, column / self.tile[1]);
            self.tiles[head].set_unit(slot, column % self.tile[1], unit);
        }
    }

    pub(super) fn keep_outputs(&mut self, sample: usize) {
        for target in self.targets() {
            let values = self.values(target, sample);
            for (column, value) in values.into_iter().enumerate() {
                let head = self.at(self.heads(target), 0, column / self.tile[1]);
                let sum = self.tiles[head].out(column % self.tile[1]);
                self.outputs[target.index()][sample * self.columns + column] = (sum, value);
            }
        }
    }

    /// Gates of a sample go down from the heads of the columns.
    pub(super) fn share_gates(&mut self, sample: usize) {
        let positions = self.positions();
        (sample * positions..(sample + 1) * positions).for_each(|slot| self.share_gates_of(slot));
    }

    fn share_gates_of(&mut self, slot: usize) {
        for (plane, (target, _)) in self.planes.clone().into_iter().enumerate() {
            for across in 0..self.grid[1] {
                let head = self.at(self.heads(target), 0, across);
                let gates = self.tiles[head].gates(slot).to_vec();
                for down in 0..self.grid[0] {
                    let tile = self.at(plane, down, across);
                    self.tiles[tile].set_gates(slot, &gates);
                    self.likes(tile).for_each(|other| other.set_gates(slot, &gates));
                }
            }
        }
    }

    /// Every array has been written once more.
    pub(super) fn written(&mut self) {
        self.move_means();
        self.writes += 1;
        let writes = self.writes;
        self.all_tiles().for_each(|tile| tile.forget(writes));
        self.assert_alike();
    }

    /// Whether a command concerns a tile: words go to heads, transposed reads to target p.
    fn concerns(&self, command: &Command<'_>, tile: usize) -> bool {
        let down = tile / self.grid[1] % self.grid[0];
        let plane = self.plane(tile);
        let target = self.planes[plane].0;
        match command {
            Command::Error { .. } => down == 0 && plane == self.heads(target),
            Command::Columns { .. } => target == Stream::P,
            _ => true,
        }
    }

    pub(super) fn ready(&self, command: &Command<'_>) -> bool {
        let reads = matches!(command, Command::Forward { .. } | Command::Columns { .. });
        let waits = !reads && !self.tree.is_empty();
        !waits && self.tiles.iter().all(|tile| tile.ready(command)) && self.others_ready(command)
    }

    pub(super) fn idle(&self) -> bool {
        self.tree.is_empty() && self.tiles.iter().all(Tile::idle) && self.others_idle()
    }

    /// One cycle of all tiles and of the tree between them.
    pub(super) fn cycle(&mut self, command: Option<&Command<'_>>, words: &[i16]) {
        match command {
            Some(Command::Add { .. }) => self.batch.added += 1,
            Some(&Command::Write { shift }) => self.begin_write(shift),
            _ => {}
        }
        self.cycle_beside(command);
        for tile in 0..self.tiles.len() {
            let command = command.filter(|command| self.concerns(command, tile));
            self.tiles[tile].set_writes(self.writes);
            if let Some(slot) = self.tiles[tile].slot_ends() {
                for bank in 0..2 {
                    let (rows, columns) = self.firing(tile, bank, slot);
                    self.tiles[tile].fire(bank, rows, columns);
                }
            }
            let word = words.get(self.tiles[tile].bus_index()).copied().unwrap_or(0);
            if self.tiles[tile].dither_wanted() {
                let [e, i] = [0, 1].map(|bank| self.draws(tile, bank));
                self.tiles[tile].cycle(command, word, [&e, &i]);
            } else {
                self.tiles[tile].cycle(command, word, [&[]; 2]);
            }
        }
        self.tree();
        self.join_squares();
        if self.tiles.iter().all(Tile::has_gathered) {
            self.tiles.iter_mut().for_each(Tile::write_gathered);
        }
    }

    /// Whether the lanes of the largest tile have seen the last group of a read in this cycle.
    pub(super) fn looked_up(&self) -> bool {
        self.tiles[0].looked_up()
    }

    pub(super) fn busy(&self, during: During) -> bool {
        self.tiles.iter().any(|tile| match during {
            During::ForwardRows | During::ForwardColumns => tile.front_is_busy(),
            During::Error => tile.errors_are_busy(),
            During::Update => tile.update_is_busy(),
            During::LoadWeights => false,
        })
    }

    /// Parts of the first copy at work in the cycle that begins, in the order of `Part`. The first tile is the largest.
    pub(super) fn at_work(&self) -> [u64; 8] {
        let tile = &self.tiles[0];
        let in_tree = self.tree.iter().filter(|entry| entry.1 == 0).count() as u64;
        let [arrays, converters, lanes, bus, multipliers, accumulators] =
            tile.at_work().map(u64::from);
        let writers = u64::from(self.tiles.iter().any(Tile::is_writing));
        [arrays, converters, in_tree, lanes, bus, multipliers, accumulators, writers]
    }

    /// What each part of each tile of the first copy is at in the cycle that begins, in the order of tiles: tile, part, sample, slice. What is
    /// in the tree belongs to the tile it goes to, and there may be several there at once.
    pub(super) fn doing(&self) -> impl Iterator<Item = (usize, Part, [Option<usize>; 2])> + '_ {
        const PARTS: [Part; 7] = [
            Part::Arrays,
            Part::Converters,
            Part::Lanes,
            Part::Bus,
            Part::Multipliers,
            Part::Accumulators,
            Part::Writers,
        ];
        let tiles = self.tiles.iter().enumerate().flat_map(|(at, tile)| {
            let parts = PARTS.into_iter().zip(tile.doing());
            parts.filter_map(move |(part, doing)| Some((at, part, doing?)))
        });
        let tree = self.tree.iter();
        let on = |slot| [Some(slot / self.positions()), None];
        tiles.chain(tree.map(move |entry| (entry.1, Part::Tree, on(entry.3.slot))))
    }
}
