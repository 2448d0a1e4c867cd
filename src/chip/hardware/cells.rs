//! What the cells of a chip are made of: its device, what they remember, what they conduct.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use std::borrow::Cow;
use std::sync::Arc;

use super::Hardware;
use crate::chip::device::{Conducting, Device, DeviceSpec, MemoryLaw, WriteNoise};
use crate::num::tables::Gaussian;

impl Hardware {
    /// The greatest level that a cell of this chip can have: the ceiling, or where cells differ in theirs what a level holds.
    #[must_use]
    pub fn level_greatest(&self) -> u16 {
        match &self.device {
            Some(device) if device.spread.moves_window() => self.cell.level_bits.level_max(),
            _ => self.cell.window.ceiling(),
        }
    }

    /// What its cells answer to pulses by, if not by a level a pulse: the device, or where cells remember their pulses one like the ideal cell.
    #[must_use]
    pub(crate) fn answering(&self) -> Option<Cow<'_, DeviceSpec>> {
        let window = self.cell.window;
        let states = u32::from(window.ceiling() - window.floor());
        // a pulse of such a cell is always right
        let even = || DeviceSpec { tries: 1, ..DeviceSpec::even(states) };
        let counted =
            || (self.endurance.is_some() || self.ageing.is_some()).then(|| Cow::Owned(even()));
        self.device.as_ref().map(Cow::Borrowed).or_else(counted)
    }

    /// The tables of what its cells answer by.
    #[must_use]
    pub(crate) fn device(&self) -> Option<Device> {
        let ends = [self.cell.window.floor(), self.cell.window.ceiling()];
        let level_max = self.cell.level_bits.level_max();
        let verified = self.timing.is_some_and(|timing| timing.verify);
        self.answering().map(|device| {
            let cells = Device::new(&device, ends, level_max);
            if verified { cells.with_verified(&device) } else { cells }
        })
    }

    /// What its cells remember beside their level; `None`: nothing.
    #[must_use]
    pub(crate) fn memory(&self) -> Option<MemoryLaw> {
        let window = self.cell.window;
        let noise = self.device.as_ref().map(|device| device.write_noise);
        let noise = noise.filter(|share| share.0 != 0).map(|share| {
            let span = window.ceiling() - window.floor();
            WriteNoise::new(Arc::new(Gaussian::new()), share, span)
        });
        let law = MemoryLaw {
            endurance: self.endurance.map(|of| (of.worn, of.limits())),
            write_noise: noise,
            leakage: self.leakage.map(|of| of.ready()),
            ageing: self.ageing.map(|of| of.ready([window.ceiling(), self.level_greatest()])),
        };
        (!law.is_nothing()).then_some(law)
    }

    /// The key by which its cells draw words of their own, so that two arrays that are written alike would not be alike; `None`: they
    /// do not. Conversions draw by the read that they are of, and the dither of a write is the layer's.
    #[must_use]
    pub(crate) fn differs_by_cell(&self) -> Option<&'static str> {
        let spread = self.endurance.is_some_and(|of| of.spread.0 != 0);
        let keys = [
            (!self.faults.is_none(), "hw.device.faults"),
            (!self.fault_map.is_empty(), "hw.device.faults.map"),
            // steps are rounded by draws, even where all are alike
            (self.device.is_some(), "hw.device.response"),
            (self.programming.is_some(), "hw.device.programming"),
            (spread, "hw.device.endurance.spread"),
            (self.leakage.is_some(), "hw.device.leakage"),
            (self.ageing.is_some(), "hw.device.drift"),
        ];
        keys.into_iter().find_map(|(differs, key)| differs.then_some(key))
    }

    /// The law of its currents, where cells conduct something else than their level.
    #[must_use]
    pub fn conducting(&self) -> Option<Conducting> {
        Conducting::new(self.conductance, self.wires, self.cell.window.ceiling())
    }

    /// Whether cells are stuck, by a draw or a list.
    #[must_use]
    pub fn has_stuck_cells(&self) -> bool {
        !self.faults.is_none() || !self.fault_map.is_empty()
    }

    /// Pulses across the window and levels they move a cell by, where those are not the same.
    #[must_use]
    pub fn pulses_of_window(&self) -> Option<[u32; 2]> {
        let window = self.cell.window;
        let span = u32::from(window.ceiling() - window.floor());
        self.device.as_ref().map(|device| [device.states, span])
    }
}
