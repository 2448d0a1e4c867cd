//! Any bytes are a table with one label and as many values as features a line, or an error that can be shown; what is read
//! is read again, in the same way, by its own layout. The first bytes say what is stated of it.
#![no_main]

use dalean::lab::data::csv::{self, ColumnKey, Reading};
use dalean::lab::data::labels;
use dalean::lab::data::numbers::NumberKind;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    let [choice, more, bytes @ ..] = bytes else { return };
    let key = |which: u8| match which % 5 {
        0 => None,
        1 => Some(ColumnKey::First),
        2 => Some(ColumnKey::Last),
        3 => Some(ColumnKey::Number(1)),
        _ => Some(ColumnKey::Named("a".to_owned())),
    };
    let reading = Reading {
        label: key(*choice),
        ignore: key(choice / 5).map(|key| vec![key]),
        header: [None, None, Some(true), Some(false)][usize::from(more % 4)],
        separator: [None, None, Some(b','), Some(b';'), Some(b'\t')][usize::from(more / 4 % 5)],
    };
    match csv::read(bytes, &reading, None, 16, 1 << 20) {
        Ok(table) => {
            let examples = table.labels.of.len();
            assert!(table.features > 0 && examples > 0);
            assert_eq!(table.values.len(), table.features * examples);
            assert!(table.kind == NumberKind::Whole || table.values.iter().all(|&value| value <= 16));
            let again = csv::read(bytes, &reading, Some(&table.layout), 16, 1 << 20).expect("by its own layout");
            assert_eq!((&again.values, &again.labels), (&table.values, &table.labels));
            let stated = Some(usize::from(*choice)).filter(|classes| classes % 3 == 0);
            match labels::classes(&[("training", &table.labels)], stated) {
                Ok(classes) => {
                    assert!((2..=256).contains(&classes.count));
                    assert!(classes.labels[0].iter().all(|&label| usize::from(label) < classes.count));
                    assert!(classes.names.is_empty() || classes.names.len() == classes.count);
                }
                Err(error) => assert!(!error.to_string().is_empty()),
            }
        }
        Err(error) => assert!(!error.to_string().is_empty()),
    }
});
