//! Which arrays of an archive hold the examples and the labels of a part: as stated, or known by their names.
//!
//! Known layouts are those of Keras (`x_train`, `y_train`), MedMNIST (`train_images`, `train_labels`), numpy.savez with
//! names of one's own (`x`, `y`) or none (`arr_0`, `arr_1`), and archives of a single array.

use super::npz::SINGLE;

/// A part of a split, as files and keys call it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PartName {
    /// Learnt from.
    Train,
    /// Chosen on.
    Validation,
    /// Read once.
    Test,
}

impl PartName {
    /// All, in order.
    pub const EACH: [Self; 3] = [Self::Train, Self::Validation, Self::Test];

    /// As keys of `[data]` call it.
    #[must_use]
    pub const fn key(self) -> &'static str {
        match self {
            Self::Train => "train",
            Self::Validation => "validation",
            Self::Test => "test",
        }
    }

    /// As sentences call it.
    #[must_use]
    pub const fn word(self) -> &'static str {
        match self {
            Self::Train => "training",
            Self::Validation => "validation",
            Self::Test => "test",
        }
    }

    /// As names of arrays call it.
    const fn spellings(self) -> &'static [&'static str] {
        match self {
            Self::Train => &["train", "training"],
            Self::Validation => &["val", "valid", "validation", "dev"],
            Self::Test => &["test"],
        }
    }
}

/// Names with a part in them: examples, labels.
const OF_A_PART: [[&str; 2]; 9] = [
    ["x_{}", "y_{}"],
    ["X_{}", "y_{}"],
    ["X_{}", "Y_{}"],
    ["{}_images", "{}_labels"],
    ["{}_x", "{}_y"],
    ["{}_X", "{}_y"],
    ["{}_data", "{}_labels"],
    ["{}_features", "{}_labels"],
    ["images_{}", "labels_{}"],
];

/// Names of an archive that holds one part.
const OF_THE_WHOLE: [[&str; 2]; 10] = [
    ["x", "y"],
    ["X", "y"],
    ["X", "Y"],
    ["images", "labels"],
    ["data", "labels"],
    ["data", "target"],
    ["features", "labels"],
    ["features", "target"],
    ["examples", "labels"],
    ["arr_0", "arr_1"],
];

fn pairs(part: PartName, whole: bool) -> Vec<[String; 2]> {
    if whole {
        return OF_THE_WHOLE.iter().map(|pair| pair.map(ToOwned::to_owned)).collect();
    }
    let spellings = part.spellings().iter();
    let of = |word: &str| OF_A_PART.map(|pair| pair.map(|name| name.replace("{}", word)));
    spellings.flat_map(|word| of(word)).collect()
}

/// Keeps the only one of some answers.
fn only<T: PartialEq>(found: impl IntoIterator<Item = T>) -> Option<T> {
    let mut found = found.into_iter();
    let first = found.next()?;
    found.all(|other| other == first).then_some(first)
}

/// The arrays of a part in an archive with both examples and labels.
///
/// `shared` says that the archive holds another part too, so that names without a part in them will not do.
#[must_use]
pub fn both(part: PartName, names: &[String], shared: bool) -> Option<[String; 2]> {
    let there = |pair: &[String; 2]| pair.iter().all(|name| names.contains(name));
    let own = || pairs(part, false).into_iter().filter(there);
    if own().next().is_some() || shared {
        return only(own());
    }
    // an archive that names parts has none for this one
    let parted = PartName::EACH.into_iter().any(|other| pairs(other, false).iter().any(there));
    if parted { None } else { only(pairs(part, true).into_iter().filter(there)) }
}

/// The array of a part in an archive that holds only examples (0) or only labels (1).
#[must_use]
pub fn one(part: PartName, names: &[String], which: usize) -> Option<String> {
    if let [single] = names {
        return Some(single.clone());
    }
    let of = |whole: bool| {
        pairs(part, whole).into_iter().map(|mut pair| std::mem::take(&mut pair[which]))
    };
    let there = |name: &String| names.contains(name);
    only(of(false).filter(there)).or_else(|| only(of(true).filter(there)))
}

/// An array as messages name it.
#[must_use]
pub fn shown(name: &str) -> String {
    if name == SINGLE { "its only array".into() } else { format!("`{name}`") }
}

#[cfg(test)]
mod tests {
    use super::*;
    use PartName::{Test, Train, Validation};

    fn names(names: &[&str]) -> Vec<String> {
        names.iter().map(ToString::to_string).collect()
    }

    #[test]
    fn known_layouts_are_told_by_their_names() {
        let keras = names(&["x_test", "x_train", "y_test", "y_train"]);
        let found = |part, names: &[String]| both(part, names, false).map(|pair| pair.join(" "));
        assert_eq!(found(Train, &keras).unwrap(), "x_train y_train");
        assert_eq!(found(Test, &keras).unwrap(), "x_test y_test");
        assert_eq!(found(Validation, &keras), None);
        let med = names(&[
            "test_images",
            "test_labels",
            "train_images",
            "train_labels",
            "val_images",
            "val_labels",
        ]);
        assert_eq!(found(Validation, &med).unwrap(), "val_images val_labels");
        assert_eq!(found(Train, &names(&["x", "y"])).unwrap(), "x y");
        assert_eq!(found(Test, &names(&["arr_0", "arr_1"])).unwrap(), "arr_0 arr_1");
        // two that would do, none that would, and names of another part
        assert_eq!(found(Train, &names(&["X", "x", "y"])), None);
        assert_eq!(found(Train, &names(&["a", "b"])), None);
        assert_eq!(found(Test, &names(&["x", "y", "x_train", "y_train"])), None);
        assert_eq!(both(Test, &names(&["x", "y"]), true), None);
    }

    #[test]
    fn an_archive_of_images_or_of_labels_has_one_array_that_fits() {
        assert_eq!(one(Train, &names(&["arr_0"]), 1), Some("arr_0".into()));
        assert_eq!(one(Test, &names(&["x_test", "x_train"]), 0), Some("x_test".into()));
        assert_eq!(one(Test, &names(&["y", "z"]), 1), Some("y".into()));
        assert_eq!(one(Test, &names(&["a", "b"]), 0), None);
    }
}
