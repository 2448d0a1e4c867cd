//! Operations over time, in the trace event format that Perfetto and Chrome read: one process a layer, one track a tile.

use serde_json::{Value, json};

use crate::chip::engine::tick::Span;

/// The text of a trace. `grids`: target streams, tiles down and across of each layer.
pub(super) fn text(spans: &[Span], grids: &[[usize; 3]], clock_khz: u64) -> String {
    let mut events: Vec<Value> = Vec::new();
    let unit = grids.len();
    let process = |pid: usize, name: String| json!({"ph": "M", "name": "process_name", "pid": pid, "args": {"name": name}});
    for (layer, grid) in grids.iter().enumerate() {
        events.push(process(layer, format!("layer {layer}")));
        for (tid, name) in tiles(*grid) {
            let args = json!({"name": name});
            events.push(
                json!({"ph": "M", "name": "thread_name", "pid": layer, "tid": tid, "args": args}),
            );
        }
    }
    events.push(process(unit, "error unit".into()));
    // microseconds; cycles stay in the arguments
    let time = |cycles: u64| cycles as f64 * 1e3 / clock_khz as f64;
    for span in spans {
        let (pid, tracks) = match span.layer {
            Some(layer) => (layer, concerned(grids[layer], span.name)),
            None => (unit, vec![0]),
        };
        for tid in tracks {
            events.push(json!({
                "ph": "X", "name": span.name, "pid": pid, "tid": tid,
                "ts": time(span.start), "dur": time(span.end - span.start),
                "args": {"sample": span.sample, "cycle": span.start, "cycles": span.end - span.start},
            }));
        }
    }
    json!({"displayTimeUnit": "ns", "traceEvents": events}).to_string()
}

/// Number and name of each tile of a layer.
fn tiles([targets, downs, acrosses]: [usize; 3]) -> Vec<(usize, String)> {
    let stream = |target: usize| ["p", "n"][target];
    let all = (0..targets)
        .flat_map(|t| (0..downs).flat_map(move |d| (0..acrosses).map(move |a| (t, d, a))));
    all.enumerate()
        .map(|(tid, (t, d, a))| (tid, format!("tile {} row {d} column {a}", stream(t))))
        .collect()
}

/// Tiles that take part: words go to the heads of columns.
fn concerned([targets, downs, acrosses]: [usize; 3], name: &str) -> Vec<usize> {
    let head = |tid: &usize| (tid / acrosses).is_multiple_of(downs);
    let p = |tid: &usize| tid / (downs * acrosses) == 0;
    let all = 0..targets * downs * acrosses;
    match name {
        "ERR(words)" => all.filter(head).collect(),
        "FWD(columns)" => all.filter(p).collect(),
        _ => all.collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_tile_has_a_track_and_cycles_become_microseconds() {
        let read = Span { layer: Some(0), name: "FWD(rows)", sample: Some(3), start: 10, end: 30 };
        let words = Span { name: "ERR(words)", ..read.clone() };
        let mean = Span { layer: None, name: "mean", sample: None, start: 30, end: 31 };
        let text = text(&[read, words, mean], &[[2, 2, 1]], 500_000);
        let value: Value = serde_json::from_str(&text).unwrap();
        let of = |name: &str| {
            let events = value["traceEvents"].as_array().unwrap().iter();
            events.filter(|e| e["ph"] == "X" && e["name"] == name).collect::<Vec<_>>()
        };
        assert_eq!((of("FWD(rows)").len(), of("ERR(words)").len(), of("mean").len()), (4, 2, 1));
        assert_eq!(of("FWD(rows)")[0]["ts"], 0.02);
        assert_eq!(of("FWD(rows)")[0]["dur"], 0.04);
        assert_eq!(of("mean")[0]["pid"], 1);
    }
}
