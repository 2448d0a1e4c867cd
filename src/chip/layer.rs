//! A dense layer: its arrays, its table, how errors reach it and its converters; and the plan that proves it fits.
//!
//! Layers with cells are numbered from 0 at the input. A layer of K inputs and N units is one unsigned K x N array a
//! pathway, cut into tiles of `tile_rows` x `tile_columns`. A constant row, if any, is the last row. See
//! docs/MODEL.md, 1.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use std::ops::Range;
use std::sync::Arc;

use super::crossbar::Crossbar;
use super::crossbar::kernel::{ConvShape, LookUp};
use super::crossbar::layout::Layout;
use super::device::{Device, MemoryLaw};
use super::hardware::{Adc, AdcRange, Hardware};
use super::periphery;
use super::population::{Stream, Wiring};
use crate::num::draw::{Place, Site};
use crate::num::fixed::DriveBits;
use crate::num::tables::{Activation, FullDrive, Lut, Unit};

mod delivery;
pub mod homeostasis;
mod listed;
pub mod requests;
mod stage;
mod state;

pub use delivery::{Delivery, Taps, WordSource};
pub use homeostasis::{Balance, Readings};
pub use listed::{Listed, check_listed};
pub use requests::{Followed, Optimiser, Requests};
pub use stage::{Gain, Homeostasis, Pool};

/// Whose codes are on the rows of an array.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum DrivenBy {
    /// One set of drives, for both streams: data.
    Shared,
    /// The same, of data with a sign: each row has a code for what is above 0 and one for what is below, and is driven with
    /// one after the other.
    Signed,
    /// A set for each stream: activities of the array before.
    Streams,
    /// A set for each stream: normalised activities of the array before, of which code 32 is 1.
    Normalised,
}

impl DrivenBy {
    /// What code 255 stands for.
    #[must_use]
    pub const fn full_drive(self) -> FullDrive {
        match self {
            Self::Shared | Self::Signed | Self::Streams => FullDrive::One,
            Self::Normalised => FullDrive::Normalised,
        }
    }

    /// Whether both streams have the same drives.
    #[must_use]
    pub const fn is_shared(self) -> bool {
        matches!(self, Self::Shared | Self::Signed)
    }

    /// How often rows are driven for a read: once, or with what is above 0 and then with what is below.
    #[must_use]
    pub const fn phases(self) -> usize {
        if matches!(self, Self::Signed) { 2 } else { 1 }
    }
}

/// What a layer is made of. A network is a list of stages, input to output; an array, which is a layer, is the only
/// kind there is.
#[derive(Debug, Clone, PartialEq)]
pub struct LayerSpec {
    /// Units of the layer below, or features; of a convolution the codes of its window. Without the constant row.
    pub inputs: usize,
    /// Units of each target stream; of a convolution its channels.
    pub units: usize,
    /// How the arrays are wired.
    pub wiring: Wiring,
    /// Whose codes drive the rows.
    pub driven_by: DrivenBy,
    /// Function of the units.
    pub activation: Activation,
    /// `log2(weight_max)`.
    pub weight_max_log2: i32,
    /// How initial levels are drawn.
    pub initial: InitialLevels,
    /// Whether a constant row is driven at full code.
    pub constant_row: bool,
    /// The window that moves over the image below; none of a dense layer.
    pub convolution: Option<ConvShape>,
    /// How often its arrays stand on the chip, to read as many positions of a convolution at a time; 1 of a dense layer.
    pub copies: usize,
    /// What lies between its units and what they drive.
    pub pool: Pool,
    /// What its units do beside their table.
    pub homeostasis: Homeostasis,
}

/// How the levels of a new layer are drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum InitialLevels {
    /// Evenly between 0 and a greatest level.
    Uniform {
        /// Gain of excitatory and of inhibitory arrays, in 64ths.
        gain_64ths: [u32; 2],
    },
    /// The absolute value of a Gaussian, of excitatory and inhibitory arrays alike.
    AbsGaussian {
        /// Gain, as numerator and denominator, of a width of `1 / sqrt(2 fan_in)`.
        gain: [u32; 2],
    },
}

