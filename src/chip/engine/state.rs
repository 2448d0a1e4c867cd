//! What an engine keeps: how many samples it was loaded with in each phase, its layers, its error
//! unit and its ledgers. Registers are none of it: a batch begins by loading them.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use super::{Engine, Phase};
use crate::chip::state::{Section, State, StateError, Visitor, visit_counts};

impl State for Engine {
    fn visit(&mut self, visitor: &mut dyn Visitor) -> Result<(), StateError> {
        let residual_bits = self.hardware.write.residual_bits.get();
        visit_counts(visitor, "loaded", Section::SampleCounters, self.loaded.iter_mut())?;
        if self.tracks() {
            let samples = std::iter::once(&mut self.unlooked);
            visit_counts(visitor, "unlooked", Section::SampleCounters, samples)?;
        }
        for layer in self.layers_mut() {
            layer.visit(residual_bits, visitor)?;
        }
        self.unit.visit(visitor)?;
        for (code, phase) in (0..).zip(Phase::ALL) {
            self.ledger_mut(phase).visit(code, phase.name(), visitor)?;
        }
        Ok(())
    }
}
