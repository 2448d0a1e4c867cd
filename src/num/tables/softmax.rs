//! Tables of the softmax of accumulators: what classes share, by look-up alone.
//!
//! ```text
//! unit   accumulator units of a nat, times the temperature
//! esh    least shift >= 0 with 2^(10 + esh) >= 8 unit;  st = 2^esh / unit
//! E[i]   = floor(2^15 exp(-i st) + 1/2),  Q[i] = floor(255 exp(-i st) + 1/2),  E[1023] = Q[1023] = 0
//! G[h]   = floor(ln(h / 32) / st + 1/2),  h = 32 ..= 32 CE
//! x_c    = min( rsh(max acc - acc_c, esh), 1023 );   L = G[ sum E[x_c] >> 10 ];   p_c = Q[ min(x_c + L, 1023) ]
//! ```
//!
//! Two look-ups a class and one for the logarithm of the sum; nothing is multiplied or divided. Shares are off by at most 8 of
//! 255, by a third of one on average, where a nat is some hundred units; by 34 where it is 4. See docs/MODEL.md, 3.1.
#![expect(clippy::float_arithmetic, reason = "floats become integers here, at load only")]
#![deny(clippy::disallowed_types, clippy::disallowed_methods)]

use super::{Positive, Unit};
use crate::num::fixed::{narrow, rsh};

/// Entries of the tables of exponentials.
const ENTRIES: usize = 1024;
/// Steps of the sum of exponentials that stand for 1, as a power of two.
const STEPS_LOG2: u32 = 5;
/// `E` of 0, as a power of two.
const ONE_LOG2: u32 = 15;

/// What the softmax of outputs is looked up in.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SoftmaxTables {
    /// `esh`.
    shift: u32,
    /// `E`.
    exponentials: Box<[u16; ENTRIES]>,
    /// `Q`.
    shares: Box<[u8; ENTRIES]>,
    /// `G`, from 32 on.
    logarithms: Vec<u32>,
}

impl SoftmaxTables {
    /// Tables for so many outputs, whose accumulators count `unit`.
    #[must_use]
    pub fn new(unit: Unit, temperature: Positive, outputs: usize) -> Self {
        let nat = temperature.get() / unit.of_z();
        let mut shift = 0u32;
        while libm::exp2(f64::from(10 + shift)) < 8.0 * nat {
            shift += 1;
        }
        let step = libm::exp2(f64::from(shift)) / nat;
        let (mut exponentials, mut shares) = ([0; ENTRIES], [0; ENTRIES]);
        let both = exponentials.iter_mut().zip(&mut shares).take(ENTRIES - 1);
        for (at, (exponential, share)) in (0u32..).zip(both) {
            let of = libm::exp(-f64::from(at) * step);
            let one = f64::from(1u32 << ONE_LOG2);
            *exponential = narrow(nearest(one * of), "at most 2^15");
            *share = narrow(nearest(255.0 * of), "at most 255");
        }
        let steps = 1u32 << STEPS_LOG2;
        let last = steps * narrow::<u32>(outputs.max(1), "an output is a column");
        let logarithm = |h: u32| nearest(libm::log(f64::from(h) / f64::from(steps)) / step);
        Self {
            shift,
            exponentials: exponentials.into(),
            shares: shares.into(),
            logarithms: (steps..=last).map(logarithm).collect(),
        }
    }

    /// `esh`.
    #[must_use]
    pub const fn shift(&self) -> u32 {
        self.shift
    }

    /// Every entry, table after table: what a run that uses them depends on.
    pub fn entries(&self) -> impl Iterator<Item = i64> {
        let exponentials = self.exponentials.iter().map(|&entry| i64::from(entry));
        let shares = self.shares.iter().map(|&entry| i64::from(entry));
        exponentials.chain(shares).chain(self.logarithms.iter().map(|&entry| entry.into()))
    }

    /// Place of an accumulator that lies so far below the greatest one.
    #[must_use]
    pub fn place(&self, below: i64) -> usize {
        narrow(rsh(below, self.shift).min(ENTRIES as i64 - 1), "no accumulator is above")
    }

    /// `E` at a place.
    #[must_use]
    pub fn exponential(&self, place: usize) -> u32 {
        self.exponentials[place].into()
    }

    /// `L` of a sum of exponentials.
    ///
    /// # Panics
    /// When it is none of as many as there are outputs, of which one is 1.
    #[must_use]
    pub fn logarithm(&self, sum: u32) -> usize {
        let from = 1 << STEPS_LOG2;
        let at = narrow::<usize>(sum >> (ONE_LOG2 - STEPS_LOG2), "at most 2^31 outputs");
        narrow(self.logarithms[at - from], "a place")
    }

    /// `Q` at the place that a logarithm moves another one to.
    #[must_use]
    pub fn share(&self, place: usize, logarithm: usize) -> u8 {
        self.shares[(place + logarithm).min(ENTRIES - 1)]
    }

