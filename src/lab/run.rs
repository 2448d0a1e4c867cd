//! Carrying out a configuration: train, continue, verify, evaluate, report.
//!
//! A [`Session`] is a training in memory that makes records; [`train`] keeps it in a folder, [`verify()`] compares it with
//! one. Neither prints: callers get [`RunEvent`]s.

mod again;
mod analyse;
mod classify;
mod deploy;
mod notes;
mod policy;
mod profile;
mod proof;
mod report;
mod repriced;
mod session;
mod task;
mod train;
mod verify;
mod watch;
mod weigh;

pub use again::{address_of, configuration, evaluate};
pub use analyse::analyse;
pub use deploy::{
    ChipResult, ChipSummary, Deployment, Moment, deploy, moments, seconds_of, summed_up, unread,
};
pub use notes::notes;
pub use profile::{Act, ModeUse, Profile, profile};
pub use proof::{records, untouched};
pub use report::{ReportMade, report};
pub use repriced::{Prices, Repriced, absent, nodes_json, priced, reprice, reprice_as};
pub use session::Session;
pub use task::Progress;
pub use train::{Keeping, RunEvent, Trained, carry_on, resume, train, train_keeping};
pub use verify::{Verdict, replay, verify};
pub use watch::{Watched, watch};
pub(crate) use weigh::weigh;
pub use weigh::{Memory, weighed};

use crate::chip::crossbar::kernel::Backend;
use crate::lab::config::ConfigError;
use crate::lab::data::DataError;
use crate::lab::store::checkpoint::CheckpointError;
use crate::lab::store::folder::FolderError;
use crate::learn::network::NetworkError;
use crate::task::environment::EnvError;
use crate::task::policy::PolicyError;

/// What a run is carried out with; none of it changes a result.
///
/// ```
/// use dalean::{Backend, Machine};
///
/// assert!(Machine::new(Backend::best(), 2).is_ok());
/// assert!(Machine::new(Backend::best(), 0).is_err());
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Machine {
    backend: Backend,
    threads: usize,
}

impl Machine {
    /// Threads of a run, at most.
    pub const THREADS_MAX: usize = 1024;

    /// These loops on so many threads.
    ///
    /// # Errors
    /// When `threads` is 0 or above [`Machine::THREADS_MAX`].
    pub fn new(backend: Backend, threads: usize) -> Result<Self, RunError> {
        if (1..=Self::THREADS_MAX).contains(&threads) {
            Ok(Self { backend, threads })
        } else {
            Err(RunError::Threads { found: threads, max: Self::THREADS_MAX })
        }
    }

    /// Which loops run.
    #[must_use]
    pub const fn backend(self) -> Backend {
        self.backend
    }

    /// Threads.
    #[must_use]
    pub const fn threads(self) -> usize {
        self.threads
    }
}

