//! Random words, addressed by place and never by order.
//!
//! ```text
//! word = ChaCha8(key, stream, counter)             as `rand_chacha` has it
//! key     = run seed (u64, little endian), then 24 zero bytes
//! stream  = site << 56 | layer << 40 | pathway << 32 | sub
//! counter = count << 28 | block                    64-byte blocks
//! cell (row, column), words of w bytes, n = 64 / w:
//!     word `row % n` of block `column * ceil(rows / n) + row / n`
//! ```
//!
//! Cells are numbered on the *logical* array, so tiles, threads and back ends cannot move a draw.
//! Words are little endian. See docs/MODEL.md, 3.4.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use std::ops::Range;

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};

/// What a random word is for. A number is never reused.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub enum Site {
    /// Dither of stochastic rounding when a crossbar is written.
    WriteDither = 0,
    /// Levels before the first update.
    InitialLevels = 1,
    /// Order of the samples in an epoch.
    Shuffle = 2,
    /// What sets a cell apart from others of its device. Sub: 0 step, 1 asymmetry, 2 ceiling, 3 floor, 4 endurance, 5 leakage.
    Variation = 3,
    /// Noise of a device's pulse. Sub: the pulse of the write.
    PulseNoise = 4,
    /// What a conversion reads beside the current.
    ReadNoise = 5,
    /// Drift of levels with time.
    Drift = 6,
    /// Actions that a policy tries.
    Exploration = 7,
    /// How episodes of an environment begin and go on.
    Environment = 8,
    /// Levels that evolution strategies try.
    Perturbation = 9,
    /// Shifts that augment a training image.
    Augment = 10,
    /// Fixed random error routes and feedback signs.
    Route = 11,
    /// Pulse trains of rows.
    RowTrain = 12,
    /// Pulse trains of columns.
    ColumnTrain = 13,
    /// Rounding of the step that a pulse makes. Sub: the pulse of the write.
    StepRounding = 14,
    /// Which cells are stuck, and where.
    StuckCell = 16,
    /// What a load leaves beside a level.
    ProgrammingNoise = 17,
    /// What a write leaves beside a level. Sub: 0 a Gaussian, 1 rounding.
    WriteNoise = 18,
    /// Rounding of what a volatile cell forgets.
    Leakage = 19,
}

/// Bytes of one block.
pub const BLOCK_BYTES: usize = 64;

/// The address of an array of random words: everything but the block number.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Place {
    /// The run's seed.
    pub seed: u64,
    /// What the words are for.
    pub site: Site,
    /// Layer with cells, counted from 0 at the input.
    pub layer: u16,
    /// Pathway code.
    pub pathway: u8,
    /// Which array of several at this place; 0 unless named.
    pub sub: u32,
    /// Writes before this one, or the sample or step number.
    pub count: u64,
}

impl Place {
    /// A place that belongs to no layer.
    #[must_use]
    pub const fn global(seed: u64, site: Site, count: u64) -> Self {
        Self { seed, site, layer: 0, pathway: 0, sub: 0, count }
    }

    /// The ChaCha stream number.
    #[must_use]
    pub const fn stream(&self) -> u64 {
        (self.site as u64) << 56
            | (self.layer as u64) << 40
            | (self.pathway as u64) << 32
            | self.sub as u64
    }

    /// The ChaCha block counter of `block`.
    ///
    /// # Panics
    /// When the address does not fit its field: `block < 2^28`, `count < 2^36`.
    #[must_use]
    pub const fn counter(&self, block: u64) -> u64 {
        assert!(block < 1 << 28, "an array has fewer than 2^28 blocks of random words");
        assert!(self.count < 1 << 36, "a place is drawn from fewer than 2^36 times");
        self.count << 28 | block
    }

    /// The ChaCha key: the seed, then zeros.
    #[must_use]
    pub fn key(&self) -> [u8; 32] {
        let mut key = [0; 32];
        key[..8].copy_from_slice(&self.seed.to_le_bytes());
        key
    }

    /// A generator at the first word of `block`.
    fn rng(&self, block: u64) -> ChaCha8Rng {
        let mut rng = ChaCha8Rng::from_seed(self.key());
        rng.set_stream(self.stream());
        rng.set_word_pos(u128::from(self.counter(block)) << 4);
        rng
    }

    /// Consecutive blocks, from `block` on.
    pub fn fill(&self, block: u64, bytes: &mut [u8]) {
        self.rng(block).fill_bytes(bytes);
    }

    /// The 8-bit words of rows `64 * group ..` of a column, as many as `words` holds (at most 64).
    pub fn bytes(&self, rows: usize, column: usize, group: usize, words: &mut [u8]) {
        debug_assert!(words.len() <= BLOCK_BYTES);
        self.fill(block(rows, column, group, BLOCK_BYTES), words);
    }

