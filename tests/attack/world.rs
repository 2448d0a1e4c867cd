//! The folders that starts work in, and what lies beside them.

use std::collections::BTreeMap;
use std::fs;
use std::os::unix::fs::FileTypeExt;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// An experiment of which every start takes milliseconds.
pub(crate) const EXPERIMENT: &str = r#"task = "classify"
seed = 3
[data]
set = "xor"
[network]
hidden = [4]
activation = "sigmoid"
alpha = 6.0
weight_max = 4.0
[learning]
rule = "ed"
epochs = 2
batch = 2
rate = 20.0
decay = "cosine"
centre = "running"
route = "modulo"
select = "best_validation"
[hw.cell]
level_bits = 6
floor = 0
floor_kind = "recoverable"
[hw.tile]
rows = 16
columns = 16
[hw.drive]
bits = 8
dac_bits = 4
[hw.adc]
bits = 7
range = "calibrated"
headroom = 3
[hw.write]
increment_max = 7
dither_bits = 8
residual_bits = 2
"#;

/// A sweep of two runs.
pub(crate) const SWEEP: &str = r#"name = "small"
title = "a small one"
seeds = [1]
filter = ["bits >= 2 || rule == \"ed\"", "seed < 100"]
[base]
data.set = "xor"
network.hidden = [3]
learning.epochs = 1
learning.batch = 2
[[axis]]
name = "bits"
key = "hw.cell.level_bits"
values = [3, 8]
[[axis]]
name = "rule"
key = "learning.rule"
values = ["ed"]
[report]
y = "test_accuracy"
"#;

/// Own data: a table.
pub(crate) const TABLE: &str =
    "a,b,c,label\n1,0,3,0\n0,1,4,1\n5,0,1,0\n0,6,2,1\n7,1,0,0\n1,8,3,1\n9,2,0,0\n2,9,1,1\n";

/// The experiment of that table.
pub(crate) const OWN: &str = r#"[data]
format = "csv"
train = "table.csv"
test = "table.csv"
[network]
hidden = [4]
[learning]
epochs = 1
batch = 2
select = "last"
"#;

/// A folder for each worker: what starts are made of, and what they must leave alone.
pub(crate) struct World {
    _place: tempfile::TempDir,
    pub(crate) root: PathBuf,
    outside: BTreeMap<PathBuf, Vec<u8>>,
    /// A small disk that can be full, where the tests may make one.
    pub(crate) disk: Option<PathBuf>,
}

impl Drop for World {
    fn drop(&mut self) {
        if let Some(disk) = &self.disk {
            let _ = Command::new("umount").arg(disk).status();
        }
    }
}

impl World {
    pub(crate) fn new() -> Self {
        let place = tempfile::tempdir().unwrap();
        let root = place.path().to_path_buf();
        for folder in ["made", "outside/figures", "work", "disk"] {
            fs::create_dir_all(root.join(folder)).unwrap();
        }
        for name in ["precious", "figures/precious", "config.toml", "index.sqlite", "x.html"] {
            fs::write(root.join("outside").join(name), format!("{name} is somebody's")).unwrap();
        }
        let made = root.join("made");
        for (name, text) in [
            ("experiment.toml", EXPERIMENT),
            ("sweep.toml", SWEEP),
            ("table.csv", TABLE),
            ("own.toml", OWN),
        ] {
            fs::write(made.join(name), text).unwrap();
        }
        let run = |arguments: &[&str]| {
            let mut command = program();
            command.current_dir(&made).args(arguments).stdout(Stdio::null()).stderr(Stdio::null());
            assert_eq!(command.status().unwrap().code(), Some(0), "{arguments:?}");
        };
        run(&["train", "experiment.toml", "--out", "runs", "--quiet"]);
        let folder = fs::read_dir(made.join("runs")).unwrap().next().unwrap().unwrap().path();
        fs::rename(folder, made.join("run")).unwrap();
        run(&["sweep", "sweep.toml", "--store", "store", "--quiet", "--keep-states"]);
        let disk = root.join("disk");
        let mount = Command::new("mount")
            .args(["-t", "tmpfs", "-o", "size=256k", "tmpfs"])
            .arg(&disk)
            .stderr(Stdio::null())
            .status();
        let disk = mount.is_ok_and(|status| status.success()).then_some(disk);
        let outside = files(&root.join("outside"));
        Self { _place: place, root, outside, disk }
    }

    pub(crate) fn made(&self, name: &str) -> PathBuf {
        self.root.join("made").join(name)
    }

    /// What is not as it was outside the folder that starts work in.
    pub(crate) fn changed_outside(&self) -> Option<String> {
        let now = files(&self.root.join("outside"));
        if now != self.outside {
            let changed = now.iter().find(|(path, bytes)| self.outside.get(*path) != Some(*bytes));
            let gone = self.outside.keys().find(|path| !now.contains_key(*path));
            let path = changed.map(|(path, _)| path).or(gone);
            let told = format!("{path:?} outside the folder was changed");
            // the next start is judged by what it does itself
            let _ = fs::remove_dir_all(self.root.join("outside"));
            for (path, bytes) in &self.outside {
                fs::create_dir_all(path.parent().unwrap()).unwrap();
                fs::write(path, bytes).unwrap();
            }
            return Some(told);
        }
        let mut beside: Vec<_> =
            fs::read_dir(&self.root).unwrap().map(|e| e.unwrap().file_name()).collect();
        beside.sort();
        if beside != ["disk", "made", "outside", "work"] {
            return Some(format!("beside the folders lie {beside:?}"));
        }
        let is_device = |path: &str| {
            fs::symlink_metadata(path).is_ok_and(|found| found.file_type().is_char_device())
        };
        ["/dev/null", "/dev/full"]
            .iter()
            .find(|path| !is_device(path))
            .map(|path| format!("{path} is gone"))
    }
}

/// The program, alone in the world.
pub(crate) fn program() -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_dalean"));
    command.env_clear().env("DALEAN_DATA", "no such folder").env("PATH", "/usr/bin:/bin");
    command
}

/// All files below a folder.
pub(crate) fn files(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let mut found = BTreeMap::new();
    let Ok(entries) = fs::read_dir(folder) else { return found };
    for entry in entries.flatten() {
        let (path, kind) = (entry.path(), entry.file_type());
        match kind {
            Ok(kind) if kind.is_dir() => found.extend(files(&path)),
            Ok(kind) if kind.is_file() => {
                drop(found.insert(path.clone(), fs::read(&path).unwrap_or_default()))
            }
            _ => drop(found.insert(path, b"no plain file".into())),
        }
    }
    found
}

/// A copy of a folder and of all files in it.
pub(crate) fn copy(from: &Path, to: &Path) {
    fs::create_dir_all(to).unwrap();
    for entry in fs::read_dir(from).unwrap() {
        let entry = entry.unwrap();
        let place = to.join(entry.file_name());
        if entry.file_type().unwrap().is_dir() {
            copy(&entry.path(), &place);
        } else {
            drop(fs::copy(entry.path(), place));
        }
    }
}
