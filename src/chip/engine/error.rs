//! `ERR`: taps and gates.
//!
//! ```text
//! err      word of the unit's tap; more than one tap: sat_eb( rsh(sum, tap_shift) ); stream n receives -err,
//!          or err where the delivery says that streams are alike
//! u        sat_8( rsh( err * a', error_bits ) )
//! ```
//!
//! In a convolution all positions of a sample hear its word, or each that of its pixel behind the pool where words come from
//! the rows of the layer above.
//!
//! See docs/MODEL.md, 3.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use std::borrow::Cow;
use std::ops::Range;

use super::Engine;
use super::each::{MOVE, each};
use super::window::spread;
use crate::chip::crossbar::kernel::Kernel;
use crate::chip::crossbar::layout::{BLOCK_ROWS, HALF_COLUMNS};
use crate::chip::layer::{Pool, Taps, WordSource};
use crate::chip::ledger::{During, Event};
use crate::chip::periphery;
use crate::chip::population::Stream;
use crate::num::fixed::{ErrorBits, log2_ceil, rail, rsh, sat};

/// Samples of a packed update, padded: words of four, or whole tiles of 64 where that costs less than half.
pub(super) const fn stride_of(samples: usize) -> usize {
    samples.next_multiple_of(if samples > 32 { 64 } else { 4 })
}

/// Place of a gate in the packed registers of a layer.
pub(super) const fn packed_at(stride: usize, sample: usize, unit: usize) -> usize {
    unit / HALF_COLUMNS * HALF_COLUMNS * stride
        + sample / 4 * 64
        + unit % HALF_COLUMNS * 4
        + sample % 4
}

impl Engine {
    pub(super) fn error(&mut self, layer: usize, samples: Range<usize>, words: &[i16]) {
        let this = &self.layers[layer];
        let (taps, units, wiring) = (&this.delivery.taps, this.layout.columns, this.spec.wiring);
        let alike = this.delivery.alike;
        let (heard, above) = (this.heard(), this.delivery.source == WordSource::Above);
        assert_eq!(words.len(), samples.len() * heard * taps.width, "a word a bus slot and sample");
        // sums are formed when they are programmed: what they are formed of must still be there
        let pending = self.registers[layer].pending;
        assert!(samples.is_empty() || samples.start >= pending, "sums wait to be programmed");
        let bits = self.hardware.digital.error_bits;
        let registers = &mut self.registers[layer];
        let spec = &this.spec;
        let positions = spec.positions();
        let (loaded, reads) = (self.samples * positions, samples.len() * positions);
        let stride = stride_of(loaded);
        let blocks = units.div_ceil(BLOCK_ROWS);
        let (mut saturated_words, mut saturated_gates) = (0, [0; 2]);
        for &target in wiring.targets() {
            registers.gates[target.index()].resize(blocks * stride * BLOCK_ROWS, 0);
        }
        // kernels take what an error unit gives: words inside their rail
        let largest = words.iter().fold(0, |most: u16, word| most.max(word.unsigned_abs()));
        let inside = i64::from(largest) <= rail(bits.get());
        let all = inside && samples == (0..self.samples);
        // [block] -> (target, derivatives, codes where the greatest of them is asked for, gates)
        let size = loaded * BLOCK_ROWS;
        let asked = above && matches!(spec.pool, Pool::Max { side: 2.. });
        let mut parts: Vec<_> = (0..blocks).map(|block| (block, (block, Vec::new()))).collect();
        for (target, gates) in [Stream::P, Stream::N].into_iter().zip(&mut registers.gates) {
            let slopes = registers.derivatives[target.index()].chunks_exact(size.max(1));
            let mut codes = registers.maps[target.index()].chunks_exact(size.max(1));
            let registers = slopes.zip(gates.chunks_exact_mut((stride * BLOCK_ROWS).max(1)));
            if wiring.targets().contains(&target) {
                for ((_, (_, part)), (slopes, gates)) in parts.iter_mut().zip(registers) {
                    let codes = codes.next().filter(|_| asked).unwrap_or_default();
                    part.push((target, slopes, codes, gates));
                }
            }
        }
        let work = reads * units * wiring.targets().len() * MOVE;
        // words that come back are those of a position, and all others are those of a sample
        let shared = if above { 1 } else { positions };
        let seen = each(&mut self.team, work, blocks, parts, |kernel, (block, part)| {
            let mut errors = vec![0; samples.len() * heard * BLOCK_ROWS];
            let saturated_words = latch(kernel, taps, bits, block, words, &mut errors);
            let mut saturated_gates = [0; 2];
            for (target, slopes, codes, gates) in part {
                let mut errors = Cow::Borrowed(&errors[..]);
                if above && spec.pool.side() > 1 {
                    let codes = codes.get(samples.start * positions * BLOCK_ROWS..);
                    errors = spread(spec, &errors, codes.unwrap_or_default()).into();
                }
                let negate = target == Stream::N && !alike;
                let count = &mut saturated_gates[target.index()];
                if all {
                    let errors = (&errors[..], shared);
                    *count += kernel.gate_shared(errors, slopes, negate, bits, stride, gates);
                    continue;
                }
                let sign = if negate { -1 } else { 1 };
                let reads = samples.start * positions..samples.end * positions;
                let errors = errors.chunks_exact(BLOCK_ROWS);
                let errors = errors.flat_map(|errors| std::iter::repeat_n(errors, shared));
                for (sample, errors) in reads.zip(errors) {
                    for (unit, &error) in errors.iter().enumerate() {
                        let slope = slopes[sample * BLOCK_ROWS + unit];
                        let (u, saturated) = periphery::gate(sign * error, slope, bits);
                        *count += u64::from(saturated);
                        gates[packed_at(stride, sample, unit)] = u;
                    }
                }
            }
            (saturated_words, saturated_gates)
        });
        for (words, gates) in seen {
            saturated_words += words;
            saturated_gates.iter_mut().zip(gates).for_each(|(sum, count)| *sum += count);
        }
        let (width, count) = (taps.width as u64, (samples.len() * heard) as u64);
        // which position of a square had the greatest code is stored and fetched
        let places = u64::from(log2_ceil(spec.pool.side().pow(2) as u64));
        let asked = if asked { 2 * places * count * units as u64 } else { 0 };
        for &target in wiring.targets() {
            let code = Self::code_of(wiring, target);
            let during = During::Error;
            self.charge(layer, code, during, Event::BusWords, width * count);
            let gates = (units * reads) as u64;
            self.charge(layer, code, during, Event::Multiplies, gates);
            self.charge(layer, code, during, Event::SramBits, gates * 8 + asked);
            let saturated = saturated_gates[target.index()];
            self.charge(layer, code, during, Event::SaturatedGates, saturated);
        }
        let code = Self::code_of(wiring, Stream::P);
        self.charge(layer, code, During::Error, Event::SaturatedErrors, saturated_words);
    }
}

