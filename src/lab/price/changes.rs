//! What one chip would have done otherwise than another: which counts of its ledger are not the other's.

use crate::chip::hardware::{
    Adc, CellSpec, DigitalSpec, DriveSpec, Hardware, HardwareSpec, Subtract, TileSpec, Timing,
    WriteSpec,
};
use crate::chip::ledger::Event;
use crate::lab::config::Per;

/// A difference between the chip of a run and another one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Change {
    /// The key of the hardware model.
    pub key: &'static str,
    /// Counts that would be others.
    pub events: &'static [Event],
    /// Whether the cycles would be others.
    pub time: bool,
}

impl Change {
    /// Whether what a quantity is counted by would be another.
    pub(super) fn touches(&self, per: Per) -> bool {
        matches!(per, Per::Event(event) if self.events.contains(&event))
    }
}

/// Follows from rows of a tile.
const DOWN: &[Event] = &[Event::Holds, Event::Conversions, Event::ShiftAdds, Event::RowPulses];
/// Follows from columns of a tile.
const ACROSS: &[Event] = &[Event::DacSlices, Event::SramBits, Event::RowPulses];
/// Follows from the number of slices.
const SLICES: &[Event] = &[
    Event::DacSlices,
    Event::SramBits,
    Event::CellReads,
    Event::Holds,
    Event::Conversions,
    Event::ShiftAdds,
];
/// Follows from where banks are subtracted.
const BANKS: &[Event] = &[Event::Conversions, Event::ShiftAdds];
/// Follows from how pulses are given.
const PULSES: &[Event] = &[Event::RowPulses, Event::VerifyReads];
/// Follows from what was learnt: another width or range learns another net.
const LEARNT: &[Event] = &[Event::PulsesAttempted, Event::RowPulses, Event::VerifyReads];
/// Follows from remainders behind cells.
const REMAINDERS: &[Event] =
    &[Event::PulsesAttempted, Event::RowPulses, Event::VerifyReads, Event::SramBits];
/// Follows from how increments become pulses.
const SCHEME: &[Event] = &[
    Event::PulsesAttempted,
    Event::RowPulses,
    Event::VerifyReads,
    Event::SramBits,
    Event::Accumulates,
    Event::DeltaComputations,
];

