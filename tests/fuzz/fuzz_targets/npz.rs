//! Any bytes are an archive whose arrays have as many elements as the product of their dimensions and values that keep to
//! the scale of fractions, or an error that can be shown.
#![no_main]

use dalean::lab::data::arrays::{self, PartName};
use dalean::lab::data::npy;
use dalean::lab::data::npz::Archive;
use dalean::lab::data::numbers::NumberKind;
use libfuzzer_sys::fuzz_target;

fn array(bytes: &[u8]) {
    match npy::values(bytes, 16) {
        Ok(array) => {
            assert_eq!(array.dims.iter().product::<usize>(), array.data.len());
            assert!(array.kind == NumberKind::Whole || array.data.iter().all(|&value| value <= 16));
        }
        Err(error) => assert!(!error.to_string().is_empty()),
    }
    match npy::labels(bytes) {
        Ok((dims, labels)) => {
            assert_eq!(dims.iter().product::<usize>(), labels.of.len());
            assert!(labels.of.iter().all(|&at| (at as usize) < labels.distinct.len()));
        }
        Err(error) => assert!(!error.to_string().is_empty()),
    }
}

fuzz_target!(|bytes: &[u8]| {
    array(bytes);
    match Archive::open(bytes) {
        Ok(mut archive) => {
            let names = archive.names();
            for part in PartName::EACH {
                for shared in [false, true] {
                    if let Some([values, labels]) = arrays::both(part, &names, shared) {
                        assert!(names.contains(&values) && names.contains(&labels) && values != labels);
                    }
                }
            }
            for name in names.iter().take(4) {
                match archive.read_limited(name, 1 << 20) {
                    Ok(bytes) => array(&bytes),
                    Err(error) => assert!(!error.to_string().is_empty()),
                }
            }
        }
        Err(error) => assert!(!error.to_string().is_empty()),
    }
});
