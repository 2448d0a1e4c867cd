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
    let point = |b: &[u8]| match *b {
        [a, b, c, d] if big => u32::from_be_bytes([a, b, c, d]),
        [a, b, c, d] => u32::from_le_bytes([a, b, c, d]),
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
#[path = "npy_tests.rs"]
pub(crate) mod tests;
