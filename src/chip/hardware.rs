//! What a chip is, as checked numbers. A hardware model file becomes one of these at the door.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use super::device::{
    Ageing, CONDUCTANCE_BITS, Conductance, DeviceError, DeviceSpec, Endurance, FaultMap, Faults,
    Leakage, Programming, ReadNoise, Reference, Wires,
};
use crate::num::fixed::{
    AdcBits, DriveBits, ErrorBits, IncrementMax, LevelBits, LutBits, OutOfRange, ResidualBits, rsh,
};

mod cells;
pub mod converter;
mod driver;
mod flaws;
pub mod read_time;
pub mod timing;

pub use converter::ConverterKind;
pub(crate) use read_time::ReadTime;
pub use read_time::{SliceTime, SliceTimes};
pub use timing::{PulseCode, Timing};

/// The programming window of a cell: `floor < ceiling <= level_max`.
///
/// ```
/// use dalean::hardware::{LevelBits, Window};
///
/// let bits = LevelBits::new(4)?;
/// let window = Window::new(2, 15, bits)?;
/// assert_eq!((window.floor(), window.ceiling()), (2, 15));
/// assert_eq!(Window::new(2, 16, bits).unwrap_err().to_string(), "`ceiling` is 16, but must lie in 1..=15");
/// # Ok::<(), dalean::hardware::OutOfRange>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Window {
    floor: u16,
    ceiling: u16,
}

impl Window {
    /// Checks the two ends against the width of a level and against each other.
    ///
    /// # Errors
    /// When `ceiling` does not fit `bits` or `floor` is not below it.
    pub fn new(floor: i64, ceiling: i64, bits: LevelBits) -> Result<Self, OutOfRange> {
        let max = i64::from(bits.level_max());
        let outside = |name, found, min, max| OutOfRange { name, found, min, max };
        let ceiling = u16::try_from(ceiling)
            .ok()
            .filter(|&c| c >= 1 && i64::from(c) <= max)
            .ok_or_else(|| outside("ceiling", ceiling, 1, max))?;
        let floor = u16::try_from(floor)
            .ok()
            .filter(|&f| f < ceiling)
            .ok_or_else(|| outside("floor", floor, 0, i64::from(ceiling) - 1))?;
        Ok(Self { floor, ceiling })
    }

    /// Least level.
    #[must_use]
    pub const fn floor(self) -> u16 {
        self.floor
    }

    /// Greatest level.
    #[must_use]
    pub const fn ceiling(self) -> u16 {
        self.ceiling
    }
}

/// What happens to a cell on the floor.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FloorKind {
    /// Positive pulses lift it.
    Recoverable,
    /// A cell that received pulses in a write and lies on the floor after it stays there for good.
    Absorbing,
}

/// Where a column's current becomes a number.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Adc {
    /// Lossless.
    Ideal,
    /// `bits` wide, one step is `2^ash` units of current.
    Finite {
        /// Resolution.
        bits: AdcBits,
        /// Whether banks are converted each, or their difference.
        subtract: Subtract,
        /// Where `ash` comes from.
        range: AdcRange,
    },
}

/// Where the inhibitory bank is subtracted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Subtract {
    /// Each bank is converted; codes are subtracted.
    Digital,
    /// Currents are subtracted; the difference is converted once.
    Current,
}

/// Where the shift of a converter's step comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum AdcRange {
    /// Given.
    Shift(u32),
    /// The worst case never saturates.
    Full,
    /// As calibrated with a headroom of [`AdcRange::TRACKING_HEADROOM`]; then the shift grows with the currents.
    Tracking,
    /// From the first 256 training samples, read with ideal converters.
    Calibrated {
        /// Shift added to the one found.
        headroom: u32,
        /// Whether it is found again before each epoch.
        every_epoch: bool,
    },
}

impl AdcRange {
    /// Headroom with which tracking begins.
    pub const TRACKING_HEADROOM: u32 = 1;
    /// One conversion in so many may lie on the rail; where more do, a tracking converter takes a greater step.
    pub const TRACKING_RARE: u64 = 64;
    /// Samples written one by one, after which tracking converters are looked at.
    pub const TRACKING_SAMPLES: u64 = 64;
}

