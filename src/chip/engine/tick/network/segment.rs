//! Cuts a list of operations into segments: the rules of `schedule`, read off the list as a whole.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use std::ops::Range;

use crate::chip::engine::{Operation, Side, Write};

/// Operations that overlap in time.
#[derive(Debug)]
pub(super) enum Segment<'a> {
    LoadDrives {
        codes: &'a [u8],
    },
    LoadWeights {
        layer: usize,
        array: usize,
        row: usize,
        levels: &'a [u16],
    },
    Reads {
        layers: Range<usize>,
        samples: usize,
    },
    Rounds(Vec<&'a Operation<'a>>),
    /// Layers and shifts.
    Writes(Vec<(usize, u32)>),
}

/// Segments of a list that begins with so many samples loaded, of so many codes each.
pub(super) fn cut<'a>(
    operations: &'a [Operation<'a>],
    mut samples: usize,
    inputs: usize,
) -> Vec<Segment<'a>> {
    let mut segments: Vec<Segment<'a>> = Vec::new();
    for operation in operations {
        match *operation {
            Operation::LoadWeights { layer, array, row, levels } => {
                segments.push(Segment::LoadWeights { layer, array, row, levels });
            }
            Operation::LoadDrives { codes } => {
                samples = codes.len() / inputs;
                segments.push(Segment::LoadDrives { codes });
            }
            Operation::Forward { side: Side::Rows, .. } if samples == 0 => {}
            Operation::Forward { layer, side: Side::Rows } => match segments.last_mut() {
                Some(Segment::Reads { layers, .. }) if layers.end == layer => layers.end += 1,
                _ => segments.push(Segment::Reads { layers: layer..layer + 1, samples }),
            },
            Operation::Update { layer, write: Write::Program, shift, .. } => {
                match segments.last_mut() {
                    Some(Segment::Writes(writes)) if writes.iter().all(|w| w.0 != layer) => {
                        writes.push((layer, shift));
                    }
                    _ => segments.push(Segment::Writes(vec![(layer, shift)])),
                }
            }
            _ if nothing(operation, samples) => {}
            _ => match segments.last_mut() {
                Some(Segment::Rounds(list)) if fits(list, operation) => list.push(operation),
                _ => segments.push(Segment::Rounds(vec![operation])),
            },
        }
    }
    segments
}

/// Whether an operation of a round is for no sample.
fn nothing(operation: &Operation<'_>, samples: usize) -> bool {
    match operation {
        Operation::Error { samples, .. } | Operation::Update { samples, .. } => samples.is_empty(),
        _ => samples == 0,
    }
}

/// Whether playing sample by sample what is here with one more operation changes nothing.
fn fits(list: &[&Operation<'_>], operation: &Operation<'_>) -> bool {
    let written = |operation: &Operation<'_>| match operation {
        Operation::Update { layer, write: Write::Now, samples, .. } => {
            Some((*layer, samples.start))
        }
        _ => None,
    };
    let read = |operation: &Operation<'_>| matches!(operation, Operation::Forward { .. });
    let mut before = list.iter().filter_map(|operation| written(operation));
    if read(operation) {
        return before.next().is_none();
    }
    if let Operation::Update { layer, write: Write::Add, samples, .. } = operation {
        // what is added does not come before a write that it came after
        return before.all(|(l, s)| l != *layer || s < samples.start);
    }
    let Some((layer, sample)) = written(operation) else {
        return true;
    };
    let later = |(l, s): (usize, usize)| s < sample || (s == sample && l != layer);
    !list.iter().any(|operation| read(operation)) && before.all(later)
}
