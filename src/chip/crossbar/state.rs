//! What an array keeps: levels, pruned cells, remainders.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use std::ops::RangeInclusive;

use super::Crossbar;
use crate::chip::state::{Piece, Section, StateError, Visitor};

/// A piece of an array.
const fn piece(name: &str, within: RangeInclusive<i64>) -> Piece<'_> {
    Piece { name, section: Some(Section::Arrays), within }
}

impl Crossbar {
    /// Shows the state of the array `name`; `residual_bits` is the width of a remainder.
    pub(crate) fn visit(
        &mut self,
        name: &str,
        residual_bits: u32,
        visitor: &mut dyn Visitor,
    ) -> Result<(), StateError> {
        let shape = [self.layout.rows, self.layout.columns];
        visitor.derived(Section::Arrays, &|| {
            let side = |n: usize| u32::try_from(n).expect("checked by the plan").to_le_bytes();
            shape.into_iter().flat_map(side).collect()
        });

        self.visit_wear(name, visitor)?;
        let levels = format!("{name}.levels");
        let [least, greatest] = self.reachable().map(i64::from);
        let window = least..=greatest;
        let seen = visitor.halves(&piece(&levels, window), shape, &|| self.levels().collect())?;
        for (row, levels) in seen.iter().flat_map(|all| all.chunks(shape[1]).enumerate()) {
            self.load_row(row, levels);
        }
        self.visit_left(name, visitor)?;
        self.visit_stamps(name, visitor)?;
        if self.absorbs {
            let pruned = format!("{name}.pruned");
            let bits = || self.pruned().expect("just seen");
            if let Some(bits) = visitor.bits(&piece(&pruned, 0..=1), shape, &bits)? {
                self.load_pruned(&bits);
            }
        }
        if self.residual.is_some() {
            let residuals = format!("{name}.residuals");
            let within = 0..=(1 << residual_bits) - 1;
            let values = || self.residuals().expect("just seen");
            if let Some(values) = visitor.halves(&piece(&residuals, within), shape, &values)? {
                self.load_residuals(&values);
            }
        }
        Ok(())
    }
}
