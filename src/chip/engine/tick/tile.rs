//! One tile, cycle by cycle: the page docs/TILE.md as plain Rust.
//!
//! All parts of a tile act at once on its registers as they were at the start of a cycle. Here they act one after the
//! other, from the end of the data's way to its start, so that each still sees what the part before it had left the
//! cycle before: lanes, tree, converters, front end; then error unit, update, and last the command that is accepted.
//!
//! Beyond the page, for networks of tiles (docs/MODEL.md, 4.5): an adder tree outside, more than one tap, remainders,
//! words pixel by pixel, verified, limited and amplitude-coded pulses, reads from the columns, drives with a sign, and digital
//! actions of more than one cycle.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

mod balance;
mod command;
mod conducting;
mod config;
mod device;
mod events;
mod memory;
mod network;
mod optimise;
mod read;
mod registers;
mod trains;
mod write;

pub use balance::TileBalance;
use balance::TileReadings;
pub use command::Command;
use conducting::Through;
pub(super) use config::TileNoise;
pub use config::{More, Squares, TileAdc, TileConfig, TileSize, TileUnits};
pub(super) use device::{TileDevice, laws};
pub use events::{BankEvents, TileEvents};
pub(super) use memory::{Memories, TileMemory, differing};
use optimise::Kept;
pub(super) use optimise::Said;

/// Which lines a read goes through.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
enum Way {
    /// Rows are driven, columns are read.
    #[default]
    Rows,
    /// Columns are driven, rows are read.
    Columns,
}

/// Sampled currents and accumulators of the lines that are read.
#[derive(Debug, Clone, Default)]
struct Lines {
    hold: [Vec<i64>; 2],
    acc: Vec<i64>,
    out: Vec<i64>,
}

#[derive(Debug, Clone, Default)]
struct Front {
    busy: bool,
    slice: u32,
    phase: u64,
    slot: usize,
    way: Way,
}

#[derive(Debug, Clone, Default)]
struct Conv {
    busy: bool,
    slice: u32,
    step: usize,
    count: u64,
    slot: usize,
    way: Way,
}

#[derive(Debug, Clone, Default)]
struct Lane {
    busy: bool,
    group: usize,
    slot: usize,
    way: Way,
    /// Cycles of the group that have passed.
    beat: u64,
}

#[derive(Debug, Clone, Default)]
struct Err {
    busy: bool,
    count: usize,
    slot: usize,
    beat: u64,
}

/// What the error unit of a tile does in a beat.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum ErrorStep {
    /// The first word is on its way.
    Wait,
    /// A word arrives, of a pixel where words come so.
    Hear { pixel: usize, word: usize },
    /// Gates of a group of columns are formed: at turn `turn` of the positions that hear those words.
    Multiply { pixel: usize, turn: usize, group: usize },
}

/// What an update does in a cycle.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
enum UpdPhase {
    #[default]
    Compute,
    Set,
    Reset,
    Turn,
    /// All sums are squared.
    Look,
    /// Until those of the whole layer have been.
    Wait,
    /// Products of more than one read are added up before they are written.
    Gather,
    /// Until those of the whole layer have been.
    Gathered,
}

/// Field of an update, as it is numbered in the register.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
enum UpdKind {
    #[default]
    Now,
    Add,
    Write,
}

#[derive(Debug, Clone, Default)]
struct Upd {
    busy: bool,
    kind: UpdKind,
    row: usize,
    group: usize,
    /// Product of the sample: a read, or a driving of the rows.
    position: usize,
    phase: UpdPhase,
    pulse: i64,
    count: u64,
    slot: usize,
    shift: u32,
    beat: u64,
    /// Passes of the pulse in progress that are done.
    pass: usize,
}

/// A stage of the adder tree.
#[derive(Debug, Clone, Default)]
struct TreeStage {
    valid: bool,
    slot: usize,
    sums: Vec<i64>,
}

/// Accumulators on their way to the lanes of a network.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Launch {
    /// Which read.
    pub slot: usize,
    /// A sum a line.
    pub sums: Vec<i64>,
}

