//! Reading a stream: which rows are read together, with which converters, and in which width.
//!
//! ```text
//! narrow   every sum fits 31 bits by the plan, and nobody has to see a current: kernels convert and look up
//! wide     anything else: 64 bits, one conversion after the other
//! ```
//!
//! Both give the same numbers. On the wide way currents exist as numbers in one place, [`Reader::currents`], between
//! the cells and the converters: what disturbs currents belongs there, and [`Mode::shows_currents`] keeps such reads
//! off the narrow way. See docs/MODEL.md, 2.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use std::borrow::Cow;
use std::ops::Range;

use super::homeostasis::{Noted, Notes};
use crate::chip::crossbar::Crossbar;
use crate::chip::crossbar::kernel::{Banks, Conversion, Drives, Greatest, Kernel, Scratch};
use crate::chip::crossbar::layout::{BLOCK_ROWS, PANEL_COLUMNS};
use crate::chip::hardware::{Adc, Hardware, Subtract};
use crate::chip::layer::{CHUNK_BLOCKS, Layer};
use crate::chip::periphery::{self, Converter};
use crate::chip::population::{BANKS_MAX, Stream, Wiring};
use signed::{below_from_above, both_phases};

mod signed;

/// Histogram of the least shifts at which conversions stay off the rail, and the greatest current, by slice.
pub(super) type Histogram = Vec<([u64; 64], i64)>;

/// How currents become numbers in one pass.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Mode {
    /// As the hardware says.
    Hardware,
    /// With ideal converters, remembering what finite ones would need.
    Probe,
    /// As the hardware says, learning so much of units that keep to a middle.
    Noting(Notes),
}

impl Mode {
    /// Whether something looks at currents, or changes them, before they are converted.
    const fn shows_currents(self) -> bool {
        matches!(self, Self::Probe)
    }
}

/// Rows that are read together with one slice of their drives.
struct TileRead<'a> {
    slice: usize,
    blocks: Range<usize>,
    /// Blocks of a physical tile among them.
    tile_blocks: usize,
    codes: Cow<'a, [u8]>,
    /// What the drives of each sample add up to, where that is known.
    sums: Vec<i32>,
}

/// What reads counted.
#[derive(Default, Clone)]
pub(super) struct Seen {
    /// By bank.
    pub(super) saturated: [u64; BANKS_MAX],
    /// Codes on the rail, of all banks, by slice; empty with ideal converters.
    pub(super) reached: Vec<u64>,
    pub(super) look_ups: u64,
    pub(super) histogram: Histogram,
    pub(super) noted: Noted,
}

impl Seen {
    pub(super) fn new(reader: &Reader<'_>) -> Self {
        let slices = if reader.probe.is_some() { reader.slices } else { 0 };
        let converted = if reader.converters.is_some() { reader.slices } else { 0 };
        let (histogram, reached) = (vec![([0; 64], 0); slices], vec![0; converted]);
        Self { histogram, reached, ..Self::default() }
    }

    /// What parts saw, by target of a wiring.
    pub(super) fn by_target(wiring: Wiring, parts: Vec<(usize, Self)>) -> Vec<Self> {
        let mut total = vec![Self::default(); wiring.targets().len()];
        for (target, seen) in parts {
            total[target].merge(seen);
        }
        total
    }

    fn merge(&mut self, other: Self) {
        self.saturated.iter_mut().zip(other.saturated).for_each(|(sum, more)| *sum += more);
        self.look_ups += other.look_ups;
        self.noted.merge(other.noted);
        self.reached.resize(other.reached.len(), 0);
        self.reached.iter_mut().zip(other.reached).for_each(|(sum, more)| *sum += more);
        if self.histogram.is_empty() {
            self.histogram = other.histogram;
        } else {
            for (mine, theirs) in self.histogram.iter_mut().zip(other.histogram) {
                mine.0.iter_mut().zip(theirs.0).for_each(|(a, b)| *a += b);
                mine.1 = mine.1.max(theirs.1);
            }
        }
    }
}

/// A panel and some samples.
#[derive(Clone)]
pub(super) struct PanelPart {
    pub(super) panel: usize,
    /// Columns of the panel that exist.
    pub(super) live: usize,
    pub(super) samples: Range<usize>,
}

