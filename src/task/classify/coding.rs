//! Input coding: what the values of an example put on the rows of the first array.
//!
//! ```text
//! values   code(x)                                                                        in the order of the file
//! pixels   code(x)                                                                        y, x, channel
//! on_off   on_c  = floor( (2 max(x - m_c, 0) 255 + r) / (2 r) ),  r = M - m_c              y, x, on of each channel, then off
//!          off_c = floor( (2 max(m_c - x, 0) 255 + r) / (2 r) ),  r = m_c                  0 where r is 0;  M the full scale
//!          m_c   = floor( (2 sum + n) / (2n) )                                             over the n pixels of a channel of the
//!                                                                                          training part
//! white    src/task/classify/coding/white.rs                                              y, x, on of each filter, then off
//! ```
//!
//! `code` is that of [`Examples::codes`]; what `on_off` and `white` give are values of full scale 255 whose code is on a row.
//! Images lie plane by plane in the file; what a convolution reads lies y, x, channel. See docs/MODEL.md, 1.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

mod white;

use super::examples::{Examples, codes_of};
use crate::learn::network::NetworkError;
use crate::num::fixed::{DriveBits, narrow};

pub use white::WHITE_NAME;
use white::White;

/// What the values of an example put on the rows of the first array. Images have a height, a width and channels.
///
/// ```
/// use dalean::network::Coding;
///
/// let image = [32, 32, 3];
/// assert_eq!(Coding::Values.channels(), None);
/// assert_eq!(Coding::Pixels { image }.channels(), Some(3));
/// assert_eq!(Coding::OnOff { image }.channels(), Some(6));
/// assert_eq!(Coding::White { image }.channels(), Some(6));
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub enum Coding {
    /// Each value a row, in the order of the file.
    #[default]
    Values,
    /// Each value a row, channels last.
    Pixels {
        /// Height, width, channels.
        image: [usize; 3],
    },
    /// What is above the mean of its channel, and what is below.
    OnOff {
        /// Height, width, channels.
        image: [usize; 3],
    },
    /// What a fixed whitening filter leaves of three colours, above 0 and below.
    White {
        /// Height, width, channels.
        image: [usize; 3],
    },
}

impl Coding {
    /// The image that it takes.
    #[must_use]
    pub const fn image(self) -> Option<[usize; 3]> {
        match self {
            Self::Values => None,
            Self::Pixels { image } | Self::OnOff { image } | Self::White { image } => Some(image),
        }
    }

    /// Channels that it gives, of an image.
    #[must_use]
    pub const fn channels(self) -> Option<usize> {
        match self {
            Self::Values => None,
            Self::Pixels { image: [.., channels] } => Some(channels),
            Self::OnOff { image: [.., channels] } => Some(channels.saturating_mul(2)),
            Self::White { .. } => Some(2 * white::FILTERS),
        }
    }

    /// Rows that an example of so many values drives.
    #[must_use]
    pub const fn rows(self, features: usize) -> usize {
        match (self.image(), self.channels()) {
            (Some([height, width, _]), Some(channels)) => {
                height.saturating_mul(width).saturating_mul(channels)
            }
            _ => features,
        }
    }

    /// Values of an example that drives so many rows.
    #[must_use]
    pub const fn features(self, rows: usize) -> usize {
        match self.image() {
            None => rows,
            Some([height, width, channels]) => {
                height.saturating_mul(width).saturating_mul(channels)
            }
        }
    }

    /// Checks that it makes the rows of the first layer, of which each example drives so many.
    pub(super) fn check(self, rows: usize) -> Result<(), NetworkError> {
        let Some([height, width, channels]) = self.image() else { return Ok(()) };
        let key = "network.input";
        if let Self::White { .. } = self
            && channels != white::COLOURS
        {
            let found = format!("is \"white\" of {channels} channels");
            let allowed = "its filter is one of three colours: use \"on_off\" or \"raw\", or images with three channels";
            return Err(NetworkError::misfit(key, found, allowed));
        }
        let side = 1..=Self::SIDE_MAX;
        let fits = side.contains(&height) && side.contains(&width) && side.contains(&channels);
        let given = self.rows(0);
        if !fits || given != rows {
            let found =
                format!("makes {given} codes of an image of {height} x {width} x {channels}");
            let allowed = format!(
                "the first layer takes {rows}, and every size of an image is 1..={}",
                Self::SIDE_MAX
            );
            return Err(NetworkError::misfit(key, found, allowed));
        }
        Ok(())
    }

