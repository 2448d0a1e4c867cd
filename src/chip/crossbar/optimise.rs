//! Writing in two passes, for optimisers that look at sums before they ask: sums are formed and kept, then programmed.
//!
//! ```text
//! sums   [half block, in the order of levels][64 rows][16 columns]       i32, of the panels of a strip
//! ```
//!
//! What is kept is 0 where rows and columns do not exist. See docs/MODEL.md, 3.10.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use std::ops::Range;

use super::StripMut;
use super::kernel::{Draws, Half, Kernel, SignLaw, Squares, WriteCounts, WriteLaw, is_driven};
use super::layout::{BLOCK_ROWS, HALF_CELLS, HALF_COLUMNS, PANEL_COLUMNS};
use super::pulses::Collector;
use super::words::Words;
use super::write::{WriteRequest, Written};
use crate::chip::hardware::DitherBits;

/// What is formed of the products of a write.
#[derive(Debug, Clone, Copy)]
pub struct Form<'a> {
    /// Mean drives of the rows, padded, of centred updates.
    pub means: Option<&'a [i32]>,
    /// Whether the squares of the sums are wanted.
    pub squares: bool,
}

/// What is asked for by sums that were kept.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Asks {
    /// A pulse towards each that is loud, with a chance. Words are of 16 bits, whatever the chip rounds with.
    Signs(SignLaw),
    /// As many pulses as they are rounded to.
    Rounded,
}

impl Asks {
    /// Bits of a word.
    const fn bits(self, rounding: DitherBits) -> DitherBits {
        match self {
            Self::Signs(_) => DitherBits::Sixteen,
            Self::Rounded => rounding,
        }
    }
}

impl StripMut<'_> {
    /// Forms the sums of these panels, and the sum of their squares if it is wanted. `gates` are those of a
    /// [`StripMut::write`].
    pub fn form(
        &self,
        kernel: &Kernel,
        request: &WriteRequest<'_>,
        gates: &[i8],
        form: Form<'_>,
        sums: &mut [i32],
    ) -> Squares {
        let blocks = self.layout.blocks();
        let mut squares = [0; 2];
        if request.stride == 0 {
            sums.fill(0);
            return squares;
        }
        for (half, gates) in gates.chunks_exact(HALF_COLUMNS * request.stride).enumerate() {
            let live = is_driven(gates);
            let totals = if live && form.means.is_some() { totals(gates) } else { [0; _] };
            for (block, turned) in request.turned.iter().enumerate() {
                let sums = half_of(sums, place(half, block, blocks));
                match turned {
                    Some(turned) if live => kernel.accumulate(turned, request.stride, gates, sums),
                    _ => sums.fill(0),
                }
                if let (Some(means), true) = (form.means, live) {
                    let means = means[block * BLOCK_ROWS..].first_chunk().expect("whole blocks");
                    kernel.centre(sums, means, &totals);
                }
                if form.squares && live {
                    let more = kernel.squares(sums);
                    squares.iter_mut().zip(more).for_each(|(sum, more)| *sum += more);
                }
            }
        }
        squares
    }

    /// Programs sums that were kept.
    pub fn write_kept(
        &mut self,
        kernel: &Kernel,
        request: &WriteRequest<'_>,
        sums: &[i32],
        asks: Asks,
    ) -> Written {
        let Range { start, end } = self.panels();
        let columns = start * PANEL_COLUMNS..end * PANEL_COLUMNS;
        let mut collector = Collector::new(request.collect, self.layout, columns.clone());
        let mut counts = WriteCounts::default();
        let silent = matches!(asks, Asks::Signs(SignLaw { chance: 0, .. }));
        if silent {
            return Written { counts, collected: collector.finish(kernel) };
        }
        let request = WriteRequest { dither_bits: asks.bits(request.dither_bits), ..*request };
        let draws = Draws::new(request.place, self.layout.rows);
        let mut words = Words::new(&request, draws, columns.clone());
        let blocks = self.layout.blocks();
        for block in 0..blocks {
            for half in 0..columns.len() / HALF_COLUMNS {
                let column = columns.start + half * HALF_COLUMNS;
                let sums = sums[place(half, block, blocks)..].first_chunk().expect("a half block");
                let groups = match asks {
                    Asks::Signs(law) => kernel.loud(sums, law.least),
                    // a mantissa may take them beyond 32 bits
                    Asks::Rounded => {
                        let wide = sums.map(i64::from);
                        kernel.may_move(&wide, &request.write, request.dither_bits.get())
                    }
                };
                if groups == 0 {
                    continue;
                }
                let mut cells = self.half(half, block);
                cells.pulses = collector.half(kernel, (column, block));
                counts += match asks {
                    Asks::Signs(law) => {
                        let words = if law.is_certain() {
                            None
                        } else {
                            words.draw_halves(kernel, column, block)
                        };
                        let law = SignLaw { groups, ..law };
                        kernel.program_signs(cells, sums, &law, words, request.write.ends())
                    }
                    Asks::Rounded => {
                        let law = WriteLaw { groups, ..request.write };
                        let wide = sums.map(i64::from);
                        kernel.program(cells, &wide, &law, words.draw(kernel, column, block))
                    }
                };
                collector.take(kernel, (column, block), groups);
            }
        }
        Written { counts, collected: collector.finish(kernel) }
    }
}

/// Place of a half block of a strip of panels.
const fn place(half: usize, block: usize, blocks: usize) -> usize {
    ((half / 2 * blocks + block) * 2 + half % 2) * HALF_CELLS
}

fn half_of(sums: &mut [i32], at: usize) -> &mut Half<i32> {
    (&mut sums[at..at + HALF_CELLS]).try_into().expect("a half block has 1024 sums")
}

/// Sums of the gates of the columns of a half block.
fn totals(gates: &[i8]) -> [i32; HALF_COLUMNS] {
    let mut totals = [0; HALF_COLUMNS];
    for quad in gates.as_chunks::<{ 4 * HALF_COLUMNS }>().0 {
        for (total, gates) in totals.iter_mut().zip(quad.as_chunks::<4>().0) {
            *total += gates.iter().map(|&gate| i32::from(gate)).sum::<i32>();
        }
    }
    totals
}
