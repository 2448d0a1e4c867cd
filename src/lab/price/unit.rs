//! Numbers with units as people read them.

use super::Range;

/// Three significant digits, a prefix and a unit: `12.3 nJ`.
#[must_use]
pub fn prefixed(value: f64, unit: &str) -> String {
    const PREFIXES: [&str; 11] = ["a", "f", "p", "n", "u", "m", "", "k", "M", "G", "T"];
    if value == 0.0 || !value.is_finite() {
        return format!("{value} {unit}");
    }
    let mut value = value;
    let mut at = 6;
    // 999.5 and more would print as 1000
    while value.abs() >= 999.5 && at + 1 < PREFIXES.len() {
        value /= 1000.0;
        at += 1;
    }
    while value.abs() < 0.9995 && at > 0 {
        value *= 1000.0;
        at -= 1;
    }
    let digits = if value.abs() < 9.995 {
        2
    } else if value.abs() < 99.95 {
        1
    } else {
        0
    };
    format!("{value:.digits$} {}{unit}", PREFIXES[at])
}

/// `12.3 nJ (4.10 nJ to 40.2 nJ)`.
#[must_use]
pub fn bounds([low, typical, high]: Range, unit: &str) -> String {
    let [low, typical, high] = [low, typical, high].map(|value| prefixed(value, unit));
    format!("{typical} ({low} to {high})")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn three_digits_and_a_prefix() {
        for (value, text) in [
            (0.0, "0 J"),
            (1.0, "1.00 J"),
            (0.9996, "1.00 J"),
            (0.9994, "999 mJ"),
            (1.234e-9, "1.23 nJ"),
            (1.56e-12, "1.56 pJ"),
            (35e-18, "35.0 aJ"),
            (3.5e-20, "0.04 aJ"),
            (63.07e12, "63.1 TJ"),
            (999_600.0, "1.00 MJ"),
        ] {
            assert_eq!(prefixed(value, "J"), text);
        }
    }
}
