//! Last step of a write: levels take their pulses, and the window holds them.
//!
//! ```text
//! ideal      reached = level + pulses
//! window     level = clamp( reached, floor, ceiling );   a gone cell stays where it was
//! pruning    gone where pulses came and the level lies on an absorbing floor
//! remainder  0 where reached < floor, 2^F - 1 where reached > ceiling: level and remainder are held as one number
//! ```
//!
//! Without the last line a cell pushed below its floor would keep a full remainder, and the next small push upward would
//! lift it. The law is for one cell; its twin is the same in lanes of 16 bits, in the order of levels, and back ends
//! compile it for their processor. Levels are at most 4,095 and pulses at most 127 in size. See docs/MODEL.md, 3.3.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use super::{Cells, Ends, Half};
use crate::chip::crossbar::layout::HALF_CELLS;

/// What became of one cell.
struct Held {
    level: i64,
    gone: bool,
    left: i64,
}

/// The law: a cell with a level and a remainder takes pulses. `absorbs` is the kind of floor.
fn held(
    (before, left): (i64, i64),
    pulses: i64,
    (absorbs, gone): (bool, bool),
    ends: Ends,
) -> Held {
    let (floor, ceiling) = (i64::from(ends.floor), i64::from(ends.ceiling));
    let reached = before + pulses;
    // a pruned cell takes pulses and does not move: attempted, not effective
    let level = if gone { before } else { reached.clamp(floor, ceiling) };
    let left = match reached {
        reached if reached < floor => 0,
        reached if reached > ceiling => ends.most_left().into(),
        _ => left,
    };
    Held { level, gone: gone || (absorbs && pulses != 0 && level == floor), left }
}

/// The law for a half block. Returns by how many levels cells moved.
pub(super) fn law(cells: &mut Cells<'_>, pulses: &Half<i8>, ends: Ends, groups: u16) -> u64 {
    let mut effective = 0;
    for (at, &pulses) in pulses.iter().enumerate().filter(|(at, _)| groups >> (at / 64) & 1 == 1) {
        let high = cells.high.as_ref().map_or(0, |high| i64::from(high[at]));
        let before = i64::from(cells.low[at]) + (high << 8);
        let left = cells.residual.as_ref().map_or(0, |residual| i64::from(residual[at]));
        let gone = cells.pruned.as_ref().map(|pruned| pruned[at] != 0);
        let kept = (gone.is_some(), gone.unwrap_or(false));
        let held = held((before, left), pulses.into(), kept, ends);
        cells.low[at] = (held.level & 0xff) as u8;
        if let Some(high) = &mut cells.high {
            high[at] = (held.level >> 8) as u8;
        }
        if let Some(residual) = &mut cells.residual {
            residual[at] = u16::try_from(held.left).expect("at most 15 fractional bits");
        }
        if let Some(pruned) = &mut cells.pruned {
            pruned[at] = if held.gone { Cells::GONE } else { 0 };
        }
        effective += (held.level - before).unsigned_abs();
    }
    effective
}

/// [`law`], as compilers make vectors of it.
#[inline(always)]
pub(super) fn twin(cells: &mut Cells<'_>, pulses: &Half<i8>, ends: Ends, groups: u16) -> u64 {
    match (cells.high.is_some(), cells.pruned.is_some(), cells.residual.is_some()) {
        (false, false, false) => planes::<false, false, false>(cells, pulses, ends, groups),
        (false, false, true) => planes::<false, false, true>(cells, pulses, ends, groups),
        (false, true, false) => planes::<false, true, false>(cells, pulses, ends, groups),
        (false, true, true) => planes::<false, true, true>(cells, pulses, ends, groups),
        (true, false, false) => planes::<true, false, false>(cells, pulses, ends, groups),
        (true, false, true) => planes::<true, false, true>(cells, pulses, ends, groups),
        (true, true, false) => planes::<true, true, false>(cells, pulses, ends, groups),
        (true, true, true) => planes::<true, true, true>(cells, pulses, ends, groups),
    }
}

#[inline(always)]
fn planes<const WIDE: bool, const ABSORBS: bool, const RESIDUAL: bool>(
    cells: &mut Cells<'_>,
    pulses: &Half<i8>,
    ends: Ends,
    groups: u16,
) -> u64 {
    // what a write does not have is neither read nor kept
    let (mut none, mut nothing) = ([0; 64], [0; 64]);
    let mut kept = [0; 64];
    let mut effective = 0;
    for group in (0..HALF_CELLS / 64).filter(|group| groups >> group & 1 == 1) {
        let low = &mut cells.low.as_chunks_mut().0[group];
        let high = match &mut cells.high {
            Some(high) if WIDE => &mut high.as_chunks_mut().0[group],
            _ => &mut none,
        };
        let pruned = match &mut cells.pruned {
            Some(pruned) if ABSORBS => &mut pruned.as_chunks_mut().0[group],
            _ => &mut kept,
        };
        let left = match &mut cells.residual {
            Some(residual) if RESIDUAL => &mut residual.as_chunks_mut().0[group],
            _ => &mut nothing,
        };
        let pulses = &pulses.as_chunks().0[group];
        effective += lanes::<WIDE, ABSORBS, RESIDUAL>((low, high), pruned, left, pulses, ends);
    }
    effective.into()
}

/// 64 cells. Returns by how many levels they moved.
#[inline(always)]
fn lanes<const WIDE: bool, const ABSORBS: bool, const RESIDUAL: bool>(
    (low, high): (&mut [u8; 64], &mut [u8; 64]),
    pruned: &mut [u8; 64],
    left: &mut [u16; 64],
    pulses: &[i8; 64],
    ends: Ends,
) -> u32 {
    let (floor, ceiling) = (ends.floor.cast_signed(), ends.ceiling.cast_signed());
    // copies, which compilers know to lie nowhere else
    let (mut lower, mut upper, mut kept, mut rest) = (*low, *high, *pruned, *left);
    let mut steps = [0; 64];
    for i in 0..64 {
        let mut before = i16::from(lower[i]);
        if WIDE {
            before |= i16::from(upper[i]) << 8;
        }
        let reached = before + i16::from(pulses[i]);
        let mut level = reached.min(ceiling).max(floor);
        if ABSORBS {
            let gone = kept[i] != 0;
            level = if gone { before } else { level };
            let absorbed = gone | ((pulses[i] != 0) & (level == floor));
            kept[i] = if absorbed { Cells::GONE } else { 0 };
        }
        if RESIDUAL {
            let held = if reached < floor { 0 } else { rest[i] };
            rest[i] = if reached > ceiling { ends.most_left() } else { held };
        }
        lower[i] = level as u8;
        if WIDE {
            upper[i] = (level >> 8) as u8;
            steps[i] = (level - before).unsigned_abs();
        }
    }
    let moved = if WIDE {
        steps.iter().map(|&step| u32::from(step)).sum()
    } else {
        (0..64).map(|i| u32::from(lower[i].abs_diff(low[i]))).sum()
    };
    (*low, *high, *pruned, *left) = (lower, upper, kept, rest);
    moved
}
