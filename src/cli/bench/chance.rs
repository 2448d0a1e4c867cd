//! Random arrays, drives, gates and images.

use aligned_vec::{AVec, avec};

use crate::chip::crossbar::Crossbar;
use crate::chip::crossbar::layout::{BLOCK_ROWS, Layout};
use crate::chip::hardware::Hardware;
use crate::lab::config::{self, Config, Sources};
use crate::num::draw::{Place, Site};
use crate::task::classify::Examples;

/// Bytes that `number` names.
pub(super) fn bytes(number: u64, len: usize) -> AVec<u8> {
    let mut bytes = avec![0; len];
    Place::global(number, Site::InitialLevels, 0).fill(0, &mut bytes);
    bytes
}

/// An array of random levels all over its window.
pub(super) fn array(number: u64, layout: Layout, hardware: &Hardware) -> Crossbar {
    let mut array = Crossbar::new(layout, hardware);
    let span = u32::from(hardware.cell.window.ceiling() - hardware.cell.window.floor()) + 1;
    let bytes = bytes(number, 2 * layout.cells());
    let mut words = bytes.as_chunks::<2>().0.iter().map(|word| u16::from_le_bytes(*word));
    let mut levels = vec![0; layout.columns];
    for row in 0..layout.rows {
        for (level, word) in levels.iter_mut().zip(&mut words) {
            let above = u16::try_from((u32::from(word) * span) >> 16).expect("below the span");
            *level = hardware.cell.window.floor() + above;
        }
        array.load_row(row, &levels);
    }
    array
}

/// Drives of a batch, `[block][sample][64]`; rows that do not exist are driven with 0.
pub(super) fn drives(number: u64, layout: Layout, batch: usize) -> AVec<u8> {
    let mut drives = bytes(number, layout.blocks() * batch * BLOCK_ROWS);
    for (at, row) in drives.chunks_exact_mut(BLOCK_ROWS).enumerate() {
        let live = layout.rows - at / batch * BLOCK_ROWS;
        row[live.min(BLOCK_ROWS)..].fill(0);
    }
    drives
}

/// Signed bytes, -127..=127.
pub(super) fn gates(number: u64, len: usize) -> AVec<i8> {
    let mut gates = avec![0; len];
    let bytes = bytes(number, len);
    gates.iter_mut().zip(&*bytes).for_each(|(gate, byte)| *gate = byte.cast_signed().max(-127));
    gates
}

/// Images of 784 values of which about 19 in 100 are not 0, as in MNIST, with labels that mean nothing.
pub(super) fn images(count: usize) -> Examples {
    let dice = bytes(1, count * 784);
    let mut values = bytes(2, count * 784).to_vec();
    for (value, &die) in values.iter_mut().zip(&*dice) {
        // 49 of 256 sides
        *value = if die < 49 { (*value).max(1) } else { 0 };
    }
    let labels = bytes(3, count).iter().map(|byte| byte % 10).collect();
    Examples::new(values, labels, 784, 255, 10).expect("784 values an image, 10 classes")
}

/// Images of 32 x 32 pixels with three planes of any values, with labels that mean nothing.
pub(super) fn pictures(count: usize) -> Examples {
    let values = bytes(4, count * 3 * 32 * 32).to_vec();
    let labels = bytes(5, count).iter().map(|byte| byte % 10).collect();
    Examples::new(values, labels, 3 * 32 * 32, 255, 10).expect("3072 values an image, 10 classes")
}

/// The configuration that some settings make.
pub(super) fn config(settings: &[String]) -> Config {
    let sources = Sources { experiment: Some(("bench", "")), settings, ..Sources::default() };
    let mut config = config::load(&sources).expect("a bench knows its own settings");
    // cycles are counted where a race asks for them
    if !settings.iter().any(|setting| setting.starts_with("hw.timing.")) {
        config.hardware =
            config.hardware.with(|chip| chip.timing = None).expect("a chip needs no timing");
    }
    config
}

/// The chip that some settings make, such as `hw.cell.level_bits=12`.
pub(super) fn hardware(settings: &[&str]) -> Hardware {
    let settings: Vec<String> = settings.iter().map(|&setting| setting.into()).collect();
    config(&settings).hardware
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_beyond_the_last_are_not_driven() {
        let layout = Layout { rows: 70, columns: 32 };
        let drives = drives(1, layout, 2);
        assert_eq!(drives.len(), 2 * 2 * 64);
        assert!(drives[..128].iter().filter(|&&code| code == 0).count() < 8);
        for row in drives[128..].chunks_exact(64) {
            assert!(row[6..].iter().all(|&code| code == 0) && row[..6].iter().any(|&c| c != 0));
        }
    }

    #[test]
    fn levels_fill_their_window_and_images_are_mostly_dark() {
        let hardware = hardware(&["hw.cell.level_bits=12"]);
        let array = array(1, Layout { rows: 64, columns: 64 }, &hardware);
        assert!(array.levels().any(|level| level > 4000) && array.levels().all(|l| l < 4096));
        let lit = images(10).all_values().iter().filter(|&&value| value > 0).count();
        assert!((1300..1700).contains(&lit), "{lit} of 7840");
    }
}
