//! Own data are read right, or refused with the cure in the message; none silently.
//!
//! `tests/golden/own_data.json` holds what NumPy and pandas wrote and what they read back (`own_data.py` made it); what
//! must be refused stands here, with the words of its cure.

use std::path::Path;

use dalean::{Config, Data, DataRoot, Examples, Sources, Split};
use serde_json::Value;

const GOLDEN: &str = include_str!("../golden/own_data.json");

/// Loads the files that `keys` of `[data]` name in `folder`.
fn load(folder: &Path, keys: &str) -> Result<Data, String> {
    let name = folder.join("own.toml").display().to_string();
    let text = format!("[data]\n{keys}\n");
    let sources = Sources { experiment: Some((&name, &text)), ..Sources::default() };
    let config = Config::load(&sources).map_err(|error| error.to_string())?;
    Data::load(&config, &DataRoot::new("no such folder")).map_err(|error| error.to_string())
}

fn bytes(hex: &str) -> Vec<u8> {
    let digit = |at: usize| u8::from_str_radix(&hex[at..at + 2], 16).unwrap();
    (0..hex.len()).step_by(2).map(digit).collect()
}

#[test]
fn files_of_numpy_and_pandas_are_read_as_numpy_and_pandas_read_them() {
    let cases: Vec<Value> = serde_json::from_str(GOLDEN).unwrap();
    assert!(cases.len() >= 40, "{} cases", cases.len());
    for case in &cases {
        let name = case["name"].as_str().unwrap();
        let folder = tempfile::tempdir().unwrap();
        for (file, content) in case["files"].as_object().unwrap() {
            std::fs::write(folder.path().join(file), bytes(content.as_str().unwrap())).unwrap();
        }
        let data = load(folder.path(), case["data"].as_str().unwrap())
            .unwrap_or_else(|error| panic!("{name}: {error}"));
        let Split { train, validation, test } = data.split();
        for (place, part) in [train, validation, test].into_iter().enumerate() {
            let wanted = &case["parts"][place];
            let rows: Vec<Vec<u8>> = serde_json::from_value(wanted["values"].clone()).unwrap();
            let labels: Vec<u8> = serde_json::from_value(wanted["labels"].clone()).unwrap();
            assert_eq!(part.labels(), labels, "{name}, labels of part {place}");
            assert_eq!(part.all_values(), rows.concat(), "{name}, values of part {place}");
            assert_eq!(u64::from(part.full_scale()), case["full_scale"], "{name}");
        }
        let names: Vec<String> = serde_json::from_value(case["names"].clone()).unwrap();
        assert_eq!(data.class_names(), names, "{name}");
        for said in case["said"].as_array().unwrap() {
            let found = data.said().iter().any(|line| line.contains(said.as_str().unwrap()));
            assert!(found, "{name}: nobody says {said}: {:?}", data.said());
        }
    }
}

/// A table of `rows` lines.
fn lines(rows: usize, line: impl Fn(usize) -> String) -> String {
    (0..rows).map(|row| line(row) + "\n").collect()
}

/// A sound table: two values and a label, 0 to 2.
fn sound(rows: usize) -> String {
    format!(
        "a,b,label\n{}",
        lines(rows, |row| format!("{},{},{}", row * 3 % 251, row * 7 % 256, row % 3))
    )
}

/// A .npy file of one type.
fn npy(descr: &str, shape: &str, elements: &[u8]) -> Vec<u8> {
    let header = format!("{{'descr': '{descr}', 'fortran_order': False, 'shape': {shape}, }}\n");
    let length = u16::try_from(header.len()).unwrap().to_le_bytes();
    [b"\x93NUMPY\x01\x00", &length[..], header.as_bytes(), elements].concat()
}

fn floats(numbers: &[f32]) -> Vec<u8> {
    let shape = format!("({}, 1)", numbers.len());
    npy("<f4", &shape, &numbers.iter().flat_map(|x| x.to_le_bytes()).collect::<Vec<_>>())
}

fn whole(numbers: &[u8]) -> Vec<u8> {
    npy("|u1", &format!("({},)", numbers.len()), numbers)
}