impl LayerSpec {
    /// The stream whose set of drives stands on the rows that `source` drives.
    #[must_use]
    pub const fn drives_of(&self, source: Stream) -> Stream {
        match self.driven_by {
            DrivenBy::Shared | DrivenBy::Signed => Stream::P,
            DrivenBy::Streams | DrivenBy::Normalised => source,
        }
    }

    /// Streams that have a set of drives of their own.
    #[must_use]
    pub const fn drive_sets(&self) -> &'static [Stream] {
        match self.driven_by {
            DrivenBy::Shared | DrivenBy::Signed => &[Stream::P],
            DrivenBy::Streams | DrivenBy::Normalised => self.wiring.sources(),
        }
    }

    /// Whether what a sample of `below` hands on is what one of this layer takes.
    pub(crate) fn meets(&self, below: &Self) -> bool {
        match self.convolution {
            None => self.inputs == below.sample_outputs(),
            Some(shape) => {
                shape.channels == below.units && [shape.height, shape.width] == below.pooled()
            }
        }
    }

    /// Whether the units of `below` can drive this array.
    #[must_use]
    pub fn follows(&self, below: &Self) -> bool {
        let given = below.wiring.targets();
        self.meets(below) && self.drive_sets().iter().all(|set| given.contains(set))
    }
}

/// A plan that cannot be built on this chip.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum PlanError {
    /// Too many physical tiles.
    #[error(
        "the network needs {needed} tiles of {rows} x {columns} (layer by layer: {by_layer}), but the chip has \
         {allowed}; raise `hw.tile.count`, use larger tiles or a smaller network"
    )]
    Tiles {
        /// Tiles needed.
        needed: usize,
        /// Rows of a tile.
        rows: usize,
        /// Columns of a tile.
        columns: usize,
        /// Tiles of each layer.
        by_layer: String,
        /// Tiles the chip has.
        allowed: usize,
    },
    /// A layer beyond what words and addresses can number.
    #[error("layer {layer} is {rows} x {columns}; at most {max} rows and columns are supported")]
    Size {
        /// Which layer.
        layer: usize,
        /// Its rows.
        rows: usize,
        /// Its columns.
        columns: usize,
        /// Greatest number of either.
        max: usize,
    },
    /// More layers than addresses.
    #[error("the network has {found} layers; 1 to {max} are supported")]
    Layers {
        /// Layers found.
        found: usize,
        /// Greatest number.
        max: usize,
    },
}

/// Rows and columns an array may have: addresses of draws and taps stay inside their fields.
pub const SIDE_MAX: usize = 65_535;
/// Layers a network may have.
pub const LAYERS_MAX: usize = 64;
/// Blocks of 64 rows whose products of two bytes an `i32` holds for certain: 512 x 64 x 255 x 255 < 2^31.
pub const CHUNK_BLOCKS: usize = 512;
const _: () =
    assert!(CHUNK_BLOCKS * 64 * 255 * 255 < 1 << 31, "a chunk of full bytes fits 32 bits");

/// A layer on the chip.
#[derive(Debug, Clone)]
pub struct Layer {
    /// Number in draws, ledger and hash.
    pub index: u16,
    /// What it is made of.
    pub spec: LayerSpec,
    /// Size of each array.
    pub layout: Layout,
    /// Activation and derivative.
    pub lut: Lut,
    /// How errors reach it.
    pub delivery: Delivery,
    /// The arrays, in the order of [`Wiring::pathways`].
    pub arrays: Vec<Crossbar>,
    /// Writes each array has had.
    pub writes: Vec<u64>,
    /// Converter shifts by target stream and slice; empty with ideal converters.
    pub adc_shifts: Vec<Vec<u32>>,
    /// Of converters that track, by target stream and slice: codes on the rail, and all codes, of training since ranges
    /// were last looked at. Empty where none track.
    pub rails: Vec<Vec<[u64; 2]>>,
    /// Thresholds and step of its units.
    pub balance: Balance,
    /// How its sums become requests.
    pub requests: Requests,
}

