//! What a ledger keeps, sparse: a count that is 0 is neither stored nor hashed, so an event that nobody saw before
//! changes nothing.
//!
//! ```text
//! stored   layer, pathway, operation, event, count;   view, layer, code, cycles
//! hashed   phase, event, total over layers, pathways and operations      without what re-tiling moves
//! ```
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use super::{Cycles, During, Event, Ledger, PATHWAYS};
use crate::chip::state::{Piece, Section, StateError, Visitor, signed};

impl Ledger {
    /// Shows the ledger of the phase `phase`, called `name`.
    pub(crate) fn visit(
        &mut self,
        phase: u32,
        name: &str,
        visitor: &mut dyn Visitor,
    ) -> Result<(), StateError> {
        let layers = self.layers();
        let counts = format!("ledger.{name}");
        let seen = visitor.rows(&stored(&counts), 5, &|| {
            let row = |(layer, pathway, during, event, count): (usize, u8, During, Event, u64)| {
                let codes = [during.code(), event.code()].map(i64::from);
                [layer as i64, i64::from(pathway), codes[0], codes[1], signed(count)]
            };
            self.entries().flat_map(row).collect()
        })?;
        if let Some(rows) = seen {
            self.forget_counts();
            for row in rows.as_chunks::<5>().0 {
                let damaged = || StateError {
                    name: counts.clone(),
                    found: format!("has a row {row:?} that no ledger has"),
                };
                let [layer, pathway, during, event, count] = row.map(i64::unsigned_abs);
                let layer = usize::try_from(layer).ok().filter(|&layer| layer < layers);
                let pathway =
                    u8::try_from(pathway).ok().filter(|&code| usize::from(code) < PATHWAYS);
                let (during, event) = (During::of_code(during), Event::of_code(event));
                let (Some(layer), Some(pathway), Some(during), Some(event), 1..) =
                    (layer, pathway, during, event, count)
                else {
                    return Err(damaged());
                };
                if self.get(layer, pathway, during, event) != 0 {
                    return Err(damaged());
                }
                self.add(layer, pathway, during, event, count);
            }
        }
        if let Some(cycles) = self.cycles_mut() {
            cycles.visit(&format!("cycles.{name}"), visitor)?;
        }
        visitor.derived(Section::Ledger, &|| {
            let hashed = Event::ALL.into_iter().filter(|event| !event.moves_with_tiling());
            let totals = hashed.map(|event| (event, self.total(event))).filter(|(_, n)| *n != 0);
            let triple = |(event, total): (Event, u64)| {
                [i64::from(phase), i64::from(event.code()), signed(total)]
            };
            totals.flat_map(triple).flat_map(i64::to_le_bytes).collect()
        });
        Ok(())
    }
}

impl Cycles {
    fn visit(&mut self, name: &str, visitor: &mut dyn Visitor) -> Result<(), StateError> {
        let seen = visitor.rows(&stored(name), 4, &|| {
            let row = |([view, layer, code], cycles): ([usize; 3], u64)| {
                [view as i64, layer as i64, code as i64, signed(cycles)]
            };
            self.entries().filter(|(_, cycles)| *cycles != 0).flat_map(row).collect()
        })?;
        let Some(rows) = seen else { return Ok(()) };
        *self = Self::new(self.layers());
        for row in rows.as_chunks::<4>().0 {
            let [view, layer, code, cycles] = row.map(i64::unsigned_abs);
            let place = [view, layer, code].map(|n| usize::try_from(n).unwrap_or(usize::MAX));
            match self.slot(place) {
                Some(slot) if *slot == 0 && cycles > 0 => *slot = cycles,
                _ => {
                    let found = format!("has a row {row:?} that no ledger has");
                    return Err(StateError { name: name.into(), found });
                }
            }
        }
        Ok(())
    }
}

/// Kept as it is, and hashed in another form or not at all.
const fn stored(name: &str) -> Piece<'_> {
    Piece { name, section: None, within: 0..=i64::MAX }
}
