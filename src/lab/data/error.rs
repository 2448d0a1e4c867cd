//! Why data could not be had: where, what was found, what is allowed, what to try.

use std::{io, path::PathBuf};

use super::{
    csv::CsvError,
    fetch::FetchError,
    idx::IdxError,
    npz::NpzError,
    source::{ImageShape, NamedSet},
};
use crate::lab::near;
use crate::task::classify::ExamplesError;

/// Why data could not be had.
///
/// See [`DataRoot`](super::DataRoot).
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum DataError {
    /// Parts that are not of one kind.
    #[error(
        "the {part} examples differ from the training examples in features, full scale or classes; all parts have the \
         same"
    )]
    Parts {
        /// Which part differs.
        part: &'static str,
    },
    /// Keys that name no data.
    #[error("{0}")]
    Keys(String),
    /// A name that is no set.
    #[error(
        "there is no data set `{found}`; the sets are optdigits, mnist, fashion-mnist, cifar10, xor and \
         parity2 to parity8, and own files go in as IDX, NPZ or CSV{hint}",
        hint = near_set(found)
    )]
    UnknownSet {
        /// The name.
        found: String,
    },
    /// A set that has not been fetched.
    #[error("data set `{set}` is not in {folder}; get it with {how}", folder = .folder.display())]
    Missing {
        /// The set.
        set: NamedSet,
        /// Where it was looked for.
        folder: PathBuf,
        /// Commands that get it.
        how: String,
    },
    /// A fetched set whose content is not what it should be.
    #[error("data set `{set}`: {path} {found}; get it again with {how}", path = .path.display())]
    Damaged {
        /// The set.
        set: NamedSet,
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        found: String,
        /// Commands that get it.
        how: String,
    },
    /// A set that is built in and needs no fetching.
    #[error("data set `{set}` is built in; there is nothing to fetch")]
    BuiltIn {
        /// The set.
        set: NamedSet,
    },
    /// Getting a set.
    #[error(transparent)]
    Fetch(#[from] FetchError),
    /// The operating system.
    #[error("cannot {doing} {path}: {source}{}", advice(.source), path = .path.display())]
    Io {
        /// What was tried.
        doing: &'static str,
        /// On which file or folder.
        path: PathBuf,
        /// Why it failed.
        source: io::Error,
    },
    /// A file too large to be read.
    #[error("{path} has {found} bytes, allowed are {limit}; cut it into parts", path = .path.display())]
    TooLarge {
        /// The file.
        path: PathBuf,
        /// Its size.
        found: u64,
        /// Greatest size allowed.
        limit: u64,
    },
    /// An IDX file.
    #[error("{path} {source}", path = .path.display())]
    Idx {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        source: IdxError,
    },
    /// An NPZ file.
    #[error("{path} {source}", path = .path.display())]
    Npz {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        source: NpzError,
    },
    /// A CSV file.
    #[error("{path} {source}", path = .path.display())]
    Csv {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        source: CsvError,
    },
    /// Labels that are not one number an example.
    #[error(
        "the labels of {path} have the shape {dims:?}, but {examples} examples need the shape \
         [{examples}]; check that values and labels belong together, and undo a one-hot code",
        path = .path.display()
    )]
    Labels {
        /// The file of the values.
        path: PathBuf,
        /// Shape of the labels.
        dims: Vec<usize>,
        /// Examples the values make.
        examples: usize,
    },
    /// Parts that differ in their number of values.
    #[error(
        "{path} has {found} values an example, but the training part has {wanted}; all parts need the \
         same shape",
        path = .path.display()
    )]
    Features {
        /// The file.
        path: PathBuf,
        /// Values found.
        found: usize,
        /// Values of the training part.
        wanted: usize,
    },
    /// Values or labels outside what was stated.
    #[error(
        "{path}: {source}; raise `full_scale` or `classes`, or mend the file",
        path = .path.display()
    )]
    Examples {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        source: ExamplesError,
    },
    /// A full scale of 0.
    #[error("`full_scale` is 0, allowed are 1 to 255; leave it out to take the greatest value")]
    FullScale,
    /// A number of classes that bytes cannot number.
    #[error("`classes` is {found}, allowed are 1 to 256; leave it out to count the labels")]
    Classes {
        /// The number.
        found: usize,
    },
    /// A picture of another size than the example.
    #[error(
        "a picture of {} x {} x {} does not fit examples of {features} values; mend `image`",
        .image.height, .image.width, .image.channels
    )]
    Image {
        /// The shape stated.
        image: ImageShape,
        /// Values of an example.
        features: usize,
    },
    /// Too few examples to cut parts from.
    #[error(
        "{path} has {found} examples, too few to cut a {part} part from (at least {wanted}); name a \
         file for it",
        path = .path.display()
    )]
    TooFew {
        /// The file.
        path: PathBuf,
        /// Which part was to be cut.
        part: &'static str,
        /// Examples there.
        found: usize,
        /// Fewest examples.
        wanted: usize,
    },
}

impl DataError {
    /// Wraps what the operating system said.
    pub(crate) fn io(
        doing: &'static str,
        path: impl Into<PathBuf>,
    ) -> impl FnOnce(io::Error) -> Self {
        let path = path.into();
        move |source| Self::Io { doing, path, source }
    }
}

fn advice(error: &io::Error) -> &'static str {
    match error.kind() {
        io::ErrorKind::StorageFull | io::ErrorKind::QuotaExceeded => {
            "; make room or choose another data folder"
        }
        io::ErrorKind::NotFound => "; check the path",
        io::ErrorKind::PermissionDenied => "; check the permissions or choose another data folder",
        _ => "",
    }
}

/// The set that a name was meant to be.
fn near_set(found: &str) -> String {
    let names: Vec<String> = NamedSet::all().map(|set| set.to_string()).collect();
    near::hint(found, names.iter().map(String::as_str))
}
