//! Operations over time, in the trace event format that Perfetto and Chrome read: a process a layer, a track a part.
//!
//! Of two slices of one track that overlap and do not lie in one another, Perfetto drops one. A part does one thing at a
//! time and has a track; where several things are under way at once (reads in a pipeline, sums in an adder tree), each
//! has a track of its own, and a track is used again once it is free. One cycle is drawn as one microsecond: viewers
//! round to whole nanoseconds, and a rounded end may lie behind the start of what follows.

use std::collections::BTreeMap;

use serde_json::{Value, json};

use crate::chip::engine::tick::{PartSpan, Span};
use crate::chip::ledger::Part;

/// A slice, where it belongs and what is said of it.
struct Slice {
    pid: usize,
    /// Place of its group of tracks on the page.
    order: (usize, usize),
    group: String,
    name: String,
    start: u64,
    end: u64,
    args: Value,
}

/// Tracks of one part, or of the commands of a layer.
#[derive(Default)]
struct Tracks {
    /// Number of each in the trace, and when it is free.
    all: Vec<(usize, u64)>,
}

/// The text of a trace. `grids`: pairs of banks, tiles down and across of each layer.
pub(super) fn text(
    spans: &[Span],
    parts: &[PartSpan],
    grids: &[[usize; 3]],
    clock_khz: u64,
) -> String {
    let commands = spans.iter().map(|span| command(span, grids.len()));
    let parts = parts.iter().map(|span| part(span, grids[span.layer]));
    let mut slices: Vec<Slice> = commands.chain(parts).collect();
    // what is longer holds what is shorter
    slices.sort_by(|a, b| {
        let key = |one: &Slice| (one.pid, one.order, one.start, std::cmp::Reverse(one.end));
        key(a).cmp(&key(b)).then_with(|| a.name.cmp(&b.name))
    });

    let cycle = format!("1 us shown = 1 cycle of {} ns", 1e6 / clock_khz as f64);
    let mut events: Vec<Value> = Vec::new();
    let names = (0..grids.len()).map(|layer| format!("layer {layer}"));
    for (at, name) in names.chain(["error unit".into()]).enumerate() {
        let pid = at + 1;
        let name = format!("{name} ({cycle})");
        events.push(json!({"ph": "M", "name": "process_name", "pid": pid, "args": {"name": name}}));
        events.push(json!({"ph": "M", "name": "process_sort_index", "pid": pid, "args": {"sort_index": pid}}));
    }
    // tracks of a group, each with its number and when it is free; numbers are never used twice in a trace
    let mut tracks: BTreeMap<_, Tracks> = BTreeMap::new();
    let mut next = 0;
    for slice in slices {
        let own = &mut tracks.entry((slice.pid, slice.order)).or_default().all;
        let free = own.iter_mut().find(|(_, free)| *free <= slice.start);
        let tid = if let Some((tid, free)) = free {
            *free = slice.end;
            *tid
        } else {
            next += 1;
            own.push((next, slice.end));
            let name = match own.len() {
                1 => slice.group,
                number => format!("{} ({number})", slice.group),
            };
            let meta = |what: &str, args: Value| json!({"ph": "M", "name": what, "pid": slice.pid, "tid": next, "args": args});
            let (tile, part) = slice.order;
            let sort = 1000 * tile + 100 * part + own.len();
            events.push(meta("thread_name", json!({"name": name})));
            events.push(meta("thread_sort_index", json!({"sort_index": sort})));
            next
        };
        events.push(json!({
            "ph": "X", "name": slice.name, "pid": slice.pid, "tid": tid,
            "ts": slice.start, "dur": slice.end - slice.start, "args": slice.args,
        }));
    }
    let other = json!({"clock_khz": clock_khz, "time": cycle});
    json!({"displayTimeUnit": "ns", "otherData": other, "traceEvents": events}).to_string()
}

fn args(start: u64, end: u64, sample: Option<usize>) -> Value {
    json!({"sample": sample, "cycle": start, "cycles": end - start})
}

/// What a layer, or the error unit, was told to do.
fn command(span: &Span, unit: usize) -> Slice {
    Slice {
        pid: 1 + span.layer.unwrap_or(unit),
        order: (0, 0),
        group: "commands".into(),
        name: span.name.into(),
        start: span.start,
        end: span.end,
        args: args(span.start, span.end, span.sample),
    }
}

/// What a part of a tile was at.
fn part(span: &PartSpan, [pairs, downs, acrosses]: [usize; 3]) -> Slice {
    let (pair, down, across) =
        (span.tile / (downs * acrosses), span.tile / acrosses % downs, span.tile % acrosses);
    let pair = match (pairs, pair) {
        (..=2, 0) => "p".into(),
        (..=2, _) => "n".into(),
        (_, pair) => format!("pair {pair}"),
    };
    let [sample, slice] = span.on;
    let mut args = args(span.start, span.end, sample);
    let name = match (sample, slice) {
        (None, _) => "all samples".into(),
        (Some(sample), None) => format!("sample {sample}"),
        (Some(sample), Some(slice)) => {
            args["slice"] = json!(slice);
            format!("sample {sample} slice {slice}")
        }
    };
    let at = Part::ALL.iter().position(|part| *part == span.part).unwrap_or_default();
    Slice {
        pid: 1 + span.layer,
        order: (1 + span.tile, at),
        group: format!("tile {pair} row {down} column {across}: {}", span.part.name()),
        name,
        start: span.start,
        end: span.end,
        args,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_overlaps_has_tracks_of_its_own_and_a_free_track_is_used_again() {
        let read = |sample, start| Span {
            layer: Some(0),
            name: "FWD(rows)",
            sample: Some(sample),
            start,
            end: start + 20,
        };
        let mean = Span { layer: None, name: "mean", sample: None, start: 30, end: 31 };
        let settle = |tile, slice, start| PartSpan {
            layer: 0,
            tile,
            part: Part::Arrays,
            on: [Some(3), Some(slice)],
            start,
            end: start + 4,
        };
        let parts = [settle(0, 0, 10), settle(0, 1, 14), settle(3, 0, 10)];
        let spans = [read(3, 10), read(4, 20), read(5, 30), mean];
        let text = text(&spans, &parts, &[[2, 2, 1]], 500_000);
        let value: Value = serde_json::from_str(&text).unwrap();
        let events = value["traceEvents"].as_array().unwrap();
        let of = |name: &str| {
            events.iter().filter(|e| e["ph"] == "X" && e["name"] == name).collect::<Vec<_>>()
        };
        let reads: Vec<_> =
            of("FWD(rows)").iter().map(|e| (e["tid"].clone(), e["ts"].clone())).collect();
        assert_eq!(reads.len(), 3);
        assert!(reads[0].0 == reads[2].0 && reads[0].0 != reads[1].0, "{reads:?}");
        assert_eq!((&reads[0].1, &of("FWD(rows)")[0]["dur"]), (&json!(10), &json!(20)));
        assert_eq!(of("mean")[0]["pid"], 2);
        assert_eq!((of("sample 3 slice 0").len(), of("sample 3 slice 1").len()), (2, 1));
        let names: Vec<_> = events
            .iter()
            .filter(|e| e["name"] == "thread_name")
            .filter_map(|e| e["args"]["name"].as_str())
            .collect();
        let wanted = [
            "commands",
            "commands (2)",
            "tile p row 0 column 0: arrays",
            "tile n row 1 column 0: arrays",
            "commands",
        ];
        assert_eq!(names, wanted);
        assert!(text.contains("1 us shown = 1 cycle of 2 ns"));
    }
}
