//! From the bytes of a table to plain UTF-8, and what separates its fields.
//!
//! A file may be gzip, begin with a byte order mark, or be UTF-16 with one. Fields are separated by commas, semicolons,
//! tabs or bars: by the one that cuts the first lines into equally many fields, a tab before a bar before a semicolon
//! before a comma, since decimal commas cut evenly too.

use std::borrow::Cow;
use std::io::Read;

use super::CsvError;
use crate::lab::data::inflate::{content, is_gzip, read_up_to};

/// Lines looked at to find the separator.
const LINES: usize = 20;
/// Separators, the least likely to stand inside a field first.
const SEPARATORS: [u8; 4] = [b'\t', b'|', b';', b','];

/// The text in `bytes`, of at most `limit` bytes, without a mark.
pub(super) fn decode(bytes: &[u8], limit: u64) -> Result<Cow<'_, [u8]>, CsvError> {
    let bytes = if is_gzip(bytes) {
        let mut source = content(bytes);
        let text = read_up_to(&mut source, limit).map_err(CsvError::Gzip)?;
        if source.read(&mut [0]).is_ok_and(|n| n > 0) {
            return Err(CsvError::Large { limit });
        }
        Cow::Owned(text)
    } else {
        Cow::Borrowed(bytes)
    };
    let units = |from_bytes: fn([u8; 2]) -> u16| {
        if bytes.len() % 2 != 0 {
            return Err(CsvError::Utf16);
        }
        let units = bytes.chunks_exact(2).skip(1).map(|pair| from_bytes([pair[0], pair[1]]));
        let text: Result<String, _> = char::decode_utf16(units).collect();
        text.map(|text| Cow::Owned(text.into_bytes())).map_err(|_| CsvError::Utf16)
    };
    match *bytes {
        [0xff, 0xfe, ..] => return units(u16::from_le_bytes),
        [0xfe, 0xff, ..] => return units(u16::from_be_bytes),
        [b'P', b'K', 3, 4, ..] => return Err(CsvError::Spreadsheet),
        _ => {}
    }
    let start = &bytes[..bytes.len().min(4096)];
    if start.contains(&0) {
        return Err(CsvError::Binary);
    }
    let text = match bytes {
        Cow::Borrowed(bytes) => Cow::Borrowed(bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes)),
        Cow::Owned(bytes) => match bytes.strip_prefix(b"\xef\xbb\xbf") {
            Some(text) => Cow::Owned(text.to_vec()),
            None => Cow::Owned(bytes),
        },
    };
    // two words of another encoding must not become one
    match std::str::from_utf8(&text) {
        Ok(_) => Ok(text),
        Err(error) => {
            let line = text[..error.valid_up_to()].iter().filter(|byte| **byte == b'\n').count();
            Err(CsvError::Encoding { line: line + 1 })
        }
    }
}

/// What separates the fields of a text.
pub(super) fn separator(text: &[u8]) -> u8 {
    let mut lines: Vec<[usize; SEPARATORS.len()]> = vec![[0; SEPARATORS.len()]];
    let mut quoted = false;
    let mut empty = true;
    for &byte in text {
        quoted ^= byte == b'"';
        match byte {
            b'\n' | b'\r' if !quoted => {
                if lines.len() == LINES {
                    break;
                }
                if !empty {
                    lines.push([0; SEPARATORS.len()]);
                }
                empty = true;
            }
            byte if !quoted => {
                empty = false;
                if let (Some(at), Some(line)) =
                    (SEPARATORS.iter().position(|&s| s == byte), lines.last_mut())
                {
                    line[at] += 1;
                }
            }
            _ => empty = false,
        }
    }
    if empty && lines.len() > 1 {
        lines.pop();
    }
    let even =
        |at: &usize| lines[0][*at] > 0 && lines.iter().all(|line| line[*at] == lines[0][*at]);
    let all = || 0..SEPARATORS.len();
    let most = || all().max_by_key(|&at| (lines[0][at], at)).unwrap_or(SEPARATORS.len() - 1);
    SEPARATORS[all().find(even).unwrap_or_else(most)]
}

#[cfg(test)]
mod tests {
    use std::io::Write;

    use super::*;

    #[test]
    fn marks_utf16_and_gzip_are_taken_off() {
        let text =
            |bytes: &[u8]| decode(bytes, 100).map(Cow::into_owned).map_err(|e| e.to_string());
        let utf16 = |mark: [u8; 2], to: fn(u16) -> [u8; 2]| {
            let mut bytes = mark.to_vec();
            bytes.extend("a,é\n".encode_utf16().flat_map(to));
            bytes
        };
        let wanted = Ok("a,é\n".as_bytes().to_vec());
        assert_eq!(text("a,é\n".as_bytes()), wanted);
        assert_eq!(text("\u{feff}a,é\n".as_bytes()), wanted);
        assert_eq!(text(&utf16([0xff, 0xfe], u16::to_le_bytes)), wanted);
        assert_eq!(text(&utf16([0xfe, 0xff], u16::to_be_bytes)), wanted);
        let gzip = |bytes: &[u8]| {
            let mut gz = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::best());
            gz.write_all(bytes).unwrap();
            gz.finish().unwrap()
        };
        assert_eq!(text(&gzip("\u{feff}a,é\n".as_bytes())), wanted);
        assert!(text(&gzip(&[b'1'; 101])).unwrap_err().contains("more than the 100 bytes"));
        let gz = gzip(b"1,2\n");
        assert!(text(&gz[..gz.len() - 9]).unwrap_err().contains("cut short"));
        assert!(text(b"\xff\xfea").unwrap_err().contains("UTF-16"));
        assert!(text(b"1\0,\x002\0").unwrap_err().contains("zero bytes"));
        assert!(text(b"1,a\n2,caf\xe9\n").unwrap_err().contains("line 2 is not UTF-8"));
        assert!(text(b"PK\x03\x04xxxx").unwrap_err().contains("spreadsheet"));
    }

    #[test]
    fn the_separator_cuts_all_lines_alike() {
        for (text, wanted) in [
            ("1,2,3\n4,5,6\n", b','),
            ("1;2;3\n4;5;6\n", b';'),
            ("1\t2\n3\t4", b'\t'),
            ("0,5;0,25;1\n0,1;0,75;0\n", b';'),
            ("\"a;b\",1,2\nc,3,4\n", b','),
            ("\n\na|b\r\n1|2\r\n", b'|'),
            ("12\n13\n", b','),
            ("", b','),
        ] {
            assert_eq!(separator(text.as_bytes()), wanted, "{text:?}");
        }
    }
}
