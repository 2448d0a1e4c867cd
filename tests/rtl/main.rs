//! The tile in SystemVerilog and the tile in Rust are the same, in every register, in every cycle.
//!
//! Both were written from docs/TILE.md. They get the same commands, bus words and draws; after every cycle all registers
//! of the page are compared, and before it what the ports say. See hw_models/rtl/README.md.
#![expect(clippy::disallowed_types, reason = "the test measures how fast the model runs")]

use std::fmt::Write;
use std::time::Instant;

use dalean::chip::engine::tick::{Command, Tile};
use rayon::prelude::*;

mod model;
#[path = "../it/tile_program.rs"]
mod tile_program;

use model::{Outputs, Rtl};
use tile_program::{GOLDEN_CYCLES, Program, Setting, digest, numbers, pinned, settings};

/// Cycles between two resets.
const LIFE_CYCLES: u64 = 4000;
/// Cycles of a setting.
const CYCLES: u64 = 28_000;

/// Counters of docs/TILE.md, section 6; the unused ones have no name.
const BANK_COUNTERS: [&str; 13] = [
    "cell_loads",
    "dac_slices",
    "cell_reads",
    "holds",
    "conversions",
    "shift_adds",
    "accumulates",
    "delta_computations",
    "requested",
    "bounded",
    "pulses_attempted",
    "pulses_effective",
    "saturated_conversions",
];
const TILE_COUNTERS: [&str; 6] =
    ["look_ups", "saturated_look_ups", "bus_words", "multiplies", "saturated_gates", "row_pulses"];

/// What was tried, as counts with names.
#[derive(Default)]
struct Coverage(Vec<(String, u64)>);

impl Coverage {
    fn add(&mut self, name: &str, count: u64) {
        match self.0.iter_mut().find(|(known, _)| known == name) {
            Some((_, total)) => *total += count,
            None => self.0.push((name.to_owned(), count)),
        }
    }
}

/// Where things stand in a run of one setting, for messages.
struct Place<'a> {
    setting: &'a Setting,
    cycle: u64,
    accepted: Vec<String>,
}

impl Place<'_> {
    fn says(&self, what: &str) -> String {
        let recent = &self.accepted[self.accepted.len().saturating_sub(3)..];
        let name = self.setting.name;
        let size = self.setting.size;
        let recent = recent.join(", ");
        format!("cycle {} of `{name}` ({size} x {size}), after {recent}: {what}", self.cycle)
    }
}

/// Runs one setting; an error says where the two tiles differ first.
fn lock_step(setting: &Setting, coverage: &mut Coverage) -> Result<u64, String> {
    let Some(mut rtl) = Rtl::new(setting.size) else { return Ok(0) };
    let table = setting.table();
    let fresh = || Tile::new(setting.tile_size(), setting.config.clone(), table.clone());
    let mut tile = fresh();
    let mut program = Program::new(setting);
    let mut hasher = blake3::Hasher::new();
    let mut place = Place { setting, cycle: 0, accepted: vec![] };
    rtl.configure(&setting.config, &table);
    rtl.reset();
    let names: Vec<_> =
        tile.registers().iter().map(|(name, all)| ((*name).to_owned(), all.len())).collect();
    assert_eq!(rtl.layout, names, "both sides name the registers alike");

    let at = |wanted: &str| {
        let before = names.iter().take_while(|(name, _)| name != wanted);
        before.map(|(_, length)| length).sum::<usize>()
    };
    let [conv_busy, lane_busy, front_slice] = ["conv_busy", "lane_busy", "front_slice"].map(at);

    for cycle in 0..CYCLES {
        place.cycle = cycle;
        if cycle > 0 && cycle % LIFE_CYCLES == 0 && cycle >= GOLDEN_CYCLES {
            cover(&tile, setting, coverage);
            rtl.reset();
            tile = fresh();
            program.restart();
            place.accepted.push("reset".to_owned());
        }
        program.prepare();
        let dither = [&program.dither[0][..], &program.dither[1][..]];
        let command = program.offer().map(|offer| offer.command());
        let said = rtl.set_inputs(command.as_ref(), program.bus_word, dither);
        let ready = command.as_ref().is_some_and(|command| tile.ready(command));
        let ports = Outputs {
            ready: if command.is_some() { ready.into() } else { said.ready },
            bus_index: u32::try_from(tile.bus_index()).expect("small"),
            dither_row: u32::try_from(tile.dither_row()).expect("small"),
            dither_wanted: tile.dither_wanted().into(),
        };
        if said != ports {
            return Err(place.says(&format!("ports are {said:?} in RTL, {ports:?} in Tick")));
        }
        if let Some(command) = &command {
            coverage.add(if ready { "commands accepted" } else { "commands refused" }, 1);
            if ready {
                let forward = matches!(command, Command::Forward { .. });
                let busy = |register: usize| u64::from(forward && rtl.registers[register] == 1);
                coverage.add("Forward accepted while converting", busy(conv_busy));
                coverage.add("Forward accepted while looking up", busy(lane_busy));
                if let Command::Now { shift, .. } | Command::Write { shift } = command {
                    let small = *shift < setting.config.dither_bits;
                    coverage.add("writes that shift by less than the dither", small.into());
                    coverage.add("writes that shift by more", (!small).into());
                }
                let text = format!("{command:?}");
                let name = text.split([' ', '{']).next().unwrap_or_default();
                place.accepted.push(format!("{name} at {cycle}"));
                coverage.add(name, 1);
            }
        }
        tile.cycle(command.as_ref(), program.bus_word, dither);
        rtl.edge();
        rtl.read_registers();
        if ready {
            program.accepted();
        }
        let slack = rtl.registers[front_slice] == i64::from(setting.config.slices);
        coverage.add("cycles of slack", slack.into());
        let expected = numbers(&tile);
        if rtl.registers != expected {
            return Err(place.says(&difference(&rtl, &expected)));
        }
        if cycle < GOLDEN_CYCLES {
            digest(&mut hasher, rtl.registers.iter().copied());
        }
    }
    cover(&tile, setting, coverage);
    let found = pinned(&hasher);
    if found != setting.golden {
        return Err(place.says(&format!("digest is {found}, pinned is {}", setting.golden)));
    }
    Ok(CYCLES)
}

