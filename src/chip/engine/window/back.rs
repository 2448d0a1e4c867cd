//! The way back through windows and pools: row sums of a transposed read are added to the pixels that drove the rows, and
//! words of pixels become words of the positions that a pool made them of.
//!
//! ```text
//! fold      D[pixel][channel] = sum of d[position][row] over the positions and taps that met the pixel      exact, i64
//! spread    average, none   every position of a square hears the word of its pixel
//!           max             the position whose code was the greatest does, the first of several; the others hear 0
//! ```
//!
//! See docs/MODEL.md, 3.8.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use std::ops::Range;

use crate::chip::crossbar::kernel::ConvShape;
use crate::chip::crossbar::layout::BLOCK_ROWS;
use crate::chip::layer::{LayerSpec, Pool};

/// The taps along one axis, from the first to the last, that lie on the image at a position; and the pixel of the first.
fn inside(shape: ConvShape, position: usize, size: usize) -> (Range<usize>, usize) {
    let first = position * shape.stride;
    let from = shape.pad.saturating_sub(first);
    let to = (size + shape.pad).saturating_sub(first).min(shape.side);
    (from..to.max(from), (first + from).saturating_sub(shape.pad))
}

/// Adds the row sums of a position, each times `2^shift` and a sign, to the sums of the pixels of its sample,
/// `[y][x][channel]`. What met the border goes nowhere, and a constant row has no pixel.
pub(in super::super) fn fold<T: Copy + Into<i64>>(
    spec: &LayerSpec,
    rows: &[T],
    position: usize,
    (shift, negate): (u32, bool),
    pixels: &mut [i64],
) {
    let add = |to: &mut [i64], from: &[T]| {
        for (to, &sum) in to.iter_mut().zip(from) {
            let sum = sum.into() << shift;
            *to += if negate { -sum } else { sum };
        }
    };
    let Some(shape) = spec.convolution else {
        return add(pixels, &rows[..spec.inputs]);
    };
    let ([_, across], channels) = (shape.output(), shape.channels);
    let (down, y) = inside(shape, position / across, shape.height);
    let (along, x) = inside(shape, position % across, shape.width);
    for (line, ky) in down.enumerate() {
        let to = ((y + line) * shape.width + x) * channels;
        let row = (ky * shape.side + along.start) * channels;
        let count = along.len() * channels;
        add(&mut pixels[to..to + count], &rows[row..row + count]);
    }
}

/// Rows of all positions of a sample that are driven by pixels of the image, and not by its border or a constant.
pub(in super::super) fn folded(spec: &LayerSpec) -> usize {
    let Some(shape) = spec.convolution else { return 0 };
    let taps = |positions: usize, size: usize| {
        (0..positions).map(|at| inside(shape, at, size).0.len()).sum::<usize>()
    };
    let [down, across] = shape.output();
    taps(down, shape.height) * taps(across, shape.width) * shape.channels
}

/// Words of the pixels of some samples, `[sample][pixel][64]`, as the positions of the map below hear them:
/// `[sample][position][64]`. `codes` are those of the positions, where the greatest of a square is asked for.
pub(in super::super) fn spread(spec: &LayerSpec, words: &[i16], codes: &[u8]) -> Vec<i16> {
    let side = spec.pool.side();
    if side == 1 {
        return words.to_vec();
    }
    let [_, across] = spec.convolution.map_or([1, 1], ConvShape::output);
    let [height, width] = spec.pooled();
    let (positions, pixels) = (spec.positions(), height * width);
    let mut heard = vec![0; words.len() * side * side];
    let (words, _) = words.as_chunks::<BLOCK_ROWS>();
    let samples = words.chunks_exact(pixels).zip(heard.chunks_exact_mut(positions * BLOCK_ROWS));
    for (sample, (words, heard)) in samples.enumerate() {
        let (heard, _) = heard.as_chunks_mut::<BLOCK_ROWS>();
        for (pixel, word) in words.iter().enumerate() {
            let corner = pixel / width * side * across + pixel % width * side;
            let square = || (0..side * side).map(|at| corner + at / side * across + at % side);
            let Pool::Max { .. } = spec.pool else {
                square().for_each(|at| heard[at] = *word);
                continue;
            };
            let (codes, _) = codes[sample * positions * BLOCK_ROWS..].as_chunks::<BLOCK_ROWS>();
            let mut most = codes[corner];
            for codes in square().map(|at| &codes[at]) {
                most.iter_mut().zip(codes).for_each(|(most, &code)| *most = (*most).max(code));
            }
            let mut left = *word;
            for at in square() {
                for unit in 0..BLOCK_ROWS {
                    if codes[at][unit] == most[unit] {
                        // the first of the greatest takes it
                        heard[at][unit] = std::mem::take(&mut left[unit]);
                    }
                }
            }
        }
    }
    heard
}

#[cfg(test)]
mod tests;
