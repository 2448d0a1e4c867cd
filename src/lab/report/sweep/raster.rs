//! SVG to PNG, with letters of our own, so that a figure looks the same on a machine without fonts.

use resvg::tiny_skia::{Color, Pixmap, Transform};
use resvg::usvg::{Options, Tree};

/// Dots for each unit that the SVG's size is in, a ninety-sixth of an inch: about 300 dots an inch.
const SCALE: f32 = 3.125;
/// Dots along a side at most.
const SIDE_MAX: f32 = 16_384.0;

/// A PNG of a figure that [`super::figures`] drew; empty if the text is no SVG or has no size.
#[must_use]
pub fn png(svg: &str) -> Vec<u8> {
    draw(svg).unwrap_or_default()
}

fn draw(svg: &str) -> Option<Vec<u8>> {
    let mut options = Options::default();
    let letters = options.fontdb_mut();
    letters.load_font_data(notosans::REGULAR_TTF.to_vec());
    letters.load_font_data(notosans::BOLD_TTF.to_vec());
    letters.set_sans_serif_family("Noto Sans");
    let tree = Tree::from_str(svg, &options).ok()?;
    let [width, height] =
        [tree.size().width(), tree.size().height()].map(|side| (side * SCALE).ceil());
    if width.max(height) > SIDE_MAX {
        return None;
    }
    let mut dots = Pixmap::new(width as u32, height as u32)?;
    dots.fill(Color::WHITE);
    resvg::render(&tree, Transform::from_scale(SCALE, SCALE), &mut dots.as_mut());
    // White lies under everything, so nothing is clear.
    let colours: Vec<u8> =
        dots.data().chunks_exact(4).flat_map(|dot| [dot[0], dot[1], dot[2]]).collect();
    let mut file = Vec::new();
    let mut encoder = png::Encoder::new(&mut file, dots.width(), dots.height());
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    let mut writer = encoder.write_header().ok()?;
    writer.write_image_data(&colours).ok()?;
    writer.finish().ok()?;
    Some(file)
}
