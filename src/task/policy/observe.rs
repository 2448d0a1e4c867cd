//! Observations: their statistics, their standard form, and the drive codes they become.
//!
//! ```text
//! x        = clamp(standard(observation), -8, 8)             by input, with 11 bits behind the point
//! split    : row 2i, row 2i + 1 = code(x), code(-x),         code(x) = min(floor(max(x, 0) M / 8 + 1/2), M)
//! offset   : row i = clamp(floor((x + 8) M / 16 + 1/2), 0, M)
//! signed   : row i = code(x), then code(-x)                   the codes of all x first
//! sparse   : row of a line = M where it is on, else 0        M = 2^drive_bits - 1, the full code
//! ```
//!
//! `standard` is that of [`Moments`], over all observations so far, frozen for a rollout: within 2^-12 + 2^-20 of the exact
//! quotient. Sums are exact, so the order of environments and threads cannot matter. After [`COUNT_MAX`] observations
//! the statistics rest. See docs/MODEL.md, 5.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use super::moments::{COUNT_MAX, Moments, Spread};
use super::number::{Observed, Real};
use crate::chip::state::{Piece, Section, State, StateError, Visitor};
use crate::num::fixed::{DriveBits, rsh};

/// The greatest standardised number, in 2^-11.
const BOUND: i64 = 8 << 11;

/// What was observed so far, input by input.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Statistics {
    inputs: Vec<Moments>,
}

impl Statistics {
    /// Of so many inputs, of which nothing was seen.
    #[must_use]
    pub fn new(inputs: usize) -> Self {
        Self { inputs: vec![Moments::default(); inputs] }
    }

    /// How many observations were taken.
    #[must_use]
    pub fn count(&self) -> u64 {
        self.inputs.first().map_or(0, |input| input.count)
    }

    /// Takes some observations, `[observation][input]`.
    ///
    /// # Panics
    /// When they are not whole.
    pub fn add(&mut self, values: &[Real]) {
        if self.inputs.is_empty() {
            return;
        }
        let observations = values.chunks_exact(self.inputs.len());
        assert!(observations.remainder().is_empty(), "observations are whole");
        for observation in observations {
            if self.count() == COUNT_MAX {
                return;
            }
            for (input, value) in self.inputs.iter_mut().zip(observation) {
                input.add(value.to_bits());
            }
        }
    }

    /// What takes observations to their standard form, from all so far. Before the first, everything is 0.
    #[must_use]
    pub fn freeze(&self) -> Standard {
        Standard { inputs: self.inputs.iter().map(Moments::spread).collect() }
    }
}

impl State for Statistics {
    fn visit(&mut self, visitor: &mut dyn Visitor) -> Result<(), StateError> {
        let numbers: Vec<i64> = self.inputs.iter().flat_map(Moments::numbers).collect();
        let (name, within) = ("policy.observed", i64::MIN..=i64::MAX);
        let piece = Piece { name, section: Some(Section::Task), within };
        if let Some(numbers) = visitor.numbers(&piece, &numbers)? {
            let inputs: Option<Vec<_>> =
                numbers.as_chunks().0.iter().map(|five| Moments::from_numbers(*five)).collect();
            let alike =
                |inputs: &Vec<Moments>| inputs.windows(2).all(|two| two[0].count == two[1].count);
            let found = "holds sums that no observations have".into();
            let wrong = || StateError { name: name.into(), found };
            self.inputs = inputs.filter(alike).ok_or_else(wrong)?;
        }
        Ok(())
    }
}

/// How observations are brought to their standard form.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Standard {
    inputs: Vec<Spread>,
}

impl Standard {
    /// Appends the standard form of some observations, `[observation][input]`.
    pub fn apply(&self, values: &[Real], observed: &mut Vec<Observed>) {
        let spreads = self.inputs.iter().cycle();
        observed.extend(values.iter().zip(spreads).map(|(value, spread)| {
            let standard = spread.standard(value.to_bits(), 11);
            Observed::from_bits(standard.clamp(-BOUND, BOUND) as i16)
        }));
    }
}

/// Appends two codes a number: what it is above 0, and what it is below.
pub fn split(observed: &[Observed], drive_bits: DriveBits, codes: &mut Vec<u8>) {
    let code_max = i32::from(drive_bits.code_max());
    codes.extend(observed.iter().flat_map(|x| {
        let x = i32::from(x.to_bits());
        [x, -x].map(|x| rsh(x.max(0) * code_max, 14).min(code_max) as u8)
    }));
}

