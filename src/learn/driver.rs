//! Carries out updates: puts numbers into a rule's steps and hands them to the engine.
//!
//! The driver owns what learning keeps beside the chip: the error unit and the number of updates done. It is
//! driven with drive codes and labels, or, by other tasks, with drive codes and errors.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use super::error::ErrorUnit;
use super::route::Delivery;
use super::rule::{Rule, Step, UpdateMode, Words};
use crate::chip::engine::{Engine, Operation, Side, Write};
use crate::chip::ledger::{During, Event};
use crate::num::fixed::{ErrorBits, rail};

/// How a network learns.
#[derive(Debug, Clone)]
pub struct Learning {
    /// The rule.
    pub rule: Rule,
    /// When a batch is written.
    pub mode: UpdateMode,
    /// How errors reach each layer.
    pub deliveries: Vec<Delivery>,
    /// Shifts of each layer: `(first update, k)`, in order.
    pub shifts: Vec<Vec<(u64, u32)>>,
}

/// Learning in progress on an engine.
#[derive(Debug)]
pub struct Driver {
    engine: Engine,
    learning: Learning,
    unit: ErrorUnit,
    updates: u64,
}

impl Driver {
    /// Starts learning on an engine.
    #[must_use]
    pub fn new(engine: Engine, learning: Learning, unit: ErrorUnit) -> Self {
        Self { engine, learning, unit, updates: 0 }
    }

    /// The chip.
    #[must_use]
    pub const fn engine(&self) -> &Engine {
        &self.engine
    }

    /// The chip, to read with or to restore.
    pub const fn engine_mut(&mut self) -> &mut Engine {
        &mut self.engine
    }

    /// The error unit.
    #[must_use]
    pub const fn unit(&self) -> &ErrorUnit {
        &self.unit
    }

    /// The error unit, to restore.
    pub const fn unit_mut(&mut self) -> &mut ErrorUnit {
        &mut self.unit
    }

    /// Batches learnt from.
    #[must_use]
    pub const fn updates(&self) -> u64 {
        self.updates
    }

    /// Restores the number of batches learnt from.
    pub const fn set_updates(&mut self, updates: u64) {
        self.updates = updates;
    }

    /// The shift of a layer for the update in progress.
    #[must_use]
    pub fn shift(&self, layer: usize) -> u32 {
        let table = &self.learning.shifts[layer];
        let after = table.partition_point(|&(first, _)| first <= self.updates);
        table[after.max(1) - 1].1
    }

    /// Reads a batch of drive codes through all layers.
    pub fn read(&mut self, codes: &[u8]) {
        self.engine.execute(&Operation::LoadDrives { codes });
        for layer in 0..self.engine.layers().len() {
            self.engine.execute(&Operation::Forward { layer, side: Side::Rows });
        }
    }

    /// One update from drive codes; `errors` gives the error of each output for a sample, `[sample][output]`,
    /// once that sample has been read: it is handed the engine, the first sample's number in the batch and the
    /// list to extend.
    pub fn learn(&mut self, codes: &[u8], mut errors: impl FnMut(&Engine, usize, &mut Vec<i32>)) {
        let inputs = self.engine.layers()[0].spec.inputs;
        match self.learning.mode {
            UpdateMode::Accumulate | UpdateMode::Replay => {
                self.read(codes);
                let mut list = Vec::new();
                errors(&self.engine, 0, &mut list);
                self.update(&list);
            }
            UpdateMode::Online => {
                for (sample, codes) in codes.chunks_exact(inputs).enumerate() {
                    self.read(codes);
                    let mut list = Vec::new();
                    errors(&self.engine, sample, &mut list);
                    self.update(&list);
                }
            }
        }
        self.updates += 1;
    }

    /// Writes what the loaded samples' errors ask for.
    fn update(&mut self, errors: &[i32]) {
        let layers = self.engine.layers().len();
        let outputs = self.engine.layers()[layers - 1].spec.units;
        let (words, saturated) = self.unit.words(errors, outputs);
        self.charge(layers - 1, Event::SaturatedErrors, saturated);
        let samples = self.engine.samples();
        if self.unit.waits_for_batch() {
            self.engine.centre(samples, outputs);
        }
        let mut heard = false;
        for step in self.learning.rule.steps(self.learning.mode, layers, samples) {
            match step {
                Step::Error { layer, samples, words: Words::Routed } => {
                    let delivery = &self.learning.deliveries[layer];
                    let common = delivery.is_common();
                    let (routed, saturated, products) = delivery.words(&words, outputs);
                    self.charge(layer, Event::SaturatedErrors, saturated);
                    self.charge(layer, Event::Multiplies, products);
                    let shared = heard && common;
                    heard = common;
                    let words = &routed;
                    self.engine.execute(&Operation::Error { layer, samples, words, shared });
                }
                Step::Error { layer, samples, words: Words::Above } => {
                    let (words, saturated) = self.backward(layer + 1);
                    self.charge(layer, Event::SaturatedErrors, saturated);
                    let (words, shared) = (&words, false);
                    self.engine.execute(&Operation::Error { layer, samples, words, shared });
                    heard = false;
                }
                Step::ReadColumns { layer } => {
                    self.engine.execute(&Operation::Forward { layer, side: Side::Columns });
                }
                Step::Update { layer, write, samples } => {
                    let shift = if write == Write::Add { 0 } else { self.shift(layer) };
                    self.engine.execute(&Operation::Update { layer, write, samples, shift });
                }
            }
        }
        self.engine.settle();
    }

