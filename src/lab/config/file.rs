//! The keys of configuration files. Every key is optional here; defaults and ranges are in `check`.

use std::{collections::BTreeMap, fmt};

use serde::de::{self, Deserializer, MapAccess, Visitor};
use serde::{Deserialize, Serialize};

use super::device::DeviceFile;
use super::law::{ScalesFile, Settings};
use super::quantity::{AreaKey, EnergyKey, PowerKey};

/// One value for all layers, or one for each.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(untagged, expecting = "one value, or a list with one a layer")]
pub enum PerLayer<T> {
    /// The same everywhere.
    All(T),
    /// Input to output.
    Each(Vec<T>),
}

/// `padding = "same"` or `1`.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(untagged, expecting = "\"same\", or a whole number")]
pub enum PaddingFile {
    /// By name.
    Named(String),
    /// So many pixels on each side.
    Pixels(usize),
}

/// `rate_mantissa = 3`, `[3, 5]` or `"auto"`.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(untagged, expecting = "a whole number, a list with one a layer, or \"auto\"")]
pub enum MantissaFile {
    /// By name.
    Named(String),
    /// The same in every layer.
    All(i64),
    /// Input to output.
    Each(Vec<i64>),
}

/// Structures of optional keys that refuse unknown ones. What stands above a key is its meaning, for `dalean keys` too.
macro_rules! keys {
    ($($(#[doc = $doc:literal])* $name:ident {
        $($(#[doc = $meaning:literal])* $(#[cfg($when:meta)])? $field:ident: $kind:ty,)*
    })*) => {$(
        $(#[doc = $doc])*
        #[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
        #[serde(deny_unknown_fields)]
        pub struct $name {
            $(
                $(#[doc = $meaning])* $(#[cfg($when)])?
                #[serde(skip_serializing_if = "Option::is_none")] pub $field: Option<$kind>,
            )*
        }

        impl $name {
            /// Each key and what it means.
            pub(in crate::lab::config) const MEANINGS: &'static [(&'static str, &'static str)] =
                &[$($(#[cfg($when)])? (stringify!($field), concat!($($meaning),*)),)*];
        }
    )*};
}

pub(super) use keys;

keys! {
    /// An experiment file.
    ExperimentFile {
        /// Who makes the error words.
        task: String,
        /// Seed of all draws.
        seed: u64,
        /// Whose defaults the keys have that the file is silent about; without it, this program's.
        preset: String,
        /// What is learnt.
        data: DataFile,
        /// Layers and units.
        network: NetworkFile,
        /// Rule, rate, batch, epochs.
        learning: LearningFile,
        /// Policies: what is acted on, and for how long.
        environment: EnvironmentFile,
        /// Policies: proximal policy optimisation.
        ppo: PpoFile,
        /// Policies: evolution strategies.
        es: EvolutionFile,
        /// Policies: episodes that are read without learning.
        evaluation: EvaluationFile,
        /// The chip: a model and what differs from it.
        hw: ChipFile,
    }
    /// `[data]`: a named set, or files of one's own.
    DataFile {
        /// A set that this program knows.
        set: String,
        /// What files of one's own are.
        format: String,
        /// File of the training examples; paths in a file are relative to that file.
        train: String,
        /// IDX, NPZ: file of the training labels, where they have one of their own.
        train_labels: String,
        /// File of the validation examples; default: every 12th training example.
        validation: String,
        /// IDX, NPZ: file of their labels.
        validation_labels: String,
        /// File of the test examples; default: every 6th example of the training file.
        test: String,
        /// IDX, NPZ: file of their labels.
        test_labels: String,
        /// Greatest value; default: the greatest training value, or 255 for fractions.
        full_scale: u8,
        /// Number of classes; default: as many as there are different labels.
        classes: usize,
        /// Height, width and channels of examples that are pictures; a table's values lie row after row, the channels of a pixel side by side.
        shape: [usize; 3],
        /// Pictures: rows and pixels of a row that are kept of their middle.
        middle: [usize; 2],
        /// CSV: `first`, `last`, a number from 0, or a header; default: told from the table, and said.
        label_column: ColumnFile,
        /// CSV: columns left out, each a number from 0 or a header; default: those without a name that number the rows.
        ignore_columns: Vec<ColumnFile>,
        /// CSV: whether the first line names the columns; default: told from the table.
        header: bool,
        /// CSV: `,`, `;`, `tab`, `|`; default: what cuts the first lines alike.
        separator: String,
        /// NPZ: name of the array of examples of every part (default: known names, such as `x` or `x_train`).
        examples_array: String,
        /// NPZ: name of the array of labels of every part.
        labels_array: String,
        /// NPZ: array of the training examples.
        train_array: String,
        /// NPZ: array of the training labels.
        train_labels_array: String,
        /// NPZ: array of the validation examples; in the training file, unless `validation` names another.
        validation_array: String,
        /// NPZ: array of the validation labels.
        validation_labels_array: String,
        /// NPZ: array of the test examples; in the training file, unless `test` names another.
        test_array: String,
        /// NPZ: array of the test labels.
        test_labels_array: String,
    }
    /// `[network]`.
    NetworkFile {
        /// Output channels of each convolution; convolutions come before the hidden layers.
        channels: Vec<usize>,
        /// Convolutions: rows and columns of the window.
        kernel: PerLayer<usize>,
        /// Convolutions: pixels from a window to the next.
        stride: PerLayer<usize>,
        /// Convolutions: pixels of border on each side of the image, which are 0.
        padding: PerLayer<PaddingFile>,
        /// Convolutions: what is handed on of each square of their map.
        pool: PerLayer<String>,
        /// Convolutions: rows and columns of such a square.
        pool_side: PerLayer<usize>,
        /// Convolutions: how often their arrays stand on the chip, each written, to read as many positions at a time.
        copies: PerLayer<usize>,
        /// Units of each hidden layer; of policies, of the network that acts.
        hidden: Vec<usize>,
        /// Policies: units of each hidden layer of the network that says what a state is worth.
        critic_hidden: Vec<usize>,
        /// Output units.
        outputs: usize,
        /// How values become drives, which have no sign.
        input: String,
        /// Function of hidden units, convolutions among them; outputs are sigmoid, sums with `softmax` and of policies.
        activation: String,
        /// Sigmoid width of each layer.
        alpha: PerLayer<f64>,
        /// Whether each hidden unit takes the running mean of its own sum off it.
        threshold: bool,
        /// How the step of the table of hidden units is found.
        gain: String,
        /// Gain `fixed`: the table reaches 2^gain_spread times as far.
        gain_spread: u32,
        /// Samples after which thresholds and gains have come all the way, were they not to turn.
        homeostasis_window: i64,
        /// Weight of the level after the greatest, of each layer.
        weight_max: PerLayer<f64>,
        /// Whether a constant input is learnt from.
        bias: String,
        /// Which outputs are read.
        readout: String,
        /// Initial gain of excitatory and inhibitory arrays of hidden layers.
        init_gain: [f64; 2],
        /// The same of the output layer.
        init_gain_output: [f64; 2],
    }
    /// `[learning]`.
    LearningFile {
        /// The learning rule.
        rule: String,
        /// Passes over the training set.
        epochs: u32,
        /// Samples of an update; of policies, steps of a minibatch.
        batch: i64,
        /// When a batch is written.
        mode: String,
        /// What is asked of a cell, given its sum.
        optimiser: String,
        /// Optimiser `sign`: sums below the root mean square of their layer ask for nothing.
        dead_zone: bool,
        /// Optimiser `momentum`: what an accumulator forgets of itself at a write, as 2^-shift.
        momentum_shift: i64,
        /// Optimiser `adam_fx`: what the mean of sums and the mean of their squares forget of themselves at a write, as 2^-shift.
        adam_shifts: [i64; 2],
        /// Whether layers learn from what differs from the mean of each row; of policies, hidden layers of the network that acts.
        centred: bool,
        /// Rate, before multipliers; of the optimiser `sign` the probability of a pulse, of `rms` and `adam_fx` a step of weights.
        rate: f64,
        /// Factor of the rate of each layer.
        rate_multipliers: PerLayer<f64>,
        /// Small factor beside the shift of each layer.
        rate_mantissa: MantissaFile,
        /// How the rate falls over the run.
        decay: String,
        /// What the error of an output is.
        error: String,
        /// Error `softmax`: what outputs are divided by before they share.
        temperature: f64,
        /// What is subtracted from errors.
        centre: String,
        /// What is taken away, to see whether it is needed.
        control: String,
        /// Updates after which, again and again, what both cells of a pair hold is taken off both by loads: for cells that only rise.
        refresh: u32,
        /// How errors reach hidden units.
        route: String,
        /// Words a hidden unit adds.
        taps: usize,
        /// Shift of the sum of words.
        tap_shift: u32,
        /// Training images move by up to so many pixels.
        shift_pixels: u32,
        /// Whether left and right of training images are exchanged, each time with a chance of a half.
        flip: bool,
        /// What is learnt from.
        train_on: String,
        /// The epoch whose state reads the test set.
        select: String,
        /// What a later program reads and no run uses.
        #[cfg(feature = "grown")]
        grown: i64,
    }
    /// `[environment]`: policies.
    EnvironmentFile {
        /// What it is called.
        id: String,
        /// How many run side by side.
        count: i64,
        /// Steps of all of them together, at least: whole epochs are done.
        steps: i64,
        /// Steps of one in a rollout; with evolution, of an episode at most.
        horizon: i64,
        /// Rollouts, or generations of evolution, of an epoch: as often is a record written and the policy evaluated.
        rollouts: i64,
    }
    /// `[ppo]`: policies, every rule but `es`.
    PpoFile {
        /// Passes over a rollout.
        passes: i64,
        /// Discount of rewards.
        gamma: f64,
        /// Decay of advantage estimates: 0 looks one step ahead, 1 to the end.
        lambda: f64,
        /// How far a ratio may go before it is clipped.
        clip: f64,
        /// What entropy is worth.
        entropy: f64,
        /// Continuous actions: logarithm of their spread at the start.
        log_sigma: f64,
        /// Continuous actions: how far that logarithm moves in an update for a mean error of 1.
        log_sigma_rate: f64,
        /// Continuous actions: steps for which what was drawn stands.
        noise_steps: i64,
    }
    /// `[es]`: policies by evolution.
    EvolutionFile {
        /// Pairs of candidates in a generation.
        pairs: i64,
        /// Levels by which the cells of a candidate differ, up and down.
        step: i64,
        /// A cell moves by a level with a probability of 2^-shift times the sum of ranks that ask for it.
        shift: i64,
    }
    /// `[evaluation]`: policies.
    EvaluationFile {
        /// Episodes after every epoch.
        episodes: i64,
        /// Episodes of the final test.
        final_episodes: i64,
        /// Whether the likeliest action is taken, and not one that is drawn.
        deterministic: bool,
    }
    /// A hardware model file, or `[hw]` of an experiment.
    HardwareFile {
        /// Name of a built-in model or path of a model file (experiments only).
        model: String,
        /// What it is called (model files).
        name: String,
        /// One sentence (model files).
        summary: String,
        /// Cells.
        cell: CellFile,
        /// Physical arrays.
        tile: TileFile,
        /// Row drivers.
        drive: DriveFile,
        /// Column converters.
        adc: AdcFile,
        /// Activation table.
        lut: LutFile,
        /// Error bus.
        error: ErrorFile,
        /// Programming.
        write: WriteFile,
        /// What real cells and converters do that ideal ones do not.
        device: DeviceFile,
        /// Cycles of what a tile does; without it no cycles are counted.
        timing: TimingFile,
        /// Joules of an event, by quantity and unit.
        energy: BTreeMap<EnergyKey, NumberFile>,
        /// Watts that flow whatever happens.
        power: BTreeMap<PowerKey, NumberFile>,
        /// Sizes of parts.
        area: BTreeMap<AreaKey, NumberFile>,
        /// Nanometres of the node that its numbers are of, unless they say another.
        node_nm: f64,
        /// Settings of the model that its numbers are for, where the chip has others. Written by the program.
        constants_for: Settings,
        /// Ways to use the chip, for `hw peak --modes` (model files): name and settings.
        modes: BTreeMap<String, Vec<String>>,
        /// What the chip has of what this program does not simulate, by the names that `dalean hw show` lists.
        not_simulated: BTreeMap<String, String>,
    }
    /// `[cell]`.
    CellFile {
        /// Bits of a stored level.
        level_bits: i64,
        /// Least level: floor over ceiling is the conductance of an off cell over that of an on cell.
        floor: i64,
        /// Greatest level.
        ceiling: i64,
        /// What becomes of a cell on the floor.
        floor_kind: String,
        /// Where the numbers come from.
        source: String,
        /// How far to trust the numbers.
        kind: String,
    }
    /// `[tile]`.
    TileFile {
        /// Rows of a tile.
        rows: i64,
        /// Columns of a tile.
        columns: i64,
        /// Tiles on the chip.
        count: i64,
        /// Whether rows can be read while columns are driven.
        transposed_read: bool,
        /// Where the numbers come from.
        source: String,
        /// How far to trust the numbers.
        kind: String,
    }
    /// `[drive]`.
    DriveFile {
        /// Bits of a drive code.
        bits: i64,
        /// How a drive code is put on a row.
        mode: String,
        /// Bits a DAC applies at a time.
        dac_bits: i64,
        /// Pulse width: time slots of a phase.
        slots: i64,
        /// Pulse width: cycles of a slot.
        slot_cycles: i64,
        /// Pulse width: phases a drive code is read in.
        phases: i64,
        /// Where the numbers come from.
        source: String,
        /// How far to trust the numbers.
        kind: String,
    }
    /// `[lut]`.
    LutFile {
        /// Bits of the table index.
        bits: i64,
        /// Where the numbers come from.
        source: String,
        /// How far to trust the numbers.
        kind: String,
    }
    /// `[error]`.
    ErrorFile {
        /// Bits of an error word.
        bits: i64,
        /// Where the numbers come from.
        source: String,
        /// How far to trust the numbers.
        kind: String,
    }
    /// `[write]`.
    WriteFile {
        /// Most pulses a write gives a cell.
        increment_max: i64,
        /// Random bits of rounding.
        dither_bits: i64,
        /// Where the random bits of a cell come from.
        dither: String,
        /// Bits of the digital remainder behind a cell.
        residual_bits: i64,
        /// How sums become pulses.
        scheme: String,
        /// Slots of a train.
        train_slots: i64,
        /// Where the numbers come from.
        source: String,
        /// How far to trust the numbers.
        kind: String,
    }
    /// `[timing]`: cycles, in the words of docs/TILE.md.
    TimingFile {
        /// Megahertz of the clock that counts cycles.
        clock_mhz: f64,
        /// `T_A`: cycles to settle and sample; with `pulse_width`, cycles beside the slots of a phase.
        settle_cycles: i64,
        /// `T_C`: cycles of a conversion of `fixed` converters; others have `adc.step_cycles`.
        convert_cycles: i64,
        /// `S`: columns of a bank that share a converter.
        columns_per_adc: i64,
        /// Whether a slice settles while the one before is converted.
        overlap: bool,
        /// `U`: columns looked up, multiplied or accumulated at a time.
        lanes: i64,
        /// `H`: cycles before the first error word arrives.
        bus_hops: i64,
        /// `T_W`: cycles of a pulse.
        pulse_cycles: i64,
        /// How many pulses a number of levels takes.
        pulses: String,
        /// Whether every pulse is followed by a read of what it did.
        verify: bool,
        /// `W`: cells that can be pulsed at a time.
        write_active_max: i64,
        /// Cycles of a digital action: 1, or the symbols of a digital clock on an optical chip.
        beat_cycles: i64,
        /// Where the numbers come from.
        source: String,
        /// How far to trust the numbers.
        kind: String,
    }
    /// One physical number of `[energy]`, `[power]` or `[area]`; the unit is in its key.
    NumberFile {
        /// The least that is credible.
        low: f64,
        /// What is reckoned with.
        typical: f64,
        /// The most that is credible.
        high: f64,
        /// Where the numbers come from.
        source: String,
        /// How far to trust the numbers.
        kind: String,
        /// How it follows the settings it belongs to: a law (`walden`, `linear`, ...), or one a setting.
        scales: ScalesFile,
        /// Settings it stands for, where they are not those of its model.
        at: Settings,
        /// Nanometres of the node it is of, where it is not the model's.
        node_nm: f64,
    }
    /// `[adc]` of finite converters.
    AdcTable {
        /// Resolution.
        bits: i64,
        /// Where the range of a converter lies.
        range: RangeFile,
        /// Shift added to the calibrated one.
        headroom: i64,
        /// When it is calibrated again.
        recalibrate: String,
        /// Where the banks are subtracted.
        subtract: String,
        /// Cycles of a conversion: `fixed` (as `timing.convert_cycles` says), `sar` (bits + 1 steps), `counter` and `ramp` (2^bits steps), `flash` (one step).
        converter: String,
        /// Cycles of a step, where bits decide how many there are; default 1.
        step_cycles: i64,
        /// Bits that a phase is converted to: `owed` (those that earlier phases left) or `all`. Of several phases of `pulse_width` alone.
        phase_bits: String,
        /// Where the numbers come from.
        source: String,
        /// How far to trust the numbers.
        kind: String,
    }
}

/// `hw = "reram"`, or a table: the chip of an experiment.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
#[serde(transparent)]
pub struct ChipFile(pub HardwareFile);

impl std::ops::Deref for ChipFile {
    type Target = HardwareFile;

    fn deref(&self) -> &HardwareFile {
        &self.0
    }
}

impl<'de> Deserialize<'de> for ChipFile {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Either;
        impl<'de> Visitor<'de> for Either {
            type Value = ChipFile;
            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("the name of a hardware model, or a table of its keys")
            }
            fn visit_str<E: de::Error>(self, text: &str) -> Result<ChipFile, E> {
                Ok(ChipFile(HardwareFile { model: Some(text.into()), ..HardwareFile::default() }))
            }
            fn visit_map<M: MapAccess<'de>>(self, map: M) -> Result<ChipFile, M::Error> {
                HardwareFile::deserialize(de::value::MapAccessDeserializer::new(map)).map(ChipFile)
            }
        }
        deserializer.deserialize_any(Either)
    }
}

/// A column of a table: a word, or a number from 0 with or without quotes.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
#[serde(transparent)]
pub struct ColumnFile(pub String);

impl<'de> Deserialize<'de> for ColumnFile {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Either;
        impl Visitor<'_> for Either {
            type Value = ColumnFile;
            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a column: `first`, `last`, a number from 0, or a header")
            }
            fn visit_str<E: de::Error>(self, text: &str) -> Result<ColumnFile, E> {
                Ok(ColumnFile(text.into()))
            }
            fn visit_i64<E: de::Error>(self, number: i64) -> Result<ColumnFile, E> {
                let found = de::Unexpected::Signed(number);
                let number = u64::try_from(number).map_err(|_| E::invalid_value(found, &self))?;
                Ok(ColumnFile(number.to_string()))
            }
        }
        deserializer.deserialize_any(Either)
    }
}

/// `adc = "ideal"` or a table.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(untagged)]
pub enum AdcFile {
    /// `"ideal"`.
    Ideal(String),
    /// Finite converters.
    Finite(AdcTable),
}

impl<'de> Deserialize<'de> for AdcFile {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Either;
        impl<'de> Visitor<'de> for Either {
            type Value = AdcFile;
            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("\"ideal\" or a table with `bits`")
            }
            fn visit_str<E: de::Error>(self, text: &str) -> Result<AdcFile, E> {
                match text {
                    "ideal" => Ok(AdcFile::Ideal(text.into())),
                    other => Err(E::invalid_value(de::Unexpected::Str(other), &self)),
                }
            }
            fn visit_map<M: MapAccess<'de>>(self, map: M) -> Result<AdcFile, M::Error> {
                AdcTable::deserialize(de::value::MapAccessDeserializer::new(map))
                    .map(AdcFile::Finite)
            }
        }
        deserializer.deserialize_any(Either)
    }
}

/// `range = "tracking"`, `"calibrated"`, `"full"` or a shift.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(untagged, expecting = "\"tracking\", \"calibrated\", \"full\" or a shift (a whole number)")]
pub enum RangeFile {
    /// By name.
    Named(String),
    /// Explicit.
    Shift(i64),
}