#[test]
fn tables_that_cannot_be_right_are_refused_with_a_cure() {
    let own = "format = \"csv\"\ntrain = \"own.csv\"";
    let at = |key: &str| format!("{own}\n{key}");
    let cases: Vec<(&str, String, String, &[&str])> = vec![
        (
            "a label of one value",
            at(""),
            lines(24, |row| format!("{},{},7", row * 3 + 2, row * 7)),
            &["neither the first", "the last (7 alone)", "data.label_column"],
        ),
        (
            "a label of one value, stated",
            at("label_column = \"last\""),
            lines(24, |row| format!("{},{},7", row * 3 + 2, row * 7)),
            &["all 24 labels are `7`", "nothing to tell apart"],
        ),
        (
            "the lines 1,2,3,0",
            at("header = false\nlabel_column = \"last\""),
            "1,2,3,0\n".repeat(30),
            &["all 30 labels are `0`", "add examples of another"],
        ),
        (
            "the lines 1,2,3,0, label first, three classes stated",
            at("header = false\nlabel_column = \"first\"\nclasses = 3"),
            "1,2,3,0\n".repeat(30),
            &["training examples have the same values", "check the file"],
        ),
        (
            "200 labels of 300 rows",
            at("label_column = \"label\""),
            format!("a,label\n{}", lines(300, |row| format!("{},{}", row % 250, row * 2 / 3))),
            &["300 training examples have 200 different labels", "data.classes = 200"],
        ),
        (
            "a measurement as label",
            at("label_column = \"label\""),
            format!("a,label\n{}", lines(30, |row| format!("{},{}.5", row * 5 % 250, row % 4))),
            &["holds the label `0.5`", "name another column with data.label_column"],
        ),
        (
            "more than 256 classes",
            at(""),
            format!("a,label\n{}", lines(900, |row| format!("{},{}", row % 250, row % 300))),
            &["300 different labels", "at most 256"],
        ),
        (
            "two columns of text",
            at(""),
            "a,kind,colour\n1,cat,red\n2,dog,blue\n".into(),
            &["`kind`, `colour` may each be the label", "data.label_column = \"kind\""],
        ),
        (
            "two columns that could be the label",
            at(""),
            lines(30, |row| format!("{},{},{}", row % 3, row * 5, row % 2)),
            &["column 0, column 2 may each be the label", "data.label_column = \"0\""],
        ),
        (
            "a column of text that is no label",
            at("label_column = \"label\""),
            "name,a,label\nx1,3,0\ny2,4,1\n".into(),
            &["line 2, column 0 (`name`) holds `x1`", "data.ignore_columns = [\"name\"]"],
        ),
        (
            "a column that numbers the rows",
            at(""),
            format!("id,a,label\n{}", lines(24, |row| format!("{row},{},{}", row * 5, row % 2))),
            &["column 0 (`id`) numbers the rows", "data.ignore_columns = [\"id\"]"],
        ),
        (
            "a missing value",
            at(""),
            "a,b,label\n1,,0\n3,4,1\n".into(),
            &["line 2, column 1 (`b`) holds ``: a missing value", "fill the gap"],
        ),
        (
            "NaN",
            at(""),
            "a,b,label\n1,NaN,0\n3,4,1\n".into(),
            &["holds `NaN`: a missing value", "fill the gap"],
        ),
        (
            "a missing label",
            at(""),
            "a,b,label\n1,2,0\n3,4,\n".into(),
            &["line 3, column 2 (`label`) holds ``", "fill the gap"],
        ),
        (
            "negative values",
            at(""),
            "a,b,label\n1,-2,0\n3,4,1\n".into(),
            &["reach from -2 to 4", "(x - least) / (greatest - least)"],
        ),
        (
            "values above a byte",
            at(""),
            "a,b,label\n1,1023,0\n3,4,1\n".into(),
            &["whole numbers up to 1023", "divide all parts by 1023"],
        ),
        (
            "fractions above 1",
            at(""),
            "a,b,label\n0.5,5.1,0\n0.3,4,1\n".into(),
            &["have fractions and reach from 0.3 to 5.1", "divide all parts alike"],
        ),
        (
            "nothing but one value",
            at(""),
            format!("a,b,label\n{}", lines(30, |row| format!("9,9,{}", row % 2))),
            &["training examples have the same values", "check the file"],
        ),
        (
            "a spreadsheet",
            at(""),
            "PK\u{3}\u{4}xxxxxxxxxxxx".into(),
            &["spreadsheet", "save it as CSV in UTF-8"],
        ),
        (
            "UTF-16 without a mark",
            at(""),
            "1\0,\x002\0\n\0".into(),
            &["holds zero bytes", "save it as UTF-8"],
        ),
        (
            "decimal commas in a comma file",
            at("label_column = \"last\""),
            "\"0,5\",\"0,2\",1\n\"0,1\",\"0,3\",0\n".into(),
            &["`0,5`", "separate the fields by semicolons"],
        ),
        (
            "a header without the row names",
            at(""),
            "a,b,label\n1,5,6,0\n2,7,8,1\n".into(),
            &["line 2 has 4 fields", "row.names=FALSE"],
        ),
        (
            "a first line that may be either",
            at("label_column = \"last\""),
            "0,1,2\n5,6,1\n".into(),
            &["may be a header or an example", "data.header = true or data.header = false"],
        ),
        (
            "one example",
            at("label_column = \"last\""),
            "5,9,0\n6,8,1\n".into(),
            &["has 2 examples, too few", "name a file"],
        ),
        (
            "no such label column",
            at("label_column = \"digit\""),
            sound(24),
            &["has no column `digit`", "the header has a, b, label"],
        ),
        (
            "no such column to leave out",
            at("ignore_columns = [\"idd\"]"),
            sound(24),
            &["no table has the column `idd`", "mend the name"],
        ),
        (
            "a number that is a name too",
            at("label_column = \"0\""),
            "b,0,label\n1,2,0\n3,4,1\n".into(),
            &["column `0` may mean", "other names"],
        ),
        (
            "two columns of one name",
            at("label_column = \"label\""),
            "label,a,label\n1,2,0\n".into(),
            &["two columns `label`", "different names"],
        ),
        (
            "classes that do not fit",
            at("classes = 2"),
            sound(24),
            &["3 different labels, 0 to 2, which are no 2 classes", "data.classes = 3"],
        ),
        ("one class stated", at("classes = 1"), sound(24), &["`data.classes` is 1", "2 to 256"]),
        (
            "a full scale that is too small",
            at("full_scale = 16"),
            sound(24),
            &["above the full scale, 16 (as stated)", "data.full_scale = "],
        ),
        (
            "no file of that name",
            "format = \"csv\"\ntrain = \"gone.csv\"".into(),
            String::new(),
            &["cannot open", "gone.csv", "relative to that file"],
        ),
    ];
    for (what, keys, text, words) in cases {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("own.csv"), &text).unwrap();
        refused(what, load(folder.path(), &keys), words);
    }
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("own.csv"), sound(400)).unwrap();
    let words: &[&str] =
        &["every 6th example", "none of those is of the class `0`", "shuffle its examples"];
    refused("classes in step with the cut", load(folder.path(), own), words);
    let folder = tempfile::tempdir().unwrap();
    let latin = b"a,label\n1,caf\xe9\n2,caf\xe8\n".repeat(12);
    std::fs::write(folder.path().join("own.csv"), latin).unwrap();
    let words: &[&str] = &["line 2 is not UTF-8", "save the file as UTF-8"];
    refused("Latin-1, whose words could become one", load(folder.path(), own), words);
}

