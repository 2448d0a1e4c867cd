//! The header of a NumPy array: a Python dictionary of three entries.
//!
//! Only what numpy.save writes is read: strings without escapes, `True` and `False`, a tuple of whole
//! numbers. Any order, any spacing; a key that is missing, strange or twice there is an error.

use super::npy::NpyError;

/// How elements stand for numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Kind {
    /// Two's complement.
    Signed,
    /// Plain binary, and booleans.
    Unsigned,
    /// IEEE 754 binary32 or binary64.
    Float,
}

/// What a header says.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Header {
    pub(crate) kind: Kind,
    /// Bytes an element: 1, 2, 4 or 8.
    pub(crate) width: u8,
    pub(crate) big_end: bool,
    /// Whether the first dimension runs fastest.
    pub(crate) fortran: bool,
    pub(crate) dims: Vec<u64>,
}

/// Splits a file into its header and the bytes of its elements.
pub(crate) fn parse(bytes: &[u8]) -> Result<(Header, &[u8]), NpyError> {
    let rest = bytes.strip_prefix(b"\x93NUMPY").ok_or(NpyError::Header("no NUMPY magic"))?;
    let cut = NpyError::Header("the header is cut short");
    let (length, rest) = match rest {
        [1, _, a, b, rest @ ..] => (u32::from(u16::from_le_bytes([*a, *b])), rest),
        [2 | 3, _, a, b, c, d, rest @ ..] => (u32::from_le_bytes([*a, *b, *c, *d]), rest),
        [0..=3, ..] | [] => return Err(cut),
        _ => return Err(NpyError::Header("the version is none of 1, 2 and 3")),
    };
    let length = usize::try_from(length).map_err(|_| NpyError::Header("the header is too long"))?;
    let (text, elements) = rest.split_at_checked(length).ok_or(cut)?;
    let text = std::str::from_utf8(text).map_err(|_| NpyError::Header("the header is no text"))?;
    Ok((dictionary(text)?, elements))
}

fn dictionary(text: &str) -> Result<Header, NpyError> {
    let strange = || NpyError::Header("the header is no dictionary that numpy.save writes");
    let mut left = Left(text);
    let (mut descr, mut fortran, mut dims) = (None, None, None);
    left.take("{").ok_or_else(strange)?;
    while left.take("}").is_none() {
        let key = left.string().ok_or_else(strange)?;
        left.take(":").ok_or_else(strange)?;
        let fresh = match key {
            "descr" if left.peek('[') => {
                return Err(NpyError::Type { found: "structured".to_owned() });
            }
            "descr" => descr.replace(left.string().ok_or_else(strange)?).is_none(),
            "fortran_order" => fortran.replace(left.truth().ok_or_else(strange)?).is_none(),
            "shape" => dims.replace(left.tuple().ok_or_else(strange)?).is_none(),
            _ => false,
        };
        if !fresh || (left.take(",").is_none() && !left.peek('}')) {
            return Err(strange());
        }
    }
    let (Some(descr), Some(fortran), Some(dims)) = (descr, fortran, dims) else {
        return Err(NpyError::Header("the header lacks descr, fortran_order or shape"));
    };
    if !left.0.trim().is_empty() {
        return Err(strange());
    }
    let (kind, width, big_end) = kind(descr).ok_or_else(|| {
        let found = descr.chars().take(24).collect();
        NpyError::Type { found }
    })?;
    Ok(Header { kind, width, big_end, fortran, dims })
}

/// Kind, width and order of bytes of a type such as `<f4`.
fn kind(descr: &str) -> Option<(Kind, u8, bool)> {
    let (end, name) = descr.split_at_checked(1)?;
    let (kind, width) = match name {
        "b1" | "u1" => (Kind::Unsigned, 1),
        "u2" => (Kind::Unsigned, 2),
        "u4" => (Kind::Unsigned, 4),
        "u8" => (Kind::Unsigned, 8),
        "i1" => (Kind::Signed, 1),
        "i2" => (Kind::Signed, 2),
        "i4" => (Kind::Signed, 4),
        "i8" => (Kind::Signed, 8),
        "f4" => (Kind::Float, 4),
        "f8" => (Kind::Float, 8),
        _ => return None,
    };
    match end {
        "<" => Some((kind, width, false)),
        ">" => Some((kind, width, true)),
        "|" if width == 1 => Some((kind, width, false)),
        _ => None,
    }
}

