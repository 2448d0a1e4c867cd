//! Any text is a configuration that resolves to itself, or an error that can be shown.
#![no_main]

use dalean::lab::config::{Sources, load};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|text: &str| {
    // a model is a file name: reading what a fuzzer names is not the subject here
    if text.contains("model") {
        return;
    }
    let sources = |text| Sources { experiment: Some(("fuzz", text)), ..Sources::default() };
    match load(&sources(text)) {
        Ok(config) => {
            let resolved = config.to_toml();
            let again = load(&sources(&resolved)).expect("a resolved configuration is valid");
            assert_eq!(again.to_toml(), resolved);
            let _ = config.experiment(64, 10, Some([8, 8, 1]));
            let _ = config.warnings();
        }
        Err(error) => assert!(!error.to_string().is_empty()),
    }
});