    /// The 16-bit words of rows `32 * group ..` of a column.
    #[must_use]
    pub fn halves(&self, rows: usize, column: usize, group: usize) -> [u16; 32] {
        let mut bytes = [0; BLOCK_BYTES];
        self.fill(block(rows, column, group, BLOCK_BYTES / 2), &mut bytes);
        std::array::from_fn(|i| u16::from_le_bytes([bytes[2 * i], bytes[2 * i + 1]]))
    }

    /// The 16-bit word of one cell.
    #[must_use]
    pub fn half(&self, rows: usize, row: usize, column: usize) -> u16 {
        self.halves(rows, column, row / 32)[row % 32]
    }

    /// The 32-bit word of one cell.
    #[must_use]
    pub fn whole(&self, rows: usize, row: usize, column: usize) -> u32 {
        let mut bytes = [0; BLOCK_BYTES];
        self.fill(block(rows, column, row / 16, BLOCK_BYTES / 4), &mut bytes);
        let at = 4 * (row % 16);
        u32::from_le_bytes([bytes[at], bytes[at + 1], bytes[at + 2], bytes[at + 3]])
    }

    /// The words of some whole columns, `width` bytes each: whole blocks, so that the words of a column lie one after the other
    /// and what lies behind them is unused. `bytes` holds as many blocks as the columns have.
    ///
    /// # Panics
    /// When `bytes` is not that long.
    pub fn columns(&self, rows: usize, columns: Range<usize>, width: usize, bytes: &mut [u8]) {
        let blocks = rows.div_ceil(BLOCK_BYTES / width);
        assert_eq!(
            bytes.len(),
            blocks * columns.len() * BLOCK_BYTES,
            "whole blocks of the columns"
        );
        self.fill((columns.start * blocks) as u64, bytes);
    }

    /// The 32-bit words of rows `16 * group ..` of a column.
    #[must_use]
    pub fn quads(&self, rows: usize, column: usize, group: usize) -> [u32; 16] {
        let mut bytes = [0; BLOCK_BYTES];
        self.fill(block(rows, column, group, BLOCK_BYTES / 4), &mut bytes);
        let mut words = [0; 16];
        for (word, of) in words.iter_mut().zip(bytes.as_chunks::<4>().0) {
            *word = u32::from_le_bytes(*of);
        }
        words
    }

    /// 32-bit words one after the other, from block 0.
    pub fn words(&self) -> impl Iterator<Item = u32> + use<> {
        let mut rng = self.rng(0);
        std::iter::from_fn(move || Some(rng.next_u32()))
    }
}

/// Number of the block that holds group `group` of `words_per_block` rows in `column`.
fn block(rows: usize, column: usize, group: usize, words_per_block: usize) -> u64 {
    (column * rows.div_ceil(words_per_block) + group) as u64
}

/// A number below `bound` from one 32-bit word: `(word * bound) >> 32`.
#[inline]
#[must_use]
pub const fn below(word: u32, bound: u32) -> u32 {
    ((word as u64 * bound as u64) >> 32) as u32
}

/// The order of `samples` samples in epoch `epoch`: Fisher and Yates, from the end, one word a swap.
#[must_use]
pub fn shuffled(seed: u64, epoch: u64, samples: u32) -> Vec<u32> {
    let mut order: Vec<u32> = (0..samples).collect();
    let mut words = Place::global(seed, Site::Shuffle, epoch).words();
    for i in (1..samples).rev() {
        let word = words.next().expect("the stream has no end");
        order.swap(i as usize, below(word, i + 1) as usize);
    }
    order
}

#[cfg(test)]
mod tests {
    use super::*;

    const PLACE: Place = Place {
        seed: 0x0123_4567_89ab_cdef,
        site: Site::WriteDither,
        layer: 3,
        pathway: 2,
        sub: 1,
        count: 5,
    };

