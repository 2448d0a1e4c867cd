//! What cells remember, through the crossbars of a chip: endurance, write noise, leakage and drift while learning, each against its
//! definition on 100,000 cells. Tolerances are four standard errors of such a sample; seeds are fixed.
//!
//! A fault in any of these shows: cells that wear out alike, noise that adds up from write to write, a fraction of a level that is always
//! or never lost, a cell that drifts since the start and not since it was written.

use std::io::{BufRead, BufReader};
use std::process::Stdio;
use std::sync::Arc;

use dalean::chip::crossbar::Crossbar;
use dalean::chip::crossbar::layout::Layout;
use dalean::chip::device::{Ageing, Endurance, Leakage, MemoryLaw, Worn, WriteNoise};
use dalean::chip::hardware::{FloorKind, Hardware, Window};
use dalean::num::draw::{Place, Site};
use dalean::num::fixed::{LevelBits, Millionths};
use dalean::num::tables::{DriftRates, Gaussian};

use super::program::{dalean, only_run, run, train, trained};

const SIZE: [usize; 2] = [400, 250];
const CELLS: f64 = 1e5;

fn law() -> MemoryLaw {
    MemoryLaw { endurance: None, write_noise: None, leakage: None, ageing: None }
}

fn place(seed: u64) -> Place {
    Place { layer: 1, pathway: 2, ..Place::global(seed, Site::Variation, 0) }
}

/// An array of 12-bit cells in 100 ..= 4000 that remember, all at one level.
fn array(law: MemoryLaw, seed: u64, level: u16) -> Crossbar {
    let bits = LevelBits::new(12).unwrap();
    let chip = Hardware::reference().with(|h| {
        h.cell.level_bits = bits;
        h.cell.window = Window::new(100, 4000, bits).unwrap();
        h.cell.floor_kind = FloorKind::Recoverable;
    });
    let [rows, columns] = SIZE;
    let mut array = Crossbar::new(Layout { rows, columns }, &chip.unwrap());
    array.remember(&Arc::new(law), place(seed));
    for row in 0..rows {
        array.program_row(row, &vec![level; columns], 0);
    }
    array
}

fn moments(values: impl IntoIterator<Item = f64>) -> (f64, f64) {
    let values: Vec<f64> = values.into_iter().collect();
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    (mean, values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / n)
}

fn endurance(pulses: u32, spread: i64, worn: Worn) -> MemoryLaw {
    let of = Endurance { pulses, spread: Millionths(spread), worn };
    MemoryLaw { endurance: Some((worn, of.limits())), ..law() }
}

#[test]
fn limits_are_log_normal_from_cell_to_cell_and_each_chip_has_its_own() {
    let of = |seed| array(endurance(1_000_000, 700_000, Worn::Level), seed, 500).wear().unwrap();
    let (one, other) = (of(1), of(2));
    let logarithms = one.iter().map(|[_, limit]| f64::from(*limit).ln());
    let (mean, variance) = moments(logarithms.clone());
    assert!((mean - 1e6f64.ln()).abs() < 4.0 * 0.7 / CELLS.sqrt(), "{mean}");
    assert!((variance / 0.49 - 1.0).abs() < 4.0 * (2.0 / CELLS).sqrt(), "{variance}");
    for (beyond, share) in [(1.0, 0.158_655), (2.0, 0.022_75), (3.0, 0.001_35)] {
        let weak = logarithms.clone().filter(|l| *l < 1e6f64.ln() - 0.7 * beyond).count() as f64;
        let off = (weak - CELLS * share).abs();
        assert!(off < 4.0 * (CELLS * share).sqrt(), "{beyond}: {weak}");
    }
    let pairs = one
        .iter()
        .zip(&other)
        .map(|(a, b)| (f64::from(a[1]).ln() - mean) * (f64::from(b[1]).ln() - mean) / variance);
    let together: f64 = pairs.sum::<f64>() / CELLS;
    assert!(together.abs() < 4.0 / CELLS.sqrt(), "{together}");
    let mut limits: Vec<_> = one.iter().map(|of| of[1]).collect();
    limits.sort_unstable();
    limits.dedup();
    assert!(limits.len() > 97_000, "cells differ: {}", limits.len());
}