impl Layer {
    /// Makes its cells of a device, those of a seed.
    pub(crate) fn fit(&mut self, device: &Arc<Device>, seed: u64) {
        let pathways = self.spec.wiring.pathways();
        for (array, pathway) in self.arrays.iter_mut().zip(pathways) {
            let (layer, pathway) = (self.index, pathway.code);
            let place = Place { layer, pathway, ..Place::global(seed, Site::Variation, 0) };
            array.fit(Arc::clone(device), place);
        }
    }

    /// Its cells remember from now on what a law says, of a chip of a seed.
    pub(crate) fn remember(&mut self, law: &Arc<MemoryLaw>, seed: u64) {
        let pathways = self.spec.wiring.pathways();
        for (array, pathway) in self.arrays.iter_mut().zip(pathways) {
            let (layer, pathway) = (self.index, pathway.code);
            let place = Place { layer, pathway, ..Place::global(seed, Site::Variation, 0) };
            array.remember(law, place);
        }
    }

    /// A layer with every cell on the floor.
    #[must_use]
    pub fn new(
        index: u16,
        spec: LayerSpec,
        delivery: impl Into<Delivery>,
        hardware: &Hardware,
    ) -> Self {
        let delivery = delivery.into();
        let rows = spec.inputs + usize::from(spec.constant_row);
        let layout = Layout { rows, columns: spec.units };
        let lut = Lut::new(spec.activation, hardware.digital.lut_bits, unit(&spec, hardware));
        let arrays: Vec<_> =
            spec.wiring.pathways().iter().map(|_| Crossbar::new(layout, hardware)).collect();
        let adc_shifts = match hardware.adc {
            Adc::Ideal => vec![],
            Adc::Finite { bits, subtract, range } => {
                let shift = match range {
                    AdcRange::Shift(shift) => shift,
                    AdcRange::Full | AdcRange::Calibrated { .. } | AdcRange::Tracking => {
                        hardware.full_shift(bits, subtract, rows.min(hardware.tile.rows))
                    }
                };
                vec![vec![shift; hardware.slices() as usize]; spec.wiring.targets().len()]
            }
        };
        let tracks = matches!(hardware.adc, Adc::Finite { range: AdcRange::Tracking, .. });
        let no_rail = |shifts: &Vec<u32>| vec![[0; 2]; shifts.len()];
        let rails = if tracks { adc_shifts.iter().map(no_rail).collect() } else { vec![] };
        let writes = vec![0; arrays.len()];
        let requests = Requests::PLAIN;
        let balance = Balance::new(&spec, hardware.digital.lut_bits, lut.shift);
        Self {
            index,
            spec,
            layout,
            lut,
            delivery,
            arrays,
            writes,
            adc_shifts,
            rails,
            balance,
            requests,
        }
    }

    /// The table as kernels take it: what a unit hands on is its activity or, with `drive_bits`, the drive code of
    /// the next layer.
    #[must_use]
    pub fn look_up(&self, drive_bits: Option<DriveBits>) -> LookUp {
        let entries = self.lut.activity.iter().zip(&self.lut.derivative).map(|(&a, &slope)| {
            let value = drive_bits.map_or(a, |bits| periphery::drive(a, bits));
            u32::from_le_bytes([value, slope, 0, 0])
        });
        LookUp { entries: entries.collect(), shift: self.lut.shift }
    }

    /// Words that a unit latches of a sample, one after the other: one, or one a pixel behind the pool where they come from
    /// the rows of the layer above.
    #[must_use]
    pub fn heard(&self) -> usize {
        match self.delivery.source {
            WordSource::Above => self.spec.pooled().into_iter().product(),
            _ => 1,
        }
    }

