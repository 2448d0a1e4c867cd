//! IDX, the format of MNIST: a magic number, the dimensions, then plain bytes.
//!
//! ```text
//! 0  0  type  n   dimension_1 .. dimension_n   values
//! 1  1   1    1   4 bytes each, big end first  product of the dimensions, last one runs fastest
//! ```
//!
//! Only unsigned bytes (type 8) are read. A file may be gzip. Nothing is allocated on the word of the
//! header alone.

use std::io::{self, Read};

use super::inflate::{content, read_up_to};

/// Greatest number of values a file may hold: 2^31.
pub const VALUES_MAX: u64 = 1 << 31;
/// Greatest number of dimensions.
pub const DIMENSIONS_MAX: u8 = 4;

/// Why bytes are not an IDX file.
#[derive(Debug, thiserror::Error)]
pub enum IdxError {
    /// The stream itself is broken, such as a cut or corrupt gzip file.
    #[error("{0} while reading; the file is cut short or corrupt, so get it again")]
    Stream(#[from] io::Error),
    /// The first bytes are not an IDX magic number.
    #[error(
        "starts with the bytes {found:02x?}, but an IDX file starts with 00 00; check that the path \
         names an IDX file"
    )]
    Magic {
        /// First two bytes.
        found: [u8; 2],
    },
    /// Values that are not unsigned bytes.
    #[error(
        "holds values of type {found:#04x}, allowed is 0x08 (unsigned byte); save the array as uint8"
    )]
    Type {
        /// Type code found.
        found: u8,
    },
    /// No dimensions, or too many.
    #[error("has {found} dimensions, allowed are 1 to {DIMENSIONS_MAX}; reshape the array")]
    Dimensions {
        /// Dimensions found.
        found: u8,
    },
    /// A header that promises nothing or too much.
    #[error(
        "promises {dims:?} values, allowed are 1 to {limit} in all; the header is damaged or the set \
         needs to be cut into smaller files"
    )]
    Size {
        /// Dimensions promised.
        dims: Vec<u32>,
        /// Greatest number of values allowed.
        limit: u64,
    },
    /// Fewer values than the header promises.
    #[error("ends after {found} of {wanted} {what}; the file is cut short, so get it again")]
    Truncated {
        /// What was being read.
        what: &'static str,
        /// Bytes there.
        found: usize,
        /// Bytes promised.
        wanted: u64,
    },
    /// More values than the header promises.
    #[error(
        "goes on after the {wanted} values its header promises; the header or the file is wrong"
    )]
    Trailing {
        /// Values promised.
        wanted: u64,
    },
}

/// An array of bytes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct IdxArray {
    /// Size along each dimension, slowest first. None is 0.
    pub dims: Vec<usize>,
    /// As many values as the product of `dims`.
    pub data: Vec<u8>,
}

/// Reads an IDX file of at most [`VALUES_MAX`] values, plain or gzip.
///
/// # Errors
/// When the bytes are not such a file, from the first to the last.
pub fn read(bytes: &[u8]) -> Result<IdxArray, IdxError> {
    read_limited(bytes, VALUES_MAX)
}

/// As [`read`], with at most `limit` values.
///
/// # Errors
/// As [`read`].
pub fn read_limited(bytes: &[u8], limit: u64) -> Result<IdxArray, IdxError> {
    let mut source = content(bytes);
    let magic = take(&mut source, "bytes of the magic number", 4)?;
    if magic[..2] != [0, 0] {
        return Err(IdxError::Magic { found: [magic[0], magic[1]] });
    }
    if magic[2] != 8 {
        return Err(IdxError::Type { found: magic[2] });
    }
    if !(1..=DIMENSIONS_MAX).contains(&magic[3]) {
        return Err(IdxError::Dimensions { found: magic[3] });
    }
    let header = take(&mut source, "bytes of the dimensions", 4 * u64::from(magic[3]))?;
    let dims: Vec<u32> = header
        .chunks_exact(4)
        .map(|d| d.iter().fold(0, |all, &byte| all << 8 | u32::from(byte)))
        .collect();
    let values = dims.iter().try_fold(1u64, |all, &d| all.checked_mul(u64::from(d)));
    let Some(wanted) = values.filter(|n| (1..=limit).contains(n)) else {
        return Err(IdxError::Size { dims, limit });
    };
    let data = take(&mut source, "values", wanted)?;
    if source.read(&mut [0])? > 0 {
        return Err(IdxError::Trailing { wanted });
    }
    let dims = dims.iter().map(|&d| usize::try_from(d).expect("usize holds a u32")).collect();
    Ok(IdxArray { dims, data })
}

