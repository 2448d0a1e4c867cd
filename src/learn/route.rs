//! Error routes: which error word a hidden unit listens to.
//!
//! ```text
//! modulo, T taps   unit j adds words (j + shift_t) mod CE,  q = j div CE:
//!                  shift_0 = 0;  shift_1 = 1 + q mod (CE - 1);
//!                  shift_t = free shift number (q div (CE - 1)^(t-1)) mod (free shifts), counted upward from 1
//! random_sparse    one word, drawn once
//! scalar_broadcast all units hear sat( rsh(sum of all words, ceil(log2 CE)) )
//! random_dense     unit j hears sat( rsh(sum of +-words, shift) ), signs drawn once; computed in the error unit
//! ```
//!
//! The first two are static taps on the tile and cost no product. See docs/MODEL.md, 3.2.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use crate::chip::layer::Taps;
use crate::num::draw::{Place, Site, below};
use crate::num::fixed::{ErrorBits, log2_ceil, rail, rsh, sat};

/// How errors reach hidden units.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Route {
    /// Deterministic taps.
    Modulo {
        /// Words a unit adds, 1..=min(4, outputs).
        taps: usize,
        /// Shift of their sum; `None` is `ceil(log2 taps)`.
        shift: Option<u32>,
    },
    /// One word a unit, drawn once.
    RandomSparse,
    /// One word for all.
    ScalarBroadcast,
    /// Random signs, as in direct feedback alignment.
    RandomDense {
        /// Shift of the sum; `None` is `ceil(log2(outputs) / 2)`, which keeps the variance.
        shift: Option<u32>,
    },
}

/// Words of at most 9 bits, with any signs, that add up inside 16 bits.
const DENSE_PART: usize = 128;

/// A route built for one layer: what the error unit computes, and what the tile taps.
#[derive(Debug, Clone)]
pub(crate) struct Delivery {
    taps: Taps,
    kind: Kind,
    bits: ErrorBits,
}

#[derive(Debug, Clone)]
enum Kind {
    Bus,
    Broadcast {
        shift: u32,
    },
    /// Signs by output and unit.
    Dense {
        signs: Vec<i16>,
        shift: u32,
    },
    Own,
}

impl Delivery {
    /// The output layer: unit c takes word c.
    #[must_use]
    pub(crate) fn output(outputs: usize, bits: ErrorBits) -> Self {
        Self { taps: Taps::identity(outputs), kind: Kind::Bus, bits }
    }

    /// A layer whose units get a word each, made elsewhere (back-propagation).
    #[must_use]
    pub(crate) fn own(units: usize, bits: ErrorBits) -> Self {
        Self { taps: Taps::identity(units), kind: Kind::Own, bits }
    }

    /// A hidden layer of `units` that hears `outputs` channels by `route`.
    #[must_use]
    pub(crate) fn hidden(
        route: Route,
        units: usize,
        outputs: usize,
        bits: ErrorBits,
        seed: u64,
        layer: u16,
    ) -> Self {
        let place = Place { layer, ..Place::global(seed, Site::Route, 0) };
        let outputs_u32 = u32::try_from(outputs).expect("checked by the plan");
        let word = |w: usize| u16::try_from(w).expect("checked by the plan");
        let (taps, kind) = match route {
            Route::Modulo { taps, shift } => {
                let words = (0..units).flat_map(|unit| modulo(unit, outputs, taps)).map(word);
                let shift = shift.unwrap_or(log2_ceil(taps as u64));
                let words = words.collect();
                (Taps { width: outputs, per_unit: taps, words, shift }, Kind::Bus)
            }
            Route::RandomSparse => {
                let words = place.words().take(units).map(|w| word(below(w, outputs_u32) as usize));
                let words = words.collect();
                (Taps { width: outputs, per_unit: 1, words, shift: 0 }, Kind::Bus)
            }
            Route::ScalarBroadcast => {
                let taps = Taps { width: 1, per_unit: 1, words: vec![0; units], shift: 0 };
                (taps, Kind::Broadcast { shift: log2_ceil(outputs as u64) })
            }
            Route::RandomDense { shift } => {
                // drawn unit by unit
                let mut signs = vec![0; units * outputs];
                for (at, word) in place.words().take(units * outputs).enumerate() {
                    let sign = if word >> 31 == 1 { -1 } else { 1 };
                    signs[at % outputs * units + at / outputs] = sign;
                }
                let shift = shift.unwrap_or(log2_ceil(outputs as u64).div_ceil(2));
                (Taps::identity(units), Kind::Dense { signs, shift })
            }
        };
        Self { taps, kind, bits }
    }

