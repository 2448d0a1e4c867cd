//! From the keys of a chip to checked numbers: defaults, ranges, and what fits with what.

use super::check::{between, range, word, wrong};
use super::file::{
    AdcFile, AdcTable, CellFile, DriveFile, ErrorFile, HardwareFile, LutFile, RangeFile, TileFile,
    TimingFile, WriteFile,
};
use super::{ConfigError, device};
use crate::chip::hardware::timing::CYCLES_MAX;
use crate::chip::hardware::{
    Adc, AdcRange, CellSpec, ConverterKind, DigitalSpec, DitherBits, DitherPattern, DriveSpec,
    FloorKind, Hardware, HardwareError, HardwareSpec, PulseCode, SliceTime, SliceTimes, Subtract,
    TileSpec, Timing, Window, WriteScheme, WriteSpec, converter,
};
use crate::num::fixed::{
    AdcBits, DriveBits, ErrorBits, IncrementMax, LevelBits, LutBits, ResidualBits,
};

/// Most cycles of one action, as keys count them.
const MOST: i64 = CYCLES_MAX.cast_signed();

/// How a drive code is put on a row.
#[derive(Debug, Clone, PartialEq, Eq)]
enum DriveMode {
    /// A voltage of `dac_bits` a slice.
    Voltage,
    /// A pulse whose length is the code, phase by phase; each takes so many cycles.
    PulseWidth { phase_cycles: Vec<u64> },
    /// The amplitude of light: one slice, and a difference of currents.
    Amplitude,
}

/// How long a conversion takes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct ConverterTime {
    kind: ConverterKind,
    bits: u32,
    step_cycles: u64,
    /// Whether a phase is converted to the bits that earlier ones left.
    owed: bool,
}

