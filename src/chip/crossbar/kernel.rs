//! The loops that touch every cell. `scalar` is the law; every other back end gives its bits.
//!
//! A [`Backend`] says which loops run; [`Kernel::start`] makes them ready on this thread. A back end is a token that
//! exists only where the processor has the feature; what it does is a table of functions, declared in `ops`, behind the
//! checks of [`Kernel`]. Sums are `i32`: a read adds at most 33,025 products of two bytes (the plan cuts longer columns into
//! chunks), an update at most 4,096 products of a drive (0..=255) and a gate (-127..=127), times a mantissa of at most 15.
//! Where an update meets more positions, its sums are `i64`.
//!
//! A write has four steps, each with one law and one twin that compilers make vectors of: `sums`, `requests`, `pulses`,
//! `levels`. Back ends have kernels of their own for products, and for writes as they usually are (`fused`, `single`).
//!
//! ```text
//! drives      [block of 64 rows][sample][64]            u8
//! levels      [block][half][16 groups][16 columns][4]   u8, one panel of 32 columns
//! gates       [half][sample / 4][16 columns][4]         i8
//! turned      [block of 64 rows][64][samples padded]    u8, drives as an update takes them
//! ```
//!
//! Each is a sequence of AMX tiles: 16 rows of 64 bytes.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use std::marker::PhantomData;
use std::ops::Range;

use super::layout::{BLOCK_CELLS, BLOCK_ROWS, HALF_CELLS, HALF_COLUMNS, Layout, PANEL_COLUMNS};
use crate::num::fixed::ErrorBits;

#[cfg(target_arch = "x86_64")]
mod amx;
#[cfg(target_arch = "x86_64")]
mod avx2;
#[cfg(target_arch = "x86_64")]
mod avx512;
mod backend;
mod chacha;
mod conv;
mod data;
mod lanes;
mod levels;
#[cfg(target_arch = "aarch64")]
mod neon;
mod normalise;
mod offsets;
mod ops;
mod optimise;
#[cfg(target_arch = "x86_64")]
mod peak;
mod pulses;
mod reads;
mod requests;
mod respond;
mod scalar;
mod sums;
mod team;
#[cfg(test)]
mod tests;

#[cfg(target_arch = "x86_64")]
use self::data::{OneProduct, Packed};
#[cfg(target_arch = "aarch64")]
pub use self::neon::Neon;
use self::ops::Ops;
#[cfg(target_arch = "x86_64")]
pub use self::{amx::Amx, avx2::Avx2, avx512::Avx512};
pub use self::{
    backend::{Backend, UnknownBackend},
    chacha::Draws,
    conv::{ConvPlan, ConvScratch, ConvShape, ConvTurned, Image, Pixels, Windows},
    data::{
        Banks, Cells, Conversion, Dither, Drives, Ends, Extremes, Greatest, Half, LookUp,
        OneSample, Peaks, Pulsed, Rails, Scratch, TOGETHER, WriteCounts, WriteLaw, is_driven,
    },
    normalise::{HandOn, SQUARED_MAX},
    offsets::{MiddleOf, OFFSET_MAX},
    optimise::{MEAN_BITS, SignLaw, Squares, joined},
    reads::ReadsScratch,
    respond::{Answering, Answers, Remembered},
    sums::Sums,
    team::Team,
};

/// Pulses of a half block between the steps of a write.
#[repr(align(64))]
struct Pulses(Half<i8>);

/// A back end at work on this thread.
#[derive(Debug)]
pub struct Kernel {
    ops: &'static Ops,
    /// Tiles keep their shape as long as this lives.
    #[cfg(target_arch = "x86_64")]
    _tiles: Option<amx::Tiles>,
    /// What is made ready belongs to this thread.
    _here: PhantomData<*const ()>,
}

/// Calls an operation of whichever back end is at work.
macro_rules! call {
    ($kernel:expr, $operation:ident($($argument:expr),*)) => {
        call!($kernel.ops.$operation, ($($argument),*))
    };
    ($operation:expr, ($($argument:expr),*)) => {{
        let operation = $operation;
        // SAFETY: `Kernel::start` has the table from a token, which exists only where processor and system have all that
        // the functions of this table are compiled for. Tiles have their shape on this thread as long as the kernel
        // lives, which cannot leave it.
        unsafe { operation($($argument),*) }
    }};
}

use call;