    /// The tile's part.
    #[must_use]
    pub(crate) const fn taps(&self) -> &Taps {
        &self.taps
    }

    /// Whether the words are those of the output, as they are: one bus brings them to all such layers at once.
    #[must_use]
    pub(crate) const fn is_common(&self) -> bool {
        matches!(self.kind, Kind::Bus)
    }

    /// The words put on this layer's bus for output words `[sample][output]`; how many saturated and how many
    /// products the error unit computed.
    #[must_use]
    pub(crate) fn words(&self, output: &[i16], outputs: usize) -> (Vec<i16>, u64, u64) {
        let mut saturated = 0;
        let mut bounded = |sum: i64, shift: u32| {
            let (word, changed) = sat(rsh(sum, shift), self.bits.get());
            saturated += u64::from(changed);
            word as i16
        };
        match &self.kind {
            Kind::Bus | Kind::Own => (output.to_vec(), 0, 0),
            Kind::Broadcast { shift } => {
                let sums =
                    output.chunks_exact(outputs).map(|w| w.iter().map(|&w| i64::from(w)).sum());
                (sums.map(|sum| bounded(sum, *shift)).collect(), saturated, 0)
            }
            Kind::Dense { signs, shift } => {
                let units = signs.len() / outputs;
                let mut words = Vec::with_capacity(output.len() / outputs * units);
                let (mut sums, mut part) = (vec![0i32; units], vec![0i16; units]);
                for sample in output.chunks_exact(outputs) {
                    sums.fill(0);
                    let parts = sample.chunks(DENSE_PART).zip(signs.chunks(DENSE_PART * units));
                    for (sample, signs) in parts {
                        // one output after the other, so that units lie side by side
                        part.fill(0);
                        for (&word, signs) in sample.iter().zip(signs.chunks_exact(units)) {
                            part.iter_mut().zip(signs).for_each(|(sum, sign)| *sum += word * sign);
                        }
                        sums.iter_mut().zip(&part).for_each(|(sum, &p)| *sum += i32::from(p));
                    }
                    let from = words.len();
                    words.resize(from + units, 0);
                    saturated += bounded_all(&sums, *shift, self.bits, &mut words[from..]);
                }
                let products = (words.len() * outputs) as u64;
                (words, saturated, products)
            }
        }
    }
}

/// `sat( rsh(sum, shift) )` of sums below 2^30, side by side; how many saturated.
fn bounded_all(sums: &[i32], shift: u32, bits: ErrorBits, words: &mut [i16]) -> u64 {
    let rail = rail(bits.get()) as i32;
    // at 31 such sums are all rounded off
    let shift = shift.min(31);
    let half = if shift == 0 { 0 } else { 1 };
    let before = shift.saturating_sub(1);
    let mut saturated = 0u32;
    for (word, &sum) in words.iter_mut().zip(sums) {
        let rounded = (sum >> shift) + (sum >> before & half);
        let bounded = rounded.clamp(-rail, rail);
        saturated += u32::from(bounded != rounded);
        *word = bounded as i16;
    }
    u64::from(saturated)
}

