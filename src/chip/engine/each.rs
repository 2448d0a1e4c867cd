//! Work on independent parts, on as many threads as there are. Order of results is the order of parts.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use crate::chip::crossbar::kernel::{Kernel, Team};

/// Products below which handing work to another thread costs more than it saves.
const WORTH_SHARING: usize = 1 << 22;

/// Products that take as long as it takes to move a byte from one order into another, or to form a gate, roughly.
pub(super) const MOVE: usize = 64;

/// Maps every part; beside it stands the place it belongs to, of `places`. `work` is the number of products in all of
/// them, or what takes as long.
pub(super) fn each<T: Send, R: Send>(
    team: &mut Team,
    work: usize,
    places: usize,
    parts: Vec<(usize, T)>,
    map: impl Fn(&Kernel, T) -> R + Sync,
) -> Vec<R> {
    if work < WORTH_SHARING {
        return team.alone(parts.into_iter().map(|(_, part)| part).collect(), map);
    }
    let at_home = parts.into_iter().map(|(place, part)| (team.home(place, places), part)).collect();
    team.each(at_home, map)
}
