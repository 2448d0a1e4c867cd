//! `dalean trace` writes waves that can be read back, of the very update that was trained.

use super::program::{dalean, run};

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
    let trace: serde_json::Value = serde_json::from_str(&text).unwrap();
    let events = trace["traceEvents"].as_array().unwrap();
    let spans: Vec<_> = events.iter().filter(|event| event["ph"] == "X").collect();
    let end = |event: &&serde_json::Value| {
        event["args"]["cycle"].as_u64().unwrap() + event["args"]["cycles"].as_u64().unwrap()
    };
    assert_eq!(
        spans.iter().map(end).max(),
        Some(cycles),
        "the last operation ends with the update"
    );
    let named = |name: &str| spans.iter().filter(|event| event["name"] == name).count();
    // three samples, two streams of two row tiles in layer 0, one stream of one tile in layer 1
    assert_eq!((named("FWD(rows)"), named("UPD(add)"), named("UPD(write)")), (15, 15, 5));
    assert_eq!(named("ERR(words)"), 9, "words go to heads");

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
