//! Tests of tables: what is told from them, what is stated, what is refused.

use proptest::prelude::*;

use super::*;

fn key(text: &str) -> ColumnKey {
    text.parse().unwrap()
}

fn with(text: &str, reading: &Reading, like: Option<&TableLayout>) -> Result<CsvTable, String> {
    read(text.as_bytes(), reading, like, 255, 1 << 20).map_err(|error| error.to_string())
}

fn labelled(text: &str, label: &str) -> Result<(Vec<u8>, Vec<String>), String> {
    let reading = Reading { label: Some(key(label)), ..Reading::default() };
    with(text, &reading, None).map(|table| seen(&table))
}

fn seen(table: &CsvTable) -> (Vec<u8>, Vec<String>) {
    let name = |&at: &u32| table.labels.distinct[at as usize].to_string();
    (table.values.clone(), table.labels.of.iter().map(name).collect())
}

fn words(labels: &[&str]) -> Vec<String> {
    labels.iter().map(ToString::to_string).collect()
}

#[test]
fn the_label_column_is_found_by_place_number_and_name() {
    let all = Ok((vec![10, 20, 30, 40], words(&["1", "0"])));
    assert_eq!(labelled("1,10,20\n0,30,40\n", "first"), all);
    assert_eq!(labelled("10,20,1\r\n30,40,0", "last"), all);
    assert_eq!(labelled("\u{feff}10, 1 ,20\n30,\"0\",40\n", "1"), all);
    assert_eq!(labelled("a,b,class\n10,20,1\n30,40,0\n", "class"), all);
    assert_eq!(labelled("0,class,1\n10,1,20\n30,0,40\n", "class"), all);
    assert_eq!(labelled("a,b,c\n10,20,1\n30,40,0\n", "last"), all);
    assert_eq!(labelled("10;20;1.0\n30;40;0,0\n", "last"), all);
}

#[test]
fn a_table_that_says_nothing_is_told_by_names_text_and_ends() {
    for (text, label, said) in [
        ("label,1x1,1x2\n5,0,9\n4,7,8\n5,1,1\n4,2,2\n", 0, "label column `label`, the first of 3"),
        ("0,1,2,3,label\n9,0,9,1,5\n8,7,8,3,4\n", 4, "`label`, the last of 5 (by its name)"),
        ("a,b,Species\n1,2,setosa\n3,4,virginica\n", 2, "`Species`"),
        ("1,2,cat\n3,4,dog\n", 2, "the only one of text"),
        ("x,y,class\n1,2,0\n3,4,1\n", 2, "by its name"),
        ("5,0,0\n4,9,0\n5,7,0\n4,3,0\n", 0, "label column 0, the first of 3 (it alone"),
        ("0,9,1\n0,8,0\n0,7,1\n0,6,0\n", 2, "label column 2, the last of 3 (it alone"),
        ("7,9,1\n7,8,0\n3,7,1\n3,6,0\n", 2, "the last"),
    ] {
        let table = with(text, &Reading::default(), None).unwrap();
        assert_eq!(table.layout.label, label, "{text}");
        assert!(table.said.iter().any(|line| line.contains(said)), "{text}: {:?}", table.said);
    }
}

#[test]
fn an_index_without_a_name_is_left_out_and_said() {
    let table = with(",a,label\n0,7,1\n1,8,0\n2,9,1\n", &Reading::default(), None).unwrap();
    assert_eq!(seen(&table), (vec![7, 8, 9], words(&["1", "0", "1"])));
    assert!(
        table.said[0].contains("column 0 has no name and numbers the rows"),
        "{:?}",
        table.said
    );
    let shuffled = with(",a,label\n71,7,1\n5,8,0\n31,9,1\n", &Reading::default(), None).unwrap();
    assert_eq!(shuffled.values, [7, 8, 9]);
    let error = with(",a,label\n1,7,1\n1,8,0\n2,9,1\n", &Reading::default(), None).unwrap_err();
    assert!(error.contains("data.ignore_columns = [\"0\"]"), "{error}");
}

#[test]
fn another_part_is_read_by_the_names_of_the_training_part() {
    let none = Reading::default();
    let train = with("label,a,b\n1,10,20\n0,30,40\n", &none, None).unwrap();
    let like = Some(&train.layout);
    let test = with("b,label,a\n2,1,1\n", &none, like).unwrap();
    assert_eq!(seen(&test), (vec![1, 2], words(&["1"])));
    let index = with(",b,label,a\n9,2,1,1\n", &none, like).unwrap();
    assert_eq!(seen(&index), (vec![1, 2], words(&["1"])));
    assert_eq!(seen(&with("1,5,6\n", &none, like).unwrap()), (vec![5, 6], words(&["1"])));
    for (text, wanted) in [
        ("a,b\n1,2\n", "has no column `label`, which the training part has as label"),
        ("label,a\n1,2\n", "has no column `b`"),
        ("label,a,b,c\n1,2,3,4\n", "has the column `c`, which the training part lacks"),
        ("label,a,a\n1,2,3\n", "two columns `a`"),
        ("1,2\n", "has 2 columns, but the training part has 3"),
    ] {
        let error = with(text, &none, like).unwrap_err();
        assert!(error.contains(wanted), "{text}: {error}");
    }
    let ignore = Reading { ignore: Some(vec![key("c")]), ..Reading::default() };
    assert_eq!(with("label,a,b,c\n1,2,3,4\n", &ignore, like).unwrap().values, [2, 3]);
}

