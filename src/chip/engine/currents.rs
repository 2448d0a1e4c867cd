//! Sums of bank currents by polarity, for the balance of activity.
//!
//! ```text
//! sum over samples and columns of v = sum over rows of (sum of drives) * (sum of levels)
//! ```
//!
//! Slices and tiles cannot change it. Noted while evaluating only: that is where it is reported.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use super::{Engine, Phase};
use crate::chip::crossbar::layout::BLOCK_ROWS;
use crate::chip::population::Polarity;

impl Engine {
    pub(super) fn note_currents(&mut self, layer: usize) {
        if self.phase != Phase::Evaluation {
            return;
        }
        let reads = self.drivings(layer);
        let this = &self.layers[layer];
        let levels = self.row_sums[layer]
            .get_or_insert_with(|| this.arrays.iter().map(|array| array.row_sums()).collect());
        let wiring = this.spec.wiring;
        for &target in wiring.targets() {
            for &at in wiring.banks(target) {
                let pathway = wiring.pathways()[at];
                let source = this.spec.drives_of(pathway.source);
                let bank = usize::from(pathway.polarity == Polarity::Inhibits);
                let drives = &self.registers[layer].drives[source.index()];
                let blocks = drives.chunks_exact(reads * BLOCK_ROWS);
                let sum: i64 = blocks
                    .zip(levels[at].chunks(BLOCK_ROWS))
                    .map(|(codes, levels)| {
                        let mut sums = [0i64; BLOCK_ROWS];
                        // 257 bytes add up within 16 bits, where lanes are many
                        for codes in codes.chunks(256 * BLOCK_ROWS) {
                            let mut part = [0u16; BLOCK_ROWS];
                            for codes in codes.as_chunks::<BLOCK_ROWS>().0 {
                                part.iter_mut().zip(codes).for_each(|(s, &x)| *s += u16::from(x));
                            }
                            sums.iter_mut().zip(part).for_each(|(s, part)| *s += i64::from(part));
                        }
                        levels.iter().zip(sums).map(|(&l, x)| l * x).sum::<i64>()
                    })
                    .sum();
                self.currents[layer][target.index()][bank] += sum;
            }
        }
    }
}
