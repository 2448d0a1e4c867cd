//! Any bytes are an NPZ archive and a .npy array whose size is the product of its dimensions and whose
//! values keep to the scale of floats, or an error that can be shown.
#![no_main]

use dalean::lab::data::{
    npy::{self, Floats},
    npz,
};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    for floats in [Floats::Scale(16), Floats::Refuse] {
        let arrays = [
            npz::read_limited(bytes, "x", floats, 1 << 20).map_err(|e| e.to_string()),
            npy::read(bytes, floats).map_err(|e| e.to_string()),
        ];
        for array in arrays {
            match array {
                Ok(array) => {
                    assert_eq!(array.dims.iter().product::<usize>(), array.data.len());
                    assert!(!array.scaled || array.data.iter().all(|&value| value <= 16));
                    assert!(!array.scaled || floats != Floats::Refuse);
                }
                Err(error) => assert!(!error.is_empty()),
            }
        }
    }
});
