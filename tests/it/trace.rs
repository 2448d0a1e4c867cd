//! `dalean trace` writes waves that can be read back, of the very update that was trained.

use std::collections::BTreeMap;

use dalean::chip::crossbar::kernel::Backend;
use dalean::chip::engine::tick::TileAt;
use dalean::chip::ledger::Part;
use dalean::lab::config::{Config, Sources};
use dalean::lab::data::DataRoot;
use dalean::lab::run::Machine;
use dalean::lab::wave::{Look, record};

use super::program::{dalean, run};

/// Two convolutions, whose layers are read more than once a sample.
const WINDOWS: &str = "network.channels=[3, 2]";

/// A slice of a trace, with the name of its track.
struct Slice {
    layer: u64,
    track: String,
    tid: u64,
    name: String,
    start: u64,
    end: u64,
}

/// Every slice of a trace. Times are whole and exact, as the viewer's nanoseconds are.
fn slices(text: &str) -> Vec<Slice> {
    let trace: serde_json::Value = serde_json::from_str(text).unwrap();
    let events = trace["traceEvents"].as_array().unwrap();
    let mut names: BTreeMap<u64, String> = BTreeMap::new();
    let tid = |event: &serde_json::Value| event["tid"].as_u64().unwrap();
    for event in events.iter().filter(|event| event["name"] == "thread_name") {
        let name = event["args"]["name"].as_str().unwrap().to_owned();
        assert!(names.insert(tid(event), name).is_none(), "a track has one name");
    }
    let slice = |event: &serde_json::Value| {
        let number = |key: &str| event[key].as_u64().expect("a whole number");
        let (start, cycles) = (number("ts"), number("dur"));
        assert_eq!(event["args"]["cycle"], start);
        Slice {
            layer: number("pid") - 1,
            track: names[&tid(event)].clone(),
            tid: tid(event),
            name: event["name"].as_str().unwrap().into(),
            start,
            end: start + cycles,
        }
    };
    events.iter().filter(|event| event["ph"] == "X").map(slice).collect()
}

/// Perfetto's rule: on one track, sorted by start, a slice lies within the one that is open or begins after its end.
fn check_tracks(slices: &[Slice]) {
    let mut tracks: BTreeMap<u64, Vec<(u64, u64)>> = BTreeMap::new();
    for one in slices {
        assert!(one.tid > 0 && one.end > one.start, "{} of {}", one.name, one.track);
        tracks.entry(one.tid).or_default().push((one.start, one.end));
    }
    for (tid, mut spans) in tracks {
        spans.sort_by_key(|&(start, end)| (start, std::cmp::Reverse(end)));
        let mut open: Vec<u64> = vec![];
        for (start, end) in spans {
            while open.last().is_some_and(|&until| until <= start) {
                open.pop();
            }
            let inside = open.last().is_none_or(|&until| end <= until);
            assert!(
                inside,
                "track {tid}: {start} to {end} overlaps what ends at {:?}",
                open.last()
            );
            open.push(end);
        }
    }
}

#[test]
fn no_slice_of_a_track_overlaps_another_and_parts_are_at_work_as_long_as_the_ledger_counts() {
    let tile = TileAt { layer: 0, target: 0, down: 0, across: 0 };
    let cases: [&[&str]; 7] = [
        &["hw.tile.rows=40"],
        &["hw.tile.rows=40", "hw.tile.columns=16", "hw.timing.lanes=1"],
        &["hw.drive.dac_bits=2", "hw.adc.bits=6"],
        // a fault: of an update that loads its samples one by one, the last one alone was played
        &["learning.mode=online", "learning.centre=none"],
        &["learning.rule=bp", "learning.taps=default", "learning.mode=replay"],
        &[
            WINDOWS,
            "network.alpha=default",
            "learning.rate_multipliers=default",
            "hw.tile.columns=2",
        ],
        &[
            WINDOWS,
            "network.alpha=default",
            "learning.rate_multipliers=default",
            "learning.mode=replay",
            "learning.optimiser=plain",
            "learning.centred=false",
        ],
    ];
    for case in cases {
        let mut settings: Vec<String> =
            vec!["learning.batch=3".into(), "network.hidden=[20]".into()];
        settings.extend(case.iter().map(|one| (*one).to_owned()));
        let config = Config::load(&Sources {
            experiment: Some(("it", include_str!("../../examples/digits.toml"))),
            settings: &settings,
            ..Sources::default()
        })
        .unwrap();
        let machine = Machine::new(Backend::best(), 1).unwrap();
        let look = Look { update: 2, tile, all: false };
        let wave = record(&config, &DataRoot::new("no such folder"), machine, look).unwrap();
        let slices = slices(&wave.perfetto);
        check_tracks(&slices);
        for layer in 0..wave.cycles.layers() {
            for part in Part::ALL {
                let ending = format!(": {}", part.name());
                let of_part = |one: &&Slice| {
                    // an adder tree holds several samples, each with a track
                    let track = one.track.split(" (").next().unwrap();
                    one.layer == layer as u64 && track.ends_with(&ending)
                };
                let mut of: Vec<&Slice> = slices.iter().filter(of_part).collect();
                // the ledger looks at the first tile, and writes until the slowest tile is done
                if part != Part::Writers {
                    of.retain(|one| one.track.contains("tile p row 0 column 0:"));
                }
                let used = wave.cycles.used(layer, part);
                let found: u64 = if part == Part::Writers {
                    let cycles = of.iter().flat_map(|one| one.start..one.end);
                    cycles.collect::<std::collections::BTreeSet<_>>().len() as u64
                } else {
                    of.iter().map(|one| one.end - one.start).sum()
                };
                assert_eq!(found, used, "{case:?}: {} of layer {layer}", part.name());
            }
        }
    }
}

