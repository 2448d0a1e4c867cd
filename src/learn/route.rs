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
//! The first two are static taps on the tile and cost no product; words of the others are formed in the error unit, by
//! the engine. See docs/MODEL.md, 3.2.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use crate::chip::layer::{Delivery, Taps, WordSource};
use crate::num::draw::{Place, Site, below};
use crate::num::fixed::log2_ceil;

/// How errors reach hidden units.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
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

impl Route {
    /// How the words of `outputs` channels reach a hidden layer of `units`. Random routes are drawn by seed and layer.
    #[must_use]
    pub(crate) fn delivery(self, units: usize, outputs: usize, seed: u64, layer: u16) -> Delivery {
        let place = Place { layer, ..Place::global(seed, Site::Route, 0) };
        let outputs_u32 = u32::try_from(outputs).expect("checked by the plan");
        let word = |w: usize| u16::try_from(w).expect("checked by the plan");
        match self {
            Self::Modulo { taps, shift } => {
                let words = (0..units).flat_map(|unit| modulo(unit, outputs, taps)).map(word);
                let shift = shift.unwrap_or(log2_ceil(taps as u64));
                Taps { width: outputs, per_unit: taps, words: words.collect(), shift }.into()
            }
            Self::RandomSparse => {
                let words = place.words().take(units).map(|w| word(below(w, outputs_u32) as usize));
                Taps { width: outputs, per_unit: 1, words: words.collect(), shift: 0 }.into()
            }
            Self::ScalarBroadcast => {
                let taps = Taps { width: 1, per_unit: 1, words: vec![0; units], shift: 0 };
                let source = WordSource::Sum { outputs, shift: log2_ceil(outputs as u64) };
                Delivery { source, taps, alike: false }
            }
            Self::RandomDense { shift } => {
                // drawn unit by unit
                let mut signs = vec![0; units * outputs];
                for (at, word) in place.words().take(units * outputs).enumerate() {
                    let sign = if word >> 31 == 1 { -1 } else { 1 };
                    signs[at % outputs * units + at / outputs] = sign;
                }
                let shift = shift.unwrap_or(log2_ceil(outputs as u64).div_ceil(2));
                let source = WordSource::Signed { signs, shift };
                Delivery { source, taps: Taps::identity(units), alike: false }
            }
        }
    }
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

    #[test]
    fn modulo_taps_follow_the_formula() {
        assert_eq!([0, 9, 10, 13].map(|j| modulo(j, 10, 1)[0]), [0, 9, 0, 3]);
        assert_eq!(modulo(0, 10, 3), [0, 1, 2]);
        assert_eq!(modulo(10, 10, 3), [0, 2, 1]); // q = 1: shift 2; free 1,3,..: number 0
        assert_eq!(modulo(95, 10, 3), [5, 6, 8]); // q = 9: shift 1 + 9 mod 9; free 2,3,..: number 1
    }

    #[test]
    fn a_broadcast_is_one_word_and_a_dense_route_one_a_unit() {
        let all = Route::ScalarBroadcast.delivery(7, 3, 1, 0);
        assert_eq!(all.source, WordSource::Sum { outputs: 3, shift: 2 });
        assert_eq!((all.taps.width, all.taps.words), (1, vec![0; 7]));
        let dense = Route::RandomDense { shift: None }.delivery(7, 10, 1, 0);
        assert_eq!((dense.output_words(), dense.taps.width), (10, 7));
        let WordSource::Signed { shift, .. } = dense.source else { panic!("signs") };
        assert_eq!(shift, 2);
    }

    #[test]
    fn a_dense_route_negates_where_the_top_bit_of_its_word_is_set() {
        let dense = Route::RandomDense { shift: Some(0) }.delivery(20, 3, 9, 2);
        let WordSource::Signed { signs, .. } = dense.source else { panic!("signs") };
        let place = Place { layer: 2, ..Place::global(9, Site::Route, 0) };
        let drawn: Vec<i16> =
            place.words().take(60).map(|word| if word < 1 << 31 { 1 } else { -1 }).collect();
        for (output, signs) in signs.chunks(20).enumerate() {
            assert!(signs.iter().eq(drawn.iter().skip(output).step_by(3)));
        }
    }

    #[test]
    fn random_routes_depend_on_seed_and_layer() {
        let taps = |seed, layer| Route::RandomSparse.delivery(200, 10, seed, layer).taps.words;
        assert_eq!(taps(1, 0), taps(1, 0));
        assert!(taps(1, 0) != taps(2, 0) && taps(1, 0) != taps(1, 1));
        assert!((0..10).all(|c| taps(1, 0).contains(&c)));
    }

    proptest! {
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