/// Fractional random bits of a rounding.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DitherBits {
    /// Half-up, no draw.
    Zero,
    /// One byte a cell.
    Eight,
    /// Two bytes a cell.
    Sixteen,
}

impl DitherBits {
    /// The number of bits.
    #[must_use]
    pub const fn get(self) -> u32 {
        match self {
            Self::Zero => 0,
            Self::Eight => 8,
            Self::Sixteen => 16,
        }
    }
}

/// Where a cell's dither word comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DitherPattern {
    /// Its own word.
    PerCell,
    /// Word of the row XOR word of the column.
    Separable,
}

/// How a write turns sums into pulses.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum WriteScheme {
    /// Sums are rounded with a draw and bounded.
    Rounded,
    /// Rank 1, one sample at a time: rows and columns fire random trains, and a cell is pulsed where both fire.
    Trains {
        /// `log2` of the slots of a train.
        slots_log2: u32,
    },
}

impl WriteScheme {
    /// Slots of a train, at most.
    pub const SLOTS_MAX: u32 = 64;
}

/// Cells.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CellSpec {
    /// Bits of a stored level.
    pub level_bits: LevelBits,
    /// Programming window.
    pub window: Window,
    /// What the floor does.
    pub floor_kind: FloorKind,
}

/// Physical arrays.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TileSpec {
    /// Rows of a tile.
    pub rows: usize,
    /// Columns of a tile.
    pub columns: usize,
    /// Tiles the chip has; `None` is as many as it takes.
    pub count_max: Option<usize>,
    /// Whether a tile can be read from its columns.
    pub transposed_read: bool,
}

impl TileSpec {
    /// Rows or columns of a tile, at most: products of one tile of full bytes fit 31 bits.
    pub const SIDE_MAX: usize = 32_768;
}

/// Row drivers.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct DriveSpec {
    /// Bits of a drive code.
    pub bits: DriveBits,
    /// Bits a row DAC puts on a row at a time.
    pub dac_bits: u32,
}

/// Digital logic beside the arrays.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct DigitalSpec {
    /// Bits of the activation table's index.
    pub lut_bits: LutBits,
    /// Bits of an error word.
    pub error_bits: ErrorBits,
}

/// Programming.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct WriteSpec {
    /// Bound of the pulses a write gives a cell.
    pub increment_max: IncrementMax,
    /// Dither of stochastic rounding.
    pub dither_bits: DitherBits,
    /// Where dither words come from.
    pub dither_pattern: DitherPattern,
    /// Fractional bits of the digital remainder behind a cell.
    pub residual_bits: ResidualBits,
    /// How sums become pulses.
    pub scheme: WriteScheme,
}

/// The parts of a chip. Lengths are in cells, widths in bits. [`Hardware::new`] checks how they fit together.
///
/// ```
/// use dalean::hardware::{FloorKind, WriteScheme};
/// use dalean::{Hardware, HardwareSpec};
///
/// let mut parts: HardwareSpec = Hardware::reference().into_spec();
/// parts.cell.floor_kind = FloorKind::Absorbing;
/// parts.write.scheme = WriteScheme::Trains { slots_log2: 2 };
/// let chip = Hardware::new(parts)?;
/// assert_eq!((chip.cell.floor_kind, chip.slices()), (FloorKind::Absorbing, 1));
/// # Ok::<(), dalean::HardwareError>(())
/// ```
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct HardwareSpec {
    /// Cells.
    pub cell: CellSpec,
    /// Physical arrays.
    pub tile: TileSpec,
    /// Row drivers.
    pub drive: DriveSpec,
    /// Column converters.
    pub adc: Adc,
    /// Digital logic beside the arrays.
    pub digital: DigitalSpec,
    /// Programming.
    pub write: WriteSpec,
    /// What cells are made of; `None`: ideal ones, which a pulse moves by a level.
    pub device: Option<DeviceSpec>,
    /// Cycles of what a tile does; `None`: no cycles are counted.
    pub timing: Option<Timing>,
    /// Cells that are stuck.
    pub faults: Faults,
    /// Cells that are stuck by a list.
    pub fault_map: FaultMap,
    /// What level 0 conducts; `None`: nothing.
    pub conductance: Option<Conductance>,
    /// Resistance of wires; `None`: none.
    pub wires: Option<Wires>,
    /// What conversions are off by; `None`: nothing.
    pub read_noise: Option<ReadNoise>,
    /// What loads leave beside a level; `None`: nothing.
    pub programming: Option<Programming>,
    /// How many pulses cells take; `None`: any number.
    pub endurance: Option<Endurance>,
    /// How cells forget; `None`: they do not.
    pub leakage: Option<Leakage>,
    /// How levels drift while others are written; `None`: a training takes no time in which they do.
    pub ageing: Option<Ageing>,
}

