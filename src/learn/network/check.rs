//! What fits with what: every rule between the parts of a network, its way to learn and its chip, said once.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use super::{NetworkError, NetworkSpec};
use crate::chip::hardware::{Adc, Hardware, WriteScheme};
use crate::chip::layer::{self, DrivenBy, InitialLevels, LayerSpec, Optimiser};
use crate::chip::population::{Stream, Wiring};
use crate::learn::error::{Centre, OutputError};
use crate::learn::route::Route;
use crate::learn::rule::{Control, Readout, Rule, UpdateMode};
use crate::num::fixed::OutOfRange;
use crate::num::tables::{Activation, Lut, SHIFT_MAX, STEP_SHIFT_MAX};

/// `log2` of the least and the greatest `weight_max`.
pub const WEIGHT_MAX_LOG2: std::ops::RangeInclusive<i32> = -8..=8;
/// Initial gains, in 64ths: up to 16.
pub const GAIN_64THS: std::ops::RangeInclusive<u32> = 1..=1024;
/// Parts of a gain that is a fraction.
const GAIN_PART: std::ops::RangeInclusive<u32> = 1..=1024;
/// Greatest shift of the chance of a pulse: words have as many bits.
const CHANCE_SHIFT_MAX: u32 = 16;
/// Words a unit adds, at most.
const TAPS_MAX: usize = 4;
/// Shift of a sum of words, at most: nothing is left of it beyond.
const TAP_SHIFT_MAX: u32 = 16;

mod copies;
mod homeostasis;

type Checked = Result<(), NetworkError>;

fn misfit(key: &'static str, found: impl ToString, allowed: impl ToString) -> Checked {
    Err(NetworkError::Misfit { key, found: found.to_string(), allowed: allowed.to_string() })
}

pub(super) fn check(network: &NetworkSpec, hardware: &Hardware) -> Checked {
    sizes(network)?;
    copies::check(network, hardware)?;
    layer::check(&network.layers, hardware)?;
    numbers(network)?;
    tables(network, hardware)?;
    rule(network, hardware)?;
    activations(network)?;
    homeostasis::check(network, hardware)?;
    wiring(network)?;
    batches(network, hardware)?;
    convolutions(network, hardware)?;
    signed(network, hardware)?;
    routes(network)?;
    control(network)?;
    optimisers(network, hardware)?;
    rates(network, hardware)
}

/// Layers that have units and follow one another.
fn sizes(network: &NetworkSpec) -> Checked {
    if network.layers.iter().any(|layer| layer.units == 0) {
        return misfit("network.hidden", "has a layer of 0 units", "give at least 1 unit");
    }
    if network.layers.iter().any(|layer| layer.inputs == 0) {
        return misfit("network.hidden", "has a layer of 0 inputs", "give it at least 1 value");
    }
    let last = network.layers.len().saturating_sub(1);
    for (at, layer) in network.layers.iter().enumerate() {
        if let Some((found, allowed)) = layer.misshapen() {
            return misfit("network.channels", format!("makes layer {at}, which {found}"), allowed);
        }
        if layer.convolution.is_some() && at == last {
            let allowed = "outputs are dense: give it a dense layer behind";
            return misfit("network.channels", "makes the output a convolution", allowed);
        }
    }
    for (at, pair) in network.layers.windows(2).enumerate() {
        let (units, inputs) = (pair[0].sample_outputs(), pair[1].sample_inputs());
        if units != inputs || !pair[1].meets(&pair[0]) {
            let found =
                format!("gives layer {at} {units} units, and layer {} {inputs} inputs", at + 1);
            return misfit(
                "network.hidden",
                found,
                "the units of a layer are the inputs of the next",
            );
        }
    }
    Ok(())
}