/// Words unit `unit` adds.
fn modulo(unit: usize, outputs: usize, taps: usize) -> Vec<usize> {
    let q = unit / outputs;
    let mut shifts = vec![0];
    for tap in 1..taps {
        let free: Vec<usize> = (1..outputs).filter(|shift| !shifts.contains(shift)).collect();
        // (CE - 1)^(t - 1) beyond the address space leaves a quotient of 0
        let power = u32::try_from(tap - 1).ok().and_then(|t| (outputs - 1).checked_pow(t));
        shifts.push(free[power.map_or(0, |power| q / power) % free.len()]);
    }
    shifts.into_iter().map(|shift| (unit + shift) % outputs).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn bits() -> ErrorBits {
        ErrorBits::new(8).unwrap()
    }

    #[test]
    fn modulo_taps_follow_the_formula() {
        assert_eq!([0, 9, 10, 13].map(|j| modulo(j, 10, 1)[0]), [0, 9, 0, 3]);
        assert_eq!(modulo(0, 10, 3), [0, 1, 2]);
        assert_eq!(modulo(10, 10, 3), [0, 2, 1]); // q = 1: shift 2; free 1,3,..: number 0
        assert_eq!(modulo(95, 10, 3), [5, 6, 8]); // q = 9: shift 1 + 9 mod 9; free 2,3,..: number 1
    }

    #[test]
    fn a_broadcast_is_one_word_and_a_dense_route_one_a_unit() {
        let all = Delivery::hidden(Route::ScalarBroadcast, 7, 3, bits(), 1, 0);
        assert_eq!(all.words(&[4, 4, 3, -1, 0, 0], 3), (vec![3, 0], 0, 0));
        assert_eq!(all.taps().width, 1);
        let dense = Delivery::hidden(Route::RandomDense { shift: Some(0) }, 7, 3, bits(), 1, 0);
        let (words, saturated, products) = dense.words(&[100, 100, 100], 3);
        assert!(words.iter().all(|w| [127, 100, -100, -127].contains(w)));
        assert!(saturated > 0 && (words.len(), products) == (7, 21));
    }

    #[test]
    fn a_dense_route_negates_where_the_top_bit_of_its_word_is_set() {
        let route = Route::RandomDense { shift: Some(0) };
        let dense = Delivery::hidden(route, 20, 3, bits(), 9, 2);
        let place = Place { layer: 2, ..Place::global(9, Site::Route, 0) };
        let signs: Vec<i16> =
            place.words().take(60).map(|word| if word < 1 << 31 { 1 } else { -1 }).collect();
        for output in 0..3 {
            let mut one = [0; 3];
            one[output] = 1;
            let column: Vec<i16> = signs.iter().skip(output).step_by(3).copied().collect();
            assert_eq!(dense.words(&one, 3).0, column);
        }
    }

    #[test]
    fn random_routes_depend_on_seed_and_layer() {
        let taps = |seed, layer| {
            let made = Delivery::hidden(Route::RandomSparse, 200, 10, bits(), seed, layer);
            made.taps().words.clone()
        };
        assert_eq!(taps(1, 0), taps(1, 0));
        assert!(taps(1, 0) != taps(2, 0) && taps(1, 0) != taps(1, 1));
        assert!((0..10).all(|c| taps(1, 0).contains(&c)));
    }

    proptest! {
        #[test]
        fn sums_side_by_side_are_bounded_as_one(
            sums in proptest::collection::vec(-(1i32 << 30) + 1..1 << 30, 1..40),
            small in proptest::collection::vec(-2000i32..2000, 1..40),
            shift in 0u32..70,
            bits in 2i64..=9,
        ) {
            let bits = ErrorBits::new(bits).unwrap();
            for sums in [sums, small] {
                let mut words = vec![0; sums.len()];
                let saturated = bounded_all(&sums, shift, bits, &mut words);
                let want = sums.iter().map(|&sum| sat(rsh(i64::from(sum), shift), bits.get()));
                let want: Vec<_> = want.collect();
                prop_assert_eq!(saturated, want.iter().map(|w| u64::from(w.1)).sum::<u64>());
                prop_assert!(words.iter().zip(&want).all(|(&word, w)| i64::from(word) == w.0));
            }
        }

        #[test]
        fn taps_of_a_unit_never_collide(unit in 0usize..5000, outputs in 1usize..40, taps in 1usize..=4) {
            let taps = taps.min(outputs);
            let mut words = modulo(unit, outputs, taps);
            prop_assert_eq!(words[0], unit % outputs);
            words.sort_unstable();
            words.dedup();
            prop_assert_eq!(words.len(), taps);
            prop_assert!(words.iter().all(|&word| word < outputs));
        }
    }
}
