//! From keys to checked numbers: defaults, ranges, and what fits with what.

use std::collections::BTreeMap;
use std::fmt::Display;

use super::ConfigError;
use super::chip;
use super::file::{DataFile, ExperimentFile, HardwareFile, LearningFile, NetworkFile, PerLayer};
use super::quantity::Constants;
use crate::chip::hardware::{Adc, Hardware, WriteScheme};
use crate::chip::layer::{DrivenBy, LayerSpec};
use crate::chip::population::Wiring;
use crate::learn::error::Centre;
use crate::learn::route::Route;
use crate::learn::rule::{Rule, UpdateMode};
use crate::num::fixed::{Batch, OutOfRange, RateMantissa};
use crate::num::tables::{Activation, Decay, Positive, divergence_index};
use crate::task::classify::{Augment, Experiment};

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

/// `[data]`, as it was written.
pub type DataConfig = DataFile;

/// A checked configuration.
#[derive(Debug, Clone)]
pub struct Config {
    /// Seed of all draws.
    pub seed: u64,
    /// What is learnt.
    pub data: DataConfig,
    /// Units of each hidden layer.
    pub hidden: Vec<usize>,
    /// Output units, if not one a class.
    pub outputs: Option<usize>,
    /// Activation of each layer.
    pub activations: Vec<Activation>,
    /// `log2(weight_max)` of each layer.
    pub weight_max_log2: Vec<i32>,
    /// Whether a constant row is driven.
    pub bias_rows: bool,
    /// Initial gains, 64ths, of hidden and of output layers.
    pub gain_64ths: [[u32; 2]; 2],
    /// The rule.
    pub rule: Rule,
    /// When a batch is written.
    pub mode: UpdateMode,
    /// What is subtracted from errors.
    pub centre: Centre,
    /// How errors reach hidden layers.
    pub route: Route,
    /// Samples of an update.
    pub batch: Batch,
    /// Small factor of the rate.
    pub mantissa: RateMantissa,
    /// Rate of each layer.
    pub rates: Vec<Positive>,
    /// How the rate falls.
    pub decay: Decay,
    /// Passes over the training set.
    pub epochs: u32,
    /// Random shift of training images.
    pub shift_pixels: u32,
    /// What is learnt from.
    pub train_on: TrainOn,
    /// Which state reads the test set.
    pub select: Select,
    /// The chip.
    pub hardware: Hardware,
    /// What its events, its parts and its idling cost.
    pub constants: Constants,
    /// What the chip does and is not simulated.
    pub not_simulated: BTreeMap<String, String>,
    /// Name of the hardware model.
    pub hardware_name: String,
    resolved: ExperimentFile,
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
    let names = || words.iter().map(|(word, _)| *word).collect::<Vec<_>>().join(", ");
    found
        .map(|(_, meaning)| *meaning)
        .ok_or_else(|| wrong(key, format!("is \"{value}\""), format!("it is one of {}", names())))
}

pub(super) fn between(key: &str, found: i64, min: i64, max: i64) -> Result<i64, ConfigError> {
    if (min..=max).contains(&found) {
        Ok(found)
    } else {
        Err(wrong(key, format!("is {found}"), format!("it must lie in {min}..={max}")))
    }
}

fn per_layer<T: Clone + PartialEq>(
    key: &str,
    value: &mut Option<PerLayer<T>>,
    default: T,
    layers: usize,
) -> Result<Vec<T>, ConfigError> {
    match value.get_or_insert(PerLayer::All(default)) {
        PerLayer::All(one) => Ok(vec![one.clone(); layers]),
        PerLayer::Each(list) if list.len() == layers => Ok(list.clone()),
        PerLayer::Each(list) => {
            let found = format!("has {} numbers", list.len());
            let allowed =
                format!("there are {layers} layers (hidden and output); give {layers}, or one");
            Err(wrong(key, found, allowed))
        }
    }
}

fn positive(key: &str, value: f64) -> Result<Positive, ConfigError> {
    Positive::new(value)
        .ok_or_else(|| wrong(key, format!("is {value}"), "it must lie above 0, in 1e-6..=1e6"))
}

