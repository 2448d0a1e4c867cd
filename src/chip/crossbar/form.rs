//! What a write is made of: sums of the half blocks of a strip, formed of drives and gates, block of rows by block of rows.
//!
//! ```text
//! short     few reads, turned once for all strips            [block][64 rows][stride]
//! long      the windows of a convolution, some at a time     [block][read][64 rows]
//! ```
//!
//! Both give the same sums. See docs/MODEL.md, 3 and 3.10.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use std::ops::Range;

use aligned_vec::{AVec, avec};

use super::StripMut;
use super::kernel::{Half, Kernel, MEAN_BITS, ReadsScratch, Windows, is_driven, joined};
use super::layout::{BLOCK_ROWS, HALF_CELLS, HALF_COLUMNS};
use super::write::WriteRequest;

/// Drives of the written samples.
#[derive(Debug, Clone, Copy)]
pub enum Met<'a> {
    /// By block of 64 rows, `[64 rows][stride]`; `None` where all are 0.
    Turned(&'a [Option<&'a [u8]>]),
    /// Those of windows, put together here again: they are more than what they are put together from.
    Windows {
        /// All windows.
        windows: Windows<'a>,
        /// The first read that is written.
        first: usize,
        /// Reads.
        count: usize,
    },
}

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

impl Form<'_> {
    /// Sums as they are.
    pub const PLAIN: Self = Self { means: None, squares: false, long: false, phases: 1 };
}

/// So many reads have centred sums of 32 bits, whatever they hold: 4096 x 4080 x 127 < 2^31.
pub const SHORT_READS: usize = 4096;

/// Sums of half blocks that 32 bits do not hold, with their places. Where they belong in the list of all, there is 0.
pub type LongSums = Vec<(usize, Box<Half<i64>>)>;

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

/// Forms the sums of a strip.
pub(super) struct Former<'a> {
    met: Met<'a>,
    gates: &'a [i8],
    stride: usize,
    form: Form<'a>,
    /// Rows of the array.
    rows: usize,
    /// By half block side by side: whether a column has a gate, and what the gates of each add up to.
    halves: Vec<(bool, [i32; HALF_COLUMNS])>,
    /// Sums of the half blocks that were formed last.
    pub(super) sums: AVec<Half<i32>>,
    /// Those that 32 bits do not hold, by half block.
    pub(super) long: LongSums,
    /// Drives of some reads, and what else is put together on the way.
    codes: AVec<u8>,
    line: Vec<u8>,
    part: AVec<Half<i32>>,
    scratch: ReadsScratch,
}

/// Reads of windows that are put together at once: so many that little is added up of what they come to.
const PART: usize = 2048;

impl<'a> Former<'a> {
    /// `gates` are those of a [`StripMut::write`].
    pub(super) fn new(
        kernel: &Kernel,
        strip: &StripMut<'_>,
        request: &WriteRequest<'a>,
        gates: &'a [i8],
        form: Form<'a>,
    ) -> Self {
        let (stride, count) = (request.stride, strip.halves());
        let halves = if stride == 0 {
            vec![(false, [0; _]); count]
        } else {
            let halves = gates.chunks_exact(HALF_COLUMNS * stride).map(|gates| {
                let live = is_driven(gates);
                let wanted = live && form.means.is_some();
                let totals = match form.phases {
                    _ if !wanted => [0; _],
                    1 => kernel.gate_totals(gates),
                    _ => totals_above(gates),
                };
                (live, totals)
            });
            halves.collect()
        };
        let (met, rows) = (request.met, strip.layout.rows);
        let sums = avec![[0; HALF_CELLS]; count];
        let (long, scratch) = (LongSums::new(), ReadsScratch::default());
        let (codes, line, part) = (avec![], vec![], avec![]);
        Self { met, gates, stride, form, rows, halves, sums, long, codes, line, part, scratch }
    }

    /// Half blocks side by side that are formed together: what is met in passing is met by all at once.
    pub(super) const fn together(&self) -> usize {
        match self.met {
            Met::Turned(_) => 1,
            Met::Windows { .. } => self.halves.len(),
        }
    }

    /// Forms the sums of some half blocks beside a block of rows. Gives the sum of their squares, if it is wanted.
    pub(super) fn form(&mut self, kernel: &Kernel, block: usize, halves: Range<usize>) -> u128 {
        self.long.clear();
        self.products(kernel, block, halves.clone());
        let mut squares = 0;
        for half in halves {
            let ((live, totals), sums) = (&self.halves[half], &mut self.sums[half]);
            if !live {
                continue;
            }
            if let Some(means) = self.form.means {
                let means = means[block * BLOCK_ROWS..].first_chunk().expect("whole blocks");
                if !self.form.long || stays_short(kernel, sums, totals) {
                    kernel.centre(sums, means, totals);
                } else if let Some(beyond) = centre_long(sums, means, totals) {
                    let each = beyond.iter().map(|sum| u128::from(sum.unsigned_abs()).pow(2));
                    squares += if self.form.squares { each.sum() } else { 0 };
                    sums.fill(0);
                    self.long.push((half, beyond));
                }
            }
            if self.form.squares {
                squares += joined(kernel.squares(sums, self.form.means.is_some()));
            }
        }
        squares
    }