/// A tile.
#[derive(Debug, Clone)]
pub struct Tile {
    size: TileSize,
    config: TileConfig,
    /// `[activity, derivative]` by index; empty where nothing is looked up.
    table: Vec<[u8; 2]>,
    /// `[row][column]`.
    level: [Vec<u16>; 2],
    pruned: [Vec<bool>; 2],
    /// Which cells hold their level whatever happens.
    stuck: [Vec<bool>; 2],
    residual: [Vec<i64>; 2],
    /// `[slot][row]`.
    drive: [Vec<u8>; 2],
    lines: [Lines; 2],
    tree: Vec<TreeStage>,
    /// `[slot][column]`.
    value: Vec<u8>,
    slope: Vec<u8>,
    /// By row, of the last read from the columns.
    backward: Vec<i64>,
    error: Vec<i64>,
    /// Sums of taps while words arrive.
    heard: Vec<i64>,
    /// `[slot][column]`.
    gate: Vec<i64>,
    sum: [Vec<i64>; 2],
    pulse: [Vec<i64>; 2],
    peak_set: i64,
    peak_reset: i64,
    front: Front,
    conv: Conv,
    lane: Lane,
    err: Err,
    upd: Upd,
    bank_events: [BankEvents; 2],
    events: TileEvents,
    /// Codes of reads through the rows, by slice: on the rail, all.
    rails: Vec<[u64; 2]>,
    launched: Option<(Launch, Way)>,
    /// By bank: which rows and columns fire in the slot that ends in this cycle.
    firing: [(Vec<bool>, Vec<bool>); 2],
    /// What requests of whole batches need.
    kept: Kept,
    /// Cells that were pulsed by trains of this write.
    trained: [Vec<bool>; 2],
    /// Whether the lanes have seen the last group of a sample in this cycle.
    looked_up: bool,
    /// What lanes of units that keep to a middle have added up.
    readings: TileReadings,
    /// What cells are made of, if they are not ideal.
    device: Option<Box<TileDevice>>,
    /// What they remember, if anything.
    memory: Option<Box<TileMemory>>,
    /// By bank: levels, and what they let through, where that is not the level itself.
    through: [Through; 2],
}

impl Tile {
    /// A tile after reset, with its look-up table: `2^lut_bits` pairs of activity and derivative.
    ///
    /// # Panics
    /// When the configuration does not fit the size or the table.
    #[must_use]
    pub fn new(size: TileSize, config: TileConfig, table: Vec<[u8; 2]>) -> Self {
        assert!((1..=size.rows).contains(&config.rows), "rows in use are rows");
        assert!((1..=size.columns).contains(&config.columns), "columns in use are columns");
        assert!(config.tree <= size.tree_max, "the tree has its stages");
        let looked_up = config.more.units == TileUnits::Table;
        assert!(!looked_up || table.len() == 1 << config.lut_bits, "a table entry an index");
        let positive = [config.settle, config.convert, config.pulse, config.more.beat];
        assert!(positive.iter().all(|&cycles| cycles > 0), "what takes time takes a cycle");
        assert!(config.share > 0 && config.lanes > 0 && config.words > 0, "counts are positive");
        let cells = size.rows * size.columns;
        let two = |count: usize| [vec![0; count], vec![0; count]];
        let lines =
            |count: usize| Lines { hold: two(count), acc: vec![0; count], out: vec![0; count] };
        let stage = TreeStage { sums: vec![0; size.columns], ..TreeStage::default() };
        Self {
            level: [vec![0; cells], vec![0; cells]],
            pruned: [vec![false; cells], vec![false; cells]],
            stuck: [vec![false; cells], vec![false; cells]],
            residual: two(cells),
            drive: [vec![0; size.slots * size.rows], vec![0; size.slots * size.rows]],
            lines: [lines(size.columns), lines(size.rows)],
            tree: vec![stage; size.tree_max],
            value: vec![0; size.slots * size.columns],
            slope: vec![0; size.slots * size.columns],
            backward: vec![0; size.rows],
            error: vec![0; size.columns],
            heard: vec![0; size.columns],
            gate: vec![0; size.slots * size.columns],
            sum: two(cells),
            pulse: two(size.columns),
            peak_set: 0,
            peak_reset: 0,
            front: Front::default(),
            conv: Conv::default(),
            lane: Lane::default(),
            err: Err::default(),
            upd: Upd::default(),
            bank_events: Default::default(),
            events: TileEvents::default(),
            rails: vec![[0; 2]; config.slices as usize],
            launched: None,
            firing: Default::default(),
            kept: Kept::new(size.rows, size.columns),
            trained: [vec![false; cells], vec![false; cells]],
            looked_up: false,
            readings: TileReadings::default(),
            device: None,
            memory: None,
            through: Default::default(),
            size,
            config,
            table,
        }
    }

