//! One NumPy array: a header in Python's own words, then the elements.
//!
//! ```text
//! \x93NUMPY  major minor  length  {'descr': '<f4', 'fortran_order': False, 'shape': (2, 3), }  elements
//!                         2 bytes (major 1) or 4 bytes, little end first
//! ```
//!
//! This is the one door from floats to codes. With `x` in 0 ..= 1 and the full scale `M`:
//!
//! ```text
//! value = floor( x M + 1/2 )                             halves toward +infinity, in binary64
//! ```
//!
//! Integers (signed or not, 1 to 8 bytes, either end first) pass when they lie in 0 ..= 255, booleans as
//! 0 and 1. Anything else is an error; nothing is clipped.

use super::npy_header::{self, Header, Kind};

/// Greatest number of bytes an array may have: 2^31.
pub const BYTES_MAX: u64 = 1 << 31;

/// What to do with floating point numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Floats {
    /// Refuse them.
    Refuse,
    /// Take them from 0 ..= 1 to 0 ..= the full scale given here.
    Scale(u8),
}

/// Why bytes are not an array of values.
#[derive(Debug, thiserror::Error)]
pub enum NpyError {
    /// Not the format, or a header that cannot be read.
    #[error("is not a .npy array: {0}; save it anew with numpy.save or numpy.savez")]
    Header(&'static str),
    /// A type that is not read.
    #[error(
        "has elements of type `{found}`, allowed are integers, booleans, float32 and float64; convert \
         it with .astype(numpy.uint8)"
    )]
    Type {
        /// NumPy's name of the type.
        found: String,
    },
    /// Floating point where only integers make sense.
    #[error("has floating point elements, but labels are integers; convert it with .astype(int)")]
    Floats,
    /// A shape of nothing or of too much.
    #[error(
        "has the shape {dims:?}, allowed are 1 to 8 dimensions, none 0, and {limit} bytes in all"
    )]
    Size {
        /// Dimensions promised.
        dims: Vec<u64>,
        /// Greatest number of bytes allowed.
        limit: u64,
    },
    /// Fewer or more elements than promised.
    #[error("has {found} bytes of elements, but its header promises {wanted}; save the file anew")]
    Length {
        /// Bytes there.
        found: usize,
        /// Bytes promised.
        wanted: usize,
    },
    /// An integer outside a byte.
    #[error(
        "element {element} is {found}, allowed are 0 to 255; scale the array before it is saved"
    )]
    Integer {
        /// Which element in file order, counted from 0.
        element: usize,
        /// The number.
        found: i128,
    },
    /// A float outside 0 ..= 1, or not a number.
    #[error(
        "element {element} is {found}, allowed are floats 0 to 1; divide the array by its greatest"
    )]
    Float {
        /// Which element in file order, counted from 0.
        element: usize,
        /// The number, printed.
        found: String,
    },
}

/// An array of values.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct NpyArray {
    /// Size along each dimension, slowest first. None is 0.
    pub dims: Vec<usize>,
    /// As many values as the product of `dims`, last dimension fastest.
    pub data: Vec<u8>,
    /// Whether the elements were floats, scaled on their way in.
    pub scaled: bool,
}

/// Reads one array.
///
/// # Errors
/// When the bytes are not such an array, from the first to the last, or an element does not fit.
pub fn read(bytes: &[u8], floats: Floats) -> Result<NpyArray, NpyError> {
    let (header, elements) = npy_header::parse(bytes)?;
    let width = header.width;
    let wanted = header
        .dims
        .iter()
        .try_fold(u64::from(width), |all, &d| all.checked_mul(d))
        .filter(|n| (1..=BYTES_MAX).contains(n) && (1..=8).contains(&header.dims.len()))
        .and_then(|n| usize::try_from(n).ok())
        .ok_or_else(|| NpyError::Size { dims: header.dims.clone(), limit: BYTES_MAX })?;
    if elements.len() != wanted {
        return Err(NpyError::Length { found: elements.len(), wanted });
    }
    let scale = match (header.kind, floats) {
        (Kind::Float, Floats::Refuse) => return Err(NpyError::Floats),
        (_, Floats::Refuse) => 0,
        (_, Floats::Scale(scale)) => scale,
    };
    let data = elements
        .chunks_exact(usize::from(width))
        .enumerate()
        .map(|(element, bytes)| value(bytes, &header, scale, element))
        .collect::<Result<Vec<u8>, _>>()?;
    let dims: Vec<usize> =
        header.dims.iter().map(|&d| usize::try_from(d).expect("at most BYTES_MAX")).collect();
    let data = if header.fortran { last_fastest(&data, &dims) } else { data };
    Ok(NpyArray { dims, data, scaled: header.kind == Kind::Float })
}

