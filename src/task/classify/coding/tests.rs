//! Codings against plain second versions of their laws.

use super::*;

/// Bytes without a pattern.
fn noise(count: usize, seed: u64) -> Vec<u8> {
    let mut state = seed;
    let next = || {
        state =
            state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 56) as u8
    };
    std::iter::repeat_with(next).take(count).collect()
}

fn set(values: Vec<u8>, features: usize, scale: u8) -> Examples {
    let labels = vec![0; values.len() / features];
    Examples::new(values, labels, features, scale, 2).unwrap()
}

fn coded(coding: Coding, set: &Examples, bits: i64) -> Vec<Vec<u8>> {
    let mut coder = coding.of(set, DriveBits::new(bits).unwrap());
    let each = (0..set.len()).map(|example| {
        // what stood there stays
        let mut out = vec![9];
        coder.code(set.values(example), &mut out);
        assert_eq!(out.remove(0), 9);
        out
    });
    each.collect()
}

#[test]
fn pixels_lie_channels_last_and_values_as_they_were() {
    let image = [2, 3, 2];
    let one = set((0..12).collect(), 12, 15);
    let code = |x: u8| 17 * x;
    assert_eq!(coded(Coding::Values, &one, 8), [(0..12).map(code).collect::<Vec<_>>()]);
    let wanted: Vec<u8> = (0..6).flat_map(|pixel| [code(pixel), code(pixel + 6)]).collect();
    assert_eq!(coded(Coding::Pixels { image }, &one, 8), [wanted]);
}

#[test]
fn above_and_below_the_mean_are_what_the_law_says() {
    for (bits, scale) in [(8, 255), (8, 16), (4, 255), (1, 16)] {
        let image = [3, 5, 3];
        let values: Vec<u8> =
            noise(45 * 20, 3).into_iter().map(|x| x.min(127) % (scale.min(127) + 1)).collect();
        let all = set(values, 45, scale);
        let code_max = (1u64 << bits) - 1;
        let plane = |example: usize, channel: usize| &all.values(example)[15 * channel..][..15];
        let found = coded(Coding::OnOff { image }, &all, bits);
        for channel in 0..3 {
            let (mut sum, mut n) = (0, 0);
            for example in 0..all.len() {
                for &x in plane(example, channel) {
                    (sum, n) = (sum + u64::from(x), n + 1);
                }
            }
            let middle = (2 * sum + n) / (2 * n);
            assert!(middle > 0 && middle < u64::from(scale));
            for (example, codes) in found.iter().enumerate() {
                for (pixel, &x) in plane(example, channel).iter().enumerate() {
                    let x = u64::from(x);
                    let law = |d: u64, r: u64| {
                        let value = (2 * d * 255 + r) / (2 * r);
                        (2 * value * code_max + 255) / 510
                    };
                    let wanted = [
                        law(x.saturating_sub(middle), u64::from(scale) - middle),
                        law(middle.saturating_sub(x), middle),
                    ];
                    let at = 6 * pixel + channel;
                    assert_eq!([codes[at], codes[at + 3]].map(u64::from), wanted);
                }
            }
        }
    }
}

#[test]
fn a_channel_that_never_changes_has_codes_of_nothing() {
    for (value, other) in [(0u8, 255u8), (255, 0)] {
        let image = [1, 2, 1];
        let codes = coded(Coding::OnOff { image }, &set(vec![value; 6], 2, 255), 8);
        assert_eq!(codes, vec![vec![0; 4]; 3]);
        // another value than all of the training part is the greatest difference there is
        let sides = super::sides(value, 255);
        assert_eq!(sides.map(|side| side[usize::from(other)]).iter().max(), Some(&255));
    }
    let none = Examples::new(vec![], vec![], 2, 9, 2).unwrap();
    assert_eq!(super::middles(&none, 2, 1), [4]);
}