/// Appends what all numbers are above 0, then what they are below: the codes of [`split`] in the order of two phases.
pub fn signed(observed: &[Observed], drive_bits: DriveBits, codes: &mut Vec<u8>) {
    let code_max = i32::from(drive_bits.code_max());
    for sign in [1, -1] {
        codes.extend(observed.iter().map(|x| {
            let x = sign * i32::from(x.to_bits());
            rsh(x.max(0) * code_max, 14).min(code_max) as u8
        }));
    }
}

/// Appends one code a number: 0 at -8, the full code at 8.
pub fn offset(observed: &[Observed], drive_bits: DriveBits, codes: &mut Vec<u8>) {
    let code_max = i32::from(drive_bits.code_max());
    codes.extend(observed.iter().map(|x| {
        let above = i32::from(x.to_bits()) + (8 << 11);
        rsh(above * code_max, 15).clamp(0, code_max) as u8
    }));
}

/// Appends one code a line, of so many: the full code where it is on.
///
/// # Panics
/// When a line that is on is none of them.
pub fn sparse(active: &[u32], lines: usize, drive_bits: DriveBits, codes: &mut Vec<u8>) {
    let start = codes.len();
    codes.resize(start + lines, 0);
    for &line in active {
        codes[start + line as usize] = drive_bits.code_max();
    }
}

