//! Verified pulses: after each a cell is looked at, and gets no more once it has moved as far as it should.
//!
//! ```text
//! slots    tries |p| of p pulses that were asked for
//! arrived  2 (2^8 moved) >= (2 |p| - 1) q        moved: levels since the write began, in the direction of p;  q: the mean step, 2^-8 of a level
//! sent     pulses before that, each counted, read and worn by;  the last one is the last pulse of the write
//! ```
//!
//! Cell by cell: no back end has a twin of it. See docs/MODEL.md, 3.17.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use super::{Answering, Remembered, pulse_of, settle};
use crate::chip::crossbar::kernel::{Cells, Ends, Half, Kernel};
use crate::chip::crossbar::layout::HALF_CELLS;
use crate::chip::device::{PulseWords, Verified};

/// Column of a cell in its half block.
const fn column(at: usize) -> usize {
    at % 64 / 4
}

/// Returns by how many levels pulses moved cells.
pub(super) fn law(
    kernel: &Kernel,
    cells: &mut Cells<'_>,
    mut remembered: Option<&mut Remembered<'_>>,
    answering: &mut Answering<'_>,
    (pulses, groups): (&Half<i8>, u16),
    (verified, ends): (Verified, Ends),
) -> u64 {
    let Answering { made, words, at: place } = answering;
    let wants = made.device.wants();
    let level = |cells: &Cells<'_>, at: usize| {
        u16::from_le_bytes([cells.low[at], cells.high.as_ref().map_or(0, |high| high[at])])
    };
    let asked = (0..HALF_CELLS).filter(|at| groups >> (at / 64) & 1 == 1 && pulses[*at] != 0);
    let mut waiting: Vec<(usize, u16)> = asked.map(|at| (at, level(cells, at))).collect();
    let (mut effective, mut sent) = (0, 0);
    for pulse in 0.. {
        if waiting.is_empty() {
            break;
        }
        let columns = waiting.iter().fold(0, |columns, (at, _)| columns | 1 << column(*at));
        words.draw(kernel, pulse as usize, *place, (columns, wants));
        waiting.retain(|&(at, start)| {
            sent += 1;
            let last = verified.slots(pulses[at]) == pulse + 1;
            let wear = remembered.as_mut().and_then(|of| of.wear.as_mut());
            if let Some((limits, spent)) = wear {
                let moves = spent[at] < limits[at];
                spent[at] = spent[at].saturating_add(1);
                if !moves {
                    return !last;
                }
            }
            let of = PulseWords { rounding: words.rounding[at], noise: words.noise[at] };
            let cell = made.cell(at);
            let [before, after, reached] = pulse_of(cells, made, (at, &cell), (pulses[at] > 0, of));
            effective += after.abs_diff(before);
            let arrived = verified.arrived(pulses[at], [start, level(cells, at)]);
            let worn = remembered.as_ref().and_then(|of| of.wear.as_ref());
            let worn = worn.is_some_and(|(limits, spent)| spent[at] >= limits[at]);
            if last || arrived || worn {
                settle(cells, (at, &cell), (after, reached), ends);
            }
            !(last || arrived)
        });
    }
    words.verified = Some(words.verified.unwrap_or(0) + sent);
    effective
}
