//! What updates have to do with the gradient: how large a layer's updates are, and how much they agree with the direction that
//! back-propagation would take through the same network.
//!
//! ```text
//! gate        u = S_heard a'                  stream n takes -S;  its root mean square, 1 is a full word and the steepest slope
//! sum         M = +- sum over reads of x u    of each array; with centred updates x is less its mean over what was read
//! gradient    G: the same with d for u;       outputs: d = S a',  stream n of a readout that subtracts takes -S
//!             below: d = a' times the sum over arrays above of +- level d, each position of a pool hearing the word of its square
//! agreement   cos = <M, G> / sqrt(<M, M> <G, G>)        over all cells of the layer
//! ```
//!
//! `S` are the words of the error unit, `x` drive codes, `a'` slopes out of the table; nothing is rounded or bounded on the
//! way, no optimiser asked. The Jacobian of a normalisation is left out, as it is on the chip. After the figure of the cosine
//! similarity and that of local surrogate gradients in "Diffusing Blame" (Fujita et al.), which this does for any network here.
//!
//! Floating point, by + - * / and square roots in a fixed order: the same figures on every machine.

mod gradient;
mod stage;
#[cfg(test)]
mod tests;

use crate::chip::engine::Engine;
use crate::chip::layer::{Delivery, WordSource};
use crate::learn::route::Route;
use stage::{Deltas, Stage, Sums};

/// Ways for errors to reach hidden units, by name: each unit hears one word, one drawn word, the sum of all, or a sum with
/// random signs.
const ROUTES: [(&str, Route); 4] = [
    ("modulo", Route::Modulo { taps: 1, shift: None }),
    ("random_sparse", Route::RandomSparse),
    ("scalar_broadcast", Route::ScalarBroadcast),
    ("random_dense", Route::RandomDense { shift: None }),
];

/// What the updates of a layer are like.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct LayerAnalysis {
    /// Number of the layer, from 0 at the input.
    pub layer: usize,
    /// Cells of its arrays.
    pub cells: u64,
    /// Root mean square of the gates that its units form on the run's own route; 1 is a full error word and the steepest
    /// slope. `None` where words come from the layer above.
    pub gate: Option<f64>,
    /// The same where units hear what back-propagation would tell them, in units of a full word times a level.
    pub gradient_gate: f64,
    /// Mean size of the sum of a cell, a read: 1 is a full drive and a full gate. `None` as of `gate`.
    pub update: Option<f64>,
    /// Agreement of the update on the run's own route with the gradient, -1 to 1; `None` as of `gate`, and where nothing moves.
    pub agreement: Option<f64>,
    /// The same, had its units heard errors on these routes; empty for the outputs, which hear their own.
    pub routes: Vec<(&'static str, Option<f64>)>,
}

/// What updates are like in one state of a run.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Analysed {
    /// Epochs finished.
    pub epoch: u32,
    /// Layers, from the input to the outputs.
    pub layers: Vec<LayerAnalysis>,
}

/// Analyses the layers of a network for the samples that it has read last, given the words that their errors make,
/// `[sample][output]`. Random routes are drawn by seed.
#[must_use]
pub(crate) fn analyse(engine: &Engine, words: &[i16], seed: u64) -> Vec<LayerAnalysis> {
    let stages: Vec<_> = (0..engine.layers().len()).map(|at| Stage::of(engine, at)).collect();
    let last = stages.len() - 1;
    let outputs = stages[last].spec.units;
    let heard_by_outputs: Vec<f64> = words.iter().map(|&word| f64::from(word)).collect();
    let mut truth = stages[last].deltas(&heard_by_outputs);
    let mut all = Vec::new();
    for layer in (0..=last).rev() {
        let stage = &stages[layer];
        let gradient = stage.sums(&truth);
        let along = |delivery: &Delivery| -> Option<(Deltas, Sums)> {
            let deltas = stage.deltas(&heard(delivery, words, outputs)?);
            let sums = stage.sums(&deltas);
            Some((deltas, sums))
        };
        let own = along(&engine.layers()[layer].delivery);
        let index = engine.layers()[layer].index;
        let route = |&(name, route): &(&'static str, Route)| {
            let delivery = route.delivery(stage.spec.units, outputs, seed, index);
            (name, along(&delivery).and_then(|(_, sums)| sums.agreement(&gradient)))
        };
        let routes = if layer == last { vec![] } else { ROUTES.iter().map(route).collect() };
        all.push(LayerAnalysis {
            layer: usize::from(index),
            cells: stage.cells(),
            gate: own.as_ref().map(|(deltas, _)| stage.root_mean_square(deltas)),
            gradient_gate: stage.root_mean_square(&truth),
            update: own.as_ref().map(|(_, sums)| stage.mean_size(sums)),
            agreement: own.as_ref().and_then(|(_, sums)| sums.agreement(&gradient)),
            routes,
        });
        if let Some(below) = layer.checked_sub(1) {
            truth = stages[below].through(&gradient::back(stage, &truth));
        }
    }
    all.reverse();
    all
}

/// What units hear, `[sample][unit]`, before their stream's sign: sums of output words, not bounded. Nothing where words come
/// from the layer above, or one a position.
fn heard(delivery: &Delivery, words: &[i16], outputs: usize) -> Option<Vec<f64>> {
    let mut out = Vec::new();
    for words in words.chunks_exact(outputs.max(1)) {
        let words: Vec<f64> = words.iter().map(|&word| f64::from(word)).collect();
        let bus: Vec<f64> = match &delivery.source {
            WordSource::Output => words,
            WordSource::Sum { .. } => vec![words.iter().sum()],
            WordSource::Signed { signs, .. } => {
                let width = delivery.taps.width;
                let of = |unit: usize| {
                    let terms = words.iter().enumerate();
                    terms.map(|(at, word)| word * f64::from(signs[at * width + unit])).sum()
                };
                (0..width).map(of).collect()
            }
            WordSource::Above => return None,
        };
        let taps = delivery.taps.words.chunks_exact(delivery.taps.per_unit);
        out.extend(taps.map(|taps| taps.iter().map(|&at| bus[usize::from(at)]).sum::<f64>()));
    }
    Some(out)
}
