//! The page of a run in a real browser: values under pointer and keyboard are those of the records, figures can be saved
//! and have content, print shows what is folded away.

use serde_json::Value;

use super::chromium::{Graphics, open_at};
use crate::program::trained;

/// What is wrong with a page that stands alone, as `watch.js` found it.
pub(super) fn clean(found: &Value) {
    assert_eq!(found["errors"], serde_json::json!([]));
    assert_eq!(found["requests"], serde_json::json!([]));
}

/// Saves every card in both formats and looks at what comes out: shapes and words, inked pixels.
pub(super) const SAVED: &str = "
    const blobs = []; URL.createObjectURL = (blob) => { blobs.push(blob); return 'blob:none'; };
    const names = []; HTMLAnchorElement.prototype.click = function () { names.push(this.download); };
    const saved = {};
    for (const card of document.querySelectorAll('.card')) {
      const one = { titles: card.querySelector('h2').textContent };
      for (const button of card.querySelectorAll('[data-save]')) {
        if (button.closest('[hidden]')) continue;
        const before = blobs.length; button.click();
        for (let wait = 0; blobs.length === before && wait < 400; wait++) await rest(10);
        const blob = blobs.at(-1), format = button.dataset.save;
        if (format === 'svg') {
          const text = await blob.text();
          const read = new DOMParser().parseFromString(text, 'image/svg+xml');
          one.svg = { broken: read.querySelector('parsererror') !== null, variables: text.includes('var(--'),
            shapes: read.querySelectorAll('path, rect, circle, image').length, words: [...read.querySelectorAll('text')].map((word) => word.textContent).join(' ') };
        } else {
          const image = await createImageBitmap(blob);
          const canvas = new OffscreenCanvas(image.width, image.height), ink = canvas.getContext('2d');
          ink.drawImage(image, 0, 0);
          const { data } = ink.getImageData(0, 0, image.width, image.height);
          let inked = 0; for (let at = 0; at < data.length; at += 4) inked += data[at] + data[at + 1] + data[at + 2] < 700;
          one.png = { wide: image.width, inked: inked / (data.length / 4) };
        }
      }
      if (one.svg) saved[card.id] = one;
    }
    return { saved, names };";

/// Every figure that was saved has shapes, its words, and ink.
pub(super) fn check_saved(saved: &Value, wanted: &[&str]) {
    let all = saved["saved"].as_object().unwrap();
    for id in wanted {
        let one = all.get(*id).unwrap_or_else(|| panic!("{id} can be saved: {:?}", all.keys()));
        let svg = &one["svg"];
        assert_eq!((&svg["broken"], &svg["variables"]), (&false.into(), &false.into()), "{id}");
        assert!(svg["shapes"].as_u64().unwrap() > 3, "{id}: {svg}");
        let inked = one["png"]["inked"].as_f64().unwrap();
        assert!(inked > 0.004 && inked < 0.9, "{id}: {inked} of the picture is inked");
        assert!(one["png"]["wide"].as_u64().unwrap() > 600, "{id} is wide enough for print");
    }
    let names = saved["names"].as_array().unwrap();
    assert!(names.iter().all(|name| !name.as_str().unwrap().contains(['/', ' '])), "{names:?}");
}