/// An error that holds all these words.
fn refused(what: &str, found: Result<Data, String>, words: &[&str]) {
    let error = match found {
        Ok(data) => panic!("{what}: read as {}", data.description()),
        Err(error) => error,
    };
    for word in words {
        assert!(error.contains(word), "{what}: no `{word}` in: {error}");
    }
}

#[test]
fn parts_that_do_not_belong_together_are_refused_with_a_cure() {
    let own = "format = \"csv\"\ntrain = \"own.csv\"\ntest = \"test.csv\"";
    let tests: [(&str, String, &[&str]); 9] = [
        (
            "the training file itself",
            sound(60),
            &["the training and the test part are the same examples", "take data.test out"],
        ),
        (
            "fractions beside whole numbers",
            "a,b,label\n0.5,0.1,0\n0.3,0.2,1\n".into(),
            &["whole numbers 0 to", "fractions 0 to 1", "two scales", "data.full_scale ="],
        ),
        (
            "values up to 1 beside 255",
            "a,b,label\n0,1,0\n1,1,1\n".into(),
            &["whole numbers 0 to 1", "two scales", "data.full_scale ="],
        ),
        (
            "a label that training lacks",
            "a,b,label\n9,5,4\n".into(),
            &["the test part has the label `4`", "data.classes = 4"],
        ),
        (
            "text labels beside numbers",
            "a,b,label\n9,5,cat\n".into(),
            &["are numbers", "are text (`cat`)", "write all parts alike"],
        ),
        (
            "no labels at all (Kaggle's test.csv)",
            "a,b\n9,5\n".into(),
            &["has no column `label`", "cannot be scored"],
        ),
        (
            "a column that training lacks",
            "a,b,c,label\n9,5,1,0\n".into(),
            &["has the column `c`", "data.ignore_columns = [\"c\"]"],
        ),
        ("a column less", "a,label\n9,0\n".into(), &["has no column `b`", "the same columns"]),
        (
            "values above those of training",
            "a,b,label\n9,255,0\n8,3,1\n".into(),
            &["the test values reach 255", "data.full_scale = 255"],
        ),
    ];
    for (what, text, words) in tests {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("own.csv"), sound(60)).unwrap();
        std::fs::write(folder.path().join("test.csv"), &text).unwrap();
        refused(what, load(folder.path(), own), words);
    }
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("own.csv"), sound(60)).unwrap();
    let same = "format = \"csv\"\ntrain = \"own.csv\"\ntest = \"./own.csv\"";
    refused(
        "one file twice",
        load(folder.path(), same),
        &["are the same examples (", "data.test out"],
    );
}

