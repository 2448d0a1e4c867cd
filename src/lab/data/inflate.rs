//! Bounded gzip: a small file never becomes more memory than its reader allows.

use std::io::{self, Read};

use flate2::read::MultiGzDecoder;

/// Whether `bytes` open like a gzip file.
pub(crate) fn is_gzip(bytes: &[u8]) -> bool {
    bytes.starts_with(&[0x1f, 0x8b])
}

/// A reader of the content of `bytes`, inflated where they are gzip.
pub(crate) fn content(bytes: &[u8]) -> Box<dyn Read + '_> {
    if is_gzip(bytes) { Box::new(MultiGzDecoder::new(bytes)) } else { Box::new(bytes) }
}

/// Reads up to `limit` bytes; memory grows with what arrives, not with what was promised.
///
/// # Errors
/// When the source fails.
pub(crate) fn read_up_to(source: &mut dyn Read, limit: u64) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    source.take(limit).read_to_end(&mut bytes)?;
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use std::io::Write;

    use flate2::{Compression, write::GzEncoder};

    use super::*;

    #[test]
    fn content_is_the_same_with_and_without_gzip_and_stops_at_the_limit() {
        let mut gz = GzEncoder::new(Vec::new(), Compression::best());
        gz.write_all(&[7; 100_000]).unwrap();
        let gz = gz.finish().unwrap();
        assert!(is_gzip(&gz) && gz.len() < 1000);
        assert_eq!(read_up_to(&mut content(&gz), 1 << 20).unwrap(), [7; 100_000]);
        assert_eq!(read_up_to(&mut content(&gz), 999).unwrap().len(), 999);
        assert_eq!(read_up_to(&mut content(b"abc"), 1 << 20).unwrap(), b"abc");
        assert!(read_up_to(&mut content(&gz[..gz.len() / 2]), 1 << 20).is_err());
    }
}
