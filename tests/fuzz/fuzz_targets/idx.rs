//! Any bytes are an IDX array whose size is the product of its dimensions, or an error that can be shown.
#![no_main]

use dalean::lab::data::idx;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    match idx::read_limited(bytes, 1 << 20) {
        Ok(array) => {
            assert_eq!(array.dims.iter().product::<usize>(), array.data.len());
            assert!(!array.data.is_empty());
        }
        Err(error) => assert!(!error.to_string().is_empty()),
    }
});
