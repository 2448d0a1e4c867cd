//! Training images that are moved and mirrored, each time they are shown by other draws.
//!
//! ```text
//! flip    left and right are exchanged where the sample's word of sub 1 is 2^31 or more
//! shift   right and down by two words of sub 0 a sample, each evenly in -pixels ..= pixels;  what comes in is 0
//! ```
//!
//! Words are those of site 10, count = epoch, in the order in which samples are learnt from. An image is mirrored first. See
//! docs/MODEL.md, 1.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use super::experiment::Augment;
use crate::num::draw::{Place, Site, below};

/// What becomes of the images of an epoch, one after the other.
pub(super) struct Moves {
    way: Augment,
    shifts: Box<dyn Iterator<Item = u32>>,
    flips: Box<dyn Iterator<Item = u32>>,
}

impl Moves {
    pub(super) fn of(way: Augment, seed: u64, epoch: u32) -> Self {
        let shifts = Place::global(seed, Site::Augment, u64::from(epoch));
        let flips = Place { sub: 1, ..shifts };
        Self { way, shifts: Box::new(shifts.words()), flips: Box::new(flips.words()) }
    }

    /// Puts the next image there, moved. Images lie plane by plane.
    pub(super) fn next_of(&mut self, values: &[u8], out: &mut Vec<u8>) {
        let Augment { pixels, height, width, channels, flip } = self.way;
        let flipped = flip && self.is_flipped();
        let by = if pixels > 0 { self.shift() } else { [0; 2] };
        out.clear();
        if by == [0; 2] && !flipped {
            out.extend_from_slice(values);
            return;
        }
        for plane in values.chunks_exact(height * width).take(channels) {
            shift_into(plane, [height, width], by, flipped, out);
        }
    }

    fn is_flipped(&mut self) -> bool {
        below(self.flips.next().expect("the stream has no end"), 2) == 1
    }

    /// Right and down.
    fn shift(&mut self) -> [i64; 2] {
        let pixels = self.way.pixels;
        [(); 2].map(|()| {
            let word = self.shifts.next().expect("the stream has no end");
            i64::from(below(word, 2 * pixels + 1)) - i64::from(pixels)
        })
    }
}

/// Appends a plane, mirrored or not and moved by `[right, down]` pixels; what comes in from outside is 0.
fn shift_into(
    plane: &[u8],
    [height, width]: [usize; 2],
    [right, down]: [i64; 2],
    flipped: bool,
    out: &mut Vec<u8>,
) {
    let inside = |at: i64, size: usize| usize::try_from(at).ok().filter(|&at| at < size);
    for y in 0..height {
        let from_row = inside(y as i64 - down, height);
        for x in 0..width {
            let from = from_row.zip(inside(x as i64 - right, width));
            out.push(
                from.map_or(0, |(y, x)| plane[y * width + if flipped { width - 1 - x } else { x }]),
            );
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const WAY: Augment = Augment { pixels: 1, height: 2, width: 3, channels: 1, flip: false };

    #[test]
    fn an_image_moves_right_and_down_and_loses_its_edge() {
        let mut out = Vec::new();
        shift_into(&[1, 2, 3, 4, 5, 6], [2, 3], [1, 0], false, &mut out);
        shift_into(&[1, 2, 3, 4, 5, 6], [2, 3], [0, -1], false, &mut out);
        // mirrored first, then moved
        shift_into(&[1, 2, 3, 4, 5, 6], [2, 3], [1, 0], true, &mut out);
        assert_eq!(out, [0, 1, 2, 0, 4, 5, 4, 5, 6, 0, 0, 0, 0, 3, 2, 0, 6, 5]);
    }

    #[test]
    fn shifts_stay_within_their_pixels_and_use_all_of_them() {
        let mut moves = Moves::of(WAY, 1, 0);
        let some: Vec<_> = (0..500).flat_map(|_| moves.shift()).collect();
        assert!((-1..=1).all(|by| some.contains(&by)) && some.iter().all(|by| by.abs() <= 1));
    }

    /// Mirror images are drawn beside shifts: a run that has none keeps its shifts.
    #[test]
    fn half_of_all_images_are_mirrored_and_shifts_are_those_of_a_run_without() {
        let way = Augment { flip: true, channels: 2, ..WAY };
        let image: Vec<u8> = (1..=12).collect();
        let (mut plain, mut mirrored) = (Moves::of(WAY, 7, 3), Moves::of(way, 7, 3));
        let (mut out, mut flips) = (vec![], 0);
        for _ in 0..400 {
            let by = plain.shift();
            let mut wanted = [vec![], vec![]];
            for (wanted, flipped) in wanted.iter_mut().zip([false, true]) {
                for plane in image.chunks_exact(6) {
                    shift_into(plane, [2, 3], by, flipped, wanted);
                }
            }
            mirrored.next_of(&image, &mut out);
            assert!(wanted.contains(&out));
            flips += u32::from(out == wanted[1] && wanted[0] != wanted[1]);
        }
        assert!((160..=240).contains(&flips), "{flips}");
        // without shifts an image is itself or its mirror image
        let still = Augment { pixels: 0, ..way };
        let mut moves = Moves::of(still, 7, 3);
        moves.next_of(&image, &mut out);
        assert!(out == image || out[..3] == [3, 2, 1]);
    }
}