/// Two banks whose currents or codes are subtracted.
struct Pair<'a> {
    arrays: [&'a Crossbar; 2],
    reads: [Vec<TileRead<'a>>; 2],
}

/// The banks of one target stream, and how they are read.
pub(super) struct Reader<'a> {
    pairs: Vec<Pair<'a>>,
    /// Drivings of rows: reads, twice as many where drives have a sign.
    samples: usize,
    phases: usize,
    /// Converters by slice; none where they are ideal.
    converters: Option<(Vec<Converter>, Subtract)>,
    probe: Option<Converter>,
    dac_bits: u32,
    slices: usize,
    greatest: Greatest,
    narrow: bool,
    /// Sums lie below this.
    bound: u128,
    pub(super) columns: usize,
    rows: usize,
}

impl<'a> Reader<'a> {
    pub(super) fn new(
        layer: &'a Layer,
        hardware: &Hardware,
        target: Stream,
        samples: usize,
        mode: Mode,
        drives: impl Fn(Stream) -> &'a [u8],
    ) -> Self {
        let wiring = layer.spec.wiring;
        let converters = match hardware.adc {
            Adc::Ideal => None,
            Adc::Finite { bits, subtract, .. } => {
                let shifts = layer.adc_shifts[target.index()].iter();
                let converters =
                    shifts.map(|&shift| Converter::new(bits, subtract, shift)).collect();
                Some((converters, subtract))
            }
        };
        let probe = match (mode, hardware.adc) {
            (Mode::Probe, Adc::Finite { bits, subtract, .. }) => {
                Some(Converter::new(bits, subtract, 0))
            }
            _ => None,
        };
        let pairs = wiring.pairs(target);
        let bound = bound(layer, hardware, pairs.len(), converters.as_ref());
        let narrow = bound.is_some() && !mode.shows_currents();
        let tiles = match (&converters, narrow) {
            (None, _) => Tiles::Whole,
            (Some(_), true) => Tiles::Together,
            (Some(_), false) => Tiles::Apart,
        };
        let code_max = hardware.drive.bits.code_max();
        let phases = layer.spec.driven_by.phases();
        let reads = |at: usize| {
            let drives = drives(wiring.pathways()[at].source);
            tile_reads(layer, hardware, drives, samples * phases, tiles)
        };
        let pair = |places: &[usize; 2]| Pair {
            arrays: places.map(|at| &layer.arrays[at]),
            reads: places.map(reads),
        };
        Self {
            pairs: pairs.iter().map(pair).collect(),
            samples: samples * phases,
            phases,
            converters,
            probe,
            dac_bits: hardware.drive.dac_bits,
            slices: hardware.slices() as usize,
            greatest: Greatest {
                // a low byte of more than 8 bits can be anything
                level: u8::try_from(hardware.level_greatest()).unwrap_or(u8::MAX),
                code: if tiles == Tiles::Whole {
                    code_max
                } else {
                    code_max.min(slice_max(hardware))
                },
            },
            narrow,
            bound: bound.unwrap_or(u128::MAX),
            columns: layer.layout.columns,
            rows: layer.layout.rows,
        }
    }

    /// Adds up once what reads of every panel take, where the kernel's do.
    pub(super) fn prepare(&mut self, kernel: &Kernel) {
        for at in 0..2 * self.pairs.len() {
            let reads = std::mem::take(&mut self.pairs[at / 2].reads[at % 2]);
            let with_sums = reads.into_iter().map(|read| {
                let sums = kernel.drive_sums(self.drives(&read)).unwrap_or_default();
                TileRead { sums, ..read }
            });
            self.pairs[at / 2].reads[at % 2] = with_sums.collect();
        }
    }

    /// What a read is driven with.
    fn drives<'b>(&self, read: &'b TileRead<'_>) -> Drives<'b> {
        let rows = (self.rows - (read.blocks.end - 1) * BLOCK_ROWS).min(BLOCK_ROWS);
        let drives = Drives::new(&read.codes, self.samples);
        let drives = drives.within(self.greatest).with_last_rows(rows);
        if read.sums.is_empty() { drives } else { drives.with_sums(&read.sums) }
    }

    /// Whether every sum fits 31 bits.
    pub(super) const fn is_narrow(&self) -> bool {
        self.narrow
    }

    /// Whether every sum lies below `bound`.
    pub(super) const fn is_below(&self, bound: u32) -> bool {
        self.narrow && self.bound <= bound as u128
    }

    /// Accumulators of a panel, `[sample][32]`, where they fit 31 bits.
    pub(super) fn read_narrow(
        &self,
        kernel: &Kernel,
        part: &PanelPart,
        scratch: &mut Scratch,
        sums: &mut [i32],
        seen: &mut Seen,
    ) {
        if self.phases == 1 {
            return self.drive_narrow(kernel, part, scratch, sums, seen);
        }
        let mut both = [0; Scratch::SUMS];
        for (part, sums) in both_phases(part, sums) {
            let both = &mut both[..2 * sums.len()];
            self.drive_narrow(kernel, &part, scratch, both, seen);
            below_from_above(both, sums);
        }
    }