/// Checks `[hw]` or a model file and writes defaults back; `prefix` is put before keys in messages.
pub(super) fn resolve(file: &mut HardwareFile, prefix: &str) -> Result<Hardware, ConfigError> {
    let key = |name: &str| format!("{prefix}{name}");
    let cell = file.cell.get_or_insert_with(CellFile::default);
    let bits = *cell.level_bits.get_or_insert(8);
    let level_bits = range(&key("cell.level_bits"), LevelBits::new(bits))?;
    let floor = *cell.floor.get_or_insert(0);
    // the default ceiling follows the bits, so it is not written back
    let ceiling = cell.ceiling.unwrap_or(i64::from(level_bits.level_max()));
    let window = range(&key("cell"), Window::new(floor, ceiling, level_bits))?;
    let floors = [("recoverable", FloorKind::Recoverable), ("absorbing", FloorKind::Absorbing)];
    let floor_kind = word(&key("cell.floor_kind"), &mut cell.floor_kind, "recoverable", &floors)?;

    let tile = file.tile.get_or_insert_with(TileFile::default);
    let tile_rows = count(&key("tile.rows"), *tile.rows.get_or_insert(256))?;
    let tile_columns = count(&key("tile.columns"), *tile.columns.get_or_insert(256))?;
    let count_max = tile.count.map(|n| count(&key("tile.count"), n)).transpose()?;
    let transposed_read = *tile.transposed_read.get_or_insert(false);

    let drive = file.drive.get_or_insert_with(DriveFile::default);
    let bits = *drive.bits.get_or_insert(8);
    let drive_bits = range(&key("drive.bits"), DriveBits::new(bits))?;
    let (mode, dac_bits) = drive_mode(drive, bits, &key)?;
    let dac_bits = u32::try_from(dac_bits).expect("1..=8");

    let (adc, converter) = match file.adc.get_or_insert_with(|| AdcFile::Ideal("ideal".into())) {
        AdcFile::Ideal(_) => (Adc::Ideal, None),
        AdcFile::Finite(table) => {
            let adc = converters(table, &key)?;
            (adc, converter_time(table, &mode, &key)?)
        }
    };

    if mode == DriveMode::Amplitude
        && matches!(adc, Adc::Finite { subtract: Subtract::Digital, .. })
    {
        let allowed = "light of the two banks meets in balanced photodiodes: with drive.mode = \"amplitude\" use \
                       adc.subtract = \"current\", or adc = \"ideal\"";
        return Err(wrong(&key("adc.subtract"), "is \"digital\"", allowed));
    }

    let lut = file.lut.get_or_insert_with(LutFile::default);
    let lut_bits = range(&key("lut.bits"), LutBits::new(*lut.bits.get_or_insert(10)))?;
    let error = file.error.get_or_insert_with(ErrorFile::default);
    let error_bits = range(&key("error.bits"), ErrorBits::new(*error.bits.get_or_insert(8)))?;

    let write = file.write.get_or_insert_with(WriteFile::default);
    let increments = *write.increment_max.get_or_insert(7);
    let increment_max = range(&key("write.increment_max"), IncrementMax::new(increments))?;
    let dither_bits = match *write.dither_bits.get_or_insert(8) {
        0 => DitherBits::Zero,
        8 => DitherBits::Eight,
        16 => DitherBits::Sixteen,
        other => {
            let allowed = "it is 0 (half-up), 8 or 16";
            return Err(wrong(&key("write.dither_bits"), format!("is {other}"), allowed));
        }
    };
    let dither_pattern = dither_pattern(write, dither_bits, &key)?;
    let bits = *write.residual_bits.get_or_insert(0);
    let residual_bits = range(&key("write.residual_bits"), ResidualBits::new(bits))?;

    let scheme = scheme(write, &key, increments)?;
    device::keep_lists(file.device.as_mut(), &key)?;
    let device = device::resolve(file.device.as_ref(), window, &key)?;
    let light = mode == DriveMode::Amplitude;
    let slices = Slices { mode, converter, count: drive_bits.get().div_ceil(dac_bits), dac_bits };
    let timing = file.timing.as_mut().map(|table| timing(table, &slices, &key)).transpose()?;
    device::check_tries(file.device.as_ref(), timing.is_some_and(|timing| timing.verify), &key)?;
    let window_end = (window.ceiling(), light);
    let flaws = device::flaws(file.device.as_ref(), window_end, &key)?;
    let spec = HardwareSpec {
        cell: CellSpec { level_bits, window, floor_kind },
        tile: TileSpec { rows: tile_rows, columns: tile_columns, count_max, transposed_read },
        drive: DriveSpec { bits: drive_bits, dac_bits },
        adc,
        digital: DigitalSpec { lut_bits, error_bits },
        write: WriteSpec { increment_max, dither_bits, dither_pattern, residual_bits, scheme },
        device,
        timing,
        faults: flaws.faults,
        fault_map: flaws.fault_map,
        conductance: flaws.conductance,
        wires: flaws.wires,
        read_noise: flaws.read_noise,
        programming: flaws.programming,
        endurance: flaws.endurance,
        leakage: flaws.leakage,
        ageing: flaws.ageing,
    };
    Hardware::new(spec)
        .map_err(|HardwareError { key: at, found, allowed }| wrong(&key(at), found, allowed))
}

/// A number of things, which the chip checks further.
fn count(key: &str, found: i64) -> Result<usize, ConfigError> {
    usize::try_from(found).map_err(|_| wrong(key, format!("is {found}"), "it must lie above 0"))
}

/// Where dither words come from, if any are drawn.
fn dither_pattern(
    write: &mut WriteFile,
    bits: DitherBits,
    key: &dyn Fn(&str) -> String,
) -> Result<DitherPattern, ConfigError> {
    let patterns = [("per_cell", DitherPattern::PerCell), ("separable", DitherPattern::Separable)];
    match (&write.dither, bits) {
        (None, DitherBits::Zero) => Ok(DitherPattern::PerCell),
        (Some(pattern), DitherBits::Zero) => {
            let allowed = "with write.dither_bits = 0 nothing is drawn: take the key out, or use 8 or 16 bits";
            Err(wrong(&key("write.dither"), format!("is \"{pattern}\""), allowed))
        }
        _ => word(&key("write.dither"), &mut write.dither, "per_cell", &patterns),
    }
}

