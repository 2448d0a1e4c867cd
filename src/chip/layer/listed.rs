//! Whether the cells that a list of stuck ones names are there.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use super::LayerSpec;
use crate::chip::device::FaultMap;
use crate::chip::hardware::HardwareError;

/// Which of a run's layers are looked at.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Listed {
    /// All of them: what a list names beyond them is nowhere.
    All,
    /// Those of one network of several.
    Some,
}

/// Checks a list against layers and their numbers.
///
/// # Errors
/// When it names a cell that is not there: which, and what there is.
pub fn check_listed<'a>(
    map: &FaultMap,
    layers: impl Iterator<Item = (u16, &'a LayerSpec)>,
    which: Listed,
) -> Result<(), HardwareError> {
    if map.is_empty() {
        return Ok(());
    }
    let layers: Vec<_> = layers.collect();
    for cell in map.cells() {
        let [row, column] = [cell.row, cell.column];
        let wrong = |found: String, allowed: String| {
            let found = format!("names layer {}, row {row}, column {column}{found}", cell.layer);
            Err(HardwareError { key: "device.faults.map", found, allowed })
        };
        let Some((_, spec)) = layers.iter().find(|(number, _)| *number == cell.layer) else {
            if which == Listed::Some {
                continue;
            }
            let numbers: Vec<_> = layers.iter().map(|(number, _)| number.to_string()).collect();
            let allowed = format!(
                "layers with cells are numbered from 0 at the input: {}",
                numbers.join(", ")
            );
            return wrong(String::new(), allowed);
        };
        let pathways = spec.wiring.pathways();
        if !pathways.iter().any(|pathway| pathway.code == cell.pathway) {
            let names: Vec<_> = pathways.iter().map(|pathway| pathway.name).collect();
            let allowed = format!("that layer has the pathways {}", names.join(", "));
            return wrong(format!(" of the pathway with code {}", cell.pathway), allowed);
        }
        let rows = spec.inputs + usize::from(spec.constant_row);
        if row as usize >= rows || column as usize >= spec.units {
            let allowed =
                format!("that layer has {rows} rows and {} columns, counted from 0", spec.units);
            return wrong(String::new(), allowed);
        }
    }
    Ok(())
}
