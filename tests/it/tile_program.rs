//! Programs for one tile: seeded random commands and data, for the lock-step test with the RTL and for golden digests.
//!
//! A program mixes what training does (load, read several samples back to back, route errors, add, write, or write at
//! once) with commands in any order, offers commands while the tile is busy, and pauses. Draws and bus words change
//! in every cycle, wanted or not. All data are legal: levels lie in the window, words have nine bits.

use std::collections::VecDeque;

use dalean::chip::engine::tick::{Command, Tile, TileConfig, TileSize};

#[path = "tile_settings.rs"]
mod tile_settings;

pub(crate) use tile_settings::settings;

/// Samples the tiles remember.
pub(crate) const SLOTS: usize = 4;
/// Stages of the adder tree there are registers for.
pub(crate) const TREE_MAX: usize = 4;
/// Cycles whose registers the golden digests hold.
pub(crate) const GOLDEN_CYCLES: u64 = 3000;

/// A tile, what it is asked to do, and what comes of it.
pub(crate) struct Setting {
    /// What is special about it.
    pub(crate) name: &'static str,
    /// Rows and columns the tile is built with.
    pub(crate) size: usize,
    /// Configuration registers.
    pub(crate) config: TileConfig,
    /// Start of the digest of all registers over the first cycles.
    pub(crate) golden: &'static str,
    /// Start of its random sequences.
    pub(crate) seed: u64,
    /// Shifts of updates: least and greatest.
    shifts: [u32; 2],
}

impl Setting {
    /// Sizes of its tile.
    pub(crate) fn tile_size(&self) -> TileSize {
        TileSize { rows: self.size, columns: self.size, slots: SLOTS, tree_max: TREE_MAX }
    }

    /// A table of `[activity, derivative]`: anything, so that no two entries are likely to be alike.
    pub(crate) fn table(&self) -> Vec<[u8; 2]> {
        let mut words = Words(!self.seed);
        (0..1 << self.config.lut_bits).map(|_| [words.byte(), words.byte()]).collect()
    }
}

// --- random numbers ---

/// Random words: a Weyl sequence, mixed (SplitMix64).
pub(crate) struct Words(u64);

impl Words {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// `0..end`.
    fn below(&mut self, end: usize) -> usize {
        let end = u64::try_from(end).expect("small");
        usize::try_from(self.next() % end).expect("small")
    }

    /// Whether one of `many` equally likely things happened.
    fn one_in(&mut self, many: usize) -> bool {
        self.below(many) == 0
    }

    fn byte(&mut self) -> u8 {
        self.next().to_le_bytes()[7]
    }

    fn fill(&mut self, draws: &mut [u16]) {
        for four in draws.chunks_mut(4) {
            let word = self.next();
            for (i, draw) in four.iter_mut().enumerate() {
                *draw = u16::try_from((word >> (16 * i)) & 0xffff).expect("16 bits");
            }
        }
    }
}

// --- programs ---

/// A command with its data.
#[derive(Debug, Clone)]
pub(crate) enum Offer {
    Weights { row: usize, levels: [Vec<u16>; 2] },
    Drives { row: usize, slot: usize, codes: [u8; 2] },
    Forward { slot: usize },
    Error { slot: usize },
    Now { slot: usize, shift: u32 },
    Add { slot: usize },
    Write { shift: u32 },
}

impl Offer {
    /// As the tile takes it.
    pub(crate) fn command(&self) -> Command<'_> {
        match *self {
            Self::Weights { row, ref levels } => {
                Command::LoadWeights { row, levels: [&levels[0], &levels[1]] }
            }
            Self::Drives { row, slot, codes } => Command::LoadDrives { row, slot, codes },
            Self::Forward { slot } => Command::Forward { slot },
            Self::Error { slot } => Command::Error { slot },
            Self::Now { slot, shift } => Command::Now { slot, shift },
            Self::Add { slot } => Command::Add { slot },
            Self::Write { shift } => Command::Write { shift },
        }
    }
}

/// What is put to the tile, cycle after cycle.
pub(crate) struct Program {
    config: TileConfig,
    shifts: [u32; 2],
    words: Words,
    waiting: VecDeque<Offer>,
    /// A command out of turn, withdrawn if the tile does not take it at once.
    stray: Option<Offer>,
    /// Commands until every row in use has been loaded: before, its levels may lie outside the window.
    unloaded: usize,
    pause: usize,
    /// What the bus carries.
    pub(crate) bus_word: i16,
    /// A draw a column, by bank.
    pub(crate) dither: [Vec<u16>; 2],
}

impl Program {
    /// The program of a setting.
    pub(crate) fn new(setting: &Setting) -> Self {
        let mut program = Self {
            config: setting.config.clone(),
            shifts: setting.shifts,
            words: Words(setting.seed),
            waiting: VecDeque::new(),
            stray: None,
            unloaded: 0,
            pause: 0,
            bus_word: 0,
            dither: [vec![0; setting.size], vec![0; setting.size]],
        };
        program.restart();
        program
    }

    /// The tile was reset: begins with loading again.
    pub(crate) fn restart(&mut self) {
        self.waiting.clear();
        self.load();
        self.unloaded = self.config.rows;
    }

