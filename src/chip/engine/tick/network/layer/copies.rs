//! Further copies of the arrays of a convolution: they share out its reads, and are written alike.
//!
//! ```text
//! turn g of a sample    copy c reads position g copies + c, if there is one, while the first one reads g copies
//! a write               every copy is sent the pulses of the first, cycle by cycle
//! ```
//!
//! Each has tiles with cells, drivers, converters and lanes, and trees of its own. Sums, gates, requests and what is kept beside
//! cells stand with the first copy: the others are told what to drive, by which tables to look up and, as a write begins, what to
//! write. See docs/MODEL.md, 2.4.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use super::super::super::tile::{BankEvents, Command, Launch, Tile, TileEvents};
use super::TickLayer;
use crate::chip::population::Stream;

/// What is on its way through a tree: cycles left, the head it goes to, from columns, sums.
pub(super) type InTree = (u64, usize, bool, Launch);

/// A copy beside the first.
#[derive(Debug)]
pub(super) struct ArrayCopy {
    /// In the order of those of the first.
    tiles: Vec<Tile>,
    tree: Vec<InTree>,
}

impl TickLayer {
    /// Makes copies of its tiles, as they are, until there are so many.
    pub(super) fn copy(&mut self, copies: usize) {
        let beside = (1..copies).map(|_| ArrayCopy { tiles: self.tiles.clone(), tree: vec![] });
        self.beside = beside.collect();
    }

    /// How often its arrays stand on the chip.
    pub(in super::super) const fn copies(&self) -> usize {
        self.beside.len() + 1
    }

    /// Reads that are taken together with one, which the first copy takes: one a copy, as far as the sample has positions.
    pub(in super::super) fn together(&self, slot: usize) -> usize {
        let left = self.positions() - slot % self.positions();
        left.min(self.copies())
    }

    /// All tiles of all copies.
    pub(in super::super) fn all_tiles(&mut self) -> impl Iterator<Item = &mut Tile> {
        self.tiles.iter_mut().chain(self.beside.iter_mut().flat_map(|copy| &mut copy.tiles))
    }

    /// The same tile of every copy beside the first.
    pub(super) fn likes(&mut self, tile: usize) -> impl Iterator<Item = &mut Tile> {
        self.beside.iter_mut().map(move |copy| &mut copy.tiles[tile])
    }

    /// Whether no copy beside the first is at anything.
    pub(super) fn others_idle(&self) -> bool {
        let idle = |copy: &ArrayCopy| copy.tree.is_empty() && copy.tiles.iter().all(Tile::idle);
        self.beside.iter().all(idle)
    }

    /// Whether all copies beside the first take a command.
    pub(super) fn others_ready(&self, command: &Command<'_>) -> bool {
        self.beside.iter().all(|copy| copy.tiles.iter().all(|tile| tile.ready(command)))
    }

    /// Registers of the first copy that say how to read are those of all.
    pub(in super::super) fn set_up(&mut self) {
        for copy in &mut self.beside {
            copy.tiles.iter_mut().zip(&self.tiles).for_each(|(tile, first)| tile.set_up(first));
        }
    }