#[test]
fn values_of_a_run_are_told_to_pointer_and_keyboard_and_its_figures_can_be_saved() {
    let folder = tempfile::tempdir().unwrap();
    let (run, _) = trained(folder.path(), &["--hw", "pcm14"]);
    let page = std::fs::read_to_string(run.join("report.html")).unwrap();
    let steps = format!(
        "await rest(200);
        const tip = document.getElementById('tip');
        const press = (one, key) => one.dispatchEvent(new KeyboardEvent('keydown', {{ key, bubbles: true, cancelable: true }}));
        const chart = document.querySelector('#accuracy svg.chart');
        chart.focus(); press(chart, 'End'); const keyed = tip.hidden ? '' : tip.textContent;
        press(chart, 'ArrowLeft'); const before = tip.textContent;
        chart.blur(); const gone = tip.hidden;
        const band = [...chart.querySelectorAll('.tip')].at(-1);
        band.dispatchEvent(new PointerEvent('pointermove', {{ bubbles: true, clientX: 300, clientY: 300 }}));
        const hovered = tip.textContent;
        const squares = document.querySelector('#confusion svg.chart');
        squares.focus(); press(squares, 'Home'); press(squares, 'ArrowDown'); const square = tip.textContent; squares.blur();
        const term = document.querySelector('#pathways thead a.term'); term.focus(); const word = tip.textContent; term.blur();
        const heads = [...document.querySelectorAll('thead th')].filter((head) => head.textContent.trim() && !head.querySelector('.ends'));
        const bare = heads.filter((head) => !head.querySelector('a.term') || !document.querySelector(head.querySelector('a.term').getAttribute('href')));
        const sums = [];
        for (const image of document.querySelectorAll('#maps img')) sums.push((await indicesOf(image.src)).out.reduce((sum, one) => sum + one, 0));
        const image = document.querySelector('#maps img'); image.focus(); await rest(100); press(image, 'ArrowRight'); await rest(50);
        const cell = tip.textContent, first = (await indicesOf(image.src)).out[1]; image.blur();
        const shut = document.querySelectorAll('details:not([open])').length;
        dispatchEvent(new Event('beforeprint')); const printed = document.querySelectorAll('details:not([open])').length;
        dispatchEvent(new Event('afterprint')); const after = document.querySelectorAll('details:not([open])').length;
        const files = await (async () => {{ {SAVED} }})();
        return {{ charts: document.querySelectorAll('svg.chart').length, title: document.title, keyed, before, gone, hovered, square, word, sums, cell, first,
          heads: heads.length, bare: bare.map((head) => head.textContent), shut, printed, after, files }};"
    );
    let Some(found) = open_at(&page, &steps, Graphics::None, 1300) else { return };
    clean(&found);
    assert!(found["charts"].as_u64().unwrap() > 5 && !found["title"].as_str().unwrap().is_empty());
    assert_eq!(found["bare"], serde_json::json!([]), "columns without an explanation");
    assert!(found["heads"].as_u64().unwrap() > 20);

    let metrics = std::fs::read_to_string(run.join("metrics.jsonl")).unwrap();
    let records: Vec<Value> =
        metrics.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    let share = |epoch: usize, part: &str| {
        let score = &records[epoch]["outcome"][part];
        let share = score["correct"].as_f64().unwrap() / score["total"].as_f64().unwrap();
        format!("{part} {:.2}\u{202f}%", 100.0 * share)
    };
    let last = records.len() - 1;
    for (told, epoch) in [("keyed", last), ("hovered", last), ("before", last - 1)] {
        let text = found[told].as_str().unwrap();
        assert!(text.starts_with(&format!("epoch {epoch}\n")), "{told}: {text}");
        for part in ["train", "validation"] {
            assert!(text.contains(&share(epoch, part)), "{told}: {text}");
        }
    }
    assert_eq!(found["gone"], true, "what was told goes with the focus");
    let receipt = std::fs::read_to_string(run.join("receipt.json")).unwrap();
    let receipt: Value = serde_json::from_str(&receipt).unwrap();
    let n = &receipt["test"]["confusion"][1][0];
    let square = found["square"].as_str().unwrap();
    assert!(square.contains(&format!("true 1\nanswered 0\n{n} of ")), "{square}");
    assert!(found["word"].as_str().unwrap().contains("pp and nn excite"), "{}", found["word"]);

    // the pixels of the maps are the levels of the state that was tested
    let tested = receipt["test"]["epoch"].as_u64().unwrap();
    let record = records.iter().find(|record| record["epoch"] == tested).unwrap();
    let mut levels: Vec<_> =
        record["pathways"].as_array().unwrap().iter().map(|p| p["levels"].as_u64()).collect();
    let mut sums: Vec<_> = found["sums"].as_array().unwrap().iter().map(Value::as_u64).collect();
    levels.sort_unstable();
    sums.sort_unstable();
    assert_eq!(sums, levels);
    assert_eq!(found["cell"], format!("row 0, column 1\nlevel {}", found["first"]));

    assert_eq!((&found["printed"], &found["after"]), (&0.into(), &found["shut"]));
    assert!(found["shut"].as_u64().unwrap() > 0);
    check_saved(
        &found["files"],
        &[
            "accuracy",
            "confusion",
            "timelines",
            "levels",
            "maps",
            "writes",
            "energy",
            "time",
            "pathways",
        ],
    );
    let words = found["files"]["saved"]["accuracy"]["svg"]["words"].as_str().unwrap();
    assert!(words.contains("Accuracy") && words.contains("Validation peaks at"), "{words}");
}

/// What reaches beyond a window, or beyond the frame of its table.
pub(super) const NARROW: &str = "await rest(200); \
        const wide = document.documentElement.clientWidth; \
        const over = [...document.querySelectorAll('main *')].filter((one) => !one.closest('svg, details, .scroll') && one.getBoundingClientRect().right > wide + 1); \
        const tables = [...document.querySelectorAll('.scroll')].filter((one) => one.scrollWidth > one.clientWidth + 1); \
        return { wide, over: over.map((one) => one.outerHTML.slice(0, 120)), tables: tables.map((one) => one.closest('.card').id) };";

pub(super) fn check_narrow(found: &Value) {
    clean(found);
    assert_eq!(found["wide"], 420);
    assert_eq!(found["over"], serde_json::json!([]));
    assert_eq!(found["tables"], serde_json::json!([]), "tables that do not fit their frame");
}

#[test]
fn no_part_of_a_runs_page_is_wider_than_a_narrow_window() {
    let folder = tempfile::tempdir().unwrap();
    let (run, _) = trained(folder.path(), &["--hw", "pcm14"]);
    let page = std::fs::read_to_string(run.join("report.html")).unwrap();
    let Some(found) = open_at(&page, NARROW, Graphics::None, 420) else { return };
    check_narrow(&found);
}