fn scheme(
    write: &mut WriteFile,
    key: &dyn Fn(&str) -> String,
    increments: i64,
) -> Result<WriteScheme, ConfigError> {
    let schemes = [("rounded", false), ("rank1", true)];
    if !word(&key("write.scheme"), &mut write.scheme, "rounded", &schemes)? {
        return match write.train_slots {
            None => Ok(WriteScheme::Rounded),
            Some(slots) => {
                let allowed = "only write.scheme = \"rank1\" has trains";
                Err(wrong(&key("write.train_slots"), format!("is {slots}"), allowed))
            }
        };
    }
    let slots = *write.train_slots.get_or_insert(1 << increments.ilog2().min(5));
    if slots < 1 || slots.count_ones() != 1 {
        let allowed = "it is a power of two, at most write.increment_max";
        return Err(wrong(&key("write.train_slots"), format!("is {slots}"), allowed));
    }
    Ok(WriteScheme::Trains { slots_log2: slots.ilog2() })
}

fn converters(table: &mut AdcTable, key: &dyn Fn(&str) -> String) -> Result<Adc, ConfigError> {
    let Some(bits) = table.bits else {
        return Err(wrong(&key("adc.bits"), "is missing", "give 2..=16, or write adc = \"ideal\""));
    };
    let bits = range(&key("adc.bits"), AdcBits::new(bits))?;
    let subtracts = [("digital", Subtract::Digital), ("current", Subtract::Current)];
    let subtract = word(&key("adc.subtract"), &mut table.subtract, "digital", &subtracts)?;
    let default = || RangeFile::Named("tracking".into());
    let range = match table.range.get_or_insert_with(default) {
        RangeFile::Named(name) if name == "calibrated" => {
            let usual = if bits.get() <= 6 { 3 } else { 4 };
            let headroom = *table.headroom.get_or_insert(usual);
            let headroom = between(&key("adc.headroom"), headroom, 0, 16)?;
            let again = [("never", false), ("epoch", true)];
            let recalibrate = &mut table.recalibrate;
            let every_epoch = word(&key("adc.recalibrate"), recalibrate, "never", &again)?;
            let headroom = u32::try_from(headroom).expect("0..=16");
            return Ok(Adc::Finite {
                bits,
                subtract,
                range: AdcRange::Calibrated { headroom, every_epoch },
            });
        }
        RangeFile::Named(name) if name == "tracking" => AdcRange::Tracking,
        RangeFile::Named(name) if name == "full" => AdcRange::Full,
        RangeFile::Named(name) => {
            let allowed = "it is \"tracking\", \"calibrated\", \"full\" or a shift in 0..=40";
            return Err(wrong(&key("adc.range"), format!("is \"{name}\""), allowed));
        }
        RangeFile::Shift(shift) => {
            let shift = between(&key("adc.range"), *shift, 0, 40)?;
            AdcRange::Shift(u32::try_from(shift).expect("0..=40"))
        }
    };
    let calibrated = "only adc.range = \"calibrated\" has it: set that, or remove the key";
    if let Some(headroom) = table.headroom {
        return Err(wrong(&key("adc.headroom"), format!("is {headroom}"), calibrated));
    }
    if let Some(recalibrate) = &table.recalibrate {
        return Err(wrong(&key("adc.recalibrate"), format!("is \"{recalibrate}\""), calibrated));
    }
    Ok(Adc::Finite { bits, subtract, range })
}

