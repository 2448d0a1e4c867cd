//! The error unit, cycle by cycle: output words of errors, and the words of layers that do not hear those as they are.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use super::{Command, Event, Interval, Network, Order, Span};
use crate::chip::engine::{Centre, ErrorUnit};
use crate::chip::hardware::Hardware;
use crate::chip::layer::WordSource;
use crate::chip::ledger::During;
use crate::chip::population::Stream;
use crate::num::fixed::{rsh, sat};
use crate::num::tables::SoftmaxTables;

/// What the unit is, and what it remembers.
#[derive(Debug)]
pub(super) struct Unit {
    centre: Centre,
    /// Bits rounded off an error that nothing is subtracted from.
    shift: u32,
    means: Vec<i64>,
    error_bits: u32,
    level_bits: u32,
    lut_bits: u32,
    drive_bits: u32,
    softmax: Option<SoftmaxTables>,
}

impl Unit {
    pub(super) fn new(hardware: &Hardware) -> Self {
        Self {
            centre: Centre::None,
            shift: 9 - hardware.digital.error_bits.get(),
            means: vec![],
            error_bits: hardware.digital.error_bits.get(),
            level_bits: hardware.cell.level_bits.get(),
            lut_bits: hardware.digital.lut_bits.get(),
            drive_bits: hardware.drive.bits.get(),
            softmax: None,
        }
    }
}

impl Network {
    /// Puts an error unit in its present state beside the output layer.
    pub fn set_error_unit(&mut self, unit: &ErrorUnit) {
        self.unit.centre = unit.centre();
        self.unit.shift = unit.shift();
        self.unit.means = unit.means().to_vec();
        self.unit.softmax = unit.softmax().cloned();
    }

    /// What the outputs of a sample share, of 255, where they share by softmax.
    ///
    /// # Panics
    /// When they do not.
    #[must_use]
    pub fn shares(&self, sample: usize) -> Vec<u8> {
        let tables = self.unit.softmax.as_ref().expect("outputs share by softmax");
        let last = self.layers.last().expect("a network has layers");
        let sums: Vec<i64> = last.outputs[Stream::P.index()][sample * last.columns..]
            [..last.columns]
            .iter()
            .map(|&(sum, _)| sum)
            .collect();
        let mut greatest = sums[0];
        sums.iter().for_each(|&sum| greatest = greatest.max(sum));
        // a class a look-up: exponentials are added up
        let mut total = 0;
        let mut places = vec![];
        for sum in sums {
            let place = tables.place(greatest - sum);
            total += tables.exponential(place);
            places.push(place);
        }
        // one of the sum, and a class a look-up again
        let logarithm = tables.logarithm(total);
        places.into_iter().map(|place| tables.share(place, logarithm)).collect()
    }

    /// Running means of the error unit.
    #[must_use]
    pub fn means(&self) -> &[i64] {
        &self.unit.means
    }

    /// Some cycles of the error unit alone.
    fn unit_works(&mut self, interval: Interval, name: &'static str, beats: u64) {
        let start = self.clock;
        for _ in 0..self.timing.beat * beats {
            self.begin(interval);
            self.end();
        }
        self.watch.span(Span { layer: None, name, sample: None, start, end: self.clock });
    }

    /// Makes output words of the errors of the loaded samples.
    pub fn output_words(&mut self, errors: &[i32]) -> Vec<i16> {
        let last = self.layers.len() - 1;
        let outputs = self.layers[last].columns;
        let (bits, samples) = (self.unit.error_bits, errors.len() / outputs);
        let errors: Vec<i64> = errors.iter().map(|&e| e.into()).collect();
        let mut sums = vec![0; outputs];
        if self.unit.softmax.is_some() {
            let look_ups = (samples * (2 * outputs + 1)) as u64;
            self.unit_works(Interval::Centre, "softmax", look_ups);
            let code = self.layers[last].unit_code(Stream::P);
            self.charge(last, code, During::Error, Event::SoftmaxLookUps, look_ups);
        }
        if self.unit.centre == Centre::Batch {
            // an error a beat, then a mean a beat
            self.unit_works(Interval::Centre, "mean", (errors.len() + outputs) as u64);
            errors.iter().enumerate().for_each(|(at, e)| sums[at % outputs] += e);
        }
        let mut words = Vec::new();
        for (at, &e) in errors.iter().enumerate() {
            let output = at % outputs;
            let exact = match self.unit.centre {
                Centre::None => rsh(e, self.unit.shift),
                Centre::Batch => {
                    let m = (samples as i64) << (9 - bits);
                    (2 * (samples as i64 * e - sums[output]) + m).div_euclid(2 * m)
                }
                Centre::Running => {
                    let off = (e << 8) - self.unit.means[output];
                    self.unit.means[output] += rsh(off, 8);
                    rsh(off, 17 - bits)
                }
            };
            words.push(self.bounded(last, exact));
        }
        words
    }

