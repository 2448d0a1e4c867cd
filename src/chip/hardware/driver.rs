//! What drives cells that are not ideal.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use super::{HardwareError, PulseCode, Timing};

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
