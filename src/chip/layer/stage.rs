//! What an array of a network may have around it: a window that moves over an image below it, a pool above it, and units
//! that keep to a middle of their own.
//!
//! ```text
//! positions   P = rows out * columns out of a convolution, 1 of a dense layer:  an array is read P times a sample
//! order       inputs and outputs of a sample lie y, x, channel
//! average     floor( (2 sum + q^2) / (2 q^2) )  over q x q codes        max    the greatest of q x q codes
//! ```
//!
//! See docs/MODEL.md, 1 and 2.4.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use crate::chip::crossbar::kernel::ConvShape;

/// What lies between the units of a convolution and what they drive.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub enum Pool {
    /// Nothing: every unit drives.
    #[default]
    None,
    /// The mean of squares of `side` x `side` codes that do not overlap.
    Average {
        /// Rows and columns of a square.
        side: usize,
    },
    /// The greatest code of each square.
    Max {
        /// Rows and columns of a square.
        side: usize,
    },
}

impl Pool {
    /// Rows and columns of a square; 1 where there is no pool.
    #[must_use]
    pub const fn side(self) -> usize {
        match self {
            Self::None => 1,
            Self::Average { side } | Self::Max { side } => side,
        }
    }
}

/// How the step of a layer's table is found.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub enum Gain {
    /// By its activation, once and for all.
    #[default]
    Table,
    /// By what its units read before the first update: a standard deviation is 128 indices, times `2^spread`.
    Fixed {
        /// 0..=2.
        spread: u32,
    },
    /// So at first, and after it by what they read: a power of two that follows their variance.
    Tracking,
}

/// What the units of a layer do beside their table. See `chip::layer::homeostasis`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Homeostasis {
    /// Whether each unit takes the running mean of its own accumulator off it.
    pub threshold: bool,
    /// How the step of the table is found.
    pub gain: Gain,
    /// `w`: so many samples, as a power of two, move thresholds and variance by what they are off.
    pub window_log2: u32,
}

impl Homeostasis {
    /// None.
    pub const OFF: Self = Self { threshold: false, gain: Gain::Table, window_log2: 9 };

    /// Whether units do anything beside their table.
    #[must_use]
    pub const fn is_on(self) -> bool {
        self.threshold || !matches!(self.gain, Gain::Table)
    }

    /// Whether writes move what units do beside their table.
    #[must_use]
    pub(crate) const fn moves(self) -> bool {
        self.threshold || matches!(self.gain, Gain::Tracking)
    }
}

impl Default for Homeostasis {
    fn default() -> Self {
        Self::OFF
    }
}

impl super::LayerSpec {
    /// Times that its array is read for a sample: positions of a convolution.
    #[must_use]
    pub fn positions(&self) -> usize {
        self.convolution.map_or(1, ConvShape::positions)
    }

    /// Turns in which its array is read for a sample: copies of it read as many positions at a time.
    ///
    /// ```text
    /// turns   ceil(P / copies);  copy c reads positions c, c + copies, c + 2 copies ..
    /// ```
    #[must_use]
    pub fn turns(&self) -> usize {
        self.positions().div_ceil(self.copies.max(1))
    }

    /// Times that its rows are driven for a sample, and that products of drives and gates are formed: twice a read where
    /// drives have a sign.
    #[must_use]
    pub fn drivings(&self) -> usize {
        self.positions() * self.driven_by.phases()
    }

    /// Codes of a sample below it, of a set of drives. Where they have a sign: what is above 0 of each, then what is below.
    #[must_use]
    pub fn sample_inputs(&self) -> usize {
        let inputs = self.inputs.saturating_mul(self.driven_by.phases());
        self.convolution.map_or(inputs, |shape| shape.height * shape.width * shape.channels)
    }

    /// Sums of a sample that a transposed read gives: one a pixel below a window, else one a row that data drive. What is
    /// driven in two phases, for its sign, is one row still.
    #[must_use]
    pub fn sample_sums(&self) -> usize {
        self.sample_inputs() / self.driven_by.phases()
    }

    /// Rows and columns of what its units hand on, behind the pool.
    #[must_use]
    pub fn pooled(&self) -> [usize; 2] {
        let side = self.pool.side();
        self.convolution.map_or([1, 1], |shape| shape.output().map(|size| size / side))
    }

    /// Codes that a stream of its units hands on, of a sample.
    #[must_use]
    pub fn sample_outputs(&self) -> usize {
        let [height, width] = self.pooled();
        height * width * self.units
    }

    /// What words that come back through its rows lose by there being fewer columns than rows, as a power of two: the root of
    /// their ratio. In a window a pixel meets `side^2 / stride^2` rows.
    #[must_use]
    pub(crate) fn back_gain_log2(&self) -> u32 {
        let inputs =
            self.convolution.map_or(self.inputs, |shape| shape.channels * shape.stride.pow(2));
        let (inputs, units) = (inputs as u128, self.units as u128);
        (0..).find(|&gain| units << (2 * gain) >= inputs).expect("sizes are far below 2^64")
    }

    /// What is wrong with the sizes of its window and pool, if anything is: what was found, and what is allowed.
    #[must_use]
    pub fn misshapen(&self) -> Option<(String, String)> {
        let Some(shape) = self.convolution else {
            let pools = self.pool != Pool::None;
            let found = "has a pool behind a dense layer".to_owned();
            return pools.then(|| (found, "only maps of a convolution are pooled".to_owned()));
        };
        let sizes = [shape.channels, shape.height, shape.width, shape.side, shape.stride];
        if sizes.contains(&0) || sizes.iter().any(|&size| size > SIZE_MAX) || shape.pad > SIZE_MAX {
            let found = format!("is a convolution of {shape:?}");
            return Some((found, format!("every size is 1..={SIZE_MAX}")));
        }
        let [height, width] = shape.padded();
        if shape.side > height.min(width) || shape.pad >= shape.side {
            let found = format!(
                "moves a window of {0} x {0} over {height} x {width} pixels, of which {1} on each side are border",
                shape.side, shape.pad
            );
            let allowed = "a window fits the image with its border, and is wider than the border";
            return Some((found, allowed.to_owned()));
        }
        if self.inputs != shape.rows() {
            let found = format!("has {} inputs", self.inputs);
            return Some((found, format!("its windows have {} codes", shape.rows())));
        }
        let (side, [height, width]) = (self.pool.side(), shape.output());
        if side == 0 || !height.is_multiple_of(side) || !width.is_multiple_of(side) {
            let found = format!("pools {side} x {side} of {height} x {width} positions");
            return Some((found, "squares cover a map without a rest".to_owned()));
        }
        None
    }
}

/// Most of any size of a convolution.
const SIZE_MAX: usize = 4096;
