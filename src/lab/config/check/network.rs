//! `[network]`: units and what they are made of.

use super::learning::Kind;
use super::style::Style;
use super::{Bias, between, per_layer, positive, word, wrong};
use crate::chip::layer::{Gain, Homeostasis};
use crate::lab::config::ConfigError;
use crate::lab::config::file::{NetworkFile, PerLayer};
use crate::learn::error::OutputError;
use crate::learn::network::{GAIN_64THS, WEIGHT_MAX_LOG2};
use crate::num::tables::Activation;

/// Checked numbers of `[network]`.
pub(super) struct Network {
    pub(super) activations: Vec<Activation>,
    pub(super) weight_max_log2: Vec<i32>,
    pub(super) bias: Bias,
    pub(super) gain_64ths: [[u32; 2]; 2],
    pub(super) homeostasis: Homeostasis,
}

/// `network.bias`.
pub(super) const BIASES: [(&str, Bias); 3] =
    [("none", Bias::None), ("input_row", Bias::InputRow), ("rows", Bias::Rows)];

/// `network.activation`: nothing for a sigmoid, which has a width.
pub(super) const ACTIVATIONS: [(&str, Option<Activation>); 5] = [
    ("sigmoid", None),
    ("relu", Some(Activation::Relu)),
    ("identity", Some(Activation::Identity)),
    ("rms", Some(Activation::Rms)),
    ("ramp", Some(Activation::Ramp)),
];

/// `network.gain`, but for how far the table reaches.
pub(super) const GAINS: [(&str, Gain); 3] =
    [("table", Gain::Table), ("fixed", Gain::Fixed { spread: 0 }), ("tracking", Gain::Tracking)];
/// Greatest `network.gain_spread`.
const SPREAD_MAX: i64 = 2;
/// `log2` of the greatest `network.homeostasis_window`.
const WINDOW_LOG2_MAX: u32 = 24;

/// Checks a network whose layers have so many inputs and writes defaults back.
pub(super) fn resolve(
    file: &mut NetworkFile,
    fan_ins: &[usize],
    kind: Kind,
    error: OutputError,
    style: Style,
) -> Result<Network, ConfigError> {
    let bias = word("network.bias", &mut file.bias, "none", &BIASES)?;
    if word("network.readout", &mut file.readout, "p", &[("p", false), ("p-n", true)])? {
        let allowed = "classes are told apart by the p stream: use \"p\", or task = \"policy\"";
        return Err(wrong("network.readout", "is \"p-n\"", allowed));
    }
    let gain = if kind.is_symmetric() { [1.0, 1.0] } else { [1.5, 0.5] };
    let gain_64ths = [
        gains("network.init_gain", *file.init_gain.get_or_insert(gain))?,
        gains("network.init_gain_output", *file.init_gain_output.get_or_insert([1.0, 1.0]))?,
    ];
    Ok(Network {
        activations: activations(file, fan_ins.len(), kind, error, style)?,
        weight_max_log2: weights(file, fan_ins, style)?,
        bias,
        gain_64ths,
        homeostasis: homeostasis(file, fan_ins.len() > 1, style.middles())?,
    })
}

/// What ramps do by default beside their table; they have no step of their own.
#[derive(Debug, Clone, Copy)]
pub(super) struct Middles {
    pub(super) threshold: bool,
    /// `network.gain`.
    pub(super) gain: &'static str,
}

