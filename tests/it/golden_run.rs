//! A run folder that is kept: what a later program adds moves nothing of it.
//!
//! With the feature `grown` this is the program as a later one would be: a key, an event, a number in records and a
//! column of tables that no run uses. `cargo test --features grown --test it golden_run`.

use std::fs;
use std::path::{Path, PathBuf};

use dalean::chip::crossbar::kernel::Backend;
use dalean::lab::config::{Sources, load};
use dalean::lab::data::DataRoot;
use dalean::lab::run::{self, Machine, Verdict};
use dalean::lab::store::folder;

use super::program::{dalean, only_run, run};

/// Exclusive or, on a chip with everything that has state.
pub(crate) const EVERYTHING: &str = "
data.set = 'xor'
network = { hidden = [3] }
learning = { epochs = 2, batch = 3, centre = 'running', rate = 60.0 }
hw.cell.floor_kind = 'absorbing'
hw.write.residual_bits = 4
hw.adc = { bits = 6, range = 'calibrated', headroom = 1, source = 'invented', kind = 'assumed' }
hw.timing = { clock_mhz = 1000.0 }
";

fn machine() -> Machine {
    Machine::new(Backend::best(), 1).unwrap()
}

fn golden() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/golden/run")
}

fn copied(from: &Path, to: &Path) {
    fs::create_dir_all(to).unwrap();
    for entry in fs::read_dir(from).unwrap() {
        let entry = entry.unwrap();
        fs::copy(entry.path(), to.join(entry.file_name())).unwrap();
    }
}

fn verified(folder: &Path) -> Result<Verdict, run::RunError> {
    run::verify(folder, &DataRoot::new("no such folder"), machine(), None, &mut |_| true)
}

/// Makes the golden run again where `UPDATE_EXPECT=1` asks for it: only when an equation moves.
#[test]
fn additions_move_no_hash_no_address_and_no_verdict() {
    let work = tempfile::tempdir().unwrap();
    let root = DataRoot::new("no such folder");
    let fresh = load(&Sources { experiment: Some(("it", EVERYTHING)), ..Sources::default() });
    let outcome = run::train(&fresh.unwrap(), &root, work.path(), machine(), &mut |_| true);
    let made = only_run(work.path());
    if std::env::var_os("UPDATE_EXPECT").is_some() && cfg!(not(feature = "grown")) {
        for name in ["lock", "report.html", "timing.json"] {
            fs::remove_file(made.join(name)).unwrap();
        }
        let _ = fs::remove_dir_all(golden());
        copied(&made, &golden());
    }
    let receipt = folder::read_receipt(&golden()).unwrap();
    let new = outcome.unwrap().receipt;
    assert_eq!(new.epoch_hashes, receipt.epoch_hashes, "state hashes");
    assert_eq!(new.run, receipt.run, "address");
    assert_eq!(new.checkpoint, receipt.checkpoint, "bytes of the checkpoint");
    assert_eq!(new.best, receipt.best, "bytes of the best state");

    let kept = work.path().join("kept");
    copied(&golden(), &kept);
    let verdict = verified(&kept).unwrap();
    assert!(matches!(verdict, Verdict::Same { epochs: 3, test: true, .. }), "{verdict:?}");
    let (test, state) = run::evaluate(&kept, &root, machine()).unwrap();
    assert_eq!(Some(&test), receipt.test.as_ref());
    assert_eq!(state, receipt.epoch_hashes[test.epoch() as usize]);
}

const SWEEP: &str = "base.data.set = 'xor'\nbase.network.hidden = [3]\nbase.learning.epochs = 1\n\
                     base.hw.cell = { source = 'SOURCE', kind = 'measured' }\n\
                     base.hw.energy.conversion_pj = { low = 1.0, typical = TYPICAL, high = 4.0, source = 'SOURCE', kind = 'assumed' }\n\
                     [[axis]]\nkey = 'hw.cell.level_bits'\nvalues = [3, 8]\n";

/// A corrected citation or constant is no other run.
#[test]
fn a_corrected_source_finds_the_run_again() {
    let work = tempfile::tempdir().unwrap();
    let store = work.path().join("store");
    let sweep = |source: &str, typical: &str| {
        // a corrected file is another sweep of that name, which has to be said
        let file = work.path().join("sweep.toml");
        let text = SWEEP.replace("SOURCE", source).replace("TYPICAL", typical);
        fs::write(&file, text).unwrap();
        let ran = run(dalean()
            .arg("sweep")
            .arg(&file)
            .arg("--store")
            .arg(&store)
            .args(["--json", "--replace"]));
        assert_eq!(ran.code, Some(0), "{ran:?}");
        ran
    };
    let addresses = || {
        let mut folders: Vec<_> = fs::read_dir(store.join("runs"))
            .unwrap()
            .flat_map(|group| fs::read_dir(group.unwrap().path()).unwrap())
            .map(|folder| folder.unwrap().path())
            .collect();
        folders.sort();
        let times = folders.iter().map(|f| f.join("receipt.json").metadata().unwrap().modified());
        folders
            .iter()
            .cloned()
            .zip(times.map(Result::unwrap).collect::<Vec<_>>())
            .collect::<Vec<_>>()
    };
    sweep("a paper", "2.0");
    let before = addresses();
    assert_eq!(before.len(), 2);
    sweep("another paper, table 2", "2.0");
    assert_eq!(addresses(), before, "nothing was done again");
    let joules = || -> Vec<f64> {
        let ran = run(dalean().arg("export").arg(&store).args(["--format", "json"]));
        let rows: serde_json::Value = serde_json::from_str(&ran.stdout).unwrap();
        rows.as_array().unwrap().iter().map(|row| row["joules"].as_f64().unwrap()).collect()
    };
    let cheap = joules();
    sweep("another paper, table 2", "3.0");
    assert_eq!(addresses(), before, "nothing was done again");
    assert!(joules().iter().zip(cheap).all(|(now, then)| *now > then), "but it is priced anew");
}