    /// Commands of the copies beside the first while that is given one: those that read do so side by side.
    fn own_commands<'a>(&self, command: Option<&Command<'a>>) -> Vec<Command<'a>> {
        let after = |slot| slot + 1..slot + self.together(slot);
        match command {
            Some(&Command::Forward { slot }) => {
                after(slot).map(|slot| Command::Forward { slot }).collect()
            }
            Some(&Command::Columns { slot }) => {
                after(slot).map(|slot| Command::Columns { slot }).collect()
            }
            _ => vec![],
        }
    }

    /// One cycle of the copies beside the first, which has still to live through it: they are sent the same pulses.
    pub(super) fn cycle_beside(&mut self, command: Option<&Command<'_>>) {
        let own = self.own_commands(command);
        let mut beside = std::mem::take(&mut self.beside);
        for (number, copy) in beside.iter_mut().enumerate() {
            let own = own.get(number);
            for (at, tile) in copy.tiles.iter_mut().enumerate() {
                if self.tiles[at].begins_to_write() {
                    tile.write_as(&self.tiles[at]);
                }
                tile.set_writes(self.writes);
                let wanted = tile.dither_wanted();
                let draws = |bank| if wanted { self.draws(at, bank) } else { vec![] };
                let [e, i] = [0, 1].map(draws);
                let own = own.filter(|own| self.concerns(own, at));
                tile.cycle(own, 0, [&e, &i]);
            }
            self.pass_tree(&mut copy.tiles, &mut copy.tree);
        }
        self.beside = beside;
    }

    /// What copies beside the first have looked up of the reads that were taken together with one goes to where gates are formed.
    pub(in super::super) fn gather_units(&mut self, slot: usize) {
        let together = self.together(slot);
        for (number, copy) in (1..together).zip(&self.beside) {
            let tiles = self.tiles.iter_mut().zip(&copy.tiles);
            tiles.for_each(|(first, tile)| first.take_units(tile, slot + number));
        }
    }

    /// What their lanes have added up goes there too.
    pub(in super::super) fn gather_readings(&mut self) {
        for copy in &mut self.beside {
            let tiles = self.tiles.iter_mut().zip(&mut copy.tiles);
            tiles.for_each(|(first, tile)| first.take_readings(tile));
        }
    }

    /// Codes on the rail of a tile, over all copies, since the last call.
    pub(super) fn take_rails_of(&mut self, tile: usize) -> Vec<[u64; 2]> {
        let mut rails = self.tiles[tile].take_rails();
        for other in self.likes(tile) {
            let both = rails.iter_mut().flatten().zip(other.take_rails().into_iter().flatten());
            both.for_each(|(sum, more)| *sum += more);
        }
        rails
    }

    /// What the last transposed read of a copy gave, by row.
    pub(super) fn backward_sums(&self, copy: usize) -> Vec<i64> {
        let tiles = copy.checked_sub(1).map_or(&self.tiles, |other| &self.beside[other].tiles);
        let sum = |row: usize| {
            let head = self.at(self.heads(Stream::P), row / self.tile[0], 0);
            tiles[head].backward_sum(row % self.tile[0])
        };
        (0..self.inputs).map(sum).collect()
    }

    /// That a write has left all copies alike.
    pub(super) fn assert_alike(&self) {
        for copy in &self.beside {
            let alike = copy.tiles.iter().zip(&self.tiles).all(|(tile, first)| tile.is_like(first));
            assert!(alike, "copies that are written alike stay alike");
        }
    }

    /// A cycle of the tree of the first copy.
    pub(super) fn tree(&mut self) {
        let (mut tiles, mut tree) =
            (std::mem::take(&mut self.tiles), std::mem::take(&mut self.tree));
        self.pass_tree(&mut tiles, &mut tree);
        (self.tiles, self.tree) = (tiles, tree);
    }

    /// A cycle of the tree of a copy.
    fn pass_tree(&self, tiles: &mut [Tile], tree: &mut Vec<InTree>) {
        tree.iter_mut().for_each(|entry| entry.0 -= 1);
        while tree.first().is_some_and(|entry| entry.0 == 0) {
            let (_, head, columns, launch) = tree.remove(0);
            tiles[head].arrive(launch, columns);
        }
        for (head, columns, launch) in self.launched(tiles) {
            match self.delay[usize::from(columns)] {
                0 => tiles[head].arrive(launch, columns),
                delay => tree.push((delay, head, columns, launch)),
            }
        }
    }

    /// What left the tiles of a copy in this cycle, added up for the head it goes to.
    fn launched(&self, tiles: &mut [Tile]) -> Vec<(usize, bool, Launch)> {
        let mut heads: Vec<(usize, bool, Launch)> = Vec::new();
        for (tile, this) in tiles.iter_mut().enumerate() {
            let Some((launch, columns)) = this.take_launch() else { continue };
            let head = match columns {
                false => {
                    let heads = self.heads(self.planes[self.plane(tile)].0);
                    self.at(heads, 0, tile % self.grid[1])
                }
                true => tile / self.grid[1] * self.grid[1],
            };
            match heads.iter_mut().find(|other| other.0 == head) {
                Some((_, _, total)) => {
                    assert_eq!(total.slot, launch.slot, "tiles of a layer are in step");
                    total.sums.iter_mut().zip(launch.sums).for_each(|(sum, more)| *sum += more);
                }
                None => heads.push((head, columns, launch)),
            }
        }
        heads
    }

    /// What was counted since the last call, by plane: banks, and what is beside them.
    pub(in super::super) fn take_events(&mut self) -> Vec<(Stream, [BankEvents; 2], TileEvents)> {
        let mut all = Vec::new();
        for plane in 0..self.planes.len() {
            let mut banks = [BankEvents::default(); 2];
            let mut events = TileEvents::default();
            for down in 0..self.grid[0] {
                for across in 0..self.grid[1] {
                    let tile = self.at(plane, down, across);
                    let first = self.tiles[tile].take_events();
                    let others = self.likes(tile).map(|tile| {
                        let (banks, events) = tile.take_events();
                        (banks.map(BankEvents::of_copy), events)
                    });
                    for (tile_banks, tile_events) in std::iter::once(first).chain(others) {
                        banks.iter_mut().zip(&tile_banks).for_each(|(sum, more)| sum.merge(more));
                        events.merge(&tile_events, across == 0);
                    }
                }
            }
            all.push((self.planes[plane].0, banks, events));
        }
        all
    }
}
