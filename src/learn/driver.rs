//! Carries out updates: puts numbers into a rule's steps and hands them to the engine.
//!
//! The driver owns what learning keeps beside the chip: the number of updates done. What the chip does for it, the
//! engine counts. It is driven with drive codes and labels, or, by other tasks, with drive codes and errors.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use std::num::NonZeroU32;

use super::error::ErrorUnit;
use super::rule::{Control, Rule, Step, UpdateMode};
use crate::chip::engine::{Engine, Operation, Side, Write, WritesDone};
use crate::chip::state::{Section, State, StateError, Visitor, visit_counts};

/// How a network learns.
#[derive(Debug, Clone)]
pub(crate) struct Learning {
    /// The rule.
    pub(crate) rule: Rule,
    /// When a batch is written.
    pub(crate) mode: UpdateMode,
    /// What is taken from it.
    pub(crate) control: Control,
    /// Updates from a refresh to the next.
    pub(crate) refresh: Option<NonZeroU32>,
    /// Shifts of each layer: `(first update, k)`, in order.
    pub(crate) shifts: Vec<Vec<(u64, u32)>>,
}

/// Learning in progress on an engine.
#[derive(Debug)]
pub struct Driver {
    engine: Engine,
    learning: Learning,
    updates: u64,
}

impl Driver {
    /// Starts learning on an engine whose layers `learning` fits: the network builder sees to that.
    #[must_use]
    pub(crate) fn new(mut engine: Engine, learning: Learning, unit: ErrorUnit) -> Self {
        engine.set_error_unit(unit);
        Self { engine, learning, updates: 0 }
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
        self.engine.error_unit()
    }

    /// Batches learnt from.
    #[must_use]
    pub const fn updates(&self) -> u64 {
        self.updates
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
        let inputs = self.engine.layers()[0].spec.sample_inputs();
        self.engine.begin_update();
        match self.learning.mode {
            UpdateMode::Accumulate | UpdateMode::Replay => {
                self.read(codes);
                let mut list = Vec::new();
                errors(&self.engine, 0, &mut list);
                self.update(&list);
                self.engine.written(WritesDone::Batch);
            }
            UpdateMode::Online => {
                for (sample, codes) in codes.chunks_exact(inputs).enumerate() {
                    self.read(codes);
                    let mut list = Vec::new();
                    errors(&self.engine, sample, &mut list);
                    self.update(&list);
                    self.engine.written(WritesDone::Sample);
                }
            }
        }
        self.updated();
    }

    /// An update is over: time for a refresh, now and then.
    fn updated(&mut self) {
        self.updates += 1;
        if self
            .learning
            .refresh
            .is_some_and(|every| self.updates.is_multiple_of(every.get().into()))
        {
            self.engine.refresh();
            self.engine.settle();
        }
    }

    /// Writes what the loaded samples' errors ask for.
    fn update(&mut self, errors: &[i32]) {
        let words = self.engine.output_words(errors);
        self.deliver(&words);
        self.write(|driver, layer| Some(driver.shift(layer)));
        self.engine.settle();
    }

    /// Steps of an update of the loaded samples: all that deliver come before all that write.
    fn steps(&self) -> Vec<Step> {
        let Learning { rule, mode, control, .. } = self.learning;
        rule.steps(control, mode, self.engine.layers().len(), self.engine.samples())
    }

    /// Does with output words what the rule does before it writes: delivers them, and reads backwards.
    pub(crate) fn deliver(&mut self, words: &[i16]) {
        let mut heard = false;
        for step in self.steps() {
            match step {
                Step::Error { layer, samples } => {
                    let delivery = &self.engine.layers()[layer].delivery;
                    let (direct, outputs) = (delivery.is_direct(), delivery.output_words());
                    let words = &words[samples.start * outputs..samples.end * outputs];
                    let shared = heard && direct;
                    heard = direct;
                    self.engine.execute(&Operation::Error { layer, samples, words, shared });
                }
                Step::ReadColumns { layer } => {
                    self.engine.execute(&Operation::Forward { layer, side: Side::Columns });
                }
                Step::Update { .. } => {}
            }
        }
    }

    /// Writes layers, each with the shift that is said of it; those without one are left out.
    pub(crate) fn write(&mut self, shift: impl Fn(&Self, usize) -> Option<u32>) {
        for step in self.steps() {
            let Step::Update { layer, write, samples } = step else { continue };
            let Some(shift) = shift(self, layer) else { continue };
            let shift = if write == Write::Add { 0 } else { shift };
            self.engine.execute(&Operation::Update { layer, write, samples, shift });
        }
    }

    /// The writes of an update are done.
    pub(crate) fn end_update(&mut self) {
        self.engine.settle();
        self.engine.written(match self.learning.mode {
            UpdateMode::Accumulate | UpdateMode::Replay => WritesDone::Batch,
            UpdateMode::Online => WritesDone::Sample,
        });
        self.updated();
    }

    /// When a batch is written.
    pub(crate) const fn mode(&self) -> UpdateMode {
        self.learning.mode
    }
}

impl State for Driver {
    fn visit(&mut self, visitor: &mut dyn Visitor) -> Result<(), StateError> {
        self.engine.visit(visitor)?;
        let updates = std::iter::once(&mut self.updates);
        visit_counts(visitor, "updates", Section::Progress, updates)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::chip::crossbar::kernel::Backend;
    use crate::chip::engine::Phase;
    use crate::chip::hardware::{DitherBits, Hardware};
    use crate::chip::layer::{
        Delivery, DrivenBy, Homeostasis, InitialLevels, Layer, LayerSpec, Pool,
    };
    use crate::chip::ledger::{During, Event};
    use crate::chip::population::Wiring;
    use crate::learn::error::Centre;
    use crate::learn::route::Route;
    use crate::num::fixed::{ErrorBits, IncrementMax};
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
            initial: InitialLevels::Uniform { gain_64ths: [64, 64] },
            constant_row: false,
            convolution: None,
            copies: 1,
            pool: Pool::None,
            homeostasis: Homeostasis::OFF,
        };
        let dense = Route::RandomDense { shift: Some(0) };
        let first = match rule {
            Rule::Bp => Delivery::above(2),
            _ => dense.delivery(2, 2, 1, 0),
        };
        let layers = [first, Delivery::output(2)].into_iter().zip(0..);
        let layers =
            layers.map(|(delivery, index)| Layer::new(index, spec.clone(), delivery, &hardware));
        let layers = layers.collect();
        let engine = Engine::new(hardware, Backend::Scalar, 1, layers);
        let shifts = vec![shifts.to_vec(); 2];
        let learning = Learning { rule, mode, control: Control::None, refresh: None, shifts };
        Driver::new(engine, learning, ErrorUnit::new(Centre::None, bits, 2))
    }

    #[test]
    fn a_shift_holds_from_its_first_update_to_the_next_one() {
        let mut driver = driver(Rule::Dfa, UpdateMode::Accumulate, &[(0, 3), (2, 4), (5, 6)]);
        let shifts = [0, 1, 2, 4, 5, 100].map(|updates| {
            driver.updates = updates;
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
        let ledger = driver.engine().ledger(Phase::Training);
        assert_eq!(ledger.get(0, 0, During::Error, Event::SaturatedErrors), 1);
        // units 0 and 1 of the first layer hear them: rsh(255 x 20, 11) and rsh(255 x 127, 11)
        let levels: Vec<u16> = driver.engine().layers()[0].arrays[0].levels().collect();
        assert_eq!(levels, [2, 16, 0, 0]);
    }
}
