//! What a window moves over: images of the samples, from whose pixels the rows of every position are driven.
//!
//! ```text
//! row (ky side + kx) channels + channel  of position y across + x  has pixel (y stride + ky - pad, x stride + kx - pad)
//! ```
//!
//! Outside the image lies a border of code 0. Addressing: it takes no time.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use super::TickLayer;
use crate::chip::crossbar::kernel::ConvShape;
use crate::chip::layer::LayerSpec;
use crate::chip::periphery;
use crate::chip::population::Stream;

/// The window of a layer, if it has one, and what it moves over.
#[derive(Debug)]
pub(super) struct Window {
    shape: Option<ConvShape>,
    /// By set of drives and sample: codes in the order y, x, channel.
    images: [Vec<Vec<u8>>; 2],
}

impl Window {
    pub(super) fn new(spec: &LayerSpec, samples: usize) -> Self {
        let image = |_| vec![vec![0; spec.sample_inputs()]; samples];
        let images = spec.convolution.map_or_else(Vec::new, image);
        Self { shape: spec.convolution, images: [images.clone(), images] }
    }
}

/// Half the logarithm of the rows that share a column, rounded up: rows of a dense layer or, in a window, channels times
/// the square of the stride.
pub(super) fn evened(spec: &LayerSpec) -> i64 {
    let rows = match spec.convolution {
        Some(shape) => shape.channels * shape.stride * shape.stride,
        None => spec.inputs,
    };
    let (mut columns, mut power) = (spec.units, 0);
    while columns < rows {
        columns *= 4;
        power += 1;
    }
    power
}

impl TickLayer {
    /// Reads of a sample.
    pub(in super::super) fn positions(&self) -> usize {
        self.window.shape.map_or(1, |shape| shape.output().iter().product())
    }

    /// Products of a cell for a sample: drivings of its row.
    pub(in super::super) fn products(&self) -> usize {
        self.positions() * self.driven_by.phases()
    }

    /// Codes of a sample below it.
    pub(in super::super) fn sample_inputs(&self) -> usize {
        let inputs = self.inputs * self.driven_by.phases();
        self.window.shape.map_or(inputs, |shape| shape.height * shape.width * shape.channels)
    }

    /// Sums of a sample that transposed reads give.
    pub(in super::super) fn sample_sums(&self) -> usize {
        self.sample_inputs() / self.driven_by.phases()
    }

    /// Puts codes of data on the rows of all banks.
    pub(in super::super) fn load_inputs(&mut self, codes: &[u8]) {
        for (sample, codes) in codes.chunks_exact(self.sample_inputs()).enumerate() {
            self.load_codes(None, sample, codes);
        }
    }

    /// Puts the codes of a sample below it, in the order y, x, channel, on the rows that a stream drives: of all banks where
    /// no stream is named.
    pub(in super::super) fn load_codes(
        &mut self,
        stream: Option<Stream>,
        sample: usize,
        codes: &[u8],
    ) {
        let shared = self.driven_by.is_shared();
        if shared && stream.is_some_and(|stream| stream != Stream::P) {
            return;
        }
        let Some(shape) = self.window.shape else {
            let phases = self.driven_by.phases();
            for (phase, codes) in codes.chunks_exact(self.inputs).enumerate() {
                for (row, &code) in codes.iter().enumerate() {
                    self.load_drive(stream, sample * phases + phase, row, code);
                }
            }
            // above 0: below it nothing was ever put on this row
            return self.load_constant(sample * phases);
        };
        self.window.images[stream.map_or(0, Stream::index)][sample] = codes.to_vec();
        let ConvShape { channels, height, width, side, stride, pad } = shape;
        let [down, across] = shape.output();
        for (y, x) in (0..down).flat_map(|y| (0..across).map(move |x| (y, x))) {
            let slot = sample * down * across + y * across + x;
            for (ky, kx) in (0..side).flat_map(|ky| (0..side).map(move |kx| (ky, kx))) {
                // from the corner of the border
                let (py, px) = (y * stride + ky, x * stride + kx);
                let inside = (pad..pad + height).contains(&py) && (pad..pad + width).contains(&px);
                for channel in 0..channels {
                    let code = match inside {
                        true => codes[((py - pad) * width + px - pad) * channels + channel],
                        false => 0,
                    };
                    self.load_drive(stream, slot, (ky * side + kx) * channels + channel, code);
                }
            }
            self.load_constant(slot);
        }
    }

    /// Adds what the last transposed read gave, of a sample of so many at a position, to the sums of the pixels that drove its
    /// rows; how many rows had one. Without a window a row is its own pixel, and its sum is kept.
    pub(in super::super) fn keep_backward(
        &mut self,
        (sample, samples): (usize, usize),
        position: usize,
    ) -> u64 {
        let (size, sums) = (self.sample_sums(), self.backward_sums(position % self.copies()));
        self.backward.resize(samples * size, 0);
        let kept = &mut self.backward[sample * size..(sample + 1) * size];
        let Some(shape) = self.window.shape else {
            kept.copy_from_slice(&sums);
            return 0;
        };
        if position == 0 {
            kept.fill(0);
        }
        let ConvShape { channels, height, width, side, stride, pad } = shape;
        let (y, x) = (position / shape.output()[1], position % shape.output()[1]);
        let mut added = 0;
        for (row, sum) in sums.into_iter().enumerate() {
            let (tap, channel) = (row / channels, row % channels);
            // from the corner of the border
            let (py, px) = (y * stride + tap / side, x * stride + tap % side);
            if (pad..pad + height).contains(&py) && (pad..pad + width).contains(&px) {
                kept[((py - pad) * width + px - pad) * channels + channel] += sum;
                added += 1;
            }
        }
        added
    }

    fn load_constant(&mut self, slot: usize) {
        if self.constant_row {
            self.load_drive(None, slot, self.inputs, self.drive_bits.code_max());
        }
    }

    /// What the units of a stream hand on of a sample: codes in the order of positions, then channels.
    pub(in super::super) fn codes_of(&self, stream: Stream, sample: usize) -> Vec<u8> {
        let reads = sample * self.positions()..(sample + 1) * self.positions();
        let values = reads.flat_map(|read| self.values(stream, read));
        values.map(|value| periphery::drive(value, self.drive_bits)).collect()
    }

    /// Sums of the codes below by channel, of a set of drives and so many samples, that of the constant row behind them; and
    /// over how many pixels they are. `None` of a layer without a window.
    pub(super) fn channel_codes(&self, set: usize, samples: usize) -> Option<(Vec<i64>, i64)> {
        let shape = self.window.shape?;
        let mut sums = vec![0; shape.channels];
        for image in &self.window.images[set][..samples] {
            for (at, &code) in image.iter().enumerate() {
                sums[at % shape.channels] += i64::from(code);
            }
        }
        let pixels = i64::try_from(samples * shape.height * shape.width).expect("few");
        if self.constant_row {
            sums.push(pixels * i64::from(self.drive_bits.code_max()));
        }
        Some((sums, pixels))
    }

    /// The mean that a row has: its own, or that of its channel.
    pub(super) fn mean_at(&self, row: usize) -> usize {
        match self.window.shape {
            Some(shape) if row < self.inputs => row % shape.channels,
            // the constant row
            Some(shape) => shape.channels,
            None => row,
        }
    }

    /// Pixels below it, as a power of two that is no less.
    pub(super) fn pixels_log2(&self) -> u32 {
        let pixels = self.window.shape.map_or(1, |shape| shape.height * shape.width);
        (0..).find(|&log2| 1 << log2 >= pixels).expect("there is a power of two")
    }
}
