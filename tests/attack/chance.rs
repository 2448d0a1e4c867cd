//! What is drawn, and how texts and bytes are damaged.

/// Numbers from a seed and the number of a start.
pub(crate) struct Chance(u64);

impl Chance {
    pub(crate) fn new(seed: u64, number: u64) -> Self {
        let mut chance = Self(seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) ^ (number << 1 | 1));
        for _ in 0..8 {
            chance.next();
        }
        chance
    }

    /// splitmix64.
    pub(crate) fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    pub(crate) fn below(&mut self, count: usize) -> usize {
        usize::try_from(self.next() % count.max(1) as u64).unwrap()
    }

    pub(crate) fn one_in(&mut self, count: usize) -> bool {
        self.below(count) == 0
    }

    pub(crate) fn of<'a, T: ?Sized>(&mut self, list: &[&'a T]) -> &'a T {
        list[self.below(list.len())]
    }

    /// Damaged bytes: some flipped, cut off, doubled, taken out or replaced.
    pub(crate) fn bytes(&mut self, bytes: &[u8]) -> Vec<u8> {
        let mut bytes = bytes.to_vec();
        for _ in 0..=self.below(4) {
            let at = self.below(bytes.len());
            match self.below(7) {
                0 => bytes.truncate(at),
                1 if !bytes.is_empty() => bytes[at] ^= 1 << self.below(8),
                2 if !bytes.is_empty() => bytes[at] = [0, 255, b'\n', b'"', b'-'][self.below(5)],
                3 => {
                    let end = (at + self.below(64)).min(bytes.len());
                    drop(bytes.drain(at.min(end)..end));
                }
                4 => {
                    let end = (at + self.below(64)).min(bytes.len());
                    let part = bytes[at.min(end)..end].to_vec();
                    bytes.splice(at..at, part);
                }
                5 => bytes.extend(vec![self.below(256).try_into().unwrap_or(0); self.below(300)]),
                _ => {
                    let more: Vec<u8> = (0..self.below(16))
                        .map(|_| self.below(256).try_into().unwrap_or(0))
                        .collect();
                    bytes.splice(at..at, more);
                }
            }
        }
        bytes
    }

    /// A damaged text of keys and values: mostly still TOML, JSON or CSV, with numbers and words that nobody expects.
    pub(crate) fn text(&mut self, text: &str) -> Vec<u8> {
        if self.one_in(5) {
            return self.bytes(text.as_bytes());
        }
        let mut text = text.to_owned();
        for _ in 0..=self.below(3) {
            text = match self.below(4) {
                // a number becomes another
                0..=1 => self.number_in(&text),
                2 => self.word_in(&text),
                _ => {
                    let mut lines: Vec<&str> = text.lines().collect();
                    let at = self.below(lines.len());
                    match self.below(3) {
                        0 if !lines.is_empty() => drop(lines.remove(at)),
                        1 if !lines.is_empty() => lines.insert(at, lines[at]),
                        _ => lines.insert(at.min(lines.len()), "more = 1"),
                    }
                    lines.join("\n") + "\n"
                }
            };
        }
        text.into_bytes()
    }

    /// A number that somebody may have typed.
    pub(crate) fn number(&mut self) -> String {
        let odd = [
            "0",
            "1",
            "-1",
            "2",
            "3",
            "7",
            "8",
            "9",
            "12",
            "13",
            "16",
            "31",
            "32",
            "63",
            "64",
            "255",
            "256",
            "257",
            "4096",
            "65535",
            "65536",
            "1000000",
            "2147483647",
            "4294967295",
            "4294967296",
            "4000000000",
            "9223372036854775807",
            "9223372036854775808",
            "18446744073709551616",
            "1e400",
            "1e-400",
            "0.5",
            "1e6",
            "1e-6",
            "3.0",
            "inf",
            "nan",
            "-0.0",
            "1e308",
            "0.1",
            "1_000",
            "0x10",
            "",
        ];
        self.of(&odd).to_owned()
    }

    fn number_in(&mut self, text: &str) -> String {
        let is_part = |b: u8| b.is_ascii_digit() || b == b'.';
        let bytes = text.as_bytes();
        let begins: Vec<usize> = (0..bytes.len())
            .filter(|&at| {
                bytes[at].is_ascii_digit()
                    && (at == 0
                        || !is_part(bytes[at - 1])
                            && !bytes[at - 1].is_ascii_alphanumeric()
                            && bytes[at - 1] != b'_')
            })
            .collect();
        if begins.is_empty() {
            return text.to_owned();
        }
        let at = begins[self.below(begins.len())];
        let end = (at..bytes.len()).find(|&i| !is_part(bytes[i])).unwrap_or(bytes.len());
        format!("{}{}{}", &text[..at], self.number(), &text[end..])
    }

    fn word_in(&mut self, text: &str) -> String {
        let quotes: Vec<usize> = text.match_indices('"').map(|(at, _)| at).collect();
        if quotes.len() < 2 {
            return text.to_owned();
        }
        let open = self.below(quotes.len() / 2) * 2;
        let words = [
            "",
            "ed",
            "bp",
            "ideal",
            "none",
            "../x",
            "/dev/null",
            "xor",
            "full",
            "calibrated",
            "batch",
            "a\\u0000b",
            "\\n",
            "é",
            "running",
            "random_dense",
            "last",
            "sigmoid",
            "relu",
            "rank1",
            "online",
            "replay",
            "tracking",
            "amplitude",
            "prime",
        ];
        let (at, end) = (quotes[open] + 1, quotes[open + 1]);
        format!("{}{}{}", &text[..at], self.of(&words), &text[end..])
    }
}
