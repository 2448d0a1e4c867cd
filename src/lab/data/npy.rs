//! One NumPy array: a header in Python's own words, then the elements. `npyz` reads both.
//!
//! ```text
//! \x93NUMPY  major minor  length  {'descr': '<f4', 'fortran_order': False, 'shape': (2, 3), }  elements
//!                         2 bytes (major 1) or 4 bytes, little end first
//! ```
//!
//! An array is either values (integers, booleans, floats: what they become is said in [`super::numbers`]) or labels
//! (the same without fractions, and strings). Anything else is an error. `npyz` takes a file at its word, so `sane` looks
//! at a header before it does.

use npyz::{DType, Deserialize, Endianness, NpyFile, NpyHeader, Order, TypeChar};

use super::labels::{Label, Labels};
use super::numbers::{self, NumberKind, NumberRange, NumbersError};

/// Longest header read, as in NumPy itself.
const HEADER_MAX: usize = 10_000;
/// Digits of a header at most. A product of numbers with `d` digits in all is below 10^d, so none overflows; an array
/// of [`BYTES_MAX`] has no more: 10 of its size, 1 more for each of 7 dimensions of 1, 1 of its type.
const DIGITS_MAX: usize = 18;
/// Greatest number of bytes an array may have: 2^31.
pub const BYTES_MAX: u64 = 1 << 31;

/// Why bytes are not an array of values.
#[derive(Debug, thiserror::Error)]
pub enum NpyError {
    /// Not the format, or a header that cannot be read.
    #[error("is not a .npy array: {0}; save it anew with numpy.save or numpy.savez")]
    Header(String),
    /// A type that is not read.
    #[error(
        "has elements of type `{found}`, allowed are integers, booleans, float32 and float64, and strings for \
         labels; convert it with .astype(numpy.uint8), or labels with .astype(str)"
    )]
    Type {
        /// NumPy's name of the type.
        found: String,
    },
    /// A label with a fraction, or none at all.
    #[error(
        "has the label {found} (element {element}, from 0): a class is a whole number or a string; if this is a \
         measurement, name another array for the labels"
    )]
    Fraction {
        /// Which element in file order, counted from 0.
        element: usize,
        /// The number, printed.
        found: String,
    },
    /// A string that is none.
    #[error(
        "has an empty or broken string as label (element {element}, from 0); give every example a label"
    )]
    Text {
        /// Which element in file order, counted from 0.
        element: usize,
    },
    /// Values that are none.
    #[error("has values that {0}")]
    Numbers(#[from] NumbersError),
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
}

/// An array of values.
#[derive(Debug, Clone, PartialEq)]
pub struct NpyArray {
    /// Size along each dimension, slowest first. None is 0.
    pub dims: Vec<usize>,
    /// As many values as the product of `dims`, last dimension fastest.
    pub data: Vec<u8>,
    /// What the numbers were.
    pub range: NumberRange,
    /// Their kind.
    pub kind: NumberKind,
}

/// An array as its header says, elements unread.
struct Opened<'a> {
    header: NpyHeader,
    dims: Vec<usize>,
    kind: TypeChar,
    big: bool,
    /// Bytes of an element.
    width: usize,
    elements: &'a [u8],
}

