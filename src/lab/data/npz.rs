//! NPZ: a zip archive of NumPy arrays, one `NAME.npy` each.

use std::io::{Cursor, Read};

use super::{
    inflate::read_up_to,
    npy::{self, BYTES_MAX, Floats, NpyArray, NpyError},
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
    #[error("array `{name}` {source}")]
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

/// Reads the array `name` out of an archive.
///
/// # Errors
/// When the bytes are no archive, the array is not there or [`npy::read`] refuses it.
pub fn read(bytes: &[u8], name: &str, floats: Floats) -> Result<NpyArray, NpzError> {
    read_limited(bytes, name, floats, BYTES_MAX)
}

/// As [`read`], with at most `limit` bytes of elements.
///
/// # Errors
/// As [`read`].
pub fn read_limited(
    bytes: &[u8],
    name: &str,
    floats: Floats,
    limit: u64,
) -> Result<NpyArray, NpzError> {
    let mut archive = zip::ZipArchive::new(Cursor::new(bytes))?;
    if archive.len() > ARRAYS_MAX {
        return Err(NpzError::Arrays { found: archive.len() });
    }
    let file_name = format!("{name}.npy");
    let Some(at) = archive.index_for_name(&file_name).or_else(|| archive.index_for_name(name))
    else {
        let mut there: Vec<String> = archive
            .file_names_raw()
            .map(|n| n.strip_suffix(b".npy").unwrap_or(n).escape_ascii().to_string())
            .collect();
        there.sort();
        return Err(NpzError::Name { wanted: name.to_owned(), there });
    };
    let name = || name.to_owned();
    let limit = limit.saturating_add(HEADER_MAX);
    let mut file = archive.by_index(at)?;
    if file.size() > limit {
        return Err(NpzError::Size { name: name(), limit });
    }
    // The size in the directory may lie, so what arrives is counted too.
    let array =
        read_up_to(&mut file, limit).map_err(|source| NpzError::Unpack { name: name(), source })?;
    if file.read(&mut [0]).is_ok_and(|n| n > 0) {
        return Err(NpzError::Size { name: name(), limit });
    }
    npy::read(&array, floats).map_err(|source| NpzError::Array { name: name(), source })
}

#[cfg(test)]
mod tests {
    use std::io::Write;

    use proptest::prelude::*;
    use zip::{CompressionMethod, ZipWriter, write::SimpleFileOptions};

    use super::*;
    use crate::lab::data::npy::tests::file as npy;

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
            let array = read(&bytes, "x", Floats::Refuse).unwrap();
            assert_eq!((array.dims, array.data), (vec![2, 2], vec![1, 2, 3, 4]));
            assert_eq!(read(&bytes, "y", Floats::Refuse).unwrap().data, [0]);
            let missing = read(&bytes, "z", Floats::Refuse).unwrap_err().to_string();
            assert_eq!(missing, "has no array `z`; there are `x`, `y`");
        }
    }

    #[test]
    fn bombs_cuts_and_flipped_bytes_are_errors() {
        let zeros = npy("'|u1'", "False", "(1000000,)", &[0; 1_000_000]);
        let bytes = archive(&[("x.npy", &zeros)], CompressionMethod::Deflated);
        assert!(bytes.len() < 10_000);
        let bomb = read_limited(&bytes, "x", Floats::Refuse, 100_000);
        assert!(matches!(bomb, Err(NpzError::Size { .. })));
        for cut in [0, 10, bytes.len() / 2, bytes.len() - 1] {
            assert!(matches!(read(&bytes[..cut], "x", Floats::Refuse), Err(NpzError::Zip(_))));
        }
        let stored = archive(&[("x.npy", &zeros)], CompressionMethod::Stored);
        let mut flipped = stored.clone();
        flipped[500_000] ^= 1;
        assert!(matches!(read(&flipped, "x", Floats::Refuse), Err(NpzError::Unpack { .. })));
    }

    proptest! {
        #[test]
        fn a_damaged_archive_is_an_array_or_an_error(at: prop::sample::Index, to: u8) {
            let x = npy("'<f4'", "True", "(1, 3)", &[0; 12]);
            let mut bytes = archive(&[("x.npy", &x)], CompressionMethod::Deflated);
            let at = at.index(bytes.len());
            bytes[at] = to;
            if let Ok(array) = read_limited(&bytes, "x", Floats::Scale(16), 1 << 16) {
                prop_assert_eq!(array.dims.iter().product::<usize>(), array.data.len());
            }
        }
    }
}