impl Kernel {
    /// Makes a back end ready on this thread, until the value is dropped.
    #[must_use]
    pub fn start(backend: Backend) -> Self {
        Self {
            ops: backend.ops(),
            #[cfg(target_arch = "x86_64")]
            _tiles: match backend {
                Backend::Amx(amx) => Some(amx.configure()),
                _ => None,
            },
            _here: PhantomData,
        }
    }

    /// Reads one panel for some samples: `out[b][c] = sum of level[r][c] * drives[b][r]`, for the 32 columns of
    /// the panel. `cells` are the blocks of one byte plane of the panel that `drives` drives.
    ///
    /// # Panics
    /// When the sizes do not match.
    pub fn read(&self, cells: &[u8], drives: Drives<'_>, samples: Range<usize>, out: &mut [i32]) {
        assert_eq!(cells.len(), drives.blocks() * BLOCK_CELLS, "every block has drives");
        assert!(samples.end <= drives.samples(), "the samples are there");
        assert_eq!(samples.len() * PANEL_COLUMNS, out.len(), "32 sums a sample");
        if !out.is_empty() {
            call!(self, read(cells, drives, samples, out));
        }
    }

    /// What the drives of each sample add up to, where reads of this back end take that: given to them by
    /// [`Drives::with_sums`], it is not added up for every panel again. Otherwise nothing.
    #[must_use]
    pub fn drive_sums(&self, drives: Drives<'_>) -> Option<Vec<i32>> {
        let sums = self.ops.drive_sums?;
        let mut out = vec![0; drives.samples()];
        call!(sums, (drives, &mut out));
        Some(out)
    }

    /// Reads one panel of two banks tile by tile, converts each and adds `code_E - code_I` to `codes` (32 a
    /// sample). Returns the conversions that met their rail. The plan proves that codes add up inside 16 bits.
    ///
    /// # Panics
    /// When the sizes do not match.
    pub fn read_converted(
        &self,
        banks: &Banks<'_>,
        samples: Range<usize>,
        scratch: &mut Scratch,
        codes: &mut [i16],
    ) -> Rails {
        let blocks = banks.drives[0].blocks();
        for (cells, drives) in banks.cells.iter().zip(banks.drives) {
            assert_eq!(cells.len(), blocks * BLOCK_CELLS, "every block has cells");
            assert_eq!(drives.blocks(), blocks, "every block has drives");
            assert!(samples.end <= drives.samples(), "the samples are there");
        }
        assert!(banks.tile_blocks > 0 && banks.live <= PANEL_COLUMNS, "a tile has cells");
        assert!(blocks.div_ceil(banks.tile_blocks) < 1024, "counts of saturation fit 16 bits");
        assert!(banks.conversion.shift <= Conversion::SHIFT_MAX, "half a step fits");
        assert_eq!(samples.len() * PANEL_COLUMNS, codes.len(), "32 codes a sample");
        if codes.is_empty() {
            return Rails::default();
        }
        let whole = samples.len() / TOGETHER * TOGETHER;
        let (these, rest) = codes.split_at_mut(whole * PANEL_COLUMNS);
        let middle = samples.start + whole;
        match call!(self, read_converted(banks, samples.start..middle, scratch, these)) {
            Some(mut rails) => {
                rails += self.read_apart(banks, middle..samples.end, scratch, rest);
                rails
            }
            None => self.read_apart(banks, samples, scratch, codes),
        }
    }

    /// Reads and converts one tile after the other.
    fn read_apart(
        &self,
        banks: &Banks<'_>,
        samples: Range<usize>,
        scratch: &mut Scratch,
        codes: &mut [i16],
    ) -> Rails {
        let mut rails = Rails::default();
        let blocks = banks.drives[0].blocks();
        let groups = samples.clone().step_by(TOGETHER);
        for (start, codes) in groups.zip(codes.chunks_mut(Scratch::SUMS)) {
            let group = start..(start + TOGETHER).min(samples.end);
            for first in (0..blocks).step_by(banks.tile_blocks) {
                let tile = first..(first + banks.tile_blocks).min(blocks);
                for (bank, out) in scratch.currents.iter_mut().enumerate() {
                    let cells =
                        &banks.cells[bank][tile.start * BLOCK_CELLS..tile.end * BLOCK_CELLS];
                    let drives = banks.drives[bank].of_blocks(tile.clone());
                    self.read(cells, drives, group.clone(), &mut out[..codes.len()]);
                }
                let [e, i] = [0, 1].map(|bank| &scratch.currents[bank][..codes.len()]);
                rails += call!(self, convert([e, i], banks.conversion, banks.live, codes));
            }
        }
        rails
    }