/// The differences that matter to a ledger made on `run` when it is priced as if made on `other`. The clock is none:
/// cycles do not depend on it.
#[must_use]
pub fn changes(run: &Hardware, other: &Hardware) -> Vec<Change> {
    let mut all = Vec::new();
    let mut differ = |key, is: bool, events, time| {
        if is {
            all.push(Change { key, events, time });
        }
    };
    // without `..`: what a chip gets is a difference here or does not compile
    let HardwareSpec {
        cell,
        tile,
        drive,
        adc,
        digital,
        write,
        device,
        timing,
        faults,
        fault_map,
        conductance,
        wires,
        read_noise,
        programming,
        endurance,
        leakage,
        ageing,
    } = &**run;
    let CellSpec { level_bits, window, floor_kind } = cell;
    let TileSpec { rows, columns, count_max: _, transposed_read: _ } = tile;
    let DriveSpec { bits: drive_bits, dac_bits: _ } = drive;
    let DigitalSpec { lut_bits, error_bits } = digital;
    let WriteSpec { increment_max, dither_bits, dither_pattern, residual_bits, scheme } = write;
    differ("tile.rows", *rows != other.tile.rows, DOWN, true);
    differ("tile.columns", *columns != other.tile.columns, ACROSS, true);
    differ("drive.dac_bits", run.slices() != other.slices(), SLICES, true);
    let at_difference = |adc: &Adc| matches!(adc, Adc::Finite { subtract: Subtract::Current, .. });
    differ("adc.subtract", at_difference(adc) != at_difference(&other.adc), BANKS, false);

    differ("cell.level_bits", *level_bits != other.cell.level_bits, LEARNT, true);
    differ("cell.floor", window.floor() != other.cell.window.floor(), LEARNT, true);
    differ("cell.ceiling", window.ceiling() != other.cell.window.ceiling(), LEARNT, true);
    differ("cell.floor_kind", *floor_kind != other.cell.floor_kind, LEARNT, true);
    differ("drive.bits", *drive_bits != other.drive.bits, LEARNT, true);
    differ("adc", *adc != other.adc, LEARNT, true);
    differ("lut.bits", *lut_bits != other.digital.lut_bits, LEARNT, true);
    differ("error.bits", *error_bits != other.digital.error_bits, LEARNT, true);
    differ("write.increment_max", *increment_max != other.write.increment_max, LEARNT, true);
    differ("write.dither_bits", *dither_bits != other.write.dither_bits, LEARNT, true);
    differ("write.dither", *dither_pattern != other.write.dither_pattern, LEARNT, true);
    let remainders = *residual_bits != other.write.residual_bits;
    differ("write.residual_bits", remainders, REMAINDERS, true);
    differ("device.faults", *faults != other.faults, LEARNT, true);
    differ("device.faults.map", *fault_map != other.fault_map, LEARNT, true);
    differ("device.conductance", *conductance != other.conductance, LEARNT, true);
    differ("device.wires", *wires != other.wires, LEARNT, true);
    differ("device.programming", *programming != other.programming, LEARNT, true);
    differ("device.endurance", *endurance != other.endurance, LEARNT, true);
    differ("device.drift.update_s", *ageing != other.ageing, LEARNT, true);
    differ("device.leakage", *leakage != other.leakage, LEARNT, true);
    differ("device.read_noise", *read_noise != other.read_noise, LEARNT, true);
    differ("write.scheme", *scheme != other.write.scheme, SCHEME, true);
    differ("device", *device != other.device, LEARNT, true);

    match (*timing, other.timing) {
        (None, None) => {}
        (Some(a), Some(b)) => {
            let Timing {
                clock_khz: _,
                beat,
                settle,
                convert,
                share,
                overlapped,
                lanes,
                hops,
                pulse,
                pulse_code,
                verify,
                active_max,
                slices,
            } = a;
            differ("timing.settle_cycles", settle != b.settle, &[], true);
            differ("timing.convert_cycles", convert != b.convert, &[], true);
            differ("timing.columns_per_adc", share != b.share, &[], true);
            differ("timing.overlap", overlapped != b.overlapped, &[], true);
            differ("timing.lanes", lanes != b.lanes, &[], true);
            differ("timing.bus_hops", hops != b.hops, &[], true);
            differ("timing.pulse_cycles", pulse != b.pulse, &[], true);
            differ("timing.beat_cycles", beat != b.beat, &[], true);
            differ("timing.pulses", pulse_code != b.pulse_code, PULSES, true);
            differ("timing.verify", verify != b.verify, PULSES, true);
            differ("timing.write_active_max", active_max != b.active_max, PULSES, true);
            // phases of unequal length
            differ("drive.phases", slices != b.slices, &[], true);
        }
        (a, b) => {
            let verified = |timing: Option<Timing>| timing.is_some_and(|timing| timing.verify);
            let events = if verified(a) != verified(b) { PULSES } else { &[Event::RowPulses] };
            differ("timing", true, events, true);
        }
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lab::config::{Sources, load};

    fn hardware(settings: &[&str]) -> Hardware {
        let settings: Vec<String> = settings.iter().map(ToString::to_string).collect();
        load(&Sources { settings: &settings, ..Sources::default() }).unwrap().hardware
    }

    #[test]
    fn every_difference_names_its_key_and_what_it_touches() {
        let run = hardware(&[]);
        assert_eq!(changes(&run, &run), []);
        for (setting, key, event) in [
            ("hw.tile.rows=128", "tile.rows", Some(Event::Conversions)),
            ("hw.tile.columns=128", "tile.columns", Some(Event::DacSlices)),
            ("hw.drive.dac_bits=4", "drive.dac_bits", Some(Event::CellReads)),
            ("hw.cell.level_bits=4", "cell.level_bits", Some(Event::PulsesAttempted)),
            ("hw.timing.lanes=1", "timing.lanes", None),
            ("hw.timing.verify=true", "timing.verify", Some(Event::VerifyReads)),
            ("hw.timing.pulses=amplitude", "timing.pulses", Some(Event::RowPulses)),
        ] {
            let found = changes(&run, &hardware(&[setting]));
            let change = found.iter().find(|c| c.key == key);
            let change = change.unwrap_or_else(|| panic!("{setting}: {found:?}"));
            assert!(change.time && event.is_none_or(|event| change.events.contains(&event)));
        }
        assert_eq!(changes(&run, &hardware(&["hw.timing.clock_mhz=5"])), []);
        let found = changes(&run, &hardware(&["hw.adc.bits=8", "hw.adc.subtract=current"]));
        assert!(found.iter().any(|c| c.key == "adc.subtract" && c.events == BANKS));
        // reads do not depend on what was learnt
        assert!(!LEARNT.contains(&Event::CellReads) && !LEARNT.contains(&Event::Conversions));
    }
}