    /// What each driving of the rows reads.
    fn drive_narrow(
        &self,
        kernel: &Kernel,
        part: &PanelPart,
        scratch: &mut Scratch,
        sums: &mut [i32],
        seen: &mut Seen,
    ) {
        if let Some((converters, _)) = &self.converters {
            sums.fill(0);
            for at in 0..self.pairs.len() {
                self.add_codes(kernel, at, converters, part, (scratch, sums, seen));
            }
            return;
        }
        let (first, others) = self.pairs.split_first().expect("a target has banks");
        self.difference(kernel, first, part, scratch, sums);
        for pair in others {
            let mut more = [0; Scratch::SUMS];
            let more = &mut more[..sums.len()];
            self.difference(kernel, pair, part, scratch, more);
            sums.iter_mut().zip(more).for_each(|(sum, more)| *sum += *more);
        }
    }

    /// Adds the converted codes of pair number `at`, each slice with its weight.
    fn add_codes(
        &self,
        kernel: &Kernel,
        at: usize,
        converters: &[Converter],
        part: &PanelPart,
        (scratch, sums, seen): (&mut Scratch, &mut [i32], &mut Seen),
    ) {
        let PanelPart { panel, live, samples } = part.clone();
        let pair = &self.pairs[at];
        let [excites, inhibits] = &pair.reads;
        let saturated = &mut seen.saturated[2 * at..2 * at + 2];
        let mut codes = [0; Scratch::SUMS];
        let codes = &mut codes[..sums.len()];
        for (at, (e, i)) in excites.iter().zip(inhibits).enumerate() {
            if at == 0 || excites[at - 1].slice != e.slice {
                codes.fill(0);
            }
            let adc = converters[e.slice];
            let banks = Banks {
                cells: pair.arrays.map(|array| array.low(panel, e.blocks.clone())),
                drives: [e, i].map(|read| self.drives(read)),
                tile_blocks: e.tile_blocks,
                conversion: Conversion {
                    shift: adc.shift,
                    max: u16::try_from(adc.max).expect("narrow: at most 15 bits"),
                },
                live,
            };
            let rails = kernel.read_converted(&banks, samples.clone(), scratch, codes);
            saturated.iter_mut().zip(rails.saturated).for_each(|(sum, count)| *sum += count);
            seen.reached[e.slice] += rails.reached;
            if excites.get(at + 1).is_none_or(|next| next.slice != e.slice) {
                let shift = adc.shift + e.slice as u32 * self.dac_bits;
                for (sum, &code) in sums.iter_mut().zip(codes.iter()) {
                    *sum += i32::from(code) << shift;
                }
            }
        }
    }

    /// Exact difference of the currents of a pair.
    fn difference(
        &self,
        kernel: &Kernel,
        pair: &Pair<'_>,
        part: &PanelPart,
        scratch: &mut Scratch,
        sums: &mut [i32],
    ) {
        let PanelPart { panel, samples, .. } = part.clone();
        let [excites, inhibits] = &pair.reads;
        let ([e], [i]) = (&excites[..], &inhibits[..]) else { unreachable!("read in one piece") };
        for ((array, read), out) in pair.arrays.iter().zip([e, i]).zip(&mut scratch.currents) {
            let out = &mut out[..sums.len()];
            let drives = self.drives(read);
            kernel.read(array.low(panel, read.blocks.clone()), drives, samples.clone(), out);
            if let Some(high) = array.high(panel, read.blocks.clone()) {
                kernel.read(high, drives, samples.clone(), sums);
                out.iter_mut().zip(&*sums).for_each(|(out, above)| *out += above << 8);
            }
        }
        let [e, i] = &scratch.currents;
        kernel.difference([&e[..sums.len()], &i[..sums.len()]], sums);
    }

    /// Accumulators of a panel, `[sample][32]`, of any size.
    pub(super) fn read_wide(
        &self,
        kernel: &Kernel,
        part: &PanelPart,
        sums: &mut [i64],
        seen: &mut Seen,
    ) {
        if self.phases == 1 {
            return self.drive_wide(kernel, part, sums, seen);
        }
        let mut both = [0; Scratch::SUMS];
        for (part, sums) in both_phases(part, sums) {
            let both = &mut both[..2 * sums.len()];
            self.drive_wide(kernel, &part, both, seen);
            below_from_above(both, sums);
        }
    }

