//! What a user may name as data: a known set, or files of one's own.

use std::{
    fmt,
    path::{Path, PathBuf},
    str::FromStr,
};

use super::{csv::Reading, error::DataError};

/// Where a run's examples come from.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Source {
    /// A set this program knows.
    Named(NamedSet),
    /// Files of the user's own.
    Files(Box<FileSet>),
    /// The middle of each picture of another source: rows and pixels of a row.
    Middle(Box<Source>, [usize; 2]),
    /// No examples at all: what a policy acts on, by name.
    Environment(String),
}

/// A set this program knows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum NamedSet {
    /// Handwritten digits, 8 x 8, built in.
    Optdigits,
    /// Handwritten digits, 28 x 28.
    Mnist,
    /// Pieces of clothing, 28 x 28.
    FashionMnist,
    /// Small photographs, 32 x 32 in three colours.
    Cifar10,
    /// The exclusive or of two bits.
    Xor,
    /// Whether the number of ones is odd.
    Parity(ParityBits),
}

/// Bits of a parity task, 2 to 8.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct ParityBits(u8);

impl ParityBits {
    /// Fewest bits.
    pub const MIN: u8 = 2;
    /// Most bits.
    pub const MAX: u8 = 8;

    /// `bits` if there are 2 to 8.
    #[must_use]
    pub fn new(bits: u8) -> Option<Self> {
        (Self::MIN..=Self::MAX).contains(&bits).then_some(Self(bits))
    }

    /// Number of bits.
    #[must_use]
    pub const fn get(self) -> u8 {
        self.0
    }
}

impl NamedSet {
    /// Every set, in the order of the list shown to users.
    pub fn all() -> impl Iterator<Item = Self> {
        let parities =
            (ParityBits::MIN..=ParityBits::MAX).map(|bits| Self::Parity(ParityBits(bits)));
        [Self::Optdigits, Self::Mnist, Self::FashionMnist, Self::Cifar10, Self::Xor]
            .into_iter()
            .chain(parities)
    }
}

impl fmt::Display for NamedSet {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Optdigits => f.write_str("optdigits"),
            Self::Mnist => f.write_str("mnist"),
            Self::FashionMnist => f.write_str("fashion-mnist"),
            Self::Cifar10 => f.write_str("cifar10"),
            Self::Xor => f.write_str("xor"),
            Self::Parity(bits) => write!(f, "parity{}", bits.0),
        }
    }
}

impl FromStr for NamedSet {
    type Err = DataError;

    fn from_str(text: &str) -> Result<Self, DataError> {
        Self::all()
            .find(|set| set.to_string() == text)
            .ok_or_else(|| DataError::UnknownSet { found: text.to_owned() })
    }
}

/// The folder that fetched sets lie in, each in a folder of its own name.
///
/// ```
/// use dalean::{Config, Data, DataRoot, Sources};
///
/// let settings = ["data.set=mnist".to_owned()];
/// let config = Config::load(&Sources { settings: &settings, ..Sources::default() })?;
/// let error = Data::load(&config, &DataRoot::new("no such folder")).unwrap_err();
/// assert!(error.to_string().contains("dalean data fetch mnist"));
/// # Ok::<(), dalean::ConfigError>(())
/// ```
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct DataRoot {
    path: PathBuf,
    /// Where files of one's own lie, if not where the configuration says.
    files: Option<PathBuf>,
}

impl DataRoot {
    /// The folder `path`, which need not exist yet.
    pub fn new(path: impl Into<PathBuf>) -> Self {
        Self { path: path.into(), files: None }
    }

    /// The same, with files of one's own elsewhere: in the folder `place` under the names they have in a configuration,
    /// or, of a set of one file, `place` itself.
    #[must_use]
    pub fn with_files(self, place: impl Into<PathBuf>) -> Self {
        Self { files: Some(place.into()), ..self }
    }

    /// Where files of one's own lie, if not where a configuration says.
    #[must_use]
    pub fn files(&self) -> Option<&Path> {
        self.files.as_deref()
    }

    /// The folder itself.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The folder of one set.
    #[must_use]
    pub fn folder(&self, set: NamedSet) -> PathBuf {
        self.path.join(set.to_string())
    }
}

/// Files of the user's own.
///
/// A part that is not given is cut from the training part, evenly over the file: every sixth example for
/// the test, then every twelfth of those left for validation.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FileSet {
    /// What is learnt from.
    pub train: PartFile,
    /// What is chosen on.
    pub validation: Option<PartFile>,
    /// What is read once at the end.
    pub test: Option<PartFile>,
    /// Greatest value; without it the greatest value of the training file, or 255 for fractions.
    pub full_scale: Option<u8>,
    /// Number of classes, labels being 0 to one less; without it as many as there are different labels.
    pub classes: Option<usize>,
    /// Shape of a picture, where the file does not tell it.
    pub image: Option<ImageShape>,
}

