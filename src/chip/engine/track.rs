//! Converters that track: their step grows with the currents, as a net learns.
//!
//! ```text
//! counted   FWD(rows) of training since the last look, all banks and row tiles of a layer, stream and slice
//! looked    after the writes of a batch, or of 64 samples that were written one by one
//! ash       ash + 1  where more than 1 in 64 codes lay on the rail, before the next read
//! ```
//!
//! One step a look. Comparing two counters takes no time beside the writes. See docs/MODEL.md, 2.1.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use super::{Engine, Phase, Recorded};
use crate::chip::hardware::{Adc, AdcRange, Subtract};
use crate::chip::population::Stream;

/// Writes that are done.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum WritesDone {
    /// Those of a batch.
    Batch,
    /// Those of one sample, of many that are written one by one.
    Sample,
}

impl Engine {
    /// Whether converters track.
    pub(super) fn tracks(&self) -> bool {
        matches!(self.hardware.adc, Adc::Finite { range: AdcRange::Tracking, .. })
    }

    /// Counts codes on the rail of a read of all samples, by slice.
    pub(super) fn count_rails(&mut self, layer: usize, target: Stream, reached: &[u64]) {
        if !self.tracks() || self.phase != Phase::Training {
            return;
        }
        let this = &self.layers[layer];
        let [down, _] = this.tiles(&self.hardware);
        let banks = this.spec.wiring.banks(target).len();
        let converted = match self.hardware.adc {
            Adc::Finite { subtract: Subtract::Current, .. } => banks / 2,
            _ => banks,
        };
        let all = (self.drivings(layer) * this.layout.columns * down * converted) as u64;
        let rails = &mut self.layers[layer].rails[target.index()];
        for ([on_rail, codes], reached) in rails.iter_mut().zip(reached) {
            *on_rail += reached;
            *codes += all;
        }
    }

    /// Writes are done: thresholds and steps of tables move where there are some and, where converters track, their ranges
    /// may be looked at.
    pub fn written(&mut self, written: WritesDone) {
        let balances = (0..self.layers.len()).any(|layer| self.balances(layer));
        if !self.tracks() && !balances {
            return;
        }
        if let Some(tape) = &mut self.tape {
            tape.push(Recorded::Written(written));
        }
        if balances {
            self.move_balances();
        }
        if !self.tracks() {
            return;
        }
        if written == WritesDone::Sample {
            self.unlooked += 1;
            if self.unlooked < AdcRange::TRACKING_SAMPLES {
                return;
            }
        }
        self.unlooked = 0;
        for layer in &mut self.layers {
            let shifts = layer.adc_shifts.iter_mut().flatten();
            for (shift, rails) in shifts.zip(layer.rails.iter_mut().flatten()) {
                let [on_rail, codes] = std::mem::take(rails);
                *shift += u32::from(on_rail * AdcRange::TRACKING_RARE > codes);
            }
        }
    }

    /// Samples written one by one since ranges were last looked at.
    #[must_use]
    pub const fn unlooked(&self) -> u64 {
        self.unlooked
    }
}
