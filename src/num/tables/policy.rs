//! Tables of policies: four smooth functions in integers, made once, read between their entries along straight lines.
//!
//! ```text
//! exp2[i]   = nearest(2^30 2^(i / 1024))                           i = 0 ..= 1024     of a share of an octave
//! log2[i]   = nearest(2^30 log2(1 + i / 1024))                     i = 0 ..= 1024     of a mantissa
//! normal[i] = nearest(-2^27 Phi^-1(v)), v = (1 + (i mod 128) / 128) 2^(floor(i / 128) - 33)    i = 0 ..= 4096
//! tanh[i]   = nearest(2^30 tanh(i / 128))                          i = 0 ..= 1024     of 0 ..= 8
//! between(t, x, b) = t[i] + rsh((t[i + 1] - t[i]) f, b),  i = floor(x / 2^b),  f = x mod 2^b
//! ```
//!
//! `Phi^-1` is the inverse of the normal distribution. Its table has 128 entries an octave, so that the tail is as fine
//! as the middle: 32 octaves below 1/2, from 2^-33 on, hold every 32-bit word. A straight line between entries is off by at
//! most `h^2 / 8` times the second derivative; [`PolicyTables::between`] is monotone because the entries are. Bounds of
//! what is made of these tables stand in `task::policy`. See docs/MODEL.md, 5.
#![expect(clippy::float_arithmetic, reason = "floats become integers here, at load only")]
#![deny(clippy::disallowed_types, clippy::disallowed_methods)]

use std::f64::consts::{FRAC_1_SQRT_2, PI};

use crate::num::fixed::{narrow, rsh};

/// Entries of the tables of `exp2`, `log2` and `tanh`, their end not counted.
const ENTRIES: usize = 1024;
/// Entries of the table of the normal distribution, its end not counted.
const NORMAL_ENTRIES: usize = 4096;

/// What policies look up. All entries are below 2^31, or 2^31.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PolicyTables {
    /// `2^(i / 1024)`, from 1 to 2, in 2^-30.
    pub exp2: Box<[u32; ENTRIES + 1]>,
    /// `log2(1 + i / 1024)`, from 0 to 1, in 2^-30.
    pub log2: Box<[u32; ENTRIES + 1]>,
    /// How far below the mean the normal distribution has a mass, in 2^-27; falling, to 0 at half of the mass.
    pub normal: Box<[u32; NORMAL_ENTRIES + 1]>,
    /// `tanh(i / 128)`, in 2^-30.
    pub tanh: Box<[u32; ENTRIES + 1]>,
}

impl PolicyTables {
    /// Makes the tables. Takes some milliseconds.
    #[must_use]
    pub fn build() -> Self {
        let one = f64::from(1u32 << 30);
        Self {
            exp2: table(|i| one * libm::exp2(i / 1024.0)),
            log2: table(|i| one * libm::log2(1.0 + i / 1024.0)),
            normal: normal(),
            tanh: table(|i| one * libm::tanh(i / 128.0)),
        }
    }

    /// Every entry, table after table: what a run that uses them depends on.
    pub fn entries(&self) -> impl Iterator<Item = i64> {
        let Self { exp2, log2, normal, tanh } = self;
        let tables: [&[u32]; 4] = [&exp2[..], &log2[..], &normal[..], &tanh[..]];
        tables.into_iter().flatten().map(|&entry| i64::from(entry))
    }

    /// A table at `x / 2^bits` entries, along a straight line between two of them, halves toward plus infinity.
    ///
    /// # Panics
    /// At or beyond the last entry.
    #[inline]
    #[must_use]
    pub fn between(table: &[u32], x: u64, bits: u32) -> i64 {
        let i = (x >> bits) as usize;
        let (a, b) = (i64::from(table[i]), i64::from(table[i + 1]));
        a + rsh((b - a) * (x & ((1 << bits) - 1)) as i64, bits)
    }
}

/// The nearest integer, halves up.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "0 ..= 2^31")]
fn nearest(x: f64) -> u32 {
    libm::floor(x + 0.5) as u32
}

