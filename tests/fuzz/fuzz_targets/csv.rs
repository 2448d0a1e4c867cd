//! Any bytes are a table with one label and as many values as features a line, or an error that can be
//! shown, wherever the label is said to be.
#![no_main]

use dalean::lab::data::csv::{self, LabelColumn};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    for label in [
        LabelColumn::First,
        LabelColumn::Last,
        LabelColumn::Number(1),
        LabelColumn::Named("a".to_owned()),
    ] {
        match csv::read(bytes, &label) {
            Ok(table) => {
                assert!(table.features > 0 && !table.labels.is_empty());
                assert_eq!(table.values.len(), table.features * table.labels.len());
            }
            Err(error) => assert!(!error.to_string().is_empty()),
        }
    }
});
