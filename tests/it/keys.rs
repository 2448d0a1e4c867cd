//! `dalean keys`, and the page that it makes.

use std::path::Path;

use serde_json::Value;

use super::program::{dalean, run};

#[test]
fn the_page_of_keys_is_what_the_program_prints() {
    let ran = run(dalean().args(["keys", "--markdown"]));
    assert_eq!(ran.code, Some(0), "{ran:?}");
    let page = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/CONFIG.md");
    expect_test::expect_file![page].assert_eq(&ran.stdout);
}

#[test]
fn a_key_is_found_by_a_part_of_its_name() {
    let ran = run(dalean().args(["keys", "headroom"]));
    assert_eq!(ran.code, Some(0), "{ran:?}");
    for word in ["hw.adc.headroom", "a whole number, 0..=16 bits", "adc.range = \"calibrated\""] {
        assert!(ran.stdout.contains(word), "{word} in {}", ran.stdout);
    }
    let ran = run(dalean().args(["keys", "rule", "--json"]));
    let lines: Vec<Value> =
        ran.stdout.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    let rule = lines.iter().find(|line| line["key"] == "learning.rule").unwrap();
    assert_eq!(rule["default"], "ed");
    assert!(rule["values"]["of"].as_array().unwrap().contains(&"bp".into()), "{rule}");
    assert_eq!(lines.last().unwrap()["event"], "done");
    let names = run(dalean().args(["keys", "--quiet"]));
    assert!(names.stdout.lines().any(|line| line == "learning.rate"), "{names:?}");
    let nothing = run(dalean().args(["keys", "hedroom"]));
    assert_eq!(nothing.code, Some(1));
    assert!(nothing.stderr.contains("did you mean \"headroom\"?"), "{nothing:?}");
}
