//! The words ChaCha starts from, for 16 columns side by side.
//!
//! ```text
//! word   0..4 constants | 4..12 key | 12, 13 counter | 14, 15 stream          little endian
//! counter of column c = count << 28 | (c * blocks a column + block)
//! ```
//!
//! The key is the seed, then zeros. Between the blocks of a write only word 12 differs: it holds the 28 bits of the
//! block number. All others are made once, as a half block is drawn faster than they are; and so are three of the
//! four quarter rounds of the first round, which do not see word 12.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use crate::chip::crossbar::layout::HALF_COLUMNS;
use crate::num::draw::Place;

/// `expand 32-byte k`, little endian.
const CONSTANTS: [i32; 4] = [0x6170_7865, 0x3320_646e, 0x7962_2d32, 0x6b20_6574];

/// Where the random words of one write of one array come from.
#[derive(Debug, Clone)]
pub struct Draws {
    place: Place,
    rows: usize,
    /// As it starts, then after the quarter rounds of columns 1, 2 and 3, with words 0, 4, 8 and 12 as they start: side by
    /// side, so that assembly takes one address.
    states: [[i32; 16]; 2],
}

/// Word 12 of 16 columns: the first, and what it grows by from a column to the next.
#[derive(Debug, Clone, Copy)]
pub(super) struct Counter {
    pub(super) first: i32,
    pub(super) step: i32,
}

impl Counter {
    /// Both in one word: the first in its low half.
    #[cfg(target_arch = "x86_64")]
    pub(super) const fn joined(self) -> u64 {
        (self.first as u32 as u64) | (self.step as u32 as u64) << 32
    }
}

impl Draws {
    /// The words of an array of `rows` rows at a place.
    #[must_use]
    pub const fn new(place: Place, rows: usize) -> Self {
        let [seed, stream] = [halves(place.seed), halves(place.stream())];
        let count = halves(place.counter(0));
        let mut start = [0; 16];
        let mut word = 0;
        while word < 4 {
            start[word] = CONSTANTS[word];
            word += 1;
        }
        [start[4], start[5]] = seed;
        [start[12], start[13]] = count;
        [start[14], start[15]] = stream;
        Self { place, rows, states: [start, mixed(start)] }
    }

    /// Address of the words.
    #[must_use]
    pub const fn place(&self) -> &Place {
        &self.place
    }

    /// Rows of the logical array.
    #[must_use]
    pub const fn rows(&self) -> usize {
        self.rows
    }

    /// What ChaCha starts from, but for the block number in word 12.
    pub(super) const fn start(&self) -> &[i32; 16] {
        &self.states[0]
    }

    /// The state before the first round's quarter round of column 0, but for word 12.
    #[cfg(target_arch = "x86_64")]
    pub(super) const fn mixed(&self) -> &[i32; 16] {
        &self.states[1]
    }

    /// [`Draws::start`], then [`Draws::mixed`].
    #[cfg(target_arch = "x86_64")]
    pub(super) const fn states(&self) -> &[[i32; 16]; 2] {
        &self.states
    }

    /// Word 12 of the blocks that hold `rows_per_block` rows each.
    ///
    /// # Panics
    /// When a block lies beyond its 28 bits, so that word 12 would carry into word 13.
    pub(super) fn counter(&self, rows_per_block: usize, column: usize, block: usize) -> Counter {
        let step = self.rows.div_ceil(rows_per_block) as u64;
        let first = column as u64 * step + block as u64;
        let last = first + (HALF_COLUMNS as u64 - 1) * step;
        assert!(last < 1 << 28, "an array has fewer than 2^28 blocks of random words");
        Counter { first: self.states[0][12] | first as u32 as i32, step: step as u32 as i32 }
    }
}

/// The state after the quarter rounds of columns 1, 2 and 3.
const fn mixed(mut state: [i32; 16]) -> [i32; 16] {
    quarter(&mut state, 1);
    quarter(&mut state, 2);
    quarter(&mut state, 3);
    state
}

/// The quarter round of a column.
const fn quarter(s: &mut [i32; 16], column: usize) {
    let [a, b, c, d] = [column, column + 4, column + 8, column + 12];
    let mut turn = 0;
    while turn < 2 {
        let [left, right] = [[16, 12], [8, 7]][turn];
        s[a] = s[a].wrapping_add(s[b]);
        s[d] = (s[d] ^ s[a]).rotate_left(left);
        s[c] = s[c].wrapping_add(s[d]);
        s[b] = (s[b] ^ s[c]).rotate_left(right);
        turn += 1;
    }
}

/// Low and high 32 bits.
const fn halves(v: u64) -> [i32; 2] {
    [v as u32 as i32, (v >> 32) as i32]
}