fn take(source: &mut dyn Read, what: &'static str, wanted: u64) -> Result<Vec<u8>, IdxError> {
    let bytes = read_up_to(source, wanted)?;
    if u64::try_from(bytes.len()).ok() == Some(wanted) {
        Ok(bytes)
    } else {
        Err(IdxError::Truncated { what, found: bytes.len(), wanted })
    }
}

#[cfg(test)]
mod tests {
    use std::io::Write;

    use flate2::{Compression, write::GzEncoder};
    use proptest::prelude::*;

    use super::*;

    fn file(kind: u8, dims: &[u32], data: &[u8]) -> Vec<u8> {
        let mut bytes = vec![0, 0, kind, u8::try_from(dims.len()).unwrap()];
        bytes.extend(dims.iter().flat_map(|d| d.to_be_bytes()));
        bytes.extend_from_slice(data);
        bytes
    }

    #[test]
    fn reads_plain_and_gzip_alike() {
        let bytes = file(8, &[2, 1, 3], &[1, 2, 3, 4, 5, 6]);
        let array = read(&bytes).unwrap();
        assert_eq!((&array.dims[..], &array.data[..]), (&[2, 1, 3][..], &[1, 2, 3, 4, 5, 6][..]));
        let mut gz = GzEncoder::new(Vec::new(), Compression::fast());
        gz.write_all(&bytes).unwrap();
        let gz = gz.finish().unwrap();
        assert_eq!(read(&gz).unwrap(), array);
        assert!(matches!(read(&gz[..gz.len() - 9]), Err(IdxError::Stream(_))));
    }

    #[test]
    fn every_kind_of_damage_has_its_error() {
        let good = file(8, &[2, 3], &[0; 6]);
        for cut in 0..good.len() {
            assert!(matches!(read(&good[..cut]), Err(IdxError::Truncated { .. })), "{cut}");
        }
        let long = file(8, &[2, 3], &[0; 7]);
        assert!(matches!(read(&long), Err(IdxError::Trailing { wanted: 6 })));
        assert!(matches!(read(b"P6 3 3 255"), Err(IdxError::Magic { found: [b'P', b'6'] })));
        assert!(matches!(read(&file(0x0d, &[1], &[0; 4])), Err(IdxError::Type { found: 0x0d })));
        assert!(matches!(read(&file(8, &[], &[])), Err(IdxError::Dimensions { found: 0 })));
        assert!(matches!(read(&file(8, &[1; 5], &[0])), Err(IdxError::Dimensions { found: 5 })));
    }

    #[test]
    fn a_lying_header_costs_no_memory() {
        for dims in [&[u32::MAX; 4][..], &[0, 5], &[1 << 16, 1 << 15, 2]] {
            assert!(matches!(read(&file(8, dims, &[0; 9])), Err(IdxError::Size { .. })));
        }
        let lie = file(8, &[1 << 16, 1 << 15], &[0; 9]);
        assert!(matches!(read(&lie), Err(IdxError::Truncated { found: 9, .. })));
    }

    proptest! {
        #[test]
        fn any_bytes_are_an_array_or_an_error(bytes: Vec<u8>, keep in 0usize..8) {
            let mut bytes = bytes;
            for (to, from) in bytes.iter_mut().zip([0, 0, 8, 2, 0, 0, 0, 1]).take(keep) {
                *to = from;
            }
            if let Ok(array) = read_limited(&bytes, 1 << 16) {
                prop_assert_eq!(array.dims.iter().product::<usize>(), array.data.len());
            }
        }
    }
}
