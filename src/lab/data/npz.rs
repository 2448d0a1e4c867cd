//! NPZ: a zip archive of NumPy arrays, one `NAME.npy` each. A file of one array alone, `.npy`, is an archive of one
//! without a name.

use std::io::{Cursor, Read};

use super::{
    inflate::read_up_to,
    npy::{BYTES_MAX, NpyError},
};

/// Greatest length of a header before the elements, beyond which a file is refused.
const HEADER_MAX: u64 = 1 << 16;
/// Greatest number of arrays in an archive.
const ARRAYS_MAX: usize = 1 << 12;

/// Why an array cannot be had from an archive.
#[derive(Debug, thiserror::Error)]
pub enum NpzError {
    /// Not a zip archive, or a damaged one.
    #[error("is not a zip archive that can be read: {0}; save it anew with numpy.savez_compressed")]
    Zip(#[from] zip::result::ZipError),
    /// No array of that name.
    #[error("has no array `{wanted}`; there are {}", list(.there))]
    Name {
        /// Name asked for.
        wanted: String,
        /// Names there, without `.npy`.
        there: Vec<String>,
    },
    /// More arrays than allowed.
    #[error("has {found} arrays, allowed are {ARRAYS_MAX}")]
    Arrays {
        /// Arrays there.
        found: usize,
    },
    /// An array that unpacks to too much.
    #[error("array `{name}` unpacks to more than the {limit} bytes allowed; save smaller pieces")]
    Size {
        /// Name of the array.
        name: String,
        /// Greatest number of bytes allowed.
        limit: u64,
    },
    /// The archive breaks off inside an array.
    #[error("array `{name}` cannot be unpacked: {source}; the archive is damaged, so save it anew")]
    Unpack {
        /// Name of the array.
        name: String,
        /// What broke.
        source: std::io::Error,
    },
    /// The array itself.
    #[error("{} {source}", if .name.is_empty() { "the array".into() } else { format!("array `{name}`") })]
    Array {
        /// Name of the array.
        name: String,
        /// What is wrong with it.
        source: NpyError,
    },
}

fn list(names: &[String]) -> String {
    match names {
        [] => "none".to_owned(),
        some => some.iter().take(12).map(|n| format!("`{n}`")).collect::<Vec<_>>().join(", "),
    }
}

/// An archive, opened.
#[derive(Debug)]
pub enum Archive<'a> {
    /// Arrays by name.
    Zip(Box<zip::ZipArchive<Cursor<&'a [u8]>>>),
    /// One array.
    Single(&'a [u8]),
}

/// What the only array of a `.npy` file is called.
pub const SINGLE: &str = "";

impl<'a> Archive<'a> {
    /// Opens an archive.
    ///
    /// # Errors
    /// When the bytes are none.
    pub fn open(bytes: &'a [u8]) -> Result<Self, NpzError> {
        if bytes.starts_with(b"\x93NUMPY") {
            return Ok(Self::Single(bytes));
        }
        let archive = zip::ZipArchive::new(Cursor::new(bytes))?;
        if archive.len() > ARRAYS_MAX {
            return Err(NpzError::Arrays { found: archive.len() });
        }
        Ok(Self::Zip(Box::new(archive)))
    }

    /// Names of its arrays, sorted, without `.npy`.
    #[must_use]
    pub fn names(&self) -> Vec<String> {
        match self {
            Self::Zip(archive) => {
                let name =
                    |n: &[u8]| n.strip_suffix(b".npy").unwrap_or(n).escape_ascii().to_string();
                let mut names: Vec<String> = archive.file_names_raw().map(name).collect();
                names.sort();
                names
            }
            Self::Single(_) => vec![SINGLE.to_owned()],
        }
    }

    /// The bytes of an array, header and elements.
    ///
    /// # Errors
    /// When it is not there, or cannot be unpacked.
    pub fn read(&mut self, name: &str) -> Result<Vec<u8>, NpzError> {
        self.read_limited(name, BYTES_MAX)
    }

    /// As [`Archive::read`], with at most `limit` bytes of elements.
    ///
    /// # Errors
    /// As [`Archive::read`].
    pub fn read_limited(&mut self, name: &str, limit: u64) -> Result<Vec<u8>, NpzError> {
        let missing = |there| Err(NpzError::Name { wanted: name.to_owned(), there });
        let archive = match self {
            Self::Single(bytes) if name == SINGLE => return Ok(bytes.to_vec()),
            Self::Single(_) => return missing(vec!["one array without a name".into()]),
            Self::Zip(archive) => archive,
        };
        let at = archive.index_for_name(&format!("{name}.npy"));
        let Some(at) = at.or_else(|| archive.index_for_name(name)) else {
            return missing(self.names());
        };
        let name = || name.to_owned();
        let limit = limit.saturating_add(HEADER_MAX);
        let mut file = archive.by_index(at)?;
        if file.size() > limit {
            return Err(NpzError::Size { name: name(), limit });
        }
        // the size in the directory may lie, so what arrives is counted too
        let array = read_up_to(&mut file, limit)
            .map_err(|source| NpzError::Unpack { name: name(), source })?;
        if file.read(&mut [0]).is_ok_and(|n| n > 0) {
            return Err(NpzError::Size { name: name(), limit });
        }
        Ok(array)
    }
}

#[cfg(test)]
mod tests {
    use std::io::Write;

    use proptest::prelude::*;
    use zip::{CompressionMethod, ZipWriter, write::SimpleFileOptions};

    use super::*;
    use crate::lab::data::npy::{self, tests::file as npy};

    /// What is left of reading the array `x` as bytes.
    fn read(bytes: &[u8], name: &str, limit: u64) -> Result<Vec<u8>, NpzError> {
        let array = Archive::open(bytes)?.read_limited(name, limit)?;
        let read = npy::values(&array, 16);
        let failed = |source| NpzError::Array { name: name.into(), source };
        read.map(|array| array.data).map_err(failed)
    }

    pub(crate) fn archive(arrays: &[(&str, &[u8])], method: CompressionMethod) -> Vec<u8> {
        let mut zip = ZipWriter::new(Cursor::new(Vec::new()));
        for (name, bytes) in arrays {
            zip.start_file(*name, SimpleFileOptions::default().compression_method(method)).unwrap();
            zip.write_all(bytes).unwrap();
        }
        zip.finish().unwrap().into_inner()
    }

    #[test]
    fn arrays_are_found_by_name_stored_or_deflated() {
        let (x, y) = (
            npy("'|u1'", "False", "(2, 2)", &[1, 2, 3, 4]),
            npy("'<i8'", "False", "(1,)", &[0; 8]),
        );
        for method in [CompressionMethod::Stored, CompressionMethod::Deflated] {
            let bytes = archive(&[("x.npy", &x), ("y.npy", &y)], method);
            assert_eq!(read(&bytes, "x", 1 << 20).unwrap(), [1, 2, 3, 4]);
            assert_eq!(read(&bytes, "y", 1 << 20).unwrap(), [0]);
            let missing = read(&bytes, "z", 1 << 20).unwrap_err().to_string();
            assert_eq!(missing, "has no array `z`; there are `x`, `y`");
        }
        assert_eq!(Archive::open(&x).unwrap().names(), [SINGLE]);
        assert_eq!(read(&x, SINGLE, 1 << 20).unwrap(), [1, 2, 3, 4]);
        assert!(read(&x, "x", 1 << 20).is_err());
    }

    #[test]
    fn bombs_cuts_and_flipped_bytes_are_errors() {
        let zeros = npy("'|u1'", "False", "(1000000,)", &[0; 1_000_000]);
        let bytes = archive(&[("x.npy", &zeros)], CompressionMethod::Deflated);
        assert!(bytes.len() < 10_000);
        let bomb = read(&bytes, "x", 100_000);
        assert!(matches!(bomb, Err(NpzError::Size { .. })));
        for cut in [0, 10, bytes.len() / 2, bytes.len() - 1] {
            assert!(matches!(read(&bytes[..cut], "x", 1 << 20), Err(NpzError::Zip(_))));
        }
        let stored = archive(&[("x.npy", &zeros)], CompressionMethod::Stored);
        let mut flipped = stored.clone();
        flipped[500_000] ^= 1;
        assert!(matches!(read(&flipped, "x", 1 << 20), Err(NpzError::Unpack { .. })));
    }

    proptest! {
        #[test]
        fn a_damaged_archive_is_an_array_or_an_error(at: prop::sample::Index, to: u8) {
            let x = npy("'<f4'", "True", "(1, 3)", &[0; 12]);
            let mut bytes = archive(&[("x.npy", &x)], CompressionMethod::Deflated);
            let at = at.index(bytes.len());
            bytes[at] = to;
            if let Ok(values) = read(&bytes, "x", 1 << 16) {
                prop_assert!(values.len() < 1 << 16);
            }
        }
    }
}
