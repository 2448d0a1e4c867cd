//! Networks that learn, one batch after the other.

use super::chance;
use crate::chip::crossbar::kernel::Backend;
use crate::chip::engine::Phase;
use crate::chip::ledger::Event;
use crate::learn::error;
use crate::learn::rule::Rule;
use crate::task::classify::{Examples, Trainer};

/// Settings of every network here: those of `examples/mnist.toml`, with another batch.
const COMMON: [&str; 4] = [
    "network.alpha=4",
    "network.weight_max=2",
    "learning.decay=constant",
    "hw.tile.transposed_read=true",
];

/// A network and what it learns from.
pub(super) struct Net<'a> {
    trainer: Trainer,
    examples: &'a Examples,
    batch: usize,
    /// First example of the next batch.
    next: usize,
}

impl<'a> Net<'a> {
    /// A fresh network of some settings, its converters calibrated.
    pub(super) fn new(settings: &[String], backend: Backend, examples: &'a Examples) -> Self {
        let all: Vec<String> =
            COMMON.iter().map(|&s| s.into()).chain(settings.iter().cloned()).collect();
        Self::of(&all, None, backend, examples)
    }

    /// A fresh network of these settings alone, of examples that are images of a height, a width and channels.
    pub(super) fn of_images(
        settings: &[String],
        image: [usize; 3],
        backend: Backend,
        examples: &'a Examples,
    ) -> Self {
        Self::of(settings, Some(image), backend, examples)
    }

    fn of(
        settings: &[String],
        image: Option<[usize; 3]>,
        backend: Backend,
        examples: &'a Examples,
    ) -> Self {
        let experiment = chance::config(settings)
            .experiment(examples.features(), examples.classes(), image)
            .expect("a bench's networks fit their data");
        let batch = experiment.network.batch.get() as usize;
        let seeded =
            experiment.build(backend, examples).expect("a bench's networks fit their chip");
        let mut trainer = Trainer::new(experiment, seeded);
        trainer.calibrate(examples);
        Self { trainer, examples, batch, next: 0 }
    }

    /// Updates share their work among so many threads from now on.
    pub(super) fn set_threads(&mut self, threads: usize) -> std::io::Result<()> {
        self.trainer.driver_mut().engine_mut().set_threads(threads)
    }

    /// Images of an update.
    pub(super) const fn batch(&self) -> usize {
        self.batch
    }

    /// One update. Values serve as 8-bit drive codes.
    pub(super) fn step(&mut self) {
        if self.next + self.batch > self.examples.len() {
            self.next = 0;
        }
        let features = self.examples.features();
        let codes = &self.examples.all_values()[self.next * features..][..self.batch * features];
        let labels = &self.examples.labels()[self.next..][..self.batch];
        self.next += self.batch;
        self.trainer.driver_mut().learn(codes, |engine, first, errors| {
            let outputs = engine.layers().last().expect("a network has layers").spec.units;
            for (sample, &label) in labels[first..][..engine.samples()].iter().enumerate() {
                let activity = (0..outputs).map(|unit| engine.output_activity(sample, unit));
                error::errors(label, activity, errors);
            }
        });
    }

    /// One pass over the examples, as `dalean train` does it: order, gathering, updates.
    pub(super) fn epoch(&mut self) {
        let learnt = self.trainer.learn(self.examples, &mut |_| true);
        learnt.expect("nobody asks it to stop");
    }

    /// Multiply-accumulates of an update: each array read once and written once, by sample; with back-propagation each
    /// array above the first layer is also read from its columns.
    pub(super) fn products(&self) -> f64 {
        let backward = self.trainer.experiment().network.rule == Rule::Bp;
        let layers = self.trainer.driver().engine().layers().iter().enumerate();
        let passes = layers.map(|(at, layer)| {
            let times = if backward && at > 0 { 3 } else { 2 };
            times * layer.arrays.len() * layer.layout.cells() * layer.spec.positions()
        });
        (self.batch * passes.sum::<usize>()) as f64
    }

    /// Share of cells that asked for a pulse, over all writes so far, in percent.
    pub(super) fn pulsed_percent(&self) -> f64 {
        let ledger = self.trainer.driver().engine().ledger(Phase::Training);
        let asked = ledger.total(Event::DeltaComputations);
        100.0 * ledger.total(Event::Requested) as f64 / asked.max(1) as f64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn products_are_counted_by_array_and_pass() {
        let images = chance::images(8);
        let products = |rule: &str| {
            let settings = ["network.hidden=[32]", "learning.batch=4"].map(String::from);
            let settings = [&settings[..], &[format!("learning.rule={rule}")]].concat();
            Net::new(&settings, Backend::Scalar, &images).products()
        };
        let (first, last) = (784.0 * 32.0, 32.0 * 10.0);
        assert_eq!(products("ed"), 4.0 * 2.0 * (4.0 * first + 2.0 * last));
        assert_eq!(products("dfa"), 4.0 * 2.0 * 2.0 * (first + last));
        assert_eq!(products("bp"), 4.0 * 2.0 * (2.0 * first + 3.0 * last));
    }

    #[test]
    fn a_network_goes_round_its_examples() {
        let images = chance::images(10);
        let settings = ["network.hidden=[32]", "learning.batch=4"].map(String::from);
        let mut net = Net::new(&settings, Backend::best(), &images);
        (0..3).for_each(|_| net.step());
        assert_eq!((net.trainer.driver().updates(), net.next), (3, 4));
        assert!(net.pulsed_percent() > 0.0);
    }
}
