//! What the last layer says: accumulators and activities of its streams, or its readout.
//!
//! ```text
//! y = acc_p - acc_n                              acc_p where there is no stream n; in units of an accumulator
//! ```
//!
//! See docs/MODEL.md, 2.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use super::Engine;
use super::forward::Units;
use crate::chip::layer;
use crate::chip::population::Stream;
use crate::num::tables::Unit;

impl Engine {
    /// Accumulator and activity of a unit of the last layer, of one of its target streams; a layer that is read out
    /// (`Activation::Accumulator`) has no activities, and they are 0.
    ///
    /// # Panics
    /// When the last layer has no such stream, or has not been read.
    #[must_use]
    pub fn output(&self, target: Stream, sample: usize, unit: usize) -> (i64, u8) {
        let registers = self.registers.last().expect("a network has layers");
        let (at, stream) = (self.register_at(sample, unit), target.index());
        let activity = match self.units.last() {
            Some(Units::Kept) => 0,
            _ => registers.activities[stream][at],
        };
        (registers.accumulators[stream][at], activity)
    }

    /// What a unit of the last layer reads out: `acc_p - acc_n`, or `acc_p` where there is no stream n. Units of the
    /// accumulator: see [`Engine::readout_unit`].
    ///
    /// # Panics
    /// When the last layer has not been read.
    #[must_use]
    pub fn readout(&self, sample: usize, unit: usize) -> i64 {
        let [p, n] = &self.registers.last().expect("a network has layers").accumulators;
        let at = self.register_at(sample, unit);
        p[at] - n.get(at).copied().unwrap_or(0)
    }

    /// Readouts of all units of the last layer for all loaded samples, `[sample][unit]`; what `out` held is lost.
    ///
    /// # Panics
    /// When the last layer has not been read.
    pub fn readouts(&self, out: &mut Vec<i64>) {
        let units = self.layers.last().expect("a network has layers").spec.units;
        out.clear();
        out.reserve(self.samples * units);
        for sample in 0..self.samples {
            out.extend((0..units).map(|unit| self.readout(sample, unit)));
        }
    }

    /// What one unit of a readout is worth.
    #[must_use]
    pub fn readout_unit(&self) -> Unit {
        layer::unit(&self.layers[self.layers.len() - 1].spec, &self.hardware)
    }

    /// Accumulator of a unit of the last layer's p stream, which predicts.
    #[must_use]
    pub fn output_accumulator(&self, sample: usize, unit: usize) -> i64 {
        self.output(Stream::P, sample, unit).0
    }

    /// Activity code of a unit of the last layer's p stream.
    #[must_use]
    pub fn output_activity(&self, sample: usize, unit: usize) -> u8 {
        self.output(Stream::P, sample, unit).1
    }
}