/// Checks a whole configuration.
pub(super) fn config(mut file: ExperimentFile) -> Result<Config, ConfigError> {
    word("task", &mut file.task, "classify", &[("classify", ())])?;
    let seed = *file.seed.get_or_insert(1);
    let hw = file.hw.get_or_insert_with(HardwareFile::default);
    let hardware = chip::resolve(hw, "hw.")?;
    let constants = Constants::new(hw, "hw.")?;
    let hardware_name = hw.name.get_or_insert_with(|| "unnamed".into()).clone();
    let not_simulated = hw.not_simulated.clone().unwrap_or_default();
    let data = file.data.get_or_insert_with(DataFile::default);
    if data.set.is_none() && data.format.is_none() {
        data.set = Some("optdigits".into());
    }
    let data = data.clone();

    let learning = file.learning.get_or_insert_with(LearningFile::default);
    let seeded = learning.rule.as_deref() == Some("ed_seed");
    let rules = [
        ("ed", Rule::Ed),
        ("ed_seed", Rule::Ed),
        ("kaneko", Rule::Kaneko),
        ("dfa", Rule::Dfa),
        ("bp", Rule::Bp),
    ];
    let rule = word("learning.rule", &mut learning.rule, "ed", &rules)?;
    // The seed rule of the paper: width 1, raw errors, symmetric gains; a potentiating net has no centre.
    let raw = seeded || rule == Rule::Kaneko;
    let centres = [("none", Centre::None), ("batch", Centre::Batch), ("running", Centre::Running)];
    let centre_default = if raw { "none" } else { "batch" };
    let centre = word("learning.centre", &mut learning.centre, centre_default, &centres)?;
    let modes = [
        ("accumulate", UpdateMode::Accumulate),
        ("replay", UpdateMode::Replay),
        ("online", UpdateMode::Online),
    ];
    let mode = word("learning.mode", &mut learning.mode, "accumulate", &modes)?;
    if mode == UpdateMode::Online && centre == Centre::Batch {
        let allowed = "one sample has no mean; use learning.centre = \"running\" or \"none\" with mode = \"online\"";
        return Err(wrong("learning.centre", "is \"batch\"", allowed));
    }

    if mode == UpdateMode::Accumulate && hardware.write.scheme != WriteScheme::Rounded {
        let allowed = "trains write one sample at a time; with hw.write.scheme = \"rank1\" use mode = \"replay\" or \
                       \"online\"";
        return Err(wrong("learning.mode", "is \"accumulate\"", allowed));
    }

    let network = file.network.get_or_insert_with(NetworkFile::default);
    let hidden = network.hidden.get_or_insert_with(|| vec![256]).clone();
    let layers = hidden.len() + 1;
    if hidden.contains(&0) {
        return Err(wrong("network.hidden", "has a layer of 0 units", "give at least 1 unit"));
    }
    let alphas =
        per_layer("network.alpha", &mut network.alpha, if seeded { 1.0 } else { 6.0 }, layers)?;
    let mut kinds = vec![
        word(
            "network.activation",
            &mut network.activation,
            "sigmoid",
            &[("sigmoid", 0), ("relu", 1), ("identity", 2)],
        )?;
        layers - 1
    ];
    kinds.push(0);
    let mut activations = Vec::new();
    for (kind, alpha) in kinds.into_iter().zip(alphas) {
        activations.push(match kind {
            1 => Activation::Relu,
            2 => Activation::Identity,
            _ => Activation::Sigmoid(positive("network.alpha", alpha)?),
        });
    }
    let mut weight_max_log2 = Vec::new();
    for weight in per_layer("network.weight_max", &mut network.weight_max, 4.0, layers)? {
        let exact = (-8..=8).find(|&log2| f64::from(log2).exp2() == weight);
        weight_max_log2.push(exact.ok_or_else(|| {
            let allowed = "it must be a power of two from 1/256 to 256";
            wrong("network.weight_max", format!("is {weight}"), allowed)
        })?);
    }
    let bias_rows =
        word("network.bias", &mut network.bias, "none", &[("none", false), ("rows", true)])?;
    word("network.readout", &mut network.readout, "p", &[("p", ())])?;
    let symmetric = seeded || !rule.is_dalean();
    let gain = if symmetric { [1.0, 1.0] } else { [1.5, 0.5] };
    let gain_64ths = [
        gains("network.init_gain", *network.init_gain.get_or_insert(gain))?,
        gains("network.init_gain_output", *network.init_gain_output.get_or_insert([1.0, 1.0]))?,
    ];

    let epochs = *learning.epochs.get_or_insert(20);
    let batch = range("learning.batch", Batch::new(*learning.batch.get_or_insert(32)))?;
    let mantissa = *learning.rate_mantissa.get_or_insert(1);
    let mantissa = range("learning.rate_mantissa", RateMantissa::new(mantissa))?;
    let rate = positive("learning.rate", *learning.rate.get_or_insert(20.0))?;
    let multipliers = &mut learning.rate_multipliers;
    let mut rates = Vec::new();
    for factor in per_layer("learning.rate_multipliers", multipliers, 1.0, layers)? {
        let factor = positive("learning.rate_multipliers", factor)?;
        let product = rate.times(factor).ok_or_else(|| {
            wrong(
                "learning.rate_multipliers",
                "times the rate is out of range",
                "keep it in 1e-6..=1e6",
            )
        })?;
        rates.push(product);
    }
    let decays = [("cosine", Decay::Cosine), ("constant", Decay::Constant)];
    let decay = word("learning.decay", &mut learning.decay, "cosine", &decays)?;
    let route = route(learning, rule)?;
    let shift_pixels = *learning.shift_pixels.get_or_insert(0);
    let halves = [("train", TrainOn::Train), ("all", TrainOn::All)];
    let train_on = word("learning.train_on", &mut learning.train_on, "train", &halves)?;
    let states = [("best_validation", Select::BestValidation), ("last", Select::Last)];
    let select_default = if train_on == TrainOn::All { "last" } else { "best_validation" };
    let select = word("learning.select", &mut learning.select, select_default, &states)?;
    if train_on == TrainOn::All && select == Select::BestValidation {
        let allowed = "validation examples are learnt from (train_on = \"all\"); use \"last\"";
        return Err(wrong("learning.select", "is \"best_validation\"", allowed));
    }
    if rule == Rule::Bp && (hardware.adc != Adc::Ideal || !hardware.tile.transposed_read) {
        let allowed = "back-propagation reads arrays from their columns: hw.tile.transposed_read = true and \
                       hw.adc = \"ideal\" (finite converters on rows are not simulated)";
        return Err(wrong("learning.rule", "is \"bp\"", allowed));
    }
    #[cfg(feature = "grown")]
    learning.grown.get_or_insert(0);
    let outputs = network.outputs;
    Ok(Config {
        seed,
        data,
        hidden,
        outputs,
        activations,
        weight_max_log2,
        bias_rows,
        gain_64ths,
        rule,
        mode,
        centre,
        route,
        batch,
        mantissa,
        rates,
        decay,
        epochs,
        shift_pixels,
        train_on,
        select,
        hardware,
        constants,
        not_simulated,
        hardware_name,
        resolved: file,
    })
}

