//! What a run takes, weighed before it is taken.
//!
//! ```text
//! wanted = sum over arrays of cells x ( 1 or 2 planes + 2 of a residual + 1 of pruned bits + 4 of a checkpoint
//!                                     + 8 of a device whose cells differ in their steps + 8 in their windows + 3 where wires resist )
//!        + sum over convolutions of reads x ( drive sets x rows + target streams x units x 10 )
//! left   = least of: memory the system can give, what the group of processes may take, what this process may address
//! ```
//!
//! Each cell of a checkpoint is two bytes, once as a tensor and once in the file. Reads are positions times the samples that
//! are read together: 256, or a batch where that is more. Of a unit a read keeps a sum, activity, slope, words and gates: ten
//! bytes, roughly. What is small is not weighed.
#![expect(clippy::disallowed_methods, reason = "the system tells its memory in files")]

use std::fmt;
use std::fs;

use super::RunError;
use crate::chip::crossbar::layout::Layout;
use crate::chip::hardware::{FloorKind, Hardware};
use crate::chip::layer::LayerSpec;
use crate::learn::network::NetworkSpec;
use crate::num::fixed::Batch;

/// Bytes that every system has: runs below are not weighed.
const SMALL: u64 = 64 << 20;
/// Samples that are read together when nothing is learnt.
const READ_TOGETHER: u64 = 256;
/// Bytes that are kept of a unit and read.
const UNIT_BYTES: usize = 10;

/// An amount of memory.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Memory(u64);

impl Memory {
    /// So many bytes.
    #[must_use]
    pub const fn of(bytes: u64) -> Self {
        Self(bytes)
    }

    /// In bytes.
    #[must_use]
    pub const fn bytes(self) -> u64 {
        self.0
    }

    /// What is left for this process; `None` where the system does not say.
    #[must_use]
    pub fn left() -> Option<Self> {
        let read = |path: &str| fs::read_to_string(path).ok();
        let number = |text: &str| text.split_whitespace().find_map(|word| word.parse::<u64>().ok());
        let line = |text: &str, head: &str| {
            text.lines().find_map(|line| line.strip_prefix(head)).and_then(number)
        };
        let free = read("/proc/meminfo").and_then(|text| line(&text, "MemAvailable:"));
        let free = free.map(|kib| kib.saturating_mul(1024));
        let group =
            |name: &str| read(&format!("/sys/fs/cgroup/memory.{name}")).and_then(|t| number(&t));
        let group = group("max").map(|most| most.saturating_sub(group("current").unwrap_or(0)));
        let limits = read("/proc/self/limits");
        let may = limits.and_then(|text| line(&text, "Max address space"));
        let used = read("/proc/self/status").and_then(|text| line(&text, "VmSize:"));
        let own = may.map(|may| may.saturating_sub(used.unwrap_or(0).saturating_mul(1024)));
        [free, group, own].into_iter().flatten().min().map(Self)
    }

    /// What the arrays of a network take, a copy of their state, and what is kept of the samples that convolutions read together.
    #[must_use]
    pub fn of_network(layers: &[LayerSpec], hardware: &Hardware, batch: Batch) -> Self {
        let planes = if hardware.cell.level_bits.get() > 8 { 2 } else { 1 };
        let residual = if hardware.write.residual_bits.get() > 0 { 2 } else { 0 };
        let absorbs = hardware.cell.floor_kind == FloorKind::Absorbing;
        let wears = hardware.endurance.is_some();
        let pruned = u64::from(absorbs || wears || hardware.has_stuck_cells());
        let beside = hardware.device.as_ref().is_some_and(|device| device.write_noise.0 != 0);
        let beside = beside || hardware.ageing.is_some();
        let drifts = hardware.ageing.is_some();
        let forgets = hardware.leakage.is_some_and(|of| of.spread.0 != 0);
        // a count is written with 8 bytes
        let memory = 16 * u64::from(wears)
            + 4 * u64::from(beside)
            + 4 * u64::from(forgets)
            + 16 * u64::from(drifts);
        let through = 3 * u64::from(hardware.wires.is_some());
        let spread = hardware.device.as_ref().map(|device| device.spread);
        let own = spread
            .map_or(0, |of| 8 * (u64::from(of.differs_in_steps()) + u64::from(of.moves_window())));
        let of = |layer: &LayerSpec| {
            let rows = layer.inputs + usize::from(layer.constant_row);
            let layout = Layout { rows, columns: layer.units };
            let arrays = layer.wiring.pathways().len() as u64;
            let cells = |cells: usize| (cells as u64).saturating_mul(arrays);
            let stored = cells(layout.cells_padded())
                .saturating_mul(planes + residual + pruned + own + through + memory);
            let together = u64::from(batch.get()).max(READ_TOGETHER);
            let reads = together.saturating_mul(layer.positions() as u64);
            let sets = layer.drive_sets().len() * rows;
            let of_units = layer.wiring.targets().len() * layer.units * UNIT_BYTES;
            let kept = match layer.convolution {
                Some(_) => reads.saturating_mul((sets + of_units) as u64),
                None => 0,
            };
            stored.saturating_add(cells(layout.cells()).saturating_mul(4)).saturating_add(kept)
        };
        Self(layers.iter().map(of).fold(0, u64::saturating_add))
    }
}

