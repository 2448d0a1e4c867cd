//! From keys to checked numbers: defaults and ranges, table by table. What fits with what is said once, by
//! [`crate::learn::network`].

use std::collections::BTreeMap;
use std::fmt::Display;
use std::iter;
use std::num::NonZeroU32;

use super::changed::{self, UnderModel};
use super::file::{ChipFile, DataFile, ExperimentFile, LearningFile, NetworkFile, PerLayer};
use super::hardware::check_marks;
use super::law::{kind_of, settings};
use super::policy::PolicySettings;
use super::quantity::{Constants, constants_of};
use super::{ConfigError, Sources, chip, data, device};
use crate::chip::hardware::{ConverterKind, Hardware};
use crate::chip::layer::{Homeostasis, Optimiser};
use crate::lab::near;
use crate::learn::error::{Centre, OutputError};
use crate::learn::route::Route;
use crate::learn::rule::{Control, Rule, UpdateMode};
use crate::num::fixed::{Batch, OutOfRange, RateMantissa};
use crate::num::tables::{Activation, Decay, FullDrive, Positive, Rate, RateOf, Unit};

mod learning;
mod network;
mod policy;
mod route;
mod style;
mod window;

use learning::Learning;
use network::Network;
use style::{PRESETS, Preset, Style};
pub(crate) use window::{Convolved, ImageInput};

/// Which epoch's state reads the test set.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Select {
    /// The one with the best validation score, the earliest on ties.
    BestValidation,
    /// The last one.
    Last,
}

/// What is learnt from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TrainOn {
    /// Training examples.
    Train,
    /// Training and validation examples, once everything is chosen.
    All,
}

/// Which arrays have a constant row.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Bias {
    /// None.
    None,
    /// That which reads data.
    InputRow,
    /// All.
    Rows,
}

/// `[data]`, as it was written.
pub type DataConfig = DataFile;

/// A checked configuration. Nothing of it can be changed, so that what was checked and written down is what runs.
///
/// ```
/// use dalean::{Config, Sources};
///
/// let text = "seed = 7\n[network]\nhidden = [32]\n[hw.cell]\nlevel_bits = 5";
/// let config = Config::load(&Sources { experiment: Some(("mine", text)), ..Sources::default() })?;
/// assert_eq!((config.seed(), config.hardware().cell.level_bits.get()), (7, 5));
/// // every default is written out, and read back as the same
/// assert!(config.to_toml().contains("epochs = 40"));
/// # Ok::<(), dalean::ConfigError>(())
/// ```
#[derive(Debug, Clone)]
pub struct Config {
    /// Seed of all draws.
    pub(crate) seed: u64,
    /// What is learnt.
    pub(crate) data: DataConfig,
    /// How values become drives.
    pub(crate) input: ImageInput,
    /// Convolutions before the dense layers.
    pub(crate) convolutions: Vec<Convolved>,
    /// Units of each dense hidden layer.
    pub(crate) hidden: Vec<usize>,
    /// Output units, if not one a class.
    pub(crate) outputs: Option<usize>,
    /// Activation of each layer.
    pub(crate) activations: Vec<Activation>,
    /// `log2(weight_max)` of each layer.
    pub(crate) weight_max_log2: Vec<i32>,
    /// Which arrays have a constant row.
    pub(crate) bias: Bias,
    /// Initial gains, 64ths, of hidden and of output layers.
    pub(crate) gain_64ths: [[u32; 2]; 2],
    /// What hidden units do beside their table.
    pub(crate) homeostasis: Homeostasis,
    /// The rule.
    pub(crate) rule: Rule,
    /// When a batch is written.
    pub(crate) mode: UpdateMode,
    /// What the error of an output is.
    pub(crate) error: OutputError,
    /// What is subtracted from errors.
    pub(crate) centre: Centre,
    /// What is taken from a network, to see whether it is needed.
    pub(crate) control: Control,
    /// Updates from a refresh of all pairs to the next.
    pub(crate) refresh: Option<NonZeroU32>,
    /// Whether all layers learn from what differs from the mean of a row; of policies, [`PolicySettings`] says which.
    pub(crate) centred: bool,
    /// How errors reach hidden layers; `None` with back-propagation.
    pub(crate) route: Option<Route>,
    /// Samples of an update.
    pub(crate) batch: Batch,
    /// Small factor of the rate of each layer.
    pub(crate) mantissas: Vec<RateMantissa>,
    /// Rate of each layer.
    pub(crate) rates: Vec<Positive>,
    /// How the rate falls.
    pub(crate) decay: Decay,
    /// What makes requests of sums.
    pub(crate) optimiser: Optimiser,
    /// Passes over the training set; epochs of a policy.
    pub(crate) epochs: u32,
    /// Random shift of training images.
    pub(crate) shift_pixels: u32,
    /// Whether training images are mirrored at random.
    pub(crate) flip: bool,
    /// What is learnt from.
    pub(crate) train_on: TrainOn,
    /// Which state reads the test set.
    pub(crate) select: Select,
    /// What a policy has beside; nothing in classification.
    pub(crate) policy: Option<PolicySettings>,
    /// The chip.
    pub(crate) hardware: Hardware,
    /// How its levels drift, where that is known: for readings after a time.
    pub(crate) drift: Option<device::Retention>,
    /// What its events, its parts and its idling cost.
    pub(crate) constants: Constants,
    /// What the chip does and is not simulated.
    pub(crate) not_simulated: BTreeMap<String, String>,
    /// Name of the hardware model.
    pub(crate) hardware_name: String,
    /// The hardware model that it was laid over, while that is known.
    pub(super) model: Option<toml::Table>,
    pub(super) resolved: ExperimentFile,
}