fn open(bytes: &[u8]) -> Result<Opened<'_>, NpyError> {
    use TypeChar::{Bool, ByteStr, Float, Int, Uint, UnicodeStr};
    sane(bytes)?;
    let mut elements = bytes;
    let header = NpyHeader::from_reader(&mut elements).map_err(|error| strange(&error))?;
    let (kind, size, big) = match header.dtype() {
        DType::Plain(one) => match (one.type_char(), one.size_field()) {
            kind @ ((Bool, 1) | (Int | Uint, 1 | 2 | 4 | 8) | (Float, 4 | 8)) => {
                (kind.0, kind.1, one.endianness() == Endianness::Big)
            }
            (ByteStr, size @ 1..) => (ByteStr, size, false),
            (UnicodeStr, size @ 1..) => {
                (UnicodeStr, size.saturating_mul(4), one.endianness() == Endianness::Big)
            }
            _ => return Err(NpyError::Type { found: one.to_string() }),
        },
        _ => return Err(NpyError::Type { found: "structured or datetime".to_owned() }),
    };
    let dims = header.shape().to_vec();
    let wanted = dims
        .iter()
        .try_fold(size, |all, &d| all.checked_mul(d))
        .filter(|n| (1..=BYTES_MAX).contains(n) && (1..=8).contains(&dims.len()))
        .and_then(|n| usize::try_from(n).ok())
        .ok_or_else(|| NpyError::Size { shape: format!("{dims:?}"), limit: BYTES_MAX })?;
    if elements.len() != wanted {
        return Err(NpyError::Length { found: elements.len(), wanted });
    }
    let small = |d: u64| usize::try_from(d).expect("at most BYTES_MAX");
    let (dims, width) = (dims.into_iter().map(small).collect(), small(size));
    Ok(Opened { header, dims, kind, big, width, elements })
}

impl Opened<'_> {
    /// Every number with its place, in file order.
    fn each(&self, to: &mut dyn FnMut(usize, Scalar)) -> Result<(), NpyError> {
        use TypeChar::{Bool, Float, Int};
        let file = NpyFile::with_header(self.header.clone(), self.elements);
        match (self.kind, self.width) {
            (Bool, _) => take(file, to, |bit: bool| Scalar::Whole(bit.into())),
            (Float, 4) => take(file, to, |x: f32| Scalar::Float(x.into())),
            (Float, _) => take(file, to, |x: f64| Scalar::Float(x)),
            (Int, 1) => take(file, to, |x: i8| Scalar::Whole(x.into())),
            (Int, 2) => take(file, to, |x: i16| Scalar::Whole(x.into())),
            (Int, 4) => take(file, to, |x: i32| Scalar::Whole(x.into())),
            (Int, _) => take(file, to, |x: i64| Scalar::Whole(x.into())),
            (_, 1) => take(file, to, |x: u8| Scalar::Whole(x.into())),
            (_, 2) => take(file, to, |x: u16| Scalar::Whole(x.into())),
            (_, 4) => take(file, to, |x: u32| Scalar::Whole(x.into())),
            (..) => take(file, to, |x: u64| Scalar::Whole(x.into())),
        }
    }

    /// Puts elements in file order last dimension fastest.
    fn sorted<T: Copy>(&self, data: Vec<T>) -> Vec<T> {
        match self.header.order() {
            Order::Fortran => last_fastest(&data, &self.dims),
            Order::C => data,
        }
    }

    fn text(&self) -> bool {
        matches!(self.kind, TypeChar::ByteStr | TypeChar::UnicodeStr)
    }
}

/// One element.
#[derive(Clone, Copy)]
enum Scalar {
    Whole(i128),
    Float(f64),
}

impl Scalar {
    #[expect(
        clippy::cast_precision_loss,
        reason = "only the size of what lies beyond 2^53 is told"
    )]
    fn float(self) -> f64 {
        match self {
            Self::Whole(x) => x as f64,
            Self::Float(x) => x,
        }
    }
}

/// Reads an array of values; floats 0 to 1 reach `full_scale`.
///
/// # Errors
/// When the bytes are not such an array, from the first to the last, or its numbers are no values.
pub fn values(bytes: &[u8], full_scale: u8) -> Result<NpyArray, NpyError> {
    let array = open(bytes)?;
    if array.text() {
        let found = "string, where values are needed".to_owned();
        return Err(NpyError::Type { found });
    }
    let mut range = NumberRange::new(array.kind == TypeChar::Float);
    array.each(&mut |at, x| range.see(at, x.float()))?;
    let kind = range.kind()?;
    let mut data = Vec::with_capacity(array.elements.len() / array.width);
    array.each(&mut |_, x| data.push(numbers::value(x.float(), kind, full_scale)))?;
    let data = array.sorted(data);
    Ok(NpyArray { dims: array.dims, data, range, kind })
}