/// The first register that differs, with both values, and how many others do.
fn difference(rtl: &Rtl, expected: &[i64]) -> String {
    let mut at = 0;
    let mut text = String::new();
    for (name, length) in &rtl.layout {
        for index in 0..*length {
            let (found, wanted) = (rtl.registers[at + index], expected[at + index]);
            if found != wanted && text.is_empty() {
                write!(text, "{name}[{index}] is {found} in RTL, {wanted} in Tick")
                    .expect("a text can be written");
            }
        }
        at += length;
    }
    let all = rtl.registers.iter().zip(expected).filter(|(found, wanted)| found != wanted).count();
    format!("{text}; {all} numbers differ")
}

/// Counts of a tile at the end of its life.
fn cover(tile: &Tile, setting: &Setting, coverage: &mut Coverage) {
    let registers = tile.registers();
    let get = |wanted: &str| {
        let found = registers.iter().find(|(name, _)| *name == wanted);
        &found.expect("a register of that name").1
    };
    let count = |number: i64| u64::try_from(number).expect("counts rise");
    let times = |register: &str, value: u16| {
        let found = get(register).iter().filter(|&&number| number == i64::from(value)).count();
        u64::try_from(found).expect("small")
    };
    for bank in ["e", "i"] {
        for (name, &events) in BANK_COUNTERS.iter().zip(get(&format!("events_{bank}"))) {
            coverage.add(&format!("{name}_{bank}"), count(events));
        }
        let level = format!("level_{bank}");
        coverage.add("cells pruned in the end", times(&format!("pruned_{bank}"), 1));
        coverage.add("cells on the ceiling in the end", times(&level, setting.config.ceiling));
    }
    for (name, &events) in TILE_COUNTERS.iter().zip(get("events")) {
        coverage.add(name, count(events));
    }
}

#[test]
fn rtl_and_tick_agree_in_every_register_of_every_cycle() {
    let start = Instant::now();
    let settings = settings();
    let run = |setting: &Setting| {
        let mut coverage = Coverage::default();
        (lock_step(setting, &mut coverage), coverage)
    };
    let runs: Vec<_> = if std::env::var_os("ED_TILE_LIBRARY").is_some() {
        // a seeded fault: in order, so that the first that notices is always the same; the rest is not needed
        let mut runs = vec![];
        for setting in &settings {
            runs.push(run(setting));
            if runs.last().is_some_and(|(run, _)| run.is_err()) {
                break;
            }
        }
        runs
    } else {
        settings.par_iter().map(run).collect()
    };
    let problems: Vec<_> = runs.iter().filter_map(|(run, _)| run.as_ref().err()).collect();
    for problem in &problems {
        println!("DIFFERS {problem}");
    }
    assert!(problems.is_empty(), "{} of {} settings differ", problems.len(), settings.len());

    let cycles: u64 = runs.iter().filter_map(|(run, _)| run.as_ref().ok()).sum();
    let mut total = Coverage::default();
    for (_, coverage) in &runs {
        for (name, count) in &coverage.0 {
            total.add(name, *count);
        }
    }
    for (name, count) in &total.0 {
        println!("{count:>12}  {name}");
    }
    println!("{cycles} cycles in {} settings, {} s", settings.len(), start.elapsed().as_secs());
    let still: Vec<_> = total.0.iter().filter(|(_, count)| *count == 0).collect();
    assert!(still.is_empty(), "these never happened: {still:?}");
    assert!(total.0.len() >= 2 * BANK_COUNTERS.len() + TILE_COUNTERS.len() + 16, "all are counted");
    if std::env::var_os("ED_TILE_LIBRARY").is_none() {
        assert!(cycles >= 300_000, "enough cycles");
    }
}

/// How many cycles a second the verilated tile does, with commands and data, without comparing anything.
#[test]
fn simulation_rate() {
    for size in [8, 16] {
        let Some(mut rtl) = Rtl::new(size) else { continue };
        let settings = settings();
        let setting = settings.iter().find(|setting| setting.size == size).expect("of each size");
        rtl.configure(&setting.config, &setting.table());
        rtl.reset();
        let mut program = Program::new(setting);
        let cycles = 40_000;
        let start = Instant::now();
        for _ in 0..cycles {
            program.prepare();
            let command = program.offer().map(|offer| offer.command());
            let dither = [&program.dither[0][..], &program.dither[1][..]];
            let said = rtl.set_inputs(command.as_ref(), program.bus_word, dither);
            rtl.edge();
            if command.is_some() && said.ready == 1 {
                program.accepted();
            }
        }
        let rate = f64::from(cycles) / start.elapsed().as_secs_f64();
        println!("rtl {size}x{size}: {rate:.0} cycles/s");
    }
}
