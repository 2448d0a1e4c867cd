//! A fixed filter that whitens images of three colours.
//!
//! ```text
//! image    N values x, brought to 0..255;  s1 = sum x,  s2 = sum x^2,  D = isqrt(N s2 - s1^2) + 8N
//!          t   = floor( (256 (N x - s1) + D) / (2D) )                                       7 fractional bits
//! filter   f_o = sum over 5 x 5 pixels and 3 colours of q[o][c][ky][kx] t                   outside the image t = 0
//! codes    on_o = clamp( rsh(f_o, 14), 0, 255 ),   off_o = clamp( rsh(-f_o, 14), 0, 255 )
//! ```
//!
//! Of an image less its mean, in units of its deviation, the filter leaves what its neighbourhood does not tell; code 255
//! is three deviations of that. `q` is `floor(10880 W + 1/2)` of the centre rows `W` of a whitening of patches of 5 x 5
//! pixels of CIFAR-10's training images: data, of which [`WHITE_NAME`] is the name. `|t| <= 4080`, since no value lies more
//! than 255 from the mean and the divisor is 8 at least, and `|f| <= 96,468 x 4080 < 2^31`. See docs/MODEL.md, 1.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use crate::num::fixed::{narrow, rsh};

/// What the constants of the filter are called where a run says what it was given: others have another name.
pub const WHITE_NAME: &str = "zca 5 x 5 x 3, 1";
/// Filters, each of which gives two channels.
pub(super) const FILTERS: usize = 3;
/// Channels of an image.
pub(super) const COLOURS: usize = 3;
/// Rows and columns of the filter.
const SIDE: usize = 5;
/// Pixels on each side of an image.
const PAD: usize = SIDE / 2;
/// Pixels filtered at a time.
const LANES: usize = 16;
/// Fractional bits of a filtered value.
const FILTERED_BITS: u32 = 14;
/// Greatest tap of 16 bits; what a tap is beyond it is one of its own.
const TAP_MAX: i32 = 32_767;

/// `q[filter][colour]`, row by row.
#[rustfmt::skip]
pub(super) const FILTER: [[[i32; SIDE * SIDE]; COLOURS]; FILTERS] = [
    [
        [
            -463, -658, -921, -648, -462,
            -718, -1626, -2793, -1613, -746,
            -1115, -2851, 38415, -2846, -1117,
            -747, -1617, -2787, -1620, -743,
            -473, -653, -912, -653, -463,
        ],
        [
            322, 279, 121, 281, 318,
            283, -322, -1272, -313, 258,
            39, -1293, -3228, -1289, 38,
            271, -297, -1250, -306, 268,
            320, 295, 141, 294, 329,
        ],
        [
            363, 400, 310, 402, 364,
            407, -21, -829, -15, 392,
            222, -875, -2602, -859, 238,
            390, -16, -818, -4, 402,
            355, 405, 324, 418, 370,
        ],
    ],
    [
        [
            343, 315, 152, 320, 343,
            305, -319, -1328, -316, 275,
            37, -1372, -3426, -1369, 34,
            272, -333, -1347, -347, 266,
            305, 282, 116, 277, 307,
        ],
        [
            -478, -613, -842, -595, -467,
            -637, -1447, -2583, -1431, -657,
            -977, -2618, 41325, -2607, -970,
            -663, -1430, -2566, -1441, -653,
            -511, -617, -845, -618, -487,
        ],
        [
            361, 321, 168, 335, 377,
            305, -310, -1293, -303, 292,
            43, -1344, -3347, -1331, 55,
            300, -291, -1268, -294, 311,
            369, 344, 188, 347, 387,
        ],
    ],
    [
        [
            353, 407, 328, 420, 362,
            409, -5, -802, 0, 402,
            219, -863, -2579, -852, 232,
            392, -15, -821, -12, 394,
            360, 406, 323, 417, 368,
        ],
        [
            322, 292, 150, 308, 334,
            280, -293, -1203, -279, 278,
            26, -1257, -3126, -1247, 39,
            266, -279, -1197, -285, 270,
            330, 310, 170, 315, 343,
        ],
        [
            -573, -738, -971, -727, -568,
            -778, -1601, -2677, -1591, -793,
            -1137, -2743, 38296, -2735, -1137,
            -795, -1585, -2661, -1591, -802,
            -570, -723, -947, -722, -567,
        ],
    ],
];

