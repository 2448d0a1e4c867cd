//! The shadow's error unit: output words, and the words of layers that do not hear those as they are.

use std::ops::Range;

use dalean::chip::layer::WordSource;
use dalean::chip::ledger::{During, Event};
use dalean::chip::population::Stream;
use dalean::learn::error::Centre;

use super::{Fault, Shadow, rsh, sat};

impl Shadow {
    /// Output words of the errors of all samples.
    pub(crate) fn output_words(&mut self, errors: &[i32]) -> Vec<i16> {
        let last = self.layers.len() - 1;
        let outputs = self.layers[last].spec.units;
        let bits = self.net.hardware.digital.error_bits.get();
        let samples = (errors.len() / outputs) as i64;
        let (mut words, mut saturated) = (vec![], 0);
        for (at, &error) in errors.iter().enumerate() {
            let (output, e) = (at % outputs, i64::from(error));
            let exact = match self.net.centre {
                Centre::None => rsh(e, 9 - bits),
                Centre::Batch => {
                    let all = errors.iter().skip(output).step_by(outputs);
                    let sum: i64 = all.map(|&e| i64::from(e)).sum();
                    let sum = if self.is(Fault::MeanForgotten) { 0 } else { sum };
                    let (c, m) = (samples * e - sum, samples << (9 - bits));
                    (2 * c + m).div_euclid(2 * m)
                }
                Centre::Running => {
                    let off = (e << 8) - self.means[output];
                    self.means[output] += rsh(off, 8);
                    rsh(off, 17 - bits)
                }
                other => panic!("the shadow knows no {other:?}"),
            };
            let (word, changed) = sat(exact, bits);
            saturated += u64::from(changed);
            words.push(word as i16);
        }
        let code = self.unit_code(last, Stream::P);
        self.count(last, code, During::Error, Event::SaturatedErrors, saturated);
        words
    }

    /// Writes of a batch, or of so many single samples, are done: converters that track are looked at.
    pub(crate) fn written(&mut self, samples: Option<u32>) {
        let Some(samples) = samples else { return self.look() };
        for _ in 0..samples {
            self.unlooked += 1;
            if self.unlooked == 64 {
                self.look();
            }
        }
    }

    fn look(&mut self) {
        self.unlooked = 0;
        let stays = self.is(Fault::ShiftStays);
        let kept = self.is(Fault::RailsAreKept);
        for layer in &mut self.layers {
            for (t, rails) in layer.rails.iter_mut().enumerate() {
                for (s, counts) in rails.iter_mut().enumerate() {
                    let [on_rail, codes] = *counts;
                    let grows = on_rail as f64 > codes as f64 / 64.0;
                    layer.adc_shifts[t][s] += u32::from(grows && !stays);
                    *counts = if kept { *counts } else { [0; 2] };
                }
            }
        }
    }

    /// What some samples put on a layer's bus.
    pub(super) fn layer_words(
        &mut self,
        layer: usize,
        samples: &Range<usize>,
        output: &[i16],
    ) -> Vec<i16> {
        let delivery = self.layers[layer].delivery.clone();
        let bits = self.net.hardware.digital.error_bits.get();
        let (outputs, units) = (delivery.output_words(), delivery.taps.width);
        let mut exact = vec![];
        let mut products = 0;
        for (at, sample) in samples.clone().enumerate() {
            let heard = output.iter().skip(at * outputs).take(outputs).map(|&s| i64::from(s));
            match &delivery.source {
                WordSource::Output => return output.to_vec(),
                WordSource::Sum { shift, .. } => exact.push(rsh(heard.sum(), *shift)),
                WordSource::Signed { signs, shift } => {
                    for unit in 0..units {
                        let sign = |c: usize| match signs[c * units + unit] {
                            _ if self.is(Fault::SignsIgnored) => 1,
                            sign => i64::from(sign),
                        };
                        let sum = heard.clone().enumerate().map(|(c, s)| s * sign(c)).sum();
                        exact.push(rsh(sum, *shift));
                        products += outputs as u64;
                    }
                }
                WordSource::Above => {
                    let above = &self.layers[layer + 1];
                    let hw = &self.net.hardware;
                    let by = hw.cell.level_bits.get() as i32 - above.spec.weight_max_log2 + 8
                        - bits as i32
                        + i32::from(self.is(Fault::WordsAboveOffByOne));
                    for d in &above.backward[sample * units..][..units] {
                        let scaled = |by: i32| match by {
                            0.. => rsh(*d, by as u32),
                            _ => d * 2i64.pow(by.unsigned_abs()),
                        };
                        exact.push(scaled(by));
                    }
                }
            }
        }
        let mut saturated = 0;
        let word = |exact: i64| {
            let (word, changed) = sat(exact, bits);
            saturated += u64::from(changed);
            word as i16
        };
        let words = exact.into_iter().map(word).collect();
        let code = self.unit_code(layer, Stream::P);
        self.count(layer, code, During::Error, Event::SaturatedErrors, saturated);
        self.count(layer, code, During::Error, Event::Multiplies, products);
        words
    }
}
