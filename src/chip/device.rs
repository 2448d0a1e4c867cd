//! What real cells and converters do that ideal ones do not, as data: functions of a place, drawn when they are needed.
//!
//! One kind is one small file here. A kind knows no array: it is told a place, a size and a window, and gives numbers.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

mod cell;
mod conductance;
mod drift;
mod endurance;
mod fault_map;
mod faults;
mod leakage;
mod memory;
mod programming;
mod read_noise;
mod response;

pub use cell::{Device, DeviceLanes, OwnCell, PLACES, PulseWords, Verified};
pub use conductance::{CONDUCTANCE_BITS, Conductance, Conducting, LetThrough, Reference, Wires};
pub use drift::{Ageing, Ages};
pub use endurance::{Endurance, Limits, Worn};
pub use fault_map::{FaultMap, ListedCell, StuckAt};
pub use faults::{Chance, Faults, StuckCell};
pub use leakage::{Leakage, Leaks};
pub use memory::{MemoryLaw, WriteNoise};
pub use programming::{Programming, cell_words};
pub use read_noise::{Direction, Noise, NoisePlace, ReadNoise};
pub use response::{CellSpread, DeviceError, DeviceSpec, PulseNoise};