/// Weights and gains that levels can stand for.
fn numbers(network: &NetworkSpec) -> Checked {
    let last = network.layers.len() - 1;
    for (at, LayerSpec { weight_max_log2, initial, .. }) in network.layers.iter().enumerate() {
        if !WEIGHT_MAX_LOG2.contains(weight_max_log2) {
            let found = format!("of layer {at} is 2^{weight_max_log2}");
            let allowed = "it must be a power of two from 1/256 to 256";
            return misfit("network.weight_max", found, allowed);
        }
        let key = if at == last { "network.init_gain_output" } else { "network.init_gain" };
        match initial {
            InitialLevels::Uniform { gain_64ths } => {
                if let Some(gain) = gain_64ths.iter().find(|&&gain| !GAIN_64THS.contains(&gain)) {
                    let found = format!("of layer {at} holds {gain}/64");
                    return misfit(key, found, "gains are multiples of 1/64, up to 16");
                }
            }
            InitialLevels::AbsGaussian { gain: [n, d] } => {
                let fits = GAIN_PART.contains(n) && GAIN_PART.contains(d);
                if !fits || *n > 16 * *d {
                    let found = format!("of layer {at} is {n}/{d}");
                    let allowed = "both parts are 1 to 1024, and a gain is at most 16";
                    return misfit(key, found, allowed);
                }
            }
        }
    }
    Ok(())
}

/// Tables whose steps the look-up can shift by.
fn tables(network: &NetworkSpec, hardware: &Hardware) -> Checked {
    let bits = hardware.digital.lut_bits;
    for (at, layer) in network.layers.iter().enumerate() {
        let shift = Lut::step_shift(layer.activation, bits, layer::unit(layer, hardware));
        if shift > STEP_SHIFT_MAX {
            let found = format!("gives layer {at} a table whose step is 2^{shift} units of a sum");
            let allowed = format!(
                "it is 2^{STEP_SHIFT_MAX} at most: lower network.alpha (2^{} times is enough), or raise \
                 network.weight_max or hw.lut.bits",
                shift - STEP_SHIFT_MAX
            );
            return misfit("network.alpha", found, allowed);
        }
    }
    Ok(())
}

/// What a rule asks of outputs and chip.
fn rule(network: &NetworkSpec, hardware: &Hardware) -> Checked {
    match network.rule {
        Rule::Ed | Rule::EdNonDalean | Rule::Dfa => Ok(()),
        Rule::Kaneko if network.outputs() == 1 => Ok(()),
        Rule::Kaneko => {
            let allowed = format!(
                "Kaneko's rule has one output and two classes, but the network has {} outputs; use a binary set such as \
                 xor or parity4, or rule = \"ed\"",
                network.outputs()
            );
            misfit("learning.rule", "is \"kaneko\"", allowed)
        }
        Rule::Bp if hardware.adc == Adc::Ideal && hardware.tile.transposed_read => Ok(()),
        Rule::Bp => {
            let allowed = "back-propagation reads arrays from their columns: hw.tile.transposed_read = true and \
                           hw.adc = \"ideal\" (finite converters on rows are not simulated)";
            misfit("learning.rule", "is \"bp\"", allowed)
        }
    }
}

/// Units that are normalised drive others, units that keep their accumulators drive none; what is then read out has errors
/// that a task hands, from which nothing is subtracted.
fn activations(network: &NetworkSpec) -> Checked {
    let last = network.layers.len() - 1;
    for (at, layer) in network.layers.iter().enumerate() {
        match layer.activation {
            Activation::Rms if at == last => {
                let allowed = "outputs are read one by one, by a table or as accumulators; only hidden layers are normalised";
                return misfit("network.activation", format!("normalises layer {at}"), allowed);
            }
            Activation::Accumulator if at < last => {
                let allowed =
                    "units that drive others have activities: give them a table, or normalise them";
                let found = format!("keeps the accumulators of layer {at}");
                return misfit("network.activation", found, allowed);
            }
            Activation::Accumulator
                if network.error == OutputError::OneVsAll && network.centre != Centre::None =>
            {
                let allowed = "where accumulators are read out, the task hands the errors and nothing is subtracted: use \
                               learning.centre = \"none\"";
                return misfit("learning.centre", "is not \"none\"", allowed);
            }
            _ => {}
        }
    }
    if network.error == OutputError::OneVsAll {
        return Ok(());
    }
    if network.layers[last].activation != Activation::Accumulator {
        let allowed =
            "accumulators are looked up, and no activities: outputs of such a network keep theirs";
        return misfit("learning.error", "is \"softmax\" beside outputs with a table", allowed);
    }
    if network.outputs() < 2 {
        let allowed =
            "a single output has nothing to share with; give it one a class, or use \"one_vs_all\"";
        return misfit("learning.error", "is \"softmax\" of one output", allowed);
    }
    Ok(())
}