/// Reads an array of labels and its dimensions.
///
/// # Errors
/// When the bytes are not such an array, or an element is no label.
pub fn labels(bytes: &[u8]) -> Result<(Vec<usize>, Labels), NpyError> {
    let array = open(bytes)?;
    let mut wrong = None;
    let mut all: Labels = if array.text() {
        let elements = array.elements.chunks_exact(array.width).enumerate();
        let label = |(element, bytes): (usize, &[u8])| {
            let text = match array.kind {
                TypeChar::ByteStr => std::str::from_utf8(bytes).ok().map(ToOwned::to_owned),
                _ => unicode(bytes, array.big),
            };
            let text = text.map(|text| text.trim_end_matches('\0').to_owned());
            text.filter(|text| !text.is_empty()).map(Label::Text).ok_or(NpyError::Text { element })
        };
        elements.map(label).collect::<Result<_, _>>()?
    } else {
        let mut labels = Vec::with_capacity(array.elements.len() / array.width);
        array.each(&mut |element, x| {
            let label = match x {
                Scalar::Whole(x) => i64::try_from(x).ok().map(Label::Number),
                Scalar::Float(x) => Label::of_float(x),
            };
            match label {
                Some(label) => labels.push(label),
                None => {
                    let found = x.float().to_string();
                    wrong.get_or_insert(NpyError::Fraction { element, found });
                }
            }
        })?;
        labels.into_iter().collect()
    };
    if let Some(wrong) = wrong {
        return Err(wrong);
    }
    all.of = array.sorted(all.of);
    Ok((array.dims, all))
}