/// Filters images of one size.
#[derive(Debug, Clone)]
pub(super) struct White {
    /// Height, width.
    size: [usize; 2],
    /// Each value in 0..=255.
    eight: [u8; 256],
    /// The drive code of each value that is put out.
    drives: [u8; 256],
    /// Taps of each filter: offset in the padded planes, factor.
    taps: [Vec<(usize, i16)>; FILTERS],
    /// `t` of each colour, with a border of 0.
    planes: Vec<i16>,
}

impl White {
    pub(super) fn new(size: [usize; 2], eight: [u8; 256], drives: [u8; 256]) -> Self {
        let [height, width] = size;
        let (stride, plane) = (stride(width), stride(width) * (height + 2 * PAD));
        let taps = FILTER.map(|colours| {
            let mut taps = Vec::new();
            for (colour, factors) in colours.iter().enumerate() {
                for (at, &factor) in factors.iter().enumerate() {
                    let offset = colour * plane + (at / SIDE) * stride + at % SIDE;
                    let whole = factor.min(TAP_MAX);
                    for part in [whole, factor - whole] {
                        if part != 0 {
                            taps.push((offset, narrow(part, "less than two greatest taps")));
                        }
                    }
                }
            }
            taps
        });
        // a last block of lanes reads beyond its row
        let planes = vec![0; COLOURS * plane + LANES];
        Self { size, eight, drives, taps, planes }
    }

    /// Appends the codes of an image that lies plane by plane.
    pub(super) fn code(&mut self, values: &[u8], out: &mut Vec<u8>) {
        self.standardise(values);
        let Self { size: [height, width], drives, taps, planes, .. } = self;
        let (height, width) = (*height, *width);
        let start = out.len();
        out.resize(start + height * width * 2 * FILTERS, 0);
        let rows = out[start..].chunks_exact_mut(width * 2 * FILTERS);
        for (y, row) in rows.enumerate() {
            let blocks = row.chunks_mut(LANES * 2 * FILTERS);
            for (block, pixels) in blocks.enumerate() {
                let at = y * stride(width) + block * LANES;
                for (filter, taps) in taps.iter().enumerate() {
                    let sums = filtered(&planes[at..], taps);
                    for (pixel, sum) in pixels.chunks_exact_mut(2 * FILTERS).zip(sums) {
                        let code = |sum: i32| rsh(sum, FILTERED_BITS).clamp(0, 255) as usize;
                        pixel[filter] = drives[code(sum)];
                        pixel[FILTERS + filter] = drives[code(-sum)];
                    }
                }
            }
        }
    }

    /// The image less its mean, in deviations.
    fn standardise(&mut self, values: &[u8]) {
        let Self { size: [height, width], eight, planes, .. } = self;
        let (height, width) = (*height, *width);
        let mut counts = [0u64; 256];
        for &value in values {
            counts[usize::from(eight[usize::from(value)])] += 1;
        }
        let moment = |power: u32| -> i128 {
            let each = counts.iter().zip(0u64..);
            each.map(|(&count, x)| i128::from(count) * i128::from(x.pow(power))).sum()
        };
        let (n, s1, s2) = (values.len() as i128, moment(1), moment(2));
        let short = |number: i128| narrow::<i64>(number, "an image has fewer than 2^26 values");
        let divisor = short((n * s2 - s1 * s1).isqrt() + 8 * n);
        let (n, s1) = (short(n), short(s1));
        let table: [i16; 256] = std::array::from_fn(|value| {
            let x = i64::from(eight[value]);
            let t = (256 * (n * x - s1) + divisor).div_euclid(2 * divisor);
            narrow(t, "a value lies at most 255 / 8 deviations from the mean")
        });
        let stride = stride(width);
        let images = values.chunks_exact(height * width);
        for (plane, image) in planes.chunks_exact_mut(stride * (height + 2 * PAD)).zip(images) {
            let rows = plane.chunks_exact_mut(stride).skip(PAD);
            for (row, image) in rows.zip(image.chunks_exact(width)) {
                for (t, &x) in row[PAD..].iter_mut().zip(image) {
                    *t = table[usize::from(x)];
                }
            }
        }
    }
}

/// Values from a row of padded planes to the next.
const fn stride(width: usize) -> usize {
    width + 2 * PAD
}

/// Sums of products of one filter for some pixels of a row.
fn filtered(planes: &[i16], taps: &[(usize, i16)]) -> [i32; LANES] {
    let mut sums = [0; LANES];
    for &(offset, factor) in taps {
        let from: &[i16; LANES] = planes[offset..].first_chunk().expect("planes end with a block");
        for (sum, &t) in sums.iter_mut().zip(from) {
            *sum += i32::from(t) * i32::from(factor);
        }
    }
    sums
}
