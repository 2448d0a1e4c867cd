//! Rules: makers of operation lists. A rule says in which order errors are delivered and layers written; it
//! never touches a cell.

use super::error::OutputError;
use crate::chip::engine::Write;
use crate::chip::population::Wiring;
use crate::num::tables::Activation;
use std::ops::Range;

mod bp;
mod ed;

/// One step of an update, before numbers are put in.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Step {
    /// `ERR` of a layer.
    Error {
        /// Which layer.
        layer: usize,
        /// Which samples.
        samples: Range<usize>,
    },
    /// `FWD(columns)` of a layer.
    ReadColumns {
        /// Which layer.
        layer: usize,
    },
    /// `UPD` of a layer.
    Update {
        /// Which layer.
        layer: usize,
        /// Which field.
        write: Write,
        /// Which samples.
        samples: Range<usize>,
    },
}

/// When a batch is written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum UpdateMode {
    /// Sums over the batch in digital accumulators, written once.
    Accumulate,
    /// One forward pass fixes the gates; then one write a sample, in batch order.
    Replay,
    /// A forward pass and a write a sample.
    Online,
}

/// What is taken from a network to see whether it is needed: a control that has to fail where it is.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum Control {
    /// Nothing.
    #[default]
    None,
    /// Hidden layers hear no error and are not written: the last layer alone learns.
    FrozenHidden,
    /// Stream n hears errors as stream p does, and not negated, in hidden layers.
    SameSignHidden,
    /// The same in all layers.
    SameSign,
}

impl Control {
    /// Whether stream n of a layer hears the wrong sign.
    #[must_use]
    pub(crate) const fn is_alike(self, last: bool) -> bool {
        match self {
            Self::None | Self::FrozenHidden => false,
            Self::SameSignHidden => !last,
            Self::SameSign => true,
        }
    }
}

/// What a last layer is read out of.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Readout {
    /// Stream p.
    P,
    /// All its streams: `acc_p - acc_n`, or the one that there is.
    All,
}

impl Readout {
    /// That of a last layer with units of this kind, from which errors of this kind come.
    #[must_use]
    pub fn of(activation: Activation, error: OutputError) -> Self {
        match (activation, error) {
            (Activation::Accumulator, OutputError::OneVsAll) => Self::All,
            _ => Self::P,
        }
    }
}

/// A learning rule.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Rule {
    /// Error diffusion: every layer hears the output error over its route.
    Ed,
    /// As `Ed`, on two populations whose pathways are differential pairs: what Dale's law costs.
    EdNonDalean,
    /// Kaneko's original: error diffusion that only potentiates.
    Kaneko,
    /// Direct feedback alignment on differential pairs: random dense route.
    Dfa,
    /// Back-propagation on differential pairs, by transposed reads.
    Bp,
}

impl Rule {
    /// Whether the rule keeps Dale's law.
    #[must_use]
    pub const fn is_dalean(self) -> bool {
        matches!(self, Self::Ed | Self::Kaneko)
    }

    /// The arrays of a layer whose units drive others and, with `readout`, of a last one: whether it is read out of all
    /// streams or of stream p alone.
    #[must_use]
    pub const fn wiring(self, readout: Option<Readout>) -> Wiring {
        match (self, readout) {
            (Self::Ed | Self::Kaneko, None | Some(Readout::All)) => Wiring::Dual,
            (Self::Ed | Self::Kaneko, Some(Readout::P)) => Wiring::DualReadout,
            (Self::EdNonDalean, None | Some(Readout::All)) => Wiring::DualPairs,
            (Self::EdNonDalean, Some(Readout::P)) => Wiring::DualReadoutPairs,
            (Self::Dfa | Self::Bp, _) => Wiring::Single,
        }
    }

    /// The steps of one update of `layers` layers over a batch whose forward pass is done.
    #[must_use]
    pub(crate) fn steps(
        self,
        control: Control,
        mode: UpdateMode,
        layers: usize,
        samples: usize,
    ) -> Vec<Step> {
        let mut steps = self.all_steps(mode, layers, samples);
        if control == Control::FrozenHidden {
            steps.retain(|step| match step {
                Step::Error { layer, .. } | Step::Update { layer, .. } => layer + 1 == layers,
                // what is read backwards is for a layer below
                Step::ReadColumns { .. } => false,
            });
        }
        steps
    }