    /// Looks up accumulators (`[sample][32]`, the first `live` of them): `values` and `derivatives` lie
    /// `[sample][64]` from this panel's first column on; columns beyond `live` are set to 0. Returns the indices
    /// that saturated.
    ///
    /// # Panics
    /// When the sizes do not match.
    pub fn look_up(
        &self,
        accumulators: &[i32],
        table: &LookUp,
        live: usize,
        values: &mut [u8],
        derivatives: &mut [u8],
    ) -> u64 {
        let samples = accumulators.len() / PANEL_COLUMNS;
        assert_eq!(samples * PANEL_COLUMNS, accumulators.len(), "32 accumulators a sample");
        assert!(live <= PANEL_COLUMNS && table.shift <= 30, "a panel has 32 columns");
        assert!(
            table.entries.len().is_power_of_two() && table.entries.len() >= 2,
            "2^bits entries"
        );
        if samples == 0 {
            return 0;
        }
        let least = (samples - 1) * BLOCK_ROWS + PANEL_COLUMNS;
        assert!(values.len() >= least && derivatives.len() >= least, "every unit has its place");
        call!(self, look_up(accumulators, table, live, values, derivatives))
    }

    /// `sums = E - I`, sum by sum. The plan proves that it fits.
    ///
    /// # Panics
    /// When the sizes do not match.
    pub fn difference(&self, currents: [&[i32]; 2], sums: &mut [i32]) {
        assert!(currents.iter().all(|bank| bank.len() == sums.len()), "both banks have every sum");
        call!(self, difference(currents, sums));
    }

    /// Adds to each sample's sum the squares of what is above 0 in a panel of 32 units, `[sample][32]`. The plan proves that
    /// sums lie below [`SQUARED_MAX`].
    ///
    /// # Panics
    /// When the sizes do not match.
    pub fn stream_squares(&self, sums: &[i32], squares: &mut [u64]) {
        assert_eq!(sums.len(), squares.len() * PANEL_COLUMNS, "32 units a sample");
        call!(self, stream_squares(sums, squares));
    }

    /// Normalises a panel of 32 units, `[sample][32]`, by the reciprocal of each sample: what they hand on, and how steep
    /// they are, both `[sample][64]` from this panel's first column on. Returns the codes that their bound changed.
    ///
    /// # Panics
    /// When the sizes do not match.
    pub fn scale(
        &self,
        sums: &[i32],
        reciprocals: &[u64],
        hand_on: HandOn,
        values: &mut [u8],
        derivatives: &mut [u8],
    ) -> u64 {
        let samples = reciprocals.len();
        assert_eq!(sums.len(), samples * PANEL_COLUMNS, "32 units a sample");
        if samples == 0 {
            return 0;
        }
        let least = (samples - 1) * BLOCK_ROWS + PANEL_COLUMNS;
        assert!(values.len() >= least && derivatives.len() >= least, "every unit has its place");
        call!(self, scale(sums, reciprocals, hand_on, values, derivatives))
    }

    /// Latches one word a unit: `errors[b][j] = words[b][taps[j]]`, `width` words and 64 units a sample; units beyond
    /// the last tap latch 0.
    ///
    /// # Panics
    /// When the sizes do not match or a tap lies beyond the bus.
    pub fn latch(&self, words: &[i16], width: usize, taps: &[u16], errors: &mut [i16]) {
        assert!(width > 0 && words.len().is_multiple_of(width), "whole samples");
        assert_eq!(words.len() / width * BLOCK_ROWS, errors.len(), "64 units a sample");
        assert!(taps.len() <= BLOCK_ROWS, "at most 64 units");
        assert!(taps.iter().all(|&tap| usize::from(tap) < width), "every tap is on the bus");
        call!(self, latch(words, width, taps, errors));
    }

