//! Streams, pathways and polarity: how unsigned arrays make a signed sum.
//!
//! ```text
//! dual stream     target p: E = pp, I = np        target n: E = nn, I = pn
//! single stream   W = E - I of two unsigned cells (codes 0 and 4): breaks Dale's law, for baselines
//! dual pairs      each of the four pathways is such a pair: what both pairs of a target read adds up
//! ```
//!
//! A pathway is written source then target. `pp` and `nn` excite, `np` and `pn` inhibit; polarity belongs to
//! the pathway, never to a cell. The I cell of a differential pair adds 4 to the code. See docs/MODEL.md, 1.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

/// Activity of the excitatory (`P`) or inhibitory (`N`) population.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
#[repr(u8)]
pub enum Stream {
    /// Excitatory neurons.
    P = 0,
    /// Inhibitory neurons.
    N = 1,
}

impl Stream {
    /// Place in an array of streams.
    #[must_use]
    pub const fn index(self) -> usize {
        self as usize
    }
}

/// Whether a pathway's current adds or subtracts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Polarity {
    /// Adds.
    Excites,
    /// Subtracts.
    Inhibits,
}

/// One array of a layer: where its drives come from, where its current goes, with which sign.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Pathway {
    /// Number in draws, ledger and hash.
    pub code: u8,
    /// Name in reports.
    pub name: &'static str,
    /// Whose activity drives the rows.
    pub source: Stream,
    /// Whose units the columns are.
    pub target: Stream,
    /// Sign of the contribution.
    pub polarity: Polarity,
}

impl Pathway {
    /// The code of the arrays that have this name, in whatever wiring.
    #[must_use]
    pub fn named(name: &str) -> Option<u8> {
        all().find(|pathway| pathway.name == name).map(|pathway| pathway.code)
    }

    /// Names of all arrays that there are.
    #[must_use]
    pub fn names() -> Vec<&'static str> {
        all().map(|pathway| pathway.name).collect()
    }
}

/// Every array that there is, by its name.
fn all() -> impl Iterator<Item = &'static Pathway> {
    const ALONE: [Pathway; 6] = [PP, NP, NN, PN, PLUS, MINUS];
    ALONE.iter().chain(&PAIRS[4..])
}

const fn pathway(
    code: u8,
    name: &'static str,
    source: Stream,
    target: Stream,
    polarity: Polarity,
) -> Pathway {
    Pathway { code, name, source, target, polarity }
}

/// Banks a target can have.
pub const BANKS_MAX: usize = 4;

use Polarity::{Excites, Inhibits};
use Stream::{N, P};

const PP: Pathway = pathway(0, "pp", P, P, Excites);
const NP: Pathway = pathway(1, "np", N, P, Inhibits);
const NN: Pathway = pathway(2, "nn", N, N, Excites);
const PN: Pathway = pathway(3, "pn", P, N, Inhibits);
const PLUS: Pathway = pathway(0, "e", P, P, Excites);
const MINUS: Pathway = pathway(4, "i", P, P, Inhibits);
/// Pathways as differential pairs: those that excite, then those that inhibit.
const PAIRS: [Pathway; 8] = [
    PP,
    Pathway { polarity: Excites, ..NP },
    NN,
    Pathway { polarity: Excites, ..PN },
    pathway(4, "pp_i", P, P, Inhibits),
    pathway(5, "np_i", N, P, Inhibits),
    pathway(6, "nn_i", N, N, Inhibits),
    pathway(7, "pn_i", P, N, Inhibits),
];

/// How a layer's arrays are wired.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Wiring {
    /// Two populations, four arrays.
    Dual,
    /// Two populations read, one read out: `pp` and `np` only.
    DualReadout,
    /// One signed stream of differential pairs.
    Single,
    /// Two populations whose four pathways are differential pairs.
    DualPairs,
    /// Two populations read, one read out, both of its pathways differential pairs.
    DualReadoutPairs,
}