    /// What row sums of its transposed read are shifted by to become words of the layer below; to the left where it is
    /// negative.
    ///
    /// ```text
    /// table     level_bits - log2(weight_max) + 8 - error_bits                     a level is worth weight_max / 2^level_bits
    /// gain      lut_bits - 3 + lsh - (drive_bits - 2) - g + 8 - error_bits         so is the slope of a ramp, of which 85 is 2^6
    /// g         least number >= 0 with 4^g units >= inputs                         of a window channels stride^2 inputs
    /// ```
    #[must_use]
    pub fn back_shift(&self, hardware: &Hardware) -> i64 {
        let widths = [hardware.digital.lut_bits.get(), hardware.drive.bits.get()].map(i64::from);
        let worth = match self.spec.homeostasis.gain {
            Gain::Table => {
                i64::from(hardware.cell.level_bits.get()) - i64::from(self.spec.weight_max_log2)
            }
            Gain::Fixed { .. } | Gain::Tracking => {
                let evened = i64::from(self.spec.back_gain_log2());
                widths[0] - 3 + i64::from(self.balance.shift()) - (widths[1] - 2) - evened
            }
        };
        worth + 8 - i64::from(hardware.digital.error_bits.get())
    }

    /// Rows of each tile of a column, top to bottom.
    pub fn row_tiles(&self, hardware: &Hardware) -> impl Iterator<Item = Range<usize>> + use<> {
        let (rows, step) = (self.layout.rows, hardware.tile.rows);
        (0..rows).step_by(step).map(move |start| start..(start + step).min(rows))
    }

    /// Tiles of one array: down, across.
    #[must_use]
    pub fn tiles(&self, hardware: &Hardware) -> [usize; 2] {
        tiles(self.layout, hardware)
    }
}

/// What one accumulator unit of a layer stands for.
#[must_use]
pub fn unit(spec: &LayerSpec, hardware: &Hardware) -> Unit {
    Unit {
        weight_max_log2: spec.weight_max_log2,
        level_bits: hardware.cell.level_bits,
        drive_bits: hardware.drive.bits,
        full_drive: spec.driven_by.full_drive(),
    }
}

fn tiles(layout: Layout, hardware: &Hardware) -> [usize; 2] {
    [layout.rows.div_ceil(hardware.tile.rows), layout.columns.div_ceil(hardware.tile.columns)]
}

/// Tiles of a layer in words, and how many copies there are of them.
fn of_copies((tiles, copies): (usize, usize)) -> String {
    match copies {
        1 => tiles.to_string(),
        _ => format!("{tiles} x {copies} copies"),
    }
}

/// Proves that a network fits: addresses, words and physical tiles. A tile holds two banks of one target.
///
/// # Errors
/// When it does not, with what is needed and what there is.
pub fn check(specs: &[LayerSpec], hardware: &Hardware) -> Result<(), PlanError> {
    if !(1..=LAYERS_MAX).contains(&specs.len()) {
        return Err(PlanError::Layers { found: specs.len(), max: LAYERS_MAX });
    }
    let mut by_layer = Vec::new();
    for (layer, spec) in specs.iter().enumerate() {
        let layout =
            // a sum that saturates is refused as too many
            Layout {
                rows: spec.inputs.saturating_add(usize::from(spec.constant_row)),
                columns: spec.units,
            };
        let Layout { rows, columns } = layout;
        if !(1..=SIDE_MAX).contains(&rows) || !(1..=SIDE_MAX).contains(&columns) {
            return Err(PlanError::Size { layer, rows, columns, max: SIDE_MAX });
        }
        let [down, across] = tiles(layout, hardware);
        let tiles = down * across * spec.wiring.planes().count();
        by_layer.push((tiles, spec.copies.max(1)));
    }
    // a product that saturates is refused as too many
    let all = by_layer.iter().map(|&(tiles, copies)| tiles.saturating_mul(copies));
    let needed = all.fold(0, usize::saturating_add);
    match hardware.tile.count_max {
        Some(allowed) if needed > allowed => Err(PlanError::Tiles {
            needed,
            rows: hardware.tile.rows,
            columns: hardware.tile.columns,
            by_layer: by_layer.into_iter().map(of_copies).collect::<Vec<_>>().join(" + "),
            allowed,
        }),
        _ => Ok(()),
    }
}
