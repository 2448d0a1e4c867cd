//! MD5 of a stream, in hexadecimal: the hash that the authors' files are known by.

use md5::Digest;

/// A running MD5.
#[derive(Default)]
pub(crate) struct Md5(md5::Md5);

impl Md5 {
    /// Goes on with `bytes`.
    pub(crate) fn update(&mut self, bytes: &[u8]) {
        self.0.update(bytes);
    }

    /// Ends the stream.
    pub(crate) fn hex(self) -> String {
        self.0.finalize().iter().map(|byte| format!("{byte:02x}")).collect()
    }
}

/// MD5 of `bytes`.
pub(crate) fn md5_hex(bytes: &[u8]) -> String {
    let mut hash = Md5::default();
    hash.update(bytes);
    hash.hex()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn known_answers() {
        assert_eq!(md5_hex(b""), "d41d8cd98f00b204e9800998ecf8427e");
        assert_eq!(md5_hex(b"hello world"), "5eb63bbbe01eeed093cb22bb8f5acdc3");
    }
}
