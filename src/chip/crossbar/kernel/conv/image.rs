//! Where drives of a convolution lie, and which of them a row of the array meets.
//!
//! ```text
//! image     [block of channels][sample][height + 2 pad][width + 2 pad][64 channels]       u8, the border is 0
//! packed    [sample][height + 2 pad][width + 2 pad][channels]                             u8, the border is 0
//! row       (ky * side + kx) * channels + channel
//! position  (sample * rows out + y) * columns out + x      meets pixel (y * stride + ky, x * stride + kx)
//! ```
//!
//! A block of an image lies as a block of [`Drives`](super::super::Drives) does, with pixels for samples: look-up
//! writes it, `turn` takes it, and 16 neighbours are one matrix tile of 1 KiB, however many channels there are. Packed
//! pixels are for first layers of few channels.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use crate::chip::crossbar::layout::{BLOCK_ROWS, Layout};

/// Sizes of a convolution.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ConvShape {
    /// Channels that drive rows.
    pub channels: usize,
    /// Rows of pixels, without the border.
    pub height: usize,
    /// Columns of pixels, without the border.
    pub width: usize,
    /// Rows and columns of the kernel: `side^2` taps.
    pub side: usize,
    /// Pixels from a position to the next.
    pub stride: usize,
    /// Pixels of border on each side, driven with 0.
    pub pad: usize,
}

impl ConvShape {
    /// Pixels down and across, with the border.
    #[must_use]
    pub const fn padded(self) -> [usize; 2] {
        [self.height + 2 * self.pad, self.width + 2 * self.pad]
    }

    /// Pixels of a sample, with the border.
    #[must_use]
    pub const fn pixels(self) -> usize {
        let [height, width] = self.padded();
        height * width
    }

    /// Positions down and across.
    #[must_use]
    pub const fn output(self) -> [usize; 2] {
        let [height, width] = self.padded();
        [(height - self.side) / self.stride + 1, (width - self.side) / self.stride + 1]
    }

    /// Positions of a sample.
    #[must_use]
    pub const fn positions(self) -> usize {
        let [height, width] = self.output();
        height * width
    }

    /// Rows of the array: one for each tap and channel.
    #[must_use]
    pub const fn rows(self) -> usize {
        self.side * self.side * self.channels
    }

    /// Pixels of the first taps of a position and of those behind it, without end.
    pub(in super::super) const fn steps(self, position: usize) -> Steps {
        let ([height, width], [down, across]) = (self.padded(), self.output());
        let place = position % self.positions();
        Steps {
            pixel: self.pixel(position),
            x: place % across,
            y: place / across,
            across,
            down,
            stride: self.stride,
            row: self.stride * width,
            sample: height * width,
        }
    }

    /// Pixel of a position's first tap, over all samples.
    const fn pixel(self, position: usize) -> usize {
        let [_, across] = self.output();
        let (sample, place) = (position / self.positions(), position % self.positions());
        let [_, width] = self.padded();
        sample * self.pixels() + (place / across * width + place % across) * self.stride
    }
}

/// See [`ConvShape::steps`].
#[derive(Debug, Clone)]
pub(in super::super) struct Steps {
    pixel: usize,
    x: usize,
    y: usize,
    across: usize,
    down: usize,
    /// Pixels from a position to the next, to the next row of positions, and to the next sample.
    stride: usize,
    row: usize,
    sample: usize,
}

impl Steps {
    /// The next pixel.
    #[cfg(target_arch = "x86_64")]
    #[inline]
    pub(in super::super) const fn pixel(&self) -> usize {
        self.pixel
    }

    /// Goes past `count` positions, if they are all of this row.
    #[inline]
    pub(in super::super) const fn pass(&mut self, count: usize) -> bool {
        if self.across - self.x < count {
            return false;
        }
        self.pixel += count * self.stride;
        self.x += count;
        if self.x == self.across {
            self.x = 0;
            self.pixel = self.pixel + self.row - self.across * self.stride;
            self.y += 1;
        }
        if self.y == self.down {
            self.y = 0;
            // the last row of positions may end behind the sample
            self.pixel = self.pixel + self.sample - self.down * self.row;
        }
        true
    }
}

impl Iterator for Steps {
    type Item = usize;

    #[inline]
    fn next(&mut self) -> Option<usize> {
        let pixel = self.pixel;
        self.pass(1).then_some(pixel)
    }
}

/// How the channels of a pixel lie.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Pixels {
    /// In blocks of 64, the last one padded with 0.
    Blocks,
    /// Side by side.
    Packed,
}

/// Where the blocks of rows of a convolution lie in images of some samples. Made once for a layer and batch.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ConvPlan {
    shape: ConvShape,
    samples: usize,
    pixels: Pixels,
    /// Bytes from the first tap of a position to its 64 drives of a block of rows, where these lie together.
    offsets: Vec<usize>,
}