    /// ChaCha8 written from RFC 8439's quarter round, with a 64-bit counter and stream.
    fn chacha8(key: [u8; 32], stream: u64, counter: u64) -> [u8; 64] {
        let word = |b: &[u8]| u32::from_le_bytes([b[0], b[1], b[2], b[3]]);
        let mut s = [0u32; 16];
        s[..4].copy_from_slice(&[0x6170_7865, 0x3320_646e, 0x7962_2d32, 0x6b20_6574]);
        for (i, chunk) in key.chunks(4).enumerate() {
            s[4 + i] = word(chunk);
        }
        s[12] = counter as u32;
        s[13] = (counter >> 32) as u32;
        s[14] = stream as u32;
        s[15] = (stream >> 32) as u32;
        let start = s;
        let mut quarter = |a: usize, b: usize, c: usize, d: usize| {
            for (x, y, z, r) in [(a, b, d, 16), (c, d, b, 12), (a, b, d, 8), (c, d, b, 7)] {
                s[x] = s[x].wrapping_add(s[y]);
                s[z] = (s[z] ^ s[x]).rotate_left(r);
            }
        };
        for _ in 0..4 {
            for i in 0..4 {
                quarter(i, 4 + i, 8 + i, 12 + i);
            }
            for i in 0..4 {
                quarter(i, 4 + (i + 1) % 4, 8 + (i + 2) % 4, 12 + (i + 3) % 4);
            }
        }
        let mut out = [0; 64];
        for i in 0..16 {
            let w = s[i].wrapping_add(start[i]);
            out[4 * i..4 * i + 4].copy_from_slice(&w.to_le_bytes());
        }
        out
    }

    #[test]
    fn a_place_is_chacha8_at_its_stream_and_counter() {
        let mut got = [0; 128];
        PLACE.fill(7, &mut got);
        let stream = 3 << 40 | 2 << 32 | 1;
        assert_eq!(PLACE.stream(), stream);
        assert_eq!(got[..64], chacha8(PLACE.key(), stream, 5 << 28 | 7));
        assert_eq!(got[64..], chacha8(PLACE.key(), stream, 5 << 28 | 8));
    }

    #[test]
    fn an_address_has_a_field_of_its_own_for_each_of_its_parts() {
        let place =
            Place { site: Site::Route, layer: 0xabcd, pathway: 0x5e, sub: 0x1234_5678, ..PLACE };
        assert_eq!(place.stream(), 0x0bab_cd5e_1234_5678);
        assert_eq!(place.counter(0x0fff_ffff), 5 << 28 | 0x0fff_ffff);
        assert_eq!(place.key()[..8], [0xef, 0xcd, 0xab, 0x89, 0x67, 0x45, 0x23, 0x01]);
        assert_eq!(place.key()[8..], [0; 24]);
    }

    #[test]
    fn cells_are_numbered_down_a_column_of_the_logical_array() {
        let mut all = vec![0; 64 * 6];
        PLACE.fill(0, &mut all);
        // 70 rows: two blocks of bytes a column, three of halves
        let mut bytes = [0; 6];
        PLACE.bytes(70, 2, 1, &mut bytes);
        assert_eq!(bytes, all[5 * 64..5 * 64 + 6]);
        let at = 64 * (3 + 2) + 2 * 5;
        assert_eq!(PLACE.half(70, 69, 1), u16::from_le_bytes([all[at], all[at + 1]]));
        // five blocks of whole words: row 37 is word 5 of the third of column 1
        let mut wide = vec![0; 64 * 10];
        PLACE.columns(70, 0..2, 4, &mut wide);
        let at = 64 * (5 + 2) + 4 * 5;
        let word = u32::from_le_bytes([wide[at], wide[at + 1], wide[at + 2], wide[at + 3]]);
        assert_eq!(PLACE.whole(70, 37, 1), word);
        let mut second = vec![0; 64 * 5];
        PLACE.columns(70, 1..2, 4, &mut second);
        assert_eq!(second, wide[64 * 5..]);
        // and of 32-bit words five: row 69 is the sixth of the fifth, here of column 0
        let quad = u32::from_le_bytes(all[4 * 64 + 4 * 5..][..4].try_into().unwrap());
        assert_eq!(PLACE.quads(70, 0, 4)[5], quad);
    }

    #[test]
    fn a_shuffle_is_a_permutation_and_differs_by_epoch() {
        let a = shuffled(1, 0, 1000);
        let mut sorted = a.clone();
        sorted.sort_unstable();
        assert!(sorted.iter().copied().eq(0..1000));
        assert_ne!(a, shuffled(1, 1, 1000));
        assert_eq!((shuffled(1, 0, 0), shuffled(1, 0, 1)), (vec![], vec![0]));
    }

    #[test]
    fn a_shuffle_swaps_from_the_end_one_word_a_swap() {
        let mut words = Place::global(7, Site::Shuffle, 3).words();
        let mut order = [0, 1, 2, 3];
        for (i, choices) in [(3, 4), (2, 3), (1, 2)] {
            order.swap(i, below(words.next().unwrap(), choices) as usize);
        }
        assert_eq!(shuffled(7, 3, 4), order);
        assert_eq!([0, 1 << 31, u32::MAX].map(|word| below(word, 6)), [0, 3, 5]);
    }

    #[test]
    #[should_panic(expected = "fewer than 2^28 blocks")]
    fn a_block_beyond_its_field_is_refused() {
        let _ = PLACE.counter(1 << 28);
    }
}
