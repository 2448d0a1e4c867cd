//! Numbers and text as people read them. Quotients exist only where there is something to divide by.

/// Counts as floats: a report needs a few digits, not all 64 bits.
pub(super) fn float(count: u64) -> f64 {
    count as f64
}

/// The same for sizes.
pub(super) fn size(count: usize) -> f64 {
    count as f64
}

/// `part / whole`, if there is a whole.
pub(super) fn quotient(part: u64, whole: u64) -> Option<f64> {
    (whole != 0).then(|| float(part) / float(whole))
}

/// `97.31 %`, with the digits asked for.
pub(super) fn percent(fraction: f64, digits: usize) -> String {
    format!("{:.digits$}\u{202f}%", 100.0 * fraction)
}

/// A percentage, or a dash where there is nothing to divide by.
pub(super) fn percent_of(part: u64, whole: u64, digits: usize) -> String {
    quotient(part, whole).map_or_else(|| "–".into(), |fraction| percent(fraction, digits))
}

/// A share with one decimal, as markup; what would round to 0 but is not says so.
pub(super) fn share(fraction: f64) -> String {
    if fraction > 0.0 && fraction < 0.0005 {
        return "&lt;\u{202f}0.1\u{202f}%".into();
    }
    percent(fraction, 1)
}

/// Three significant digits of a ratio, or a dash.
pub(super) fn ratio(value: Option<f64>) -> String {
    match value {
        None => "–".into(),
        Some(value) if value >= 100.0 => format!("{value:.0}"),
        Some(value) if value >= 10.0 => format!("{value:.1}"),
        Some(value) => format!("{value:.2}"),
    }
}

/// Six significant digits at most, and no zeros behind them.
pub(super) fn significant(value: f64) -> String {
    if value == 0.0 || !value.is_finite() {
        return if value == 0.0 { "0".into() } else { "–".into() };
    }
    let power = value.abs().log10().floor();
    if !(-5.0..15.0).contains(&power) {
        let text = format!("{value:.3e}");
        let (digits, power) = text.split_once('e').unwrap_or((&text, "0"));
        return format!("{}e{power}", digits.trim_end_matches('0').trim_end_matches('.'));
    }
    let decimals = (5.0 - power).max(0.0) as usize;
    let text = format!("{value:.decimals$}");
    let text = if decimals > 0 { text.trim_end_matches('0').trim_end_matches('.') } else { &text };
    text.replace('-', "\u{2212}")
}

/// All digits, in groups of three: `1 234 567`.
pub(super) fn count(count: u64) -> String {
    let digits = count.to_string();
    let mut out = String::with_capacity(2 * digits.len());
    for (i, digit) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i).is_multiple_of(3) {
            out.push('\u{202f}');
        }
        out.push(digit);
    }
    out
}

/// Three significant digits and a unit prefix, `gap` between them: `12.3 M`. Exact below 10 000.
pub(super) fn short_with(count: u64, gap: &str) -> String {
    if count < 10_000 {
        return count.to_string();
    }
    let mut value = float(count);
    let mut prefix = "";
    for next in ["k", "M", "G", "T", "P", "E"] {
        // 999.5 and more would print as 1000.
        if value < 999.5 {
            break;
        }
        value /= 1000.0;
        prefix = next;
    }
    let digits = if value < 9.995 {
        2
    } else if value < 99.95 {
        1
    } else {
        0
    };
    format!("{value:.digits$}{gap}{prefix}")
}

/// [`short_with`] a narrow gap.
pub(super) fn short(count: u64) -> String {
    short_with(count, "\u{202f}")
}

/// Wall-clock time in the two units that matter.
pub(super) fn seconds(seconds: f64) -> String {
    if !seconds.is_finite() || seconds < 0.0 {
        return "–".into();
    }
    if seconds < 1.0 {
        return format!("{:.0}\u{202f}ms", seconds * 1000.0);
    }
    if seconds < 99.95 {
        return format!("{seconds:.1}\u{202f}s");
    }
    let minutes = (seconds / 60.0).floor();
    if minutes < 100.0 {
        return format!(
            "{minutes:.0}\u{202f}min {:.0}\u{202f}s",
            (seconds - 60.0 * minutes).floor()
        );
    }
    format!("{:.0}\u{202f}h {:.0}\u{202f}min", (minutes / 60.0).floor(), minutes % 60.0)
}

/// A coordinate in a drawing: at most one decimal, never `NaN`.
pub(super) fn place(value: f64) -> String {
    if !value.is_finite() {
        return "0".into();
    }
    let text = format!("{value:.1}");
    match text.strip_suffix(".0") {
        Some("-0") => "0".into(),
        Some(whole) => whole.into(),
        None => text,
    }
}

/// Text made safe for elements and quoted attributes. Characters XML forbids become a replacement mark.
pub(super) fn escape(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for character in text.chars() {
        match character {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            '\'' => out.push_str("&#39;"),
            '\n' | '\t' => out.push(character),
            character if character.is_control() => out.push('\u{fffd}'),
            character => out.push(character),
        }
    }
    out
}

/// The first twelve characters of a hash.
pub(super) fn hash_head(hash: &str) -> String {
    hash.chars().take(12).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_keep_their_digits_and_short_forms_three_of_them() {
        assert_eq!(count(0), "0");
        assert_eq!(count(1_234_567), "1\u{202f}234\u{202f}567");
        let cases = [
            (9_999, "9999"),
            (10_000, "10.0 k"),
            (99_949, "99.9 k"),
            (99_950, "100 k"),
            (999_499, "999 k"),
            (999_500, "1.00 M"),
            (12_345_678, "12.3 M"),
            (u64::MAX, "18.4 E"),
        ];
        for (value, text) in cases {
            assert_eq!(short_with(value, " "), text);
        }
    }

    #[test]
    fn significant_digits_are_six_and_no_zeros_trail() {
        let cases = [
            (0.0, "0"),
            (1200.0, "1200"),
            (0.1 + 0.2, "0.3"),
            (-2.5, "\u{2212}2.5"),
            (0.000_123_456_78, "0.000123457"),
            (1e-7, "1e-7"),
            (1e20, "1e20"),
        ];
        for (value, text) in cases {
            assert_eq!(significant(value), text);
        }
    }

    #[test]
    fn nothing_divided_by_nothing_is_a_dash() {
        assert_eq!(percent_of(0, 0, 1), "–");
        assert_eq!(percent_of(1, 3, 1), "33.3\u{202f}%");
        assert_eq!(
            [0.0, 0.0004, 0.0005].map(share),
            ["0.0\u{202f}%", "&lt;\u{202f}0.1\u{202f}%", "0.1\u{202f}%"]
        );
        assert_eq!(ratio(None), "–");
        assert_eq!(seconds(f64::NAN), "–");
        assert_eq!(place(f64::INFINITY), "0");
        assert_eq!(place(-0.01), "0");
    }

    #[test]
    fn times_and_markup_read_well() {
        assert_eq!(seconds(0.25), "250\u{202f}ms");
        assert_eq!(seconds(99.95), "1\u{202f}min 39\u{202f}s");
        assert_eq!(seconds(6000.0), "1\u{202f}h 40\u{202f}min");
        assert_eq!(escape("<a b=\"c\">&'\u{1}"), "&lt;a b=&quot;c&quot;&gt;&amp;&#39;\u{fffd}");
    }
}
