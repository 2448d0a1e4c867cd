//! Words of a layer, formed from the output words or from what the layer above read from its columns.
//!
//! ```text
//! sum, signed   ceil( CE N / U ) beats of the error unit before the N words of a sample cross the bus
//! above         no beat of its own: the lanes that end a transposed read scale and bound what they pass on
//! ```
//!
//! What is formed: [`WordSource`](crate::chip::layer::WordSource). See docs/MODEL.md, 3.2, 3.8 and 4.5.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use std::borrow::Cow;
use std::ops::Range;

use super::Engine;
use crate::chip::layer::WordSource;
use crate::chip::ledger::{During, Event};
use crate::chip::population::Stream;
use crate::num::fixed::{ErrorBits, rail, rsh, sat};

/// Words of at most 9 bits, with any signs, that add up inside 16 bits.
const SIGNED_PART: usize = 128;

impl Engine {
    /// The words that some samples put on a layer's bus, from the output words of an `ERR`.
    pub(super) fn layer_words<'a>(
        &mut self,
        layer: usize,
        samples: &Range<usize>,
        output: &'a [i16],
    ) -> Cow<'a, [i16]> {
        let delivery = &self.layers[layer].delivery;
        let outputs = delivery.output_words();
        assert_eq!(output.len(), samples.len() * outputs, "a word an output and sample");
        let bits = self.hardware.digital.error_bits;
        let bounded = || output.iter().all(|&word| i64::from(word).abs() <= rail(bits.get()));
        let (words, saturated) = match &delivery.source {
            WordSource::Output => return Cow::Borrowed(output),
            WordSource::Sum { shift, .. } => {
                assert!(bounded(), "output words lie inside their rail");
                sums(output, outputs, *shift, bits)
            }
            WordSource::Signed { signs, shift } => {
                assert!(bounded(), "output words lie inside their rail");
                signed(output, outputs, signs, *shift, bits)
            }
            WordSource::Above => self.words_above(layer, samples),
        };
        let dense = matches!(delivery.source, WordSource::Signed { .. });
        let products = if dense { samples.len() * delivery.terms() } else { 0 };
        let code = Self::code_of(self.layers[layer].spec.wiring, Stream::P);
        self.charge(layer, code, During::Error, Event::SaturatedErrors, saturated);
        self.charge(layer, code, During::Error, Event::Multiplies, products as u64);
        Cow::Owned(words)
    }

    /// What the layer above read from its columns, as words.
    fn words_above(&self, layer: usize, samples: &Range<usize>) -> (Vec<i16>, u64) {
        let above = &self.layers[layer + 1];
        let (sums, inputs) = (&self.registers[layer + 1].backward, above.spec.sample_sums());
        assert_eq!(sums.len(), self.samples * inputs, "the layer above was read backwards");
        backward_words(
            &sums[samples.start * inputs..samples.end * inputs],
            above.back_shift(&self.hardware),
            self.hardware.digital.error_bits,
        )
    }
}

/// A word a sample: the sum of its output words; and how many saturated.
fn sums(output: &[i16], outputs: usize, shift: u32, bits: ErrorBits) -> (Vec<i16>, u64) {
    let mut saturated = 0;
    let word = |words: &[i16]| {
        let sum: i64 = words.iter().map(|&word| i64::from(word)).sum();
        let (word, changed) = sat(rsh(sum, shift), bits.get());
        saturated += u64::from(changed);
        word as i16
    };
    (output.chunks_exact(outputs).map(word).collect(), saturated)
}

/// A word a unit and sample: sums of output words with signs, `[output][unit]`; and how many saturated.
fn signed(
    output: &[i16],
    outputs: usize,
    signs: &[i16],
    shift: u32,
    bits: ErrorBits,
) -> (Vec<i16>, u64) {
    let units = signs.len() / outputs;
    let mut saturated = 0;
    let mut words = Vec::with_capacity(output.len() / outputs * units);
    let (mut sums, mut part) = (vec![0i32; units], vec![0i16; units]);
    for sample in output.chunks_exact(outputs) {
        sums.fill(0);
        let parts = sample.chunks(SIGNED_PART).zip(signs.chunks(SIGNED_PART * units));
        for (sample, signs) in parts {
            // one output after the other, so that units lie side by side
            part.fill(0);
            for (&word, signs) in sample.iter().zip(signs.chunks_exact(units)) {
                part.iter_mut().zip(signs).for_each(|(sum, sign)| *sum += word * sign);
            }
            sums.iter_mut().zip(&part).for_each(|(sum, &p)| *sum += i32::from(p));
        }
        let from = words.len();
        words.resize(from + units, 0);
        saturated += bounded_all(&sums, shift, bits, &mut words[from..]);
    }
    (words, saturated)
}