/// Loads are pulses: after so many of them as many cells are worn out as the law says, and these hold what wore them out.
#[test]
fn cells_wear_out_when_their_pulses_are_spent() {
    for (worn, stays) in
        [(Worn::Level, None), (Worn::Floor, Some(100)), (Worn::Ceiling, Some(4000))]
    {
        let mut array = array(endurance(8, 500_000, worn), 3, 1001);
        for load in 2..=10u16 {
            for row in 0..SIZE[0] {
                array.program_row(row, &vec![1000 + load; SIZE[1]], 0);
            }
        }
        let wear = array.wear().unwrap();
        let weak = wear.iter().filter(|[spent, limit]| spent >= limit).count() as f64;
        // a limit is rounded to the nearest: 10 and below wear out, those of less than 10.5
        let share = 0.5 * libm::erfc(-(10.5f64 / 8.0).ln() / 0.5 / 2f64.sqrt());
        assert!((weak / CELLS - share).abs() < 4.0 * (share / CELLS).sqrt(), "{weak} {share}");
        for (level, [spent, limit]) in array.levels().zip(wear) {
            assert_eq!(spent, 10, "all are sent");
            let last = 1000 + u16::try_from(limit.min(10)).unwrap();
            let wanted = if spent >= limit { stays.unwrap_or(last) } else { 1010 };
            assert_eq!(level, wanted, "{limit}");
        }
    }
}

#[test]
fn what_stands_beside_a_level_has_the_moments_of_a_gaussian() {
    let noise = WriteNoise::new(Arc::new(Gaussian::new()), Millionths(50_000), 3900);
    let words = |count| {
        let of = |sub| Place { site: Site::WriteNoise, sub, count, ..place(5) };
        let cells = (0..SIZE[1]).flat_map(|column| (0..SIZE[0]).map(move |row| (row, column)));
        let word = move |sub, (row, column)| of(sub).half(SIZE[0], row, column);
        cells.map(move |at| [word(0, at), word(1, at)]).collect::<Vec<_>>()
    };
    let of = |count| -> Vec<f64> {
        let words = words(count).into_iter();
        words.map(|words| f64::from(noise.beside(2000, words, [100, 4000]))).collect()
    };
    let (first, second) = (of(0), of(1));
    let sd = 195.0;
    let (mean, variance) = moments(first.iter().copied());
    assert!((mean - 2000.0).abs() < 4.0 * sd / CELLS.sqrt(), "{mean}");
    assert!((variance / (sd * sd) - 1.0).abs() < 4.0 * (2.0 / CELLS).sqrt() + 2e-4, "{variance}");
    let both = first.iter().zip(&second).map(|(a, b)| (a - mean) * (b - mean) / variance);
    let together = both.sum::<f64>() / CELLS;
    assert!(together.abs() < 4.0 / CELLS.sqrt(), "{together}");
    let next = first.windows(2).map(|pair| (pair[0] - mean) * (pair[1] - mean) / variance);
    let neighbours = next.sum::<f64>() / CELLS;
    assert!(neighbours.abs() < 4.0 / CELLS.sqrt(), "{neighbours}");
}

