//! What was executed, with its numbers, kept so that it can be played again: cycle by cycle, or to be looked at.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use std::ops::Range;

use super::{ErrorUnit, Operation, Side, Write, WritesDone};
use crate::chip::layer::Layer;

/// What an engine holds when an update begins: what plays its tape starts from here. Reads before it, as those of a rollout,
/// count for converters that track.
#[derive(Debug, Clone)]
pub struct UpdateStart {
    /// The layers: cells, ranges of converters and the codes counted for them, thresholds, what optimisers remember.
    pub layers: Vec<Layer>,
    /// The error unit.
    pub unit: ErrorUnit,
    /// Samples written one by one since ranges were last looked at.
    pub unlooked: u64,
    /// Samples loaded before, by phase.
    pub loaded: [u64; 3],
}

/// An operation with numbers of its own, or what happens between operations.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Recorded {
    /// `LOADW`.
    LoadWeights {
        /// Which layer.
        layer: usize,
        /// Which of its arrays.
        array: usize,
        /// Which row.
        row: usize,
        /// One level a column.
        levels: Vec<u16>,
    },
    /// `LOADX`.
    LoadDrives {
        /// `inputs` codes a sample.
        codes: Vec<u8>,
    },
    /// `FWD`.
    Forward {
        /// Which layer.
        layer: usize,
        /// Which side.
        side: Side,
    },
    /// The error unit makes output words.
    Words {
        /// Errors of the loaded samples, `[sample][output]`.
        errors: Vec<i32>,
    },
    /// Writes are done, on a chip whose converters track or whose units keep to a middle.
    Written(WritesDone),
    /// `ERR`.
    Error {
        /// Which layer.
        layer: usize,
        /// Which samples.
        samples: Range<usize>,
        /// Output words.
        words: Vec<i16>,
        /// Whether they are the words of the `ERR` before.
        shared: bool,
    },
    /// `UPD`.
    Update {
        /// Which layer.
        layer: usize,
        /// Which field.
        write: Write,
        /// Which samples.
        samples: Range<usize>,
        /// k.
        shift: u32,
    },
}

impl Recorded {
    pub(super) fn new(operation: &Operation<'_>) -> Self {
        match *operation {
            Operation::LoadWeights { layer, array, row, levels } => {
                Self::LoadWeights { layer, array, row, levels: levels.to_vec() }
            }
            Operation::LoadDrives { codes } => Self::LoadDrives { codes: codes.to_vec() },
            Operation::Forward { layer, side } => Self::Forward { layer, side },
            Operation::Error { layer, ref samples, words, shared } => {
                Self::Error { layer, samples: samples.clone(), words: words.to_vec(), shared }
            }
            Operation::Update { layer, write, ref samples, shift } => {
                Self::Update { layer, write, samples: samples.clone(), shift }
            }
        }
    }

    /// The operation, unless it is none of the tiles'.
    #[must_use]
    pub fn operation(&self) -> Option<Operation<'_>> {
        Some(match self {
            Self::LoadWeights { layer, array, row, levels } => {
                Operation::LoadWeights { layer: *layer, array: *array, row: *row, levels }
            }
            Self::LoadDrives { codes } => Operation::LoadDrives { codes },
            Self::Forward { layer, side } => Operation::Forward { layer: *layer, side: *side },
            Self::Words { .. } | Self::Written(_) => return None,
            Self::Error { layer, samples, words, shared } => {
                Operation::Error { layer: *layer, samples: samples.clone(), words, shared: *shared }
            }
            Self::Update { layer, write, samples, shift } => Operation::Update {
                layer: *layer,
                write: *write,
                samples: samples.clone(),
                shift: *shift,
            },
        })
    }
}
