//! One NumPy array: a header in Python's own words, then the elements. `npyz` reads both.
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
//! 0 and 1. Anything else is an error; nothing is clipped. `npyz` takes a file at its word, so `sane` looks at a
//! header before it does.

use npyz::{DType, Deserialize, NpyFile, NpyHeader, Order, TypeChar};

/// Longest header read, as in NumPy itself.
const HEADER_MAX: usize = 10_000;
/// Digits of a header at most. A product of numbers with `d` digits in all is below 10^d, so none overflows; an array
/// of [`BYTES_MAX`] has no more: 10 of its size, 1 more for each of 7 dimensions of 1, 1 of its type.
const DIGITS_MAX: usize = 18;
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
    Header(String),
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
        "has the shape {shape}, allowed are 1 to 8 dimensions, none 0, and {limit} bytes in all; save it \
         in smaller pieces"
    )]
    Size {
        /// Dimensions promised.
        shape: String,
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
    /// A boolean that is neither.
    #[error(
        "element {element} cannot be read: {source}; convert the array with .astype(numpy.uint8)"
    )]
    Element {
        /// Which element in file order, counted from 0.
        element: usize,
        /// What is wrong with it.
        source: std::io::Error,
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
    use TypeChar::{Bool, Float, Int, Uint};
    sane(bytes)?;
    let mut elements = bytes;
    let header = NpyHeader::from_reader(&mut elements).map_err(|error| strange(&error))?;
    let (kind, width) = match header.dtype() {
        DType::Plain(one) => match (one.type_char(), one.size_field()) {
            kind @ ((Bool, 1) | (Int | Uint, 1 | 2 | 4 | 8) | (Float, 4 | 8)) => kind,
            _ => return Err(NpyError::Type { found: one.to_string() }),
        },
        _ => return Err(NpyError::Type { found: "structured or datetime".to_owned() }),
    };
    let dims = header.shape().to_vec();
    let wanted = dims
        .iter()
        .try_fold(width, |all, &d| all.checked_mul(d))
        .filter(|n| (1..=BYTES_MAX).contains(n) && (1..=8).contains(&dims.len()))
        .and_then(|n| usize::try_from(n).ok())
        .ok_or_else(|| NpyError::Size { shape: format!("{dims:?}"), limit: BYTES_MAX })?;
    if elements.len() != wanted {
        return Err(NpyError::Length { found: elements.len(), wanted });
    }
    let scale = match (kind, floats) {
        (Float, Floats::Refuse) => return Err(NpyError::Floats),
        (_, Floats::Refuse) => 0,
        (_, Floats::Scale(scale)) => scale,
    };
    let fortran = header.order() == Order::Fortran;
    let file = NpyFile::with_header(header, elements);
    let data = match (kind, width) {
        (Bool, _) => take(file, |_, bit: bool| Ok(bit.into())),
        (Float, 4) => take(file, |at, x: f32| unit(at, x.into(), scale)),
        (Float, _) => take(file, |at, x: f64| unit(at, x, scale)),
        (Int, 1) => take(file, whole::<i8>),
        (Int, 2) => take(file, whole::<i16>),
        (Int, 4) => take(file, whole::<i32>),
        (Int, _) => take(file, whole::<i64>),
        (_, 1) => take(file, whole::<u8>),
        (_, 2) => take(file, whole::<u16>),
        (_, 4) => take(file, whole::<u32>),
        (..) => take(file, whole::<u64>),
    }?;
    let dims: Vec<usize> =
        dims.into_iter().map(|d| usize::try_from(d).expect("at most BYTES_MAX")).collect();
    let data = if fortran { last_fastest(&data, &dims) } else { data };
    Ok(NpyArray { dims, data, scaled: kind == Float })
}

fn strange(why: &dyn std::fmt::Display) -> NpyError {
    NpyError::Header(why.to_string())
}

/// Refuses a header that `npyz` would follow too far: it reserves what a length asks for, tries nested brackets in
/// exponentially many ways, multiplies dimensions unchecked, and takes the last of two equal keys.
fn sane(bytes: &[u8]) -> Result<(), NpyError> {
    let rest = bytes.strip_prefix(b"\x93NUMPY").ok_or_else(|| strange(&"no NUMPY magic"))?;
    let (length, rest) = match *rest {
        [1, _, a, b, ref rest @ ..] => (u32::from(u16::from_le_bytes([a, b])), rest),
        [_, _, a, b, c, d, ref rest @ ..] => (u32::from_le_bytes([a, b, c, d]), rest),
        _ => return Err(strange(&"the header is cut short")),
    };
    let length = usize::try_from(length).ok().filter(|&length| length <= HEADER_MAX);
    let length = length.ok_or_else(|| strange(&"the header is longer than NumPy's longest"))?;
    let text = rest.get(..length).ok_or_else(|| strange(&"the header is cut short"))?;
    let text = std::str::from_utf8(text).map_err(|error| strange(&error))?;
    if text.contains('[') {
        return Err(NpyError::Type { found: "structured or datetime".to_owned() });
    }
    let count = |fits: fn(char) -> bool| text.chars().filter(|&c| fits(c)).count();
    // a dictionary of three entries that holds a tuple, all numbers in decimals
    if [count(|c| "{(".contains(c)), count(|c| c == ':')] != [2, 3] || text.contains(['x', 'X']) {
        return Err(strange(&"the header is no dictionary that numpy.save writes"));
    }
    if count(|c| c.is_ascii_digit()) > DIGITS_MAX {
        let shape = text.split(['(', ')']).nth(1).unwrap_or_default();
        return Err(NpyError::Size { shape: format!("[{shape}]"), limit: BYTES_MAX });
    }
    Ok(())
}