/// What it is, the array of values, the array of labels, and words of the refusal.
type ArrayCase<'a> = (&'a str, Vec<u8>, Vec<u8>, &'a [&'a str]);

#[test]
fn arrays_that_cannot_be_right_are_refused_with_a_cure() {
    let own = "format = \"npz\"\ntrain = \"x.npy\"\ntrain_labels = \"y.npy\"";
    let twelve: Vec<u8> = (0..12).collect();
    let (x, y) = (floats(&[0.5, 0.25, 1.0, 0.0].repeat(3)), whole(&[0, 1].repeat(6)));
    let bad = |x: f32| floats(&[&[x, 0.5][..], &[0.25; 10]].concat());
    let cases: [ArrayCase<'_>; 14] = [
        ("NaN", bad(f32::NAN), y.clone(), &["hold NaN", "a missing value", "nan_to_num"]),
        ("infinity", bad(f32::INFINITY), y.clone(), &["hold inf", "fill the gap"]),
        ("standardised values", bad(-1.5), y.clone(), &["reach from -1.5 to 0.5", "(x - least)"]),
        (
            "fractions up to 254.5",
            bad(254.5),
            y.clone(),
            &["have fractions and reach from 0.25 to 254.5", "divide all parts alike"],
        ),
        (
            "16 bits",
            npy("<u2", "(12, 1)", &[0xff, 0x0f].repeat(12)),
            y.clone(),
            &["whole numbers up to 4095", "divide all parts by 4095"],
        ),
        (
            "one-hot labels",
            x.clone(),
            npy("|u1", "(12, 2)", &[0, 1].repeat(12)),
            &["shape [12, 2]", "undo a one-hot code"],
        ),
        (
            "labels of other examples",
            x.clone(),
            whole(&[0, 1, 0]),
            &["shape [3]", "belong together"],
        ),
        (
            "a measurement as label",
            x.clone(),
            npy("<f4", "(12,)", &0.5f32.to_le_bytes().repeat(12)),
            &["has the label 0.5", "name another array"],
        ),
        (
            "one class",
            x.clone(),
            whole(&[3; 12]),
            &["all 12 labels are `3`", "nothing to tell apart"],
        ),
        (
            "every label another",
            x.clone(),
            whole(&twelve),
            &["12 training examples have 12 different labels", "data.classes = 12"],
        ),
        (
            "Python objects",
            x.clone(),
            npy("|O", "(12,)", &[0; 12]),
            &["elements of type `|O`", ".astype(str)"],
        ),
        (
            "half floats",
            npy("<f2", "(12, 1)", &[0; 24]),
            y.clone(),
            &["elements of type `<f2`", ".astype(numpy.uint8)"],
        ),
        (
            "text as values",
            npy("<U1", "(12, 1)", &b"a\0\0\0".repeat(12)),
            y.clone(),
            &["string, where values are needed"],
        ),
        (
            "something else",
            b"hello".to_vec(),
            y.clone(),
            &["is not a zip archive", "numpy.savez_compressed"],
        ),
    ];
    for (what, x, y, words) in cases {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("x.npy"), x).unwrap();
        std::fs::write(folder.path().join("y.npy"), y).unwrap();
        refused(what, load(folder.path(), own), words);
    }
}

