//! The state hash: one number for everything that decides what comes next.
//!
//! ```text
//! BLAKE3 over  arithmetic version (u32 LE)
//!              each layer and existing pathway in code order: rows, columns (u32 LE), levels row-major u16 LE,
//!                  pruned bits row-major LSB first (absorbing floor only), residuals u16 LE (F > 0 only)
//!              then as i64 LE: running centres; converter shifts (layer, stream, slice); write counts (layer, pathway);
//!                  ledger totals (training, calibration, evaluation) in the order of the ledger's table, without those
//!                  that follow from how arrays are cut into tiles
//! ```
//!
//! Logical order, unpadded; what a run does not have is left out. Re-tiling with ideal converters is no other run, so
//! DAC slices, holds, conversions and shift-adds, which the plan tells, are not part of it.

use super::ARITHMETIC;
use crate::chip::engine::Phase;
use crate::chip::ledger::Event;
use crate::learn::driver::Driver;

/// Hash of the state, in hexadecimal.
#[must_use]
pub fn state(driver: &Driver) -> String {
    let engine = driver.engine();
    let mut hash = blake3::Hasher::new();
    hash.update(&ARITHMETIC.to_le_bytes());
    let side = |n: usize| u32::try_from(n).expect("checked by the plan").to_le_bytes();
    for layer in engine.layers() {
        for array in &layer.arrays {
            let layout = array.layout();
            hash.update(&side(layout.rows)).update(&side(layout.columns));
            let levels: Vec<u8> = array.levels().flat_map(u16::to_le_bytes).collect();
            hash.update(&levels);
            if let Some(mut bits) = array.pruned() {
                bits.set_uninitialized(false);
                hash.update(bits.as_raw_slice());
            }
            if let Some(residuals) = array.residuals() {
                let bytes: Vec<u8> = residuals.into_iter().flat_map(u16::to_le_bytes).collect();
                hash.update(&bytes);
            }
        }
    }
    let mut number = |n: i64| {
        hash.update(&n.to_le_bytes());
    };
    let count = |n: u64| i64::try_from(n).expect("a run has fewer than 2^63 events");
    driver.unit().means().iter().copied().for_each(&mut number);
    for layer in engine.layers() {
        layer.adc_shifts.iter().flatten().for_each(|&shift| number(i64::from(shift)));
    }
    for layer in engine.layers() {
        layer.writes.iter().for_each(|&writes| number(count(writes)));
    }
    for phase in Phase::ALL {
        let events = Event::ALL.into_iter().filter(|event| event.is_state());
        events.for_each(|event| number(count(engine.ledger(phase).total(event))));
    }
    hash.finalize().to_hex().to_string()
}

/// Hash of all activation tables, layer by layer.
#[must_use]
pub fn tables(driver: &Driver) -> String {
    let mut hash = blake3::Hasher::new();
    for layer in driver.engine().layers() {
        hash.update(&layer.lut.shift.to_le_bytes());
        hash.update(&layer.lut.activity).update(&layer.lut.derivative);
    }
    hash.finalize().to_hex().to_string()
}

/// Hash of a text.
#[must_use]
pub fn text(text: &str) -> String {
    blake3::hash(text.as_bytes()).to_hex().to_string()
}
