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
use super::kernel::{
    Draws, Half, Kernel, MEAN_BITS, SignLaw, WriteCounts, WriteLaw, is_driven, joined,
};
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
    /// Whether centred sums may be beyond 32 bits: those of more than [`SHORT_READS`] reads.
    pub long: bool,
    /// Products of a read: 2 where drives have a sign, the second with its gate turned round.
    pub phases: usize,
}

/// So many reads have centred sums of 32 bits, whatever they hold: 4096 x 4080 x 127 < 2^31.
pub const SHORT_READS: usize = 4096;

/// Sums of half blocks that 32 bits do not hold, with their places. Where they belong in the list of all, there is 0.
pub type LongSums = Vec<(usize, Box<Half<i64>>)>;

/// What is asked for by sums that were kept.
#[derive(Debug)]
pub enum Asks<'a> {
    /// A pulse towards each that is loud, with a chance. Words are of 16 bits, whatever the chip rounds with. Beside it what is
    /// loud among sums that 32 bits do not hold.
    Signs(SignLaw, u64),
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
            Self::Signs(..) => DitherBits::Sixteen,
            _ => rounding,
        }
    }

    /// What the sums of the half block at a place ask to be rounded, in 64 bits: a mantissa may take them beyond 32.
    fn requests(&mut self, mut requests: Half<i64>, at: usize) -> Half<i64> {
        match self {
            Self::Signs(..) | Self::Nothing | Self::Narrow | Self::Sums => {}
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
    ) -> (u128, LongSums) {
        let blocks = self.layout.blocks();
        let (mut squares, mut long) = (0, LongSums::new());
        if request.stride == 0 {
            sums.fill(0);
            return (squares, long);
        }
        for (half, gates) in gates.chunks_exact(HALF_COLUMNS * request.stride).enumerate() {
            let live = is_driven(gates);
            let centred = live && form.means.is_some();
            let totals = match form.phases {
                _ if !centred => [0; _],
                1 => kernel.gate_totals(gates),
                _ => totals_above(gates),
            };
            for (block, turned) in request.turned.iter().enumerate() {
                let at = place(half, block, blocks);
                let sums = half_of(sums, at);
                match turned {
                    Some(turned) if live => kernel.accumulate(turned, request.stride, gates, sums),
                    _ => sums.fill(0),
                }
                if let (Some(means), true) = (form.means, live) {
                    let means = means[block * BLOCK_ROWS..].first_chunk().expect("whole blocks");
                    if !form.long || stays_short(kernel, sums, &totals) {
                        kernel.centre(sums, means, &totals);
                    } else if let Some(beyond) = centre_long(sums, means, &totals) {
                        let each = beyond.iter().map(|sum| u128::from(sum.unsigned_abs()).pow(2));
                        squares += if form.squares { each.sum() } else { 0 };
                        sums.fill(0);
                        long.push((at, beyond));
                    }
                }
                if form.squares && live {
                    let more = kernel.squares(sums, form.means.is_some());
                    squares += joined(more);
                }
            }
        }
        (squares, long)
    }

    /// Programs sums that were kept.
    pub fn write_kept(
        &mut self,
        kernel: &Kernel,
        request: &WriteRequest<'_>,
        (sums, long): (&[i32], &LongSums),
        mut asks: Asks<'_>,
    ) -> Written {
        let Range { start, end } = self.panels();
        let columns = start * PANEL_COLUMNS..end * PANEL_COLUMNS;
        let mut collector = Collector::new(request.collect, self.layout, columns.clone());
        let mut counts = WriteCounts::default();
        if matches!(asks, Asks::Nothing | Asks::Signs(SignLaw { chance: 0, .. }, _)) {
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
                let mut sums: &Half<i32> = sums[at..].first_chunk().expect("a half block");
                let beyond = long.iter().find(|(place, _)| *place == at).map(|(_, sums)| &**sums);
                let held = beyond.map(|beyond| held(beyond, &asks));
                if let Some(held) = &held {
                    sums = held;
                }
                let mut cells = self.half(half, block);
                cells.pulses = collector.half(kernel, (column, block));
                let groups = if let Asks::Signs(law, _) = asks {
                    // what is held is loud, or 0
                    let least = if beyond.is_some() { 1 } else { law.least };
                    let law = SignLaw { least, ..law };
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
                } else if matches!(asks, Asks::Narrow)
                    || (matches!(asks, Asks::Sums)
                        && beyond.is_none()
                        && fits(kernel, sums, &request))
                {
                    let groups = kernel.may_move(sums, &request.write, bits.get());
                    if groups != 0 {
                        let law = WriteLaw { groups, ..request.write };
                        let words = words.draw(kernel, column, block);
                        counts += kernel.program(cells, sums, &law, words);
                    }
                    groups
                } else {
                    let requests =
                        asks.requests(beyond.map_or_else(|| sums.map(i64::from), |b| *b), at);
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

/// Sums of the gates of 16 columns, packed as an update takes them, of which every second is turned round: of the others.
fn totals_above(gates: &[i8]) -> [i32; HALF_COLUMNS] {
    let mut totals = [0; HALF_COLUMNS];
    for four in gates.as_chunks::<{ 4 * HALF_COLUMNS }>().0 {
        for (total, gates) in totals.iter_mut().zip(four.as_chunks::<4>().0) {
            *total += i32::from(gates[0]) + i32::from(gates[2]);
        }
    }
    totals
}

/// Whether centred sums are below 2^31 for certain: sums below 2^26 and gates that add up to little.
fn stays_short(kernel: &Kernel, sums: &Half<i32>, totals: &[i32; HALF_COLUMNS]) -> bool {
    let most = totals.iter().map(|total| total.unsigned_abs()).max().unwrap_or(0);
    most <= TOTAL_SHORT && kernel.loud(sums, SUM_SHORT) == 0
}

/// Sums and totals of gates below which nothing centred goes beyond 32 bits: 16 x 2^26 + 4080 x 2^18 < 2^31.
const SUM_SHORT: u32 = 1 << 26;
const TOTAL_SHORT: u32 = 1 << 18;

/// Takes means off in 64 bits; gives what 32 do not hold.
fn centre_long(
    sums: &mut Half<i32>,
    means: &[i32; BLOCK_ROWS],
    totals: &[i32; HALF_COLUMNS],
) -> Option<Box<Half<i64>>> {
    let mut centred = Box::new([0i64; _]);
    let rows = sums.as_chunks::<HALF_COLUMNS>().0.iter().zip(means);
    for ((sums, &mean), out) in rows.zip(centred.as_chunks_mut::<HALF_COLUMNS>().0) {
        for ((out, &sum), &total) in out.iter_mut().zip(sums).zip(totals) {
            *out = (i64::from(sum) << MEAN_BITS) - i64::from(mean) * i64::from(total);
        }
    }
    // the least number of 32 bits has no opposite
    let short = -i64::from(i32::MAX)..=i64::from(i32::MAX);
    if centred.iter().any(|sum| !short.contains(sum)) {
        return Some(centred);
    }
    for (sum, &centred) in sums.iter_mut().zip(centred.iter()) {
        *sum = i32::try_from(centred).expect("just looked at");
    }
    None
}

/// What stands for sums beyond 32 bits where only their sign, and whether they are loud, is asked for.
fn held(beyond: &Half<i64>, asks: &Asks<'_>) -> Half<i32> {
    let least = if let Asks::Signs(_, least) = asks { *least } else { 0 };
    beyond.map(|sum| match sum.unsigned_abs() >= least {
        true => i32::try_from(sum.signum()).expect("-1..=1") * i32::MAX,
        false => 0,
    })
}

/// Whether sums times their mantissa fit 32 bits, and so does their shift.
fn fits(kernel: &Kernel, sums: &Half<i32>, request: &WriteRequest<'_>) -> bool {
    request.write.shift <= 31 && kernel.loud(sums, 1 << 27) == 0
}

/// Place of a half block of a strip of panels.
const fn place(half: usize, block: usize, blocks: usize) -> usize {
    ((half / 2 * blocks + block) * 2 + half % 2) * HALF_CELLS
}

fn half_of(sums: &mut [i32], at: usize) -> &mut Half<i32> {
    (&mut sums[at..at + HALF_CELLS]).try_into().expect("a half block has 1024 sums")
}
