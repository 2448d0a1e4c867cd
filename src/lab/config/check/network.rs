//! `[network]`: units and what they are made of.

use super::learning::Kind;
use super::{Bias, per_layer, positive, word, wrong};
use crate::lab::config::ConfigError;
use crate::lab::config::defaults::SetDefaults;
use crate::lab::config::file::NetworkFile;
use crate::learn::network::{GAIN_64THS, WEIGHT_MAX_LOG2};
use crate::num::tables::Activation;

/// Checked numbers of `[network]`.
pub(super) struct Network {
    pub(super) activations: Vec<Activation>,
    pub(super) weight_max_log2: Vec<i32>,
    pub(super) bias: Bias,
    pub(super) gain_64ths: [[u32; 2]; 2],
}

/// `network.bias`.
pub(super) const BIASES: [(&str, Bias); 3] =
    [("none", Bias::None), ("input_row", Bias::InputRow), ("rows", Bias::Rows)];

/// `network.activation`: nothing for a sigmoid, which has a width.
pub(super) const ACTIVATIONS: [(&str, Option<Activation>); 4] = [
    ("sigmoid", None),
    ("relu", Some(Activation::Relu)),
    ("identity", Some(Activation::Identity)),
    ("rms", Some(Activation::Rms)),
];

/// Checks a network of so many layers and writes defaults back.
pub(super) fn resolve(
    file: &mut NetworkFile,
    layers: usize,
    kind: Kind,
    defaults: &SetDefaults,
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
        activations: activations(file, layers, kind, defaults)?,
        weight_max_log2: weights(file, layers, defaults)?,
        bias,
        gain_64ths,
    })
}

/// The functions of all layers; outputs are sigmoid.
fn activations(
    file: &mut NetworkFile,
    layers: usize,
    kind: Kind,
    defaults: &SetDefaults,
) -> Result<Vec<Activation>, ConfigError> {
    let alpha = if kind.seeded { 1.0 } else { defaults.alpha };
    let alphas = per_layer("network.alpha", &mut file.alpha, alpha, layers)?;
    let hidden = word("network.activation", &mut file.activation, "sigmoid", &ACTIVATIONS)?;
    let layers = alphas.into_iter().enumerate().map(|(layer, alpha)| match hidden {
        Some(activation) if layer + 1 < layers => Ok(activation),
        _ => positive("network.alpha", alpha).map(Activation::Sigmoid),
    });
    layers.collect()
}

fn weights(
    file: &mut NetworkFile,
    layers: usize,
    defaults: &SetDefaults,
) -> Result<Vec<i32>, ConfigError> {
    let weights =
        per_layer("network.weight_max", &mut file.weight_max, defaults.weight_max, layers)?;
    logarithms(weights)
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
