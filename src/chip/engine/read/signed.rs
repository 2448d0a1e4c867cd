//! Reads of drives with a sign: what is read below 0 is taken off what is read above.
//!
//! ```text
//! drivings  [sample][above, below]                 two a sample, each a read of its own up to its accumulators
//! ```
//!
//! See docs/MODEL.md, 2.6.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use super::PanelPart;
use crate::chip::crossbar::kernel::TOGETHER;
use crate::chip::crossbar::layout::PANEL_COLUMNS;

/// The drivings of a part's samples, some samples at a time, each with its place among `sums`: where drives have a sign, two
/// a sample.
pub(super) fn both_phases<'a, T>(
    part: &'a PanelPart,
    sums: &'a mut [T],
) -> impl Iterator<Item = (PanelPart, &'a mut [T])> {
    const SAMPLES: usize = TOGETHER / 2;
    let starts = part.samples.clone().step_by(SAMPLES);
    starts.zip(sums.chunks_mut(SAMPLES * PANEL_COLUMNS)).map(|(start, sums)| {
        let end = start + sums.len() / PANEL_COLUMNS;
        (PanelPart { samples: 2 * start..2 * end, ..part.clone() }, sums)
    })
}

/// What was read above 0 less what was read below: `[sample][2][32]` becomes `[sample][32]`.
pub(super) fn below_from_above<T: Copy + std::ops::Sub<Output = T>>(both: &[T], sums: &mut [T]) {
    let samples = sums.as_chunks_mut::<PANEL_COLUMNS>().0.iter_mut();
    for (sums, both) in samples.zip(both.as_chunks::<{ 2 * PANEL_COLUMNS }>().0) {
        let (above, below) = both.split_at(PANEL_COLUMNS);
        for (sum, (&above, &below)) in sums.iter_mut().zip(above.iter().zip(below)) {
            *sum = above - below;
        }
    }
}
