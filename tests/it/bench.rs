//! The bench runs and says what it found in lines that programs can read. Its times are nobody's test.

use serde_json::Value;

use super::program::{dalean, run};

#[test]
fn a_section_can_be_measured_alone_and_read_by_programs() {
    let ran = run(dalean().args(["bench", "--quick", "--only", "peak", "--json"]));
    assert_eq!(ran.code, Some(0), "{ran:?}");
    let lines: Vec<Value> =
        ran.stdout.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    assert_eq!((&lines[0]["event"], &ran.last()["event"]), (&"machine".into(), &"done".into()));
    let kernels = lines[0]["kernels"].as_array().unwrap();
    for row in &lines[1..lines.len() - 1] {
        assert_eq!(row["event"], "peak");
        assert!(kernels.contains(&row["kernel"]) && row["gmac_per_second_best"].is_f64(), "{row}");
    }
}

#[test]
fn what_cannot_be_measured_is_refused() {
    for bad in [["--threads", "0"], ["--kernel", "none"], ["--only", "nothing"]] {
        let ran = run(dalean().args(["bench", "--quick"]).args(bad));
        assert_eq!(ran.code, Some(2), "{bad:?}: {ran:?}");
    }
}
