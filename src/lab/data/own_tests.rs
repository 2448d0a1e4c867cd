//! Tests of the user's own files: every format, every part, every mistake.
#![expect(clippy::disallowed_methods, reason = "data sets live in files")]

use std::{fs, io::Write, path::PathBuf};

use super::parts::planes;
use super::*;
use crate::lab::data::csv::Reading;
use crate::lab::data::{
    npy::tests::file as npy,
    source::{DataRoot, PartFile, Source},
};

struct Files(tempfile::TempDir);

impl Files {
    fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    fn put(&self, name: &str, bytes: &[u8]) -> PathBuf {
        let path = self.0.path().join(name);
        fs::write(&path, bytes).unwrap();
        path
    }

    fn csv(&self, name: &str, text: &str) -> PartFile {
        table(self.put(name, text.as_bytes()))
    }

    fn idx(&self, name: &str, dims: &[u8], values: &[u8], labels: &[u8]) -> PartFile {
        let file = |dims: &[u8], data: &[u8]| {
            let mut bytes = vec![0, 0, 8, u8::try_from(dims.len()).unwrap()];
            bytes.extend(dims.iter().flat_map(|&d| [0, 0, 0, d]));
            bytes.extend_from_slice(data);
            bytes
        };
        let count = u8::try_from(labels.len()).unwrap();
        PartFile::Idx {
            values: self.put(&format!("{name}-values"), &file(dims, values)),
            labels: self.put(&format!("{name}-labels"), &file(&[count], labels)),
        }
    }

    fn npz(&self, arrays: &[(&str, Vec<u8>)]) -> PathBuf {
        let mut zip = zip::ZipWriter::new(std::io::Cursor::new(Vec::new()));
        for (name, bytes) in arrays {
            let options = zip::write::SimpleFileOptions::default();
            zip.start_file(format!("{name}.npy"), options).unwrap();
            zip.write_all(bytes).unwrap();
        }
        self.put("own.npz", &zip.finish().unwrap().into_inner())
    }
}

fn table(path: PathBuf) -> PartFile {
    let label = Some(crate::lab::data::csv::ColumnKey::First);
    PartFile::Csv { path, reading: Reading { label, ..Reading::default() } }
}

fn only(train: PartFile) -> FileSet {
    FileSet { train, validation: None, test: None, full_scale: None, classes: None, image: None }
}

fn loaded(files: FileSet) -> Result<Data, String> {
    crate::lab::data::load(&Source::Files(Box::new(files)), &DataRoot::new("unused"))
        .map_err(|e| e.to_string())
}

fn rows(count: u8) -> String {
    (0..count).map(|e| format!("{},{},{}\n", e / 12, e + 2, 2 * e)).collect()
}

#[test]
fn one_table_is_cut_evenly_even_when_sorted_by_class() {
    let files = Files::new();
    let set = loaded(only(files.csv("all.csv", &rows(36)))).unwrap();
    let Split { train, validation, test } = &set.split;
    assert_eq!((train.len(), validation.len(), test.len()), (28, 2, 6));
    assert_eq!(test.labels(), [0, 0, 1, 1, 2, 2]);
    assert_eq!((test.values(0), train.full_scale(), train.classes()), (&[7, 10][..], 70, 3));
    assert_eq!(validation.values(0), [15, 26]);
    assert!(set.description.ends_with(
        "all.csv: 28 training, 2 validation, 6 test examples of 2 values 0 to 70, 3 classes; test is \
         every 6th example of the file; validation is every 12th example of the training part"
    ));
}

#[test]
fn parts_of_three_formats_make_one_split() {
    let files = Files::new();
    let floats: Vec<u8> = [0.0f32, 1.0, 0.5, 0.25].iter().flat_map(|x| x.to_le_bytes()).collect();
    let path = files.npz(&[
        ("x", npy("'<f4'", "False", "(2, 1, 2)", &floats)),
        ("y", npy("'<i8'", "False", "(2, 1)", &[[2u8, 0, 0, 0, 0, 0, 0, 0], [0; 8]].concat())),
    ]);
    let set = loaded(FileSet {
        validation: Some(files.csv("v.csv", "label,a,b\n1,3,4\n")),
        test: Some(PartFile::Npz { path, labels_path: None, values: None, labels: None }),
        full_scale: Some(16),
        classes: Some(3),
        ..only(files.idx("t", &[2, 1, 2], &[1, 2, 3, 4], &[0, 1]))
    })
    .unwrap();
    assert_eq!(set.split.test.all_values(), [0, 16, 8, 4]);
    assert_eq!(set.split.test.labels(), [2, 0]);
    assert_eq!((set.split.train.classes(), set.split.validation.len()), (3, 1));
    assert_eq!(set.image, Some(ImageShape { height: 1, width: 2, channels: 1 }));
    assert!(set.description.ends_with("3 classes"), "{}", set.description);
}

