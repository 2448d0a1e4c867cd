//! Devices from measurements: known ones are found again from reads of their pulses, and published curves are those of others.

use std::fmt::Write as _;
use std::path::Path;

use dalean::chip::device::{CellSpread, Device, DeviceSpec, OwnCell, PulseNoise, PulseWords};
use dalean::lab::config::load_model;
use dalean::lab::measure::MeasuredDevice;
use dalean::num::fixed::Millionths;
use dalean::num::tables::{NeurosimSteps, Response, SoftBoundSteps, SpreadLaw, TableSteps};
use expect_test::expect_file;
use serde_json::Value;

use super::program::{Ran, SMALL, dalean, finished, run};

fn millionths(value: f64) -> Millionths {
    Millionths((value * 1e6).round() as i64)
}

/// Words in a row.
struct Words(u64);

impl Words {
    fn next(&mut self) -> u32 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mixed = (self.0 ^ self.0 >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let mixed = (mixed ^ mixed >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        (mixed ^ mixed >> 31) as u32
    }
}

/// Levels of the window that pulses are taken in, and of all there are: fine, so that rounding is no noise.
const WINDOW: [u16; 2] = [400, 3400];
const LEVEL_MAX: u16 = 4095;

/// Reads of so many cells that take `pulses` up and down in turn, as the chip itself answers to a pulse.
fn reads(device: &DeviceSpec, cells: usize, cycles: usize, pulses: usize, seed: u64) -> String {
    assert_eq!(device.check(), Ok(()));
    let mut words = Words(seed);
    let device = Device::new(device, WINDOW, LEVEL_MAX);
    let mut text = "device,pulse,polarity,conductance_us\n".to_owned();
    for cell in 0..cells {
        let own: OwnCell = device.cell(std::array::from_fn(|_| words.next()));
        let mut level = own.floor;
        for pass in 0..2 * cycles {
            let rises = pass % 2 == 0;
            for pulse in 1..=pulses {
                let word = words.next();
                let words = PulseWords { rounding: word as u8, noise: (word >> 16) as u16 };
                let moved = i64::from(level) + device.moves(&own, level, rises, words);
                level = moved.clamp(own.floor.into(), own.ceiling.into()) as u16;
                let way = if rises { "up" } else { "down" };
                let _ = writeln!(text, "c{cell},{pulse},{way},{:.2}", f64::from(level) / 100.0);
            }
        }
    }
    text
}

fn neurosim() -> DeviceSpec {
    DeviceSpec {
        response: Response::Neurosim(NeurosimSteps { labels: [1.75, -1.46].map(millionths) }),
        states: 32,
        asymmetry: Millionths(0),
        noise: PulseNoise::OfWindow(millionths(0.01)),
        write_noise: Millionths(0),
        tries: DeviceSpec::TRIES,
        spread: CellSpread::default(),
    }
}

fn soft(spread: CellSpread) -> DeviceSpec {
    DeviceSpec {
        response: Response::SoftBounds(SoftBoundSteps {
            up: millionths(2.4),
            down: millionths(1.8),
        }),
        states: 64,
        asymmetry: Millionths(0),
        noise: PulseNoise::OfStep(millionths(0.3)),
        write_noise: Millionths(0),
        tries: DeviceSpec::TRIES,
        spread,
    }
}

fn measured(text: &str) -> MeasuredDevice {
    MeasuredDevice::new("reads.csv", text.as_bytes()).unwrap_or_else(|error| panic!("{error}"))
}

/// 4 cells of 20 cycles of 40 pulses: 3,200 steps each way, of which noise leaves a label some hundredths.
#[test]
fn labels_of_a_known_device_are_found_again() {
    let found = measured(&reads(&neurosim(), 4, 20, 40, 1));
    let best = found.best();
    let Response::Neurosim(NeurosimSteps { labels }) = &best.response else {
        panic!("{} of {:?}", found.reason(), found.kinds)
    };
    let [up, down] = labels.map(|label| label.0 as f64 / 1e6);
    assert!((up - 1.75).abs() < 0.2 && (down + 1.46).abs() < 0.2, "{up} {down}");
    assert!((30..=34).contains(&best.states), "{}", best.states);
    let PulseNoise::OfWindow(noise) = found.device.noise else { panic!("{:?}", found.device) };
    assert!((noise.0 - 10_000).abs() < 1_000, "{noise}");
    assert_eq!(found.read_noise, 0.0);
    let ratio = found.on_off().unwrap();
    assert!((ratio - 8.5).abs() < 0.1, "{ratio}");
}

/// Standard deviations of 10 cells are known to a quarter: three of these are allowed.
#[test]
fn differences_of_ten_cells_are_found_again() {
    let spread = CellSpread {
        step_law: SpreadLaw::Normal,
        step: millionths(0.2),
        asymmetry: millionths(0.06),
        ceiling: millionths(0.05),
        floor: millionths(0.02),
    };
    let found = measured(&reads(&soft(spread), 10, 2, 300, 2));
    let Response::SoftBounds(steps) = &found.best().response else {
        panic!("{} of {:?}", found.reason(), found.kinds)
    };
    // steps in windows, whatever the states: to what the mean of 10 cells allows
    let states = f64::from(found.best().states);
    for (found, wanted) in [(steps.up, 2.4), (steps.down, 1.8)] {
        let ratio = found.0 as f64 / 1e6 / states / (wanted / 64.0);
        assert!((ratio - 1.0).abs() < 3.0 * 0.21 / 10f64.sqrt(), "{ratio}");
    }
    let PulseNoise::OfStep(noise) = found.device.noise else { panic!("{:?}", found.device) };
    assert!((noise.0 - 300_000).abs() < 30_000, "{noise}");
    let of = found.device.spread;
    for (found, wanted) in
        [(of.step, 0.2), (of.asymmetry, 0.06), (of.ceiling, 0.05), (of.floor, 0.02)]
    {
        let ratio = found.0 as f64 / 1e6 / wanted;
        assert!((ratio - 1.0).abs() < 0.75, "{found} for {wanted}: {of:?}");
    }
    assert_eq!(of.step_law, SpreadLaw::Normal);
}

/// Reads that miss are no noise of pulses: they show twice, once either way.
#[test]
fn reads_that_miss_are_told_from_pulses_that_vary() {
    let text = reads(&soft(CellSpread::default()), 4, 2, 300, 3);
    let mut words = Words(9);
    let mut noisy = String::new();
    for line in text.lines() {
        match line.rsplit_once(',').and_then(|(head, g)| Some((head, g.parse::<f64>().ok()?))) {
            Some((head, g)) => {
                // a sum of four even words: 1 % of a window of 30
                let sum: f64 =
                    (0..4).map(|_| f64::from(words.next()) / 4_294_967_296.0 - 0.5).sum();
                let _ = writeln!(noisy, "{head},{:.4}", g + 0.3 * sum * 3f64.sqrt());
            }
            None => noisy += &format!("{line}\n"),
        }
    }
    let found = measured(&noisy);
    // near the ends of the window reads that miss outward are ends themselves: some of it is not seen
    assert!((0.006..0.012).contains(&found.read_noise), "{}", found.read_noise);
    assert!(found.hardware_toml("x").contains("a read of the table seems to miss by"));
}

/// A table's own curve, written out as reads and read again, is the same table: to the millionth that files have.
#[test]
fn a_table_that_is_written_out_is_found_again() {
    let row = |steps: [f64; 17]| steps.map(millionths).to_vec();
    let table = TableSteps {
        up: row([
            0.4, 0.7, 1.3, 1.8, 1.6, 1.5, 1.2, 0.9, 1.1, 1.4, 1.2, 0.8, 0.7, 0.5, 0.6, 0.8, 0.3,
        ]),
        down: row([
            0.2, 0.4, 0.9, 1.5, 0.8, 0.7, 1.0, 1.3, 1.6, 1.2, 0.9, 0.6, 0.8, 1.1, 1.5, 1.7, 0.9,
        ]),
    };
    // straight lines between the steps, of which 400 cross the window
    let step = |row: &[Millionths], x: f64| {
        let at = ((16.0 * x) as usize).min(15);
        let [from, to] = [row[at], row[at + 1]].map(|step| step.0 as f64 / 1e6);
        (from + (to - from) * (16.0 * x - at as f64)) / 400.0
    };
    let (mut text, mut x) = ("pulse,polarity,conductance\n0,,0\n".to_owned(), 0.0f64);
    for pass in 0..6 {
        for pulse in 1..=600 {
            let moved = if pass % 2 == 0 { step(&table.up, x) } else { -step(&table.down, x) };
            x = (x + moved).clamp(0.0, 1.0);
            let _ = writeln!(text, "{pulse},{},{x:.9}", if pass % 2 == 0 { "up" } else { "down" });
        }
    }
    let found = measured(&text);
    let Response::Table(again) = &found.best().response else {
        panic!("{} of {:?}", found.reason(), found.kinds)
    };
    let states = f64::from(found.best().states);
    for (found, wanted) in [(&again.up, &table.up), (&again.down, &table.down)] {
        for (found, wanted) in found.iter().zip(wanted.iter()) {
            // in windows: digits of the file, and those of the model
            let [found, wanted] = [found.0 as f64 / states, wanted.0 as f64 / 400.0];
            assert!((found - wanted).abs() < 1.0, "{found} for {wanted} millionths");
        }
        assert_eq!(found.len(), wanted.len());
    }
    assert!(found.best().curve_rms < 1e-5, "{}", found.best().curve_rms);
}

const EXAMPLE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/examples/devices/pulses.csv");

/// The same table gives the same model to the byte, on every machine.
#[test]
fn the_example_gives_the_model_that_it_gave() {
    let bytes = std::fs::read(EXAMPLE).unwrap();
    let found = MeasuredDevice::new("pulses.csv", &bytes).unwrap();
    let text = found.hardware_toml("pulses");
    let (device, _) = text.split_once("[tile]").unwrap();
    expect_file!["../golden/measured.toml"].assert_eq(device);
}

fn import(folder: &Path, more: &[&str]) -> Ran {
    run(dalean().current_dir(folder).args(["hw", "import", EXAMPLE]).args(more))
}

#[test]
fn a_table_becomes_a_model_that_trains() {
    let out = tempfile::tempdir().unwrap();
    let told = import(out.path(), &["--json", "--figure", "figure.svg"]);
    assert_eq!(told.code, Some(0), "{told:?}");
    let told: Value = told.last();
    assert_eq!((&told["event"], &told["file"]), (&"done".into(), &"pulses.toml".into()));
    assert_eq!((&told["devices"], &told["curve"]), (&4.into(), &"soft_bounds".into()));
    let figure = std::fs::read_to_string(out.path().join("figure.svg")).unwrap();
    assert!(figure.starts_with("<svg") && figure.contains("Steps over the window"));
    assert!(!figure.contains("var(") && !figure.contains("NaN"), "stands alone");
    // what is there stays
    let again = import(out.path(), &[]);
    assert_eq!(again.code, Some(1), "{again:?}");
    assert!(again.stderr.contains("cannot write pulses.toml"), "{again:?}");
    let named = import(out.path(), &["--name", "other", "--quiet"]);
    assert_eq!((named.code, named.stdout.trim()), (Some(0), "other.toml"));
    let refused = import(out.path(), &["--name", "ag_asi"]);
    assert_eq!(refused.code, Some(2), "{refused:?}");
    let model = out.path().join("pulses.toml").display().to_string();
    let checked = run(dalean().args(["hw", "check", &model]));
    assert_eq!(checked.code, Some(0), "{checked:?}");
    let mut train = dalean();
    let runs = out.path().join("runs");
    train.args(["train", SMALL, "--json", "--hw", &model, "--set", "learning.epochs=1", "--out"]);
    let (_, done) = finished(train.arg(runs));
    assert!(done["test_accuracy"].as_f64().unwrap() > 0.3, "{done}");
}

/// Every curve that a fit can propose is one that a run accepts.
#[test]
fn every_kind_of_measured_device_trains() {
    let out = tempfile::tempdir().unwrap();
    let spread =
        CellSpread { step: millionths(0.2), ceiling: millionths(0.05), ..CellSpread::default() };
    for (name, device) in [("labels", neurosim()), ("soft", soft(spread))] {
        let table = out.path().join(format!("{name}.csv"));
        std::fs::write(&table, reads(&device, 10, 2, 200, 4)).unwrap();
        let model = out.path().join(format!("{name}.toml"));
        let ran = run(dalean().args(["hw", "import"]).arg(&table).arg("--out").arg(&model));
        assert_eq!(ran.code, Some(0), "{ran:?}");
        assert!(ran.stdout.contains("proposed"), "{ran:?}");
        let model = model.display().to_string();
        let mut train = dalean();
        train.args([
            "train",
            SMALL,
            "--json",
            "--hw",
            &model,
            "--set",
            "learning.epochs=1",
            "--out",
        ]);
        let (_, done) = finished(train.arg(out.path().join(name)));
        assert!(done["test_accuracy"].is_number(), "{name}: {done}");
    }
}

#[test]
fn what_cannot_be_a_table_is_refused_with_its_place() {
    let out = tempfile::tempdir().unwrap();
    let table = out.path().join("t.csv");
    for (text, wanted) in [
        (
            "pulse,polarity,g\n1,up,1\n2,sideways,2\n",
            "t.csv line 3, column 1 (`polarity`) holds `sideways`",
        ),
        ("pulse,g\n1,1\n2,2\n3,3\n", "2 pulses up and 0 down"),
        ("", "t.csv holds no reads"),
    ] {
        std::fs::write(&table, text).unwrap();
        let ran = run(dalean().current_dir(out.path()).args(["hw", "import"]).arg(&table));
        assert!(ran.code == Some(1) && ran.stderr.contains(wanted), "{ran:?}");
        assert!(!out.path().join("t.toml").exists());
    }
    let missing = run(dalean().args(["hw", "import", "no such table.csv"]));
    assert!(missing.code == Some(2) && missing.stderr.contains("cannot read"), "{missing:?}");
}

/// Mean curves of aihwkit's presets, from its own tiles (tests/golden/aihwkit_curves.py), pulse by pulse: the cell of the model walks
/// by the table that a chip has. Faults this is made for: a range that is mapped otherwise, up and down exchanged, states that
/// count another step.
#[test]
fn presets_of_aihwkit_pulse_as_its_own_tiles_do() {
    let text = include_str!("../golden/aihwkit_curves.csv");
    let mut names = vec![];
    let mut at = (String::new(), 0.0, 0u32, [vec![], vec![]], 0.0);
    let mut worst = 0.0f64;
    for line in text.lines().skip(1) {
        let fields: Vec<_> = line.split(',').collect();
        let [name, pulse, way, weight] = fields[..] else { panic!("{line}") };
        let (pulse, weight): (u32, f64) = (pulse.parse().unwrap(), weight.parse().unwrap());
        if at.0 != name {
            let chip = load_model(name).unwrap().hardware;
            let device = chip.device.clone().unwrap();
            let span = chip.cell.window.ceiling() - chip.cell.window.floor();
            let tables = device.response.table(span, device.states, device.asymmetry);
            at = (name.to_owned(), f64::from(span), 0, tables, 0.0);
            names.push(name);
        }
        let (_, span, done, tables, level) = &mut at;
        if pulse == 0 {
            *done = 0;
        }
        while *done < pulse {
            let place = (*level + 0.5) as usize;
            let step = |of: usize| f64::from(tables[of][place]) / 256.0;
            *level =
                if way == "up" { *level + step(0) } else { *level - step(1) }.clamp(0.0, *span);
            *done += 1;
        }
        let off = (*level / *span - weight).abs();
        assert!(off < 0.01, "{line}: {}", *level / *span);
        worst = worst.max(off);
    }
    assert_eq!(names.len(), 9, "{names:?}");
    assert!(worst > 0.0, "two programs never agree in every digit");
}