impl Wiring {
    /// Name in files.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Dual => "dual",
            Self::DualReadout => "dual_readout",
            Self::Single => "single",
            Self::DualPairs => "dual_pairs",
            Self::DualReadoutPairs => "dual_readout_pairs",
        }
    }

    /// The arrays, in code order.
    #[must_use]
    pub const fn pathways(self) -> &'static [Pathway] {
        match self {
            Self::Dual => &[PP, NP, NN, PN],
            Self::DualReadout => &[PP, NP],
            Self::Single => &[PLUS, MINUS],
            Self::DualPairs => &PAIRS,
            Self::DualReadoutPairs => &[PAIRS[0], PAIRS[1], PAIRS[4], PAIRS[5]],
        }
    }

    /// Populations whose units the columns are.
    #[must_use]
    pub const fn targets(self) -> &'static [Stream] {
        match self {
            Self::Dual | Self::DualPairs => &[P, N],
            Self::DualReadout | Self::DualReadoutPairs | Self::Single => &[P],
        }
    }

    /// Populations that drive the rows.
    #[must_use]
    pub const fn sources(self) -> &'static [Stream] {
        match self {
            Self::Dual | Self::DualReadout | Self::DualPairs | Self::DualReadoutPairs => &[P, N],
            Self::Single => &[P],
        }
    }

    /// Places, in [`Wiring::pathways`], of the banks of a target, in pairs of one that excites and one that inhibits.
    /// A pair is what a physical tile holds; what all pairs read adds up in the target's accumulators.
    #[must_use]
    pub const fn pairs(self, target: Stream) -> &'static [[usize; 2]] {
        match (self, target) {
            (Self::DualPairs, P) => &[[0, 4], [1, 5]],
            (Self::DualPairs, N) => &[[2, 6], [3, 7]],
            (Self::DualReadoutPairs, _) => &[[0, 2], [1, 3]],
            (_, P) => &[[0, 1]],
            (_, N) => &[[2, 3]],
        }
    }

    /// The pairs of all targets, target after target.
    pub fn planes(self) -> impl Iterator<Item = (Stream, [usize; 2])> {
        let of = move |&target| self.pairs(target).iter().map(move |&pair| (target, pair));
        self.targets().iter().flat_map(of)
    }

    /// Places of the banks of a target, each of which has the polarity of its pathway.
    #[must_use]
    pub fn banks(self, target: Stream) -> &'static [usize] {
        self.pairs(target).as_flattened()
    }

    /// Bits added to the rate's shift: a differential pair moves by two cells.
    #[must_use]
    pub const fn shift_extra(self) -> u32 {
        match self {
            Self::Dual | Self::DualReadout => 0,
            Self::Single | Self::DualPairs | Self::DualReadoutPairs => 1,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ALL: [Wiring; 5] = [
        Wiring::Dual,
        Wiring::DualReadout,
        Wiring::Single,
        Wiring::DualPairs,
        Wiring::DualReadoutPairs,
    ];

    #[test]
    fn the_banks_of_a_target_excite_and_inhibit_it() {
        for wiring in ALL {
            for &target in wiring.targets() {
                for pair in wiring.pairs(target) {
                    let [e, i] = pair.map(|at| wiring.pathways()[at]);
                    assert_eq!((e.target, i.target), (target, target));
                    assert_eq!((e.polarity, i.polarity), (Excites, Inhibits));
                }
                let mine = wiring.pathways().iter().filter(|pathway| pathway.target == target);
                assert_eq!(mine.count(), wiring.banks(target).len(), "every array is a bank once");
                assert!(wiring.banks(target).len() <= BANKS_MAX);
            }
            assert!(wiring.pathways().is_sorted_by_key(|pathway| pathway.code));
        }
    }

    #[test]
    fn a_pair_joins_two_cells_of_one_pathway_and_the_one_that_inhibits_adds_4_to_the_code() {
        for wiring in ALL.into_iter().filter(|wiring| wiring.shift_extra() == 1) {
            for (_, pair) in wiring.planes() {
                let [e, i] = pair.map(|at| wiring.pathways()[at]);
                assert_eq!((e.source, e.target, e.code + 4), (i.source, i.target, i.code));
            }
        }
    }

    #[test]
    fn a_pathway_excites_exactly_when_source_and_target_agree() {
        for pathway in Wiring::Dual.pathways() {
            assert_eq!(pathway.polarity == Excites, pathway.source == pathway.target);
        }
    }
}