    /// A word inside its rail; one that is not is counted.
    fn bounded(&mut self, layer: usize, exact: i64) -> i16 {
        let (word, saturated) = sat(exact, self.unit.error_bits);
        let code = self.layers[layer].unit_code(Stream::P);
        let count = u64::from(saturated);
        self.charge(layer, code, During::Error, Event::SaturatedErrors, count);
        i16::try_from(word).expect("at most 9 bits")
    }

    /// The words a layer's bus carries for a sample; what the error unit has to add takes its beats now.
    pub(super) fn layer_words(&mut self, order: &Order<'_>, sample: usize) -> Vec<i16> {
        let layer = order.layer;
        if !matches!(order.command, Command::Error { .. }) {
            return vec![];
        }
        let delivery = self.layers[layer].delivery.clone();
        let width = delivery.taps.width;
        let sum_of = |word: usize| -> i64 {
            match &delivery.source {
                WordSource::Signed { signs, .. } => {
                    let signs = signs.iter().skip(word).step_by(width);
                    let terms = order.words.iter().zip(signs);
                    terms.map(|(&s, &sign)| i64::from(s) * i64::from(sign)).sum()
                }
                _ => order.words.iter().map(|&s| i64::from(s)).sum(),
            }
        };
        let exact: Vec<i64> = match delivery.source {
            WordSource::Output => return order.words.to_vec(),
            WordSource::Sum { shift, .. } | WordSource::Signed { shift, .. } => {
                // one term after the other, as many a beat as there are lanes
                let terms = order.words.len() * width;
                let beats = (0..terms).step_by(usize::try_from(self.timing.lanes).expect("few"));
                self.unit_works(Interval::Error, "words", beats.count() as u64);
                if matches!(delivery.source, WordSource::Signed { .. }) {
                    let code = self.layers[layer].unit_code(Stream::P);
                    self.charge(layer, code, During::Error, Event::Multiplies, terms as u64);
                }
                (0..width).map(|word| rsh(sum_of(word), shift)).collect()
            }
            WordSource::Above => {
                let (own, above) = (&self.layers[layer], &self.layers[layer + 1]);
                let inputs = above.sample_sums();
                let sums = &above.backward[sample * inputs..][..inputs];
                let asked = own.place_bits() * inputs as u64;
                let code = own.unit_code(Stream::P);
                let worth = if above.has_gain() {
                    // of the ramp: 85 codes are 2^(lut_bits - 3) of its steps, and 85 is 2^6 or so
                    let code = i64::from(self.unit.drive_bits) - 2;
                    i64::from(self.unit.lut_bits) - 3 + i64::from(above.step().0)
                        - code
                        - above.evened
                } else {
                    i64::from(self.unit.level_bits) - i64::from(above.weight_max_log2)
                };
                let shift = worth + 8 - i64::from(self.unit.error_bits);
                let scaled = |&d: &i64| match u32::try_from(shift) {
                    Ok(right) => rsh(d, right),
                    Err(_) => d << shift.unsigned_abs(),
                };
                let exact = sums.iter().map(scaled).collect();
                self.charge(layer, code, During::Error, Event::SramBits, asked);
                exact
            }
        };
        exact.into_iter().map(|exact| self.bounded(layer, exact)).collect()
    }
}