#[cfg(test)]
pub(super) mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::chip::state::Seen;
    use bitvec::prelude::*;

    /// Keeps the one piece that it is shown, which has this name, and hands something back.
    #[derive(Default)]
    pub(in crate::task::policy) struct Numbers {
        pub(in crate::task::policy) name: &'static str,
        pub(in crate::task::policy) shown: Vec<i64>,
        pub(in crate::task::policy) back: Option<Vec<i64>>,
    }

    impl Visitor for Numbers {
        fn halves(
            &mut self,
            _: &Piece<'_>,
            _: [usize; 2],
            _: &dyn Fn() -> Vec<u16>,
        ) -> Seen<Vec<u16>> {
            unreachable!("there are only numbers")
        }
        fn bits(
            &mut self,
            _: &Piece<'_>,
            _: [usize; 2],
            _: &dyn Fn() -> BitVec<u8, Lsb0>,
        ) -> Seen<BitVec<u8, Lsb0>> {
            unreachable!("there are only numbers")
        }
        fn numbers(&mut self, piece: &Piece<'_>, values: &[i64]) -> Seen<Vec<i64>> {
            assert_eq!((piece.name, piece.section), (self.name, Some(Section::Task)));
            assert!(self.shown.is_empty(), "there is one piece");
            self.shown = values.to_vec();
            Ok(self.back.take())
        }
        fn rows(&mut self, _: &Piece<'_>, _: usize, _: &dyn Fn() -> Vec<i64>) -> Seen<Vec<i64>> {
            unreachable!("there are only numbers")
        }
    }

    fn reals(values: &[i32]) -> Vec<Real> {
        values.iter().map(|&bits| Real::from_bits(bits)).collect()
    }

    #[test]
    fn what_a_checkpoint_holds_is_what_was_there_or_an_error() {
        let mut statistics = Statistics::new(2);
        statistics.add(&reals(&[1 << 16, i32::MIN, -3, 7, i32::MAX, i32::MIN]));
        let name = "policy.observed";
        let mut writer = Numbers { name, ..Numbers::default() };
        statistics.visit(&mut writer).unwrap();
        let back = |numbers: &[i64]| Numbers { name, back: Some(numbers.to_vec()), shown: vec![] };
        let mut again = Statistics::new(2);
        again.visit(&mut back(&writer.shown)).unwrap();
        assert_eq!((again, writer.shown.len()), (statistics.clone(), 10));
        for (at, by) in [(0, 1), (3, i64::MIN)] {
            let mut numbers = writer.shown.clone();
            numbers[at] ^= by;
            let error = statistics.visit(&mut back(&numbers)).unwrap_err();
            assert_eq!(error.to_string(), "`policy.observed` holds sums that no observations have");
        }
    }

    #[test]
    fn a_constant_input_gives_zero_whatever_comes_later() {
        let mut statistics = Statistics::new(2);
        let mut observed = Vec::new();
        statistics.freeze().apply(&reals(&[99, 100]), &mut observed);
        statistics.add(&reals(&[5, -(1 << 20), 5, 1 << 20]));
        assert_eq!(statistics.count(), 2);
        statistics.freeze().apply(&reals(&[5, 1 << 20, i32::MIN, i32::MIN]), &mut observed);
        assert_eq!(observed, [0, 0, 0, 1, 0, -8].map(Observed::from_num));
    }

    #[test]
    fn statistics_rest_when_they_are_full() {
        let mut statistics = Statistics::new(1);
        statistics.inputs[0].count = COUNT_MAX - 1;
        statistics.add(&reals(&[3, 4]));
        assert_eq!((statistics.count(), statistics.inputs[0].sum), (COUNT_MAX, 3));
        let mut nothing = Statistics::new(0);
        nothing.add(&[]);
        assert_eq!(nothing.count(), 0);
    }

    #[test]
    #[should_panic(expected = "observations are whole")]
    fn half_an_observation_is_refused() {
        Statistics::new(2).add(&reals(&[1, 2, 3]));
    }

    #[test]
    fn codes_at_the_edges() {
        let observed = [-16, -8, 0, 8, 15].map(Observed::from_num);
        for bits in [1, 4, 8] {
            let (bits, mut codes) = (DriveBits::new(bits).unwrap(), vec![77]);
            let full = bits.code_max();
            split(&observed, bits, &mut codes);
            assert_eq!(codes, [77, 0, full, 0, full, 0, 0, full, 0, full, 0]);
            codes.clear();
            signed(&observed, bits, &mut codes);
            assert_eq!(codes, [0, 0, 0, full, full, full, full, 0, 0, 0]);
            codes.clear();
            offset(&observed, bits, &mut codes);
            assert_eq!(codes, [0, 0, full / 2 + 1, full, full]);
            sparse(&[0, 2], 4, bits, &mut codes);
            assert_eq!(codes[5..], [full, 0, full, 0]);
        }
    }

    proptest! {
        #[test]
        fn codes_are_the_equations(x in any::<i16>(), bits in 1i64..=8) {
            let (observed, drive_bits) = ([Observed::from_bits(x)], DriveBits::new(bits).unwrap());
            let (x, full) = (i64::from(x), i64::from(drive_bits.code_max()));
            // (numerator + 1/2) / 2^11 / 8, floored
            let code = |x: i64| (2 * x.max(0) * full + (1 << 14)).div_euclid(1 << 15).min(full);
            let mut codes = Vec::new();
            signed(&observed, drive_bits, &mut codes);
            prop_assert_eq!(codes.iter().map(|&c| i64::from(c)).collect::<Vec<_>>(), [code(x), code(-x)]);
            codes.clear();
            split(&observed, drive_bits, &mut codes);
            offset(&observed, drive_bits, &mut codes);
            let middle = (2 * (x + (8 << 11)) * full + (1 << 15)).div_euclid(1 << 16).clamp(0, full);
            prop_assert_eq!(codes.iter().map(|&c| i64::from(c)).collect::<Vec<_>>(), [code(x), code(-x), middle]);
        }

        #[test]
        fn the_order_of_observations_does_not_matter(mut values in prop::collection::vec(any::<i32>(), 1..30)) {
            let mut forth = Statistics::new(1);
            forth.add(&reals(&values));
            values.reverse();
            let mut back = Statistics::new(1);
            values.chunks(3).for_each(|some| back.add(&reals(some)));
            prop_assert_eq!(forth, back);
        }

        #[test]
        fn standard_form_is_within_its_bound_of_the_exact_one(
            values in prop::collection::vec(-1i32 << 24..1 << 24, 3..30), scale in 0u32..16,
        ) {
            let values: Vec<i32> = values.iter().map(|x| x >> scale).collect();
            let mut statistics = Statistics::new(1);
            statistics.add(&reals(&values));
            let mut observed = Vec::new();
            statistics.freeze().apply(&reals(&values), &mut observed);
            let n = values.len() as i128;
            let sum: i128 = values.iter().map(|&x| i128::from(x)).sum();
            let apart = n * values.iter().map(|&x| i128::from(x).pow(2)).sum::<i128>() - sum * sum;
            prop_assume!(apart >= 256 * n * n);
            let root = (apart << 40).isqrt(); // 2^-20
            for (&value, observed) in values.iter().zip(observed) {
                // (n x - sum) / root, in 2^-30, clamped
                let exact = ((n * i128::from(value) - sum) << 50) / root;
                let exact = exact.clamp(-8 << 30, 8 << 30);
                let off = (i128::from(observed.to_bits()) << 19) - exact;
                prop_assert!(off.abs() <= (1 << 18) + (1 << 10), "{off}");
            }
        }
    }
}
