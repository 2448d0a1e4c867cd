//! The land of a foray: a square of tiles, made anew for every episode.
//!
//! ```text
//! lake      a rectangle of 2 or 3 by 2 to 4 tiles, at least 2 tiles from each edge
//! quarry    a walk of one tile at a time in a drawn direction turns ground into stone until 16 tiles are stone
//! ores      2 of the stones
//! bench, vault      on ground, at least 1 tile from each edge
//! trees     8, on ground;  the start of the walker is on ground too
//! ```
//!
//! What was drawn needs nobody to check it: bench and vault stand where they and the lake can enclose nothing, and all
//! else gives way. Draws are 32-bit words, `floor(n word / 2^32)` a number below `n`. See docs/MODEL.md, 5.4.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use crate::chip::ledger::coded;
use crate::num::draw::below;

/// Tiles along an edge.
pub const SIDE: usize = 9;
/// Tiles.
pub const TILES: usize = SIDE * SIDE;

const STONES: usize = 16;
const ORES: usize = 2;
const TREES: usize = 8;

coded! {
    /// What a tile holds.
    Terrain {
        /// Nothing: one can walk there.
        Ground = 0, "ground";
        /// Gives wood, once.
        Tree = 1, "tree";
        /// Gives water, always.
        Lake = 2, "lake";
        /// Gives stone, once, to a pickaxe.
        Stone = 3, "stone";
        /// Gives ore, once, to a hammer.
        Ore = 4, "ore";
        /// Where tools are made.
        Bench = 5, "bench";
        /// What a key opens.
        Vault = 6, "vault";
        /// What lies outside.
        Edge = 7, "edge";
    }
}

impl Terrain {
    /// Its character in a picture.
    #[must_use]
    pub const fn glyph(self) -> char {
        match self {
            Self::Ground => '.',
            Self::Tree => 'T',
            Self::Lake => '~',
            Self::Stone => 'o',
            Self::Ore => '*',
            Self::Bench => 'B',
            Self::Vault => 'V',
            Self::Edge => '#',
        }
    }
}

/// Where to: north, east, south, west, as columns and rows.
pub const DIRECTIONS: [(isize, isize); 4] = [(0, -1), (1, 0), (0, 1), (-1, 0)];

/// The tile that lies so many columns and rows from another; `None` outside.
#[inline]
#[must_use]
pub const fn away(from: usize, (columns, rows): (isize, isize)) -> Option<usize> {
    let (Some(column), Some(row)) =
        ((from % SIDE).checked_add_signed(columns), (from / SIDE).checked_add_signed(rows))
    else {
        return None;
    };
    if column < SIDE && row < SIDE { Some(row * SIDE + column) } else { None }
}

/// A land.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Land {
    /// `[row][column]`, from the north-west.
    pub tiles: [Terrain; TILES],
}

impl Land {
    /// A new land, and where the walker stands.
    pub fn draw(words: &mut impl Iterator<Item = u32>) -> (Self, usize) {
        let mut pick = |bound: usize| {
            let bound = u32::try_from(bound).expect("a land has fewer than 2^32 tiles");
            below(words.next().expect("the stream has no end"), bound) as usize
        };
        let mut land = Self { tiles: [Terrain::Ground; TILES] };
        let (width, height) = (2 + pick(2), 2 + pick(3));
        let (left, top) = (2 + pick(SIDE - 3 - width), 2 + pick(SIDE - 3 - height));
        for row in top..top + height {
            land.tiles[row * SIDE + left..][..width].fill(Terrain::Lake);
        }
        let mut at = pick(TILES);
        let mut stones = 0;
        while stones < STONES {
            if land.tiles[at] == Terrain::Ground {
                land.tiles[at] = Terrain::Stone;
                stones += 1;
            }
            at = away(at, DIRECTIONS[pick(4)]).unwrap_or(at);
        }
        let inside = |tile: usize| {
            let middle = 1..SIDE - 1;
            middle.contains(&(tile % SIDE)) && middle.contains(&(tile / SIDE))
        };
        for _ in 0..ORES {
            let at = land.one_of(Terrain::Stone, |_| true, &mut pick);
            land.tiles[at] = Terrain::Ore;
        }
        for building in [Terrain::Bench, Terrain::Vault] {
            let at = land.one_of(Terrain::Ground, inside, &mut pick);
            land.tiles[at] = building;
        }
        for _ in 0..TREES {
            let at = land.one_of(Terrain::Ground, |_| true, &mut pick);
            land.tiles[at] = Terrain::Tree;
        }
        let walker = land.one_of(Terrain::Ground, |_| true, &mut pick);
        (land, walker)
    }

    /// One of the tiles that hold `kind` at a place that will do.
    fn one_of(
        &self,
        kind: Terrain,
        will_do: impl Fn(usize) -> bool,
        pick: &mut impl FnMut(usize) -> usize,
    ) -> usize {
        let fits = |at: &usize| self.tiles[*at] == kind && will_do(*at);
        let number = pick((0..TILES).filter(fits).count());
        (0..TILES).filter(fits).nth(number).expect("a number below how many there are")
    }

    /// What lies there.
    #[inline]
    #[must_use]
    pub fn tile(&self, at: Option<usize>) -> Terrain {
        at.map_or(Terrain::Edge, |at| self.tiles[at])
    }
}