/// What is left of the text.
struct Left<'a>(&'a str);

impl<'a> Left<'a> {
    fn peek(&mut self, wanted: char) -> bool {
        self.0 = self.0.trim_start();
        self.0.starts_with(wanted)
    }

    fn take(&mut self, wanted: &str) -> Option<()> {
        self.0 = self.0.trim_start().strip_prefix(wanted)?;
        Some(())
    }

    fn string(&mut self) -> Option<&'a str> {
        let text = self.0.trim_start();
        let quote = text.chars().next().filter(|c| matches!(c, '\'' | '"'))?;
        let (string, rest) = text[1..].split_once(quote)?;
        self.0 = rest;
        (!string.contains('\\')).then_some(string)
    }

    fn truth(&mut self) -> Option<bool> {
        match self.take("True") {
            Some(()) => Some(true),
            None => self.take("False").map(|()| false),
        }
    }

    fn tuple(&mut self) -> Option<Vec<u64>> {
        self.take("(")?;
        let mut numbers = Vec::new();
        while self.take(")").is_none() {
            let text = self.0.trim_start();
            let digits = text.len() - text.trim_start_matches(|c: char| c.is_ascii_digit()).len();
            numbers.push(text[..digits].parse().ok()?);
            self.0 = &text[digits..];
            if self.take(",").is_none() && !self.peek(')') {
                return None;
            }
        }
        Some(numbers)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reads_what_numpy_writes_in_any_order_and_spacing() {
        let wanted = Header {
            kind: Kind::Float,
            width: 4,
            big_end: false,
            fortran: false,
            dims: vec![60000, 28, 28],
        };
        let texts = [
            "{'descr': '<f4', 'fortran_order': False, 'shape': (60000, 28, 28), }      \n",
            "{\"shape\":(60000,28,28,),\"descr\":\"<f4\",\"fortran_order\":False}",
        ];
        for text in texts {
            assert_eq!(dictionary(text).unwrap(), wanted);
        }
        assert!(
            dictionary("{'descr': '|b1', 'fortran_order': True, 'shape': ()}").unwrap().fortran
        );
    }

    #[test]
    fn strange_headers_are_errors() {
        let strange = [
            "",
            "{",
            "{}",
            "{'descr': '<f4', 'fortran_order': False, 'shape': (1,)",
            "{'descr': '<f4', 'fortran_order': False, 'shape': (1,)} x",
            "{'descr': '<f4' 'fortran_order': False, 'shape': (1,)}",
            "{'descr': '<f4', 'descr': '<f4', 'fortran_order': False, 'shape': (1,)}",
            "{'descr': '<f4', 'fortran_order': 0, 'shape': (1,)}",
            "{'descr': '<f4', 'fortran_order': False, 'shape': (-1,)}",
            "{'descr': '<f4', 'fortran_order': False, 'shape': (99999999999999999999,)}",
            "{'descr': '<f4', 'fortran_order': False, 'shape': (,)}",
            "{'descr': '<f4', 'fortran_order': False, 'shape': (1,), 'more': 1}",
        ];
        for text in strange {
            assert!(matches!(dictionary(text), Err(NpyError::Header(_))), "{text}");
        }
        for descr in ["'<f2'", "'|O'", "'<U3'", "'|u2'", "''", "'é'", "[('a', '<i4')]"] {
            let text = format!("{{'descr': {descr}, 'fortran_order': False, 'shape': (1,)}}");
            assert!(matches!(dictionary(&text), Err(NpyError::Type { .. })), "{text}");
        }
    }

    #[test]
    fn versions_and_cuts_are_checked() {
        let text = b"{'descr': '|u1', 'fortran_order': False, 'shape': (1,)}";
        let length = u8::try_from(text.len()).unwrap();
        let one = [&b"\x93NUMPY\x01\x00"[..], &[length, 0], text, &[9]].concat();
        let two = [&b"\x93NUMPY\x02\x00"[..], &[length, 0, 0, 0], text, &[9]].concat();
        assert_eq!(parse(&one).unwrap(), parse(&two).unwrap());
        assert_eq!(parse(&one).unwrap().1, [9]);
        for cut in 0..one.len() - 1 {
            assert!(parse(&one[..cut]).is_err(), "{cut}");
        }
        assert!(parse(b"\x93NUMPY\x04\x00\x00\x00").is_err());
    }
}
