//! What lies between the units of one layer and the rows of the next where either is a convolution: maps, pools, images
//! and the windows that move over them.
//!
//! ```text
//! map       [block of 64 channels][read][64]          codes of the units of a stream; read = sample P + position
//! image     [sample][height + 2 pad][width + 2 pad][channels]                          pooled, with its border of 0
//! drives    [block of 64 rows][read][64]              what windows meet, as the drives of a dense layer lie: of some reads,
//!                                                     put together where they are read and where they are written
//! ```
//!
//! A read of a convolution is to its array what a sample is to a dense one, so everything before and behind, from
//! converters to writes, is what dense layers have. Into a dense layer codes go in the order y, x, channel. See
//! docs/MODEL.md, 1 and 2.4.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use std::ops::Range;

use super::Engine;
use super::each::{MOVE, each};
use crate::chip::crossbar::kernel::{ConvPlan, ConvShape, Image, Pixels, Team, Windows};
use crate::chip::crossbar::layout::BLOCK_ROWS;
use crate::chip::hardware::Hardware;
use crate::chip::layer::{LayerSpec, Pool};
use crate::chip::ledger::Event;
use crate::chip::population::Stream;

mod back;

pub(super) use back::{fold, folded, spread};

impl Engine {
    /// Reads of a layer of the loaded samples: positions of all of them.
    pub(super) fn reads(&self, layer: usize) -> usize {
        self.samples * self.layers[layer].spec.positions()
    }

    /// Times that rows of a layer are driven for the samples that are loaded.
    pub(super) fn drivings(&self, layer: usize) -> usize {
        self.samples * self.layers[layer].spec.drivings()
    }

    /// The same of some samples.
    pub(super) fn drivings_of(&self, layer: usize, samples: &Range<usize>) -> Range<usize> {
        let drivings = self.layers[layer].spec.drivings();
        samples.start * drivings..samples.end * drivings
    }

    /// Reads of some samples of a layer.
    pub(super) fn reads_of(&self, layer: usize, samples: &Range<usize>) -> Range<usize> {
        let positions = self.layers[layer].spec.positions();
        samples.start * positions..samples.end * positions
    }

    /// How often the arrays of a layer stand on the chip.
    pub(super) fn copies_of(&self, layer: usize) -> u64 {
        self.layers[layer].spec.copies as u64
    }

    /// Whether units of a layer put their codes where the next one is driven from, as they are.
    pub(super) fn hands_on_directly(&self, layer: usize) -> bool {
        let next = self.layers.get(layer + 1);
        self.layers[layer].spec.positions() == 1
            && next.is_some_and(|next| next.spec.convolution.is_none())
    }

    /// Puts codes of data on the rows of the first layer, which is a convolution: `[sample][y][x][channel]`.
    pub(super) fn load_image(&mut self, shape: ConvShape, codes: &[u8]) {
        let inside = shape.height * shape.width * shape.channels;
        let registers = &mut self.registers[0];
        let image = &mut registers.images[0];
        image.resize(self.samples * shape.pixels() * shape.channels, 0);
        let size = shape.pixels() * shape.channels;
        let parts = image.chunks_exact_mut(size).zip(codes.chunks_exact(inside)).enumerate();
        each(&mut self.team, codes.len() * MOVE, self.samples, parts.collect(), |_, part| {
            let (image, codes) = part;
            let line = shape.width * shape.channels;
            for (y, codes) in codes.chunks_exact(line).enumerate() {
                let at = ((y + shape.pad) * shape.padded()[1] + shape.pad) * shape.channels;
                image[at..at + line].copy_from_slice(codes);
            }
        });
        self.lay_windows(0);
    }

    /// What the units of a layer put out becomes drives of the next one.
    pub(super) fn hand_on(&mut self, layer: usize) {
        if layer + 1 == self.layers.len() || self.hands_on_directly(layer) {
            return;
        }
        let samples = self.samples;
        let spec = self.layers[layer].spec.clone();
        let next = self.layers[layer + 1].spec.clone();
        let (rows, [height, width]) = (self.layers[layer + 1].layout.rows_padded(), spec.pooled());
        let pad = next.convolution.map_or(0, |shape| shape.pad);
        let size = (height + 2 * pad) * (width + 2 * pad) * spec.units;
        for target in next.drive_sets() {
            let at = target.index();
            let (head, tail) = self.registers.split_at_mut(layer + 1);
            let (map, image) = (&head[layer].maps[at], &mut tail[0].images[at]);
            image.resize(samples * size, 0);
            let parts =
                image.chunks_exact_mut(size).enumerate().map(|(at, image)| (at, (at, image)));
            let work = map.len() * MOVE / 8;
            each(&mut self.team, work, samples, parts.collect(), |_, (sample, image)| {
                pool(&spec, map, (sample, samples), pad, image);
            });
            if next.convolution.is_some() {
                self.lay_windows(layer + 1);
            } else {
                let to = &mut tail[0];
                to.drives[at].resize(samples * rows, 0);
                flatten(&mut self.team, &to.images[at], samples, next.inputs, &mut to.drives[at]);
            }
            let code = Self::code_of(spec.wiring, *target);
            if spec.pool != Pool::None {
                let pooled = (samples * spec.positions() * spec.units) as u64;
                self.charge_read(layer, code, Event::Pooled, pooled);
                // a code is stored and fetched
                self.charge_read(layer, code, Event::SramBits, 16 * pooled);
            }
        }
    }