    /// Chooses what the next cycle brings.
    pub(crate) fn prepare(&mut self) {
        self.bus_word = self.word();
        for draws in &mut self.dither {
            self.words.fill(draws);
        }
        if self.words.one_in(16) {
            let bank = self.words.below(2);
            self.dither[bank].fill(if self.words.one_in(2) { 0 } else { 0xffff });
        }
        if self.waiting.is_empty() {
            self.plan();
        }
        self.stray = (self.unloaded == 0 && self.words.one_in(12)).then(|| self.any());
        if self.pause > 0 {
            self.pause -= 1;
        } else if self.words.one_in(40) {
            // long enough, now and then, for all that is in flight to end
            self.pause = if self.words.one_in(4) { 60 } else { 5 };
        }
    }

    /// The command offered in this cycle.
    pub(crate) fn offer(&self) -> Option<&Offer> {
        let in_turn = (self.pause == 0).then(|| self.waiting.front()).flatten();
        self.stray.as_ref().or(in_turn)
    }

    /// The tile has taken the command.
    pub(crate) fn accepted(&mut self) {
        if self.stray.is_none() {
            self.waiting.pop_front();
        }
        self.unloaded = self.unloaded.saturating_sub(1);
    }

    /// A word of the error bus: mostly of the width in use, at times wider, which saturates gates.
    fn word(&mut self) -> i16 {
        let bits = if self.words.one_in(8) { 9 } else { self.config.error_bits };
        let most = (1_usize << (bits - 1)) - 1;
        let word = match self.words.below(6) {
            0 => most,
            1 => 0,
            _ => self.words.below(most + 1),
        };
        let word = i16::try_from(word).expect("nine bits");
        if self.words.one_in(2) { -word } else { word }
    }

    /// A level: often near an end of the window, where pulses find it.
    fn level(&mut self) -> u16 {
        let TileConfig { floor, ceiling, .. } = self.config;
        let height = usize::from(ceiling - floor);
        let near = self.words.below(height.min(3) + 1);
        let above = match self.words.below(4) {
            0 => near,
            1 => height - near,
            _ => self.words.below(height + 1),
        };
        floor + u16::try_from(above).expect("inside the window")
    }

    fn code(&mut self) -> u8 {
        match self.words.below(6) {
            0 => 0,
            1 => 255,
            _ => self.words.byte(),
        }
    }

    fn slot(&mut self) -> usize {
        self.words.below(SLOTS)
    }

    fn shift(&mut self) -> u32 {
        let [least, most] = self.shifts;
        if self.words.one_in(12) {
            return u32::try_from(self.words.below(40)).expect("small");
        }
        least
            + u32::try_from(self.words.below(usize::try_from(most - least).expect("small") + 1))
                .expect("small")
    }

    fn weights(&mut self, row: usize) -> Offer {
        let columns = self.config.columns;
        let mut bank = || (0..columns).map(|_| self.level()).collect();
        Offer::Weights { row, levels: [bank(), bank()] }
    }

    fn drives(&mut self, row: usize, slot: usize) -> Offer {
        Offer::Drives { row, slot, codes: [self.code(), self.code()] }
    }

    /// Any command; loads also of rows that are not in use.
    fn any(&mut self) -> Offer {
        let row = self.words.below(self.dither[0].len());
        match self.words.below(7) {
            0 => self.weights(row),
            1 => {
                let slot = self.slot();
                self.drives(row, slot)
            }
            2 => Offer::Forward { slot: self.slot() },
            3 => Offer::Error { slot: self.slot() },
            4 => Offer::Now { slot: self.slot(), shift: self.shift() },
            5 => Offer::Add { slot: self.slot() },
            _ => Offer::Write { shift: self.shift() },
        }
    }

    /// New levels in every row, new drives in every slot.
    fn load(&mut self) {
        for row in 0..self.config.rows {
            let weights = self.weights(row);
            self.waiting.push_back(weights);
        }
        for slot in 0..SLOTS {
            self.load_drives(slot);
        }
    }

    fn load_drives(&mut self, slot: usize) {
        for row in 0..self.config.rows {
            let drives = self.drives(row, slot);
            self.waiting.push_back(drives);
        }
    }

    /// Chooses what comes next when nothing waits.
    fn plan(&mut self) {
        match self.words.below(12) {
            0 => self.load(),
            1..=2 => {
                for _ in 0..8 {
                    let any = self.any();
                    self.waiting.push_back(any);
                }
            }
            scene => self.train(scene > 9),
        }
    }

    /// One training step on a few samples: written after each of them, or once.
    fn train(&mut self, at_once: bool) {
        let samples = 1 + self.words.below(SLOTS);
        for slot in 0..samples {
            if self.words.one_in(2) {
                self.load_drives(slot);
            }
        }
        self.waiting.extend((0..samples).map(|slot| Offer::Forward { slot }));
        for slot in 0..samples {
            self.waiting.push_back(Offer::Error { slot });
            let shift = self.shift();
            let update = if at_once { Offer::Now { slot, shift } } else { Offer::Add { slot } };
            self.waiting.push_back(update);
        }
        if !at_once {
            let shift = self.shift();
            self.waiting.push_back(Offer::Write { shift });
        }
    }
}

/// Takes the registers of a cycle into a digest.
pub(crate) fn digest(hasher: &mut blake3::Hasher, registers: impl Iterator<Item = i64>) {
    let bytes: Vec<u8> = registers.flat_map(i64::to_le_bytes).collect();
    hasher.update(&bytes);
}

/// Start of a digest, enough to pin it.
pub(crate) fn pinned(hasher: &blake3::Hasher) -> String {
    hasher.finalize().to_hex()[..16].to_owned()
}

/// All numbers of all registers.
pub(crate) fn numbers(tile: &Tile) -> Vec<i64> {
    tile.registers().into_iter().flat_map(|(_, numbers)| numbers).collect()
}