impl fmt::Display for Memory {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut amount = self.0 as f64;
        let mut units = ["bytes", "KiB", "MiB", "GiB", "TiB", "PiB", "EiB"].into_iter();
        let mut unit = units.next().unwrap_or("bytes");
        while amount >= 1024.0
            && let Some(next) = units.next()
        {
            (amount, unit) = (amount / 1024.0, next);
        }
        if unit == "bytes" { write!(f, "{amount} {unit}") } else { write!(f, "{amount:.1} {unit}") }
    }
}

/// Whether a network fits into what is left.
///
/// # Errors
/// When it does not, with both amounts.
pub(crate) fn weigh(
    layers: &[LayerSpec],
    hardware: &Hardware,
    batch: Batch,
    left: Option<Memory>,
) -> Result<(), RunError> {
    let wanted = Memory::of_network(layers, hardware, batch);
    match left {
        Some(left) if wanted.0 > SMALL && wanted > left => Err(RunError::Memory { wanted, left }),
        _ => Ok(()),
    }
}

/// Whether networks that are about to be built side by side fit into the memory that this system has left. Runs are weighed by
/// themselves.
///
/// ```
/// use dalean::{Config, RunError, Sources};
///
/// let settings = ["network.hidden=[65535, 65535]".to_owned()];
/// let config = Config::load(&Sources { settings: &settings, ..Sources::default() })?;
/// let experiment = config.experiment(64, 10, None)?;
/// match dalean::weighed(&[&experiment.network], &experiment.hardware) {
///     Err(RunError::Memory { wanted, .. }) => assert!(wanted.bytes() > 1 << 34),
///     Err(error) => panic!("{error}"),
///     Ok(()) => {} // a system that has it, or does not say
/// }
/// # Ok::<(), dalean::ConfigError>(())
/// ```
///
/// # Errors
/// When they do not, with both amounts.
pub fn weighed(networks: &[&NetworkSpec], hardware: &Hardware) -> Result<(), RunError> {
    let layers: Vec<LayerSpec> =
        networks.iter().flat_map(|network| network.layers.iter().cloned()).collect();
    let batch = networks.iter().map(|network| network.batch).max_by_key(|batch| batch.get());
    match batch {
        Some(batch) => weigh(&layers, hardware, batch, Memory::left()),
        None => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lab::config::{Sources, load};

    #[test]
    fn amounts_are_shown_in_three_digits_or_so() {
        let shown = [0, 1023, 1024, 3 << 29, u64::MAX].map(|bytes| Memory(bytes).to_string());
        assert_eq!(shown, ["0 bytes", "1023 bytes", "1.0 KiB", "1.5 GiB", "16.0 EiB"]);
    }

    #[test]
    fn a_network_that_no_machine_holds_is_refused_with_both_amounts() {
        let settings =
            ["network.hidden=[65535, 65535, 65535]".to_owned(), "hw.tile.count=default".to_owned()];
        let config = load(&Sources { settings: &settings, ..Sources::default() }).unwrap();
        let experiment = config.experiment(64, 10, None).unwrap();
        let (layers, hardware) = (&experiment.network.layers, &experiment.hardware);
        let batch = experiment.network.batch;
        // two layers of 65535 x 65535 in four pathways: a byte, a plane padded, and four of the checkpoint
        let wanted = Memory::of_network(layers, hardware, batch);
        let cells = 2 * 4 * 65_535u64.pow(2);
        assert!((5 * cells..6 * cells).contains(&wanted.bytes()), "{wanted}");
        let error =
            weigh(layers, hardware, batch, Some(Memory::of(24 << 30))).unwrap_err().to_string();
        assert!(error.contains("160.") && error.contains("24.0 GiB"), "{error}");
        assert!(weigh(layers, hardware, batch, None).is_ok(), "who knows nothing refuses nothing");
        let small = config.experiment(4, 10, None);
        assert!(small.is_ok());
    }

    #[test]
    fn what_convolutions_read_together_counts() {
        let settings = ["network.channels=[10]".to_owned(), "network.hidden=[]".to_owned()];
        let config = load(&Sources { settings: &settings, ..Sources::default() }).unwrap();
        let network = config.experiment(64, 10, Some([8, 8, 1])).unwrap().network;
        let of = |batch| {
            let batch = Batch::new(batch).unwrap();
            Memory::of_network(&network.layers, config.hardware(), batch).bytes()
        };
        // 9 rows of one set, 10 units in two streams, at 64 positions
        assert_eq!(of(257) - of(256), 64 * (9 + 2 * 10 * 10));
        assert_eq!(of(1), of(256), "as many are read together when nothing is learnt");
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn this_system_says_what_is_left() {
        assert!(Memory::left().is_some_and(|left| left.bytes() > 0));
    }
}