/// 1000 levels above rest and a loss of a thousandth a look: 1 level each on the mean, after 50 looks 48.8, with the spread of the cells.
#[test]
fn cells_lose_what_they_are_said_to_lose() {
    let lost = (4_294_967_296.0f64 / 1000.0).round() as u32;
    for (spread, rest, level) in [(0i64, 0i64, 1100), (300_000, 0, 1100), (0, 1_000_000, 3000)] {
        let leaks = Leakage { lost, every: 2, rest: Millionths(rest), spread: Millionths(spread) };
        let mut array = array(MemoryLaw { leakage: Some(leaks.ready()), ..law() }, 7, level);
        let sign = if rest == 0 { 1.0 } else { -1.0 };
        for write in 1..=100 {
            array.forget(Place { site: Site::Leakage, count: write, ..place(9) });
        }
        let gone = array.levels().map(|now| sign * (f64::from(level) - f64::from(now)));
        let (mean, variance) = moments(gone);
        // the factor of a cell is normal; about rounding a look adds p (1 - p), at most a quarter
        let wanted = 1000.0 * (1.0 - 0.999f64.powi(50));
        let of_cells = (spread as f64 / 1e6 * wanted).powi(2);
        assert!((mean - wanted).abs() < 4.0 * ((of_cells + 12.5) / CELLS).sqrt() + 0.3, "{mean}");
        assert!(variance >= 0.9 * of_cells && variance < 1.1 * of_cells + 12.5, "{variance}");
    }
}

/// G (t / t0)^-nu since the write that left it: cells that were loaded later have drifted less.
#[test]
fn cells_drift_since_they_were_written() {
    let [zero, nu, sd] = [0, 50_000, 10_000].map(Millionths);
    let rates = DriftRates::Power([[zero, nu, nu, nu], [zero, sd, sd, sd]]);
    // a write takes t0
    let ages = Ageing { rates, since: 0, every: 10 }.ready([4000; 2]);
    let mut array = array(MemoryLaw { ageing: Some(ages), ..law() }, 11, 3000);
    let forget = |array: &mut Crossbar, count| {
        array.forget(Place { site: Site::Leakage, count, ..place(11) });
    };
    (1..=500).for_each(|count| forget(&mut array, count));
    for row in 0..SIZE[0] / 2 {
        array.program_row(row, &vec![3000; SIZE[1]], 500);
    }
    (501..=600).for_each(|count| forget(&mut array, count));
    let levels: Vec<f64> = array.levels().map(f64::from).collect();
    let (late, early) = levels.split_at(levels.len() / 2);
    for (of, passed) in [(late, 100.0f64), (early, 600.0)] {
        let s = 0.01 * passed.ln();
        let wanted = 3000.0 * passed.powf(-0.05) * (s * s / 2.0).exp();
        let spread = wanted * wanted * ((s * s).exp() - 1.0) + 1.0 / 6.0;
        let (mean, variance) = moments(of.iter().copied());
        let error = 4.0 * (2.0 * spread / CELLS).sqrt();
        assert!((mean - wanted).abs() < error + 0.15, "{passed}: {mean} {wanted}");
        assert!((variance / spread - 1.0).abs() < 0.04, "{passed}: {variance} {spread}");
    }
    assert_eq!(array.left().unwrap(), vec![3000; SIZE[0] * SIZE[1]]);
}

/// Everything that cells do, together; and drift, which goes with neither leakage nor write noise.
const ALL: [&[&str]; 2] = [
    &[
        "hw.cell.ceiling=200",
        "hw.device.response.curve=soft_bounds",
        "hw.device.response.states=60",
        "hw.device.response.noise=0.3",
        "hw.device.response.write_noise=0.02",
        "hw.device.spread.step=0.2",
        "hw.device.spread.ceiling=0.05",
        "hw.device.endurance.pulses=12",
        "hw.device.endurance.spread=0.5",
        "hw.device.leakage.lifetime=300",
        "hw.device.leakage.every=3",
        "hw.device.leakage.spread=0.3",
        "hw.device.faults.stuck_any=0.02",
        "hw.device.read_noise.sigma_cells=0.1",
        "hw.device.wires.segment_ohm=1",
        "hw.device.wires.cell_on_ohm=1e5",
        "hw.write.residual_bits=2",
    ],
    &[
        "hw.cell.ceiling=200",
        "hw.cell.floor_kind=absorbing",
        "hw.device.spread.ceiling=0.05",
        "hw.device.endurance.pulses=12",
        "hw.device.endurance.worn=ceiling",
        "hw.device.drift.start_s=1",
        "hw.device.drift.exponent=[0.05]",
        "hw.device.drift.exponent_spread=[0.02]",
        "hw.device.drift.update_s=10",
        "hw.device.drift.every=5",
    ],
];

