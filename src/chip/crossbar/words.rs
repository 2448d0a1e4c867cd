//! Random words of a write, half block by half block.
//!
//! ```text
//! per cell    a word of 8 or 16 bits of the cell's own
//! separable   word of the row, XOR word of the column:  rows at sub 1, columns at sub 2, each numbered as one column
//! ```
//!
//! See docs/MODEL.md, 3.4.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use std::ops::{BitXor, Range};

use super::kernel::{Dither, Draws, Half, Kernel};
use super::layout::{BLOCK_ROWS, HALF_CELLS, HALF_COLUMNS};
use super::write::WriteRequest;
use crate::chip::hardware::{DitherBits, DitherPattern};
use crate::num::draw::Place;

/// Where the words of some columns come from, and scratch for those of a half block.
#[repr(align(64))]
pub(super) struct Words {
    pub(super) bytes: Half<u8>,
    halves: Half<u16>,
    pub(super) draws: Draws,
    source: Source,
}

enum Source {
    /// Half-up.
    Nowhere,
    Bytes,
    Halves,
    SeparableBytes(Separable<u8>),
    SeparableHalves(Separable<u16>),
}

/// Words of all rows, and of some columns.
struct Separable<T> {
    /// Whole blocks.
    down: Vec<T>,
    first: usize,
    /// Four times each, as four rows of a column lie side by side.
    across: Vec<T>,
}

impl Words {
    /// `columns` are whole half panels.
    pub(super) fn new(request: &WriteRequest<'_>, draws: Draws, columns: Range<usize>) -> Self {
        let (bits, place) = (request.dither_bits, request.place);
        let lines = |sub, first, count| lines(&Place { sub, ..place }, bits, first, count);
        let separable = || {
            let down = lines(1, 0, draws.rows().div_ceil(BLOCK_ROWS) * BLOCK_ROWS);
            let across = lines(2, columns.start, columns.len());
            Separable { down, first: columns.start, across }
        };
        let source = match (bits, request.dither_pattern) {
            (DitherBits::Zero, _) => Source::Nowhere,
            (DitherBits::Eight, DitherPattern::PerCell) => Source::Bytes,
            (DitherBits::Sixteen, DitherPattern::PerCell) => Source::Halves,
            (DitherBits::Eight, DitherPattern::Separable) => {
                Source::SeparableBytes(separable().map(|word| word as u8))
            }
            (DitherBits::Sixteen, DitherPattern::Separable) => {
                Source::SeparableHalves(separable().map(|word| word))
            }
        };
        Self { bytes: [0; HALF_CELLS], halves: [0; HALF_CELLS], draws, source }
    }

    /// The words of the half block at a column and a block of rows.
    pub(super) fn draw(&mut self, kernel: &Kernel, column: usize, block: usize) -> Dither<'_> {
        match &self.source {
            Source::Nowhere => return Dither::Nearest,
            Source::Bytes => kernel.dither(&self.draws, column, block, &mut self.bytes),
            Source::Halves => kernel.dither_words(&self.draws, column, block, &mut self.halves),
            Source::SeparableBytes(lines) => lines.cross(column, block, &mut self.bytes),
            Source::SeparableHalves(lines) => lines.cross(column, block, &mut self.halves),
        }
        match self.source {
            Source::Halves | Source::SeparableHalves(_) => Dither::Word(&self.halves),
            _ => Dither::Byte(&self.bytes),
        }
    }

    /// The same, of words of 16 bits; nothing of others.
    pub(super) fn draw_halves(
        &mut self,
        kernel: &Kernel,
        column: usize,
        block: usize,
    ) -> Option<&Half<u16>> {
        match self.draw(kernel, column, block) {
            Dither::Word(words) => Some(words),
            Dither::Nearest | Dither::Byte(_) => None,
        }
    }
}

impl Separable<u16> {
    /// The words as they are crossed.
    fn map<T: Copy>(self, word: impl Fn(u16) -> T) -> Separable<T> {
        let across = self.across.iter().flat_map(|&across| [word(across); 4]).collect();
        Separable { down: self.down.into_iter().map(&word).collect(), first: self.first, across }
    }
}

impl<T: Copy + BitXor<Output = T>> Separable<T> {
    /// Each row's word with each column's.
    fn cross(&self, column: usize, block: usize, words: &mut Half<T>) {
        let across: &[T; 4 * HALF_COLUMNS] =
            self.across[4 * (column - self.first)..].first_chunk().expect("16 columns");
        let down = self.down[block * BLOCK_ROWS..].as_chunks::<4>().0;
        for (words, down) in words.as_chunks_mut::<64>().0.iter_mut().zip(down) {
            let down = [*down; HALF_COLUMNS];
            for (word, (down, across)) in
                words.iter_mut().zip(down.as_flattened().iter().zip(across))
            {
                *word = *down ^ *across;
            }
        }
    }
}

/// Words `first ..` of an array of one column, 8 or 16 bits wide.
fn lines(place: &Place, bits: DitherBits, first: usize, count: usize) -> Vec<u16> {
    // an array of one column has its blocks one after the other, however many rows it has
    let wide = bits == DitherBits::Sixteen;
    let in_block = if wide { 32 } else { 64 };
    let mut bytes = vec![0; (first % in_block + count).div_ceil(in_block) * 64];
    place.fill((first / in_block) as u64, &mut bytes);
    if wide {
        let words = bytes[first % in_block * 2..].as_chunks::<2>().0;
        words.iter().take(count).map(|word| u16::from_le_bytes(*word)).collect()
    } else {
        bytes[first % in_block..].iter().take(count).map(|&byte| u16::from(byte)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::chip::crossbar::layout::in_half;
    use crate::num::draw::Site;

    #[test]
    fn a_separable_word_is_that_of_its_row_with_that_of_its_column() {
        let place = Place::global(5, Site::WriteDither, 9);
        for bits in [DitherBits::Eight, DitherBits::Sixteen] {
            let (rows, columns) = (130, 64..112);
            let down = lines(&Place { sub: 1, ..place }, bits, 0, 192);
            let across = lines(&Place { sub: 2, ..place }, bits, 0, columns.end);
            // an array of one column has its words in order
            let word = |sub, line: usize| match bits {
                DitherBits::Sixteen => Place { sub, ..place }.half(usize::MAX, line, 0),
                _ => {
                    let mut bytes = [0; 64];
                    Place { sub, ..place }.bytes(usize::MAX, 0, line / 64, &mut bytes);
                    bytes[line % 64].into()
                }
            };
            assert!((0..rows).all(|row| down[row] == word(1, row)));
            assert!((0..columns.end).all(|column| across[column] == word(2, column)));
            let of = lines(&Place { sub: 2, ..place }, bits, columns.start, columns.len());
            assert_eq!(of, across[columns.clone()], "columns that begin later");
            let lines = Separable { down: down.clone(), first: columns.start, across: of };
            let lines = lines.map(|word| word);
            for (column, block) in [(64, 0), (80, 1), (96, 2)] {
                let mut words = [0; HALF_CELLS];
                lines.cross(column, block, &mut words);
                for (row, c) in (0..64).flat_map(|row| (0..16).map(move |c| (row, c))) {
                    let want = down[block * 64 + row] ^ across[column + c];
                    assert_eq!(words[in_half(row, c)], want, "{row} {c}");
                }
            }
        }
    }
}