/// Parts that make no chip.
///
/// ```
/// use dalean::Hardware;
///
/// let error = Hardware::reference().with(|parts| parts.drive.dac_bits = 9).unwrap_err();
/// assert_eq!(error.key, "drive.dac_bits");
/// assert_eq!(error.to_string(), "`drive.dac_bits` is 9; it must lie in 1..=8");
/// ```
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("`{key}` {found}; {allowed}")]
#[non_exhaustive]
pub struct HardwareError {
    /// The key of a hardware model.
    pub key: &'static str,
    /// What was found.
    pub found: String,
    /// What is allowed and what to try.
    pub allowed: String,
}

/// A chip whose parts were checked. Its [`HardwareSpec`] can be read, but not changed.
///
/// ```
/// use dalean::Hardware;
///
/// let chip = Hardware::reference();
/// let tall = chip.with(|parts| parts.tile.rows = 1024)?;
/// assert_eq!((chip.tile.rows, tall.tile.rows), (256, 1024));
/// # Ok::<(), dalean::HardwareError>(())
/// ```
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Hardware(HardwareSpec);

impl std::ops::Deref for Hardware {
    type Target = HardwareSpec;

    fn deref(&self) -> &HardwareSpec {
        &self.0
    }
}

/// A number between two ends, or what is wrong with it.
fn between(key: &'static str, found: u64, [min, max]: [u64; 2]) -> Result<(), HardwareError> {
    if (min..=max).contains(&found) {
        return Ok(());
    }
    let allowed = format!("it must lie in {min}..={max}");
    Err(HardwareError { key, found: format!("is {found}"), allowed })
}

