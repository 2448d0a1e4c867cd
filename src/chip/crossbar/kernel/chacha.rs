//! The words ChaCha starts from, for 16 columns side by side.
//!
//! ```text
//! word   0..4 constants | 4..12 key | 12, 13 counter | 14, 15 stream          little endian
//! counter of column c = count << 28 | (c * blocks a column + block)
//! ```
//!
//! Only word 12 differs between the columns: it holds the 28 bits of the block number.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use crate::chip::crossbar::layout::HALF_COLUMNS;
use crate::num::draw::Place;

/// The start of the first column, and what word 12 grows by from a column to the next: `step` blocks.
pub(super) fn start(place: &Place, step: usize, column: usize, block: usize) -> ([i32; 16], i32) {
    let step = step as u64;
    let first = column as u64 * step + block as u64;
    let counter = place.counter(first);
    // Refuses a block beyond its 28 bits, so that word 12 of no column carries into word 13.
    let _ = place.counter(first + (HALF_COLUMNS as u64 - 1) * step);
    let mut bytes = [0; 64];
    bytes[..16].copy_from_slice(b"expand 32-byte k");
    bytes[16..48].copy_from_slice(&place.key());
    bytes[48..56].copy_from_slice(&counter.to_le_bytes());
    bytes[56..].copy_from_slice(&place.stream().to_le_bytes());
    let mut words = [0; 16];
    for (word, bytes) in words.iter_mut().zip(bytes.as_chunks().0) {
        *word = i32::from_le_bytes(*bytes);
    }
    (words, i32::try_from(step).expect("a step between blocks of 28 bits"))
}
