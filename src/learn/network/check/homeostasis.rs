//! Which layers can keep to a middle, in which windows, and that their sums fit.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use super::{Checked, NetworkSpec, misfit};
use crate::chip::engine::CALIBRATION_SAMPLES;
use crate::chip::hardware::{Adc, Hardware};
use crate::chip::layer::homeostasis::{SUMS_BELOW_LOG2, sums_max};
use crate::chip::layer::{Gain, LayerSpec};
use crate::chip::population::Stream;
use crate::learn::rule::UpdateMode;
use crate::num::tables::Activation;

/// Greatest spread of a gain that stays.
const SPREAD_MAX: u32 = 2;
/// Greatest window, as a power of two of samples.
const WINDOW_LOG2_MAX: u32 = 24;

/// Units that keep to a middle: hidden ones with a table, of steps that are found where it is a ramp.
pub(super) fn check(network: &NetworkSpec, hardware: &Hardware) -> Checked {
    let last = network.layers.len() - 1;
    for (at, layer) in network.layers.iter().enumerate() {
        let law = layer.homeostasis;
        let (ramp, gains) = (layer.activation == Activation::Ramp, law.gain != Gain::Table);
        if ramp && !gains {
            let allowed = "a ramp ends at 3 deviations, which have to be found: give it a gain, \"fixed\" or \"tracking\"";
            return misfit(
                "network.gain",
                format!("leaves the ramp of layer {at} as it is"),
                allowed,
            );
        }
        if !law.is_on() {
            continue;
        }
        let key = if law.threshold { "network.threshold" } else { "network.gain" };
        if at == last {
            let allowed = "outputs are compared with one another as they are; only hidden layers keep to a middle";
            return misfit(key, format!("is given to layer {at}, the output"), allowed);
        }
        if !layer.activation.has_table() {
            let allowed = "what is normalised has no table to be shifted; give it another activation or leave it out";
            return misfit(key, format!("is given to layer {at}, which is normalised"), allowed);
        }
        if gains && !ramp {
            let allowed = "steps of a deviation are those of a ramp; use network.activation = \"ramp\", or thresholds alone";
            let found = format!("finds the steps of layer {at}, which is no ramp");
            return misfit("network.gain", found, allowed);
        }
        if let Gain::Fixed { spread } = law.gain
            && spread > SPREAD_MAX
        {
            let found = format!("of layer {at} is {spread}");
            return misfit("network.gain_spread", found, format!("it is 0..={SPREAD_MAX}"));
        }
        window(network, at, law.window_log2)?;
        sums(network, hardware, at, layer)?;
    }
    Ok(())
}

/// A window that holds a batch, so that a mean never moves beyond what it is a mean of.
fn window(network: &NetworkSpec, at: usize, window_log2: u32) -> Checked {
    let key = "network.homeostasis_window";
    if window_log2 > WINDOW_LOG2_MAX {
        let found = format!("of layer {at} is 2^{window_log2} samples");
        return misfit(key, found, format!("it is 2^{WINDOW_LOG2_MAX} at most"));
    }
    let batch = u64::from(network.batch.get());
    if network.mode != UpdateMode::Online && batch > 1 << window_log2 {
        let found = format!("of layer {at} is {} samples", 1u64 << window_log2);
        let allowed = format!("it holds a batch, of {batch}: raise it, or lower learning.batch");
        return misfit(key, found, allowed);
    }
    Ok(())
}

/// Sums of a batch, or of what is read first, that 64 bits hold.
fn sums(network: &NetworkSpec, hardware: &Hardware, at: usize, layer: &LayerSpec) -> Checked {
    let rows = (layer.inputs + usize::from(layer.constant_row)) as u128;
    let pairs = layer.wiring.pairs(Stream::P).len() as u128;
    let exact = pairs
        * rows
        * u128::from(hardware.level_greatest())
        * u128::from(hardware.drive.bits.code_max());
    // a code rounds to no more than twice the current it stands for
    let most = if hardware.adc == Adc::Ideal { exact } else { 2 * exact };
    let samples = (network.batch.get() as usize).max(CALIBRATION_SAMPLES);
    let reads = samples as u128 * layer.positions() as u128;
    let sums = sums_max(layer, hardware.digital.lut_bits, most, reads);
    if sums >= 1 << SUMS_BELOW_LOG2 {
        let key = if layer.homeostasis.threshold { "network.threshold" } else { "network.gain" };
        let found = format!("adds up to 2^{} in layer {at}", sums.ilog2() + 1);
        let allowed = format!(
            "its registers hold less than 2^{SUMS_BELOW_LOG2}: fewer positions, a smaller learning.batch or fewer bits"
        );
        return misfit(key, found, allowed);
    }
    Ok(())
}
