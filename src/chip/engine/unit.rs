//! The error unit beside the output layer: output words, and words of layers that do not hear those as they are.
//!
//! ```text
//! none      S = sat_eb( rsh(e, 9 - error_bits) )
//! batch     c = B' e - sum_b' e;  S = sat_eb( floor((2 c + m) / (2 m)) ),  m = B' 2^(9 - error_bits)
//! running   S = sat_eb( rsh((e << 8) - mu, 17 - error_bits) ),  then mu += rsh((e << 8) - mu, 8)
//! handed    S = sat_eb( rsh(e, 23 - error_bits) )             e with 20 fractional bits; no centre
//! softmax   e = 255 onehot - p, p by `num::tables::SoftmaxTables`:  2 CE + 1 look-ups a sample, one a beat, before any mean
//! ```
//!
//! `e` is the error of an output in activity codes or, where a task hands it itself, a number whose 4 is just beyond the
//! greatest word: `floor(e 2^(error_bits - 3) + 1/2)`. B' is the size of the batch. A mean over the batch takes `B' CE + CE` beats. See
//! docs/MODEL.md, 3.1.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use super::{Engine, Recorded};
use crate::chip::ledger::{During, Event};
use crate::chip::population::Stream;
use crate::chip::state::{Piece, Section, State, StateError, Visitor};
use crate::num::fixed::{ErrorBits, rsh, sat};
use crate::num::tables::SoftmaxTables;

/// What is subtracted from the error of a class.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Centre {
    /// Nothing.
    None,
    /// The mean over the batch (paper, section 3.3).
    Batch,
    /// A running mean: state.
    Running,
}

/// The error unit beside the output layer.
#[derive(Debug, Clone)]
pub struct ErrorUnit {
    centre: Centre,
    bits: ErrorBits,
    /// Bits that are rounded off an error without a centre.
    shift: u32,
    /// `mu`, 8 fractional bits, by output; empty unless the centre runs.
    means: Vec<i64>,
    /// What it looks accumulators up in, where classes share by softmax.
    softmax: Option<SoftmaxTables>,
}

impl ErrorUnit {
    /// A unit for `outputs` channels.
    #[must_use]
    pub fn new(centre: Centre, bits: ErrorBits, outputs: usize) -> Self {
        let means = if centre == Centre::Running { vec![0; outputs] } else { vec![] };
        Self { centre, bits, shift: 9 - bits.get(), means, softmax: None }
    }

    /// The same unit, where classes share by softmax: it looks the accumulators of outputs up before their errors are there.
    #[must_use]
    pub fn with_softmax(self, tables: SoftmaxTables) -> Self {
        Self { softmax: Some(tables), ..self }
    }

    /// What it looks accumulators up in, where classes share by softmax.
    #[must_use]
    pub const fn softmax(&self) -> Option<&SoftmaxTables> {
        self.softmax.as_ref()
    }

    /// Fractional bits of errors that a task hands itself.
    pub const POINT: u32 = 20;

    /// A unit for errors that a task hands itself, with [`ErrorUnit::POINT`] fractional bits. Nothing is subtracted.
    #[must_use]
    pub const fn handed(bits: ErrorBits) -> Self {
        let shift = Self::POINT + 3 - bits.get();
        Self { centre: Centre::None, bits, shift, means: vec![], softmax: None }
    }

    /// Bits that are rounded off an error without a centre.
    #[must_use]
    pub const fn shift(&self) -> u32 {
        self.shift
    }

    /// What is subtracted from errors.
    #[must_use]
    pub const fn centre(&self) -> Centre {
        self.centre
    }

    /// Whether every word waits for the errors of the whole batch.
    #[must_use]
    pub fn waits_for_batch(&self) -> bool {
        self.centre == Centre::Batch
    }

    /// Running means, 8 fractional bits; empty unless the centre runs.
    #[must_use]
    pub fn means(&self) -> &[i64] {
        &self.means
    }

    /// Words for a batch of errors `[sample][output]`, and how many saturated.
    pub fn words(&mut self, errors: &[i32], outputs: usize) -> (Vec<i16>, u64) {
        let bits = self.bits.get();
        let mut saturated = 0;
        let mut bounded = |v: i64| {
            let (word, changed) = sat(v, bits);
            saturated += u64::from(changed);
            word as i16
        };
        let words = match self.centre {
            Centre::None => errors.iter().map(|&e| bounded(rsh(e.into(), self.shift))).collect(),
            Centre::Batch => {
                let samples = (errors.len() / outputs) as i64;
                let mut sums = vec![0i64; outputs];
                for errors in errors.chunks_exact(outputs) {
                    sums.iter_mut().zip(errors).for_each(|(sum, &e)| *sum += i64::from(e));
                }
                let m = samples << (9 - bits);
                let centred = |(&e, &sum): (&i32, &i64)| samples * i64::from(e) - sum;
                errors
                    .iter()
                    .zip(sums.iter().cycle())
                    .map(centred)
                    .map(|c| {
                        let c = 2 * c + m;
                        // a batch of a power of two, which most are, needs no division
                        bounded(if m.count_ones() == 1 {
                            c >> (m.trailing_zeros() + 1)
                        } else {
                            c.div_euclid(2 * m)
                        })
                    })
                    .collect()
            }
            Centre::Running => {
                let mut words = Vec::with_capacity(errors.len());
                for errors in errors.chunks_exact(outputs) {
                    for (mean, &e) in self.means.iter_mut().zip(errors) {
                        let off = (i64::from(e) << 8) - *mean;
                        words.push(bounded(rsh(off, 17 - bits)));
                        *mean += rsh(off, 8);
                    }
                }
                words
            }
        };
        (words, saturated)
    }
}

