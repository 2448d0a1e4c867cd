//! Why data could not be had: where, what was found, what is allowed, what to try.

use std::{io, path::PathBuf};

use super::{
    arrays::{self, PartName},
    csv::CsvError,
    fetch::FetchError,
    idx::IdxError,
    labels::LabelsError,
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
    /// A middle of what is no picture.
    #[error(
        "data.middle: these examples are no pictures ({description}); take it out, or say their sides with data.shape"
    )]
    NoPictures {
        /// What the examples are.
        description: String,
    },
    /// A middle that a picture does not have.
    #[error(
        "data.middle is {sides:?}; pictures of {} x {} have a middle of 1..={} rows of 1..={} pixels",
        .whole.height, .whole.width, .whole.height, .whole.width
    )]
    NoMiddle {
        /// Rows and pixels of a row that were asked for.
        sides: [usize; 2],
        /// What the pictures are.
        whole: ImageShape,
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
    /// A file of one's own that is not there.
    #[error(
        "cannot open {path}: there is no such file; check the path, which in a file is relative to that file (of a run, \
         --data says where its data are now)", path = .path.display()
    )]
    NotThere {
        /// The file.
        path: PathBuf,
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
        source: Box<IdxError>,
    },
    /// An NPZ file.
    #[error("{path} {source}", path = .path.display())]
    Npz {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        source: Box<NpzError>,
    },
    /// A CSV file.
    #[error("{path} {source}", path = .path.display())]
    Csv {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        source: Box<CsvError>,
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
    /// Labels that are no classes.
    #[error("{path}: {source}", path = .path.display())]
    Classless {
        /// The training file.
        path: PathBuf,
        /// What is wrong.
        source: Box<LabelsError>,
    },
    /// Values above the full scale.
    #[error(
        "{path}: the {part} values reach {found}, above the full scale, {full_scale} ({}); say data.full_scale = \
         {found}", if *.stated { "as stated" } else { "the greatest training value" }, path = .path.display()
    )]
    Bright {
        /// The file.
        path: PathBuf,
        /// Which part.
        part: &'static str,
        /// Greatest value.
        found: u8,
        /// Full scale.
        full_scale: u8,
        /// Whether it was stated.
        stated: bool,
    },
    /// Parts of two scales.
    #[error(
        "the training values are {train} and the {part} values {other} ({path}): two scales in one set; save both \
         alike, or if they belong together, say with data.full_scale = {full_scale} what the brightest is",
        path = .path.display()
    )]
    Scales {
        /// The file of the other part.
        path: PathBuf,
        /// Which part.
        part: &'static str,
        /// What the training values are.
        train: String,
        /// What the others are.
        other: String,
        /// A full scale that joins them.
        full_scale: u8,
    },
    /// Examples that are all the same.
    #[error(
        "{path}: all {examples} training examples have the same values, so there is nothing to learn from; check the \
         file and what is read of it", path = .path.display()
    )]
    Constant {
        /// The training file.
        path: PathBuf,
        /// How many there are.
        examples: usize,
    },
    /// A class that lost its training examples to the parts that were cut off.
    #[error(
        "{path}: the class `{class}` has too few examples: those there are went to the {part} part, which is cut \
         from the file; add examples, name a file for data.{part}, or say data.classes = {classes} if it is meant",
        path = .path.display()
    )]
    Thin {
        /// The training file.
        path: PathBuf,
        /// Name of the class.
        class: String,
        /// The part that has them.
        part: &'static str,
        /// Number of classes.
        classes: usize,
    },
    /// A file whose order of classes and a cut keep step.
    #[error(
        "{path}: the {part} part would be every {every}th example, but none of those is of the class `{class}`, of which \
         there are {there}: the file repeats its classes in step with the cut; shuffle its examples, or name a file for \
         data.{part}", path = .path.display()
    )]
    Step {
        /// The training file.
        path: PathBuf,
        /// The part that was to be cut.
        part: &'static str,
        /// One in so many.
        every: usize,
        /// Name of the class.
        class: String,
        /// Its examples.
        there: usize,
    },
    /// Two parts that are the same.
    #[error(
        "the {one} and the {other} part are the same {what}, so the score would be one of examples that were learnt; \
         give each part a file or array of its own (data.{other_key}_array in an archive), or take data.{other_key} \
         out, and it is cut from the training file"
    )]
    SamePart {
        /// One part.
        one: &'static str,
        /// The other.
        other: &'static str,
        /// As a key.
        other_key: &'static str,
        /// What is the same.
        what: String,
    },
    /// Arrays whose names say nothing.
    #[error(
        "{path} has {}, and no known names among them tell the {} {what}; say {}", names(.there), .part.word(),
        array_keys(.part.key(), .what), path = .path.display()
    )]
    Arrays {
        /// The archive.
        path: PathBuf,
        /// Which part was looked for.
        part: PartName,
        /// What was looked for.
        what: &'static str,
        /// Names there.
        there: Vec<String>,
    },
    /// A column to be left out that no table has.
    #[error(
        "no table has the column `{name}` that data.ignore_columns leaves out; mend the name or take it out"
    )]
    NoColumn {
        /// Its name.
        name: String,
    },
    /// One file for a set of several.
    #[error(
        "{path} is one file, but the data are several ({}); give the folder that holds them", .names.join(", "),
        path = .path.display()
    )]
    Several {
        /// What was given.
        path: PathBuf,
        /// Names of the files.
        names: Vec<String>,
    },
    /// A file for a known set.
    #[error(
        "the data are the set `{set}`, not files of one's own, so {path} cannot stand for them; leave --data out, and \
         give the folder of sets with --data-dir", path = .path.display()
    )]
    NotOwn {
        /// The set.
        set: NamedSet,
        /// What was given.
        path: PathBuf,
    },
    /// A file for what a policy acts on.
    #[error("`{id}` is an environment, which is made of no files, so {path} cannot stand for them; leave --data out", path = .path.display())]
    NoFiles {
        /// The environment.
        id: String,
        /// What was given.
        path: PathBuf,
    },
    /// Values and labels that make no examples.
    #[error("{path}: {source}", path = .path.display())]
    Examples {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        source: Box<ExamplesError>,
    },
    /// A full scale of 0.
    #[error(
        "`data.full_scale` is 0, allowed are 1 to 255; leave it out to take the greatest value"
    )]
    FullScale,
    /// A number of classes that bytes cannot number.
    #[error("`data.classes` is {found}, allowed are 2 to 256; leave it out to count the labels")]
    Classes {
        /// The number.
        found: usize,
    },
    /// A picture of another size than the example.
    #[error(
        "a picture of {} x {} x {} does not fit examples of {features} values; mend `data.shape`",
        .image.height, .image.width, .image.channels
    )]
    Image {
        /// The shape stated.
        image: ImageShape,
        /// Values of an example.
        features: usize,
    },
    /// A shape that a file contradicts.
    #[error(
        "`data.shape` is {} x {} x {}, but {path} holds pictures of {} x {} x {}; leave the key out, or mend it",
        .stated.height, .stated.width, .stated.channels, .found.height, .found.width, .found.channels
    )]
    Shape {
        /// The file.
        path: PathBuf,
        /// The shape stated.
        stated: ImageShape,
        /// The shape found.
        found: ImageShape,
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

fn names(there: &[String]) -> String {
    let mut some: Vec<String> = there.iter().take(12).map(|name| arrays::shown(name)).collect();
    if there.len() > some.len() {
        some.push("...".into());
    }
    if some.is_empty() { "no arrays".into() } else { format!("the arrays {}", some.join(", ")) }
}

fn array_keys(part: &str, what: &str) -> String {
    match what {
        "examples" => format!("data.{part}_array"),
        "labels" => format!("data.{part}_labels_array"),
        _ => format!("data.{part}_array and data.{part}_labels_array"),
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
