//! Two scripts that go for the nearest useful thing they see: what a policy has to beat.
//!
//! ```text
//! useful      lake     below the last quarter of the flask      stone    with a pickaxe and no hammer, while he has none
//!             bench    when something can be made there         ore      with a hammer and no key, while he has none
//!             vault    with a key                               tree     without a pickaxe, while he has no wood
//! foresight   tree     also with a pickaxe and no hammer, and while he has fewer than 2 wood
//! nearest     fewest columns plus rows away; then the first by rows
//! step        along the longer way to it if that tile is open or is the thing, else along the other if that is
//! else        on ahead if that is open, else the first that is open to the right of it
//! restless    one step in eight sees nothing useful, and takes a drawn direction for ahead
//! open        ground; with foresight also trees and, with a pickaxe, stones
//! ```
//!
//! [`greedy`] goes for what pays at once, [`provident`] also for the wood that a hammer will need, which pays nothing when it
//! is taken. Both see what a policy sees, and remember nothing.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use super::land::{DIRECTIONS, Terrain};
use super::{LINE_CARRIED, LINE_FLASK, LINE_TURNED, SEEN, VIEW, from_middle};

/// What the script does that goes for what pays at once, where these lines are on; `word` is drawn.
#[must_use]
pub fn greedy(lines: &[u32], word: u32) -> u16 {
    step(lines, word, false)
}

/// What the script does that knows what will be needed, where these lines are on; `word` is drawn.
#[must_use]
pub fn provident(lines: &[u32], word: u32) -> u16 {
    step(lines, word, true)
}

fn step(lines: &[u32], word: u32, foresight: bool) -> u16 {
    let on = |line: usize| lines.iter().any(|&active| active as usize == line);
    let [wood, wood_2, stone, ore, pickaxe, hammer, key] =
        std::array::from_fn(|number| on(LINE_CARRIED + number));
    let useful = |tile: Terrain| match tile {
        Terrain::Tree if foresight => !wood_2 && !hammer,
        Terrain::Tree => !wood && !pickaxe,
        Terrain::Lake => !on(LINE_FLASK + 3),
        Terrain::Stone => pickaxe && !hammer && !stone,
        Terrain::Ore => hammer && !key && !ore,
        Terrain::Bench if !pickaxe => wood,
        Terrain::Bench if !hammer => wood && stone,
        Terrain::Bench => ore && !key,
        Terrain::Vault => key,
        Terrain::Ground | Terrain::Edge => false,
    };
    let mut seen = [Terrain::Ground; SEEN];
    for line in lines.iter().map(|&line| line as usize).filter(|&line| line < LINE_TURNED) {
        seen[line % SEEN] = Terrain::ALL[1 + line / SEEN];
    }
    let way = |at: usize| {
        let (columns, rows) = from_middle(at);
        columns.unsigned_abs() + rows.unsigned_abs()
    };
    let next = DIRECTIONS.map(|(columns, rows)| {
        let at = (SEEN / 2).cast_signed() + rows * VIEW[0].cast_signed() + columns;
        seen[at.unsigned_abs()]
    });
    let open = |direction: usize| match next[direction] {
        Terrain::Ground => true,
        Terrain::Tree => foresight,
        Terrain::Stone => foresight && pickaxe,
        _ => false,
    };
    let restless = word >> 29 == 0;
    let things = (0..SEEN).filter(|&at| !restless && useful(seen[at]));
    let toward = things.min_by_key(|&at| way(at)).and_then(|target| {
        let (columns, rows) = from_middle(target);
        let across = (columns != 0).then_some(if columns > 0 { 1 } else { 3 });
        let along = (rows != 0).then_some(if rows > 0 { 2 } else { 0 });
        let far = columns.unsigned_abs() >= rows.unsigned_abs();
        let ways = if far { [across, along] } else { [along, across] };
        ways.into_iter().flatten().find(|&turned| way(target) == 1 || open(turned))
    });
    let direction = toward.unwrap_or_else(|| {
        let ahead = (0..4).find(|turned| on(LINE_TURNED + turned)).unwrap_or(0);
        let first = if restless { (word >> 27 & 3) as usize } else { ahead };
        (0..4).map(|turn| (first + turn) % 4).find(|&turned| open(turned)).unwrap_or(first)
    });
    u16::try_from(direction).expect("there are four directions")
}