/// How long a conversion takes, where its bits decide that; `None` where it is given.
fn converter_time(
    table: &mut AdcTable,
    mode: &DriveMode,
    key: &dyn Fn(&str) -> String,
) -> Result<Option<ConverterTime>, ConfigError> {
    let words = |text: &str| ConverterKind::NAMES.iter().any(|(name, _)| *name == text);
    if let Some(mark) = table.kind.as_deref().filter(|mark| words(mark)) {
        let allowed = format!(
            "`kind` says how far to trust the numbers: measured, fitted or assumed. The kind of a converter is \
             adc.converter = \"{mark}\""
        );
        return Err(wrong(&key("adc.kind"), format!("is \"{mark}\""), allowed));
    }
    // absent is fixed, and is not written back: a chip that does not ask is described as it was
    let kind = match &table.converter {
        None => ConverterKind::Fixed,
        Some(_) => {
            word(&key("adc.converter"), &mut table.converter, "fixed", ConverterKind::NAMES)?
        }
    };
    let phases = match mode {
        DriveMode::PulseWidth { phase_cycles } => phase_cycles.len(),
        DriveMode::Voltage | DriveMode::Amplitude => 1,
    };
    if kind == ConverterKind::Fixed {
        let given = [
            ("step_cycles", table.step_cycles.map(|cycles| cycles.to_string())),
            ("phase_bits", table.phase_bits.clone()),
        ];
        if let Some((name, found)) = given.into_iter().find_map(|(n, v)| Some((n, v?))) {
            let allowed = "a fixed converter takes timing.convert_cycles whatever its bits: give adc.converter = \"sar\", \
                           \"counter\", \"ramp\" or \"flash\", or remove the key";
            return Err(wrong(&key(&format!("adc.{name}")), format!("is {found}"), allowed));
        }
        return Ok(None);
    }
    if phases == 1
        && let Some(found) = &table.phase_bits
    {
        let allowed = "only a drive.mode = \"pulse_width\" of several drive.phases has phases that owe fewer bits; \
                       remove the key";
        return Err(wrong(&key("adc.phase_bits"), format!("is \"{found}\""), allowed));
    }
    let words = [("owed", true), ("all", false)];
    let owed = phases > 1 && word(&key("adc.phase_bits"), &mut table.phase_bits, "owed", &words)?;
    let step_cycles = *table.step_cycles.get_or_insert(1);
    let step_cycles = between(&key("adc.step_cycles"), step_cycles, 1, MOST)?.unsigned_abs();
    let bits = u32::try_from(table.bits.expect("checked before")).expect("2..=16");
    Ok(Some(ConverterTime { kind, bits, step_cycles, owed }))
}

/// What decides how long the slices of a read take.
struct Slices {
    mode: DriveMode,
    converter: Option<ConverterTime>,
    count: u32,
    dac_bits: u32,
}

impl Slices {
    /// Times of each, when settling takes so many cycles beside its pulses and a conversion that is given so many.
    fn times(&self, settle: u64, convert: u64) -> Vec<SliceTime> {
        let time = |slice: u32| {
            let slots = match &self.mode {
                DriveMode::PulseWidth { phase_cycles } => phase_cycles[slice as usize],
                DriveMode::Voltage | DriveMode::Amplitude => 0,
            };
            let convert = self.converter.map_or(convert, |time| {
                let carried = if time.owed { slice * self.dac_bits } else { 0 };
                let steps = time.kind.steps(converter::owed(time.bits, carried));
                steps.map_or(convert, |steps| steps.saturating_mul(time.step_cycles))
            });
            SliceTime { settle: settle + slots, convert }
        };
        (0..self.count).map(time).collect()
    }
}

