//! What cells and reads may do beside the ideal.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use super::{HardwareError, Window, between};
use crate::chip::device::{Conductance, FaultMap, Faults, Programming, ReadNoise, StuckAt, Wires};

/// Checks the numbers of each.
pub(super) fn check(
    (faults, map, window): (Faults, &FaultMap, Window),
    (conductance, wires): (Option<Conductance>, Option<Wires>),
    (read_noise, programming): (Option<ReadNoise>, Option<Programming>),
) -> Result<(), HardwareError> {
    if faults.total() > 1 << 32 {
        let found = "make more than all cells".to_owned();
        let allowed = "the shares of stuck cells add up to at most 1".to_owned();
        return Err(HardwareError { key: "device.faults", found, allowed });
    }
    check_listed(map, window)?;
    if let Some(Conductance { least, reference: _ }) = conductance {
        let most = u64::from(Conductance::LEAST_MAX);
        between("device.conductance.on_off", least.into(), [1, most])?;
    }
    if let Some(Wires { segment }) = wires {
        between("device.wires.segment_ohm", segment, [1, Wires::SEGMENT_MAX])?;
    }
    if let Some(Programming { coefficients }) = programming {
        let most = Programming::COEFFICIENT_MAX;
        if let Some(c) = coefficients.iter().find(|c| c.abs() > most) {
            let found = format!("has {c} of 2^24");
            let allowed = "a coefficient is at most four times the greatest conductance".into();
            return Err(HardwareError { key: "device.programming.sigma", found, allowed });
        }
    }
    if let Some(ReadNoise { sigma }) = read_noise {
        let most = u64::from(ReadNoise::SIGMA_MAX);
        between("device.read_noise.sigma_cells", sigma.into(), [1, most])?;
    }
    Ok(())
}

/// Listed cells hold a level of the window.
fn check_listed(map: &FaultMap, window: Window) -> Result<(), HardwareError> {
    let levels = window.floor()..=window.ceiling();
    let outside = map.cells().iter().find_map(|cell| match cell.at {
        StuckAt::Level(level) if !levels.contains(&level) => Some((cell, level)),
        _ => None,
    });
    let Some((cell, level)) = outside else { return Ok(()) };
    let [row, column] = [cell.row, cell.column];
    Err(HardwareError {
        key: "device.faults.map",
        found: format!(
            "has a cell at level {level} (layer {}, row {row}, column {column})",
            cell.layer
        ),
        allowed: format!(
            "a stuck cell holds a level of the window, {}..={}",
            window.floor(),
            window.ceiling()
        ),
    })
}
