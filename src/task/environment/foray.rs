//! `Foray-v0`: find your way through an unknown land, make tools, open the vault. Small and our own.
//!
//! ```text
//! actions   0 north, 1 east, 2 south, 3 west: the walker turns there and walks into the tile
//! ground    is walked onto                                                 edge       gives nothing
//! tree      becomes ground: wood + 1                  reward 1, first      wood       at most 9, as stone and ore
//! lake      fills the flask to 80                     reward 1, first
//! bench     wood - 1 -> pickaxe                       reward 2
//!           else wood - 1, stone - 1 -> hammer        reward 3             whatever is due, in this order
//!           else ore - 1 -> key                       reward 5
//! stone     to a pickaxe: becomes ground, stone + 1   reward 2, first
//! ore       to a hammer: becomes ground, ore + 1      reward 3, first
//! vault     to a key: opens, and the foray is over    reward 8
//! flask     80 at first, one less a step; empty, the foray is over
//! ```
//!
//! Rewards sum to 25 at most; 300 steps. Every episode has a land of its own ([`land`]). The walker sees 5 columns and 5 rows
//! of it, himself in the middle, what he carries and where he turned to last: where bench, lake and vault lie he must
//! remember or find again. All that is shown is lines that are on or off:
//!
//! ```text
//! 0 .. 175      (kind - 1) 25 + row 5 + column      what lies there, but for ground
//! 175 .. 179    where he turned to last
//! 179 .. 186    wood >= 1, wood >= 2, stone >= 1, ore >= 1, pickaxe, hammer, key
//! 186 .. 190    the quarter that the flask is in, of 1 .. 20, 21 .. 40, 41 .. 60, 61 .. 80
//! ```
//!
//! Nothing is drawn after the beginning. Mean return of 10000 episodes: uniform random actions 3.5, the script that goes for
//! what pays at once 4.2, the one with foresight 18.1 ([`greedy`]). See docs/MODEL.md, 5.4.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use super::one::{Action, Came, Environment, StatePart};
use super::{EnvSpec, Observations, Real, Shown, Taken};
use crate::chip::ledger::coded;

pub mod greedy;
pub mod land;

use land::{DIRECTIONS, Land, SIDE, TILES, Terrain, away};

/// Columns and rows of the view.
pub const VIEW: [usize; 2] = [5, 5];
const SEEN: usize = VIEW[0] * VIEW[1];
/// The line of the first tile that is seen as a tree, of the first direction, of what is carried, of the flask.
const LINE_TURNED: usize = (Terrain::COUNT - 1) * SEEN;
const LINE_CARRIED: usize = LINE_TURNED + DIRECTIONS.len();
const CARRIED: usize = 7;
const LINE_FLASK: usize = LINE_CARRIED + CARRIED;
/// Lines.
pub const LINES: usize = LINE_FLASK + 4;

const FLASK: u8 = 80;
const MANY: u8 = 9;

/// What is earned by a [`Feat`], in their order.
const REWARDS: [i32; Feat::COUNT] = [1, 1, 2, 2, 3, 3, 5, 8];

coded! {
    /// What can be reached in an episode.
    Feat {
        /// Took wood.
        Wood = 0, "wood";
        /// Filled the flask.
        Water = 1, "water";
        /// Made the pickaxe.
        Pickaxe = 2, "pickaxe";
        /// Took stone.
        Stone = 3, "stone";
        /// Made the hammer.
        Hammer = 4, "hammer";
        /// Took ore.
        Ore = 5, "ore";
        /// Made the key.
        Key = 6, "key";
        /// Opened the vault.
        Vault = 7, "vault";
    }
}

/// A walker in a land.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Foray {
    land: Land,
    at: usize,
    /// Which of [`DIRECTIONS`] he turned to last.
    turned: usize,
    wood: u8,
    stone: u8,
    ore: u8,
    flask: u8,
    /// A bit a [`Feat`].
    done: u8,
}

