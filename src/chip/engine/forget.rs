//! The end of the writes of a layer: they are counted, and volatile cells forget. See docs/MODEL.md, 3.16.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use super::Engine;
use crate::num::draw::{Place, Site};

impl Engine {
    /// Every array of a layer has been written once more.
    pub(super) fn end_writes(&mut self, layer: usize) {
        let this = &mut self.layers[layer];
        let pathways = this.spec.wiring.pathways();
        let arrays = this.arrays.iter_mut().zip(&mut this.writes).zip(pathways);
        for ((array, writes), pathway) in arrays {
            *writes += 1;
            let (layer, pathway) = (this.index, pathway.code);
            array.forget(Place {
                layer,
                pathway,
                ..Place::global(self.seed, Site::Leakage, *writes)
            });
        }
    }

    /// Cells that are worn out, and the pulses that all cells were sent, where pulses are counted.
    #[must_use]
    pub fn wear(&self) -> Option<[u64; 2]> {
        let arrays = self.layers.iter().flat_map(|layer| &layer.arrays);
        let wear: Option<Vec<_>> = arrays.map(|array| array.wear()).collect();
        let wear = wear?.into_iter().flatten();
        Some(wear.fold([0; 2], |[worn, all], [spent, limit]| {
            [worn + u64::from(spent >= limit), all + u64::from(spent)]
        }))
    }
}