    /// What each of some accumulators shares, of 255. What `out` held is lost.
    pub fn share_out(&self, accumulators: &[i64], out: &mut Vec<u8>) {
        let greatest = accumulators.iter().max().copied().unwrap_or(0);
        let place = |&accumulator: &i64| self.place(greatest - accumulator);
        let sum = accumulators.iter().map(|acc| self.exponential(place(acc))).sum();
        let logarithm = self.logarithm(sum);
        out.clear();
        out.extend(accumulators.iter().map(|acc| self.share(place(acc), logarithm)));
    }
}

/// The nearest whole number, halves up.
fn nearest(x: f64) -> u32 {
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "0..=2^31, whole")]
    {
        libm::floor(x + 0.5) as u32
    }
}

#[cfg(test)]
mod tests {
    use super::super::FullDrive;
    use super::*;
    use crate::num::fixed::{DriveBits, LevelBits};

    fn unit(weight_max_log2: i32, level_bits: i64, drive_bits: i64) -> Unit {
        Unit {
            weight_max_log2,
            level_bits: LevelBits::new(level_bits).unwrap(),
            drive_bits: DriveBits::new(drive_bits).unwrap(),
            full_drive: FullDrive::One,
        }
    }

    /// Numbers from -1 to 1.
    fn numbers(mut seed: u64) -> impl FnMut() -> f64 {
        move || {
            seed = seed.wrapping_mul(0x5851_f42d_4c95_7f2d).wrapping_add(0x1405_7b7e_f767_814f);
            (seed >> 11) as f64 / (1u64 << 52) as f64 - 1.0
        }
    }

    /// Mean and greatest difference from exact shares, and the least and greatest sum of a row, over some rows.
    fn compare(unit: Unit, temperature: f64, outputs: usize) -> (f64, f64, [i32; 2]) {
        let temperature = Positive::new(temperature).unwrap();
        let tables = SoftmaxTables::new(unit, temperature, outputs);
        let mut number = numbers(7);
        let (mut mean, mut most, mut sums) = (0.0, 0f64, [i32::MAX, 0]);
        let mut out = vec![];
        let rows = 5000;
        for _ in 0..rows {
            // logits of a few nats, in accumulator units
            let wide = 6.0 * number().abs();
            let nat = temperature.get() / unit.of_z();
            let row: Vec<i64> =
                (0..outputs).map(|_| libm::floor(wide * number() * nat) as i64).collect();
            tables.share_out(&row, &mut out);
            let z = row.iter().map(|&acc| libm::exp(acc as f64 / nat)).sum::<f64>();
            for (&acc, &share) in row.iter().zip(&out) {
                let off = (f64::from(share) - 255.0 * libm::exp(acc as f64 / nat) / z).abs();
                (mean, most) = (mean + off, most.max(off));
            }
            let sum: i32 = out.iter().map(|&share| i32::from(share)).sum();
            sums = [sums[0].min(sum), sums[1].max(sum)];
        }
        (mean / (rows * outputs) as f64, most, sums)
    }

    #[test]
    fn shares_are_near_those_of_exact_softmax() {
        for (unit, temperature) in
            [(unit(1, 8, 8), 1.0), (unit(0, 8, 8), 2.0), (unit(0, 4, 4), 1.0)]
        {
            let (mean, most, [least_sum, most_sum]) = compare(unit, temperature, 10);
            assert!(mean < 0.6 && most < 9.0, "{unit:?}: {mean} on average, {most} at most");
            assert!(least_sum >= 245 && most_sum <= 275, "{unit:?}: {least_sum}..{most_sum}");
        }
        // a nat of 2 units: coarse, as is said
        let (_, most, _) = compare(unit(0, 1, 1), 1.0, 10);
        assert!((8.0..80.0).contains(&most), "{most}");
    }

    #[test]
    fn tables_by_hand() {
        // a nat is 256 x 255 / 2 = 32,640 units: 2^(10 + 8) >= 261,120
        let tables = SoftmaxTables::new(unit(1, 8, 8), Positive::ONE, 10);
        assert_eq!(tables.shift(), 8);
        // 127.5 steps a nat: exp(-1/127.5) is 0.99219
        assert_eq!([0, 1, 1022, 1023].map(|i| tables.exponential(i)), [32768, 32512, 11, 0]);
        assert_eq!([0, 88, 1023].map(|i| tables.share(i, 0)), [255, 128, 0]);
        // ln 2 is 88.4 steps, ln 10 is 293.6
        assert_eq!([1, 2, 10].map(|n| tables.logarithm(n << 15)), [0, 88, 294]);
        assert_eq!(tables.entries().count(), 1024 + 1024 + 9 * 32 + 1);
        let mut out = vec![];
        tables.share_out(&[5, 5, 5, 5, 5, 5, 5, 5, 5, 5], &mut out);
        assert_eq!(out, [25; 10]);
        tables.share_out(&[0, 1 << 40], &mut out);
        assert_eq!(out, [0, 255]);
    }
}