/// One element as a value.
fn value(bytes: &[u8], header: &Header, scale: u8, element: usize) -> Result<u8, NpyError> {
    let raw = bytes.iter().enumerate().fold(0u64, |raw, (at, &byte)| {
        let shift = if header.big_end { bytes.len() - 1 - at } else { at };
        raw | u64::from(byte) << (8 * shift)
    });
    let unused = 64 - 8 * u32::from(header.width);
    let number = match header.kind {
        Kind::Float => return unit(bytes, header, raw, scale, element),
        Kind::Signed => i128::from((raw << unused).cast_signed() >> unused),
        Kind::Unsigned => i128::from(raw),
    };
    u8::try_from(number).map_err(|_| NpyError::Integer { element, found: number })
}

const TWO_TO_52: f64 = 4_503_599_627_370_496.0;

/// A float in 0 ..= 1 as a value: `floor(x scale + 1/2)`.
fn unit(
    bytes: &[u8],
    header: &Header,
    raw: u64,
    scale: u8,
    element: usize,
) -> Result<u8, NpyError> {
    let x = match u32::try_from(raw) {
        Ok(raw) if bytes.len() == 4 => f64::from(f32::from_bits(raw)),
        _ => f64::from_bits(raw),
    };
    debug_assert!(header.kind == Kind::Float && matches!(header.width, 4 | 8));
    // A comparison with NaN is false, so NaN is refused here too.
    if !(0.0..=1.0).contains(&x) {
        return Err(NpyError::Float { element, found: x.to_string() });
    }
    let whole = (x * f64::from(scale) + 0.5).floor();
    // A whole number below 2^52 stands in the last bits of its sum with 2^52.
    let bits = (whole + TWO_TO_52).to_bits();
    Ok(bits.to_le_bytes()[0])
}

/// Elements stored first dimension fastest, put last dimension fastest.
fn last_fastest(data: &[u8], dims: &[usize]) -> Vec<u8> {
    let mut place = vec![0; dims.len()];
    let mut strides = Vec::with_capacity(dims.len());
    let mut stride = 1;
    for d in dims {
        strides.push(stride);
        stride *= d;
    }
    let mut from = 0;
    let mut sorted = Vec::with_capacity(data.len());
    for _ in 0..data.len() {
        sorted.push(data[from]);
        for axis in (0..dims.len()).rev() {
            place[axis] += 1;
            from += strides[axis];
            if place[axis] < dims[axis] {
                break;
            }
            from -= strides[axis] * dims[axis];
            place[axis] = 0;
        }
    }
    sorted
}

#[cfg(test)]
pub(crate) mod tests {
    use proptest::prelude::*;

    use super::*;

    /// A version 1 file.
    pub(crate) fn file(descr: &str, fortran: &str, shape: &str, elements: &[u8]) -> Vec<u8> {
        let dict =
            format!("{{'descr': {descr}, 'fortran_order': {fortran}, 'shape': {shape}, }}\n");
        let length = u16::try_from(dict.len()).unwrap().to_le_bytes();
        [b"\x93NUMPY\x01\x00", &length[..], dict.as_bytes(), elements].concat()
    }

    fn values(descr: &str, elements: &[u8], count: usize) -> Result<Vec<u8>, String> {
        let bytes = file(descr, "False", &format!("({count},)"), elements);
        read(&bytes, Floats::Scale(255)).map(|a| a.data).map_err(|e| e.to_string())
    }

