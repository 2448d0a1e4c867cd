//! Numbers with units as people read them.

use super::Range;

/// Three significant digits, a prefix and a unit: `12.3 nJ`. Two minutes and more are told in minutes, hours or days.
#[must_use]
pub fn prefixed(value: f64, unit: &str) -> String {
    const PREFIXES: [&str; 11] = ["a", "f", "p", "n", "u", "m", "", "k", "M", "G", "T"];
    if value == 0.0 || !value.is_finite() {
        return format!("{value} {unit}");
    }
    if unit == "s" && value >= MINUTES_FROM {
        return long(value);
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

/// Seconds from which on people count in minutes.
const MINUTES_FROM: f64 = 119.5;

/// A time in the two units that matter.
fn long(seconds: f64) -> String {
    let (minute, hour, day) = (60.0, 3600.0, 86_400.0);
    let (big, small, [big_name, small_name]) = match seconds {
        seconds if seconds < 100.0 * minute => (minute, 1.0, ["min", "s"]),
        seconds if seconds < 2.0 * day => (hour, minute, ["h", "min"]),
        _ => (day, hour, ["days", "h"]),
    };
    // whole units of the smaller kind, so that 60 of them never stand there
    let whole = (seconds / small).round();
    let each = big / small;
    format!("{:.0} {big_name} {:.0} {small_name}", (whole / each).floor(), whole % each)
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

    #[test]
    fn long_times_are_told_in_minutes_hours_and_days() {
        for (value, text) in [
            (99.96, "100 s"),
            (119.4, "119 s"),
            (119.6, "2 min 0 s"),
            (1234.0, "20 min 34 s"),
            (5999.7, "100 min 0 s"),
            (6000.0, "1 h 40 min"),
            (172_799.0, "48 h 0 min"),
            (180_000.0, "2 days 2 h"),
        ] {
            assert_eq!(prefixed(value, "s"), text);
        }
        assert_eq!(prefixed(1234.0, "J"), "1.23 kJ");
    }
}