    /// Most of any size of an image.
    const SIDE_MAX: usize = 4096;

    /// What codes examples like these, whose means are those of the training part.
    pub(super) fn of(self, train: &Examples, bits: DriveBits) -> Coder {
        let (codes, drives) = (train.codes(bits), codes_of(255, bits));
        let middles = match self {
            Self::OnOff { image: [height, width, channels] } => {
                middles(train, height * width, channels)
            }
            _ => vec![],
        };
        let way = match self {
            Self::Values => Way::Values,
            Self::Pixels { image: [.., channels] } => Way::Tables(vec![codes; channels]),
            Self::OnOff { .. } => {
                let table = |middle: &u8, side: usize| {
                    sides(*middle, train.full_scale())[side].map(|value| drives[usize::from(value)])
                };
                let on = middles.iter().map(|middle| table(middle, 0));
                Way::Tables(on.chain(middles.iter().map(|middle| table(middle, 1))).collect())
            }
            Self::White { image: [height, width, _] } => {
                let eight = train.codes(DriveBits::new(8).expect("in range"));
                Way::White(Box::new(White::new([height, width], eight, drives)))
            }
        };
        Coder { way, codes, image: self.image(), middles }
    }
}

/// The mean of each channel over images, halves up; half the scale of no image.
pub(super) fn middles(train: &Examples, pixels: usize, channels: usize) -> Vec<u8> {
    let mut sums = vec![0u64; channels];
    for example in 0..train.len() {
        let planes = train.values(example).chunks_exact(pixels);
        for (sum, plane) in sums.iter_mut().zip(planes) {
            *sum += plane.iter().map(|&x| u64::from(x)).sum::<u64>();
        }
    }
    let n = (train.len() as u64).saturating_mul(pixels as u64);
    let mean = |sum: u64| match n {
        0 => train.full_scale() / 2,
        _ => narrow((2 * u128::from(sum) + u128::from(n)) / (2 * u128::from(n)), "a mean of bytes"),
    };
    sums.into_iter().map(mean).collect()
}

/// The value of each value above a middle, and below it, each of full scale 255.
fn sides(middle: u8, full_scale: u8) -> [[u8; 256]; 2] {
    let (middle, most) = (u32::from(middle), u32::from(full_scale));
    let scaled = |apart: u32, range: u32| match range {
        0 => 0,
        range => narrow((2 * apart * 255 + range) / (2 * range), "no more than its range"),
    };
    let value = |at: usize| (at as u32).min(most);
    [
        std::array::from_fn(|x| scaled(value(x).saturating_sub(middle), most - middle)),
        std::array::from_fn(|x| scaled(middle.saturating_sub(value(x)), middle)),
    ]
}

/// Codes examples of one kind.
#[derive(Debug, Clone)]
pub(super) struct Coder {
    way: Way,
    /// The drive code of each value.
    codes: [u8; 256],
    image: Option<[usize; 3]>,
    /// Mean of each channel that inputs lie above and below.
    middles: Vec<u8>,
}

#[derive(Debug, Clone)]
enum Way {
    Values,
    /// A table for each channel that is put out; behind those of all channels that came in, they begin again.
    Tables(Vec<[u8; 256]>),
    White(Box<White>),
}

impl Coder {
    /// Mean of each channel, where inputs lie above and below it.
    pub(super) fn middles(&self) -> &[u8] {
        &self.middles
    }

    /// Appends the drive codes of an example.
    pub(super) fn code(&mut self, values: &[u8], out: &mut Vec<u8>) {
        let Self { way, codes, image, .. } = self;
        match (way, *image) {
            (Way::Tables(tables), Some([height, width, channels])) => {
                let pixels = height * width;
                let start = out.len();
                out.resize(start + pixels * tables.len(), 0);
                let out = &mut out[start..];
                for (at, table) in tables.iter().enumerate() {
                    let plane = &values[(at % channels) * pixels..][..pixels];
                    for (pixel, &x) in out.chunks_exact_mut(tables.len()).zip(plane) {
                        pixel[at] = table[usize::from(x)];
                    }
                }
            }
            (Way::White(white), _) => white.code(values, out),
            (Way::Values | Way::Tables(_), _) => {
                out.extend(values.iter().map(|&x| codes[usize::from(x)]));
            }
        }
    }
}

#[cfg(test)]
mod tests;