    /// `NG` of so many lines.
    const fn groups(&self, lines: usize) -> usize {
        lines.div_ceil(self.config.lanes)
    }

    /// Whether nothing is in progress.
    #[must_use]
    pub fn idle(&self) -> bool {
        let tree = self.tree.iter().any(|stage| stage.valid);
        let busy = [self.front.busy, self.conv.busy, self.lane.busy, self.err.busy, self.upd.busy];
        !tree && busy.iter().all(|busy| !busy)
    }

    /// Whether a command would be accepted in this cycle.
    #[must_use]
    pub fn ready(&self, command: &Command<'_>) -> bool {
        match command {
            // networks read what follows in a pipeline, the same way
            Command::Forward { .. } | Command::Columns { .. } => {
                !self.front.busy && !self.err.busy && !self.upd.busy
            }
            _ => self.idle(),
        }
    }

    /// Number of the error word that arrives in this cycle; 0 when none.
    #[must_use]
    pub fn bus_index(&self) -> usize {
        match self.error_step() {
            Some(ErrorStep::Hear { pixel, word }) => pixel * self.config.words + word,
            _ => 0,
        }
    }

    /// Whether an error word arrives in this cycle.
    #[must_use]
    pub fn bus_wanted(&self) -> bool {
        matches!(self.error_step(), Some(ErrorStep::Hear { .. }))
    }

    /// Row whose draws are wanted.
    #[must_use]
    pub const fn dither_row(&self) -> usize {
        self.upd.row
    }

    /// Whether draws are taken in this cycle.
    #[must_use]
    pub fn dither_wanted(&self) -> bool {
        let computes = self.upd.phase == UpdPhase::Compute && self.upd.kind != UpdKind::Add;
        self.upd.busy && computes
    }

    /// One cycle. `command` is what is offered, `bus_word` what the bus carries, `dither` a draw a column and bank.
    pub fn cycle(&mut self, command: Option<&Command<'_>>, bus_word: i16, dither: [&[u16]; 2]) {
        let accepted = command.filter(|command| self.ready(command));
        self.launched = None;
        self.looked_up = false;
        self.lanes();
        self.tree();
        self.converters();
        self.front_end();
        self.errors(i64::from(bus_word));
        self.updates(dither);
        if let Some(command) = accepted {
            self.accept(command);
        }
    }

    fn accept(&mut self, command: &Command<'_>) {
        let read = |slot, way| Front { busy: true, slice: 0, phase: 0, slot, way };
        let update = |kind, slot, shift| Upd { busy: true, kind, slot, shift, ..Upd::default() };
        match *command {
            Command::LoadWeights { row, levels } => {
                for (bank, levels) in levels.into_iter().enumerate() {
                    let at = row * self.size.columns;
                    let count = self.config.columns;
                    let cells = self.level[bank][at..].iter_mut().zip(&self.stuck[bank][at..]);
                    let free = cells.zip(&levels[..count]).filter(|((_, stuck), _)| !**stuck);
                    free.for_each(|((cell, _), &level)| *cell = level);
                    self.bank_events[bank].cell_loads += count as u64;
                }
            }
            Command::LoadDrives { row, slot, codes } => {
                for (bank, code) in codes.into_iter().enumerate() {
                    self.drive[bank][slot * self.size.rows + row] = code;
                }
            }
            Command::Forward { slot } => self.front = read(slot, Way::Rows),
            Command::Columns { slot } => self.front = read(slot, Way::Columns),
            Command::Error { slot } => {
                self.heard.fill(0);
                self.err = Err { busy: true, slot, ..Err::default() };
            }
            Command::Now { slot, shift } => {
                self.upd = update(UpdKind::Now, slot, shift);
                if self.config.more.train_slots.is_some() {
                    self.upd.phase = UpdPhase::Set;
                } else if self.products() > 1 {
                    self.upd.phase = UpdPhase::Gather;
                }
            }
            // the field is taken, and not used
            Command::Add { slot } => self.upd = update(UpdKind::Add, slot, 0),
            Command::Write { shift } => {
                self.upd = update(UpdKind::Write, 0, shift);
                if self.config.more.looks.is_some() {
                    self.upd.phase = UpdPhase::Look;
                }
            }
        }
    }
}

#[cfg(test)]
mod tests;