/// One part of a set, as files.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum PartFile {
    /// Two IDX files, plain or gzip.
    Idx {
        /// The values, one example along the first dimension.
        values: PathBuf,
        /// The labels, one dimension.
        labels: PathBuf,
    },
    /// Two arrays of NPZ archives.
    Npz {
        /// The archive.
        path: PathBuf,
        /// The archive of the labels, if they lie in another.
        labels_path: Option<PathBuf>,
        /// Name of the array of values; without it a known one.
        values: Option<String>,
        /// Name of the array of labels; without it a known one.
        labels: Option<String>,
    },
    /// A table.
    Csv {
        /// The table.
        path: PathBuf,
        /// What is stated of it.
        reading: Reading,
    },
}

impl PartFile {
    /// The file that holds the values.
    #[must_use]
    pub fn path(&self) -> &Path {
        match self {
            Self::Idx { values: path, .. } | Self::Npz { path, .. } | Self::Csv { path, .. } => {
                path
            }
        }
    }

    /// Every file of the part, to be read or named anew.
    pub(crate) fn paths_mut(&mut self) -> Vec<&mut PathBuf> {
        match self {
            Self::Idx { values, labels } => vec![values, labels],
            Self::Npz { path, labels_path, .. } => {
                std::iter::once(path).chain(labels_path.as_mut()).collect()
            }
            Self::Csv { path, .. } => vec![path],
        }
    }
}

impl FileSet {
    /// The same set with its files elsewhere: all of them in the folder `place` under their names, or `place` itself
    /// when there is one file.
    ///
    /// # Errors
    /// When `place` is a file and the set has several.
    pub(crate) fn moved(&self, place: &Path) -> Result<Self, DataError> {
        let mut set = self.clone();
        let mut paths: Vec<&mut PathBuf> = set.train.paths_mut();
        paths.extend(
            [&mut set.validation, &mut set.test]
                .into_iter()
                .flatten()
                .flat_map(PartFile::paths_mut),
        );
        let name = |path: &Path| path.file_name().map(PathBuf::from).unwrap_or_default();
        let folder = place.is_dir();
        let mut names: Vec<PathBuf> = paths.iter().map(|path| (**path).clone()).collect();
        names.sort();
        names.dedup();
        if !folder && names.len() > 1 {
            let names = names.iter().map(|path| name(path).display().to_string()).collect();
            return Err(DataError::Several { path: place.into(), names });
        }
        for path in paths {
            *path = if folder { place.join(name(path)) } else { place.to_owned() };
        }
        Ok(set)
    }
}

/// How the values of an example make a picture: channel after channel, each row after row.
///
/// ```
/// use dalean::ImageShape;
///
/// assert_eq!(ImageShape { height: 28, width: 28, channels: 1 }.values(), Some(784));
/// assert_eq!(ImageShape { height: usize::MAX, width: 2, channels: 1 }.values(), None);
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ImageShape {
    /// Rows of pixels.
    pub height: usize,
    /// Pixels of a row.
    pub width: usize,
    /// Planes: 1 for grey, 3 for red, green and blue.
    pub channels: usize,
}

impl ImageShape {
    /// Values of a picture; `None` when they cannot be counted.
    #[must_use]
    pub fn values(self) -> Option<usize> {
        self.height.checked_mul(self.width)?.checked_mul(self.channels)
    }

    /// The middle of it, `height` rows of `width` pixels; where a border is odd, the part above or to the left is the smaller
    /// one. `None` when it has no such middle.
    #[must_use]
    pub const fn middle(self, [height, width]: [usize; 2]) -> Option<Self> {
        let fits = height > 0 && width > 0 && height <= self.height && width <= self.width;
        if fits { Some(Self { height, width, ..self }) } else { None }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_name_is_read_as_it_prints() {
        let names: Vec<_> = NamedSet::all().map(|set| set.to_string()).collect();
        assert_eq!(
            names[..6],
            ["optdigits", "mnist", "fashion-mnist", "cifar10", "xor", "parity2"]
        );
        assert_eq!(names.len(), 12);
        for set in NamedSet::all() {
            assert_eq!(set.to_string().parse::<NamedSet>().unwrap(), set);
        }
        for wrong in ["parity1", "parity9", "MNIST", "", "../mnist"] {
            let error = wrong.parse::<NamedSet>().unwrap_err().to_string();
            assert!(error.contains("parity2"), "{error}");
        }
        assert!(ParityBits::new(1).is_none() && ParityBits::new(9).is_none());
    }
}