/// How rows are driven, and the bits of a slice.
fn drive_mode(
    drive: &mut DriveFile,
    bits: i64,
    key: &dyn Fn(&str) -> String,
) -> Result<(DriveMode, i64), ConfigError> {
    let names = [("voltage", 0), ("pulse_width", 1), ("amplitude", 2)];
    let mode = word(&key("drive.mode"), &mut drive.mode, "voltage", &names)?;
    let own =
        [("slots", drive.slots), ("slot_cycles", drive.slot_cycles), ("phases", drive.phases)];
    if let (0 | 2, Some((name, _))) = (mode, own.iter().find(|(_, value)| value.is_some())) {
        let allowed = "only drive.mode = \"pulse_width\" has slots and phases; remove the key";
        return Err(wrong(&key(&format!("drive.{name}")), "is given", allowed));
    }
    if mode != 1 {
        let dac_bits = *drive.dac_bits.get_or_insert(bits);
        let dac_bits = between(&key("drive.dac_bits"), dac_bits, 1, bits)?;
        if mode == 2 && dac_bits != bits {
            let allowed =
                format!("light carries a drive code at once: it must be drive.bits, {bits}");
            return Err(wrong(&key("drive.dac_bits"), format!("is {dac_bits}"), allowed));
        }
        let mode = if mode == 2 { DriveMode::Amplitude } else { DriveMode::Voltage };
        return Ok((mode, dac_bits));
    }
    let phases = between(&key("drive.phases"), *drive.phases.get_or_insert(1), 1, bits)?;
    // what follows from bits and phases is not written back, so that either can be set alone
    let ceil = |n: i64, by: i64| (n + by - 1) / by;
    let dac_bits = ceil(bits, phases);
    if ceil(bits, dac_bits) != phases {
        let allowed = format!(
            "{bits} bits in phases of {dac_bits} take {}; use that, or change drive.bits",
            ceil(bits, dac_bits)
        );
        return Err(wrong(&key("drive.phases"), format!("is {phases}"), allowed));
    }
    if drive.dac_bits.is_some_and(|given| given != dac_bits) {
        let allowed =
            format!("{bits} bits in {phases} phases are {dac_bits} a phase; remove the key");
        return Err(wrong(&key("drive.dac_bits"), "does not fit drive.phases", allowed));
    }
    let most = (1i64 << dac_bits) - 1;
    let slots = drive.slots.unwrap_or(most);
    if !(most..=MOST).contains(&slots) {
        let allowed = format!(
            "the greatest code of a phase of {dac_bits} bits is a pulse of {most} slots; give at least {most}, or more \
             drive.phases"
        );
        return Err(wrong(&key("drive.slots"), format!("is {slots}"), allowed));
    }
    let slot_cycles = *drive.slot_cycles.get_or_insert(1);
    let slot_cycles = between(&key("drive.slot_cycles"), slot_cycles, 1, MOST / slots)?;
    // a phase is as long as its own greatest code, unless all are said to take as many slots
    let slots_of = |phase: i64| {
        let left = bits - phase * dac_bits;
        drive.slots.unwrap_or((1 << left.min(dac_bits)) - 1)
    };
    let phase_cycles = (0..phases).map(|phase| (slots_of(phase) * slot_cycles).unsigned_abs());
    Ok((DriveMode::PulseWidth { phase_cycles: phase_cycles.collect() }, dac_bits))
}

