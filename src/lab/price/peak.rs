//! What a model says before anything runs: times of a full tile, peak rates of the whole chip, areas.
//!
//! ```text
//! alone        1 + read(C, 0) cycles                          one read after the other
//! back to back 1 + again(C) cycles                            the front end never waits
//! TOPS         operations of 2 R C tiles products / time
//! ```
//!
//! A tile holds two banks of R x C cells, each of which takes part in a product; how products become operations is a
//! [`Convention`]. See docs/MODEL.md, 4.6.

use super::convention::Convention;
use super::plan::Footprint;
use super::total::Range;
use crate::chip::hardware::{Hardware, ReadTime, Timing};
use crate::lab::config::{Constants, CostTable};

/// A duration on a full tile.
#[derive(Debug, Clone, PartialEq)]
pub struct Figure {
    /// What takes it.
    pub name: &'static str,
    /// Cycles, the accepted command included.
    pub cycles: u64,
    /// Seconds.
    pub seconds: f64,
}

/// Cycles as seconds.
fn seconds(timing: &Timing, cycles: u64) -> f64 {
    cycles as f64 / (timing.clock_khz as f64 * 1000.0)
}

/// Durations of the operations on a full tile; `words` are on the error bus.
#[must_use]
pub fn figures(hardware: &Hardware, words: u64) -> Vec<Figure> {
    let Some(timing) = hardware.timing else { return vec![] };
    let (rows, columns) = (hardware.tile.rows as u64, hardware.tile.columns as u64);
    let reads = ReadTime::new(hardware, timing);
    let accept = timing.accept();
    let figure = |name, cycles| Figure { name, cycles, seconds: seconds(&timing, cycles) };
    vec![
        figure("read", accept + reads.read(1, columns, 0)),
        figure("next read after", accept + reads.again(1, columns)),
        figure("error words", accept + timing.error(words, columns, 1)),
        figure("accumulate", accept + timing.accumulate(rows, columns)),
        figure("write, row without pulses", timing.rows(1, 0)),
        figure("write, row with one pulse", timing.rows(1, 1)),
        figure("write, all rows, one pulse", accept + timing.rows(rows, rows)),
    ]
}

/// The most a chip can do.
#[derive(Debug, Clone, PartialEq)]
pub struct Peak {
    /// Tiles reckoned with.
    pub tiles: u64,
    /// How operations are counted.
    pub convention: Convention,
    /// Multiplications with additions of a read of all tiles.
    pub macs: f64,
    /// One read after the other: duration, operations a second.
    pub alone: (Figure, f64),
    /// Reads back to back.
    pub back_to_back: (Figure, f64),
}

/// Peak rate of reading with `tiles` full tiles, in `slices` slices or phases: other than the chip's own, all as its first.
#[must_use]
pub fn peak(hardware: &Hardware, tiles: u64, slices: u64, convention: Convention) -> Option<Peak> {
    let timing = hardware.timing?;
    let reads = ReadTime::of(timing, slices);
    let (rows, columns) = (hardware.tile.rows as u64, hardware.tile.columns as u64);
    let products = 2 * tiles * rows * columns;
    let rate = |name, cycles| {
        let figure = Figure { name, cycles, seconds: seconds(&timing, cycles) };
        let rate = convention.operations(products) / figure.seconds;
        (figure, rate)
    };
    Some(Peak {
        tiles,
        convention,
        macs: convention.macs(products),
        alone: rate("alone", timing.accept() + reads.read(1, columns, 0)),
        back_to_back: rate("back to back", timing.accept() + reads.again(1, columns)),
    })
}

/// Square metres of a plan's parts, by component, as far as the model gives them.
#[must_use]
pub fn areas(
    plan: &Footprint,
    hardware: &Hardware,
    constants: &Constants,
) -> Vec<(&'static str, Range)> {
    let given = constants.iter().filter(|c| c.quantity.table == CostTable::Area);
    let given = given.filter(|c| c.not_here().is_none());
    given
        .map(|c| {
            let parts = plan.parts(c.quantity.per, hardware) as f64;
            (c.quantity.name, c.value.map(|area| area * parts))
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lab::config::{Sources, load};

    #[test]
    fn a_peak_is_operations_of_all_tiles_over_the_time_of_a_read() {
        let settings = [
            "hw.timing.clock_mhz=1000",
            "hw.timing.settle_cycles=10",
            "hw.timing.convert_cycles=1",
            "hw.timing.columns_per_adc=8",
            "hw.timing.lanes=256",
            "hw.drive.dac_bits=4",
        ];
        let settings = settings.map(str::to_owned);
        let sources = Sources { settings: &settings, ..Sources::default() };
        let hardware = load(&sources).unwrap().hardware;
        let peak = peak(&hardware, 3, u64::from(hardware.slices()), Convention::PAIRS).unwrap();
        // 1 + 10 + 10 + 8 + 1 cycles alone, 1 + 20 back to back
        assert_eq!((peak.alone.0.cycles, peak.back_to_back.0.cycles), (30, 21));
        let operations = 2.0 * 3.0 * 65536.0;
        assert!((peak.alone.1 / (operations / 30e-9) - 1.0).abs() < 1e-12);
        assert_eq!(figures(&hardware, 10)[0].cycles, 30);
    }
}