impl State for ErrorUnit {
    fn visit(&mut self, visitor: &mut dyn Visitor) -> Result<(), StateError> {
        if self.means.is_empty() {
            return Ok(());
        }
        // a mean of errors of at most 255, 8 fractional bits
        let within = -(256 << 8)..=256 << 8;
        let piece = Piece { name: "means", section: Some(Section::Centres), within };
        if let Some(means) = visitor.numbers(&piece, &self.means)? {
            self.means = means;
        }
        Ok(())
    }
}

impl Engine {
    /// Makes output words of the errors of the loaded samples, `[sample][output]`.
    pub fn output_words(&mut self, errors: &[i32]) -> Vec<i16> {
        if let Some(tape) = &mut self.tape {
            tape.push(Recorded::Words { errors: errors.to_vec() });
        }
        let last = self.layers.len() - 1;
        let (wiring, outputs) = (self.layers[last].spec.wiring, self.layers[last].spec.units);
        assert!(errors.len().is_multiple_of(outputs), "errors come in whole samples");
        let (words, saturated) = self.unit.words(errors, outputs);
        let code = Self::code_of(wiring, Stream::P);
        self.charge(last, code, During::Error, Event::SaturatedErrors, saturated);
        let samples = errors.len() / outputs;
        if self.unit.softmax.is_some() {
            let each = 2 * outputs as u64 + 1;
            let look_ups = samples as u64 * each;
            self.charge(last, code, During::Error, Event::SoftmaxLookUps, look_ups);
            self.time(|schedule, cycles| schedule.look_up_outputs(cycles, look_ups));
        }
        if self.unit.waits_for_batch() {
            self.time(|schedule, cycles| schedule.centre(cycles, samples, outputs));
        }
        words
    }

    /// The error unit.
    #[must_use]
    pub const fn error_unit(&self) -> &ErrorUnit {
        &self.unit
    }

    /// Puts another error unit beside the output layer.
    pub fn set_error_unit(&mut self, unit: ErrorUnit) {
        self.unit = unit;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn unit(centre: Centre, bits: i64) -> ErrorUnit {
        ErrorUnit::new(centre, ErrorBits::new(bits).unwrap(), 2)
    }

    #[test]
    fn uncentred_words_halve_and_saturate_symmetrically() {
        let (words, saturated) = unit(Centre::None, 8).words(&[255, -255, 1, -1, 3, 254], 2);
        assert_eq!((words, saturated), (vec![127, -127, 1, 0, 2, 127], 1));
        let (words, saturated) = unit(Centre::None, 9).words(&[255, -255], 2);
        assert_eq!((words, saturated), (vec![255, -255], 0));
    }

    #[test]
    fn a_running_centre_moves_after_the_word_is_made() {
        let mut unit = unit(Centre::Running, 8);
        let (words, _) = unit.words(&[128, -128], 2);
        assert_eq!((words, unit.means()), (vec![64, -64], &[128, -128][..]));
        let mut again = unit.clone();
        again.means = vec![128 << 8, -(128 << 8)];
        assert_eq!(again.words(&[128, -128], 2).0, [0, 0]);
    }

    #[test]
    fn a_batch_of_one_has_no_centred_error() {
        assert_eq!(unit(Centre::Batch, 8).words(&[255, -3], 2).0, [0, 0]);
    }

    proptest! {
        #[test]
        fn batch_centred_words_are_the_rounded_deviation(
            errors in prop::collection::vec(-255i32..=255, 2..80), bits in 2i64..=9,
        ) {
            let errors = &errors[..errors.len() / 2 * 2];
            let (words, _) = unit(Centre::Batch, bits).words(errors, 2);
            let samples = (errors.len() / 2) as i64;
            for (i, (&e, &word)) in errors.iter().zip(&words).enumerate() {
                let sum: i64 = errors.iter().skip(i % 2).step_by(2).map(|&e| i64::from(e)).sum();
                let (c, m) = (samples * i64::from(e) - sum, samples << (9 - bits));
                let rail = (1 << (bits - 1)) - 1;
                let word = i64::from(word);
                // the nearest whole number to c / m, halves up, unless the rail is nearer
                prop_assert!(word == rail || 2 * c < (2 * word + 1) * m);
                prop_assert!(word == -rail || (2 * word - 1) * m <= 2 * c);
                prop_assert!(word.abs() <= rail);
            }
        }
    }

    #[test]
    fn errors_that_are_handed_saturate_at_4() {
        let of = |bits: i64, errors: &[i32]| {
            ErrorUnit::handed(ErrorBits::new(bits).unwrap()).words(errors, 1)
        };
        let one = 1 << ErrorUnit::POINT;
        assert_eq!(of(8, &[one, -one, 3 * one, 0]), (vec![32, -32, 96, 0], 0));
        // 4 is word 128, which 127 bounds; halves round up
        assert_eq!(of(8, &[4 * one, -4 * one, i32::MAX]), (vec![127, -127, 127], 3));
        assert_eq!(of(8, &[one >> 6, -(one >> 6), (one >> 6) - 1]), (vec![1, 0, 0], 0));
        assert_eq!(of(2, &[one, -one, 4 * one]), (vec![1, 0, 1], 1));
    }
}