#[test]
fn every_kind_of_damage_says_where_and_what_to_do() {
    let cases = [
        ("", "last", "no line of values"),
        ("a,b\n", "last", "no line of values"),
        ("123\n456\n", "last", "line 1 has the single field `123`"),
        ("1,2\n1,2,3\n", "last", "line 2 has 3 fields, but the lines before it have 2"),
        ("5,2\n256,2\n", "last", "values that are whole numbers up to 256"),
        ("5,2\n-1,2\n", "last", "values that reach from -1 to 5"),
        ("5,2\n0.5,2\n", "last", "have fractions and reach from 0.5 to 5"),
        ("5,2\n,2\n", "last", "line 2, column 0 holds ``: a missing value"),
        ("5,2\nNaN,2\n", "last", "line 2, column 0 holds `NaN`: a missing value"),
        ("5,2\n1,\n", "last", "line 2, column 1 holds ``: a missing value"),
        ("5,2\n1,2.5\n", "last", "holds the label `2.5`"),
        ("5,2,\n1,2,\n", "first", "a separator at the end of every line"),
        ("7,a\n1,2\n1,b\n", "first", "say data.header = true"),
        ("a,k\n1,2\nx1,3\n", "k", "line 3, column 0 (`a`) holds `x1`, which is no number"),
        ("\"1,5\",2\n\"2,5\",1\n", "last", "separate the fields by semicolons"),
        ("5,2\n", "2", "no column `2`; there are 0 to 1"),
        ("a,b\n1,2\n", "c", "no column `c`; the header has a, b"),
        ("b,b\n1,2\n", "b", "two columns `b`"),
        ("a,0\n1,2\n", "0", "column `0` may mean column 0 or the one that is called `0`"),
        ("1,2\n3,4\n", "last", "say data.header = true or data.header = false"),
        ("?,7,1\n5,8,0\n", "last", "the first line (?, 7, 1) may be a header or an example"),
    ];
    for (text, label, wanted) in cases {
        let found = labelled(text, label).unwrap_err();
        assert!(found.contains(wanted), "{text:?}: {found}");
    }
    for (text, wanted) in [
        ("1,5,0\n0,7,1\n1,5,0\n0,7,1\n", "column 0, column 2 may each be the label"),
        (
            "a,b,c\n1,1,1\n2,2,2\n3,3,3\n4,4,4\n5,5,5\n",
            "neither the first (5 different values, 1 to 5)",
        ),
        (
            "a,b,c\nx,y,1\nz,w,2\n",
            "`a`, `b` may each be the label; say which with data.label_column",
        ),
        ("class,label,c\n1,1,1\n0,0,2\n", "`class`, `label` may each"),
        ("label\tclass\n1\t1\n", "may each be the label"),
    ] {
        let found = with(text, &Reading::default(), None).unwrap_err();
        assert!(found.contains(wanted), "{text:?}: {found}");
    }
    let rows: String = (0..9).map(|row| format!("{row},{},{}\n", row * 3, row % 2)).collect();
    let found = with(&format!("id,a,label\n{rows}"), &Reading::default(), None).unwrap_err();
    assert!(
        found.contains("column 0 (`id`) numbers the rows") && found.contains("[\"id\"]"),
        "{found}"
    );
    let keep = Reading { ignore: Some(vec![]), ..Reading::default() };
    assert_eq!(with(&format!("id,a,label\n{rows}"), &keep, None).unwrap().features, 2);
}

#[test]
fn a_line_of_endless_fields_costs_no_memory() {
    let text = format!("{}\n", "1,".repeat(300_000));
    let error = with(&text, &Reading::default(), None).unwrap_err();
    assert!(error.contains("has 300001 columns, at most 262144"), "{error}");
}

#[test]
fn a_column_key_prints_as_it_is_read() {
    for text in ["first", "last", "3", "digit"] {
        assert_eq!(text.parse::<ColumnKey>().unwrap().to_string(), text);
    }
}

proptest! {
    #[test]
    fn any_bytes_are_a_table_or_an_error(text in "[0-9,;\n\"ax. ]{0,60}", tail: Vec<u8>) {
        let bytes = [text.as_bytes(), &tail].concat();
        for label in ["first", "last", "1", "a", ""] {
            let label = Some(label).filter(|label| !label.is_empty()).map(key);
            let reading = Reading { label, ..Reading::default() };
            match read(&bytes, &reading, None, 255, 1 << 16) {
                Ok(table) => {
                    prop_assert_eq!(table.values.len(), table.features * table.labels.of.len());
                    let again = read(&bytes, &reading, Some(&table.layout), 255, 1 << 16).unwrap();
                    prop_assert_eq!((again.values, again.labels), (table.values, table.labels));
                }
                Err(error) => prop_assert!(!error.to_string().is_empty()),
            }
        }
    }
}