impl Hardware {
    /// Checks that parts make a chip.
    ///
    /// # Errors
    /// When a number lies outside what a chip of this kind can have, or parts contradict one another.
    pub fn new(spec: HardwareSpec) -> Result<Self, HardwareError> {
        // without `..`: a new part is checked here or does not compile
        let HardwareSpec {
            cell,
            tile,
            drive,
            adc,
            digital,
            write,
            device,
            timing,
            faults,
            fault_map,
            conductance,
            wires,
            read_noise,
            programming,
            endurance,
            leakage,
            ageing,
        } = &spec;
        let CellSpec { level_bits, window, floor_kind: _ } = cell;
        let TileSpec { rows, columns, count_max, transposed_read: _ } = tile;
        let DriveSpec { bits: drive_bits, dac_bits } = drive;
        let DigitalSpec { lut_bits: _, error_bits: _ } = digital;
        let WriteSpec { increment_max, dither_bits: _, dither_pattern: _, residual_bits, scheme } =
            write;
        let side_max = TileSpec::SIDE_MAX as u64;
        let level_max = u64::from(level_bits.level_max());
        between("cell.ceiling", window.ceiling().into(), [1, level_max])?;
        between("tile.rows", *rows as u64, [1, side_max])?;
        between("tile.columns", *columns as u64, [1, side_max])?;
        if let Some(count) = count_max {
            between("tile.count", *count as u64, [1, 1 << 30])?;
        }
        between("drive.dac_bits", (*dac_bits).into(), [1, drive_bits.get().into()])?;
        if let Adc::Finite { range, .. } = adc {
            match *range {
                AdcRange::Shift(shift) => between("adc.range", shift.into(), [0, 40])?,
                AdcRange::Calibrated { headroom, every_epoch: _ } => {
                    between("adc.headroom", headroom.into(), [0, 16])?;
                }
                AdcRange::Full | AdcRange::Tracking => {}
            }
        }
        if let Some(timing) = timing {
            timing.check()?;
            let slices = drive_bits.get().div_ceil(*dac_bits);
            let listed = timing.slices.map_or(u64::from(slices), |own| own.iter().len() as u64);
            if listed != u64::from(slices) {
                let found = format!("are {listed}");
                let allowed = format!("a drive code of this chip is read in {slices}");
                return Err(HardwareError { key: "timing.slices", found, allowed });
            }
        }
        if let Some(device) = device {
            let wrong = |DeviceError { key, found, allowed }| HardwareError { key, found, allowed };
            device.check().map_err(wrong)?;
        }
        if device.is_some() || endurance.is_some() || ageing.is_some() {
            let tries = device.as_ref().map_or(1, |device| device.tries);
            driver::check_driver(*timing, tries, *increment_max)?;
        }
        if let WriteScheme::Trains { slots_log2 } = *scheme {
            driver::check_trains(slots_log2, *increment_max, *residual_bits, *timing)?;
        }
        flaws::check(
            (*faults, fault_map, *window),
            (*conductance, *wires),
            (*read_noise, *programming),
            (*endurance, *leakage),
        )?;
        flaws::check_ageing(*ageing, *leakage, device.as_ref())?;
        Ok(Self(spec))
    }

    /// The ideal chip that tests and examples start from: 8-bit levels over their whole range, drives, words and dither
    /// of 8 bits, tables of 10, tiles of 256 x 256 that can be read backwards, ideal converters, at most 7 pulses a
    /// write, no remainders and no time.
    ///
    /// ```
    /// use dalean::hardware::TileSpec;
    /// use dalean::{Hardware, HardwareSpec};
    ///
    /// let HardwareSpec { tile, .. } = Hardware::reference().into_spec();
    /// let spec = HardwareSpec {
    ///     tile: TileSpec { rows: 40_000, ..tile },
    ///     ..Hardware::reference().into_spec()
    /// };
    /// let error = Hardware::new(spec).unwrap_err();
    /// assert_eq!(error.to_string(), "`tile.rows` is 40000; it must lie in 1..=32768");
    /// ```
    ///
    /// # Panics
    /// Never: its numbers are constants.
    #[must_use]
    pub fn reference() -> Self {
        const INSIDE: &str = "a constant inside its range";
        let level_bits = LevelBits::new(8).expect(INSIDE);
        let spec = HardwareSpec {
            cell: CellSpec {
                level_bits,
                window: Window::new(0, 255, level_bits).expect(INSIDE),
                floor_kind: FloorKind::Recoverable,
            },
            tile: TileSpec { rows: 256, columns: 256, count_max: None, transposed_read: true },
            drive: DriveSpec { bits: DriveBits::new(8).expect(INSIDE), dac_bits: 8 },
            adc: Adc::Ideal,
            digital: DigitalSpec {
                lut_bits: LutBits::new(10).expect(INSIDE),
                error_bits: ErrorBits::new(8).expect(INSIDE),
            },
            write: WriteSpec {
                increment_max: IncrementMax::new(7).expect(INSIDE),
                dither_bits: DitherBits::Eight,
                dither_pattern: DitherPattern::PerCell,
                residual_bits: ResidualBits::new(0).expect(INSIDE),
                scheme: WriteScheme::Rounded,
            },
            device: None,
            timing: None,
            faults: Faults::NONE,
            fault_map: FaultMap::default(),
            conductance: None,
            wires: None,
            read_noise: None,
            programming: None,
            endurance: None,
            leakage: None,
            ageing: None,
        };
        Self::new(spec).expect("the reference is a chip")
    }

