//! What somebody may have meant: the known word that is nearest to one that is not known.

/// The known word with the fewest slips of the pen (a letter more, less, other, or two exchanged) from `found`; none when
/// every word is too far: at most a third of its letters may differ.
#[must_use]
pub fn nearest<'a>(found: &str, known: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let plain = |word: &str| word.trim().to_lowercase().replace('-', "_");
    let wanted = plain(found);
    let slips = |word: &&'a str| (strsim::osa_distance(&wanted, &plain(word)), *word);
    let near = known.into_iter().map(|word| slips(&word)).min_by_key(|(slips, _)| *slips);
    let room = wanted.chars().count().div_ceil(3).max(1);
    near.filter(|(slips, _)| *slips <= room && !wanted.is_empty()).map(|(_, word)| word)
}

/// `; did you mean "x"?`, or nothing: the end of a message.
#[must_use]
pub fn hint<'a>(found: &str, known: impl IntoIterator<Item = &'a str>) -> String {
    nearest(found, known).map_or_else(String::new, |word| format!("; did you mean \"{word}\"?"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_slip_is_found_and_another_word_is_not() {
        let known = ["level_bits", "floor", "ceiling", "reram", "ed", "bp", "dfa"];
        for (found, wanted) in [
            ("level_bit", Some("level_bits")),
            ("Level-Bits", Some("level_bits")),
            ("levle_bits", Some("level_bits")),
            ("flor", Some("floor")),
            ("reramm", Some("reram")),
            ("de", Some("ed")),
            ("adam", None),
            ("temperature", None),
            ("", None),
        ] {
            assert_eq!(nearest(found, known), wanted, "{found}");
        }
        assert_eq!(hint("flor", known), "; did you mean \"floor\"?");
        assert_eq!(hint("temperature", known), "");
    }
}