pub(super) fn wrong(key: &str, found: impl Display, allowed: impl Display) -> ConfigError {
    ConfigError::Value { key: key.into(), found: found.to_string(), allowed: allowed.to_string() }
}

pub(super) fn range<T>(key: &str, result: Result<T, OutOfRange>) -> Result<T, ConfigError> {
    result.map_err(|error| ConfigError::Range { key: key.into(), error })
}

/// One of some words.
pub(super) fn word<T: Copy>(
    key: &str,
    value: &mut Option<String>,
    default: &str,
    words: &[(&str, T)],
) -> Result<T, ConfigError> {
    let value = value.get_or_insert_with(|| default.into());
    let found = words.iter().find(|(word, _)| word == value);
    found.map(|(_, meaning)| *meaning).ok_or_else(|| {
        let names: Vec<_> = words.iter().map(|(word, _)| *word).collect();
        let hint = near::hint(value, names.iter().copied());
        wrong(key, format!("is \"{value}\""), format!("it is one of {}{hint}", names.join(", ")))
    })
}

pub(super) fn between(key: &str, found: i64, min: i64, max: i64) -> Result<i64, ConfigError> {
    if (min..=max).contains(&found) {
        Ok(found)
    } else {
        Err(wrong(key, format!("is {found}"), format!("it must lie in {min}..={max}")))
    }
}

pub(super) fn per_layer<T: Clone + PartialEq>(
    key: &str,
    value: &mut Option<PerLayer<T>>,
    default: T,
    layers: usize,
) -> Result<Vec<T>, ConfigError> {
    match value.get_or_insert(PerLayer::All(default)) {
        PerLayer::All(one) => Ok(vec![one.clone(); layers]),
        PerLayer::Each(list) if list.len() == layers => Ok(list.clone()),
        PerLayer::Each(list) => Err(one_a_layer(key, list.len(), layers)),
    }
}

/// A list that has not one number a layer.
pub(super) fn one_a_layer(key: &str, found: usize, layers: usize) -> ConfigError {
    let allowed = format!("there are {layers} layers (hidden and output); give {layers}, or one");
    wrong(key, format!("has {found} numbers"), allowed)
}

pub(super) fn positive(key: &str, value: f64) -> Result<Positive, ConfigError> {
    Positive::new(value)
        .ok_or_else(|| wrong(key, format!("is {value}"), "it must lie above 0, in 1e-6..=1e6"))
}

/// What is learnt.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum TaskKind {
    Classify,
    Policy,
}