#[test]
fn colours_side_by_side_become_planes() {
    let values: Vec<u8> = (0..12).collect();
    assert_eq!(planes(&values, 12, 3), [0, 3, 6, 9, 1, 4, 7, 10, 2, 5, 8, 11]);
    let files = Files::new();
    let values: Vec<u8> = (0..240).collect();
    let labels: Vec<u8> = (0..20).map(|e| e % 2).collect();
    let set = loaded(only(files.idx("t", &[20, 2, 2, 3], &values, &labels))).unwrap();
    assert_eq!(set.split.train.values(0)[..4], [0, 3, 6, 9]);
    assert_eq!(set.image, Some(ImageShape { height: 2, width: 2, channels: 3 }));
}

#[test]
fn every_mistake_names_the_file_and_the_way_out() {
    let files = Files::new();
    let train = || files.csv("train.csv", &rows(36));
    let other = |name, text| Some(files.csv(name, text));
    let gone = table(files.0.path().join("gone.csv"));
    let folder = table(files.0.path().to_owned());
    let image = Some(ImageShape { height: 3, width: 3, channels: 1 });
    let cases = [
        (only(gone), "cannot open", "check the path"),
        (only(folder), "cannot read", "directory"),
        (
            FileSet { test: other("narrow.csv", "0,1\n"), ..only(train()) },
            "narrow.csv has 2 columns",
            "the training part has 3",
        ),
        (
            FileSet { test: other("bright.csv", "0,1,99\n"), ..only(train()) },
            "bright.csv: the test values reach 99, above the full scale, 70",
            "say data.full_scale = 99",
        ),
        (FileSet { full_scale: Some(9), ..only(train()) }, "reach 70", "9 (as stated)"),
        (FileSet { classes: Some(2), ..only(train()) }, "no 2 classes", "say data.classes = 3"),
        (FileSet { classes: Some(257), ..only(train()) }, "`data.classes` is 257", "2 to 256"),
        (FileSet { full_scale: Some(0), ..only(train()) }, "`data.full_scale` is 0", "1 to 255"),
        (FileSet { image, ..only(train()) }, "3 x 3 x 1", "examples of 2 values"),
        (
            only(files.csv("few.csv", "0,7\n1,2\n0,3\n1,4\n0,5\n")),
            "few.csv has 5 examples",
            "at least 6",
        ),
        (
            only(files.csv("bad.csv", "0,x1\n0,1\n0\n")),
            "bad.csv line 3 has 1 fields",
            "complete the line",
        ),
        (only(files.idx("i", &[3, 1], &[0; 3], &[0; 2])), "shape [2]", "3 examples need"),
        (
            only(files.idx("j", &[3], &[0; 3], &[0; 3])),
            "all 3 labels are `0`",
            "nothing to tell apart",
        ),
        (
            FileSet { test: Some(train()), ..only(train()) },
            "training and the test part are the same examples",
            "take data.test out",
        ),
        (
            FileSet { test: other("dark.csv", "0,1,0\n1,0,1\n"), ..only(train()) },
            "two scales",
            "data.full_scale = 70",
        ),
        (
            FileSet { test: other("new.csv", "7,1,40\n"), ..only(train()) },
            "the label `7`",
            "data.classes = 4",
        ),
        (
            only(files.csv(
                "thin.csv",
                "0,5\n0,2\n1,3\n1,4\n1,5\n2,6\n0,7\n0,8\n1,9\n1,5\n1,5\n2,6\n0,7\n0,8\n0,9\n",
            )),
            "the class `2` has too few examples",
            "data.classes = 3",
        ),
        (
            only(files.csv("flat.csv", &"0,9\n1,9\n".repeat(12))),
            "training examples have the same values",
            "check the file",
        ),
    ];
    for (set, found, advice) in cases {
        let error = loaded(set).unwrap_err();
        assert!(error.contains(found) && error.contains(advice), "{error}");
    }
}