    /// What the windows of a convolution meet, of a set of drives; nothing where no sample is loaded.
    pub(super) fn windows(&self, layer: usize, set: Stream) -> Option<Windows<'_>> {
        let registers = &self.registers[layer];
        let plan = registers.plan.as_ref()?;
        let image = Image::new(plan, &registers.images[set.index()]);
        Some(windows_of(&self.layers[layer].spec, &self.hardware, image))
    }

    /// Says where windows of the loaded samples lie.
    fn lay_windows(&mut self, layer: usize) {
        let shape = self.layers[layer].spec.convolution.expect("only windows are laid");
        let plan = (self.samples > 0).then(|| ConvPlan::new(shape, self.samples, Pixels::Packed));
        self.registers[layer].plan = plan;
    }
}

/// What the windows of a convolution meet that move over an image.
pub(super) fn windows_of<'a>(
    spec: &LayerSpec,
    hardware: &Hardware,
    image: Image<'a>,
) -> Windows<'a> {
    let code_max = hardware.drive.bits.code_max();
    Windows::new(image, spec.constant_row.then_some((spec.inputs, code_max)))
}

/// Sums of the codes below a convolution, by channel; the border adds nothing.
pub(super) fn channel_sums(image: &[u8], channels: usize) -> Vec<i64> {
    let mut sums = vec![0i64; channels];
    // rows of at most 2^24 codes are added in 32 bits
    for rows in image.chunks(channels << 12) {
        let mut part = vec![0u32; channels];
        for pixel in rows.chunks_exact(channels) {
            part.iter_mut().zip(pixel).for_each(|(sum, &code)| *sum += u32::from(code));
        }
        sums.iter_mut().zip(part).for_each(|(sum, part)| *sum += i64::from(part));
    }
    sums
}

/// Pools the map of a sample into its image, whose border stays 0.
fn pool(
    spec: &LayerSpec,
    map: &[u8],
    (sample, samples): (usize, usize),
    pad: usize,
    image: &mut [u8],
) {
    let [_, across] = spec.convolution.map_or([1, 1], ConvShape::output);
    let ([height, width], side) = (spec.pooled(), spec.pool.side());
    let (positions, channels) = (spec.positions(), spec.units);
    for (block, first) in (0..channels).step_by(BLOCK_ROWS).enumerate() {
        let live = (channels - first).min(BLOCK_ROWS);
        let codes = &map[(block * samples + sample) * positions * BLOCK_ROWS..];
        let (codes, _) = codes[..positions * BLOCK_ROWS].as_chunks::<BLOCK_ROWS>();
        for y in 0..height {
            for x in 0..width {
                let at = ((y + pad) * (width + 2 * pad) + x + pad) * channels + first;
                let square = (0..side).flat_map(|dy| {
                    let row = (y * side + dy) * across + x * side;
                    &codes[row..row + side]
                });
                let pooled = match spec.pool {
                    Pool::None => codes[y * across + x],
                    Pool::Average { side: 2 } => {
                        average_of_four(codes, y * 2 * across + x * 2, across)
                    }
                    Pool::Average { .. } => average(square, side),
                    Pool::Max { .. } => greatest(square),
                };
                image[at..at + live].copy_from_slice(&pooled[..live]);
            }
        }
    }
}

/// The same of a square of two, whose first code lies at `at`: `(sum + 2) >> 2`, in 16 bits.
fn average_of_four(codes: &[[u8; BLOCK_ROWS]], at: usize, across: usize) -> [u8; BLOCK_ROWS] {
    let [a, b, c, d] = [at, at + 1, at + across, at + across + 1].map(|at| &codes[at]);
    let mut out = [0; BLOCK_ROWS];
    for i in 0..BLOCK_ROWS {
        let sum = [a[i], b[i], c[i], d[i]].map(u16::from).iter().sum::<u16>();
        out[i] = ((sum + 2) >> 2) as u8;
    }
    out
}

/// `floor((2 sum + q^2) / (2 q^2))` of each of 64 channels.
fn average<'a>(
    square: impl Iterator<Item = &'a [u8; BLOCK_ROWS]>,
    side: usize,
) -> [u8; BLOCK_ROWS] {
    let mut sums = [0u32; BLOCK_ROWS];
    for codes in square {
        sums.iter_mut().zip(codes).for_each(|(sum, &code)| *sum += u32::from(code));
    }
    let cells = u32::try_from(side * side).expect("a square of a map");
    sums.map(|sum| u8::try_from((2 * sum + cells) / (2 * cells)).expect("a mean of bytes"))
}

fn greatest<'a>(square: impl Iterator<Item = &'a [u8; BLOCK_ROWS]>) -> [u8; BLOCK_ROWS] {
    let mut most = [0; BLOCK_ROWS];
    for codes in square {
        most.iter_mut().zip(codes).for_each(|(most, &code)| *most = (*most).max(code));
    }
    most
}

/// Lays codes `[sample][input]` as the drives of a dense layer lie, `[block of 64 rows][sample][64]`.
pub(super) fn flatten(
    team: &mut Team,
    codes: &[u8],
    samples: usize,
    inputs: usize,
    drives: &mut [u8],
) {
    let blocks = drives.len() / (samples * BLOCK_ROWS).max(1);
    let parts = drives.chunks_exact_mut((samples * BLOCK_ROWS).max(1)).enumerate();
    let parts = parts.map(|(block, drives)| (block, (block * BLOCK_ROWS, drives))).collect();
    each(team, codes.len() * MOVE, blocks, parts, |_, (first, drives)| {
        let last = (first + BLOCK_ROWS).min(inputs);
        for (row, codes) in drives.chunks_exact_mut(BLOCK_ROWS).zip(codes.chunks_exact(inputs)) {
            // a block may hold the constant row alone
            let codes = &codes[first.min(last)..last];
            row[..codes.len()].copy_from_slice(codes);
            row[codes.len()..].fill(0);
        }
    });
}

#[cfg(test)]
mod tests;
