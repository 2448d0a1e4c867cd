//! CIFAR-10 out of a package that holds it as pictures: back to the authors' records.
//!
//! ```text
//! picture:  10,000 rows, each one image: 1,024 pixels of red, green, blue, row-major
//! record:   label, 1,024 red, 1,024 green, 1,024 blue
//! ```
//!
//! The MD5 of the records is the authors' own, so a pixel that went another way does not pass.

use std::io::{BufRead, Cursor, Read, Seek};

use flate2::read::MultiGzDecoder;

use super::{FetchError, archive, stage::Stage};
use crate::lab::data::{catalog::CIFAR_RECORD, error::DataError, inflate::read_up_to};

const IMAGES: usize = 10_000;
const PIXELS: usize = 1_024;
/// Greatest size of a file of the package; the pictures have 23 MB.
const FILE_BYTES_MAX: u64 = 1 << 26;

/// Converts and puts in place every wanted batch; `first` and `second` read the same archive.
pub(super) fn install(
    stage: &mut Stage<'_>,
    place: &str,
    first: impl Read,
    second: impl Read,
) -> Result<(), DataError> {
    // The spelling is the package's.
    let (mut train, mut test) = (Vec::new(), Vec::new());
    each_file(place, first, |name, bytes| {
        match name {
            "train_lables.json" => train = labels(name, bytes, 5 * IMAGES)?,
            "test_lables.json" => test = labels(name, bytes, IMAGES)?,
            _ => {}
        }
        Ok(())
    })?;
    let batches: Vec<&[u8]> = train.chunks_exact(IMAGES).chain(test.chunks_exact(IMAGES)).collect();
    let files = stage.entry.files;
    each_file(place, second, |name, bytes| {
        let wanted = stage.wanted();
        let stem = name.strip_suffix(".png").map(|stem| format!("{stem}.bin"));
        let at = files.iter().position(|file| stem.as_deref() == Some(file.name));
        let batch = at.and_then(|at| Some((&files[at], *batches.get(at)?)));
        match batch.filter(|(file, _)| wanted.iter().any(|w| w.name == file.name)) {
            Some((file, labels)) => {
                let records = records(name, Cursor::new(bytes), labels)?;
                stage.install(file, &mut &records[..])
            }
            None => Ok(()),
        }
    })?;
    archive::complete(stage, place)
}

/// Calls `act` with the name and content of every file that may matter.
fn each_file(
    place: &str,
    source: impl Read,
    mut act: impl FnMut(&str, &[u8]) -> Result<(), DataError>,
) -> Result<(), DataError> {
    let broken = |e: std::io::Error| picture(place, format!("breaks off: {e}"));
    let mut archive = tar::Archive::new(MultiGzDecoder::new(source));
    for entry in archive.entries().map_err(broken)? {
        let mut entry = entry.map_err(broken)?;
        let name = entry.path().ok().and_then(|p| Some(p.file_name()?.to_str()?.to_owned()));
        let Some(name) = name.filter(|n| n.ends_with("_lables.json") || n.ends_with(".png")) else {
            continue;
        };
        let bytes = read_up_to(&mut entry, FILE_BYTES_MAX).map_err(broken)?;
        act(&name, &bytes)?;
    }
    Ok(())
}

fn picture(file: &str, found: String) -> DataError {
    FetchError::Picture { file: file.to_owned(), found }.into()
}

fn labels(name: &str, bytes: &[u8], wanted: usize) -> Result<Vec<u8>, DataError> {
    let labels: Vec<u8> =
        serde_json::from_slice(bytes).map_err(|e| picture(name, format!("is no list: {e}")))?;
    if labels.len() == wanted {
        Ok(labels)
    } else {
        Err(picture(name, format!("has {} labels in place of {wanted}", labels.len())))
    }
}

/// The records of one picture.
fn records(name: &str, source: impl BufRead + Seek, labels: &[u8]) -> Result<Vec<u8>, DataError> {
    let broken = |e: png::DecodingError| picture(name, format!("is no PNG: {e}"));
    let mut reader = png::Decoder::new(source).read_info().map_err(broken)?;
    let kind = (reader.info().size(), reader.output_color_type());
    if kind != ((1_024, 10_000), (png::ColorType::Rgb, png::BitDepth::Eight)) {
        return Err(picture(name, format!("is {kind:?} in place of 1024 x 10000, 8-bit RGB")));
    }
    let mut rows = vec![0; IMAGES * PIXELS * 3];
    reader.next_frame(&mut rows).map_err(broken)?;
    let mut records = Vec::with_capacity(IMAGES * CIFAR_RECORD);
    for (row, &label) in rows.chunks_exact(PIXELS * 3).zip(labels) {
        records.push(label);
        records.extend(planes(row));
    }
    Ok(records)
}

/// All red, then all green, then all blue of pixels whose colours stand side by side.
fn planes(row: &[u8]) -> impl Iterator<Item = u8> {
    (0..3).flat_map(|plane| row.iter().skip(plane).step_by(3)).copied()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colours_are_put_plane_after_plane() {
        assert!(planes(&[1, 2, 3, 4, 5, 6]).eq([1, 4, 2, 5, 3, 6]));
    }

    #[test]
    fn another_picture_or_another_number_of_labels_is_an_error() {
        let mut small = Vec::new();
        let mut encoder = png::Encoder::new(&mut small, 2, 2);
        encoder.set_color(png::ColorType::Rgb);
        encoder.write_header().unwrap().write_image_data(&[0; 12]).unwrap();
        let refused =
            |bytes: &[u8]| records("a.png", Cursor::new(bytes), &[0]).unwrap_err().to_string();
        assert!(
            refused(&small).contains("a.png is ((2, 2), (Rgb, Eight)) in place of 1024 x 10000")
        );
        assert!(refused(b"GIF89a").contains("a.png is no PNG"));
        let refused = |text: &str| labels("l", text.as_bytes(), 2).unwrap_err().to_string();
        assert_eq!(labels("l", b"[1, 2]", 2).unwrap(), [1, 2]);
        assert!(refused("[1,2,3]").contains("has 3 labels in place of 2"));
        assert!(refused("[1,256]").contains("is no list"));
    }
}