/// All elements as values.
fn take<T: Deserialize>(
    file: NpyFile<&[u8]>,
    value: impl Fn(usize, T) -> Result<u8, NpyError>,
) -> Result<Vec<u8>, NpyError> {
    let elements = file.data::<T>().map_err(|error| strange(&error))?;
    let value = |(element, one): (usize, std::io::Result<T>)| {
        value(element, one.map_err(|source| NpyError::Element { element, source })?)
    };
    elements.enumerate().map(value).collect()
}

/// An integer as a value.
fn whole<T: Into<i128>>(element: usize, number: T) -> Result<u8, NpyError> {
    let found = number.into();
    u8::try_from(found).map_err(|_| NpyError::Integer { element, found })
}

const TWO_TO_52: f64 = 4_503_599_627_370_496.0;

/// A float in 0 ..= 1 as a value: `floor(x scale + 1/2)`.
fn unit(element: usize, x: f64, scale: u8) -> Result<u8, NpyError> {
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

    #[test]
    fn headers_are_read_in_any_order_and_spacing_and_every_version() {
        let wanted = NpyArray { dims: vec![1, 2], data: vec![0, 255], scaled: true };
        let elements = [0.0f32.to_le_bytes(), 1.0f32.to_le_bytes()].concat();
        let texts = [
            "{'descr': '<f4', 'fortran_order': False, 'shape': (1, 2), }      \n",
            "{\"shape\":(1,2,),\"descr\":\"<f4\",\"fortran_order\":False}",
        ];
        for text in texts {
            let length = u8::try_from(text.len()).unwrap();
            for version in 1..=3 {
                let head = [b"\x93NUMPY", &[version, 0, length][..], &[0; 3]].concat();
                let head = &head[..if version == 1 { 10 } else { 12 }];
                let bytes = [head, text.as_bytes(), &elements].concat();
                assert_eq!(read(&bytes, Floats::Scale(255)).unwrap(), wanted);
                for cut in 0..bytes.len() {
                    assert!(read(&bytes[..cut], Floats::Scale(255)).is_err(), "{cut}");
                }
            }
        }
        assert!(read(b"\x93NUMPY\x04\x00\x00\x00\x00\x00", Floats::Refuse).is_err());
    }

    fn refused(text: &str) -> NpyError {
        let length = u16::try_from(text.len()).unwrap().to_le_bytes();
        let bytes = [b"\x93NUMPY\x01\x00", &length[..], text.as_bytes(), &[0; 4]].concat();
        read(&bytes, Floats::Scale(1)).unwrap_err()
    }

    #[test]
    fn strange_headers_are_errors() {
        let strange = [
            "",
            "{",
            "{}",
            "{'descr': '<f4', 'fortran_order': False, 'shape': (1,)",
            "{'descr': '<f4', 'fortran_order': False, 'shape': (1,)} x",
            "{'descr': '<f4' 'fortran_order': False, 'shape': (1,)}",
            "{'descr': '<f4', 'descr': '<f4', 'fortran_order': False, 'shape': (1,)}",
            "{'descr': '<f4', 'fortran_order': 0, 'shape': (1,)}",
            "{'descr': '<f4', 'fortran_order': False, 'shape': (-1,)}",
            "{'descr': '<f4', 'fortran_order': False, 'shape': (0x7fffffffffffffff, 0x7f)}",
            "{'descr': '<f4', 'fortran_order': False, 'shape': (,)}",
            "{'descr': '<f4', 'fortran_order': False, 'shape': (1,), 'more': 1}",
            "{'descr': '|u2', 'fortran_order': False, 'shape': (1,)}",
            "{'descr': '', 'fortran_order': False, 'shape': (1,)}",
            "{'descr': 'é', 'fortran_order': False, 'shape': (1,)}",
        ];
        for text in strange {
            assert!(matches!(refused(text), NpyError::Header(_)), "{text}: {}", refused(text));
        }
        for descr in ["'<f2'", "'|O'", "'<U3'", "'<m8[ns]'", "[('a', '<i4')]"] {
            let text = format!("{{'descr': {descr}, 'fortran_order': False, 'shape': (1,)}}");
            assert!(matches!(refused(&text), NpyError::Type { .. }), "{text}: {}", refused(&text));
        }
    }

    #[test]
    fn a_header_that_asks_for_the_world_gets_an_error_at_once() {
        let shapes =
            ["(1000000000000000000,)", "(99999999999999999999,)", "(9999999999, 9999999999)"];
        for shape in shapes {
            let text = format!("{{'descr': '<f4', 'fortran_order': False, 'shape': {shape}}}");
            let error = refused(&text);
            assert!(matches!(error, NpyError::Size { .. }), "{error}");
            assert!(error.to_string().contains(shape.trim_matches(['(', ')'])), "{error}");
        }
        for nest in ["[", "(", "{"] {
            let text = format!("{{'descr': {}", nest.repeat(5000));
            assert!(!refused(&text).to_string().is_empty(), "{nest}");
        }
        let long = [&b"\x93NUMPY\x02\x00\xff\xff\xff\xff"[..], &[b' '; 64]].concat();
        assert!(matches!(read(&long, Floats::Refuse), Err(NpyError::Header(_))));
    }

    #[test]
    fn a_boolean_is_0_or_1() {
        let error = values("'|b1'", &[1, 2], 2).unwrap_err();
        assert!(
            error.starts_with("element 1 cannot be read: invalid value for bool: 2;"),
            "{error}"
        );
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