    fn all_steps(self, mode: UpdateMode, layers: usize, samples: usize) -> Vec<Step> {
        match self {
            Self::Ed | Self::EdNonDalean | Self::Kaneko | Self::Dfa => {
                ed::steps(mode, layers, samples)
            }
            Self::Bp => bp::steps(mode, layers, samples),
        }
    }
}

/// The writes of a batch: all samples added and written once, or each written on its own.
fn writes(mode: UpdateMode, layers: usize, samples: usize) -> Vec<Step> {
    let update = |layer, write, samples| Step::Update { layer, write, samples };
    let mut steps = Vec::new();
    match mode {
        UpdateMode::Accumulate => {
            steps.extend((0..layers).map(|layer| update(layer, Write::Add, 0..samples)));
            steps.extend((0..layers).map(|layer| update(layer, Write::Program, 0..0)));
        }
        UpdateMode::Replay | UpdateMode::Online => {
            for sample in 0..samples {
                let each = (0..layers).map(|l| update(l, Write::Now, sample..sample + 1));
                steps.extend(each);
            }
        }
    }
    steps
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ed_delivers_each_layer_once_and_never_reads_backwards() {
        for rule in [Rule::Ed, Rule::EdNonDalean, Rule::Kaneko, Rule::Dfa] {
            let steps = rule.steps(Control::None, UpdateMode::Accumulate, 2, 5);
            assert_eq!(
                steps,
                [
                    Step::Error { layer: 0, samples: 0..5 },
                    Step::Error { layer: 1, samples: 0..5 },
                    Step::Update { layer: 0, write: Write::Add, samples: 0..5 },
                    Step::Update { layer: 1, write: Write::Add, samples: 0..5 },
                    Step::Update { layer: 0, write: Write::Program, samples: 0..0 },
                    Step::Update { layer: 1, write: Write::Program, samples: 0..0 },
                ]
            );
        }
    }

    #[test]
    fn frozen_layers_hear_nothing_and_are_not_written() {
        for rule in [Rule::Ed, Rule::EdNonDalean, Rule::Dfa, Rule::Bp] {
            assert_eq!(
                rule.steps(Control::FrozenHidden, UpdateMode::Accumulate, 3, 5),
                [
                    Step::Error { layer: 2, samples: 0..5 },
                    Step::Update { layer: 2, write: Write::Add, samples: 0..5 },
                    Step::Update { layer: 2, write: Write::Program, samples: 0..0 },
                ],
                "{rule:?}"
            );
        }
    }

    #[test]
    fn differential_pairs_break_dales_law() {
        let rules = [Rule::Ed, Rule::Kaneko, Rule::EdNonDalean, Rule::Dfa, Rule::Bp];
        assert_eq!(rules.map(Rule::is_dalean), [true, true, false, false, false]);
        for rule in rules {
            for readout in [None, Some(Readout::P), Some(Readout::All)] {
                let breaks = rule.wiring(readout).shift_extra() == 1;
                assert_eq!(breaks, !rule.is_dalean(), "{rule:?} {readout:?}");
            }
        }
    }

    #[test]
    fn bp_reads_each_layer_above_before_it_is_written() {
        let steps = Rule::Bp.steps(Control::None, UpdateMode::Replay, 2, 2);
        assert_eq!(
            steps[..3],
            [
                Step::Error { layer: 1, samples: 0..2 },
                Step::ReadColumns { layer: 1 },
                Step::Error { layer: 0, samples: 0..2 },
            ]
        );
        assert_eq!(
            steps[3..],
            [
                Step::Update { layer: 0, write: Write::Now, samples: 0..1 },
                Step::Update { layer: 1, write: Write::Now, samples: 0..1 },
                Step::Update { layer: 0, write: Write::Now, samples: 1..2 },
                Step::Update { layer: 1, write: Write::Now, samples: 1..2 },
            ]
        );
    }
}
