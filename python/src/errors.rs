//! Errors of the library as exceptions of `dalean.errors`: each keeps where, found and allowed, where the library has them.

use dalean::policy::{EnvError, PolicyError};
use dalean::sweep::{SweepError, WriteError};
use dalean::{
    CheckpointError, ConfigError, DataError, DriveError, ExamplesError, NetworkError, RunError,
    UnknownBackend,
};
use pyo3::prelude::*;

/// What an exception is told beside its message.
#[derive(Debug, Default)]
struct Parts {
    place: Option<String>,
    found: Option<String>,
    allowed: Option<String>,
}

fn parts(place: &str, found: &str, allowed: &str) -> Parts {
    let text = |text: &str| Some(text.to_owned());
    Parts { place: text(place), found: text(found), allowed: text(allowed) }
}

fn raise(kind: &str, message: String, parts: Parts) -> PyErr {
    let Parts { place, found, allowed } = parts;
    Python::attach(|py| {
        let made = py
            .import("dalean.errors")
            .and_then(|module| module.getattr(kind))
            .and_then(|class| class.call1((message, place, found, allowed)));
        match made {
            Ok(error) => PyErr::from_value(error),
            Err(error) => error,
        }
    })
}

/// An error of the library, on its way to Python.
pub(crate) struct Raised(pub(crate) PyErr);

impl From<Raised> for PyErr {
    fn from(raised: Raised) -> Self {
        raised.0
    }
}

impl From<PyErr> for Raised {
    fn from(error: PyErr) -> Self {
        Self(error)
    }
}

/// What a caller here gave that cannot be.
pub(crate) fn wrong(place: &str, found: &str, allowed: &str) -> PyErr {
    raise("ArrayError", format!("{place} {found}; {allowed}"), parts(place, found, allowed))
}

impl From<ConfigError> for Raised {
    fn from(error: ConfigError) -> Self {
        let message = error.to_string();
        let told = match &error {
            ConfigError::Text { place, .. } => {
                Parts { place: Some(place.clone()), ..Parts::default() }
            }
            ConfigError::Unreadable { path, error, hint } => {
                parts(path, &format!("cannot be read: {error}"), hint)
            }
            ConfigError::Range { key, error } => parts(
                key,
                &format!("is {}", error.found),
                &format!("it must lie in {}..={}", error.min, error.max),
            ),
            ConfigError::Value { key, found, allowed } => parts(key, found, allowed),
            ConfigError::Network(error) => return named("ConfigError", error),
            _ => Parts::default(),
        };
        Self(raise("ConfigError", message, told))
    }
}

fn named(kind: &str, error: &NetworkError) -> Raised {
    let told = match error {
        NetworkError::Misfit { key, found, allowed } => parts(key, found, allowed),
        _ => Parts { place: Some(error.key().into()), ..Parts::default() },
    };
    Raised(raise(kind, error.to_string(), told))
}

impl From<NetworkError> for Raised {
    fn from(error: NetworkError) -> Self {
        named("NetworkError", &error)
    }
}

impl From<DriveError> for Raised {
    fn from(error: DriveError) -> Self {
        let told = parts(&error.place, &error.found, &error.allowed);
        Self(raise("ChipError", error.to_string(), told))
    }
}

impl From<EnvError> for Raised {
    fn from(error: EnvError) -> Self {
        let told = parts(
            &format!("environment {} of `{}`", error.which, error.id),
            &error.found,
            &error.allowed,
        );
        Self(raise("EnvironmentFault", error.to_string(), told))
    }
}

impl From<PolicyError> for Raised {
    fn from(error: PolicyError) -> Self {
        match error {
            PolicyError::Network(error) => error.into(),
            PolicyError::Environment(error) => error.into(),
            other => Self(raise("RunError", other.to_string(), Parts::default())),
        }
    }
}

impl From<RunError> for Raised {
    fn from(error: RunError) -> Self {
        match error {
            RunError::Config(error) => error.into(),
            RunError::Data(error) => error.into(),
            RunError::Network(error) => error.into(),
            RunError::Environment(error) => error.into(),
            other => Self(raise("RunError", other.to_string(), Parts::default())),
        }
    }
}

impl From<SweepError> for Raised {
    fn from(error: SweepError) -> Self {
        match error {
            SweepError::Config(error) => error.into(),
            SweepError::Data(error) => error.into(),
            SweepError::Run(error) => error.into(),
            SweepError::Key { key, found, allowed } => {
                let message = format!("`{key}` {found}; {allowed}");
                Self(raise("ConfigError", message, parts(&key, &found, &allowed)))
            }
            SweepError::Axis { axis, found, allowed } => {
                let message = format!("axis `{axis}` {found}; {allowed}");
                Self(raise("ConfigError", message, parts(&axis, &found, &allowed)))
            }
            other => Self(raise("RunError", other.to_string(), Parts::default())),
        }
    }
}

/// What is asked of chips, in words of the command line, as arguments of Python have it.
pub(crate) fn of_chips(error: impl Into<RunError>) -> Raised {
    let argument = |text: String| text.replace("--set", "overrides").replace("--", "");
    match error.into() {
        RunError::Config(ConfigError::Value { key, found, allowed }) => {
            let key = argument(key.strip_prefix("eval ").map_or(key.clone(), str::to_owned));
            ConfigError::Value { key, found: argument(found), allowed: argument(allowed) }.into()
        }
        other => other.into(),
    }
}

macro_rules! plain {
    ($($error:ty => $kind:literal),* $(,)?) => {
        $(impl From<$error> for Raised {
            fn from(error: $error) -> Self {
                Self(raise($kind, error.to_string(), Parts::default()))
            }
        })*
    };
}
plain!(
    DataError => "DataError",
    ExamplesError => "DataError",
    CheckpointError => "CheckpointError",
    UnknownBackend => "ConfigError",
    WriteError => "RunError",
    std::io::Error => "RunError",
);
