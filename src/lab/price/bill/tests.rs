//! Small ledgers whose price is known.

use super::*;
use crate::lab::config::{self, Sources};
use crate::lab::price::LayerFootprint;
use crate::lab::store::ledger::CyclesRecord;

fn line(phase: &str, layer: usize, event: &str, count: u64) -> CountRecord {
    CountRecord {
        phase: phase.into(),
        layer,
        pathway: "pp".into(),
        operation: "update".into(),
        event: event.into(),
        count,
    }
}

fn ledger() -> LedgerRecord {
    let elapsed = |elapsed| CyclesRecord { elapsed, stages: [].into(), layers: vec![] };
    LedgerRecord {
        counts: vec![
            line("training", 0, "conversions", 1000),
            line("training", 1, "holds", 500),
            line("evaluation", 1, "conversions", 3000),
            line("training", 0, "requested", 77),
            line("training", 0, "multiplies", 5),
        ],
        cycles: Some(
            [("training".into(), elapsed(2000)), ("evaluation".into(), elapsed(8000))].into(),
        ),
    }
}

/// An empty chip with two energies and a static power, at 1 MHz.
fn chip() -> config::Config {
    let text = "
        [hw]
        name = \"x\"
        cell = {}
        tile = {}
        drive = {}
        adc = \"ideal\"
        write = {}
        timing.clock_mhz = 1
        [hw.energy]
        conversion_pj = { low = 1, typical = 2, high = 4, source = \"s\", kind = \"assumed\" }
        hold_fj = { low = 0, typical = 4, high = 4, source = \"s\", kind = \"measured\" }
        [hw.power]
        tile_static_nw = { low = 1, typical = 1, high = 1, source = \"s\", kind = \"fitted\" }
    ";
    config::load(&Sources { experiment: Some(("x", text)), ..Sources::default() }).unwrap()
}

fn close(found: f64, wanted: f64) -> bool {
    (found - wanted).abs() <= 1e-9 * wanted.abs()
}

#[test]
fn counts_times_constants_and_watts_times_seconds() {
    let (config, ledger) = (chip(), ledger());
    let plan = Footprint {
        layers: vec![LayerFootprint { rows: 300, columns: 256, targets: 1, copies: 1 }],
    };
    let bill = price(&ledger, &plan, &config.hardware, &config.constants, &[]);
    // 4000 conversions, 500 holds, two tiles for 10 ms
    let wanted = [4e-9 + 2e-11, 8e-9 + 2e-12 + 2e-11, 16e-9 + 2e-12 + 2e-11];
    for (found, wanted) in bill.total().joules.into_iter().zip(wanted) {
        assert!(close(found, wanted), "{found} {wanted}");
    }
    assert!(close(bill.seconds_total().unwrap(), 0.01));
    let phases = bill.by_phase();
    assert_eq!(phases[0].name, "evaluation");
    assert!(close(phases[0].joules[1], 6e-9 + 1.6e-11));
    for groups in [bill.by_component(), bill.by_layer(), bill.by_operation(), bill.by_pathway()] {
        let sum: f64 = groups.iter().map(|group| group.joules[1]).sum();
        assert!(close(sum, bill.total().joules[1]), "{groups:?}");
    }
    let (share, assumed) = bill.assumed();
    assert!(close(share, 8e-9 / bill.total().joules[1]));
    assert_eq!(assumed[0].key, "energy.conversion_pj");
    // an action without a price is named; an outcome needs none
    let missing: Vec<_> = bill.missing.iter().map(|m| (&*m.what, m.count)).collect();
    assert_eq!(missing, [("multiplies", Some(5))]);
}

#[test]
fn what_another_chip_would_do_otherwise_is_not_priced() {
    let (config, ledger) = (chip(), ledger());
    let change = Change { key: "tile.rows", events: &[Event::Holds], time: true };
    let plan = Footprint::default();
    let bill = price(&ledger, &plan, &config.hardware, &config.constants, &[change]);
    assert!(close(bill.total().joules[1], 8e-9) && bill.seconds.is_none());
    let whys = bill.missing.iter().map(|m| (&*m.what, m.why.contains("tile.rows")));
    let whys: Vec<_> = whys.collect();
    assert_eq!(
        whys,
        [("holds", true), ("multiplies", false), ("time", true), ("tile_static", false)]
    );
}
