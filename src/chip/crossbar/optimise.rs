//! Writing in two passes, for optimisers that look at sums before they ask: sums are formed and kept, then programmed.
//!
//! ```text
//! sums   [half block, in the order of levels][64 rows][16 columns]       i32, of the panels of a strip
//! ```
//!
//! What is kept is 0 where rows and columns do not exist. See docs/MODEL.md, 3.10.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use std::ops::Range;

mod adam;
mod momentum;

pub use adam::Adam;
pub use momentum::Momentum;

use super::StripMut;
use super::kernel::{Draws, Half, Kernel, SignLaw, WriteCounts, WriteLaw, is_driven, joined};
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
#[derive(Debug)]
pub enum Asks<'a> {
    /// A pulse towards each that is loud, with a chance. Words are of 16 bits, whatever the chip rounds with.
    Signs(SignLaw),
    /// Nothing.
    Nothing,
    /// As many pulses as they are rounded to. They may be 16 times as large as those of a batch.
    Sums,
    /// The same, of sums that are not.
    Narrow,
    /// What comes of accumulators of the cells, which lie as sums do.
    Momentum(Momentum, &'a mut [i64]),
    /// What comes of two means of the cells, which lie as sums do.
    Adam(Adam, [&'a mut [i64]; 2]),
}

impl Asks<'_> {
    /// Bits of a word.
    const fn bits(&self, rounding: DitherBits) -> DitherBits {
        match self {
            Self::Signs(_) => DitherBits::Sixteen,
            _ => rounding,
        }
    }

    /// What the sums of the half block at a place ask to be rounded, in 64 bits: a mantissa may take them beyond 32.
    fn requests(&mut self, sums: &Half<i32>, at: usize) -> Half<i64> {
        let mut requests = sums.map(i64::from);
        match self {
            Self::Signs(_) | Self::Nothing | Self::Narrow | Self::Sums => {}
            Self::Momentum(momentum, moments) => {
                for (request, moment) in requests.iter_mut().zip(&mut moments[at..]) {
                    *moment = momentum.after(*moment, *request);
                    *request = *moment;
                }
            }
            Self::Adam(adam, [first, second]) => {
                let means = first[at..].iter_mut().zip(&mut second[at..]);
                for (request, (first, second)) in requests.iter_mut().zip(means) {
                    *request = adam.request([first, second], *request);
                }
            }
        }
        requests
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
    ) -> u128 {
        let blocks = self.layout.blocks();
        let mut squares = 0;
        if request.stride == 0 {
            sums.fill(0);
            return squares;
        }
        for (half, gates) in gates.chunks_exact(HALF_COLUMNS * request.stride).enumerate() {
            let live = is_driven(gates);
            let centred = live && form.means.is_some();
            let totals = if centred { kernel.gate_totals(gates) } else { [0; _] };
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
                    let more = kernel.squares(sums, form.means.is_some());
                    squares += joined(more);
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
        mut asks: Asks<'_>,
    ) -> Written {
        let Range { start, end } = self.panels();
        let columns = start * PANEL_COLUMNS..end * PANEL_COLUMNS;
        let mut collector = Collector::new(request.collect, self.layout, columns.clone());
        let mut counts = WriteCounts::default();
        if matches!(asks, Asks::Nothing | Asks::Signs(SignLaw { chance: 0, .. })) {
            return Written { counts, collected: collector.finish(kernel) };
        }
        let bits = asks.bits(request.dither_bits);
        let request = WriteRequest { dither_bits: bits, ..*request };
        let draws = Draws::new(request.place, self.layout.rows);
        let mut words = Words::new(&request, draws, columns.clone());
        let blocks = self.layout.blocks();
        for block in 0..blocks {
            for half in 0..columns.len() / HALF_COLUMNS {
                let (at, column) =
                    (place(half, block, blocks), columns.start + half * HALF_COLUMNS);
                let sums = sums[at..].first_chunk().expect("a half block");
                let mut cells = self.half(half, block);
                cells.pulses = collector.half(kernel, (column, block));
                let groups = if let Asks::Signs(law) = asks {
                    let groups = kernel.loud(sums, law.least);
                    if groups != 0 {
                        let law = SignLaw { groups, ..law };
                        let words = if law.is_certain() {
                            None
                        } else {
                            words.draw_halves(kernel, column, block)
                        };
                        counts +=
                            kernel.program_signs(cells, sums, &law, words, request.write.ends());
                    }
                    groups
                } else if let Asks::Narrow = asks {
                    let groups = kernel.may_move(sums, &request.write, bits.get());
                    if groups != 0 {
                        let law = WriteLaw { groups, ..request.write };
                        let words = words.draw(kernel, column, block);
                        counts += kernel.program(cells, sums, &law, words);
                    }
                    groups
                } else {
                    let requests = asks.requests(sums, at);
                    let groups = kernel.may_move(&requests, &request.write, bits.get());
                    if groups != 0 {
                        let law = WriteLaw { groups, ..request.write };
                        let words = words.draw(kernel, column, block);
                        counts += kernel.program(cells, &requests, &law, words);
                    }
                    groups
                };
                if groups != 0 {
                    collector.take(kernel, (column, block), groups);
                }
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