fn route(learning: &mut LearningFile, rule: Rule) -> Result<Route, ConfigError> {
    let default = if rule == Rule::Dfa { "random_dense" } else { "modulo" };
    let names = [("modulo", 0), ("random_sparse", 1), ("scalar_broadcast", 2), ("random_dense", 3)];
    let kind = word("learning.route", &mut learning.route, default, &names)?;
    if rule == Rule::Dfa && kind != 3 {
        let allowed = "direct feedback alignment has random dense feedback; leave the key out";
        return Err(wrong("learning.route", "is not \"random_dense\"", allowed));
    }
    if kind == 0 && rule == Rule::Ed {
        learning.taps.get_or_insert(1);
    } else {
        // taps belong to ED's modulo route: a file may keep them while its rule or route is changed
        learning.taps = None;
    }
    let shift = learning.tap_shift;
    if shift.is_some_and(|shift| shift > 16) {
        return Err(wrong("learning.tap_shift", "is above 16", "a sum of words needs at most 16"));
    }
    Ok(match kind {
        0 => Route::Modulo { taps: learning.taps.unwrap_or(1), shift },
        1 => Route::RandomSparse,
        2 => Route::ScalarBroadcast,
        _ => Route::RandomDense { shift },
    })
}

fn gains(key: &str, gains: [f64; 2]) -> Result<[u32; 2], ConfigError> {
    let mut exact = [0; 2];
    for (exact, gain) in exact.iter_mut().zip(gains) {
        let found = (1..=1024u32).find(|&n| f64::from(n) / 64.0 == gain);
        *exact = found.ok_or_else(|| {
            wrong(key, format!("holds {gain}"), "gains are multiples of 1/64, up to 16")
        })?;
    }
    Ok(exact)
}