impl ConvPlan {
    /// A plan for `samples` samples.
    ///
    /// # Panics
    /// When a size is 0 or the kernel is larger than the image and its border.
    #[must_use]
    pub fn new(shape: ConvShape, samples: usize, pixels: Pixels) -> Self {
        let sizes = [shape.channels, shape.height, shape.width, shape.side, shape.stride, samples];
        assert!(sizes.iter().all(|&size| size > 0), "there is something to read");
        let [height, width] = shape.padded();
        assert!(shape.side <= height && shape.side <= width, "the kernel fits the image");
        let together = shape.channels.is_multiple_of(BLOCK_ROWS)
            && (pixels == Pixels::Blocks || shape.channels == BLOCK_ROWS);
        let blocks = if together { shape.channels / BLOCK_ROWS } else { 0 };
        let taps = (0..shape.side).flat_map(|ky| (0..shape.side).map(move |kx| ky * width + kx));
        let offsets = taps.flat_map(|tap| {
            (0..blocks).map(move |block| (block * samples * shape.pixels() + tap) * BLOCK_ROWS)
        });
        Self { shape, samples, pixels, offsets: offsets.collect() }
    }

    /// Sizes.
    #[must_use]
    pub const fn shape(&self) -> ConvShape {
        self.shape
    }

    /// Samples of an image.
    #[must_use]
    pub const fn samples(&self) -> usize {
        self.samples
    }

    /// How the channels of a pixel lie.
    #[must_use]
    pub const fn form(&self) -> Pixels {
        self.pixels
    }

    /// Positions of all samples.
    #[must_use]
    pub const fn positions(&self) -> usize {
        self.samples * self.shape.positions()
    }

    /// Blocks of 64 rows of the array.
    #[must_use]
    pub const fn blocks(&self) -> usize {
        Layout { rows: self.shape.rows(), columns: 1 }.blocks()
    }

    /// Bytes of an image.
    #[must_use]
    pub const fn image_bytes(&self) -> usize {
        self.channel_blocks() * self.samples * self.shape.pixels() * self.pixel_bytes()
    }

    /// Blocks of channels of an image.
    #[must_use]
    pub const fn channel_blocks(&self) -> usize {
        match self.pixels {
            Pixels::Blocks => self.shape.channels.div_ceil(BLOCK_ROWS),
            Pixels::Packed => 1,
        }
    }

    /// Bytes of a pixel in a block of channels.
    #[must_use]
    pub const fn pixel_bytes(&self) -> usize {
        match self.pixels {
            Pixels::Blocks => BLOCK_ROWS,
            Pixels::Packed => self.shape.channels,
        }
    }

    /// Place of a drive in an image. `y` and `x` count pixels of the border too.
    #[must_use]
    pub const fn index(&self, sample: usize, y: usize, x: usize, channel: usize) -> usize {
        let bytes = self.pixel_bytes();
        let [_, width] = self.shape.padded();
        let block = channel / bytes * self.samples + sample;
        (block * self.shape.pixels() + y * width + x) * bytes + channel % bytes
    }

    /// Where 64 rows of a block lie together in the image, their bytes from the first tap on; by block.
    pub(in super::super) fn offsets(&self) -> Option<&[usize]> {
        (!self.offsets.is_empty()).then_some(&self.offsets)
    }

    /// Whether an update takes the image as it lies: the tap of a block is then a step along turned pixels.
    pub(super) const fn steps_along(&self) -> bool {
        !self.offsets.is_empty() && self.shape.stride == 1
    }

    /// Pixels from the first tap to the last.
    pub(super) const fn reach(&self) -> usize {
        let [_, width] = self.shape.padded();
        (self.shape.side - 1) * (width + 1)
    }

    /// Places of the gates of some samples, a multiple of 64. Places without a position have gates of 0.
    #[must_use]
    pub const fn places(&self, samples: usize) -> usize {
        let positions = samples * self.shape.positions();
        let places = match positions {
            0 => 0,
            positions => self.place(positions - 1) + 1,
        };
        places.next_multiple_of(64)
    }

    /// Place of a position's gate, counted from the first of some samples.
    #[must_use]
    pub const fn place(&self, position: usize) -> usize {
        if self.steps_along() { self.shape.pixel(position) } else { position }
    }
}

/// Drives of some samples, with their border.
#[derive(Debug, Clone, Copy)]
pub struct Image<'a> {
    plan: &'a ConvPlan,
    codes: &'a [u8],
}

impl<'a> Image<'a> {
    /// An image of the plan's sizes.
    ///
    /// # Panics
    /// When there are more codes or fewer.
    #[must_use]
    pub fn new(plan: &'a ConvPlan, codes: &'a [u8]) -> Self {
        assert_eq!(codes.len(), plan.image_bytes(), "every pixel has its codes");
        Self { plan, codes }
    }

    /// Its plan.
    #[must_use]
    pub const fn plan(self) -> &'a ConvPlan {
        self.plan
    }

    /// All codes.
    #[must_use]
    pub const fn codes(self) -> &'a [u8] {
        self.codes
    }

    /// The drive of a row of the array at a position. Rows that do not exist are driven with 0.
    #[must_use]
    pub fn drive(self, row: usize, position: usize) -> u8 {
        let shape = self.plan.shape;
        if row >= shape.rows() {
            return 0;
        }
        let (tap, channel) = (row / shape.channels, row % shape.channels);
        let (sample, place) = (position / shape.positions(), position % shape.positions());
        let [_, across] = shape.output();
        let y = place / across * shape.stride + tap / shape.side;
        let x = place % across * shape.stride + tap % shape.side;
        self.codes[self.plan.index(sample, y, x, channel)]
    }
}
