//! Ranges of finite converters.
//!
//! ```text
//! ash = headroom + least shift with at most 1 in 1,024 conversions on the rail          by layer, stream, slice
//! ```
//!
//! Converters that track begin with a headroom of 1; what comes after is in `track`.
//!
//! The first 256 training samples are read with ideal converters in the whole network, and every current that a
//! finite converter would have seen is noted. A conversion is on the rail when its code is the greatest one
//! (or, of a difference, the least). Where units keep to a middle this is done layer by layer upward, each with
//! what was found below: a layer's converters, then its thresholds and step (see `homeostasis`), and what the layer above is
//! driven with is read as the chip reads it. See docs/MODEL.md, 2.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use super::read::Mode;
use super::{Engine, Operation, Phase};
use crate::chip::hardware::{Adc, AdcRange};
use crate::chip::layer::Layer;
use crate::num::fixed::rsh;

/// Samples read to find converter ranges, thresholds and steps.
pub const CALIBRATION_SAMPLES: usize = 256;
/// One conversion in so many may lie on the rail.
const RARE: u64 = 1024;

/// What a probe of the converters found.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Calibration {
    /// Converter shifts in force, by layer, target stream and slice.
    pub shifts: Vec<Vec<Vec<u32>>>,
    /// Greatest code each layer's converters gave for the samples.
    pub code_max: Vec<i64>,
}

impl Engine {
    /// Reads up to 256 samples (`inputs` codes each) with ideal converters and, if the hardware calibrates, sets
    /// the converter shifts; before the first update also thresholds and steps of units that keep to a middle. `None` when
    /// the converters are ideal.
    pub fn calibrate(&mut self, codes: &[u8]) -> Option<Calibration> {
        let range = match self.hardware.adc {
            Adc::Finite { range, .. } => Some(range),
            Adc::Ideal => None,
        };
        let balance = self.is_to_balance();
        let on = |layer: &Layer| balance && layer.balance.law().is_on();
        let layers = match range {
            Some(_) => self.layers.len(),
            // nothing waits for what lies above
            None => self.layers.iter().rposition(on).map_or(0, |last| last + 1),
        };
        if layers == 0 {
            return None;
        }
        let phase = self.phase;
        self.set_phase(Phase::Calibration);
        let inputs = self.layers[0].spec.sample_inputs();
        self.execute(&Operation::LoadDrives {
            codes: &codes[..codes.len().min(CALIBRATION_SAMPLES * inputs)],
        });
        let mut calibration = Calibration { shifts: vec![], code_max: vec![] };
        for layer in 0..layers {
            let on = on(&self.layers[layer]);
            let Some(range) = range else {
                if on {
                    self.balance(layer)
                } else {
                    self.forward(layer)
                }
                continue;
            };
            let histograms = self.forward_in(layer, Mode::Probe);
            let mut code_max = 0;
            for (target, histogram) in histograms.iter().enumerate() {
                for (slice, (counts, current_max)) in histogram.iter().enumerate() {
                    let shift = &mut self.layers[layer].adc_shifts[target][slice];
                    let headroom = match range {
                        AdcRange::Calibrated { headroom, .. } => Some(headroom),
                        AdcRange::Tracking => Some(AdcRange::TRACKING_HEADROOM),
                        AdcRange::Shift(_) | AdcRange::Full => None,
                    };
                    if let Some(headroom) = headroom {
                        *shift = least_shift(counts) + headroom;
                    }
                    code_max = code_max.max(rsh(*current_max, *shift));
                }
            }
            calibration.shifts.push(self.layers[layer].adc_shifts.clone());
            calibration.code_max.push(code_max);
            // with something to find above, everything is read as the chip reads it
            if on {
                self.balance(layer);
            } else if balance && layer + 1 < layers {
                self.forward(layer);
            }
        }
        self.set_phase(phase);
        range.map(|_| calibration)
    }
}

/// The least shift that leaves at most one conversion in 1,024 on the rail. `counts[s]` conversions need a shift of s.
fn least_shift(counts: &[u64; 64]) -> u32 {
    let total: u64 = counts.iter().sum();
    let mut beyond = total;
    for (shift, count) in (0..).zip(counts) {
        beyond -= count;
        if beyond * RARE <= total {
            return shift;
        }
    }
    unreachable!("no conversion needs more than the last shift")
}

#[cfg(test)]
mod tests {
    use super::least_shift;

    #[test]
    fn one_conversion_in_1024_may_lie_on_the_rail() {
        let mut counts = [0; 64];
        counts[3] = 1023;
        counts[7] = 1;
        assert_eq!(least_shift(&counts), 3);
        counts[7] = 2;
        assert_eq!(least_shift(&counts), 7);
        assert_eq!(least_shift(&[0; 64]), 0);
    }
}
