//! What one chip would have done otherwise than another: which counts of its ledger are not the other's.

use crate::chip::hardware::{Adc, Hardware, Subtract, Timing};
use crate::chip::ledger::Event;

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
    differ("tile.rows", run.tile_rows != other.tile_rows, DOWN, true);
    differ("tile.columns", run.tile_columns != other.tile_columns, ACROSS, true);
    differ("drive.dac_bits", run.slices() != other.slices(), SLICES, true);
    let at_difference =
        |h: &Hardware| matches!(h.adc, Adc::Finite { subtract: Subtract::Current, .. });
    differ("adc.subtract", at_difference(run) != at_difference(other), BANKS, false);

    differ("cell.level_bits", run.level_bits != other.level_bits, LEARNT, true);
    differ("cell.floor", run.window.floor() != other.window.floor(), LEARNT, true);
    differ("cell.ceiling", run.window.ceiling() != other.window.ceiling(), LEARNT, true);
    differ("cell.floor_kind", run.floor_kind != other.floor_kind, LEARNT, true);
    differ("drive.bits", run.drive_bits != other.drive_bits, LEARNT, true);
    differ("adc", run.adc != other.adc, LEARNT, true);
    differ("lut.bits", run.lut_bits != other.lut_bits, LEARNT, true);
    differ("error.bits", run.error_bits != other.error_bits, LEARNT, true);
    differ("write.increment_max", run.increment_max != other.increment_max, LEARNT, true);
    differ("write.dither_bits", run.dither_bits != other.dither_bits, LEARNT, true);
    differ("write.dither", run.dither_pattern != other.dither_pattern, LEARNT, true);
    differ("write.residual_bits", run.residual_bits != other.residual_bits, REMAINDERS, true);
    differ("write.scheme", run.scheme != other.scheme, SCHEME, true);

    match (run.timing, other.timing) {
        (None, None) => {}
        (Some(a), Some(b)) => {
            differ("timing.settle_cycles", a.settle != b.settle, &[], true);
            differ("timing.convert_cycles", a.convert != b.convert, &[], true);
            differ("timing.columns_per_adc", a.share != b.share, &[], true);
            differ("timing.overlap", a.overlapped != b.overlapped, &[], true);
            differ("timing.lanes", a.lanes != b.lanes, &[], true);
            differ("timing.bus_hops", a.hops != b.hops, &[], true);
            differ("timing.pulse_cycles", a.pulse != b.pulse, &[], true);
            differ("timing.beat_cycles", a.beat != b.beat, &[], true);
            differ("timing.pulses", a.pulse_code != b.pulse_code, PULSES, true);
            differ("timing.verify", a.verify != b.verify, PULSES, true);
            differ("timing.write_active_max", a.active_max != b.active_max, PULSES, true);
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
