//! What a sweep's page says beside its curves: what runs learnt, what explains the variance, how the best setting was
//! chosen, how wide the steps of colour are; and that it fits a narrow window.

use dalean::lab::report::sweep::html;
use serde_json::Value;

use super::chromium::{Graphics, open, open_at};
use super::sample::Sample;
use super::{check, close, half, mean, traces, values};

#[test]
fn learning_curves_are_the_means_of_the_records() {
    let sample = Sample::grid();
    let steps = "await drawn(); const first = look(); choose('choose-learner', 'rule'); return { ...first, second: look() };";
    let Some(found) = open(&html(&sample.view()), steps, Graphics::None) else { return };
    check(&found);
    let curves = traces(&found, "learning", "learning");
    assert_eq!(curves.len(), 3, "a curve a rounding, the other axes held at the best setting");
    let caption = found["figures"]["learning"]["caption"].as_str().unwrap();
    assert!(caption.contains("Held: level bits = ") && caption.contains("rule = bp"), "{caption}");
    let bits = caption.split("level bits = ").nth(1).unwrap().split([',', '.']).next().unwrap();
    for curve in curves {
        let rounding = curve["meta"]["series"].as_str().unwrap();
        let at = [("level_bits", bits), ("rounding", rounding), ("rule", "bp")];
        let tops = values(&sample, "validation_accuracy", &at);
        assert_eq!(curve["x"], serde_json::json!([1, 2, 3, 4, 5, 6]), "what was known before");
        let of = |epoch: f64| -> Vec<f64> {
            tops.iter().map(|top| 0.1 + (top - 0.1) * epoch / 6.0).collect()
        };
        for at in 0..6 {
            let known = of(1.0 + at as f64);
            let drawn = curve["y"][at].as_f64().unwrap();
            assert!((drawn - 100.0 * mean(&known)).abs() < 1e-3, "{drawn}");
            let band = curve["customdata"][at][2].as_f64().unwrap();
            assert!((band - half(&known)).abs() < 1e-4, "{band}");
        }
    }
    assert_eq!(traces(&found["second"], "learning", "learning").len(), 2);
    assert_eq!(found["second"]["hash"], "#learner=rule");
}

#[test]
fn shares_of_the_variance_are_those_of_the_table() {
    let sample = Sample::grid();
    let steps = "await drawn(); return look();";
    let Some(found) = open(&html(&sample.view()), steps, Graphics::None) else { return };
    let bars = traces(&found, "importance", "importance")[0];
    let all = values(&sample, "test_accuracy", &[]);
    let whole: f64 = all.iter().map(|x| (x - mean(&all)).powi(2)).sum();
    let axes: [(&str, Vec<String>); 3] = [
        ("level_bits", (1..=12).map(|bits| bits.to_string()).collect()),
        ("rounding", ["nearest", "stochastic", "separable"].map(String::from).into()),
        ("rule", ["ed", "bp"].map(String::from).into()),
    ];
    let names = bars["meta"]["names"].as_array().unwrap();
    let place = |axis: &str| names.iter().position(|name| *name == axis.replace('_', " ")).unwrap();
    for (axis, texts) in axes {
        let between: f64 = texts
            .iter()
            .map(|text| {
                let own = values(&sample, "test_accuracy", &[(axis, text)]);
                own.len() as f64 * (mean(&own) - mean(&all)).powi(2)
            })
            .sum();
        close(&bars["x"][place(axis)], 100.0 * between / whole);
    }
    assert!(names.iter().any(|name| name == "seeds"));
    // some settings were not run: the parts need not add up, and the caption says so
    let caption = found["figures"]["importance"]["caption"].as_str().unwrap();
    assert!(caption.contains("may overlap") && !names.iter().any(|name| name == "axes together"));
    let chance = &traces(&found, "importance", "chance")[0]["x"][place("level_bits")];
    close(chance, 100.0 * 11.0 / (all.len() as f64 - 1.0));
}