/// Gates of some samples of `loaded` ones, packed as an update of just these takes them.
pub(super) fn gates_of<'a>(
    packed: &'a [i8],
    loaded: usize,
    samples: &Range<usize>,
) -> Cow<'a, [i8]> {
    if *samples == (0..loaded) {
        return Cow::Borrowed(packed);
    }
    let (from, to) = (stride_of(loaded), stride_of(samples.len()));
    let units = packed.len() / from;
    let mut out = vec![0; units * to];
    for unit in 0..units {
        for (b, sample) in samples.clone().enumerate() {
            out[packed_at(to, b, unit)] = packed[packed_at(from, sample, unit)];
        }
    }
    Cow::Owned(out)
}

/// Error words of a block of 64 units, `[sample][64]`, and how many saturated.
fn latch(
    kernel: &Kernel,
    taps: &Taps,
    bits: ErrorBits,
    block: usize,
    words: &[i16],
    errors: &mut [i16],
) -> u64 {
    let units = taps.words.len() / taps.per_unit;
    let live = (units - block * BLOCK_ROWS).min(BLOCK_ROWS);
    let taps_here = &taps.words[block * BLOCK_ROWS * taps.per_unit..][..live * taps.per_unit];
    if taps.per_unit == 1 {
        kernel.latch(words, taps.width, taps_here, errors);
        return 0;
    }
    let mut saturated = 0;
    for (words, errors) in words.chunks_exact(taps.width).zip(errors.chunks_exact_mut(BLOCK_ROWS)) {
        let (errors, beyond) = errors.split_at_mut(live);
        beyond.fill(0);
        for (error, tapped) in errors.iter_mut().zip(taps_here.chunks_exact(taps.per_unit)) {
            let sum: i64 = tapped.iter().map(|&word| i64::from(words[usize::from(word)])).sum();
            let (bounded, changed) = sat(rsh(sum, taps.shift), bits.get());
            saturated += u64::from(changed);
            *error = bounded as i16;
        }
    }
    saturated
}
