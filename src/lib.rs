//! Simulates neural networks that learn **on** an analog or photonic chip whose synapses can only be non-negative:
//! deterministic, all-integer, the same bits on every machine.
//!
//! The program `dalean` is a thin face over this library. Six wings, each may use those before it:
//!
//! | wing | holds |
//! |---|---|
//! | [`num`] | rounding, random words by place, tables |
//! | [`chip`] | unsigned crossbars, converters, the engine with its five operations, the event ledger |
//! | [`learn`] | error words, routes, rules, statistics |
//! | [`task`] | classification: examples, experiments, epochs |
//! | [`lab`] | configuration, data sets, run folders, prices, reports, verifying |
//! | [`cli`] | arguments and messages |
//!
//! The equations are in docs/MODEL.md, the words in docs/GLOSSARY.md, the map in docs/ARCHITECTURE.md.
//!
//! # A few batches of the built-in digits
//!
//! ```
//! use dalean::chip::crossbar::kernel::Backend;
//! use dalean::lab::{config, data, store::hash};
//! use dalean::task::classify::Trainer;
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! // an experiment on 5-bit cells; what it does not say has harmless defaults
//! let text = "network.hidden = [32]\nlearning = { batch = 16, epochs = 1 }\nhw.cell.level_bits = 5";
//! let sources = config::Sources { experiment: Some(("example", text)), ..Default::default() };
//! let config = config::load(&sources)?;
//! let digits = data::load(&config.source()?, &data::DataRoot::new("data"))?;
//! let (few, _) = digits.split.train.split_at(160);
//!
//! // ten updates, with the scalar law and with the fastest kernel of this machine
//! let mut hashes = Vec::new();
//! for backend in [Backend::Scalar, Backend::best()] {
//!     let experiment = config.experiment(few.features(), few.classes(), None)?;
//!     let seeded = experiment.build(backend, few.len())?;
//!     let mut trainer = Trainer::new(experiment, seeded);
//!     trainer.learn(&few, &mut |_progress| true).expect("nobody asks it to stop");
//!     assert_eq!(trainer.driver().updates(), 10);
//!     for pathway in trainer.statistics() {
//!         println!("layer {} {}: {} deaths", pathway.layer, pathway.name, pathway.deaths);
//!     }
//!     hashes.push(hash::state(&mut trainer));
//! }
//! assert_eq!(hashes[0], hashes[1]); // levels, counters, everything
//! # Ok(())
//! # }
//! ```

pub mod chip;
pub mod cli;
pub mod lab;
pub mod learn;
pub mod num;
pub mod task;