#[test]
fn the_headline_is_chosen_by_validation_and_the_test_stands_beside() {
    let sample = Sample::grid();
    let page = html(&sample.view());
    let (mut best, mut at) = (0.0, None);
    for bits in 1..=11 {
        for rounding in ["nearest", "stochastic", "separable"] {
            for rule in ["ed", "bp"] {
                let bits = bits.to_string();
                let own = [("level_bits", bits.as_str()), ("rounding", rounding), ("rule", rule)];
                let validation = values(&sample, "validation_accuracy", &own);
                if validation.len() == 3 && mean(&validation) > best {
                    (best, at) = (mean(&validation), Some(values(&sample, "test_accuracy", &own)));
                }
            }
        }
    }
    let test = at.unwrap();
    let head = &page[page.find("class=\"headline\"").unwrap()..page.find("class=\"keys").unwrap()];
    assert!(head.contains(&format!("{:.2}<small>", 100.0 * best)), "{head}");
    assert!(head.contains("highest validation accuracy"), "{head}");
    let beside = format!(
        "test accuracy there <b>{:.2}\u{202f}%</b> ±\u{202f}{:.2}",
        100.0 * mean(&test),
        100.0 * half(&test)
    );
    assert!(head.contains(&beside), "{beside} in {head}");
}

#[test]
fn a_step_of_colour_is_the_interval_of_a_cell() {
    let sample = Sample::grid();
    // at the best level bits little is left but noise
    let steps = "await drawn(); choose('choose-hx', 'rounding'); choose('choose-hy', 'rule'); return look();";
    let Some(found) = open(&html(&sample.view()), steps, Graphics::None) else { return };
    let heat = traces(&found, "heat", "heat")[0];
    let caption = found["figures"]["heat"]["caption"].as_str().unwrap();
    assert!(caption.contains("One step of colour is"), "{caption}");
    let bits = caption.split("level bits = ").nth(1).unwrap().trim_end_matches('.');
    let mut wide: Vec<f64> = Vec::new();
    for rounding in ["nearest", "stochastic", "separable"] {
        for rule in ["ed", "bp"] {
            let at = [("level_bits", bits), ("rounding", rounding), ("rule", rule)];
            let own = values(&sample, "test_accuracy", &at);
            if own.len() > 1 {
                wide.push(200.0 * half(&own));
            }
        }
    }
    wide.sort_by(f64::total_cmp);
    let step = wide[wide.len() / 2];
    close(&heat["meta"]["step"], step);
    let steps = heat["meta"]["steps"].as_f64().unwrap();
    assert!((6.0..=24.0).contains(&steps), "{steps}");
    let span = heat["zmax"].as_f64().unwrap() - heat["zmin"].as_f64().unwrap();
    close(&Value::from(span), steps * step);
}

#[test]
fn a_sweeps_page_fits_a_narrow_window() {
    let sample = Sample::grid();
    let steps = "await drawn(); const first = look(); const wide = document.documentElement.clientWidth; \
        const over = [...document.querySelectorAll('main *')].filter((one) => !one.closest('.plot, details, .scroll') && one.getBoundingClientRect().right > wide + 1); \
        const columns = document.querySelectorAll('#table thead th').length; document.getElementById('every').click(); \
        const button = document.querySelector('#table thead button'); button.focus(); const told = document.getElementById('tip').textContent; \
        return { ...first, wide, columns, told, every: document.querySelectorAll('#table thead th').length, over: over.map((one) => one.outerHTML.slice(0, 120)) };";
    let Some(found) = open_at(&html(&sample.view()), steps, Graphics::None, 420) else { return };
    check(&found);
    assert_eq!(found["wide"], 420);
    assert_eq!(found["over"], serde_json::json!([]));
    assert_eq!(found["fits"], true, "the table is no wider than its frame");
    assert!((3..8).contains(&found["columns"].as_u64().unwrap()), "{}", found["columns"]);
    assert_eq!(found["every"], 14, "all columns for who asks");
    assert!(found["told"].as_str().unwrap().contains("Varied by the sweep"), "{}", found["told"]);
}