impl Foray {
    /// Whether it was reached.
    #[must_use]
    pub const fn has(&self, feat: Feat) -> bool {
        self.done >> feat as u8 & 1 == 1
    }

    /// What it is worth: its reward the first time, then nothing.
    fn reach(&mut self, feat: Feat) -> i32 {
        if self.has(feat) {
            return 0;
        }
        self.done |= 1 << feat as u8;
        REWARDS[feat as usize]
    }

    /// Makes whatever is due.
    fn make(&mut self) -> i32 {
        if !self.has(Feat::Pickaxe) {
            if self.wood == 0 {
                return 0;
            }
            self.wood -= 1;
            self.reach(Feat::Pickaxe)
        } else if !self.has(Feat::Hammer) {
            if self.wood == 0 || self.stone == 0 {
                return 0;
            }
            self.wood -= 1;
            self.stone -= 1;
            self.reach(Feat::Hammer)
        } else if !self.has(Feat::Key) && self.ore > 0 {
            self.ore -= 1;
            self.reach(Feat::Key)
        } else {
            0
        }
    }

    /// What comes of walking into a tile.
    fn meet(&mut self, at: Option<usize>) -> i32 {
        let Some(at) = at else { return 0 };
        match self.land.tiles[at] {
            Terrain::Ground => {
                self.at = at;
                0
            }
            Terrain::Tree => {
                self.land.tiles[at] = Terrain::Ground;
                self.wood = MANY.min(self.wood + 1);
                self.reach(Feat::Wood)
            }
            Terrain::Lake => {
                self.flask = FLASK;
                self.reach(Feat::Water)
            }
            Terrain::Stone if self.has(Feat::Pickaxe) => {
                self.land.tiles[at] = Terrain::Ground;
                self.stone = MANY.min(self.stone + 1);
                self.reach(Feat::Stone)
            }
            Terrain::Ore if self.has(Feat::Hammer) => {
                self.land.tiles[at] = Terrain::Ground;
                self.ore = MANY.min(self.ore + 1);
                self.reach(Feat::Ore)
            }
            Terrain::Bench => self.make(),
            Terrain::Vault if self.has(Feat::Key) => self.reach(Feat::Vault),
            Terrain::Stone | Terrain::Ore | Terrain::Vault | Terrain::Edge => 0,
        }
    }

    /// What he carries, in the order of its lines.
    fn carried(&self) -> [bool; CARRIED] {
        [
            self.wood >= 1,
            self.wood >= 2,
            self.stone >= 1,
            self.ore >= 1,
            self.has(Feat::Pickaxe),
            self.has(Feat::Hammer),
            self.has(Feat::Key),
        ]
    }
}

/// Where a tile of the view lies from its middle, in columns and rows.
#[inline]
const fn from_middle(seen: usize) -> (isize, isize) {
    let [width, height] = VIEW;
    let (column, row) = (seen % width, seen / width);
    (
        column.cast_signed() - (width / 2).cast_signed(),
        row.cast_signed() - (height / 2).cast_signed(),
    )
}

/// A line's number as it is shown.
fn line(number: usize) -> u32 {
    u32::try_from(number).expect("there are fewer than 2^32 lines")
}

impl Environment for Foray {
    fn spec() -> EnvSpec {
        EnvSpec {
            id: "Foray-v0".into(),
            shown: Shown::Sparse { lines: LINES, active: SEEN + 1 + CARRIED + 1 },
            taken: Taken::Discrete(DIRECTIONS.len()),
            steps_max: 300,
            inputs: vec![
                ("tree", SEEN),
                ("lake", SEEN),
                ("stone", SEEN),
                ("ore", SEEN),
                ("bench", SEEN),
                ("vault", SEEN),
                ("edge", SEEN),
                ("turned", DIRECTIONS.len()),
                ("wood carried", 2),
                ("stone carried", 1),
                ("ore carried", 1),
                ("pickaxe", 1),
                ("hammer", 1),
                ("key", 1),
                ("flask", 4),
            ],
        }
    }

