//! Configuration: TOML text in, checked numbers out.
//!
//! An experiment file, a hardware model file and `--set key=value` all speak the same keys. Each text is read on its
//! own, so an unknown key is reported with its line and a caret; then they are laid over one another and checked.
//! The result is a [`Config`], which can be written back as one self-contained file.

mod absent;
mod changed;
mod check;
mod chip;
mod data;
mod defaults;
mod device;
mod differs;
mod experiment;
pub mod file;
mod given;
mod hardware;
pub mod keys;
mod law;
mod layers;
mod policy;
mod quantity;
pub mod sweep;
mod template;
mod wrong;

pub use absent::{Absent, EFFECTS, Effect, absent_words};
pub(crate) use check::Bias;
pub use check::{Config, DataConfig, Select, TrainOn};
pub use defaults::policy::{POLICY_DEFAULTS, PolicyDefaults};
pub use defaults::{SET_DEFAULTS, SetDefaults};
pub use device::Retention;
pub use differs::{Difference, flat};
pub use file::{ExperimentFile, HardwareFile};
pub use hardware::{Model, builtin_devices, builtin_models, device_names, load_model, model_names};
pub use law::{Law, Setting, SettingValue};
pub(crate) use layers::anchor_map;
pub use layers::{Overlay, Sources, anchor, load, overlay, setting, setting_table};
pub(crate) use policy::PolicySettings;
pub use quantity::{
    Constant, Constants, CostClass, CostTable, Kind, Per, QUANTITIES, Quantity, Standing,
};
pub use template::template;

/// Why a configuration cannot be used. Each message says where, what was found, what is allowed.
///
/// ```
/// use dalean::{Config, Sources};
///
/// let text = "[learning]\nbatchh = 16";
/// let sources = Sources { experiment: Some(("mine.toml", text)), ..Sources::default() };
/// let error = Config::load(&sources).unwrap_err().to_string();
/// assert!(error.contains("mine.toml") && error.contains("unknown field `batchh`"));
/// ```
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ConfigError {
    /// The text is not TOML, or has keys or values of the wrong kind.
    #[error("{place}:\n{error}")]
    Text {
        /// File name or option.
        place: String,
        /// Message with line, column and caret.
        error: String,
    },
    /// A file cannot be read.
    #[error("cannot read {path}: {error}; {hint}")]
    Unreadable {
        /// The file.
        path: String,
        /// What the system says.
        error: std::io::Error,
        /// What to try.
        hint: String,
    },
    /// A number outside its range.
    #[error("`{key}`: {error}")]
    Range {
        /// The key in full.
        key: String,
        /// What was found and what is allowed.
        error: crate::num::fixed::OutOfRange,
    },
    /// A network that does not fit together, or not on the chip.
    #[error(transparent)]
    Network(#[from] crate::learn::network::NetworkError),
    /// A value that does not fit with the others.
    #[error("`{key}` {found}; {allowed}")]
    Value {
        /// The key in full.
        key: String,
        /// What was found.
        found: String,
        /// What is allowed and what to try.
        allowed: String,
    },
}
