//! Any text is a receipt and records of epochs that survive being written and read, or an error.
#![no_main]

use dalean::lab::store::folder::{parse_metrics, parse_receipt};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|text: &str| {
    if let Ok(receipt) = parse_receipt(text) {
        let written = serde_json::to_string(&receipt).expect("a receipt has a JSON form");
        assert!(parse_receipt(&written).is_ok());
    }
    if let Ok(records) = parse_metrics(text) {
        assert!(records.iter().enumerate().all(|(i, record)| record.epoch as usize == i));
    }
});