    #[test]
    fn integers_of_every_width_and_end_are_read() {
        assert_eq!(values("'|u1'", &[0, 255], 2), Ok(vec![0, 255]));
        assert_eq!(values("'|b1'", &[0, 1], 2), Ok(vec![0, 1]));
        assert_eq!(values("'<i2'", &[3, 0, 255, 0], 2), Ok(vec![3, 255]));
        assert_eq!(values("'>i2'", &[0, 3, 0, 255], 2), Ok(vec![3, 255]));
        assert_eq!(values("'<i8'", &7i64.to_le_bytes(), 1), Ok(vec![7]));
        assert_eq!(values("'>u4'", &7u32.to_be_bytes(), 1), Ok(vec![7]));
        let refused = [
            values("'|i1'", &[0, 0xff], 2),
            values("'<i4'", &(-1i32).to_le_bytes(), 1),
            values("'<u2'", &256u16.to_le_bytes(), 1),
            values("'<u8'", &u64::MAX.to_le_bytes(), 1),
            values("'<i8'", &i64::MIN.to_le_bytes(), 1),
        ];
        let found = ["element 1 is -1,", "0 is -1,", "0 is 256,", "0 is 18446744073709551615,"];
        let found = found.iter().chain(&["0 is -9223372036854775808,"]);
        for (refused, found) in refused.into_iter().zip(found) {
            assert!(refused.as_ref().unwrap_err().contains(found), "{refused:?}");
        }
    }

    #[test]
    fn floats_round_half_up_and_only_the_unit_interval_passes() {
        let half = |n: f64| (n / 510.0).to_le_bytes();
        let x = [half(0.0), half(255.0), half(509.0), half(510.0)].concat();
        assert_eq!(values("'<f8'", &x, 4), Ok(vec![0, 128, 255, 255]));
        assert_eq!(values("'>f4'", &1.0f32.to_be_bytes(), 1), Ok(vec![255]));
        assert_eq!(values("'<f4'", &(-0.0f32).to_le_bytes(), 1), Ok(vec![0]));
        let bad = [f32::NAN, f32::INFINITY, -1e-9, 1.0 + f32::EPSILON, f32::MIN];
        for x in bad {
            assert!(values("'<f4'", &x.to_le_bytes(), 1).unwrap_err().contains("element 0 is"));
        }
        let labels = file("'<f4'", "False", "(1,)", &[0; 4]);
        assert!(matches!(read(&labels, Floats::Refuse), Err(NpyError::Floats)));
    }

    #[test]
    fn every_code_comes_back_from_its_own_float() {
        for scale in [1u8, 16, 255] {
            for code in 0..=scale {
                let x = f64::from(code) / f64::from(scale);
                let bytes = file("'<f8'", "False", "(1,)", &x.to_le_bytes());
                assert_eq!(read(&bytes, Floats::Scale(scale)).unwrap().data, [code]);
            }
        }
    }

    #[test]
    fn fortran_order_is_turned() {
        let c = read(&file("'|u1'", "False", "(2, 3)", &[1, 2, 3, 4, 5, 6]), Floats::Refuse);
        let f = read(&file("'|u1'", "True", "(2, 3)", &[1, 4, 2, 5, 3, 6]), Floats::Refuse);
        assert_eq!(c.unwrap(), f.unwrap());
    }

    #[test]
    fn lengths_and_sizes_are_checked_before_anything_is_kept() {
        let lie = |shape: &str| read(&file("'<f8'", "False", shape, &[0; 8]), Floats::Refuse);
        assert!(matches!(lie("(2,)"), Err(NpyError::Length { found: 8, wanted: 16 })));
        assert!(matches!(lie("(0,)"), Err(NpyError::Size { .. })));
        assert!(matches!(lie("()"), Err(NpyError::Size { .. })));
        assert!(matches!(lie("(4294967296, 4294967296)"), Err(NpyError::Size { .. })));
        assert!(matches!(lie("(1,1,1,1,1,1,1,1,1)"), Err(NpyError::Size { .. })));
    }

    proptest! {
        #[test]
        fn any_bytes_are_an_array_or_an_error(bytes: Vec<u8>, keep in 0usize..90) {
            let mut bytes = bytes;
            bytes.resize(bytes.len().max(keep), 0);
            for (to, from) in bytes.iter_mut().zip(file("'<f4'", "True", "(1, 3)", &[])).take(keep) {
                *to = from;
            }
            if let Ok(array) = read(&bytes, Floats::Scale(16)) {
                prop_assert_eq!(array.dims.iter().product::<usize>(), array.data.len());
                prop_assert!(array.data.iter().all(|&v| v <= 16));
            }
        }
    }
}
