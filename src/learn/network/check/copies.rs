//! Which arrays may stand on the chip more than once: those of convolutions, of cells that are alike.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use super::{Checked, NetworkSpec, misfit};
use crate::chip::hardware::Hardware;

/// Copies that share out the positions of a layer, and hold the same levels after the same pulses.
pub(super) fn check(network: &NetworkSpec, hardware: &Hardware) -> Checked {
    const KEY: &str = "network.copies";
    for (at, layer) in network.layers.iter().enumerate() {
        let (copies, positions) = (layer.copies, layer.positions());
        if copies == 1 {
            continue;
        }
        let found = format!("gives layer {at} {copies} copies");
        if copies == 0 {
            return misfit(KEY, found, "an array stands on the chip once at least: give it 1");
        }
        if layer.convolution.is_none() {
            let allowed = "a dense layer is read once a sample, which cannot be shared out: give copies to convolutions alone";
            return misfit(KEY, found, allowed);
        }
        if copies > positions {
            let allowed = format!(
                "it is read at {positions} positions of a sample, and every copy takes one at least: give it {positions} or fewer"
            );
            return misfit(KEY, found, allowed);
        }
        if let Some(key) = hardware.differs_by_cell() {
            let allowed = format!(
                "cells with {key} draw words of their own, so copies that are written alike would not stay alike: that is not \
                 simulated; take {key} out, or leave network.copies at 1"
            );
            return misfit(KEY, format!("{found}, beside {key}"), allowed);
        }
    }
    Ok(())
}