/// Two populations under Dale's law; for what breaks it, differential pairs, in two populations or one stream.
fn wiring(network: &NetworkSpec) -> Checked {
    let last = network.layers.len() - 1;
    for (at, layer) in network.layers.iter().enumerate() {
        let wanted =
            network.rule.wiring((at == last).then(|| Readout::of(layer.activation, network.error)));
        if layer.wiring != wanted {
            let found =
                format!("does not fit the arrays of layer {at}, which {}", wired(layer.wiring));
            let allowed = format!(
                "error diffusion has two populations and reads one out, baselines have differential pairs: make arrays that {}",
                wired(wanted)
            );
            return misfit("learning.rule", found, allowed);
        }
        let below = at.checked_sub(1).map(|below| network.layers[below].activation);
        let drives = match below {
            None if layer.driven_by == DrivenBy::Signed => DrivenBy::Signed,
            None => DrivenBy::Shared,
            Some(Activation::Rms) => DrivenBy::Normalised,
            Some(_) => DrivenBy::Streams,
        };
        if layer.driven_by != drives {
            let shared = |drives: DrivenBy| match drives {
                DrivenBy::Shared => "one set of drives",
                DrivenBy::Signed => "one set of drives with a sign",
                DrivenBy::Streams => "a set of drives for each stream",
                DrivenBy::Normalised => "a set of normalised drives for each stream",
            };
            let found = format!("gives layer {at} {}", shared(layer.driven_by));
            let allowed = format!(
                "data drive both streams of the first layer alike, and streams those of the others: give it {}",
                shared(drives)
            );
            return misfit("network.hidden", found, allowed);
        }
    }
    Ok(())
}

/// What the arrays of a layer do, in words.
const fn wired(wiring: Wiring) -> &'static str {
    match wiring {
        Wiring::Dual => "have two populations above and below",
        Wiring::DualReadout => "read one of two populations out",
        Wiring::Single => "are differential pairs",
        Wiring::DualPairs => "have two populations of differential pairs",
        Wiring::DualReadoutPairs => "read one of two populations out by differential pairs",
    }
}

/// What is centred over, and when it is written.
fn batches(network: &NetworkSpec, hardware: &Hardware) -> Checked {
    if network.centre == Centre::Batch {
        if network.mode == UpdateMode::Online {
            let allowed = "one sample has no mean; use learning.centre = \"running\" or \"none\" with mode = \"online\"";
            return misfit("learning.centre", "is \"batch\"", allowed);
        }
        if network.batch.get() == 1 {
            let allowed = "a batch of one has no error beside its mean and learns nothing; use learning.centre = \
                           \"running\" or \"none\", or a larger learning.batch";
            return misfit("learning.centre", "is \"batch\"", allowed);
        }
    }
    if network.mode == UpdateMode::Accumulate && hardware.write.scheme != WriteScheme::Rounded {
        let allowed = "trains write one sample at a time; with hw.write.scheme = \"rank1\" use mode = \"replay\" or \
                       \"online\"";
        return misfit("learning.mode", "is \"accumulate\"", allowed);
    }
    Ok(())
}