    /// Gates of a block of 64 columns from latched error words and derivatives (both `[sample][64]`), packed for an
    /// update: `[4 halves][stride / 4][16][4]`. `negate` is stream n. Errors lie inside the rail of their width, where
    /// no gate saturates; the law counts those that would.
    ///
    /// # Panics
    /// When the sizes do not match.
    pub fn gate(
        &self,
        errors: &[i16],
        derivatives: &[u8],
        negate: bool,
        bits: ErrorBits,
        stride: usize,
        gates: &mut [i8],
    ) -> u64 {
        assert_eq!(errors.len(), derivatives.len(), "every unit has an error");
        assert!(errors.len().is_multiple_of(BLOCK_ROWS), "64 columns a sample");
        assert!(stride.is_multiple_of(4) && stride * BLOCK_ROWS >= errors.len(), "padded samples");
        assert_eq!(gates.len(), stride * BLOCK_ROWS, "every gate has its place");
        call!(self, gate(errors, derivatives, negate, bits, stride, gates))
    }

    /// [`Kernel::gate`] of samples, so many of which in a row share a word: `errors` lies `[sample / shared][64]`.
    ///
    /// # Panics
    /// When the sizes do not match.
    pub fn gate_shared(
        &self,
        (errors, shared): (&[i16], usize),
        derivatives: &[u8],
        negate: bool,
        bits: ErrorBits,
        stride: usize,
        gates: &mut [i8],
    ) -> u64 {
        assert_eq!(errors.len() * shared, derivatives.len(), "every unit has an error");
        match self.ops.gate_shared {
            Some(gate) if shared > 1 => {
                assert!(errors.len().is_multiple_of(BLOCK_ROWS), "64 columns a sample");
                let padded = stride.is_multiple_of(4) && stride * BLOCK_ROWS >= derivatives.len();
                assert!(padded && gates.len() == stride * BLOCK_ROWS, "every gate has its place");
                call!(gate, ((errors, shared), derivatives, negate, bits, stride, gates))
            }
            None if shared > 1 => {
                let all = errors.as_chunks::<BLOCK_ROWS>().0.iter();
                let all = all.flat_map(|errors| std::iter::repeat_n(errors, shared));
                let all: Vec<i16> = all.flatten().copied().collect();
                self.gate(&all, derivatives, negate, bits, stride, gates)
            }
            _ => self.gate(errors, derivatives, negate, bits, stride, gates),
        }
    }

    /// Turns one block of drives (`[sample][64]`) into rows of samples, `[64][stride]`, padded with 0.
    ///
    /// # Panics
    /// When the sizes do not match.
    pub fn turn(&self, codes: &[u8], stride: usize, turned: &mut [u8]) {
        assert!(codes.len().is_multiple_of(BLOCK_ROWS), "64 rows a sample");
        assert!(stride.is_multiple_of(4) && stride * BLOCK_ROWS >= codes.len(), "padded samples");
        assert_eq!(turned.len(), stride * BLOCK_ROWS, "every code has its place");
        call!(self, turn(codes, stride, turned));
    }

    /// Reads a whole array from its columns: `out[b][r] = sum of level[r][c] * gates[b][c]` over all columns.
    /// `plane` is one byte plane of the array; `gates` are signed bytes (-127..=127) that lie as drives do, by
    /// column, 0 beyond the last column; `out` holds the padded rows of each sample. 65,535 products of a level and a
    /// gate fit 32 bits.
    ///
    /// # Panics
    /// When the sizes do not match.
    pub fn read_columns(&self, plane: &[u8], layout: Layout, gates: Drives<'_>, out: &mut [i32]) {
        assert_eq!(plane.len(), layout.cells_padded(), "one byte a cell");
        assert_eq!(gates.blocks(), layout.columns.div_ceil(BLOCK_ROWS), "one gate a column");
        assert_eq!(out.len(), gates.samples() * layout.rows_padded(), "one sum a row");
        call!(self, read_columns(plane, layout, gates, out));
    }

    /// Sums of a half block: `sums[r][c] = sum over b of turned[r][b] * gates[b][c]`. `turned` holds 64 rows of
    /// `stride` samples (a multiple of 4, padded with 0), `gates` lies `[stride / 4][16 columns][4 samples]`.
    ///
    /// # Panics
    /// When the sizes do not match.
    pub fn accumulate(&self, turned: &[u8], stride: usize, gates: &[i8], sums: &mut Half<i32>) {
        assert!(stride > 0 && stride.is_multiple_of(4), "samples are padded to words of four");
        assert_eq!(turned.len(), BLOCK_ROWS * stride, "64 rows");
        assert_eq!(gates.len(), HALF_COLUMNS * stride, "16 columns");
        call!(self, accumulate(turned, stride, gates, sums));
    }