/// Code points of four bytes each.
fn unicode(bytes: &[u8], big: bool) -> Option<String> {
    let point = |b: &[u8]| match b {
        &[a, b, c, d] if big => u32::from_be_bytes([a, b, c, d]),
        &[a, b, c, d] => u32::from_le_bytes([a, b, c, d]),
        _ => u32::MAX,
    };
    bytes.chunks(4).map(|b| char::from_u32(point(b))).collect()
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

/// All elements, as scalars.
fn take<T: Deserialize>(
    file: NpyFile<&[u8]>,
    to: &mut dyn FnMut(usize, Scalar),
    scalar: impl Fn(T) -> Scalar,
) -> Result<(), NpyError> {
    let elements = file.data::<T>().map_err(|error| strange(&error))?;
    for (element, one) in elements.enumerate() {
        to(element, scalar(one.map_err(|source| NpyError::Element { element, source })?));
    }
    Ok(())
}

/// Elements stored first dimension fastest, put last dimension fastest.
fn last_fastest<T: Copy>(data: &[T], dims: &[usize]) -> Vec<T> {
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
        super::values(&bytes, 255).map(|a| a.data).map_err(|e| e.to_string())
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
        let found =
            ["from -1 to 0,", "from -1 to -1,", "up to 256,", "up to 18446744073709552000,"];
        let found = found.iter().chain(&["from -9223372036854776000 to"]);
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
            let half = 0.5f32.to_le_bytes();
            let both = [x.to_le_bytes(), half].concat();
            let error = values("'<f4'", &both, 2).unwrap_err();
            assert!(error.starts_with("has values that "), "{error}");
        }
        let whole = [0.0f32, 16.0].map(f32::to_le_bytes).concat();
        assert_eq!(values("'<f4'", &whole, 2), Ok(vec![0, 16]));
    }

    #[test]
    fn labels_are_whole_numbers_of_any_type_or_strings() {
        let labels = |descr: &str, shape: &str, fortran: &str, elements: &[u8]| {
            super::labels(&file(descr, fortran, shape, elements))
                .map(|(_, l)| {
                    let name = |&at: &u32| l.distinct[at as usize].to_string();
                    l.of.iter().map(name).collect::<Vec<_>>()
                })
                .map_err(|e| e.to_string())
        };
        let signed = [-1i64, 1].map(i64::to_le_bytes).concat();
        assert_eq!(labels("'<i8'", "(2,)", "False", &signed).unwrap(), ["-1", "1"]);
        let floats = [3.0f32, 0.0].map(f32::to_be_bytes).concat();
        assert_eq!(labels("'>f4'", "(2, 1)", "True", &floats).unwrap(), ["3", "0"]);
        assert_eq!(labels("'|b1'", "(2,)", "False", &[1, 0]).unwrap(), ["1", "0"]);
        assert_eq!(labels("'|S3'", "(2,)", "False", b"dogca\0").unwrap(), ["dog", "ca"]);
        let wide = ['é', 'x', 'b', '\0'].map(|c| u32::from(c).to_le_bytes()).concat();
        assert_eq!(labels("'<U2'", "(2,)", "False", &wide).unwrap(), ["éx", "b"]);
        for (descr, elements, wanted) in [
            ("'<f4'", 0.5f32.to_le_bytes(), "has the label 0.5 (element 0"),
            ("'<f4'", f32::NAN.to_le_bytes(), "has the label NaN"),
            ("'<U1'", [0; 4], "an empty or broken string"),
            ("'<U1'", [0xff; 4], "an empty or broken string"),
            ("'|S4'", [0xff; 4], "an empty or broken string"),
        ] {
            let error = labels(descr, "(1,)", "False", &elements).unwrap_err();
            assert!(error.contains(wanted), "{error}");
        }
    }

    #[test]
    fn fortran_order_is_turned() {
        let c = super::values(&file("'|u1'", "False", "(2, 3)", &[1, 2, 3, 4, 5, 6]), 1);
        let f = super::values(&file("'|u1'", "True", "(2, 3)", &[1, 4, 2, 5, 3, 6]), 1);
        assert_eq!(c.unwrap(), f.unwrap());
    }

    #[test]
    fn lengths_and_sizes_are_checked_before_anything_is_kept() {
        let lie = |shape: &str| super::values(&file("'<f8'", "False", shape, &[0; 8]), 1);
        assert!(matches!(lie("(2,)"), Err(NpyError::Length { found: 8, wanted: 16 })));
        assert!(matches!(lie("(0,)"), Err(NpyError::Size { .. })));
        assert!(matches!(lie("()"), Err(NpyError::Size { .. })));
        assert!(matches!(lie("(4294967296, 4294967296)"), Err(NpyError::Size { .. })));
        assert!(matches!(lie("(1,1,1,1,1,1,1,1,1)"), Err(NpyError::Size { .. })));
    }

    #[test]
    fn headers_are_read_in_any_order_and_spacing_and_every_version() {
        let wanted = (vec![1, 2], vec![0, 255], NumberKind::Fraction);
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
                let array = super::values(&bytes, 255).unwrap();
                assert_eq!((array.dims, array.data, array.kind), wanted);
                for cut in 0..bytes.len() {
                    assert!(super::values(&bytes[..cut], 255).is_err(), "{cut}");
                }
            }
        }
        assert!(super::values(b"\x93NUMPY\x04\x00\x00\x00\x00\x00", 1).is_err());
    }

    fn refused(text: &str) -> NpyError {
        let length = u16::try_from(text.len()).unwrap().to_le_bytes();
        let bytes = [b"\x93NUMPY\x01\x00", &length[..], text.as_bytes(), &[0; 4]].concat();
        super::values(&bytes, 1).unwrap_err()
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
        for descr in ["'<f2'", "'|O'", "'<U1'", "'<m8[ns]'", "[('a', '<i4')]"] {
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
        assert!(matches!(super::values(&long, 1), Err(NpyError::Header(_))));
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
            if let Ok((dims, labels)) = super::labels(&bytes) {
                prop_assert_eq!(dims.iter().product::<usize>(), labels.of.len());
            }
            if let Ok(array) = super::values(&bytes, 16) {
                prop_assert_eq!(array.dims.iter().product::<usize>(), array.data.len());
                prop_assert!(array.kind == NumberKind::Whole || array.data.iter().all(|&v| v <= 16));
            }
        }
    }
}