/// A table of a function of the number of its entry.
fn table<const N: usize>(f: impl Fn(f64) -> f64) -> Box<[u32; N]> {
    let mut table = Box::new([0; N]);
    for (entry, i) in table.iter_mut().zip(0u32..) {
        *entry = nearest(f(f64::from(i)));
    }
    table
}

/// The table of the normal distribution, from the middle to the tail. Newton's steps from the last entry, which lies
/// nearer to the mean, come to the next from one side, because the tail is convex.
fn normal() -> Box<[u32; NORMAL_ENTRIES + 1]> {
    let mut table = Box::new([0; NORMAL_ENTRIES + 1]);
    let mut z = 0.0;
    for (i, entry) in table.iter_mut().enumerate().rev() {
        let i: u32 = narrow(i, "some thousand entries");
        let mass = (1.0 + f64::from(i % 128) / 128.0) * libm::exp2(f64::from(i / 128) - 33.0);
        for _ in 0..5 {
            let tail = 0.5 * libm::erfc(z * FRAC_1_SQRT_2);
            let density = libm::exp(-0.5 * z * z) / libm::sqrt(2.0 * PI);
            z += (tail - mass) / density;
        }
        *entry = nearest(z * f64::from(1u32 << 27));
    }
    table
}

#[cfg(test)]
mod tests {
    use super::super::precise;
    use super::*;

    #[test]
    fn every_entry_is_the_nearest_integer_to_its_function() {
        let PolicyTables { exp2, log2, normal, tanh } = PolicyTables::build();
        // half a step, and what the reference may be off by
        let near = |entry: u32, bits: u32, exact: i128| {
            let step = 1 << (precise::BITS - bits);
            let off = (i128::from(entry) * step - exact).abs();
            assert!(off <= step / 2 + step / 256, "{entry} {exact}");
        };
        for i in 0..=ENTRIES {
            let share = (i as i128) << (precise::BITS - 10);
            near(exp2[i], 30, precise::exp(precise::mul(share, precise::ln(2 * precise::ONE))));
            let ln = precise::ln(precise::ONE + share);
            near(log2[i], 30, precise::div(ln, precise::ln(2 * precise::ONE)));
            near(tanh[i], 30, precise::tanh(8 * share));
        }
        assert_eq!(
            (exp2[0], exp2[ENTRIES], log2[0], log2[ENTRIES]),
            (1 << 30, 1 << 31, 0, 1 << 30)
        );
        assert_eq!((tanh[0], normal[NORMAL_ENTRIES]), (0, 0));
        for (i, &entry) in normal.iter().enumerate() {
            let mass = ((128 + i as i128 % 128) << (precise::BITS - 40)) << (i / 128);
            let z = |steps: i128| (2 * i128::from(entry) + steps) << (precise::BITS - 28);
            let slack = 4;
            assert!(precise::tail(z(-1)) + slack >= mass, "{i}");
            assert!(precise::tail(z(1)) <= mass + slack, "{i}");
        }
    }

    #[test]
    fn entries_are_listed_in_the_order_of_the_tables() {
        let tables = PolicyTables::build();
        let all: Vec<i64> = tables.entries().collect();
        assert_eq!(all.len(), 3 * (ENTRIES + 1) + NORMAL_ENTRIES + 1);
        for (at, entry) in [
            (0, tables.exp2[0]),
            (1026, tables.log2[1]),
            (2050, tables.normal[0]),
            (6146, tables.normal[4096]),
            (6148, tables.tanh[1]),
        ] {
            assert_eq!(all[at], i64::from(entry), "{at}");
        }
    }

    #[test]
    fn between_entries_lies_a_straight_line() {
        let table = [10, 14, 4];
        let at = |x| PolicyTables::between(&table, x, 3);
        assert_eq!([0, 1, 2, 4, 7, 8, 9, 12, 15].map(at), [10, 11, 11, 12, 14, 14, 13, 9, 5]);
    }
}
