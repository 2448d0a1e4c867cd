//! What a layer keeps: its arrays, the shifts of its converters and what these are adjusted by, thresholds and table step, and how often each array was written.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use super::Layer;
use crate::chip::state::{Piece, Section, StateError, Visitor, visit_counts};

/// Greatest shift of a converter.
const SHIFT_MAX: i64 = 62;

impl Layer {
    /// Name of the levels of a pathway of a layer, in checkpoints.
    #[must_use]
    pub fn levels_name(layer: usize, pathway: &str) -> String {
        format!("layer{layer}.{pathway}.levels")
    }

    /// Shows the state of the layer; `residual_bits` is the width of a remainder.
    pub(crate) fn visit(
        &mut self,
        residual_bits: u32,
        visitor: &mut dyn Visitor,
    ) -> Result<(), StateError> {
        let name = format!("layer{}", self.index);
        for (array, pathway) in self.arrays.iter_mut().zip(self.spec.wiring.pathways()) {
            array.visit(&format!("{name}.{}", pathway.name), residual_bits, visitor)?;
        }
        let shifts: Vec<i64> = self.adc_shifts.iter().flatten().map(|&s| i64::from(s)).collect();
        if !shifts.is_empty() {
            let piece = Piece {
                name: &format!("{name}.adc_shifts"),
                section: Some(Section::ConverterShifts),
                within: 0..=SHIFT_MAX,
            };
            if let Some(shifts) = visitor.numbers(&piece, &shifts)? {
                let places = self.adc_shifts.iter_mut().flatten();
                places.zip(shifts).for_each(|(place, shift)| {
                    *place = u32::try_from(shift).expect("a visitor keeps to the range");
                });
            }
        }
        self.balance.visit(&name, visitor)?;
        self.requests.visit(&name, (self.spec.wiring, self.layout), visitor)?;
        if !self.rails.is_empty() {
            let counts = self.rails.iter_mut().flatten().flatten();
            visit_counts(visitor, &format!("{name}.rails"), Section::SampleCounters, counts)?;
        }
        let writes = format!("{name}.writes");
        visit_counts(visitor, &writes, Section::WriteCounts, self.writes.iter_mut())
    }
}