fn timing(
    table: &mut TimingFile,
    slices: &Slices,
    key: &dyn Fn(&str) -> String,
) -> Result<Timing, ConfigError> {
    let step_key = key("adc.step_cycles");
    let key = |name: &str| key(&format!("timing.{name}"));
    let Some(clock_mhz) = table.clock_mhz else {
        let allowed = "give the clock that counts cycles, such as clock_mhz = 1000.0; without [timing] no cycles are \
                       counted";
        return Err(wrong(&key("clock_mhz"), "is missing", allowed));
    };
    if !(0.001..=1e6).contains(&clock_mhz) {
        let allowed = "it must lie in 0.001..=1000000 (1 kHz to 1 THz)";
        return Err(wrong(&key("clock_mhz"), format!("is {clock_mhz}"), allowed));
    }
    // a phase takes its slots; what is said here comes on top of them
    let least = i64::from(!matches!(slices.mode, DriveMode::PulseWidth { .. }));
    let count = |name: &str, value: &mut Option<i64>, least: i64, most: i64| {
        let value = *value.get_or_insert(least);
        between(&key(name), value, least, most).map(i64::unsigned_abs)
    };
    let settle = count("settle_cycles", &mut table.settle_cycles, least, MOST)?;
    let convert = match (slices.converter, table.convert_cycles) {
        (None, _) => count("convert_cycles", &mut table.convert_cycles, 1, MOST)?,
        (Some(_), None) => 1,
        (Some(ConverterTime { kind, bits, .. }), Some(cycles)) => {
            let steps = kind.steps(bits).map_or_else(String::new, |steps| format!("{steps} "));
            let allowed = format!(
                "a {} converter of {bits} bits takes {steps}steps of adc.step_cycles: remove the key, or give \
                 adc.converter = \"fixed\"",
                kind.name()
            );
            return Err(wrong(&key("convert_cycles"), format!("is {cycles}"), allowed));
        }
    };
    let times = slices.times(settle, convert);
    let SliceTime { settle, convert } = times[0];
    if convert > CYCLES_MAX {
        let allowed = format!(
            "a conversion takes at most {CYCLES_MAX} cycles: give fewer, or fewer adc.bits"
        );
        return Err(wrong(&step_key, format!("makes conversions of {convert} cycles"), allowed));
    }
    let unequal = times.iter().any(|time| *time != times[0]);
    let own = SliceTimes::new(&times).map_err(|HardwareError { found, allowed, .. }| {
        wrong(&key("settle_cycles"), found, allowed)
    })?;
    let pulse_codes = [("unary", PulseCode::Unary), ("amplitude", PulseCode::Amplitude)];
    Ok(Timing {
        clock_khz: (clock_mhz * 1000.0).round() as u64,
        beat: count("beat_cycles", &mut table.beat_cycles, 1, 1_000_000)?,
        settle,
        convert,
        share: count("columns_per_adc", &mut table.columns_per_adc, 1, 32_768)?,
        overlapped: *table.overlap.get_or_insert(false),
        lanes: count("lanes", &mut table.lanes, 1, 32_768)?,
        hops: count("bus_hops", &mut table.bus_hops, 0, 1_000_000)?,
        pulse: count("pulse_cycles", &mut table.pulse_cycles, 1, MOST)?,
        pulse_code: word(&key("pulses"), &mut table.pulses, "unary", &pulse_codes)?,
        verify: *table.verify.get_or_insert(false),
        active_max: match table.write_active_max {
            None => None,
            Some(cells) => {
                Some(between(&key("write_active_max"), cells, 1, 65_536).map(i64::unsigned_abs)?)
            }
        },
        slices: unequal.then_some(own),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn chip(text: &str) -> Result<(Hardware, HardwareFile), String> {
        let mut file: HardwareFile = toml::from_str(text).map_err(|e| e.to_string())?;
        let hardware = resolve(&mut file, "hw.").map_err(|e| e.to_string())?;
        Ok((hardware, file))
    }

    #[test]
    fn a_silent_timing_is_the_shortest_there_is_and_is_written_out() {
        assert_eq!(chip("").unwrap().0.timing, None);
        let (hardware, file) = chip("timing.clock_mhz = 1280.5").unwrap();
        let timing = hardware.timing.unwrap();
        assert_eq!((timing.clock_khz, timing.beat, timing.settle), (1_280_500, 1, 1));
        assert_eq!((timing.share, timing.lanes, timing.hops, timing.active_max), (1, 1, 0, None));
        let text = toml::to_string(&file).unwrap();
        for key in ["settle_cycles = 1", "overlap = false", "pulses = \"unary\"", "bus_hops = 0"] {
            assert!(text.contains(key), "{key} in {text}");
        }
        assert_eq!(chip(&text).unwrap().0, hardware);
    }

    #[test]
    fn a_phase_of_pulse_width_takes_its_slots_and_what_comes_on_top() {
        let text = "drive = { bits = 7, mode = \"pulse_width\", slots = 128, slot_cycles = 3 }\n\
                    timing = { clock_mhz = 1, settle_cycles = 2 }";
        let (hardware, _) = chip(text).unwrap();
        assert_eq!((hardware.slices(), hardware.drive.dac_bits), (1, 7));
        assert_eq!(hardware.timing.unwrap().settle, 3 * 128 + 2);
        for (phases, dac_bits, slots) in [(1, 7, 127), (2, 4, 15), (3, 3, 7), (4, 2, 3), (7, 1, 1)]
        {
            let text = format!(
                "drive = {{ bits = 7, mode = \"pulse_width\", phases = {phases} }}\ntiming.clock_mhz = 1"
            );
            let (hardware, _) = chip(&text).unwrap();
            assert_eq!((hardware.slices(), hardware.drive.dac_bits), (phases, dac_bits));
            assert_eq!(hardware.timing.unwrap().settle, slots, "the greatest code fits exactly");
        }
    }

    #[test]
    fn a_conversion_takes_the_steps_of_its_kind() {
        let convert = |adc: &str| {
            let (hardware, file) =
                chip(&format!("adc = {{ {adc} }}\ntiming.clock_mhz = 1")).unwrap();
            assert_eq!(chip(&toml::to_string(&file).unwrap()).unwrap().0, hardware, "{adc}");
            hardware.timing.unwrap().convert
        };
        for (kind, bits, cycles) in [
            ("sar", 2, 3),
            ("sar", 6, 7),
            ("sar", 16, 17),
            ("counter", 4, 16),
            ("ramp", 10, 1024),
            ("flash", 4, 1),
            ("flash", 12, 1),
        ] {
            let text = format!("bits = {bits}, converter = \"{kind}\"");
            assert_eq!(convert(&text), cycles, "{text}");
            assert_eq!(convert(&format!("{text}, step_cycles = 30")), 30 * cycles, "{text}");
        }
        let fixed = "adc = { bits = 6, converter = \"fixed\" }\ntiming = { clock_mhz = 1, convert_cycles = 9 }";
        assert_eq!(chip(fixed).unwrap().0.timing.unwrap().convert, 9);
        // a chip that does not ask for a kind is written out as it always was
        let (_, file) = chip("adc = { bits = 6 }\ntiming.clock_mhz = 1").unwrap();
        assert!(!toml::to_string(&file).unwrap().contains("converter"));
    }

    /// NeuRRAM: seven magnitude bits in phases of four and three, each a comparison an owed bit and one step more.
    #[test]
    fn a_phase_is_as_long_as_its_own_bits_and_owes_what_earlier_ones_left() {
        let times = |drive: &str, adc: &str| {
            let text = format!(
                "drive = {{ bits = 7, mode = \"pulse_width\", phases = 2, slot_cycles = 27{drive} }}\n\
                 adc = {{ bits = 10, subtract = \"current\"{adc} }}\ntiming = {{ clock_mhz = 100, settle_cycles = 0 }}"
            );
            let (hardware, file) = chip(&text).unwrap();
            assert_eq!(chip(&toml::to_string(&file).unwrap()).unwrap().0, hardware, "{text}");
            let timing = hardware.timing.unwrap();
            let all = timing.slices.map(|own| own.iter().map(|s| [s.settle, s.convert]).collect());
            all.unwrap_or_else(|| vec![[timing.settle, timing.convert]])
        };
        let sar = ", converter = \"sar\", step_cycles = 30";
        assert_eq!(times("", sar), [[27 * 15, 30 * 11], [27 * 7, 30 * 7]]);
        let all = ", converter = \"sar\", step_cycles = 30, phase_bits = \"all\"";
        assert_eq!(times("", all), [[27 * 15, 30 * 11], [27 * 7, 30 * 11]]);
        assert_eq!(times(", slots = 20", all), [[27 * 20, 30 * 11]]);
        assert_eq!(times("", ", converter = \"counter\""), [[405, 1024], [189, 64]]);
        // fixed converters: only the pulses differ
        assert_eq!(times("", ""), [[405, 1], [189, 1]]);
    }

    #[test]
    fn finite_converters_track_unless_they_are_told_otherwise() {
        let range = |text: &str| {
            let (hardware, file) = chip(text).unwrap();
            assert_eq!(chip(&toml::to_string(&file).unwrap()).unwrap().0, hardware, "{text}");
            let Adc::Finite { range, .. } = hardware.adc else { panic!("finite") };
            range
        };
        assert_eq!(range("adc.bits = 4"), AdcRange::Tracking);
        for (bits, headroom) in [(4, 3), (6, 3), (7, 4), (12, 4)] {
            let found = range(&format!("adc = {{ bits = {bits}, range = \"calibrated\" }}"));
            assert_eq!(found, AdcRange::Calibrated { headroom, every_epoch: false });
        }
        let given =
            "adc = { bits = 8, range = \"calibrated\", headroom = 1, recalibrate = \"epoch\" }";
        assert_eq!(range(given), AdcRange::Calibrated { headroom: 1, every_epoch: true });
    }

    #[test]
    fn mistakes_name_the_key_and_what_is_allowed() {
        let wide = "drive.mode = \"pulse_width\"\n";
        for (text, wanted) in [
            ("timing.lanes = 8", "`hw.timing.clock_mhz` is missing"),
            ("timing = { clock_mhz = 0 }", "0.001..=1000000"),
            ("timing = { clock_mhz = 1, lanes = 0 }", "`hw.timing.lanes` is 0"),
            ("timing = { clock_mhz = 1, settle_cycles = 0 }", "`hw.timing.settle_cycles`"),
            ("timing = { clock_mhz = 1, pulses = \"long\" }", "unary, amplitude"),
            ("timing = { clock_mhz = 1, write_active_max = 0 }", "write_active_max"),
            ("drive.mode = \"light\"", "voltage, pulse_width, amplitude"),
            ("drive.slots = 4", "only drive.mode = \"pulse_width\""),
            (&format!("{wide}drive.slots = 254"), "pulse of 255 slots"),
            (&format!("{wide}drive.bits = 7\ndrive.phases = 5"), "take 4"),
            (&format!("{wide}drive.phases = 9"), "1..=8"),
            (&format!("{wide}drive.dac_bits = 3"), "does not fit"),
            (&format!("{wide}drive.slot_cycles = 1000000"), "slot_cycles"),
            ("drive = { mode = \"amplitude\", dac_bits = 4 }", "light carries"),
            ("drive.mode = \"amplitude\"\nadc = { bits = 8 }", "balanced photodiodes"),
            ("adc = { bits = 8, headroom = 3 }", "`hw.adc.headroom` is 3; only adc.range"),
            ("adc = { bits = 8, range = 4, headroom = 0 }", "`hw.adc.headroom` is 0"),
            ("adc = { bits = 8, recalibrate = \"epoch\" }", "`hw.adc.recalibrate` is \"epoch\""),
            ("adc = { bits = 8, range = \"tracked\" }", "it is \"tracking\", \"calibrated\""),
            ("adc = { bits = 8, converter = \"slow\" }", "fixed, sar, counter, ramp, flash"),
            ("adc = { bits = 8, kind = \"sar\" }", "adc.converter = \"sar\""),
            ("adc = { bits = 8, step_cycles = 2 }", "`hw.adc.step_cycles` is 2; a fixed converter"),
            ("adc = { bits = 8, converter = \"sar\", step_cycles = 0 }", "adc.step_cycles"),
            (
                "adc = { bits = 8, converter = \"sar\", phase_bits = \"all\" }",
                "several drive.phases",
            ),
            (
                "adc = { bits = 8, converter = \"sar\" }\ntiming = { clock_mhz = 1, convert_cycles = 9 }",
                "`hw.timing.convert_cycles` is 9; a sar converter of 8 bits takes 9 steps",
            ),
            (
                "adc = { bits = 16, converter = \"ramp\", step_cycles = 2000 }\ntiming.clock_mhz = 1",
                "makes conversions of 131072000 cycles",
            ),
        ] {
            let error = chip(text).unwrap_err();
            assert!(error.contains(wanted), "{text}: {error}");
        }
        let light = "drive.mode = \"amplitude\"\nadc = { bits = 8, subtract = \"current\" }";
        assert!(chip(light).is_ok() && chip("drive.mode = \"amplitude\"").is_ok());
    }
}
