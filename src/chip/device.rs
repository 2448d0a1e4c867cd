//! What real cells and converters do that ideal ones do not, as data: functions of a place, drawn when they are needed.
//!
//! One kind is one small file here. A kind knows no array: it is told a place, a size and a window, and gives numbers.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

mod cell;
mod drift;
mod faults;
mod programming;
mod read_noise;
mod response;

pub use cell::{Device, DeviceLanes, OwnCell, PLACES, PulseWords};
pub use faults::{Chance, Faults, StuckCell};
pub use programming::{Programming, cell_words};
pub use read_noise::{Direction, Noise, NoisePlace, ReadNoise};
pub use response::{CellSpread, DeviceError, DeviceSpec, PulseNoise};
