//! The pages in a real browser: nothing goes wrong, nothing is asked of the outside, what is drawn is what the table
//! says. Means and intervals are computed here once more, by other means than the page's.
#![expect(clippy::disallowed_types, reason = "a browser is given a limit of time")]

use dalean::lab::report::sweep::html;
use dalean::lab::table::Role;
use serde_json::Value;

mod chromium;
mod compare;
mod parts;
mod run;
mod sample;

use chromium::{Graphics, open};
use sample::Sample;

/// 97.5 % points of Student's distribution for 1 and 2 degrees of freedom.
const STUDENT: [f64; 2] = [12.706_204_736_174_7, 4.302_652_729_749_46];

/// No error, nothing from outside, every axis that has marks has a title, everything a reader can use has a name.
fn check(found: &Value) {
    assert_eq!(found["errors"], serde_json::json!([]));
    assert_eq!(found["requests"], serde_json::json!([]));
    assert_eq!(found["unnamed"], 0, "choices without a label");
    for (id, figure) in found["figures"].as_object().unwrap() {
        assert!(!figure["caption"].as_str().unwrap().is_empty(), "{id} has a caption");
        if figure["empty"] == true {
            continue;
        }
        assert!(figure["drawn"].as_u64().unwrap() > 5, "{id} has drawn something");
        assert!(!figure["label"].as_str().unwrap().is_empty(), "{id} says what it shows");
        for (name, axis) in figure["axes"].as_object().unwrap() {
            let named = axis["bare"] == true || !axis["title"].as_str().unwrap().is_empty();
            assert!(named, "{id}: {name} has a title");
        }
    }
}

