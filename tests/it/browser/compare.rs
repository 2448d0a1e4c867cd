//! The page that compares runs, in a real browser: curves and tables are those of the records, and it fits a narrow window.

use serde_json::Value;

use super::chromium::{Graphics, open_at};
use super::run::{SAVED, check_saved, clean};
use crate::program::{dalean, run, trained};

#[test]
fn runs_side_by_side_are_those_of_their_records() {
    let out = tempfile::tempdir().unwrap();
    let (first, _) = trained(out.path(), &["--hw", "pcm14"]);
    let (second, _) = trained(out.path(), &["--hw", "reram", "--set", "learning.rate=5"]);
    let place = out.path().join("both.html");
    let said = run(dalean().arg("compare").args([&first, &second]).arg("--out").arg(&place));
    assert_eq!(said.code, Some(0), "{said:?}");
    assert!(said.stdout.contains(&format!("page     {}", place.display())), "{}", said.stdout);
    let page = std::fs::read_to_string(&place).unwrap();
    let steps = format!(
        "await rest(200);
        const tip = document.getElementById('tip');
        const last = (id, at) => {{ const chart = document.querySelectorAll(`#${{id}} svg.chart`)[at]; chart.focus();
          chart.dispatchEvent(new KeyboardEvent('keydown', {{ key: 'End', bubbles: true }})); const text = tip.textContent; chart.blur(); return text; }};
        const rows = (id) => [...document.querySelectorAll(`#${{id}} tbody tr`)].map((row) => [...row.cells].map((cell) => cell.textContent));
        const told = [last('accuracy', 0), last('accuracy', 1), last('balance', 1)];
        const found = {{ told, keys: rows('keys'), results: rows('results'), states: rows('states'), charts: document.querySelectorAll('svg.chart').length }};
        const files = await (async () => {{ {SAVED} }})();
        return {{ ...found, files }};"
    );
    let Some(found) = open_at(&page, &steps, Graphics::None, 1300) else { return };
    clean(&found);
    assert!(found["charts"].as_u64().unwrap() >= 7, "{}", found["charts"]);

    let records = |folder: &std::path::Path| -> Vec<Value> {
        let text = std::fs::read_to_string(folder.join("metrics.jsonl")).unwrap();
        text.lines().map(|line| serde_json::from_str(line).unwrap()).collect()
    };
    let both = [records(&first), records(&second)];
    for (told, part) in [(0, "validation"), (1, "train")] {
        let text = found["told"][told].as_str().unwrap();
        for (at, records) in both.iter().enumerate() {
            let score = &records.last().unwrap()["outcome"][part];
            let share = score["correct"].as_f64().unwrap() / score["total"].as_f64().unwrap();
            let line = format!("({}) {:.2}\u{202f}%", at + 1, 100.0 * share);
            assert!(text.contains(&line), "{line} in {text}");
        }
    }
    let floor = |records: &[Value]| {
        let pathways = records.last().unwrap()["pathways"].as_array().unwrap().clone();
        let sum = |key: &str| pathways.iter().map(|one| one[key].as_f64().unwrap()).sum::<f64>();
        100.0 * sum("floor") / sum("cells")
    };
    let line = format!("(2) {:.2}\u{202f}%", floor(&both[1]));
    assert!(found["told"][2].as_str().unwrap().contains(&line), "{line} in {}", found["told"][2]);

    let rows = |id: &str| found[id].as_array().unwrap().clone();
    let key = |name: &str| rows("keys").into_iter().find(|row| row[0] == name);
    assert!(key("learning.rate").is_some_and(|row| row[1] != row[2]), "{:?}", rows("keys"));
    assert_eq!(key("seed"), None, "keys that are alike are not listed");
    let hash =
        |at: usize, epoch: usize| both[at][epoch]["state_hash"].as_str().unwrap()[..12].to_owned();
    for (epoch, row) in rows("states").iter().enumerate() {
        assert_eq!(*row, serde_json::json!([epoch.to_string(), hash(0, epoch), hash(1, epoch)]));
    }
    let accuracy = rows("results").into_iter().find(|row| row[0] == "test accuracy").unwrap();
    assert!(
        accuracy[2].as_str().unwrap().contains("points")
            || accuracy[2].as_str().unwrap().contains('=')
    );
    check_saved(
        &found["files"],
        &["accuracy", "results", "keys", "balance", "writes", "energy", "states"],
    );
}

#[test]
fn a_comparison_fits_a_narrow_window() {
    let out = tempfile::tempdir().unwrap();
    let (first, _) = trained(out.path(), &["--hw", "pcm14"]);
    let (second, _) = trained(out.path(), &["--hw", "reram", "--seed", "2"]);
    let place = out.path().join("both.html");
    let said = run(dalean()
        .arg("compare")
        .args([&first, &second])
        .arg("--quiet")
        .arg("--out")
        .arg(&place));
    assert_eq!(said.code, Some(0), "{said:?}");
    let page = std::fs::read_to_string(&place).unwrap();
    let Some(found) = open_at(&page, super::run::NARROW, Graphics::None, 420) else { return };
    super::run::check_narrow(&found);
}