    /// The parts, to make another chip of them.
    #[must_use]
    pub fn into_spec(self) -> HardwareSpec {
        self.0
    }

    /// The same chip with some parts changed.
    ///
    /// # Errors
    /// When the changed parts make no chip.
    pub fn with(&self, change: impl FnOnce(&mut HardwareSpec)) -> Result<Self, HardwareError> {
        let mut spec = self.0.clone();
        change(&mut spec);
        Self::new(spec)
    }

    /// `NS`: slices a drive code is read in.
    #[must_use]
    pub const fn slices(&self) -> u32 {
        self.0.drive.bits.get().div_ceil(self.0.drive.dac_bits)
    }

    /// The shift at which no current of a tile can saturate a converter of `bits`.
    #[must_use]
    pub(crate) fn full_shift(&self, bits: AdcBits, subtract: Subtract, rows: usize) -> u32 {
        let slice_max = (1i64 << self.drive.dac_bits.min(self.drive.bits.get())) - 1;
        let kept = self.conductance.filter(|of| of.reference == Reference::None);
        let least = kept.map_or(0, |of| i64::from(of.least));
        let cell = (i64::from(self.level_greatest()) << CONDUCTANCE_BITS) + least;
        let worst = rsh(rows as i64 * slice_max * cell, CONDUCTANCE_BITS);
        let rail = match subtract {
            Subtract::Digital => (1i64 << bits.get()) - 1,
            Subtract::Current => (1i64 << (bits.get() - 1)) - 1,
        };
        (0..).find(|&shift| rsh(worst, shift) <= rail).expect("rsh ends at 0")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_window_keeps_floor_below_ceiling_inside_the_level() {
        let bits = LevelBits::new(4).unwrap();
        assert!(Window::new(0, 15, bits).is_ok() && Window::new(14, 15, bits).is_ok());
        for (floor, ceiling) in [(0, 16), (15, 15), (-1, 15), (0, 0), (3, 2)] {
            assert!(Window::new(floor, ceiling, bits).is_err(), "{floor}..={ceiling}");
        }
    }

    #[test]
    fn parts_that_make_no_chip_are_refused_with_their_key() {
        let reference = Hardware::reference();
        let key = |change: &dyn Fn(&mut HardwareSpec)| reference.with(change).unwrap_err().key;
        assert_eq!(key(&|h| h.tile.rows = 0), "tile.rows");
        assert_eq!(key(&|h| h.tile.rows = 32_769), "tile.rows");
        assert!(reference.with(|h| h.tile.rows = 32_768).is_ok());
        assert_eq!(key(&|h| h.tile.columns = 65_535), "tile.columns");
        assert_eq!(key(&|h| h.tile.count_max = Some(0)), "tile.count");
        assert_eq!(key(&|h| h.drive.dac_bits = 9), "drive.dac_bits");
        assert_eq!(key(&|h| h.cell.level_bits = LevelBits::new(7).unwrap()), "cell.ceiling");
        let bits = AdcBits::new(8).unwrap();
        let adc = |range| Adc::Finite { bits, subtract: Subtract::Digital, range };
        assert_eq!(key(&|h| h.adc = adc(AdcRange::Shift(41))), "adc.range");
        let far = AdcRange::Calibrated { headroom: 17, every_epoch: false };
        assert_eq!(key(&|h| h.adc = adc(far)), "adc.headroom");
        let trains = |slots_log2| WriteScheme::Trains { slots_log2 };
        assert_eq!(key(&|h| h.write.scheme = trains(3)), "write.train_slots");
        assert_eq!(key(&|h| h.write.scheme = trains(200)), "write.train_slots");
        assert!(reference.with(|h| h.write.scheme = trains(2)).is_ok());
        let some = ResidualBits::new(1).unwrap();
        let both = |h: &mut HardwareSpec| {
            (h.write.scheme, h.write.residual_bits) = (trains(2), some);
        };
        assert_eq!(key(&both), "write.residual_bits");
    }
}
