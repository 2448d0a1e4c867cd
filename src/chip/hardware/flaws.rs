//! What cells and reads may do beside the ideal.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use super::{HardwareError, Window, between};
use crate::chip::device::{
    Ageing, Conductance, DeviceSpec, Endurance, FaultMap, Faults, Leakage, Programming, ReadNoise,
    StuckAt, Wires,
};
use crate::num::fixed::Millionths;
use crate::num::tables::DriftRates;

/// Checks the numbers of each.
pub(super) fn check(
    (faults, map, window): (Faults, &FaultMap, Window),
    (conductance, wires): (Option<Conductance>, Option<Wires>),
    (read_noise, programming): (Option<ReadNoise>, Option<Programming>),
    (endurance, leakage): (Option<Endurance>, Option<Leakage>),
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
    if let Some(Endurance { pulses, spread, worn: _ }) = endurance {
        between("device.endurance.pulses", pulses.into(), [1, u32::MAX.into()])?;
        share("device.endurance.spread", spread, 2)?;
    }
    if let Some(Leakage { lost, every, rest, spread }) = leakage {
        between("device.leakage.lifetime", lost.into(), [1, u32::MAX.into()])?;
        between("device.leakage.every", every.into(), [1, Leakage::EVERY_MAX.into()])?;
        share("device.leakage.rest", rest, 1)?;
        share("device.leakage.spread", spread, 1)?;
    }
    Ok(())
}

/// Checks how levels drift while others are written, and that nothing else moves them then.
pub(super) fn check_ageing(
    ageing: Option<Ageing>,
    leakage: Option<Leakage>,
    device: Option<&DeviceSpec>,
) -> Result<(), HardwareError> {
    let Some(Ageing { rates, since, every }) = ageing else { return Ok(()) };
    between("device.drift.every", every.into(), [1, Ageing::EVERY_MAX.into()])?;
    if since.abs() > Ageing::SINCE_MAX {
        let found = format!("is 2^{} of the start", since >> 16);
        let allowed = "it must lie within 2^100 of device.drift.start_s".to_owned();
        return Err(HardwareError { key: "device.drift.update_s", found, allowed });
    }
    match rates {
        DriftRates::Power(both) => {
            for (key, [slope, offset, least, most]) in
                [("device.drift.exponent", both[0]), ("device.drift.exponent_spread", both[1])]
            {
                [slope, offset]
                    .iter()
                    .try_for_each(|of| share(key, Millionths(of.0.abs()), 100))?;
                [least, most].iter().try_for_each(|of| share(key, *of, 10))?;
                if least.0 > most.0 {
                    let found = format!("has a least of {least} and a most of {most}");
                    let allowed = "the least comes first".to_owned();
                    return Err(HardwareError { key, found, allowed });
                }
            }
        }
        DriftRates::Log([change, spread]) => {
            share("device.drift.change", Millionths(change.0.abs()), 1)?;
            share("device.drift.change_spread", spread, 1)?;
        }
    }
    let beside = match (leakage, device) {
        (Some(_), _) => "device.leakage",
        (_, Some(device)) if device.write_noise.0 != 0 => "device.response.write_noise",
        _ => return Ok(()),
    };
    let found = format!("is given beside {beside}");
    let allowed = "cells drift, leak or hold noise beside what pulses left while they learn, one of them: remove the others";
    Err(HardwareError { key: "device.drift.update_s", found, allowed: allowed.into() })
}

/// A share from 0 to so much.
fn share(key: &'static str, found: Millionths, most: i64) -> Result<(), HardwareError> {
    if (0..=most * 1_000_000).contains(&found.0) {
        return Ok(());
    }
    let allowed = format!("it must lie in 0..={most}");
    Err(HardwareError { key, found: format!("is {found}"), allowed })
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