impl Config {
    /// The configuration as one self-contained file, every default written out.
    ///
    /// # Panics
    /// Never: every key has a TOML form.
    #[must_use]
    pub fn to_toml(&self) -> String {
        toml::to_string(&self.resolved).expect("every key has a TOML form")
    }

    /// The experiment for examples of `features` values and `classes` classes.
    ///
    /// # Errors
    /// When outputs, taps or image shifts do not fit the data.
    pub fn experiment(
        &self,
        features: usize,
        classes: usize,
        image: Option<[usize; 3]>,
    ) -> Result<Experiment, ConfigError> {
        let default = if self.rule == Rule::Kaneko && classes == 2 { 1 } else { classes };
        let outputs = self.outputs.unwrap_or(default);
        if outputs != classes && !(outputs == 1 && classes == 2) {
            let allowed =
                format!("the data has {classes} classes: use {classes}, or 1 for two classes");
            return Err(wrong("network.outputs", format!("is {outputs}"), allowed));
        }
        if self.rule == Rule::Kaneko && outputs != 1 {
            let allowed = format!(
                "Kaneko's rule has one output and two classes, but the data has {classes}; use a binary set such as \
                 xor or parity4, or rule = \"ed\""
            );
            return Err(wrong("learning.rule", "is \"kaneko\"", allowed));
        }
        if let Route::Modulo { taps, .. } = self.route
            && !(1..=outputs.min(4)).contains(&taps)
        {
            let allowed = format!("with {outputs} outputs it must lie in 1..={}", outputs.min(4));
            return Err(wrong("learning.taps", format!("is {taps}"), allowed));
        }
        let augment = match (self.shift_pixels, image) {
            (0, _) => None,
            (pixels, Some([height, width, channels])) if (pixels as usize) < height.min(width) => {
                Some(Augment { pixels, height, width, channels })
            }
            (pixels, _) => {
                let allowed = "only images larger than the shift can be moved";
                return Err(wrong("learning.shift_pixels", format!("is {pixels}"), allowed));
            }
        };
        let mut sizes = vec![features];
        sizes.extend(&self.hidden);
        sizes.push(outputs);
        let layers = (0..self.hidden.len() + 1).map(|layer| {
            let last = layer == self.hidden.len();
            let wiring = match (self.rule.is_dalean(), last) {
                (true, false) => Wiring::Dual,
                (true, true) => Wiring::DualReadout,
                (false, _) => Wiring::Single,
            };
            LayerSpec {
                inputs: sizes[layer],
                units: sizes[layer + 1],
                wiring,
                driven_by: if layer == 0 { DrivenBy::Shared } else { DrivenBy::Streams },
                activation: self.activations[layer],
                weight_max_log2: self.weight_max_log2[layer],
                gain_64ths: self.gain_64ths[usize::from(last)],
                constant_row: self.bias_rows,
            }
        });
        Ok(Experiment {
            seed: self.seed,
            hardware: self.hardware.clone(),
            layers: layers.collect(),
            rule: self.rule,
            mode: self.mode,
            centre: self.centre,
            route: self.route,
            batch: self.batch,
            mantissa: self.mantissa,
            rates: self.rates.clone(),
            decay: self.decay,
            epochs: self.epochs,
            augment,
        })
    }

    /// The rule as it was written.
    #[must_use]
    pub fn rule_name(&self) -> &str {
        self.resolved.learning.as_ref().and_then(|l| l.rule.as_deref()).unwrap_or("ed")
    }

    /// What may go wrong with these numbers, before anything runs.
    #[must_use]
    pub fn warnings(&self) -> Vec<String> {
        let mut warnings = Vec::new();
        for (layer, (rate, activation)) in self.rates.iter().zip(&self.activations).enumerate() {
            let Activation::Sigmoid(alpha) = *activation else { continue };
            let width = self.hidden.get(layer).copied().unwrap_or(0);
            let index = divergence_index(*rate, width, alpha);
            if index >= 320 {
                warnings.push(format!(
                    "layer {layer}: rate x width / alpha^2 is {index}; nets above about 320 to 570 diverge. Lower \
                     learning.rate or raise network.alpha"
                ));
            }
        }
        warnings.extend(self.constants.complaints());
        for (what, how) in &self.not_simulated {
            warnings.push(format!("not simulated: {what} ({how})"));
        }
        warnings
    }
}