/// Samples whose products with drives that have a sign a sum holds: two a sample.
const SIGNED_MAX: u32 = 2048;

/// What a first layer can do whose drives have a sign.
fn signed(network: &NetworkSpec, hardware: &Hardware) -> Checked {
    let first = &network.layers[0];
    if first.driven_by != DrivenBy::Signed {
        return Ok(());
    }
    let found = |what: &str| format!("is \"signed\" {what}");
    if first.convolution.is_some() {
        let allowed =
            "a window moves over codes of one sign: use \"split\", or a dense first layer";
        return misfit("network.input", found("beside convolutions"), allowed);
    }
    if first.homeostasis.is_on() {
        let allowed = "thresholds and gains follow what drives of one sign read: use \"split\", or take them out";
        return misfit("network.input", found("beside network.threshold or network.gain"), allowed);
    }
    if hardware.write.scheme != WriteScheme::Rounded {
        let allowed = "a train has no sign of its own for what lies below 0: use \"split\", or hw.write.scheme = \"rounded\"";
        return misfit("network.input", found("beside hw.write.scheme = \"rank1\""), allowed);
    }
    if network.rule == Rule::Kaneko {
        let allowed =
            "Kaneko's rule only potentiates, and takes drives of one sign: use another rule";
        return misfit("network.input", found("beside rule = \"kaneko\""), allowed);
    }
    if network.batch.get() > SIGNED_MAX {
        let allowed = format!(
            "of numbers with a sign a sum takes two products a sample, and 4096 at most: use a batch of {SIGNED_MAX} or \
             fewer, or input = \"split\""
        );
        return misfit("learning.batch", format!("is {}", network.batch.get()), allowed);
    }
    Ok(())
}

/// Reads of a sum that 32 bits hold: 65,536 products of a drive and a gate.
const READS_MAX: u64 = 65_536;

/// What layers whose windows move over an image can do.
fn convolutions(network: &NetworkSpec, hardware: &Hardware) -> Checked {
    for (at, layer) in network.layers.iter().enumerate() {
        if layer.convolution.is_none() {
            continue;
        }
        let below = at.checked_sub(1).map(|below| network.layers[below].activation);
        if layer.activation == Activation::Rms || below == Some(Activation::Rms) {
            let allowed = "a read of a convolution is not normalised, and does not follow what is: give it a table";
            return misfit("network.activation", format!("normalises around layer {at}"), allowed);
        }
        let positions = layer.positions() as u64;
        let reads = u64::from(network.batch.get()).saturating_mul(positions);
        if reads > READS_MAX {
            let found = format!("is {}", network.batch.get());
            let allowed = format!(
                "layer {at} has {positions} positions, and a sum runs over {READS_MAX} reads at most: use a batch of {} or \
                 fewer",
                READS_MAX / positions
            );
            return misfit("learning.batch", found, allowed);
        }
        if hardware.write.scheme != WriteScheme::Rounded {
            let allowed = "a train writes one read of one sample, and a sample of a convolution has many: use \"rounded\"";
            return misfit("hw.write.scheme", "is \"rank1\" beside convolutions", allowed);
        }
        let wide = matches!(
            network.optimisers.get(at),
            Some(Optimiser::Momentum { .. } | Optimiser::AdamFx { .. })
        );
        if wide && reads > crate::chip::crossbar::SHORT_READS as u64 {
            let found = format!("keeps words of layer {at} that are for sums of few reads");
            let allowed = format!(
                "with momentum or adam_fx a sum runs over {} reads at most: use \"rms\", \"sign\" or \"plain\"",
                crate::chip::crossbar::SHORT_READS
            );
            return misfit("learning.optimiser", found, allowed);
        }
    }
    Ok(())
}