/// Fails when what cells remember hangs on a back end or on threads, or is lost between a stop and a resumption; when nobody is told of
/// cells that are worn out; and when a level above the chip's ceiling has no drift.
#[test]
fn cells_remember_the_same_however_a_run_is_carried_out() {
    for settings in ALL {
        let settings: Vec<&str> = settings.iter().flat_map(|one| ["--set", one]).collect();
        let out = tempfile::tempdir().unwrap();
        let hash = |more: &[&str]| {
            let (folder, done) = trained(out.path(), &[&settings[..], more].concat());
            (folder, done["state_hash"].as_str().unwrap().to_owned(), done)
        };
        let (folder, whole, done) = hash(&[]);
        let notes = done["notes"].to_string();
        assert!(notes.contains("worn"), "{notes}");
        for variant in [["--threads", "3"], ["--kernel", "scalar"]] {
            assert_eq!(hash(&variant).1, whole, "{variant:?}");
        }
        let ran = run(dalean().arg("verify").arg(&folder));
        assert_eq!(ran.code, Some(0), "{ran:?}");
        let last = std::fs::read_to_string(folder.join("metrics.jsonl")).unwrap();
        let last: serde_json::Value = serde_json::from_str(last.lines().last().unwrap()).unwrap();
        let wear = &last["pathways"][0]["wear"];
        let cells: u64 =
            wear["histogram"].as_array().unwrap().iter().map(|n| n.as_u64().unwrap()).sum();
        assert_eq!(cells, last["pathways"][0]["cells"].as_u64().unwrap(), "{wear}");
        assert!(
            wear["worn"].as_u64().unwrap() > 0 && wear["most"].as_u64().unwrap() > 12,
            "{wear}"
        );
        let page = std::fs::read_to_string(folder.join("report.html")).unwrap();
        assert!(page.contains("id=\"wear\""), "a figure of wear");
        // stopped in the middle
        let root = tempfile::tempdir().unwrap();
        let mut child = train(root.path()).args(&settings).stdout(Stdio::piped()).spawn().unwrap();
        let lines = BufReader::new(child.stdout.take().unwrap()).lines();
        for line in lines {
            let event: serde_json::Value = serde_json::from_str(&line.unwrap()).unwrap();
            if event["record"]["epoch"].as_u64() == Some(1) {
                break;
            }
        }
        child.kill().unwrap();
        child.wait().unwrap();
        let ran = run(dalean().args(["train", "--json", "--resume"]).arg(only_run(root.path())));
        let outran = ran.code == Some(1) && ran.stderr.contains("is finished");
        assert!(outran || ran.last()["state_hash"] == whole.as_str(), "{ran:?}");
    }
}

#[test]
fn cells_above_the_ceiling_of_their_chip_drift_too() {
    let out = tempfile::tempdir().unwrap();
    let ceiling = ["--set", "hw.cell.ceiling=100", "--set", "hw.device.spread.ceiling=0.3"];
    let (folder, _) = trained(out.path(), &ceiling);
    for law in ["exponent=[0.05]", "change=-0.01"] {
        let drift = format!("hw.device.drift.{law}");
        let eval = ["eval", "--after", "1d", "--set", "hw.device.drift.start_s=1", "--set", &drift];
        let ran = run(dalean().args(eval).arg(&folder));
        assert_eq!(ran.code, Some(0), "{ran:?}");
    }
}
