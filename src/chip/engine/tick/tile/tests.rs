//! Two-sided timing: not ready one cycle before, ready on the cycle.

use super::*;
use crate::chip::hardware::PulseCode;

const SIZE: TileSize = TileSize { rows: 3, columns: 5, slots: 2, tree_max: 4 };

fn config() -> TileConfig {
    TileConfig {
        rows: 3,
        columns: 5,
        settle: 4,
        convert: 2,
        share: 3,
        overlap: true,
        slices: 2,
        dac_bits: 4,
        tree: 1,
        lanes: 2,
        hops: 2,
        words: 4,
        tap_base: 1,
        pulse: 3,
        adc: TileAdc::Ideal,
        lut_bits: 4,
        lut_shift: 6,
        error_bits: 8,
        negate: false,
        mantissa: 1,
        dither_bits: 0,
        increment_max: 7,
        floor: 0,
        ceiling: 255,
        absorbing: false,
        more: More::default(),
    }
}

fn tile(config: TileConfig) -> Tile {
    let table = (0..16).map(|i| [i * 16, 255 - i]).collect();
    let mut tile = Tile::new(SIZE, config, table);
    for row in 0..3 {
        let levels = [[10, 20, 30, 40, 50], [1, 2, 3, 4, 5]].map(|l| l.map(|l| l + row as u16));
        run(&mut tile, &Command::LoadWeights { row, levels: [&levels[0], &levels[1]] });
        for slot in 0..2 {
            let code = (row * 60 + slot * 7) as u8;
            run(&mut tile, &Command::LoadDrives { row, slot, codes: [code, code + 1] });
        }
    }
    tile
}

/// Busy cycles of a command: those after the one that accepts it, until the tile is idle.
fn run(tile: &mut Tile, command: &Command<'_>) -> u64 {
    assert!(tile.ready(command), "idle tiles take commands");
    tile.cycle(Some(command), 0, [&[]; 2]);
    let mut cycles = 0;
    while !tile.idle() {
        tile.cycle(None, 90, [&[0; 5]; 2]);
        cycles += 1;
    }
    cycles
}

#[test]
fn commands_take_the_cycles_of_the_page() {
    // conv 6 > settle 4; NG 3
    let mut overlapped = tile(config());
    assert_eq!(run(&mut overlapped, &Command::Forward { slot: 0 }), 4 + 6 + 6 + 1 + 3);
    assert_eq!(run(&mut overlapped, &Command::Error { slot: 0 }), 2 + 4 + 3);
    assert_eq!(run(&mut overlapped, &Command::Add { slot: 0 }), 9);
    let mut apart = tile(TileConfig { overlap: false, ..config() });
    assert_eq!(run(&mut apart, &Command::Forward { slot: 0 }), 2 * 10 + 1 + 3);
    // nothing to write: compute and turn around
    assert_eq!(run(&mut apart, &Command::Write { shift: 0 }), 3 * 2);
}

#[test]
fn the_front_end_takes_the_next_read_on_its_cycle_and_not_before() {
    for (lanes, again) in [(2, 12), (1, 12)] {
        let mut tile = tile(TileConfig { lanes, ..config() });
        let read = Command::Forward { slot: 1 };
        tile.cycle(Some(&read), 0, [&[]; 2]);
        for _ in 0..again {
            assert!(!tile.ready(&read), "one cycle before");
            tile.cycle(Some(&read), 0, [&[]; 2]);
        }
        assert!(tile.ready(&read), "on the cycle");
        assert!(!tile.idle(), "converters and lanes still work");
    }
}

#[test]
fn lanes_that_are_slower_than_slices_hold_the_front_end() {
    let one = TileConfig {
        slices: 1,
        dac_bits: 8,
        convert: 1,
        share: 1,
        lanes: 1,
        settle: 1,
        tree: 0,
        ..config()
    };
    let mut tile = tile(one);
    let read = Command::Forward { slot: 0 };
    tile.cycle(Some(&read), 0, [&[]; 2]);
    for _ in 0..5 {
        assert!(!tile.ready(&read));
        tile.cycle(None, 0, [&[]; 2]);
    }
    assert!(tile.ready(&read));
    for _ in 0..20 {
        tile.cycle(Some(&read), 0, [&[]; 2]);
    }
}

#[test]
fn pulses_take_as_many_passes_as_the_most_active_cell() {
    let mut tile = tile(config());
    run(&mut tile, &Command::Forward { slot: 0 });
    run(&mut tile, &Command::Error { slot: 0 });
    let before = tile.level.clone();
    let cycles = run(&mut tile, &Command::Now { slot: 0, shift: 10 });
    let moved = |bank: usize, row: usize| -> Vec<i64> {
        let at = |column: usize| row * 5 + column;
        let change = |c| i64::from(tile.level[bank][at(c)]) - i64::from(before[bank][at(c)]);
        (0..5).map(change).collect()
    };
    let mut expected = 0;
    for row in 0..3 {
        let all: Vec<i64> = (0..2).flat_map(|bank| moved(bank, row)).collect();
        let (set, reset) = (all.iter().max().unwrap().max(&0), all.iter().min().unwrap().min(&0));
        expected += 2 + 3 * (set - reset).unsigned_abs();
    }
    assert_eq!(cycles, expected);
    assert!(tile.events.row_pulses > 0, "the case is none");
}

#[test]
fn limited_and_verified_pulses_take_the_passes_they_need() {
    let more = More { verify: true, active_max: Some(2), ..More::default() };
    let mut tile = tile(TileConfig { more, ..config() });
    tile.gate[..5].copy_from_slice(&[0, 100, 100, 0, 100]);
    tile.config.mantissa = 1;
    // rows drive 0, 60, 120 (e) and 1, 61, 121 (i): 6,000 >> 11 rounds to 3, 12,000 to 6
    let cycles = run(&mut tile, &Command::Now { slot: 0, shift: 11 });
    // three cells a bank: two passes each for set (e) and for reset (i)
    assert_eq!(cycles, 3 * 2 + 2 * 2 * (3 + 6) * (3 + 4 + 6));
    assert_eq!(tile.bank_events[0].verify_reads, 3 * 9);
}

#[test]
fn an_amplitude_moves_many_levels_in_one_pulse() {
    let more = More { pulse_code: PulseCode::Amplitude, ..More::default() };
    let mut tile = tile(TileConfig { more, ..config() });
    tile.gate[..5].copy_from_slice(&[0, 100, 100, 0, 100]);
    let before = tile.level[0][2 * 5 + 1];
    let cycles = run(&mut tile, &Command::Now { slot: 0, shift: 11 });
    assert_eq!(cycles, 3 * 2 + 2 * 2 * 3);
    assert_eq!(tile.level[0][2 * 5 + 1], before + 6);
    assert_eq!(tile.bank_events[0].pulses_attempted, 3 * 9);
}