/// A route that the rule has, with taps that the words of the output can give.
fn routes(network: &NetworkSpec) -> Checked {
    let Some(route) = network.route else {
        return match network.rule {
            Rule::Bp => Ok(()),
            Rule::Ed | Rule::EdNonDalean | Rule::Kaneko | Rule::Dfa => {
                let allowed = "every other rule than \"bp\" has one, such as \"modulo\"";
                misfit("learning.route", "is missing", allowed)
            }
        };
    };
    match network.rule {
        Rule::Bp => {
            let allowed = "back-propagation has no route: errors come down through the layers above; leave the key out";
            return misfit("learning.route", "is given beside rule = \"bp\"", allowed);
        }
        Rule::Dfa if !matches!(route, Route::RandomDense { .. }) => {
            let allowed = "direct feedback alignment has random dense feedback; leave the key out";
            return misfit("learning.route", "is not \"random_dense\"", allowed);
        }
        Rule::Ed | Rule::EdNonDalean | Rule::Kaneko | Rule::Dfa => {}
    }
    let most = TAPS_MAX.min(network.outputs());
    let shift = match route {
        Route::Modulo { taps, .. } if !(1..=most).contains(&taps) => {
            let outputs = network.outputs();
            let allowed = format!("with {outputs} outputs it must lie in 1..={most}");
            return misfit("learning.taps", format!("is {taps}"), allowed);
        }
        Route::Modulo { taps: 1, shift: Some(shift) } => {
            let allowed = "with one tap there is no sum to shift: leave the key out, or use more learning.taps";
            return misfit("learning.tap_shift", format!("is {shift}"), allowed);
        }
        Route::Modulo { shift, .. } | Route::RandomDense { shift } => shift,
        Route::RandomSparse | Route::ScalarBroadcast => None,
    };
    match shift {
        Some(shift) if shift > TAP_SHIFT_MAX => {
            let allowed = format!("a sum of words needs at most {TAP_SHIFT_MAX}");
            misfit("learning.tap_shift", format!("is {shift}"), allowed)
        }
        _ => Ok(()),
    }
}

/// Something to take away.
fn control(network: &NetworkSpec) -> Checked {
    const KEY: &str = "learning.control";
    let hidden = network.layers.len() > 1;
    match network.control {
        Control::FrozenHidden if !hidden => {
            let allowed = "there is no hidden layer to freeze; add one, or take the key out";
            misfit(KEY, "is \"frozen_hidden\"", allowed)
        }
        Control::SameSignHidden if !hidden => {
            let allowed = "there is no hidden layer that could hear the wrong sign; add one, or take the key out";
            misfit(KEY, "is \"same_sign_hidden\"", allowed)
        }
        control if control.is_alike(false) => {
            let hears_n = |layer: &LayerSpec| layer.wiring.targets().contains(&Stream::N);
            if network.layers.iter().any(hears_n) {
                return Ok(());
            }
            let allowed = "no layer has a stream n that could hear the wrong sign: it belongs to rules with two \
                           populations and hidden layers, or outputs read as \"p-n\"; take the key out";
            misfit(KEY, "is a wrong sign in stream n", allowed)
        }
        _ => Ok(()),
    }
}

/// A rate a layer, each of which a shift stands for.
fn rates(network: &NetworkSpec, hardware: &Hardware) -> Checked {
    let (found, layers) = (network.rates.len(), network.layers.len());
    if found != layers {
        let allowed = format!("there are {layers} layers (hidden and output); give {layers}");
        return misfit("learning.rate_multipliers", format!("makes {found} rates"), allowed);
    }
    let found = network.mantissas.len();
    if found != layers {
        let allowed = format!("there are {layers} layers (hidden and output); give {layers}");
        return misfit("learning.rate_mantissa", format!("has {found} numbers"), allowed);
    }
    for (at, rate) in network.rates(hardware).enumerate() {
        let k = rate.shift().map_err(|error| no_shift(at, &error))?;
        let most = CHANCE_SHIFT_MAX - network.layers[at].wiring.shift_extra();
        if network.optimisers[at].is_sign() && k > most {
            let found = format!("gives layer {at} a chance of 2^-{k} that a cell is pulsed");
            let allowed =
                format!("words of 16 bits give 2^-{most} at least: raise it or its multiplier");
            return misfit("learning.rate", found, allowed);
        }
    }
    Ok(())
}