    /// What each driving of the rows reads.
    fn drive_wide(&self, kernel: &Kernel, part: &PanelPart, sums: &mut [i64], seen: &mut Seen) {
        sums.fill(0);
        let mut currents = [[0; Scratch::SUMS]; 2];
        for (at, pair) in self.pairs.iter().enumerate() {
            for read in 0..pair.reads[0].len() {
                let [e, i] = &mut currents;
                let (e, i) = (&mut e[..sums.len()], &mut i[..sums.len()]);
                self.currents(kernel, pair, read, part, [e, i]);
                let slice = pair.reads[0][read].slice;
                self.convert([e, i], at, slice, part.live, sums, seen);
            }
        }
    }

    /// Currents of both banks of a pair for one of their reads: what the chip has in the columns of a tile while a
    /// slice is on its rows, before anything is converted.
    fn currents(
        &self,
        kernel: &Kernel,
        pair: &Pair<'_>,
        read: usize,
        part: &PanelPart,
        [e, i]: [&mut [i64]; 2],
    ) {
        let PanelPart { panel, samples, .. } = part.clone();
        for ((array, reads), out) in pair.arrays.iter().zip(&pair.reads).zip([e, i]) {
            let read = &reads[read];
            let drives = self.drives(read);
            let mut sums = [0; Scratch::SUMS];
            let sums = &mut sums[..out.len()];
            kernel.read(array.low(panel, read.blocks.clone()), drives, samples.clone(), sums);
            out.iter_mut().zip(&*sums).for_each(|(out, &sum)| *out = i64::from(sum));
            if let Some(high) = array.high(panel, read.blocks.clone()) {
                kernel.read(high, drives, samples.clone(), sums);
                out.iter_mut().zip(sums).for_each(|(out, sum)| *out += i64::from(*sum) << 8);
            }
        }
    }

    /// Converts the currents of pair number `pair` and adds them up with the weight of their slice.
    fn convert(
        &self,
        [e, i]: [&[i64]; 2],
        pair: usize,
        slice: usize,
        live: usize,
        sums: &mut [i64],
        seen: &mut Seen,
    ) {
        let weight = slice as u32 * self.dac_bits;
        for (at, (sum, (&e, &i))) in sums.iter_mut().zip(e.iter().zip(i)).enumerate() {
            if at % PANEL_COLUMNS >= live {
                continue;
            }
            if let Some(adc) = self.probe {
                let entry = &mut seen.histogram[slice];
                let mut note = |v: i64| {
                    entry.0[adc.least_shift(v) as usize] += 1;
                    entry.1 = entry.1.max(v.abs());
                };
                if adc.min == 0 {
                    note(e);
                    note(i);
                } else {
                    note(e - i);
                }
            }
            match &self.converters {
                Some((converters, subtract)) if self.probe.is_none() => {
                    let adc = converters[slice];
                    let d = match subtract {
                        Subtract::Digital => {
                            let [e, i] = [e, i].map(|v| adc.convert(v));
                            let rails = [e, i].map(|(code, _)| u64::from(adc.is_rail(code)));
                            seen.reached[slice] += rails[0] + rails[1];
                            seen.saturated[2 * pair] += u64::from(e.1);
                            seen.saturated[2 * pair + 1] += u64::from(i.1);
                            e.0 - i.0
                        }
                        Subtract::Current => {
                            let (d, saturated) = adc.convert(e - i);
                            seen.saturated[2 * pair] += u64::from(saturated);
                            seen.reached[slice] += u64::from(adc.is_rail(d));
                            d
                        }
                    };
                    *sum += d << (adc.shift + weight);
                }
                _ => *sum += (e - i) << weight,
            }
        }
    }
}

/// Greatest slice of a drive.
fn slice_max(hardware: &Hardware) -> u8 {
    u8::MAX >> 8u32.saturating_sub(hardware.drive.dac_bits)
}

/// Sums stay below this: then rounding constants fit beside them.
const NARROW: u128 = 1 << 30;

