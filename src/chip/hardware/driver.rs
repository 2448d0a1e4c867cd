//! What drives cells: pulses of cells that are not ideal, and trains.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use super::{HardwareError, IncrementMax, PulseCode, ResidualBits, Timing, WriteScheme};

/// Pulses of a real cell are equal, and what they did is not looked at.
pub(super) fn check_driver(timing: Option<Timing>) -> Result<(), HardwareError> {
    let wrong = |key, found: &str, allowed: &str| {
        let (found, allowed) = (found.to_owned(), allowed.to_owned());
        Err(HardwareError { key, found, allowed })
    };
    match timing {
        Some(Timing { verify: true, .. }) => wrong(
            "timing.verify",
            "is true beside a device",
            "verified pulses are always right, which those of a device are not: leave one of them out",
        ),
        Some(Timing { pulse_code: PulseCode::Amplitude, .. }) => wrong(
            "timing.pulses",
            "is \"amplitude\" beside a device",
            "a response is one to equal pulses: use \"unary\"",
        ),
        _ => Ok(()),
    }
}

/// Coincidences of trains: at most a pulse a slot, all lines at once, nothing left over.
pub(super) fn check_trains(
    slots_log2: u32,
    increment_max: IncrementMax,
    residual_bits: ResidualBits,
    timing: Option<Timing>,
) -> Result<(), HardwareError> {
    let wrong = |key, found: String, allowed: String| Err(HardwareError { key, found, allowed });
    let most = WriteScheme::SLOTS_MAX.min(increment_max.get());
    if 1u64 << slots_log2.min(63) > u64::from(most) {
        let allowed = format!(
            "a power of two in 1..={most}: a cell gets at most one pulse a slot, and write.increment_max is {}",
            increment_max.get()
        );
        return wrong("write.train_slots", format!("is 2^{slots_log2}"), allowed);
    }
    if residual_bits.get() != 0 {
        let allowed = "coincidences of trains have no remainder; set it to 0".to_owned();
        return wrong("write.residual_bits", "is not 0".to_owned(), allowed);
    }
    let plain = |timing: Timing| {
        !timing.verify && timing.active_max.is_none() && timing.pulse_code == PulseCode::Unary
    };
    if timing.is_some_and(|timing| !plain(timing)) {
        let found = "is \"rank1\" beside verified, limited or amplitude-coded pulses".to_owned();
        let allowed = "all rows and columns fire at once: leave out timing.verify, timing.write_active_max and \
                       timing.pulses, or use write.scheme = \"rounded\"";
        return wrong("write.scheme", found, allowed.to_owned());
    }
    Ok(())
}
