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
use crate::chip::population::{Polarity, Stream};

/// Reads whose drives are added up in 16 bits.
const TOGETHER: usize = 256;

impl Engine {
    pub(super) fn note_currents(&mut self, layer: usize) {
        if self.phase != Phase::Evaluation {
            return;
        }
        let this = &self.layers[layer];
        self.row_sums[layer]
            .get_or_insert_with(|| this.arrays.iter().map(|array| array.row_sums()).collect());
        let (wiring, spec) = (this.spec.wiring, this.spec.clone());
        let mut drives: [Vec<i64>; 2] = [vec![], vec![]];
        for &set in spec.drive_sets() {
            drives[set.index()] = self.row_drives(layer, set);
        }
        for &target in wiring.targets() {
            for &at in wiring.banks(target) {
                let pathway = wiring.pathways()[at];
                let drives = &drives[spec.drives_of(pathway.source).index()];
                let bank = usize::from(pathway.polarity == Polarity::Inhibits);
                let levels = &self.row_sums[layer].as_ref().expect("just added up")[at];
                let sum = levels.iter().zip(drives).map(|(&l, x)| l * x).sum::<i64>();
                self.currents[layer][target.index()][bank] += sum;
            }
        }
    }

    /// Sums of the drives of the rows of a set over all reads, padded.
    fn row_drives(&self, layer: usize, set: Stream) -> Vec<i64> {
        let (reads, blocks) = (self.drivings(layer), self.layers[layer].layout.blocks());
        let mut sums = vec![0i64; blocks * BLOCK_ROWS];
        let mut add = |block: usize, codes: &[u8]| {
            let sums = &mut sums[block * BLOCK_ROWS..][..BLOCK_ROWS];
            // 257 bytes add up within 16 bits, where lanes are many
            for codes in codes.chunks(TOGETHER * BLOCK_ROWS) {
                let mut part = [0u16; BLOCK_ROWS];
                for codes in codes.as_chunks::<BLOCK_ROWS>().0 {
                    part.iter_mut().zip(codes).for_each(|(s, &x)| *s += u16::from(x));
                }
                sums.iter_mut().zip(part).for_each(|(s, part)| *s += i64::from(part));
            }
        };
        let Some(windows) = self.windows(layer, set) else {
            let drives = &self.registers[layer].drives[set.index()];
            let blocks = drives.chunks_exact((reads * BLOCK_ROWS).max(1)).enumerate();
            blocks.for_each(|(block, codes)| add(block, codes));
            return sums;
        };
        let (mut line, mut codes) = (vec![], vec![]);
        for start in (0..reads).step_by(TOGETHER) {
            let some = start..(start + TOGETHER).min(reads);
            codes.resize(blocks * some.len() * BLOCK_ROWS, 0);
            windows.assemble(0..blocks, some.clone(), &mut line, &mut codes);
            let each = codes.chunks_exact(some.len() * BLOCK_ROWS).enumerate();
            each.for_each(|(block, codes)| add(block, codes));
        }
        sums
    }
}