/// `sat( rsh(sum, shift) )` of sums below 2^30, side by side; how many saturated.
fn bounded_all(sums: &[i32], shift: u32, bits: ErrorBits, words: &mut [i16]) -> u64 {
    let rail = rail(bits.get()) as i32;
    // at 31 such sums are all rounded off
    let shift = shift.min(31);
    let half = if shift == 0 { 0 } else { 1 };
    let before = shift.saturating_sub(1);
    let mut saturated = 0u32;
    for (word, &sum) in words.iter_mut().zip(sums) {
        let rounded = (sum >> shift) + (sum >> before & half);
        let bounded = rounded.clamp(-rail, rail);
        saturated += u32::from(bounded != rounded);
        *word = bounded as i16;
    }
    u64::from(saturated)
}

/// Row sums of a transposed read as error words.
///
/// ```text
/// S_below = sat_eb( rsh( d, shift ) )
/// ```
///
/// The shift is that of [`Layer::back_shift`](crate::chip::layer::Layer::back_shift); a negative one is a multiplication.
/// The derivative's peak, `1 / (2 alpha)`, is left to the layer's rate.
fn backward_words(sums: &[i64], shift: i64, bits: ErrorBits) -> (Vec<i16>, u64) {
    let rail = rail(bits.get());
    let mut saturated = 0;
    // no branch: which sums saturate is hard to guess
    let mut bounded = |scaled: i64| {
        let word = scaled.clamp(-rail, rail);
        saturated += u64::from(word != scaled);
        word as i16
    };
    let mut words = vec![0; sums.len()];
    let pairs = words.iter_mut().zip(sums);
    match u32::try_from(shift) {
        Ok(0) => pairs.for_each(|(word, &d)| *word = bounded(d)),
        // `rsh` of at most 63
        Ok(right) => {
            let right = right.min(63);
            pairs.for_each(|(word, &d)| *word = bounded((d >> right) + (d >> (right - 1) & 1)));
        }
        Err(_) => pairs.for_each(|(word, &d)| *word = bounded(d << shift.unsigned_abs())),
    }
    (words, saturated)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn backward_sums_are_scaled_by_the_worth_of_a_level_and_bounded() {
        let eight = ErrorBits::new(8).unwrap();
        // 8 bits, weight_max 4: 64 levels are a weight of 1
        let (words, saturated) =
            backward_words(&[64, 32, -32, 31, 64 * 127, 64 * 128], 8 - 2, eight);
        assert_eq!((words, saturated), (vec![1, 1, 0, 0, 127, 127], 1));
        // 1 bit, weight_max 4: a level is worth 2
        assert_eq!(backward_words(&[3, -5], 1 - 2, eight).0, [6, -10]);
    }

    #[test]
    fn words_are_added_with_their_signs_and_bounded() {
        let bits = ErrorBits::new(8).unwrap();
        assert_eq!(sums(&[4, 4, 3, -1, 0, 0, 127, 127, 127], 3, 1, bits), (vec![6, 0, 127], 1));
        let signs = [1, -1, 1, 1, 1, -1]; // two outputs, three units
        let (words, saturated) = signed(&[100, 50, -7, 3], 2, &signs, 0, bits);
        assert_eq!((words, saturated), (vec![127, -50, 50, -4, 10, -10], 1));
    }

    proptest! {
        #[test]
        fn sums_side_by_side_are_bounded_as_one(
            sums in proptest::collection::vec(-(1i32 << 30) + 1..1 << 30, 1..40),
            small in proptest::collection::vec(-2000i32..2000, 1..40),
            shift in 0u32..70,
            bits in 2i64..=9,
        ) {
            let bits = ErrorBits::new(bits).unwrap();
            for sums in [sums, small] {
                let mut words = vec![0; sums.len()];
                let saturated = bounded_all(&sums, shift, bits, &mut words);
                let want = sums.iter().map(|&sum| sat(rsh(i64::from(sum), shift), bits.get()));
                let want: Vec<_> = want.collect();
                prop_assert_eq!(saturated, want.iter().map(|w| u64::from(w.1)).sum::<u64>());
                prop_assert!(words.iter().zip(&want).all(|(&word, w)| i64::from(word) == w.0));
            }
        }
    }
}