/// An optimiser a layer, on a chip and with a way to write that it makes sense with.
fn optimisers(network: &NetworkSpec, hardware: &Hardware) -> Checked {
    let layers = network.layers.len();
    for (key, found) in [
        ("learning.optimiser", network.optimisers.len()),
        ("learning.centred", network.centred.len()),
    ] {
        if found != layers {
            let allowed = format!("there are {layers} layers (hidden and output); give {layers}");
            return misfit(key, format!("says it of {found} layers"), allowed);
        }
    }
    let other = network.optimisers.iter().any(|&optimiser| optimiser != Optimiser::Plain);
    let centred = network.centred.contains(&true);
    if network.mode != UpdateMode::Accumulate && (other || centred) {
        let key = if other { "learning.optimiser" } else { "learning.centred" };
        let found = if other { "is not \"plain\"" } else { "is true of a layer" };
        let allowed = "such requests are made of the sums of a whole batch; use learning.mode = \"accumulate\"";
        return misfit(key, found, allowed);
    }
    if network.rule == Rule::Kaneko && centred {
        let allowed = "Kaneko's rule only potentiates, and what is centred falls as often as it rises; leave it out";
        return misfit("learning.centred", "is true of a layer beside rule = \"kaneko\"", allowed);
    }
    for (at, optimiser) in network.optimisers.iter().enumerate() {
        let (name, decays) = match *optimiser {
            Optimiser::Sign { .. } => ("sign", [1, 1]),
            Optimiser::Rms => ("rms", [1, 1]),
            Optimiser::Momentum { decay } => ("momentum", [decay, 1]),
            Optimiser::AdamFx { first_decay, second_decay } => {
                ("adam_fx", [first_decay, second_decay])
            }
            _ => continue,
        };
        if let Some(decay) =
            decays.iter().find(|decay| !(1..=Optimiser::DECAY_MAX).contains(*decay))
        {
            let found = format!("forgets 2^-{decay} in layer {at}");
            let allowed = format!("a decay is 1..={}", Optimiser::DECAY_MAX);
            return misfit("learning.optimiser", found, allowed);
        }
        let found = format!("is \"{name}\" in layer {at}");
        if optimiser.is_sign() && hardware.write.residual_bits.get() > 0 {
            let allowed = "it asks for whole pulses, of which no remainder is left; use hw.write.residual_bits = 0";
            return misfit("learning.optimiser", found, allowed);
        }
        let scales = optimiser.is_sign() || *optimiser == Optimiser::Rms;
        if scales && network.mantissas.get(at).is_some_and(|mantissa| mantissa.get() != 1) {
            let allowed = "what it scales pulses by has no mantissa of yours beside it; leave learning.rate_mantissa at 1";
            return misfit("learning.optimiser", found, allowed);
        }
    }
    Ok(())
}

/// A rate for which there is no shift.
pub(super) fn no_shift(layer: usize, error: &OutOfRange) -> NetworkError {
    let k = error.found;
    let (rate, others, by) =
        if k > 0 { ("raise", "lower", k - i64::from(SHIFT_MAX)) } else { ("lower", "raise", -k) };
    let allowed = format!(
        "k is the number of bits that its sums of products are shifted by, 0..={SHIFT_MAX}: {rate} learning.rate or its \
         multiplier (2^{by} times is enough), or {others} learning.batch, learning.rate_mantissa or network.weight_max"
    );
    NetworkError::misfit("learning.rate", format!("gives layer {layer} a k of {k}"), allowed)
}
