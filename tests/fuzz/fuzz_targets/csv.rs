//! Any bytes are a table with one label and as many values as features a line, or an error that can be
//! shown. The first byte says where the label is.
#![no_main]

use dalean::lab::data::csv::{self, LabelColumn};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    let Some((choice, bytes)) = bytes.split_first() else { return };
    let label = match choice % 4 {
        0 => LabelColumn::First,
        1 => LabelColumn::Last,
        2 => LabelColumn::Number(1),
        _ => LabelColumn::Named("a".to_owned()),
    };
    match csv::read(bytes, &label) {
        Ok(table) => {
            assert!(table.features > 0 && !table.labels.is_empty());
            assert_eq!(table.values.len(), table.features * table.labels.len());
        }
        Err(error) => assert!(!error.to_string().is_empty()),
    }
});
