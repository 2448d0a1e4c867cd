//! Simulates neural networks that learn **on** an analog or photonic chip whose synapses can only be non-negative:
//! deterministic, all-integer, the same bits on every machine.
//!
//! This page is the library's whole public face. A configuration is read and checked ([`Config`]), data is loaded
//! ([`Data`]), and a run is carried out in memory ([`Session`]) or in a folder ([`train()`], [`resume`], [`evaluate`],
//! [`verify`]). Below that stand the parts themselves: a chip ([`Hardware`]), a network ([`NetworkSpec`]), examples, and
//! a [`Classifier`] that joins them; a [`DrivenNetwork`] is a network whose every operation a caller decides. Whatever can be wrong is an error that says where, what was found and what is
//! allowed; no argument makes a call panic.
//!
//! | feature | brings | needs |
//! |---|---|---|
//! | none | chip, learning, tasks | a handful of crates |
//! | `lab` | configuration, data sets, run folders, sweeps, prices, reports | files, SQLite, plotting |
//! | `cli` (default) | the program `dalean` | a terminal |
//!
//! The equations are in docs/MODEL.md, the words in docs/GLOSSARY.md, the map in docs/ARCHITECTURE.md.
#![cfg_attr(feature = "lab", doc = "")]
#![cfg_attr(feature = "lab", doc = "# One epoch of the built-in digits")]
#![cfg_attr(feature = "lab", doc = "")]
#![cfg_attr(feature = "lab", doc = include_str!("../docs/example.md"))]
#![cfg_attr(
    not(feature = "internals"),
    expect(
        dead_code,
        unreachable_pub,
        unused_imports,
        reason = "wings are public to the tests of this repository alone: feature `internals`"
    )
)]

// Six wings, each may use those before it. Tests, benches and fuzz targets of this repository see them whole.
#[cfg(feature = "internals")]
pub mod chip;
#[cfg(not(feature = "internals"))]
mod chip;
#[cfg(feature = "cli")]
#[doc(hidden)]
pub mod cli;
#[cfg(all(feature = "lab", feature = "internals"))]
pub mod lab;
#[cfg(all(feature = "lab", not(feature = "internals")))]
mod lab;
#[cfg(feature = "internals")]
pub mod learn;
#[cfg(not(feature = "internals"))]
mod learn;
#[cfg(feature = "internals")]
pub mod num;
#[cfg(not(feature = "internals"))]
mod num;
#[cfg(feature = "internals")]
pub mod task;
#[cfg(not(feature = "internals"))]
mod task;

pub use crate::chip::crossbar::kernel::{Backend, UnknownBackend};
pub use crate::chip::hardware::{Hardware, HardwareError, HardwareSpec};
pub use crate::learn::network::{NetworkError, NetworkSpec};
pub use crate::learn::outside::{DriveError, DrivenNetwork};
pub use crate::task::classify::{
    Classifier, Evaluation, Examples, ExamplesError, Experiment, Split, Stop,
};

/// The parts of a chip: what a [`HardwareSpec`] is made of.
///
/// ```
/// use dalean::hardware::{Adc, AdcBits, AdcRange, Subtract};
/// use dalean::Hardware;
///
/// let bits = AdcBits::new(6).expect("2..=16");
/// let adc = Adc::Finite { bits, subtract: Subtract::Digital, range: AdcRange::Full };
/// let chip = Hardware::reference().with(|parts| parts.adc = adc).expect("a chip");
/// assert_eq!(chip.adc, adc);
/// ```
pub mod hardware {
    pub use crate::chip::device::{
        Ageing, CellSpread, Chance, Conductance, Conducting, DeviceError, DeviceSpec, Endurance,
        FaultMap, Faults, Leakage, LetThrough, ListedCell, Programming, PulseNoise, ReadNoise,
        Reference, StuckAt, Wires, Worn,
    };
    pub use crate::chip::hardware::{
        Adc, AdcRange, CellSpec, ConverterKind, DigitalSpec, DitherBits, DitherPattern, DriveSpec,
        FloorKind, PulseCode, SliceTime, SliceTimes, Subtract, TileSpec, Timing, Window,
        WriteScheme, WriteSpec,
    };
    pub use crate::num::fixed::{
        AdcBits, DriveBits, ErrorBits, IncrementMax, LevelBits, LutBits, Millionths, OutOfRange,
        ResidualBits,
    };
    pub use crate::num::tables::{
        DriftRates, ExponentialSteps, LinearSteps, MeasuredSteps, NeurosimSteps, Response,
        SoftBoundSteps, SpreadLaw, TableSteps,
    };
}

/// The parts of a network: what a [`NetworkSpec`] is made of. [`Classifier`] shows one put together.
pub mod network {
    pub use crate::chip::crossbar::kernel::ConvShape;
    pub use crate::chip::layer::{
        DrivenBy, Gain, Homeostasis, InitialLevels, LayerSpec, Optimiser, PlanError, Pool,
    };
    pub use crate::chip::population::Wiring;
    pub use crate::learn::error::{Centre, OutputError};
    pub use crate::learn::network::{HiddenWords, NetworkPlace};
    pub use crate::learn::route::Route;
    pub use crate::learn::rule::{Control, Rule, UpdateMode};
    pub use crate::num::fixed::{Batch, RateMantissa};
    pub use crate::num::tables::{Activation, Decay, Positive};
    pub use crate::task::classify::{Augment, Coding};
}

/// Policies that are trained from outside: a [`PolicyLearner`](policy::PolicyLearner) is shown what environments of one's own
/// show, and says what they are to do.
pub mod policy {
    pub use crate::task::environment::{
        Actions, EnvError, EnvSpec, Observations, Outcomes, Real, Shown, Taken,
    };
    pub use crate::task::policy::{
        Evaluating, Evolution, InputCoding, Method, PolicyEpoch, PolicyError, PolicyExperiment,
        PolicyLearner, PolicyProgress, PolicyTurn, Ppo, Share, SumOf,
    };

    #[cfg(feature = "lab")]
    pub use crate::lab::data::{FloatDoor, FloatOutcomes};
}

/// Grids of runs: a sweep file carried out in a store, and its results as a table.
#[cfg(feature = "lab")]
pub mod sweep {
    pub use crate::lab::sweep::{
        Carried, Options as SweepOptions, Shard, SweepError, SweepProgress, Swept, sweep,
        sweep_part, sweep_runs,
    };
    pub use crate::lab::table::{Column, ColumnUnit, Format, Role, Table, Values, WriteError};
}

/// Finished runs on other chips of their kind and after a time: what [`Deployment`](deployment::Deployment) asks for.
#[cfg(feature = "lab")]
pub mod deployment {
    pub use crate::lab::run::{
        ChipResult, ChipSummary, Deployment, Moment, deploy, moments, seconds_of, summed_up, unread,
    };
}

#[cfg(feature = "lab")]
pub use crate::lab::{
    config::{Config, ConfigError, Sources},
    data::{Data, DataError, DataRoot, ImageShape},
    run::{
        Keeping, Machine, Memory, Progress, ReportMade, RunError, RunEvent, Session, Trained,
        Verdict, evaluate, priced, report, resume, train, train_keeping, verify, weighed,
    },
    store::{
        ARITHMETIC,
        checkpoint::CheckpointError,
        kept::{Checkpointed, ledger_of},
        record::{EpochRecord, Receipt, Score, TestOutcome},
    },
};