    /// [`Kernel::accumulate`] and [`Kernel::dither`] of the half block at `(column, block)`, at once where that
    /// is faster than one after the other. `prefetch` is what will be wanted next: it may be fetched meanwhile.
    ///
    /// # Panics
    /// When the sizes do not match.
    pub fn accumulate_drawn(
        &self,
        (turned, stride): (&[u8], usize),
        gates: &[i8],
        sums: &mut Half<i32>,
        from: (&Draws, (usize, usize)),
        words: &mut Half<u8>,
        prefetch: &Half<u8>,
    ) {
        assert!(stride > 0 && stride.is_multiple_of(4), "samples are padded to words of four");
        assert_eq!(turned.len(), BLOCK_ROWS * stride, "64 rows");
        assert_eq!(gates.len(), HALF_COLUMNS * stride, "16 columns");
        let both = self.ops.accumulate_drawn;
        let done = both.is_some_and(|both| {
            call!(both, ((turned, stride), gates, sums, from, words, prefetch))
        });
        if !done {
            let (draws, (column, block)) = from;
            call!(self, accumulate(turned, stride, gates, sums));
            call!(self, dither(draws, column, block, words));
        }
    }

    /// Groups of four rows, a bit each, with a sum that does not round to 0 whatever its dither word of `bits` bits. In
    /// all others nothing is drawn, nothing moves and nothing is counted.
    #[must_use]
    pub fn may_move<'a>(&self, sums: impl Into<Sums<'a>>, write: &WriteLaw, bits: u32) -> u16 {
        call!(self, may_move(sums.into(), write, bits))
    }

    /// The 8-bit dither words of a half block: columns `column .. column + 16`, rows `64 * block ..`, in the order of
    /// levels.
    pub fn dither(&self, draws: &Draws, column: usize, block: usize, words: &mut Half<u8>) {
        call!(self, dither(draws, column, block, words));
    }

    /// The 16-bit dither words of a half block, as [`Kernel::dither`] gives 8-bit words.
    pub fn dither_words(&self, draws: &Draws, column: usize, block: usize, words: &mut Half<u16>) {
        call!(self, dither_words(draws, column, block, words));
    }

    /// Rounds, bounds and programs a half block: requests become pulses, and pulses levels.
    ///
    /// # Panics
    /// When the window is empty, numbers lie outside the ranges of [`WriteLaw`], or a remainder has
    /// no bits.
    pub fn program<'a>(
        &self,
        mut cells: Cells<'_>,
        sums: impl Into<Sums<'a>>,
        write: &WriteLaw,
        dither: Dither<'_>,
    ) -> WriteCounts {
        assert!(write.floor <= write.ceiling, "the window is not empty");
        let sums = sums.into();
        let shift_max = if matches!(sums, Sums::Narrow(_)) { 31 } else { 55 };
        let fits = write.shift <= shift_max && (1..=15).contains(&write.mantissa);
        assert!(fits, "products fit 32 bits, and what is added before a shift too");
        assert!((1..=127).contains(&write.increment_max), "pulses fit a byte");
        assert!(write.residual_bits <= 15, "a remainder fits 16 bits");
        assert!(cells.residual.is_some() == (write.residual_bits > 0), "a remainder has bits");
        let fused = match sums {
            Sums::Narrow(sums) if cells.answering.is_none() => {
                call!(self, fused(&mut cells, sums, write, dither))
            }
            _ => None,
        };
        fused.unwrap_or_else(|| self.program_in_steps(cells, sums, write, dither))
    }

    /// Programs pulses that lie in memory between the steps. Apart, so that writes at once do not wait for their place.
    #[inline(never)]
    fn program_in_steps(
        &self,
        mut cells: Cells<'_>,
        sums: Sums<'_>,
        write: &WriteLaw,
        dither: Dither<'_>,
    ) -> WriteCounts {
        let mut pulses = Pulses([0; HALF_CELLS]);
        let counts = call!(self, pulses(sums, write, dither, &mut cells, &mut pulses.0));
        let effective = self.levels(cells, &pulses.0, write.ends(), write.groups);
        WriteCounts { effective, ..counts }
    }

    /// Programs pulses of some groups of a half block. Returns by how many levels cells moved.
    ///
    /// # Panics
    /// When the window is empty.
    pub fn levels(&self, mut cells: Cells<'_>, pulses: &Half<i8>, ends: Ends, groups: u16) -> u64 {
        assert!(ends.floor <= ends.ceiling, "the window is not empty");
        if let Some(mut answering) = cells.answering.take() {
            return respond::respond(self, &mut cells, &mut answering, (pulses, groups), ends);
        }
        call!(self, levels(&mut cells, pulses, ends, groups))
    }

    /// Takes the means of the rows off the sums of a half block: see `optimise`. `totals` are the sums of the gates of
    /// its columns.
    pub fn centre(
        &self,
        sums: &mut Half<i32>,
        means: &[i32; BLOCK_ROWS],
        totals: &[i32; HALF_COLUMNS],
    ) {
        call!(self, centre(sums, means, totals));
    }

    /// Sums of the gates of the 16 columns of a half block over all samples: `[stride / 4][16 columns][4 samples]`.
    ///
    /// # Panics
    /// When the size is no such.
    #[must_use]
    pub fn gate_totals(&self, gates: &[i8]) -> [i32; HALF_COLUMNS] {
        assert!(gates.len().is_multiple_of(4 * HALF_COLUMNS), "16 columns of padded samples");
        call!(self, gate_totals(gates))
    }

    /// Sums of the drives of the 64 rows of a block over all samples: `[64 rows][stride]`.
    ///
    /// # Panics
    /// When the size is no such.
    #[must_use]
    pub fn drive_totals(&self, turned: &[u8], stride: usize) -> [u32; BLOCK_ROWS] {
        assert!(stride > 0 && turned.len() == BLOCK_ROWS * stride, "64 rows");
        call!(self, drive_totals(turned, stride))
    }

    /// Sums of the squares of the sums of a half block; `wide`: of centred ones.
    #[must_use]
    pub fn squares(&self, sums: &Half<i32>, wide: bool) -> Squares {
        call!(self, squares(sums, wide))
    }

    /// Groups of four rows, a bit each, with a sum of at least that size.
    #[must_use]
    pub fn loud(&self, sums: &Half<i32>, least: u32) -> u16 {
        call!(self, loud(sums, least))
    }

    /// Programs a half block with at most a pulse a cell, towards its sum. `words` are only read where they decide.
    ///
    /// # Panics
    /// When the window is empty, a sum of 0 would be loud, or words that decide are not there.
    pub fn program_signs(
        &self,
        mut cells: Cells<'_>,
        sums: &Half<i32>,
        law: &SignLaw,
        words: Option<&Half<u16>>,
        ends: Ends,
    ) -> WriteCounts {
        assert!(law.least > 0, "a sum of 0 has no sign");
        assert!(law.is_certain() || words.is_some(), "words decide");
        let mut pulses = Pulses([0; HALF_CELLS]);
        let counts = call!(self, signs(sums, law, words, &mut cells, &mut pulses.0));
        let effective = self.levels(cells, &pulses.0, ends, law.groups);
        WriteCounts { effective, ..counts }
    }

    /// Writes a strip for one sample, all at once; `None` where a back end does not, and nothing was done.
    ///
    /// # Panics
    /// When the sizes do not match.
    pub fn one_sample(&self, strip: OneSample<'_>) -> Option<WriteCounts> {
        let halves = strip.gates.len() / (4 * HALF_COLUMNS);
        assert_eq!(strip.gates.len(), halves * 4 * HALF_COLUMNS, "four gates a column");
        assert_eq!(strip.low.len(), halves / 2 * strip.blocks * BLOCK_CELLS, "whole panels");
        assert_eq!(strip.turned.len(), strip.blocks, "every block is driven or not");
        let whole = |turned: &&[u8]| turned.len() == 4 * BLOCK_ROWS;
        assert!(strip.turned.iter().flatten().all(whole), "64 rows");
        assert!(strip.write.floor <= strip.write.ceiling, "the window is not empty");
        let rows = strip.peaks.as_ref().map_or(0, |rows| rows.len().div_ceil(BLOCK_ROWS));
        assert!(rows == 0 || rows == strip.blocks, "peaks of all rows");
        call!(self, one_sample(strip))
    }

    /// Sizes of the most positive and the most negative pulses of each row.
    #[must_use]
    pub fn peaks(&self, extremes: &Extremes) -> Peaks {
        call!(self, peaks(extremes))
    }

    /// Multiplies random numbers in registers, and nothing else, for some rounds. Returns the products made: what this
    /// back end's instruction reaches at most, once a caller has timed it. 0 where a back end has no such measure.
    #[must_use]
    pub fn peak(&self, rounds: usize) -> u64 {
        call!(self, peak(rounds))
    }
}