/// Checks a whole configuration.
pub(super) fn config(mut file: ExperimentFile, model: &UnderModel) -> Result<Config, ConfigError> {
    let tasks = [("classify", TaskKind::Classify), ("policy", TaskKind::Policy)];
    let task = word("task", &mut file.task, "classify", &tasks)?;
    let seed = *file.seed.get_or_insert(1);
    let ChipFile(hw) = file.hw.get_or_insert_with(ChipFile::default);
    let hardware = chip::resolve(hw, "hw.")?;
    let of = (hardware.cell.window.ceiling(), false);
    let drift = device::flaws(hw.device.as_ref(), of, &|name| format!("hw.{name}"))?.drift;
    check_marks(hw, "hw.")?;
    changed::settle(hw, model, &settings(&hardware, kind_of(hw)));
    let constants = constants_of(hw, &hardware, "hw.")?;
    let hardware_name = hw.name.get_or_insert_with(|| "unnamed".into()).clone();
    let not_simulated = hw.not_simulated.clone().unwrap_or_default();
    let learnt = match task {
        TaskKind::Classify => classify(&mut file, &hardware)?,
        TaskKind::Policy => policy::resolve(&mut file, &hardware)?,
    };
    let Learnt { data, input, convolutions, hidden, outputs, .. } = learnt;
    let Learnt { network, learning, mantissas, policy, .. } = learnt;
    let Network { activations, weight_max_log2, bias, gain_64ths, homeostasis } = network;
    let Learning {
        kind,
        mode,
        centre,
        control,
        refresh,
        route,
        batch,
        rates,
        decay,
        optimiser,
        ..
    } = learning;
    let Learning { error, centred, epochs, shift_pixels, flip, train_on, select, .. } = learning;
    #[cfg(feature = "grown")]
    file.learning.get_or_insert_default().grown.get_or_insert(0);
    Ok(Config {
        seed,
        data,
        input,
        convolutions,
        hidden,
        outputs,
        activations,
        weight_max_log2,
        bias,
        gain_64ths,
        homeostasis,
        rule: kind.rule,
        mode,
        error,
        centre,
        control,
        refresh,
        centred,
        route,
        batch,
        mantissas,
        rates,
        decay,
        optimiser,
        epochs,
        shift_pixels,
        flip,
        train_on,
        select,
        policy,
        hardware,
        drift,
        constants,
        not_simulated,
        hardware_name,
        model: None,
        resolved: file,
    })
}

/// What is learnt and how, whatever the chip.
struct Learnt {
    data: DataConfig,
    input: ImageInput,
    convolutions: Vec<Convolved>,
    hidden: Vec<usize>,
    outputs: Option<usize>,
    network: Network,
    learning: Learning,
    mantissas: Vec<RateMantissa>,
    policy: Option<PolicySettings>,
}

/// Examples with labels.
fn classify(file: &mut ExperimentFile, hardware: &Hardware) -> Result<Learnt, ConfigError> {
    policy::refused_in_classification(file)?;
    let data = data::resolve(file.data.get_or_insert_with(DataFile::default))?;
    let preset = match &mut file.preset {
        None => Preset::Own,
        some => word("preset", some, "", &PRESETS)?,
    };
    let network = file.network.get_or_insert_with(NetworkFile::default);
    let learning = file.learning.get_or_insert_with(LearningFile::default);
    let windows = network.channels.as_ref().map_or(0, Vec::len);
    let style = Style::of(preset, windows, &data)?;
    let (input, convolutions) = window::resolve(network, style)?;
    let hidden = network.hidden.get_or_insert_with(|| style.hidden()).clone();
    let learnt = learning::resolve(learning, &hidden, style)?;
    let made = network::resolve(
        network,
        &fan_ins(&convolutions, &hidden),
        learnt.kind,
        learnt.error,
        style,
    )?;
    let mantissas = mantissas(learning, &learnt, &made, &convolutions, hardware)?;
    let (outputs, policy) = (network.outputs, None);
    let network = made;
    Ok(Learnt {
        data,
        input,
        convolutions,
        hidden,
        outputs,
        network,
        learning: learnt,
        mantissas,
        policy,
    })
}