/// The law of `white` as it is written, pixel by pixel.
fn white(values: &[u8], [height, width]: [usize; 2], scale: u8, bits: u32) -> Vec<u8> {
    let eight = |x: u8| (2 * i64::from(x) * 255 + i64::from(scale)) / (2 * i64::from(scale));
    let n = values.len() as i64;
    let (mut s1, mut s2) = (0i64, 0i64);
    for &x in values {
        (s1, s2) = (s1 + eight(x), s2 + eight(x) * eight(x));
    }
    let mut root = 0i64;
    while (root + 1) * (root + 1) <= n * s2 - s1 * s1 {
        root += 1;
    }
    let d = root + 8 * n;
    let t = |x: u8| (256 * (n * eight(x) - s1) + d).div_euclid(2 * d);
    let mut out = vec![];
    for y in 0..height {
        for x in 0..width {
            let f = white::FILTER.map(|colours| {
                let mut sum = 0i64;
                for (colour, factors) in colours.iter().enumerate() {
                    for (at, &factor) in factors.iter().enumerate() {
                        let (v, u) = (y + at / 5, x + at % 5);
                        if (2..height + 2).contains(&v) && (2..width + 2).contains(&u) {
                            let place = (colour * height + v - 2) * width + u - 2;
                            sum += i64::from(factor) * t(values[place]);
                        }
                    }
                }
                sum
            });
            let round = |v: i64| ((v + (1 << 13)) >> 14).clamp(0, 255);
            let drive = |a: i64| ((2 * a * ((1 << bits) - 1) + 255) / 510) as u8;
            out.extend(f.map(|f| drive(round(f))));
            out.extend(f.map(|f| drive(round(-f))));
        }
    }
    out
}

#[test]
fn whitened_images_are_what_the_law_says() {
    for ([height, width], scale, bits) in
        [([7, 9], 255, 8), ([1, 1], 255, 8), ([5, 16], 16, 8), ([3, 17], 255, 3), ([6, 33], 255, 8)]
    {
        let features = 3 * height * width;
        let mut values: Vec<u8> = noise(features * 4, 11);
        // a gentle image, one of two values, and a flat one
        for (at, value) in values.iter_mut().enumerate() {
            match at / features {
                0 => *value = (*value >> 3) + (at % width) as u8,
                1 => *value = 255 * (*value >> 7),
                2 => *value = 77,
                _ => {}
            }
            *value = u8::try_from(u32::from(*value) * u32::from(scale) / 255).unwrap();
        }
        let all = set(values, features, scale);
        let coding = Coding::White { image: [height, width, 3] };
        let found = coded(coding, &all, bits);
        for (example, codes) in found.iter().enumerate() {
            let wanted = white(all.values(example), [height, width], scale, bits as u32);
            assert_eq!(*codes, wanted, "{height} x {width}, example {example}");
        }
        assert!(found[2].iter().all(|&code| code == 0), "a flat image has no edges");
    }
}

/// One bright value in black: as far from the mean as a value can be, through the greatest taps.
#[test]
fn the_bounds_of_a_filtered_value_hold() {
    let greatest = white::FILTER.iter().map(|colours| {
        colours.iter().flatten().map(|&factor| u64::from(factor.unsigned_abs())).sum::<u64>()
    });
    let greatest = greatest.max().expect("there are taps");
    assert_eq!(greatest, 96_468);
    assert!(greatest * 4080 < 1 << 31);
    let (height, width) = (40, 40);
    let mut values = vec![0; 3 * height * width];
    for colour in 0..3 {
        values[colour * height * width + 20 * width + 20] = 255;
    }
    let all = set(values, 3 * height * width, 255);
    let found = coded(Coding::White { image: [height, width, 3] }, &all, 8);
    assert_eq!(found[0], white(all.values(0), [height, width], 255, 8));
    assert_eq!(found[0].iter().max(), Some(&255));
}

#[test]
fn a_coding_fits_its_layer_or_is_refused() {
    let white = Coding::White { image: [4, 4, 3] };
    assert_eq!((white.rows(48), white.features(96)), (96, 48));
    assert!(white.check(96).is_ok());
    assert!(Coding::Values.check(7).is_ok());
    let refused = |coding: Coding, rows| coding.check(rows).unwrap_err();
    assert_eq!(refused(white, 48).key(), "network.input");
    let grey = refused(Coding::White { image: [4, 4, 1] }, 96).to_string();
    assert!(grey.contains("of 1 channels") && grey.contains("\"on_off\""), "{grey}");
    let huge = Coding::Pixels { image: [usize::MAX, 2, 1] };
    assert_eq!(refused(huge, usize::MAX).key(), "network.input");
}