/// What hidden units do beside their table.
pub(super) fn homeostasis(
    file: &mut NetworkFile,
    hidden: bool,
    of_ramps: Middles,
) -> Result<Homeostasis, ConfigError> {
    let ramp = file.activation.as_deref() == Some("ramp") && hidden;
    let default = if ramp { of_ramps.gain } else { "table" };
    let threshold = *file.threshold.get_or_insert(ramp && of_ramps.threshold);
    let gain = word("network.gain", &mut file.gain, default, &GAINS)?;
    let gain = match (gain, file.gain_spread) {
        (Gain::Fixed { .. }, _) => {
            let spread = i64::from(*file.gain_spread.get_or_insert(0));
            let spread = between("network.gain_spread", spread, 0, SPREAD_MAX)?;
            Gain::Fixed { spread: u32::try_from(spread).expect("its range was checked") }
        }
        (other, None) => other,
        (_, Some(spread)) => {
            let allowed = "it belongs to network.gain = \"fixed\": say that, or take it out";
            return Err(wrong("network.gain_spread", format!("is {spread}"), allowed));
        }
    };
    let mut homeostasis = Homeostasis { threshold, gain, ..Homeostasis::OFF };
    if homeostasis.is_on() && !hidden {
        let key = if threshold { "network.threshold" } else { "network.gain" };
        let allowed =
            "hidden units alone keep to a middle, and there is no hidden layer: take it out";
        return Err(wrong(key, "is given", allowed));
    }
    match (homeostasis.moves(), file.homeostasis_window) {
        (true, _) => {
            let window = *file.homeostasis_window.get_or_insert(1 << Homeostasis::OFF.window_log2);
            let log2 = (0..=WINDOW_LOG2_MAX).find(|log2| window == 1 << log2);
            homeostasis.window_log2 = log2.ok_or_else(|| {
                let allowed = format!("it must be a power of two, 1..={}", 1 << WINDOW_LOG2_MAX);
                wrong("network.homeostasis_window", format!("is {window}"), allowed)
            })?;
        }
        (false, None) => {}
        (false, Some(window)) => {
            let allowed = "neither thresholds nor a gain that tracks move: take it out, or use network.threshold = true";
            return Err(wrong("network.homeostasis_window", format!("is {window}"), allowed));
        }
    }
    Ok(homeostasis)
}

/// The functions of all layers; outputs are sigmoid, or sums of which an error is made for all together.
fn activations(
    file: &mut NetworkFile,
    layers: usize,
    kind: Kind,
    error: OutputError,
    style: Style,
) -> Result<Vec<Activation>, ConfigError> {
    let hidden =
        word("network.activation", &mut file.activation, style.activation(), &ACTIVATIONS)?;
    let sums = matches!(error, OutputError::Softmax { .. });
    let sigmoid = (hidden.is_none() && layers > 1) || !sums;
    if let (false, Some(_)) = (sigmoid, &file.alpha) {
        let allowed = "it is the width of a sigmoid, and no layer has one: take it out (--set network.alpha=default)";
        return Err(wrong("network.alpha", "is given", allowed));
    }
    let mut alphas = vec![1.0; layers];
    if sigmoid {
        let own = if kind.seeded { PerLayer::All(1.0) } else { style.alpha(layers) };
        file.alpha.get_or_insert(own);
        alphas = per_layer("network.alpha", &mut file.alpha, 1.0, layers)?;
    }
    let layers = alphas.into_iter().enumerate().map(|(layer, alpha)| match hidden {
        _ if layer + 1 == layers && sums => Ok(Activation::Accumulator),
        Some(activation) if layer + 1 < layers => Ok(activation),
        _ => positive("network.alpha", alpha).map(Activation::Sigmoid),
    });
    layers.collect()
}

fn weights(
    file: &mut NetworkFile,
    fan_ins: &[usize],
    style: Style,
) -> Result<Vec<i32>, ConfigError> {
    file.weight_max.get_or_insert_with(|| style.weight_max(fan_ins));
    logarithms(per_layer("network.weight_max", &mut file.weight_max, 1.0, fan_ins.len())?)
}

/// `log2` of weights that are powers of two.
pub(super) fn logarithms(weights: Vec<f64>) -> Result<Vec<i32>, ConfigError> {
    let log2 = weights.into_iter().map(|weight| {
        let exact = WEIGHT_MAX_LOG2.into_iter().find(|&log2| f64::from(log2).exp2() == weight);
        exact.ok_or_else(|| {
            let allowed = "it must be a power of two from 1/256 to 256";
            wrong("network.weight_max", format!("is {weight}"), allowed)
        })
    });
    log2.collect()
}

fn gains(key: &str, gains: [f64; 2]) -> Result<[u32; 2], ConfigError> {
    let mut exact = [0; 2];
    for (exact, gain) in exact.iter_mut().zip(gains) {
        let found = GAIN_64THS.into_iter().find(|&n| f64::from(n) / 64.0 == gain);
        *exact = found.ok_or_else(|| {
            wrong(key, format!("holds {gain}"), "gains are multiples of 1/64, up to 16")
        })?;
    }
    Ok(exact)
}
