//! What real cells and converters do that ideal ones do not, as data: functions of a place, drawn when they are needed.
//!
//! One kind is one small file here. A kind knows no array: it is told a place, a size and a window, and gives numbers.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

mod cell;
mod response;

pub use cell::{Device, OwnCell, PulseWords};
pub use response::{CellSpread, DeviceError, DeviceSpec, PulseNoise};
