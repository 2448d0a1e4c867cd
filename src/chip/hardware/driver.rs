//! What drives cells: pulses of cells that are not ideal, and trains.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use super::{HardwareError, IncrementMax, PulseCode, ResidualBits, Timing, WriteScheme};

/// Pulses of a real cell are equal; where each is looked at, few enough for a byte.
pub(super) fn check_driver(
    timing: Option<Timing>,
    tries: u32,
    increment_max: IncrementMax,
) -> Result<(), HardwareError> {
    let wrong = |key, found: String, allowed: String| Err(HardwareError { key, found, allowed });
    match timing {
        Some(Timing { pulse_code: PulseCode::Amplitude, .. }) => wrong(
            "timing.pulses",
            "is \"amplitude\" beside a device".to_owned(),
            "a response is one to equal pulses: use \"unary\"".to_owned(),
        ),
        Some(Timing { verify: true, .. }) if tries * increment_max.get() > 127 => wrong(
            "device.response.tries",
            format!("is {tries}"),
            format!(
                "a write gives at most 127 verified pulses, and write.increment_max is {}: lower one of them",
                increment_max.get()
            ),
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