    /// Sums of products, as they are.
    fn products(&mut self, kernel: &Kernel, block: usize, halves: Range<usize>) {
        match self.met {
            Met::Turned(turned) => {
                let turned = turned.get(block).copied().flatten();
                let size = HALF_COLUMNS * self.stride;
                for half in halves {
                    match turned {
                        Some(turned) if self.halves[half].0 => {
                            let gates = &self.gates[half * size..][..size];
                            kernel.accumulate(turned, self.stride, gates, &mut self.sums[half]);
                        }
                        _ => self.sums[half].fill(0),
                    }
                }
            }
            Met::Windows { windows, first, count } => {
                self.sums[halves.clone()].fill([0; _]);
                for start in (0..count).step_by(PART) {
                    let reads = start..(start + PART).min(count);
                    self.codes.resize(reads.len() * BLOCK_ROWS, 0);
                    let all = first + reads.start..first + reads.end;
                    windows.assemble(block..block + 1, all, &mut self.line, &mut self.codes);
                    self.add(kernel, block, halves.clone(), start);
                }
            }
        }
    }

    /// Adds the products of the reads from `start` on that were put together.
    fn add(&mut self, kernel: &Kernel, block: usize, halves: Range<usize>, start: usize) {
        let size = HALF_COLUMNS * self.stride;
        let rows = (self.rows - block * BLOCK_ROWS).min(BLOCK_ROWS);
        let mut first = halves.start;
        // half blocks in a row that have gates, or have none
        for run in self.halves[halves].chunk_by(|a, b| a.0 == b.0) {
            let these = first..first + run.len();
            first = these.end;
            if !run[0].0 {
                continue;
            }
            let gates = (&self.gates[these.start * size..these.end * size], self.stride, start);
            let (codes, sums) = ((&self.codes[..], rows), &mut self.sums[these]);
            if start == 0 {
                kernel.accumulate_reads(codes, gates, &mut self.scratch, sums);
                continue;
            }
            self.part.resize(sums.len(), [0; HALF_CELLS]);
            kernel.accumulate_reads(codes, gates, &mut self.scratch, &mut self.part);
            for (sums, part) in sums.iter_mut().zip(&*self.part) {
                sums.iter_mut().zip(part).for_each(|(sum, part)| *sum += part);
            }
        }
    }
}

impl StripMut<'_> {
    /// Half blocks side by side.
    pub(super) fn halves(&self) -> usize {
        2 * self.panels().len()
    }

    /// Forms the sums of these panels and keeps them, `[half block, in the order of levels][64 rows][16 columns]`; gives the sum
    /// of their squares if it is wanted, and what 32 bits do not hold. `gates` are those of a [`StripMut::write`].
    pub fn form(
        &self,
        kernel: &Kernel,
        request: &WriteRequest<'_>,
        gates: &[i8],
        form: Form<'_>,
        sums: &mut [i32],
    ) -> (u128, LongSums) {
        let blocks = self.layout.blocks();
        let mut former = Former::new(kernel, self, request, gates, form);
        let (mut squares, mut long, together) = (0, LongSums::new(), former.together());
        for block in 0..blocks {
            for first in (0..self.halves()).step_by(together) {
                let halves = first..first + together;
                squares += former.form(kernel, block, halves.clone());
                for half in halves {
                    let at = place(half, block, blocks);
                    sums[at..at + HALF_CELLS].copy_from_slice(&former.sums[half]);
                }
                let beyond = former.long.drain(..);
                long.extend(beyond.map(|(half, sums)| (place(half, block, blocks), sums)));
            }
        }
        (squares, long)
    }

    /// The sum of the squares of the sums of these panels, which are kept nowhere.
    pub fn squares(
        &self,
        kernel: &Kernel,
        request: &WriteRequest<'_>,
        gates: &[i8],
        form: Form<'_>,
    ) -> u128 {
        let mut former = Former::new(kernel, self, request, gates, form);
        let (mut squares, together) = (0, former.together());
        for block in 0..self.layout.blocks() {
            for first in (0..self.halves()).step_by(together) {
                squares += former.form(kernel, block, first..first + together);
            }
        }
        squares
    }
}

/// Place of a half block of a strip of panels.
pub(super) const fn place(half: usize, block: usize, blocks: usize) -> usize {
    ((half / 2 * blocks + block) * 2 + half % 2) * HALF_CELLS
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
