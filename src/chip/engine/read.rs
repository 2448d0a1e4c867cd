//! Reading a stream: which rows are read together, with which converters, and in which width.
//!
//! ```text
//! narrow   every sum fits 31 bits by the plan, and nobody has to see a current: kernels convert and look up
//! wide     anything else: 64 bits, one conversion after the other; all reads that are noisy, or of cells that conduct more or less
//!          than their level
//! ```
//!
//! Both give the same numbers. On the wide way currents exist as numbers in one place, [`Reader::currents`], between
//! the cells and the converters: what disturbs currents belongs there, and [`Mode::shows_currents`] keeps such reads
//! off the narrow way. See docs/MODEL.md, 2.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use std::borrow::Cow;
use std::ops::Range;

use super::conducting::{Common, Letting};
use super::homeostasis::{Noted, Notes};
use super::noise::{Beside, Noisy};
use crate::chip::crossbar::Crossbar;
use crate::chip::crossbar::kernel::{Banks, Conversion, Drives, Greatest, Kernel, Scratch};
use crate::chip::crossbar::layout::{BLOCK_ROWS, PANEL_COLUMNS};
use crate::chip::device::CONDUCTANCE_BITS;
use crate::chip::hardware::{Adc, Hardware, Subtract};
use crate::chip::layer::{CHUNK_BLOCKS, Layer};
use crate::chip::periphery::Converter;
use crate::chip::population::{BANKS_MAX, Stream, Wiring};
use crate::num::fixed::rsh;
use signed::{below_from_above, both_phases};
use tiles::{Tiles, tile_reads};

mod signed;
mod tiles;

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
    /// Physical tile, from the top; the first of several.
    tile: usize,
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
    /// Their numbers in the layer.
    at: [usize; 2],
    reads: [Vec<TileRead<'a>>; 2],
    /// What comes to the currents of each read, where cells conduct beside their levels.
    common: [Vec<Common>; 2],
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
    /// What conversions are off by.
    noisy: Option<Noisy>,
    /// What cells let through, if not their level.
    letting: Option<Letting>,
    /// What accumulators are multiplied by, 12 fractional bits.
    factor: Option<i64>,
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
        (mode, beside): (Mode, Beside),
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
        let narrow = bound.is_some() && !mode.shows_currents() && beside.is_nothing();
        let Beside { noise, letting, factor } = beside;
        let tiles = match (&converters, narrow) {
            // a lossless conversion is off all the same
            (None, _) if noise.is_none() && letting.is_none() => Tiles::Whole,
            (Some(_), true) => Tiles::Together,
            _ => Tiles::Apart,
        };
        let code_max = hardware.drive.bits.code_max();
        let phases = layer.spec.driven_by.phases();
        let reads = |at: usize| {
            let drives = drives(wiring.pathways()[at].source);
            tile_reads(layer, hardware, drives, samples * phases, tiles)
        };
        let pair = |places: &[usize; 2]| {
            let reads = places.map(reads);
            let common = [0, 1].map(|bank| match &letting {
                None => vec![],
                Some(letting) => {
                    let common = |read: &TileRead<'_>| {
                        let drives = (&*read.codes, samples * phases);
                        let first = read.blocks.start * BLOCK_ROWS;
                        Common::of(letting, places[bank], drives, first, hardware.tile.columns)
                    };
                    reads[bank].iter().map(common).collect()
                }
            });
            Pair { arrays: places.map(|at| &layer.arrays[at]), at: *places, reads, common }
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
                level: match &letting {
                    Some(Letting::Own(_)) => u8::MAX,
                    _ => u8::try_from(hardware.level_greatest()).unwrap_or(u8::MAX),
                },
                code: if tiles == Tiles::Whole {
                    code_max
                } else {
                    code_max.min(slice_max(hardware))
                },
            },
            noisy: noise.map(|noise| Noisy::new(noise, wiring, pairs, (phases, hardware))),
            letting,
            factor,
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
        self.read_both(kernel, part, sums, seen);
        if let Some(factor) = self.factor {
            sums.iter_mut().for_each(|sum| *sum = rsh(*sum * factor, 12));
        }
    }

    /// The same as they come out of the adders.
    fn read_both(&self, kernel: &Kernel, part: &PanelPart, sums: &mut [i64], seen: &mut Seen) {
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
                self.currents(kernel, pair, read, part, [&mut *e, &mut *i]);
                let TileRead { slice, tile, .. } = pair.reads[0][read];
                if let Some(noisy) = &self.noisy {
                    let lines = (part.panel, part.live);
                    let both = [&mut *e, &mut *i];
                    noisy.disturb(at, (slice, tile), lines, &part.samples, both);
                }
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
        let PanelPart { panel, live, samples } = part.clone();
        for (bank, out) in [e, i].into_iter().enumerate() {
            let (array, of) = (pair.arrays[bank], &pair.reads[bank][read]);
            let drives = self.drives(of);
            let mut sums = [0; Scratch::SUMS];
            let sums = &mut sums[..out.len()];
            let mut add = |plane: &[u8], place: usize, out: &mut [i64]| {
                kernel.read(plane, drives, samples.clone(), sums);
                let weighed = sums.iter().map(|&sum| i64::from(sum) << (8 * place));
                out.iter_mut().zip(weighed).for_each(|(out, sum)| *out += sum);
            };
            out.fill(0);
            if let Some(Letting::Own(all)) = &self.letting {
                let planes = all[pair.at[bank]].planes(panel, of.blocks.clone());
                planes.enumerate().for_each(|(place, plane)| add(plane, place, out));
                out.iter_mut().for_each(|sum| *sum = rsh(*sum, CONDUCTANCE_BITS));
            } else {
                add(array.low(panel, of.blocks.clone()), 0, out);
                if let Some(high) = array.high(panel, of.blocks.clone()) {
                    add(high, 1, out);
                }
            }
            let Some(common) = pair.common[bank].get(read).filter(|of| !of.is_nothing()) else {
                continue;
            };
            let first = panel * PANEL_COLUMNS;
            for (driving, out) in samples.clone().zip(out.chunks_exact_mut(PANEL_COLUMNS)) {
                let lines = out[..live].iter_mut().zip(first..);
                lines.for_each(|(sum, column)| *sum += common.at(driving, column));
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