/// Inputs of a pathway of each layer; of the first dense one without convolutions the data say it.
fn fan_ins(convolutions: &[Convolved], hidden: &[usize]) -> Vec<usize> {
    let below = convolutions.last().map_or(1, |last| last.pooled().iter().product());
    let windows = convolutions.iter().map(|one| one.shape.rows());
    windows.chain(iter::once(below)).chain(hidden.iter().copied()).collect()
}

/// What the greatest code behind a layer of this kind stands for, or of data.
fn full_drive(below: Option<&Activation>) -> FullDrive {
    match below {
        Some(Activation::Rms) => FullDrive::Normalised,
        _ => FullDrive::One,
    }
}

/// The small factor of the rate of each layer.
fn mantissas(
    file: &mut LearningFile,
    learning: &Learning,
    network: &Network,
    convolutions: &[Convolved],
    hardware: &Hardware,
) -> Result<Vec<RateMantissa>, ConfigError> {
    let positions = convolutions.iter().map(|one| one.shape.positions()).chain(iter::repeat(1));
    let layers = network.activations.iter().zip(&network.weight_max_log2);
    let below = iter::once(None).chain(network.activations.iter().map(Some));
    let asked = learning.rates.iter().zip(layers).zip(below.map(full_drive)).zip(positions);
    let asked =
        asked.map(|(((&rate, (&activation, &weight_max_log2)), full_drive), positions)| Rate {
            rate,
            of: match learning.optimiser {
                Optimiser::Sign { .. } => RateOf::Pulses,
                Optimiser::AdamFx { .. } => RateOf::Requests,
                _ => RateOf::Sums,
            },
            batch: learning.batch,
            positions,
            mantissa: RateMantissa::new(1).expect("in range"),
            error_bits: hardware.digital.error_bits,
            activation,
            unit: Unit {
                weight_max_log2,
                level_bits: hardware.cell.level_bits,
                drive_bits: hardware.drive.bits,
                full_drive,
            },
            window: hardware.pulses_of_window(),
        });
    learning::mantissas(file, &asked.collect::<Vec<_>>())
}

impl Config {
    /// Reads and checks a configuration.
    ///
    /// ```
    /// use dalean::{Config, Sources};
    ///
    /// let settings = ["hw.cell.level_bits=13".to_owned()];
    /// let error = Config::load(&Sources { settings: &settings, ..Sources::default() }).unwrap_err();
    /// assert!(error.to_string().contains("must lie in 1..=12"));
    /// ```
    ///
    /// # Errors
    /// When a text cannot be read, has unknown keys, or the numbers are impossible.
    pub fn load(sources: &Sources<'_>) -> Result<Self, ConfigError> {
        super::load(sources)
    }

    /// Seed of all draws.
    #[must_use]
    pub const fn seed(&self) -> u64 {
        self.seed
    }

    /// Passes over the training set.
    #[must_use]
    pub const fn epochs(&self) -> u32 {
        self.epochs
    }

    /// Samples of an update.
    #[must_use]
    pub const fn batch(&self) -> Batch {
        self.batch
    }

    /// The chip.
    #[must_use]
    pub const fn hardware(&self) -> &Hardware {
        &self.hardware
    }

    /// What its events, its parts and its idling cost.
    #[must_use]
    pub const fn constants(&self) -> &Constants {
        &self.constants
    }

    /// What the chip is, in a sentence, and what was changed of its model.
    pub(crate) fn hardware_summary(&self) -> &str {
        let hw = self.resolved.hw.as_ref();
        hw.and_then(|hw| hw.summary.as_deref()).unwrap_or_default()
    }

    /// Name of the model under the chip, whatever was laid over it.
    pub(crate) fn model_name(&self) -> &str {
        self.hardware_name.strip_suffix(changed::SUFFIX).unwrap_or(&self.hardware_name)
    }

    /// What kind of converters the chip has.
    #[must_use]
    pub(crate) fn converter_kind(&self) -> ConverterKind {
        self.resolved.hw.as_ref().map_or(ConverterKind::Fixed, |hw| kind_of(hw))
    }

    /// The configuration as one self-contained file, every default written out.
    ///
    /// # Panics
    /// Never: every key has a TOML form.
    #[must_use]
    pub fn to_toml(&self) -> String {
        toml::to_string(&self.resolved).expect("every key has a TOML form")
    }
}
