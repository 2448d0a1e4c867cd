//! Work on independent parts, on as many threads as there are. Order of results is the order of parts.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use rayon::prelude::*;

/// Products below which handing work to another thread costs more than it saves.
const WORTH_SHARING: usize = 1 << 22;

/// Maps every part. `work` is the number of products in all of them.
pub(super) fn each<T: Send, R: Send>(
    work: usize,
    parts: Vec<T>,
    map: impl Fn(T) -> R + Send + Sync,
) -> Vec<R> {
    if work < WORTH_SHARING || parts.len() < 2 || rayon::current_num_threads() == 1 {
        parts.into_iter().map(map).collect()
    } else {
        parts.into_par_iter().with_max_len(1).map(map).collect()
    }
}
