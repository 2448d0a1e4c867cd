//! Whole updates: read, error, gates, write.

use std::hint::black_box;

use ndarray::Array2;

use super::float::FloatNet;
use super::net::Net;
use super::table::{BenchTable, Cell, Column, kept, shown};
use super::time::{Arm, Time, race};
use super::{BenchPlan, chance, giga};
use crate::chip::crossbar::kernel::Backend;
use crate::lab::data::{self, DataError, NamedSet, Source};
use crate::task::classify::Examples;

/// Images of a batch of the larger races.
const BATCH: usize = 128;
/// Images of an epoch that seconds are given for.
const EPOCH: f64 = 60_000.0;
/// Rate of the float network: so low that no unit is driven to an end, where floats become tiny and slow.
const FLOAT_RATE: f32 = 1e-5;
/// A chip with a clock.
const TIMED: [&str; 2] = ["hw.timing.clock_mhz=1000.0", "hw.timing.lanes=16"];
/// Images that are made up.
const IMAGES: usize = 64 * BATCH;
/// Batches of the arm that goes through whole epochs.
const EPOCH_BATCHES: usize = 8;

const COLUMNS: &[Column] = &[
    shown("net", "net", 0),
    shown("what", "what", 0),
    shown("images", "images", 0),
    shown("kernel", "kernel", 0),
    shown("threads", "threads", 0),
    shown("batch", "batch", 0),
    shown("microseconds_best", "us/step", 1),
    shown("microseconds_median", "median", 1),
    shown("epoch_seconds", "s/epoch", 3),
    shown("images_per_second", "images/s", 0),
    shown("gmac_per_second_best", "GMAC/s", 1),
    shown("rate_times_ed", "rate / ED", 3),
    shown("times_float", "x f32", 1),
    shown("times_scalar", "x scalar", 1),
    shown("pulsed_percent", "pulsed %", 1),
    kept("mmac_per_step"),
];

/// One way to learn, to be timed.
struct Entry<'a> {
    net: Net<'a>,
    what: &'static str,
    images: &'static str,
    backend: Backend,
    threads: usize,
    /// Updates of a run, when it is a whole pass over the examples.
    steps: Option<usize>,
    /// Whether the float network, and the scalar law, do the same.
    like: [bool; 2],
}

/// What a race of networks is held against.
struct Reference {
    /// Seconds of a step in floats.
    float: Option<Time>,
    /// Seconds of a step by the scalar law.
    scalar: Option<f64>,
    /// Multiply-accumulates a second of plain error diffusion.
    rate: f64,
}

pub(super) fn measure(plan: &BenchPlan) -> Vec<BenchTable> {
    let made_up = chance::images(IMAGES);
    let few = made_up.clone().split_at(EPOCH_BATCHES * BATCH).0;
    let root = &plan.data;
    let (mnist, why) = match data::load(&Source::Named(NamedSet::Mnist), root) {
        Ok(loaded) => (Some(loaded.split.train), None),
        Err(DataError::Missing { .. }) => {
            let folder = root.path().display();
            (None, Some(format!("MNIST is not in {folder}: made-up images alone")))
        }
        Err(error) => (None, Some(format!("MNIST cannot be read: {error}"))),
    };
    let mut table = BenchTable::new("step", "step: one update of a whole network", COLUMNS);
    small(plan, (&made_up, &few, mnist.as_ref()), &mut table);
    wide(plan, &made_up, &mut table);
    online(plan, mnist.as_ref().unwrap_or(&made_up), mnist.is_some(), &mut table);
    table.notes.extend(why);
    table.notes.extend(
        [
            "made-up: 19 % of values not 0, labels without meaning",
            "epoch: 60,000 images; what \"with its epoch loop\" adds is order and gathering of images",
            "MACs: cells x images of each array read, of each read from its columns, of each written",
            "rate / ED: MACs a second beside those of ED in the same race",
            "f32: the same dual-stream network by ndarray (matrixmultiply), one thread",
            "pulsed: cells that asked for a pulse; what asks for none is skipped and costs less",
        ]
        .map(String::from),
    );
    vec![table]
}