    /// Error words for the layer below `layer`: its row sums in units of an error word.
    fn backward(&self, layer: usize) -> (Vec<i16>, u64) {
        let hardware = self.engine.hardware();
        let spec = &self.engine.layers()[layer].spec;
        backward_words(
            self.engine.backward(layer),
            hardware.cell.level_bits.get(),
            spec.weight_max_log2,
            hardware.digital.error_bits,
        )
    }

    fn charge(&mut self, layer: usize, event: Event, count: u64) {
        let phase = self.engine.phase();
        self.engine.ledger_mut(phase).add(layer, 0, During::Error, event, count);
    }
}

/// Row sums of a transposed read as error words.
///
/// ```text
/// S_below = sat_eb( rsh( d, level_bits - log2(weight_max) + 8 - error_bits ) )
/// ```
///
/// A level is worth `weight_max / 2^level_bits` and a gate `2^(8 - error_bits)` of a word; a negative shift is a
/// multiplication. The derivative's peak, `1 / (2 alpha)`, is left to the layer's rate.
fn backward_words(
    sums: &[i64],
    level_bits: u32,
    weight_max_log2: i32,
    bits: ErrorBits,
) -> (Vec<i16>, u64) {
    let shift = i64::from(level_bits) - i64::from(weight_max_log2) + 8 - i64::from(bits.get());
    let rail = rail(bits.get());
    let mut saturated = 0;
    // no branch: which sums saturate is hard to guess
    let mut bounded = |scaled: i64| {
        let word = scaled.clamp(-rail, rail);
        saturated += u64::from(word != scaled);
        word as i16
    };
    let mut words = vec![0; sums.len()];
    let pairs = words.iter_mut().zip(sums);
    match u32::try_from(shift) {
        Ok(0) => pairs.for_each(|(word, &d)| *word = bounded(d)),
        // `rsh` of at most 63
        Ok(right) => {
            let right = right.min(63);
            pairs.for_each(|(word, &d)| *word = bounded((d >> right) + (d >> (right - 1) & 1)));
        }
        Err(_) => pairs.for_each(|(word, &d)| *word = bounded(d << shift.unsigned_abs())),
    }
    (words, saturated)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::chip::crossbar::kernel::Backend;
    use crate::chip::engine::Phase;
    use crate::chip::hardware::{DitherBits, Hardware};
    use crate::chip::layer::{DrivenBy, Layer, LayerSpec};
    use crate::chip::population::Wiring;
    use crate::learn::error::Centre;
    use crate::learn::route::Route;
    use crate::num::fixed::IncrementMax;
    use crate::num::tables::Activation;

    /// Two layers of a single stream, 2 to 2 to 2, with the given shifts.
    fn driver(rule: Rule, mode: UpdateMode, shifts: &[(u64, u32)]) -> Driver {
        let bits = ErrorBits::new(8).unwrap();
        let hardware = Hardware::reference()
            .with(|h| {
                h.tile.rows = 64;
                h.tile.columns = 64;
                h.write.increment_max = IncrementMax::new(127).unwrap();
                h.write.dither_bits = DitherBits::Zero;
            })
            .unwrap();
        let spec = LayerSpec {
            inputs: 2,
            units: 2,
            wiring: Wiring::Single,
            driven_by: DrivenBy::Shared,
            activation: Activation::Identity,
            weight_max_log2: 2,
            gain_64ths: [64, 64],
            constant_row: false,
        };
        let dense = Route::RandomDense { shift: Some(0) };
        let first = match rule {
            Rule::Bp => Delivery::own(2, bits),
            _ => Delivery::hidden(dense, 2, 2, bits, 1, 0),
        };
        let deliveries = vec![first, Delivery::output(2, bits)];
        let layers = deliveries.iter().zip(0..).map(|(delivery, index)| {
            Layer::new(index, spec.clone(), delivery.taps().clone(), &hardware)
        });
        let layers = layers.collect();
        let engine = Engine::new(hardware, Backend::Scalar, 1, layers);
        let shifts = vec![shifts.to_vec(); 2];
        let learning = Learning { rule, mode, deliveries, shifts };
        Driver::new(engine, learning, ErrorUnit::new(Centre::None, bits, 2))
    }

    #[test]
    fn a_shift_holds_from_its_first_update_to_the_next_one() {
        let mut driver = driver(Rule::Dfa, UpdateMode::Accumulate, &[(0, 3), (2, 4), (5, 6)]);
        let shifts = [0, 1, 2, 4, 5, 100].map(|updates| {
            driver.set_updates(updates);
            driver.shift(1)
        });
        assert_eq!(shifts, [3, 3, 4, 4, 6, 6]);
    }

    #[test]
    fn a_batch_is_one_update_however_often_it_writes() {
        for (mode, writes) in [(UpdateMode::Accumulate, 1), (UpdateMode::Online, 3)] {
            let mut driver = driver(Rule::Dfa, mode, &[(0, 10)]);
            for batch in 1..=2 {
                driver.learn(&[9; 6], |engine, _, list| list.extend(vec![0; 2 * engine.samples()]));
                assert_eq!(driver.updates(), batch);
            }
            assert_eq!(driver.engine().layers()[0].writes, [2 * writes; 2]);
        }
    }

    #[test]
    fn what_the_error_unit_clamps_and_multiplies_is_counted() {
        let mut driver = driver(Rule::Dfa, UpdateMode::Accumulate, &[(0, 10)]);
        driver.learn(&[9; 4], |_, _, list| list.extend([255, 255, 0, 0]));
        let ledger = driver.engine().ledger(Phase::Training);
        let count = |layer, event| ledger.get(layer, 0, During::Error, event);
        // both output words, and on the dense route every sum of two words that agree in sign
        assert_eq!(count(1, Event::SaturatedErrors), 2);
        let signs: Vec<bool> = crate::num::draw::Place::global(1, crate::num::draw::Site::Route, 0)
            .words()
            .take(4)
            .map(|word| word >> 31 == 1)
            .collect();
        let agree = signs.chunks(2).filter(|pair| pair[0] == pair[1]).count() as u64;
        assert_eq!(count(0, Event::SaturatedErrors), agree);
        // two samples, two units: two products each of the dense route, and one of each unit's gate
        assert_eq!([count(0, Event::Multiplies), count(1, Event::Multiplies)], [8 + 4, 4]);
    }

    #[test]
    fn backward_sums_are_scaled_by_the_worth_of_a_level_and_bounded() {
        let eight = ErrorBits::new(8).unwrap();
        // 8 bits, weight_max 4: 64 levels are a weight of 1
        let (words, saturated) =
            backward_words(&[64, 32, -32, 31, 64 * 127, 64 * 128], 8, 2, eight);
        assert_eq!((words, saturated), (vec![1, 1, 0, 0, 127, 127], 1));
        // 1 bit, weight_max 4: a level is worth 2
        assert_eq!(backward_words(&[3, -5], 1, 2, eight).0, [6, -10]);
    }

    #[test]
    fn sums_are_written_with_the_shift_of_the_update() {
        for (shift, moved) in [(30, false), (10, true)] {
            let mut driver = driver(Rule::Dfa, UpdateMode::Accumulate, &[(0, shift)]);
            driver.learn(&[255; 4], |_, _, list| list.extend([200, -200, 200, -200]));
            let ledger = driver.engine().ledger(Phase::Training);
            assert_eq!(ledger.total(Event::PulsesAttempted) > 0, moved, "k = {shift}");
        }
    }

    #[test]
    fn back_propagation_hands_down_the_row_sums_of_the_layer_above() {
        let mut driver = driver(Rule::Bp, UpdateMode::Accumulate, &[(0, 10)]);
        for (row, levels) in [[64, 0], [0, 255]].iter().enumerate() {
            let load = Operation::LoadWeights { layer: 1, array: 0, row, levels };
            driver.engine_mut().execute(&load);
        }
        driver.learn(&[255, 0], |_, _, list| list.extend([40, 254]));
        // words 20 and 127 give gates 20 and 127; 64 levels are a weight of 1
        assert_eq!(driver.engine().backward(1), [20 * 64, 127 * 255]);
        assert_eq!(driver.backward(1), (vec![20, 127], 1));
        let ledger = driver.engine().ledger(Phase::Training);
        assert_eq!(ledger.get(0, 0, During::Error, Event::SaturatedErrors), 1);
        // units 0 and 1 of the first layer hear them: rsh(255 x 20, 11) and rsh(255 x 127, 11)
        let levels: Vec<u16> = driver.engine().layers()[0].arrays[0].levels().collect();
        assert_eq!(levels, [2, 16, 0, 0]);
    }
}
