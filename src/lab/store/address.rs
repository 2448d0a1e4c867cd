//! The address of a run: what decides its result, and nothing else.
//!
//! ```text
//! key = first 16 bytes of BLAKE3("dalean run 2\n" | arithmetic version, u32 LE | data hash | "\n" | list)
//! list = what the core was given, a line "key word\n" each, sorted by key, frozen defaults left out     (see `given`)
//! ```
//!
//! Kernel, threads, machine, time, names, constants, sources and the sweep that asked for it are not part of it.

use super::ARITHMETIC;

/// The key of a run, 32 hexadecimal digits, from what it was given and the hash of its data.
#[must_use]
pub fn key(mut given: Vec<(String, String)>, data: &str) -> String {
    given.sort();
    let mut hash = blake3::Hasher::new();
    hash.update(b"dalean run 2\n").update(&ARITHMETIC.to_le_bytes());
    hash.update(data.as_bytes()).update(b"\n");
    for (key, word) in given {
        hash.update(format!("{key} {word}\n").as_bytes());
    }
    hash.finalize().to_hex()[..32].to_owned()
}

/// Whether a text is a key.
#[must_use]
pub fn is_key(text: &str) -> bool {
    text.len() == 32 && text.bytes().all(|b| b.is_ascii_digit() || (b'a'..=b'f').contains(&b))
}

/// Whether a text can be the name of a sweep: 1 to 64 lower-case letters, digits and `-`, so that it can be that of a file.
#[must_use]
pub fn is_name(text: &str) -> bool {
    let good = |b: u8| b.is_ascii_lowercase() || b.is_ascii_digit() || b == b'-';
    (1..=64).contains(&text.len()) && text.bytes().all(good)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_given_and_the_data_move_the_key_and_their_order_does_not() {
        let list = |pairs: &[[&str; 2]]| -> Vec<(String, String)> {
            pairs.iter().map(|[key, word]| ((*key).to_owned(), (*word).to_owned())).collect()
        };
        let (a, b) = (["seed", "2"], ["adc", "4"]);
        let keys = [
            key(list(&[a]), "x"),
            key(list(&[a]), "y"),
            key(list(&[a, b]), "x"),
            key(list(&[["seed", "3"]]), "x"),
            key(vec![], "x"),
        ];
        assert!(keys.iter().all(|key| is_key(key)));
        assert!(keys.iter().enumerate().all(|(at, key)| !keys[..at].contains(key)));
        assert_eq!(key(list(&[b, a]), "x"), keys[2]);
    }
}