/// Numbers of a result where some axes have some values.
fn values(sample: &Sample, result: &str, at: &[(&str, &str)]) -> Vec<f64> {
    let column = |name: &str| sample.table.column(name).unwrap();
    let fits = |row: &usize| {
        at.iter().all(|(name, value)| column(name).values.text(*row).as_deref() == Some(*value))
    };
    let rows = (0..sample.table.len()).filter(fits);
    rows.filter_map(|row| column(result).values.number(row)).collect()
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// Half the interval, from sums instead of deviations.
fn half(values: &[f64]) -> f64 {
    let n = values.len() as f64;
    let squares: f64 = values.iter().map(|value| value * value).sum();
    let variance = (squares - n * mean(values).powi(2)) / (n - 1.0);
    STUDENT[values.len() - 2] * (variance.max(0.0) / n).sqrt()
}

fn close(found: &Value, wanted: f64) {
    let found = found.as_f64().unwrap();
    assert!((found - wanted).abs() < 1e-6 * (1.0 + wanted.abs()), "{found} is not {wanted}");
}

fn traces<'a>(found: &'a Value, figure: &str, kind: &'static str) -> Vec<&'a Value> {
    let all = found["figures"][figure]["traces"].as_array().unwrap();
    all.iter().filter(|trace| trace["meta"]["kind"] == kind).collect()
}

#[test]
fn curves_are_the_means_of_the_table_and_bands_their_intervals() {
    let sample = Sample::grid();
    let steps = "await drawn(); const first = look(); choose('choose-y', 'joules'); choose('choose-panel', ''); \
                 const second = look(); return { ...first, second };";
    let Some(found) = open(&html(&sample.view()), steps, Graphics::Played) else { return };
    check(&found);
    let curves = traces(&found, "curves", "mean");
    assert_eq!(curves.len(), 6, "3 roundings x 2 rules");
    for curve in &curves {
        let text = |key: &str| curve["meta"][key].as_str().unwrap().to_owned();
        let (rounding, rule) = (text("series"), text("panel"));
        let places = curve["x"].as_array().unwrap();
        assert_eq!(
            places.len(),
            if rule == "ed" { 12 } else { 11 },
            "points without a run are left out"
        );
        for (at, place) in places.iter().enumerate() {
            let bits = place.as_u64().unwrap().to_string();
            let here = [("level_bits", bits.as_str()), ("rounding", &rounding), ("rule", &rule)];
            let values = values(&sample, "test_accuracy", &here);
            close(&curve["y"][at], 100.0 * mean(&values));
            assert_eq!(curve["customdata"][at][0], values.len());
            close(&curve["customdata"][at][2], half(&values));
        }
    }
    let parallel = traces(&found, "parallel", "parallel")[0];
    assert_eq!(parallel["type"], "parcoords");
    assert_eq!(parallel["dimensions"].as_array().unwrap().len(), 5, "3 axes, cost and result");
    let bands = traces(&found, "curves", "band");
    assert_eq!(bands.len(), 6);
    for (curve, band) in curves.iter().zip(bands) {
        let n = curve["x"].as_array().unwrap().len();
        for at in 0..n {
            let (low, high) = (&band["y"][2 * n - 1 - at], &band["y"][at]);
            let (mean, half) = (&curve["customdata"][at][1], &curve["customdata"][at][2]);
            let [mean, half] = [mean, half].map(|number| number.as_f64().unwrap());
            close(high, 100.0 * (mean + half));
            close(low, 100.0 * (mean - half));
        }
    }
    let titles = &found["figures"]["curves"]["axes"];
    assert_eq!(titles["yaxis"]["title"], "test accuracy (%)");
    assert_eq!(titles["xaxis"]["title"], "level bits");
    assert!(found["figures"]["curves"]["caption"].as_str().unwrap().contains("n = 2 to 3"));
    changed(&sample, &found["second"]);
}

/// Another result, one panel: the axis that is not shown any more is held at the best setting.
fn changed(sample: &Sample, found: &Value) {
    assert_eq!(found["hash"], "#y=joules&panel=");
    let curves = traces(found, "curves", "mean");
    assert_eq!(curves.len(), 3);
    let caption = found["figures"]["curves"]["caption"].as_str().unwrap();
    assert!(caption.contains("Held: rule = bp."), "{caption}");
    assert_eq!(found["figures"]["curves"]["axes"]["yaxis"]["title"], "joules (µJ)");
    let rounding = curves[1]["meta"]["series"].as_str().unwrap();
    let values =
        values(sample, "joules", &[("level_bits", "4"), ("rounding", rounding), ("rule", "bp")]);
    close(&curves[1]["y"][3], 1e6 * mean(&values));
}

#[test]
fn heat_map_and_front_are_those_of_the_table() {
    let sample = Sample::grid();
    let steps = "await drawn(); return look();";
    let Some(found) = open(&html(&sample.view()), steps, Graphics::None) else { return };
    check(&found);
    let heat = traces(&found, "heat", "heat")[0];
    assert_eq!(heat["bar"], "test accuracy (%)");
    for (j, rounding) in ["nearest", "stochastic", "separable"].into_iter().enumerate() {
        for bits in 1..=11usize {
            let at = [("level_bits", &*bits.to_string()), ("rounding", rounding), ("rule", "bp")];
            let mean = 100.0 * mean(&values(&sample, "test_accuracy", &at));
            close(&heat["z"][j][bits - 1], mean);
            assert_eq!(heat["text"][j][bits - 1], format!("{mean:.1}"));
        }
        assert!(heat["z"][j][11].is_null() && heat["text"][j][11] == "", "no run, no colour");
    }

    // Every setting, and which of them none beats, by comparing all with all.
    let mut points = Vec::new();
    for bits in 1..=12 {
        for rounding in ["nearest", "stochastic", "separable"] {
            for rule in ["ed", "bp"] {
                let at =
                    [("level_bits", &*bits.to_string()), ("rounding", rounding), ("rule", rule)];
                let scores = values(&sample, "test_accuracy", &at);
                if !scores.is_empty() {
                    points.push((mean(&values(&sample, "joules", &at)), mean(&scores)));
                }
            }
        }
    }
    let beaten =
        |one: &(f64, f64)| points.iter().any(|two| two != one && two.0 <= one.0 && two.1 >= one.1);
    let mut best: Vec<_> = points.iter().filter(|one| !beaten(one)).collect();
    best.sort_by(|a, b| a.0.total_cmp(&b.0));
    let front = traces(&found, "pareto", "front")[0];
    assert_eq!(front["x"].as_array().unwrap().len(), best.len());
    for (at, (joules, score)) in best.iter().enumerate() {
        close(&front["x"][at], 1e6 * joules);
        close(&front["y"][at], 100.0 * score);
    }
    let drawn: usize = traces(&found, "pareto", "settings")
        .iter()
        .chain(&traces(&found, "pareto", "chosen"))
        .map(|trace| trace["x"].as_array().unwrap().len())
        .sum();
    assert_eq!(drawn, points.len());
    let figure = &found["figures"]["pareto"];
    assert_eq!(figure["lines"], best.len(), "the front is listed");
    assert!(figure["links"][0].as_str().unwrap().starts_with("runs/"));
    assert!(
        !traces(&found, "pareto", "chosen")[0]["error_x"]["array"].is_null(),
        "bounds of the energy"
    );
    // Without WebGL the lines are drawn all the same.
    let lines = traces(&found, "parallel", "parallel");
    assert!(lines.len() > 2 && lines.iter().all(|trace| trace["type"] == "scatter"));
}

#[test]
fn the_table_shows_finds_and_sorts_every_row() {
    let sample = Sample::grid();
    let steps = "await drawn(); const first = look(); \
        const box = document.getElementById('find'); box.value = 'rounding=stochastic level_bits=4 bp'; \
        box.dispatchEvent(new Event('input')); await rest(400); const second = look(); \
        box.value = ''; box.dispatchEvent(new Event('input')); await rest(400); \
        [...document.querySelectorAll('#table thead button')].find((one) => one.textContent === 'test accuracy').click(); \
        let saved; window.URL.createObjectURL = (blob) => { saved = blob; return 'blob:none'; }; \
        HTMLAnchorElement.prototype.click = () => {}; document.getElementById('csv-save').click(); \
        return { ...first, second, third: look(), csv: await saved.text() };";
    let Some(found) = open(&html(&sample.view()), steps, Graphics::None) else { return };
    check(&found);
    assert!(found["found"].as_str().unwrap().starts_with("216 rows, "), "{}", found["found"]);
    assert_eq!(found["fits"], true, "the table is no wider than its frame");
    assert_eq!(found["rows"].as_array().unwrap().len(), 50);
    assert_eq!(found["head"][1], "level bits");
    let runs = sample.table.column("run").unwrap();
    let wanted: Vec<_> = (0..50).filter_map(|row| runs.values.text(row)).collect();
    assert_eq!(found["runs"], serde_json::json!(wanted));
    assert_eq!(found["rows"][46][0], "47, no result");
    let score = sample.table.column("test_accuracy").unwrap();
    let text = format!("{:.2}\u{202f}%", 100.0 * score.values.number(0).unwrap());
    assert_eq!(found["rows"][0][5], text);

    assert!(found["second"]["found"].as_str().unwrap().starts_with("3 of 216 rows, "));
    let best = (0..216).filter_map(|row| score.values.number(row)).fold(0.0, f64::max);
    assert_eq!(found["third"]["rows"][0][5], format!("{:.2}\u{202f}%", 100.0 * best), "best first");

    // The CSV holds the numbers to the last digit.
    let csv = found["csv"].as_str().unwrap();
    let mut reader = csv::Reader::from_reader(csv.as_bytes());
    let names: Vec<&str> = sample.table.columns.iter().map(|column| column.name.as_str()).collect();
    assert_eq!(reader.headers().unwrap(), names);
    let records: Vec<_> = reader.records().map(Result::unwrap).collect();
    assert_eq!(records.len(), 216);
    let first: f64 = records[0][4].parse().unwrap();
    assert_eq!(first, best);
    let sum: f64 = records.iter().filter_map(|record| record[4].parse::<f64>().ok()).sum();
    let wanted: f64 = (0..216).filter_map(|row| score.values.number(row)).sum();
    assert!((sum - wanted).abs() < 1e-9);
}

#[test]
fn ten_thousand_rows_open_quickly() {
    let sample = Sample::large(10_000);
    assert_eq!(sample.table.columns.len(), 25);
    let page = html(&sample.view());
    for graphics in [Graphics::Software, Graphics::None] {
        let steps = "await drawn(); const first = look(); choose('choose-x', 'write_noise'); \
                     return { ...first, second: look() };";
        let Some(found) = open(&page, steps, graphics) else { return };
        check(&found);
        // where values were drawn from a range, every run of a setting is a point of its own
        let second = traces(&found["second"], "curves", "mean");
        let points = second.iter().flat_map(|trace| trace["customdata"].as_array().unwrap());
        assert!(points.clone().count() > 500 && points.clone().all(|point| point[0] == 1));
        let (ready, nodes) = (found["ready"].as_f64().unwrap(), found["nodes"].as_u64().unwrap());
        println!(
            "10 000 x 25, {graphics:?}: {} bytes, all drawn after {ready} ms, {nodes} nodes",
            page.len()
        );
        println!("milliseconds: {}", found["marks"]);
        assert!(ready < 20_000.0, "{ready} ms");
        assert!(nodes < 12_000, "{nodes} nodes");
        let caption = found["figures"]["curves"]["caption"].as_str().unwrap();
        assert!(
            caption.contains("not repetitions") && caption.contains("not a confidence interval")
        );
        assert!(found["found"].as_str().unwrap().starts_with("10\u{202f}000 rows, "));
        let parallel = &found["figures"]["parallel"]["caption"];
        assert!(parallel.as_str().unwrap().contains("evenly picked"));
    }
}

#[test]
fn odd_tables_make_pages_without_errors() {
    for sample in [Sample::words(), Sample::hollow(), Sample::empty()] {
        let Some(found) =
            open(&html(&sample.view()), "await drawn(); return look();", Graphics::None)
        else {
            return;
        };
        println!("{}", sample.name);
        check(&found);
        let results = sample.table.with_role(Role::Result);
        let any = results
            .flat_map(|column| (0..column.values.len()).filter_map(|row| column.values.text(row)))
            .count();
        assert_eq!(found["figures"]["curves"]["empty"], any == 0);
        assert_eq!(found["figures"]["pareto"]["empty"], true, "no cost or no result");
    }
}

#[test]
fn an_address_brings_its_choices_back() {
    let sample = Sample::grid();
    let steps = "await drawn(); location.hash = '#x=rounding&series=rule&hold.level_bits=5&panel='; await rest(300); \
                 const first = look(); location.hash = '#x=rounding&series=rule&hold.level_bits=*&panel='; await rest(300); \
                 return { ...first, second: look() };";
    let Some(found) = open(&html(&sample.view()), steps, Graphics::None) else { return };
    check(&found);
    let curves = traces(&found, "curves", "mean");
    assert_eq!(curves.len(), 2);
    for curve in curves {
        let rule = curve["meta"]["series"].as_str().unwrap();
        for (at, rounding) in ["nearest", "stochastic", "separable"].into_iter().enumerate() {
            let values = values(
                &sample,
                "test_accuracy",
                &[("level_bits", "5"), ("rounding", rounding), ("rule", rule)],
            );
            close(&curve["y"][at], 100.0 * mean(&values));
            close(&curve["error_y"]["array"][at], 100.0 * half(&values));
        }
    }
    pooled(&sample, &found["second"]);
}

/// Pooled settings have a mean and a range.
fn pooled(sample: &Sample, found: &Value) {
    let caption = found["figures"]["curves"]["caption"].as_str().unwrap();
    assert!(caption.contains("over level bits, pooled") && caption.contains("range"), "{caption}");
    let curves = traces(found, "curves", "mean");
    assert_eq!(curves.len(), 2);
    for curve in curves {
        let rule = curve["meta"]["series"].as_str().unwrap();
        for (at, rounding) in ["nearest", "stochastic", "separable"].into_iter().enumerate() {
            let values = values(sample, "test_accuracy", &[("rounding", rounding), ("rule", rule)]);
            let ends = [
                values.iter().copied().fold(1.0, f64::min),
                values.iter().copied().fold(0.0, f64::max),
            ];
            close(&curve["y"][at], 100.0 * mean(&values));
            close(&curve["error_y"]["array"][at], 100.0 * (ends[1] - mean(&values)));
            close(&curve["error_y"]["arrayminus"][at], 100.0 * (mean(&values) - ends[0]));
            assert_eq!(curve["customdata"][at][0], values.len());
        }
    }
}