#[test]
fn keys_of_data_that_have_no_effect_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let cases: [(&str, &[&str]); 19] = [
        (
            "train = \"own.csv\"",
            &["`data.train` is given without data.format", "data.format = \"csv\""],
        ),
        ("train = \"mnist.npz\"", &["data.format = \"npz\""]),
        ("train = \"images-idx3-ubyte.gz\"", &["data.format = \"idx\""]),
        ("classes = 3", &["`data.classes` is given without data.format"]),
        ("set = \"xor\"\nfull_scale = 3", &["`data.full_scale` is given without data.format"]),
        (
            "set = \"xor\"\nformat = \"csv\"\ntrain = \"a\"",
            &["data.format", "name a set or files, not both"],
        ),
        ("format = \"parquet\"\ntrain = \"a\"", &["is \"parquet\"", "idx, npz or csv"]),
        ("format = \"csv\"", &["`data.train` is missing"]),
        (
            "format = \"csv\"\ntrain = \"a\"\ntrain_labels = \"b\"",
            &["`data.train_labels` is given beside", "idx, npz; take it out"],
        ),
        (
            "format = \"csv\"\ntrain = \"a\"\ntrain_array = \"b\"",
            &["`data.train_array` is given beside", "npz; take it out"],
        ),
        (
            "format = \"csv\"\ntrain = \"a\"\nexamples_array = \"b\"",
            &["`data.examples_array` is given beside"],
        ),
        (
            "format = \"npz\"\ntrain = \"a\"\nlabel_column = \"b\"",
            &["`data.label_column` is given beside", "csv; take it out"],
        ),
        ("format = \"npz\"\ntrain = \"a\"\nheader = true", &["`data.header` is given beside"]),
        (
            "format = \"idx\"\ntrain = \"a\"\ntrain_labels = \"b\"\nignore_columns = []",
            &["`data.ignore_columns` is given beside"],
        ),
        (
            "format = \"idx\"\ntrain = \"a\"",
            &["`data.train_labels` is missing", "a file of their own"],
        ),
        (
            "format = \"npz\"\ntrain = \"a\"\ntest_labels = \"b\"",
            &["`data.test_labels` is given without data.test", "data.test_array"],
        ),
        (
            "format = \"npz\"\ntrain = \"a\"\nvalidation_labels_array = \"b\"",
            &["`data.validation_labels_array` is given without"],
        ),
        (
            "format = \"npz\"\ntrain = \"a\"\ntrain_array = \"b\"\nexamples_array = \"c\"",
            &["`data.examples_array` has no effect", "take it out"],
        ),
        (
            "format = \"csv\"\ntrain = \"a\"\nseparator = \"x\"",
            &["`data.separator` is \"x\"", "tab"],
        ),
    ];
    for (keys, words) in cases {
        refused(keys, load(folder.path(), keys), words);
    }
}

#[test]
fn an_example_of_one_part_stands_in_no_other() {
    let folder = tempfile::tempdir().unwrap();
    let table = lines(61, |row| format!("{},{},{}", row + 2, row * 7 % 256, row % 3));
    std::fs::write(folder.path().join("own.csv"), format!("a,b,label\n{table}")).unwrap();
    let data = load(folder.path(), "format = \"csv\"\ntrain = \"own.csv\"").unwrap();
    let Split { train, validation, test } = data.split();
    let rows =
        |part: &Examples| part.all_values().chunks(2).map(|row| row[0] - 2).collect::<Vec<_>>();
    let mut all = [rows(train), rows(validation), rows(test)].concat();
    all.sort_unstable();
    assert_eq!(all, (0..61).collect::<Vec<_>>());
    assert_eq!(rows(test), (0..61).filter(|row| row % 6 == 5).collect::<Vec<_>>());
}