#[test]
fn the_arrays_of_known_archives_are_the_parts_they_name() {
    let files = Files::new();
    let bytes = |count: u8, from: u8| {
        let shape = format!("({count}, 2)");
        npy("'|u1'", "False", &shape, &(from..from + 2 * count).collect::<Vec<_>>())
    };
    let labels = |count: u8| {
        let shape = format!("({count},)");
        npy("'|u1'", "False", &shape, &(0..count).map(|e| e % 2).collect::<Vec<_>>())
    };
    let path = files.npz(&[
        ("x_train", bytes(24, 0)),
        ("y_train", labels(24)),
        ("x_test", bytes(6, 30)),
        ("y_test", labels(6)),
    ]);
    let npz = |path: &PathBuf| PartFile::Npz {
        path: path.clone(),
        labels_path: None,
        values: None,
        labels: None,
    };
    let set = loaded(only(npz(&path))).unwrap();
    assert_eq!(
        (set.split.train.len(), set.split.validation.len(), set.split.test.len()),
        (22, 2, 6)
    );
    assert_eq!(set.split.test.values(0), [30, 31]);
    assert_eq!(set.told.in_training_file, [false, false, true]);
    assert!(set.said[0].contains("training examples are array `x_train`"), "{:?}", set.said);
    assert!(set.said[1].contains("test examples are array `x_test`"), "{:?}", set.said);
    let same = loaded(FileSet { test: Some(npz(&path)), ..only(npz(&path)) }).unwrap();
    assert_eq!(same.hash, set.hash);
    let named = |values: &str, labels: &str| PartFile::Npz {
        path: path.clone(),
        labels_path: None,
        values: Some(values.into()),
        labels: Some(labels.into()),
    };
    let twice =
        FileSet { test: Some(named("x_train", "y_train")), ..only(named("x_train", "y_train")) };
    let error = loaded(twice).unwrap_err();
    assert!(error.contains("the same examples") && error.contains("data.test_array"), "{error}");
}

/// `data.shape`: the channels of a pixel stand side by side in a table, and examples lie plane by plane.
#[test]
fn a_table_of_a_stated_shape_holds_pictures() {
    let files = Files::new();
    // 1 x 2 pixels of 3 channels, of which the last tells the class
    // the first of them in an order of their own: a column that counts is no value
    let line =
        |at: u8| format!("{},{},1,2,3,4,{}\n", at % 2, (u32::from(at) * 13 + 24) % 36, at % 2);
    let text: String = (0..36).map(line).collect();
    let shape = |height, width, channels| Some(ImageShape { height, width, channels });
    let set = |image| FileSet { image, ..only(files.csv("all.csv", &text)) };
    let stated = loaded(set(shape(1, 2, 3))).unwrap();
    assert_eq!(stated.image, shape(1, 2, 3));
    assert_eq!(stated.split.train.values(1), [1, 3, 1, 4, 2, 1]);
    let flat = loaded(set(None)).unwrap();
    assert_eq!((flat.image, flat.split.train.values(1)), (None, &[1, 1, 2, 3, 4, 1][..]));
    let grey = loaded(set(shape(2, 3, 1))).unwrap();
    assert_eq!(grey.split.train.values(1), flat.split.train.values(1));
    let error = loaded(set(shape(2, 2, 2))).unwrap_err();
    assert!(error.contains("2 x 2 x 2") && error.contains("`data.shape`"), "{error}");
    let values: Vec<u8> = (0..72).collect();
    let labels: Vec<u8> = (0..36).map(|at| at % 2).collect();
    let own = files.idx("a", &[36, 1, 2], &values, &labels);
    let error = loaded(FileSet { image: shape(2, 1, 1), ..only(own.clone()) }).unwrap_err();
    assert!(error.contains("holds pictures of 1 x 2 x 1"), "{error}");
    let stated = loaded(FileSet { image: shape(1, 2, 1), ..only(own) }).unwrap();
    assert_eq!(stated.image, shape(1, 2, 1));
}