fn settings(hidden: &str, rate: &str, more: &[&str]) -> Vec<String> {
    let own = [format!("network.hidden={hidden}"), format!("learning.rate={rate}")];
    let batch = format!("learning.batch={BATCH}");
    own.into_iter().chain([batch]).chain(more.iter().map(|&s| s.into())).collect()
}

fn small<'a>(
    plan: &BenchPlan,
    (made_up, few, mnist): (&'a Examples, &'a Examples, Option<&'a Examples>),
    table: &mut BenchTable,
) {
    let entry = |what, more: &[&str]| Entry {
        net: Net::new(&settings("[256,256]", "10", more), plan.best, made_up),
        what,
        images: "made-up",
        backend: plan.best,
        threads: 1,
        steps: None,
        like: [true; 2],
    };
    let adc = ["hw.adc.bits=8", "hw.tile.rows=128"];
    let ed = settings("[256,256]", "10", &[]);
    let mut entries = vec![
        entry("ED", &[]),
        Entry { like: [true, false], ..entry("ED, 8-bit converters, 128 rows", &adc) },
        Entry { like: [false; 2], ..entry("DFA", &["learning.rule=dfa"]) },
        Entry { like: [false; 2], ..entry("BP", &["learning.rule=bp"]) },
        Entry {
            net: Net::new(&ed, plan.best, few),
            steps: Some(EPOCH_BATCHES),
            ..entry("ED with its epoch loop", &[])
        },
    ];
    if let Some(mnist) = mnist {
        let net = Net::new(&ed, plan.best, mnist);
        entries.push(Entry { net, images: "MNIST", ..entry("ED", &[]) });
        let net = Net::new(&settings("[256,256]", "10", &TIMED), plan.best, mnist);
        let timed = entry("ED, its cycles counted", &[]);
        entries.push(Entry { net, images: "MNIST", like: [false; 2], ..timed });
    }
    if plan.threads > 1 {
        let mut several = Entry { threads: plan.threads, ..entry("ED", &[]) };
        // there is no row of threads that the system does not give
        if several.net.set_threads(plan.threads).is_ok() {
            entries.push(several);
        }
    }
    if plan.best != Backend::Scalar {
        let net = Net::new(&ed, Backend::Scalar, made_up);
        entries.push(Entry { net, backend: Backend::Scalar, ..entry("ED", &[]) });
    }
    let sizes = [784, 256, 256, 10];
    compare("784-256-256-10", entries, Some(&sizes), plan.seconds(12.0), table);
}

fn wide(plan: &BenchPlan, images: &Examples, table: &mut BenchTable) {
    // a rate at which the wide net does not diverge
    let entries = vec![Entry {
        net: Net::new(&settings("[1024,1024]", "4", &[]), plan.best, images),
        what: "ED",
        images: "made-up",
        backend: plan.best,
        threads: 1,
        steps: None,
        like: [true; 2],
    }];
    let sizes = [784, 1024, 1024, 10];
    compare("784-1024-1024-10", entries, Some(&sizes), plan.seconds(6.0), table);
}

/// Batches of one image, each read and written on its own.
fn online(plan: &BenchPlan, images: &Examples, real: bool, table: &mut BenchTable) {
    let entry = |what, centre: &str| {
        let own = ["learning.batch=1", "learning.mode=online", centre];
        Entry {
            // the rate of a batch of 128, by image
            net: Net::new(&settings("[256,256]", "0.08", &own), plan.best, images),
            what,
            images: if real { "MNIST" } else { "made-up" },
            backend: plan.best,
            threads: 1,
            steps: None,
            like: [false; 2],
        }
    };
    let entries = vec![
        entry("ED online, no centring", "learning.centre=none"),
        entry("ED online, running centre", "learning.centre=running"),
    ];
    compare("784-256-256-10", entries, None, plan.seconds(4.0), table);
}