/// Why a run could not be carried out.
///
/// See [`train`](crate::train()).
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RunError {
    /// Threads that no run has.
    #[error("a run on {found} threads; use 1 to {max}")]
    Threads {
        /// Asked for.
        found: usize,
        /// Most.
        max: usize,
    },
    /// Memory that the system does not have.
    #[error(
        "the cells of the network and a copy of its state take {wanted} of memory, and {left} are left; make \
         network.hidden smaller, or use a machine with more memory"
    )]
    Memory {
        /// What they take.
        wanted: Memory,
        /// What is left.
        left: Memory,
    },
    /// Threads that the system does not give.
    #[error("the system gives no {threads} threads ({error}); use fewer")]
    NoThreads {
        /// Asked for.
        threads: usize,
        /// What the system says.
        error: std::io::Error,
    },
    /// The configuration.
    #[error(transparent)]
    Config(#[from] ConfigError),
    /// The data.
    #[error(transparent)]
    Data(#[from] DataError),
    /// The network does not fit together, or not on the chip.
    #[error(transparent)]
    Network(#[from] NetworkError),
    /// An environment that cannot go on.
    #[error(
        "{0}; the epochs that are finished are kept, and the run goes on from there with --resume"
    )]
    Environment(EnvError),
    /// What is asked for is not there in this task.
    #[error(
        "{path} is a run of examples with labels, which has no episodes; name the run of a policy"
    )]
    NoEpisodes {
        /// Folder of the run.
        path: String,
    },
    /// Errors of a task without labels.
    #[error(
        "{path} is a run of a policy, whose errors are those of its own steps; name a run of examples with labels"
    )]
    NoLabels {
        /// Folder of the run.
        path: String,
    },
    /// An epoch that the run does not have.
    #[error("{path} has no epoch {epoch}; its states are those after 0 to {last} epochs")]
    NoEpoch {
        /// Folder of the run.
        path: String,
        /// Asked for.
        epoch: u32,
        /// Its last one.
        last: usize,
    },
    /// The folder.
    #[error(transparent)]
    Folder(#[from] FolderError),
    /// The checkpoint.
    #[error("{path}: {error}")]
    Checkpoint {
        /// Which file.
        path: String,
        /// What is wrong.
        error: CheckpointError,
    },
    /// The data is not what the run was made with.
    #[error(
        "the data has the hash {found}, but the run was made with {wanted}; get the same data again (`dalean data list`), \
         or say with --data where the files are that it was made with"
    )]
    DataChanged {
        /// Hash now.
        found: String,
        /// Hash in the receipt.
        wanted: String,
    },
    /// The configuration is not what the run was made with.
    #[error("the {what} {found}, but receipt.json says {wanted}; something was changed since")]
    ConfigChanged {
        /// What does not fit, with its verb.
        what: &'static str,
        /// Now.
        found: String,
        /// In the receipt.
        wanted: String,
    },
    /// The run was made with other arithmetic.
    #[error(
        "the run was made with arithmetic {found}, this program has {wanted}; use the version of dalean that made it"
    )]
    Arithmetic {
        /// In the receipt.
        found: u32,
        /// Of this program.
        wanted: u32,
    },
    /// The run is finished.
    #[error("{path} is finished; there is nothing to continue (see `dalean verify`)")]
    Finished {
        /// Which folder.
        path: String,
    },
    /// The caller asked to stop.
    #[error("stopped in epoch {}; continue with --resume {path}", .epoch.saturating_add(1))]
    Stopped {
        /// Epochs finished.
        epoch: u32,
        /// Folder of the run.
        path: String,
    },
    /// There is nothing to count cycles with.
    #[error(
        "hardware model {model} has no [timing], so nothing can be said of cycles; give it one (see hw_models/ideal.toml) \
         or choose another with --hw"
    )]
    NoTiming {
        /// Name of the model.
        model: String,
    },
    /// The training is shorter.
    #[error("the training has no update {update} in its first epoch; it has {updates}")]
    NoUpdate {
        /// Asked for, from 1.
        update: u64,
        /// There are.
        updates: u64,
    },
    /// There is no such tile.
    #[error("there is no such tile: {}", .grid.map_or_else(
        || format!("layers are 0..{layers}"),
        |[t, d, a]| format!("that layer has {t} target streams, {d} rows and {a} columns of tiles, numbered from 0"),
    ))]
    NoTile {
        /// Layers of the network.
        layers: usize,
        /// Streams, rows and columns of tiles of the layer, if there is one.
        grid: Option<[usize; 3]>,
    },
    /// Too little data.
    #[error("the {part} part of the data has no examples; {hint}")]
    Empty {
        /// Which part.
        part: &'static str,
        /// What to try.
        hint: &'static str,
    },
}

impl From<PolicyError> for RunError {
    fn from(error: PolicyError) -> Self {
        match error {
            PolicyError::Network(error) => error.into(),
            PolicyError::Environment(error) => Self::Environment(error),
            PolicyError::Unknown(error) => Self::Data(DataError::Keys(error.to_string())),
            PolicyError::Stopped => unreachable!("who stops a training knows of it"),
            PolicyError::Turn { .. } => unreachable!("environments of this program need no turns"),
        }
    }
}
