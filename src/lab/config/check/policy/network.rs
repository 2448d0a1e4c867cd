//! `[network]` of a policy: actor and critic.

use super::super::network::{self, Middles, Network};
use super::super::{Bias, per_layer, positive, word, wrong};
use super::refuse;
use crate::chip::layer::Homeostasis;
use crate::lab::config::ConfigError;
use crate::lab::config::defaults::policy as defaults;
use crate::lab::config::file::NetworkFile;
use crate::num::tables::Activation;
use crate::task::environment::{EnvSpec, Shown};
use crate::task::policy::InputCoding;

/// `network.input`: nothing for what images have.
const INPUTS: [(&str, Option<InputCoding>); 6] = [
    ("split", Some(InputCoding::Split)),
    ("offset", Some(InputCoding::Offset)),
    ("signed", Some(InputCoding::Signed)),
    ("raw", None),
    ("on_off", None),
    ("white", None),
];

/// Checked numbers of `[network]`.
pub(super) struct Made {
    pub(super) hidden: Vec<usize>,
    pub(super) critic_hidden: Vec<usize>,
    pub(super) input: InputCoding,
    pub(super) network: Network,
}

/// Checks actor and critic and writes defaults back. With evolution there is no critic.
pub(super) fn resolve(
    file: &mut NetworkFile,
    spec: &EnvSpec,
    evolution: bool,
) -> Result<Made, ConfigError> {
    let hidden = file.hidden.get_or_insert_with(|| defaults::HIDDEN.to_vec()).clone();
    let critic_hidden = if evolution {
        const WHY: &str = "evolution has no critic: take the key out";
        refuse(&[("network.critic_hidden", file.critic_hidden.is_some(), WHY)])?;
        hidden.clone()
    } else {
        file.critic_hidden.get_or_insert_with(|| hidden.clone()).clone()
    };
    if critic_hidden.len() != hidden.len() {
        let found = format!("has {} layers", critic_hidden.len());
        let allowed = format!(
            "network.hidden has {}: weights and rates are told layer by layer for both, so give as many",
            hidden.len()
        );
        return Err(wrong("network.critic_hidden", found, allowed));
    }
    let layers = hidden.len() + 1;
    let readouts = [("p", false), ("p-n", true)];
    if !word("network.readout", &mut file.readout, "p-n", &readouts)? {
        let allowed = "what a policy puts out has a sign: use \"p-n\", or take the key out";
        return Err(wrong("network.readout", "is \"p\"", allowed));
    }
    let ramps = is_ramp(file) && !hidden.is_empty();
    file.weight_max.get_or_insert_with(|| defaults::weight_max(layers, ramps));
    let weights = per_layer("network.weight_max", &mut file.weight_max, 1.0, layers)?;
    let network = Network {
        activations: activations(file, hidden.len())?,
        weight_max_log2: network::logarithms(weights)?,
        bias: word("network.bias", &mut file.bias, "input_row", &network::BIASES)?,
        gain_64ths: [[64; 2]; 2],
        homeostasis: homeostasis(file, !hidden.is_empty())?,
    };
    Ok(Made { hidden, critic_hidden, input: input(file, spec, network.bias)?, network })
}

fn is_ramp(file: &NetworkFile) -> bool {
    file.activation.as_deref() == Some("ramp")
}

/// What hidden units of both networks do beside their table. What is normalised has none, and nothing is written back of it.
fn homeostasis(file: &mut NetworkFile, hidden: bool) -> Result<Homeostasis, ConfigError> {
    let beside = [file.threshold.is_some(), file.gain.is_some(), file.gain_spread.is_some()];
    if !(is_ramp(file) || beside.contains(&true) || file.homeostasis_window.is_some()) {
        return Ok(Homeostasis::OFF);
    }
    network::homeostasis(file, hidden, Middles { threshold: false, gain: "fixed" })
}

/// How numbers become drives; lines that are on are driven as they are.
fn input(file: &mut NetworkFile, spec: &EnvSpec, bias: Bias) -> Result<InputCoding, ConfigError> {
    if let Shown::Sparse { .. } = spec.shown {
        let why = "the environment shows lines that are on or off, which need no coding: take the key out";
        refuse(&[("network.input", file.input.is_some(), why)])?;
        return Ok(InputCoding::Split);
    }
    let coding = match word("network.input", &mut file.input, "split", &INPUTS)? {
        Some(coding) => coding,
        None => {
            let found = format!("is \"{}\"", file.input.as_deref().unwrap_or_default());
            return Err(wrong(
                "network.input",
                found,
                "it is of images: use split, offset or signed",
            ));
        }
    };
    if coding == InputCoding::Offset && bias == Bias::None {
        let allowed = "half the scale is added to every number, which only a constant row can take away: use bias = \
                       \"input_row\", or input = \"split\"";
        return Err(wrong("network.input", "is \"offset\" with bias = \"none\"", allowed));
    }
    Ok(coding)
}

/// The functions of all layers: outputs are sums.
fn activations(file: &mut NetworkFile, hidden: usize) -> Result<Vec<Activation>, ConfigError> {
    let found = word("network.activation", &mut file.activation, "rms", &network::ACTIVATIONS)?;
    let mut all = match found {
        Some(activation) => {
            let why =
                "it is the width of a sigmoid: take the key out, or use activation = \"sigmoid\"";
            refuse(&[("network.alpha", file.alpha.is_some(), why)])?;
            vec![activation; hidden]
        }
        None => {
            let alphas = per_layer("network.alpha", &mut file.alpha, defaults::ALPHA, hidden)?;
            let sigmoid = |alpha| positive("network.alpha", alpha).map(Activation::Sigmoid);
            alphas.into_iter().map(sigmoid).collect::<Result<_, _>>()?
        }
    };
    all.push(Activation::Accumulator);
    Ok(all)
}
