//! Which loops run, chosen once at start.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

#[cfg(target_arch = "aarch64")]
use super::neon::Neon;
use super::ops::Ops;
use super::scalar;
#[cfg(target_arch = "x86_64")]
use super::{amx, amx::Amx, avx2, avx2::Avx2, avx512, avx512::Avx512};

/// Which loops run. All give the same bits.
///
/// ```
/// use dalean::Backend;
///
/// assert_eq!(Backend::named("scalar")?, Backend::available()[0]);
/// assert_eq!(Backend::named(Backend::best().name())?, Backend::best());
/// assert!(Backend::named("abacus").unwrap_err().to_string().starts_with("there is no kernel `abacus`"));
/// # Ok::<(), dalean::UnknownBackend>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Backend {
    /// Plain loops: the definition.
    Scalar,
    /// 128-bit loops, with 8-bit dot products where the processor has them.
    #[cfg(target_arch = "aarch64")]
    Neon(Neon),
    /// 256-bit loops.
    #[cfg(target_arch = "x86_64")]
    Avx2(Avx2),
    /// 512-bit loops with 8-bit dot products.
    #[cfg(target_arch = "x86_64")]
    Avx512(Avx512),
    /// Products of 16 x 64 by 64 x 16 bytes at a time; 512-bit loops for the rest.
    #[cfg(target_arch = "x86_64")]
    Amx(Amx),
}

/// Why a back end cannot be had by its name.
///
/// See [`Backend`].
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum UnknownBackend {
    /// No back end has this name on any machine.
    #[error("there is no kernel `{name}`; say one of {}", Backend::NAMES.join(", "))]
    Name {
        /// What was asked for.
        name: String,
    },
    /// The name is right, but the processor lacks the feature.
    #[error("this processor cannot run the kernel `{name}`; it has {}", there.join(", "))]
    Absent {
        /// What was asked for.
        name: String,
        /// Names of the back ends of this machine.
        there: Vec<&'static str>,
    },
}

impl Backend {
    /// Names of all back ends of all machines, slowest first.
    pub(crate) const NAMES: [&str; 5] = ["scalar", "neon", "avx2", "avx512", "amx"];

    /// The back ends this machine has, slowest first.
    #[must_use]
    pub fn available() -> Vec<Self> {
        let all = [Self::Scalar].into_iter();
        #[cfg(target_arch = "aarch64")]
        let all = all.chain(Neon::detect().map(Self::Neon));
        #[cfg(target_arch = "x86_64")]
        let all = all
            .chain(Avx2::detect().map(Self::Avx2))
            .chain(Avx512::detect().map(Self::Avx512))
            .chain(Amx::detect().map(Self::Amx));
        all.collect()
    }

    /// The fastest back end this machine has.
    #[must_use]
    pub fn best() -> Self {
        *Self::available().last().expect("the scalar law is always there")
    }

    /// What it does.
    pub(super) const fn ops(self) -> &'static Ops {
        match self {
            Self::Scalar => &scalar::OPS,
            #[cfg(target_arch = "aarch64")]
            Self::Neon(neon) => neon.ops(),
            #[cfg(target_arch = "x86_64")]
            Self::Avx2(_) => &avx2::OPS,
            #[cfg(target_arch = "x86_64")]
            Self::Avx512(_) => &avx512::OPS,
            #[cfg(target_arch = "x86_64")]
            Self::Amx(_) => &amx::OPS,
        }
    }

    /// The name `--kernel` takes.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Scalar => "scalar",
            #[cfg(target_arch = "aarch64")]
            Self::Neon(_) => "neon",
            #[cfg(target_arch = "x86_64")]
            Self::Avx2(_) => "avx2",
            #[cfg(target_arch = "x86_64")]
            Self::Avx512(_) => "avx512",
            #[cfg(target_arch = "x86_64")]
            Self::Amx(_) => "amx",
        }
    }

    /// The back end called `name`.
    ///
    /// # Errors
    /// When no back end has that name, or this processor lacks it.
    pub fn named(name: &str) -> Result<Self, UnknownBackend> {
        let available = Self::available();
        if let Some(backend) = available.iter().find(|backend| backend.name() == name) {
            return Ok(*backend);
        }
        let name = name.to_owned();
        if Backend::NAMES.contains(&name.as_str()) {
            let there = available.into_iter().map(Self::name).collect();
            return Err(UnknownBackend::Absent { name, there });
        }
        Err(UnknownBackend::Name { name })
    }
}
