//! Any bytes are calls of the public face that give a result, or an error that can be shown.
#![no_main]

use libfuzzer_sys::fuzz_target;

#[path = "../../it/facade/play.rs"]
mod play;

fuzz_target!(|bytes: &[u8]| play::play(bytes));
