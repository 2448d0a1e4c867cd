//! Colours. Pathways use the Okabe-Ito set, blues for excitation and oranges for inhibition; the page's style
//! sheet holds the values, lighter ones for dark mode. Levels use a map of steadily rising lightness.

/// Colours of curves: apart for every kind of colour vision, on white and on black (Okabe and Ito).
pub(super) const HUES: [&str; 8] = [
    "var(--d)",
    "var(--e)",
    "var(--a)",
    "var(--b)",
    "var(--nn)",
    "var(--f)",
    "var(--c)",
    "var(--ink)",
];

/// The colour of a curve.
pub(super) fn hue(number: usize) -> &'static str {
    HUES[number % HUES.len()]
}

/// The same text with each colour of the style sheet as it is on white, for what stands alone.
pub(super) fn on_white(text: &str) -> String {
    let mut parts = text.split("var(--");
    let mut out = parts.next().unwrap_or_default().to_owned();
    for part in parts {
        let known = part.split_once(')').and_then(|(name, rest)| Some((light(name)?, rest)));
        match known {
            Some((colour, rest)) => out.extend([colour, rest]),
            None => out.extend(["var(--", part]),
        }
    }
    out
}

/// What the style sheet says of a colour on white.
fn light(name: &str) -> Option<&'static str> {
    let (_, rest) = SHEET.split_once(&format!("--{name}:light-dark("))?;
    Some(rest.split_once(',')?.0)
}

/// The one place of colours: `--name:light-dark(on white,on black)`.
const SHEET: &str = include_str!("page.css");

/// A 256-entry table of red, green, blue, alpha.
pub(super) type Palette = [[u8; 4]; 256];

/// The style-sheet colour of a pathway.
pub(super) fn pathway(name: &str, excites: bool) -> &'static str {
    match (name, excites) {
        ("pp" | "e", _) => "var(--pp)",
        ("np" | "i", _) => "var(--np)",
        ("nn", _) => "var(--nn)",
        ("pn", _) => "var(--pn)",
        (_, true) => "var(--pp)",
        (_, false) => "var(--np)",
    }
}

/// Whether the pathway's line is dashed: its target is the n stream.
pub(super) fn dashed(name: &str) -> bool {
    name.trim_end_matches("_i").ends_with('n')
}

/// Dark violet through green to yellow: anchors at equal steps of lightness, straight lines between.
const ANCHORS: [[f64; 3]; 10] = [
    [68.0, 1.0, 84.0],
    [72.0, 40.0, 120.0],
    [62.0, 74.0, 137.0],
    [49.0, 104.0, 142.0],
    [38.0, 130.0, 142.0],
    [31.0, 158.0, 137.0],
    [53.0, 183.0, 121.0],
    [110.0, 206.0, 88.0],
    [181.0, 222.0, 43.0],
    [253.0, 231.0, 37.0],
];

/// The map of levels.
pub(super) fn levels() -> Palette {
    std::array::from_fn(|i| {
        let along = i as f64 / 255.0 * (ANCHORS.len() - 1) as f64;
        let from = (along as usize).min(ANCHORS.len() - 2);
        let part = along - from as f64;
        let mix = |channel: usize| {
            byte(ANCHORS[from][channel] * (1.0 - part) + ANCHORS[from + 1][channel] * part)
        };
        [mix(0), mix(1), mix(2), 255]
    })
}

/// Sixteen steps of it, as words.
pub(super) fn ramp() -> Vec<String> {
    let word = |[red, green, blue, _]: &[u8; 4]| format!("#{red:02x}{green:02x}{blue:02x}");
    levels().iter().step_by(17).map(word).collect()
}

/// The place in [`shares`] of a share, 0 to 1: clear at 0, then logarithmic from 0.01 % on.
pub(super) fn share_index(share: f64) -> u8 {
    if share <= 0.0 {
        return 0;
    }
    let along = 1.0 + share.clamp(SHARE_MIN, 1.0).log10() / -SHARE_MIN.log10();
    byte(1.0 + 254.0 * along)
}

/// Where the scale of shares begins; what is rarer looks the same.
const SHARE_MIN: f64 = 1e-4;

/// The map of levels, clear where there is nothing.
pub(super) fn shares() -> Palette {
    let mut palette = levels();
    palette[0] = [255, 255, 255, 0];
    palette
}

const EXCITES: [u8; 3] = [20, 134, 212];
const INHIBITS: [u8; 3] = [222, 98, 8];

/// Orange below 128, clear at 128, blue above: it shows the page through where there is nothing.
pub(super) fn signed() -> Palette {
    std::array::from_fn(|i| {
        let away = (i as f64 - 128.0) / 127.0;
        let [red, green, blue] = if away < 0.0 { INHIBITS } else { EXCITES };
        [red, green, blue, byte(255.0 * away.abs().min(1.0))]
    })
}

/// The place in [`signed`] of a value between -1 and 1.
pub(super) fn signed_index(value: f64) -> u8 {
    byte(128.0 + 127.0 * value.clamp(-1.0, 1.0))
}

/// Clear to blue (0 to 127), then clear to orange (128 to 255): right answers and wrong ones.
pub(super) fn answers() -> Palette {
    std::array::from_fn(|i| {
        let [red, green, blue] = if i < 128 { EXCITES } else { INHIBITS };
        [red, green, blue, byte((i % 128) as f64 / 127.0 * 255.0)]
    })
}

/// Rounds into a byte.
pub(super) fn byte(value: f64) -> u8 {
    // A float-to-integer cast saturates and sends NaN to 0.
    value.round() as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lightness_rises_all_along_the_map_of_levels() {
        let light = |c: [u8; 4]| {
            0.2126 * f64::from(c[0]) + 0.7152 * f64::from(c[1]) + 0.0722 * f64::from(c[2])
        };
        let map = levels();
        assert!(map.windows(2).all(|pair| light(pair[1]) >= light(pair[0]) - 0.8));
        assert_eq!((map[0], map[255]), ([68, 1, 84, 255], [253, 231, 37, 255]));
    }

    #[test]
    fn every_colour_of_curves_and_charts_is_known_on_white() {
        for text in HUES.into_iter().chain([include_str!("chart.css")]) {
            assert!(!on_white(text).contains("var("), "{text}");
        }
        assert_eq!(
            on_white("fill:var(--pp);var(--unknown) var(--"),
            "fill:#0072b2;var(--unknown) var(--"
        );
        assert_eq!((ramp().len(), ramp()[15].as_str()), (16, "#fde725"));
    }

    #[test]
    fn shares_are_clear_at_nothing_and_logarithmic_above() {
        assert_eq!([0.0, 1e-9, 1e-4, 0.01, 1.0].map(share_index), [0, 1, 1, 128, 255]);
        assert_eq!((shares()[0][3], shares()[1][3]), (0, 255));
    }

    #[test]
    fn signed_map_is_clear_in_the_middle() {
        assert_eq!(signed()[usize::from(signed_index(0.0))][3], 0);
        assert_eq!(signed()[usize::from(signed_index(2.0))][3], 255);
        assert!(signed()[usize::from(signed_index(-2.0))][3] >= 254);
    }
}