/// What every sum of a read lies below, whatever the levels and drives; `None` where not every number keeps to the widths
/// of the kernels.
fn bound(
    layer: &Layer,
    hardware: &Hardware,
    pairs: usize,
    converters: Option<&(Vec<Converter>, Subtract)>,
) -> Option<u128> {
    let ceiling = u128::from(hardware.level_greatest());
    // of codes of both phases one is taken off the other
    let (rows, pairs) = (layer.layout.rows, (pairs * layer.spec.driven_by.phases()) as u128);
    let current = |rows: usize, code: u32| rows as u128 * ceiling * u128::from(code);
    match converters {
        None => {
            let most = pairs * current(rows, hardware.drive.bits.code_max().into());
            (layer.layout.blocks() <= CHUNK_BLOCKS && most < NARROW).then_some(most + 1)
        }
        Some((_, Subtract::Current)) => None,
        Some((converters, Subtract::Digital)) => {
            let tiles = rows.div_ceil(hardware.tile.rows) as u128;
            let slice_max = (1 << hardware.drive.dac_bits.min(hardware.drive.bits.get())) - 1;
            let fits = |(slice, adc): (u32, &Converter)| {
                let codes = tiles * adc.max.unsigned_abs() as u128;
                let total = codes << (adc.shift.min(64) + slice * hardware.drive.dac_bits);
                let inside = adc.shift <= Conversion::SHIFT_MAX && codes < 1 << 15;
                (inside && pairs * total < NARROW / 8).then_some(pairs * total)
            };
            let narrow = hardware.cell.level_bits.get() <= 8
                && tiles < 1024
                && current(hardware.tile.rows.min(rows), slice_max) < NARROW;
            let slices = || (0..).zip(converters).map(fits);
            let most = narrow.then(|| slices().sum::<Option<u128>>()).flatten()?;
            Some(most + 1)
        }
    }
}

/// How rows are taken together.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Tiles {
    /// All rows, in chunks whose sums fit 32 bits; the full code.
    Whole,
    /// Tiles one after the other in one read, where their edges allow it.
    Together,
    /// A read a tile.
    Apart,
}

/// Slices and tiles of a batch of drives.
fn tile_reads<'a>(
    layer: &Layer,
    hardware: &Hardware,
    drives: &'a [u8],
    samples: usize,
    tiles: Tiles,
) -> Vec<TileRead<'a>> {
    let blocks = layer.layout.blocks();
    let size = samples * BLOCK_ROWS;
    let drives = &drives[..blocks * size];
    if tiles == Tiles::Whole {
        let starts = (0..blocks).step_by(CHUNK_BLOCKS);
        let chunk = |start: usize| start..(start + CHUNK_BLOCKS).min(blocks);
        return starts
            .map(chunk)
            .map(|blocks| TileRead {
                slice: 0,
                tile_blocks: blocks.len(),
                codes: Cow::Borrowed(&drives[blocks.start * size..blocks.end * size]),
                blocks,
                sums: vec![],
            })
            .collect();
    }
    let (dac_bits, slices) = (hardware.drive.dac_bits, hardware.slices());
    let aligned =
        hardware.tile.rows.is_multiple_of(BLOCK_ROWS) || layer.layout.rows <= hardware.tile.rows;
    let mut reads = Vec::new();
    for slice in 0..slices {
        let sliced = |codes: &'a [u8]| -> Cow<'a, [u8]> {
            if slices == 1 {
                Cow::Borrowed(codes)
            } else {
                codes.iter().map(|&x| periphery::slice(x, slice, dac_bits)).collect()
            }
        };
        if tiles == Tiles::Together && aligned {
            let tile_blocks = hardware.tile.rows.div_ceil(BLOCK_ROWS);
            let codes = sliced(drives);
            let (slice, sums) = (slice as usize, vec![]);
            reads.push(TileRead { slice, blocks: 0..blocks, tile_blocks, codes, sums });
            continue;
        }
        for rows in layer.row_tiles(hardware) {
            let blocks = rows.start / BLOCK_ROWS..rows.end.div_ceil(BLOCK_ROWS);
            let mut codes = sliced(&drives[blocks.start * size..blocks.end * size]);
            if !aligned {
                silence(codes.to_mut(), blocks.clone(), &rows, size);
            }
            debug_assert!(blocks.len() <= CHUNK_BLOCKS, "a converted tile is one chunk");
            let tile_blocks = blocks.len();
            let (slice, sums) = (slice as usize, vec![]);
            reads.push(TileRead { slice, blocks, tile_blocks, codes, sums });
        }
    }
    reads
}

/// A tile's edge lies inside a block: drives of its neighbours' rows become 0.
fn silence(codes: &mut [u8], blocks: Range<usize>, rows: &Range<usize>, size: usize) {
    for (block, codes) in blocks.zip(codes.chunks_exact_mut(size)) {
        let first = block * BLOCK_ROWS;
        let from = rows.start.saturating_sub(first).min(BLOCK_ROWS);
        let to = (rows.end - first).min(BLOCK_ROWS);
        for codes in codes.chunks_exact_mut(BLOCK_ROWS) {
            codes[..from].fill(0);
            codes[to..].fill(0);
        }
    }
}
