//! The address of a run: what decides its result, and nothing else.
//!
//! ```text
//! key = first 16 bytes of BLAKE3("dalean run 1\n" | arithmetic version, u32 LE | data hash | "\n" | resolved configuration)
//! ```
//!
//! Kernel, threads, machine, time and the sweep that asked for it are not part of it.

use super::ARITHMETIC;

/// The key of a run, 32 hexadecimal digits. `config` is the resolved configuration, `data` the hash of the data.
#[must_use]
pub fn key(config: &str, data: &str) -> String {
    let mut hash = blake3::Hasher::new();
    hash.update(b"dalean run 1\n").update(&ARITHMETIC.to_le_bytes());
    hash.update(data.as_bytes()).update(b"\n").update(config.as_bytes());
    hash.finalize().to_hex()[..32].to_owned()
}

/// Whether a text is a key.
#[must_use]
pub fn is_key(text: &str) -> bool {
    text.len() == 32 && text.bytes().all(|b| b.is_ascii_digit() || (b'a'..=b'f').contains(&b))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn configuration_and_data_move_the_key() {
        let keys = [key("a", "b"), key("a", "c"), key("b", "b"), key("", "b\na")];
        assert!(keys.iter().all(|key| is_key(key)));
        let mut sorted = keys.to_vec();
        sorted.sort();
        sorted.dedup();
        assert_eq!(sorted.len(), keys.len());
    }
}