    fn parts() -> Vec<StatePart> {
        let part = |name, numbers, most: i64| StatePart { name, numbers, within: 0..=most };
        vec![
            part("tiles", TILES, i64::from(Terrain::Vault.code())),
            part("at", 1, (TILES - 1) as i64),
            part("turned", 1, 3),
            part("wood", 1, i64::from(MANY)),
            part("stone", 1, i64::from(MANY)),
            part("ore", 1, i64::from(MANY)),
            part("flask", 1, i64::from(FLASK)),
            part("done", 1, 255),
        ]
    }

    fn begin(words: &mut impl Iterator<Item = u32>) -> Self {
        let (land, at) = Land::draw(words);
        Self { land, at, turned: 0, wood: 0, stone: 0, ore: 0, flask: FLASK, done: 0 }
    }

    fn act(&mut self, action: Action<'_>) -> Came {
        self.turned = usize::from(action.choice());
        self.flask = self.flask.saturating_sub(1);
        let reward = self.meet(away(self.at, DIRECTIONS[self.turned]));
        let terminated = self.flask == 0 || self.has(Feat::Vault);
        Came { reward: Real::from_num(reward), terminated }
    }

    fn show(&self, shown: &mut Observations) {
        let mut there = [0_u32; Terrain::COUNT];
        for seen in 0..SEEN {
            there[self.land.tile(away(self.at, from_middle(seen))) as usize] |= 1 << seen;
        }
        for (kind, mut seen) in there.into_iter().enumerate().skip(1) {
            while seen != 0 {
                shown.active.push(line((kind - 1) * SEEN) + seen.trailing_zeros());
                seen &= seen - 1;
            }
        }
        shown.active.push(line(LINE_TURNED + self.turned));
        let carried = self.carried().into_iter().enumerate().filter(|(_, has)| *has);
        shown.active.extend(carried.map(|(number, _)| line(LINE_CARRIED + number)));
        let quarter = usize::from(self.flask.saturating_sub(1)) * 4 / usize::from(FLASK);
        shown.active.push(line(LINE_FLASK + quarter));
    }

    fn numbers(&self, numbers: &mut Vec<i64>) {
        numbers.extend(self.land.tiles.map(|tile| i64::from(tile.code())));
        numbers.extend([self.at, self.turned].map(|number| number as i64));
        let Self { wood, stone, ore, flask, done, .. } = *self;
        numbers.extend([wood, stone, ore, flask, done].map(i64::from));
    }

    fn from_numbers(numbers: &[i64]) -> Self {
        let (tiles, rest) = numbers.split_at(TILES);
        let index = |number: i64| usize::try_from(number).expect("it lies within its part");
        let byte = |number: i64| u8::try_from(number).expect("it lies within its part");
        Self {
            land: Land { tiles: std::array::from_fn(|at| Terrain::ALL[index(tiles[at])]) },
            at: index(rest[0]),
            turned: index(rest[1]),
            wood: byte(rest[2]),
            stone: byte(rest[3]),
            ore: byte(rest[4]),
            flask: byte(rest[5]),
            done: byte(rest[6]),
        }
    }

    fn picture(&self) -> String {
        let glyph = |at: usize| {
            if at == self.at {
                ['^', '>', 'v', '<'][self.turned]
            } else {
                self.land.tiles[at].glyph()
            }
        };
        let mut picture = String::new();
        for row in 0..SIDE {
            picture.extend((0..SIDE).map(|column| glyph(row * SIDE + column)));
            picture.push('\n');
        }
        let Self { wood, stone, ore, flask, .. } = self;
        picture += &format!("wood {wood}  stone {stone}  ore {ore}  flask {flask}\n");
        let tools = [Feat::Pickaxe, Feat::Hammer, Feat::Key];
        let tools = tools.into_iter().filter(|tool| self.has(*tool));
        picture + &tools.map(Feat::name).collect::<Vec<_>>().join("  ") + "\n"
    }
}

#[cfg(test)]
mod tests;