#[test]
fn an_update_becomes_waves_of_as_many_cycles_as_are_said() {
    let out = tempfile::tempdir().unwrap();
    let (vcd, json) = (out.path().join("tile.vcd"), out.path().join("tiles.json"));
    let mut command = dalean();
    command.args(["trace", "--set", "learning.batch=3", "--set", "network.hidden=[16]", "--json"]);
    command.args(["--set", "hw.tile.rows=40", "--update", "2", "--tile", "0,n,1,0"]);
    command.arg("--vcd").arg(&vcd).arg("--perfetto").arg(&json);
    let ran = run(&mut command);
    assert_eq!(ran.code, Some(0), "{ran:?}");
    let cycles = ran.last()["cycles"].as_u64().unwrap();

    let text = std::fs::read_to_string(&json).unwrap();
    let slices = slices(&text);
    assert_eq!(slices.iter().map(|one| one.end).max(), Some(cycles), "it ends with the update");
    let named = |name: &str| slices.iter().filter(|one| one.name == name).count();
    // three samples in two layers
    assert_eq!((named("FWD(rows)"), named("ERR(words)"), named("UPD(add)")), (6, 6, 6));
    assert_eq!(named("UPD(write)"), 2);
    // each of them settles in two streams of two row tiles in layer 0, one stream of one tile in layer 1
    let settled = |one: &&Slice| one.track.contains("arrays") && one.name.starts_with("sample");
    assert_eq!(slices.iter().filter(settled).count() % 15, 0);

    let bytes = std::fs::read(&vcd).unwrap();
    let mut parser = vcd::Parser::new(&bytes[..]);
    let header = parser.parse_header().unwrap();
    assert!(header.find_var(&["tile", "front_busy"]).is_some());
    let clock = header.find_var(&["tile", "clock"]).unwrap().code;
    let rises = parser.filter(|command| {
        matches!(command.as_ref().unwrap(), vcd::Command::ChangeScalar(code, vcd::Value::V1) if *code == clock)
    });
    assert_eq!(rises.count() as u64, cycles, "a rise a cycle");
}

#[test]
fn a_tile_or_an_update_that_is_not_there_is_said() {
    let out = tempfile::tempdir().unwrap();
    let file = out.path().join("x.vcd");
    for (arguments, code, said) in [
        (&["--tile", "0,p,9,0"][..], 1, "2 target streams"),
        (&["--tile", "7,p,0,0"], 1, "layers are 0..2"),
        (&["--update", "100000"], 1, "the training has no update"),
        (&["--tile", "p"], 2, "layer,stream,row,column"),
    ] {
        let mut command = dalean();
        command.arg("trace").args(arguments).arg("--vcd").arg(&file);
        let ran = run(&mut command);
        assert_eq!(ran.code, Some(code), "{ran:?}");
        assert!(ran.stderr.contains(said), "{}", ran.stderr);
        assert!(!file.exists(), "nothing is written");
    }
}

/// Once it began before the rollout, whose reads tracking converters count: the first update took no step that the engine took.
#[test]
fn an_update_of_a_policy_begins_behind_its_rollout() {
    let experiment = Some(("it", super::policies::TINY));
    let settings =
        ["hw.adc={bits=4, range=\"tracking\"}", "environment.rollouts=2"].map(str::to_owned);
    let config = Config::load(&Sources { experiment, settings: &settings, ..Sources::default() });
    let (config, root) = (config.unwrap(), DataRoot::new("none"));
    for (update, layer) in [(1, 0), (1, 2), (2, 0), (5, 1), (5, 3)] {
        let tile = TileAt { layer, target: 0, down: 0, across: 0 };
        let look = Look { update, tile, all: false };
        // what it reaches, ranges included, is what the engine reaches, or it panics
        record(&config, &root, Machine::new(Backend::best(), 1).unwrap(), look).unwrap();
    }
}

#[test]
fn the_network_that_has_the_layer_is_shown() {
    let settings = [super::policies::TINY.to_owned()];
    let experiment = Some(("it", settings[0].as_str()));
    let config = Config::load(&Sources { experiment, ..Sources::default() }).unwrap();
    let (root, machine) = (DataRoot::new("none"), || Machine::new(Backend::best(), 1).unwrap());
    // two layers of the actor, two of the critic
    let of = |layer| {
        let tile = TileAt { layer, target: 0, down: 0, across: 0 };
        record(&config, &root, machine(), Look { update: 2, tile, all: true })
    };
    let layers = |layer| slices(&of(layer).unwrap().perfetto).into_iter().map(|s| s.layer).max();
    assert_eq!([0, 1, 2, 3].map(layers), [Some(1); 4]);
    assert_eq!(of(0).unwrap().perfetto, of(1).unwrap().perfetto);
    assert_ne!(of(1).unwrap().perfetto, of(2).unwrap().perfetto);
    let error = of(4).unwrap_err().to_string();
    assert!(error.contains('4'), "{error}");
}
