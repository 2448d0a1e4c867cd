//! Errors on their way down, through the levels of a layer.

use super::stage::{Deltas, Stage};
use crate::chip::population::Stream;

/// Errors of what drives a layer, by source stream, `[sample][code]`: what the gates of its units make of its levels.
pub(super) fn back(stage: &Stage, deltas: &Deltas) -> Deltas {
    let (units, positions) = (stage.spec.units, stage.spec.positions());
    let inputs = stage.spec.sample_inputs();
    let mut errors = [Stream::P, Stream::N].map(|source| {
        let there = stage.spec.wiring.sources().contains(&source);
        vec![0.0; if there { stage.samples * inputs } else { 0 }]
    });
    for (way, sign, levels) in stage.arrays() {
        let levels: Vec<f64> = levels.iter().map(|&level| sign * f64::from(level)).collect();
        let errors = &mut errors[way.source.index()];
        let gates = deltas[way.target.index()].chunks_exact(units.max(1)).enumerate();
        for (read, gates) in gates.filter(|(_, gates)| gates.iter().any(|&gate| gate != 0.0)) {
            let errors = &mut errors[read / positions * inputs..][..inputs];
            stage.taps(read % positions, |row, codes| {
                let rows = levels[row * units..].chunks_exact(units);
                for (error, levels) in errors[codes].iter_mut().zip(rows) {
                    *error +=
                        levels.iter().zip(gates).map(|(level, gate)| level * gate).sum::<f64>();
                }
            });
        }
    }
    errors
}

/// Positions of a square of a pool, from its corner, in the order y, x.
pub(super) fn square(side: usize, across: usize) -> impl Iterator<Item = usize> {
    (0..side * side).map(move |at| at / side * across + at % side)
}
