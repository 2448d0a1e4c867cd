//! An attack on the program: thousands of starts over damaged configurations, models, data, sweeps, stores and run
//! folders, with full disks, closed streams, limits and kills.
//!
//! ```text
//! each start   no panic, no crash            it ends with a code of 0 to 100, or by the signal that was sent
//!              an answer to a signal         what takes long is interrupted and ends soon after
//!              no 0 without its answer       what says that it is done has written or printed what it was asked for
//!              no file outside its folder    what lies beside the folder it works in stays as it was, devices are devices
//! ```
//!
//! Everything is drawn from a seed and the number of the start, so that `ATTACK_FIRST=N ATTACK_STARTS=1` does start N again.
//! `ATTACK_STARTS` is 300 unless said otherwise (`tests/deep.sh attack` takes 4,000), `ATTACK_SEED` is 1. With
//! `ATTACK_KEEP=1` folders of starts that failed stay.
#![expect(
    clippy::unwrap_used,
    clippy::disallowed_methods,
    clippy::disallowed_types,
    reason = "tests fail by panicking, look at files and watch the clock"
)]
#![cfg(target_os = "linux")]

mod ask;
mod chance;
mod start;
mod world;

use std::collections::BTreeMap;
use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, Ordering};

use chance::Chance;
use start::{Judgement, start};
use world::World;

fn number(name: &str, default: u64) -> u64 {
    match std::env::var(name) {
        Ok(text) => text.parse().unwrap_or_else(|_| panic!("{name} is {text}, but no number")),
        Err(_) => default,
    }
}

#[test]
fn nothing_makes_the_program_panic_lie_or_write_elsewhere() {
    let [starts, first, seed] = [("ATTACK_STARTS", 300), ("ATTACK_FIRST", 0), ("ATTACK_SEED", 1)]
        .map(|(n, d)| number(n, d));
    let clock = std::time::Instant::now();
    let next = AtomicU64::new(first);
    let told = Mutex::new(Told::default());
    let workers = std::thread::available_parallelism().map_or(1, usize::from);
    std::thread::scope(|scope| {
        for _ in 0..workers {
            scope.spawn(|| {
                let world = World::new();
                loop {
                    let number = next.fetch_add(1, Ordering::Relaxed);
                    if number >= first + starts {
                        return;
                    }
                    let judgement = start(&world, &mut Chance::new(seed, number), number);
                    told.lock().unwrap().add(number, judgement);
                }
            });
        }
    });
    let Told { kinds, ends, failures } = told.into_inner().unwrap();
    let list = |all: BTreeMap<String, u64>| {
        all.into_iter().map(|(what, n)| format!("{n} {what}")).collect::<Vec<_>>().join(", ")
    };
    println!("{starts} starts in {} s, seed {seed}", clock.elapsed().as_secs());
    println!("of: {}", list(kinds));
    println!("ended: {}", list(ends));
    assert!(failures.is_empty(), "{} failures:\n{}", failures.len(), failures.join("\n"));
}

/// What all starts came to.
#[derive(Default)]
struct Told {
    kinds: BTreeMap<String, u64>,
    ends: BTreeMap<String, u64>,
    failures: Vec<String>,
}

impl Told {
    fn add(&mut self, number: u64, judgement: Judgement) {
        let Judgement { kind, end, failure } = judgement;
        *self.kinds.entry(kind.clone()).or_default() += 1;
        *self.ends.entry(end).or_default() += 1;
        if let Some(failure) = failure {
            println!("start {number} ({kind}): {failure}");
            self.failures.push(format!("start {number} ({kind}): {failure}"));
        }
    }
}
