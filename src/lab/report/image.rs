//! Small images as PNG data URIs, and the mean pooling that makes large ones small.

use super::colour::Palette;

/// A rectangle of numbers, row-major.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Grid {
    pub height: usize,
    pub width: usize,
    pub values: Vec<f64>,
}

/// Means of blocks of whole cells, so that no side is longer than `side`. Blocks at the far edges may be smaller.
pub(super) fn pool(levels: &[u16], rows: usize, columns: usize, side: usize) -> Option<Grid> {
    if rows == 0 || columns == 0 || levels.len() != rows * columns {
        return None;
    }
    let (down, across) = (rows.div_ceil(side), columns.div_ceil(side));
    let (height, width) = (rows.div_ceil(down), columns.div_ceil(across));
    let mut values = Vec::with_capacity(height * width);
    for y in 0..height {
        for x in 0..width {
            let block_rows = y * down..rows.min((y + 1) * down);
            let block_columns = x * across..columns.min((x + 1) * across);
            let cells = block_rows.len() * block_columns.len();
            let sum: u64 = block_rows
                .flat_map(|row| &levels[row * columns..][block_columns.clone()])
                .map(|&level| u64::from(level))
                .sum();
            values.push(sum as f64 / cells as f64);
        }
    }
    Some(Grid { height, width, values })
}

/// An image of palette indices.
pub(super) fn indexed(
    width: usize,
    height: usize,
    indices: &[u8],
    palette: &Palette,
) -> Option<String> {
    let colours = palette.iter().flat_map(|c| [c[0], c[1], c[2]]).collect::<Vec<u8>>();
    let alphas = palette.iter().map(|c| c[3]).collect::<Vec<u8>>();
    encode(width, height, indices, |encoder| {
        encoder.set_color(png::ColorType::Indexed);
        encoder.set_palette(colours);
        if alphas.iter().any(|&alpha| alpha < 255) {
            encoder.set_trns(alphas);
        }
    })
    .map(|file| uri(&file))
}

/// A grey image.
pub(super) fn grey(width: usize, height: usize, values: &[u8]) -> Option<String> {
    encode(width, height, values, |encoder| encoder.set_color(png::ColorType::Grayscale))
        .map(|file| uri(&file))
}

/// A colour image, three bytes a pixel.
pub(super) fn rgb(width: usize, height: usize, values: &[u8]) -> Option<String> {
    encode(width, height, values, |encoder| encoder.set_color(png::ColorType::Rgb))
        .map(|file| uri(&file))
}

fn encode(
    width: usize,
    height: usize,
    bytes: &[u8],
    setup: impl FnOnce(&mut png::Encoder<'_, &mut Vec<u8>>),
) -> Option<Vec<u8>> {
    let mut file = Vec::new();
    let (wide, high) = (u32::try_from(width).ok()?, u32::try_from(height).ok()?);
    let mut encoder = png::Encoder::new(&mut file, wide, high);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_compression(png::Compression::High);
    setup(&mut encoder);
    let mut writer = encoder.write_header().ok()?;
    writer.write_image_data(bytes).ok()?;
    writer.finish().ok()?;
    Some(file)
}

fn uri(file: &[u8]) -> String {
    format!("data:image/png;base64,{}", base64(file))
}

/// RFC 4648, with padding.
fn base64(bytes: &[u8]) -> String {
    const DIGITS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut out = String::with_capacity(bytes.len().div_ceil(3) * 4);
    for chunk in bytes.chunks(3) {
        let word = (0..3).fold(0u32, |word, i| word << 8 | chunk.get(i).map_or(0, |&b| b.into()));
        for digit in 0..4 {
            let index = (word >> (18 - 6 * digit)) & 63;
            out.push(if digit > chunk.len() { '=' } else { DIGITS[index as usize].into() });
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn base64_matches_the_vectors_of_the_standard() {
        let cases = ["", "f", "fo", "foo", "foob", "fooba", "foobar"];
        let wanted = ["", "Zg==", "Zm8=", "Zm9v", "Zm9vYg==", "Zm9vYmE=", "Zm9vYmFy"];
        assert_eq!(cases.map(|text| base64(text.as_bytes())), wanted);
    }

    #[test]
    fn pooling_means_blocks_and_keeps_small_grids() {
        let grid = pool(&[1, 3, 5, 7, 9, 11], 2, 3, 2).unwrap();
        assert_eq!((grid.height, grid.width, grid.values), (2, 2, vec![2.0, 5.0, 8.0, 11.0]));
        assert_eq!(pool(&[4, 6], 1, 2, 400).unwrap().values, [4.0, 6.0]);
        assert_eq!((pool(&[], 0, 3, 2), pool(&[1], 2, 2, 2)), (None, None));
    }

    #[test]
    fn what_is_encoded_decodes_to_the_same_pixels() {
        let file = encode(2, 1, &[7, 200], |e| e.set_color(png::ColorType::Grayscale)).unwrap();
        let mut reader = png::Decoder::new(std::io::Cursor::new(file)).read_info().unwrap();
        let mut pixels = [0; 2];
        reader.next_frame(&mut pixels).unwrap();
        assert_eq!(pixels, [7, 200]);
        assert!(grey(2, 1, &[7, 200]).unwrap().starts_with("data:image/png;base64,iVBORw0KGgo"));
        assert_eq!((grey(0, 1, &[]), grey(2, 2, &[1])), (None, None));
    }
}