/// Races networks, the first of which is plain error diffusion, against one another and against floats.
fn compare(
    name: &str,
    mut entries: Vec<Entry<'_>>,
    float: Option<&[usize]>,
    seconds: f64,
    table: &mut BenchTable,
) {
    let mut arms: Vec<Arm<'_>> = entries
        .iter_mut()
        .map(|entry| {
            let net = &mut entry.net;
            match entry.steps {
                None => Arm::new(|| net.step()),
                Some(_) => Arm::new(|| net.epoch()),
            }
        })
        .collect();
    arms.extend(float.map(float_arm));
    let times = race(arms, seconds);
    let (times, float) = times.split_at(entries.len());
    let by_step = |entry: &Entry<'_>, time: Time| {
        let steps = entry.steps.unwrap_or(1) as f64;
        Time { best: time.best / steps, median: time.median / steps }
    };
    let times: Vec<Time> = entries.iter().zip(times).map(|(e, &time)| by_step(e, time)).collect();
    let scalar = entries.iter().zip(&times).find(|(entry, _)| entry.backend == Backend::Scalar);
    let reference = Reference {
        float: float.first().copied(),
        scalar: scalar.map(|(_, time)| time.best),
        rate: giga(entries[0].net.products(), times[0].best),
    };
    for (entry, time) in entries.iter().zip(times) {
        table.row(row(name, entry, time, &reference));
    }
    if let Some(time) = reference.float {
        let products = entries[0].net.products();
        let mut cells = vec![name.into(), "f32".into(), "made-up".into(), "ndarray".into()];
        cells.extend([1usize, BATCH].map(Cell::from));
        cells.extend(speeds(time, BATCH, products));
        cells.extend([
            (giga(products, time.best) / reference.rate).into(),
            1.0.into(),
            reference.scalar.map(|scalar| scalar / time.best).into(),
            Cell::Nothing,
            (1e-6 * products).into(),
        ]);
        table.row(cells);
    }
}

fn row(name: &str, entry: &Entry<'_>, time: Time, reference: &Reference) -> Vec<Cell> {
    let Entry { net, what, images, backend, threads, like, .. } = entry;
    let mut cells = vec![name.into(), (*what).into(), (*images).into(), backend.name().into()];
    cells.extend([*threads, net.batch()].map(Cell::from));
    cells.extend(speeds(time, net.batch(), net.products()));
    let float = reference.float.filter(|_| like[0]);
    let scalar = reference.scalar.filter(|_| like[1]);
    cells.extend([
        (giga(net.products(), time.best) / reference.rate).into(),
        float.map(|float| float.best / time.best).into(),
        scalar.map(|scalar| scalar / time.best).into(),
        net.pulsed_percent().into(),
        (1e-6 * net.products()).into(),
    ]);
    cells
}

/// Microseconds (best, median), seconds of an epoch, images a second, billions of products a second.
fn speeds(time: Time, batch: usize, products: f64) -> [Cell; 5] {
    let images = batch as f64 / time.best;
    [
        (1e6 * time.best).into(),
        (1e6 * time.median).into(),
        (EPOCH / images).into(),
        images.into(),
        giga(products, time.best).into(),
    ]
}

/// A step of the float network on made-up images, several batches in turn.
fn float_arm<'a>(sizes: &[usize]) -> Arm<'a> {
    let images = chance::images(4 * BATCH);
    let batches: Vec<[Array2<f32>; 2]> = (0..4)
        .map(|batch| {
            let image = |b: usize| batch * BATCH + b;
            let input = |(b, i): (usize, usize)| f32::from(images.values(image(b))[i]) / 255.0;
            let target =
                |(b, o): (usize, usize)| f32::from(usize::from(images.labels()[image(b)]) == o);
            [
                Array2::from_shape_fn((BATCH, sizes[0]), input),
                Array2::from_shape_fn((BATCH, sizes[sizes.len() - 1]), target),
            ]
        })
        .collect();
    let mut net = FloatNet::new(sizes, BATCH);
    let mut next = 0;
    Arm::new(move || {
        let [inputs, targets] = &batches[next % batches.len()];
        net.step(inputs, targets, FLOAT_RATE);
        black_box(&mut net);
        next += 1;
    })
}
