//! Every example file is read, resolved and learns for two batches: on its own data where that is built in, on generated
//! data of the same shape where it has to be fetched.

use std::path::{Path, PathBuf};

use dalean::chip::crossbar::kernel::Backend;
use dalean::lab::config::{Sources, load};
use dalean::lab::data::{self, Data, DataRoot, ImageShape, NamedSet, Source};
use dalean::lab::run::{Machine, Session};
use dalean::lab::sweep::Sweep;
use dalean::task::classify::{Examples, Split};

/// Files below `examples` with the extension, sorted.
fn files(folder: &Path, extension: &str) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            found.extend(files(&path, extension));
        } else if path.extension().is_some_and(|e| e == extension) {
            found.push(path);
        }
    }
    found.sort();
    found
}

fn examples() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("examples")
}

/// As many generated examples as two batches need, of the shape of a fetched set.
fn generated(set: NamedSet, count: usize) -> Data {
    let image = match set {
        NamedSet::Cifar10 => ImageShape { height: 32, width: 32, channels: 3 },
        _ => ImageShape { height: 28, width: 28, channels: 1 },
    };
    let features = image.values().unwrap();
    let part = |count: usize| {
        let values = (0..count * features).map(|at| (at * 37 % 251) as u8).collect();
        let labels = (0..count).map(|at| (at % 10) as u8).collect();
        Examples::new(values, labels, features, 255, 10).unwrap()
    };
    let split = Split { train: part(count), validation: part(20), test: part(20) };
    Data::new(&format!("generated in place of {set}"), split, Some(image)).unwrap()
}

/// Whether a file varies something.
fn is_sweep(path: &Path) -> bool {
    std::fs::read_to_string(path).unwrap().contains("\n[[axis]]")
}

#[test]
fn every_experiment_learns_two_batches() {
    let experiments: Vec<_> =
        files(&examples(), "toml").into_iter().filter(|path| !is_sweep(path)).collect();
    assert_eq!(experiments.len(), 32, "{experiments:?}");
    for path in experiments {
        let name = path.display().to_string();
        let text = std::fs::read_to_string(&path).unwrap();
        let sources = Sources { experiment: Some((&name, &text)), ..Sources::default() };
        let config = load(&sources).unwrap_or_else(|error| panic!("{error}"));
        let batch = config.batch().get() as usize;
        let loaded = match config.source().unwrap() {
            Source::Named(set @ (NamedSet::Mnist | NamedSet::FashionMnist | NamedSet::Cifar10)) => {
                generated(set, 2 * batch)
            }
            source => data::load(&source, &DataRoot::new("no such folder")).unwrap(),
        };
        let machine = Machine::new(Backend::best(), 1).unwrap();
        let mut session =
            Session::new(&config, loaded, machine).unwrap_or_else(|e| panic!("{name}: {e}"));
        let (_, updates) = session.epoch_size();
        session.updates(updates.min(2)).unwrap_or_else(|error| panic!("{name}: {error}"));
    }
}

#[test]
fn every_sweep_is_read_and_has_points() {
    let sweeps: Vec<_> =
        files(&examples(), "toml").into_iter().filter(|path| is_sweep(path)).collect();
    assert_eq!(sweeps.len(), 22, "{sweeps:?}");
    for path in sweeps {
        let sweep = Sweep::read(&path).unwrap_or_else(|error| panic!("{error}"));
        let (points, _) =
            sweep.points().unwrap_or_else(|error| panic!("{}: {error}", path.display()));
        assert!(points.len() >= 3, "{}: {}", path.display(), points.len());
    }
}
