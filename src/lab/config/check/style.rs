//! What a network is by default where its file is silent, beside what its data say: a net with convolutions keeps its units
//! to a middle of their own, unless it is to be the paper's.

use super::network::Middles;
use super::wrong;
use crate::lab::config::ConfigError;
use crate::lab::config::defaults::SetDefaults;
use crate::lab::config::file::{DataFile, PerLayer};
use crate::lab::data::{CatalogEntry, ImageShape, NamedSet};

/// Whose defaults.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Preset {
    /// This program's.
    Own,
    /// The paper's.
    Paper,
}

/// `preset`.
pub(super) const PRESETS: [(&str, Preset); 1] = [("paper", Preset::Paper)];

/// What decides the defaults of a network.
#[derive(Debug, Clone, Copy)]
pub(super) struct Style {
    pub(super) preset: Preset,
    /// Convolutions.
    pub(super) windows: usize,
    /// Height, width and channels of the examples, where that is known before they are read.
    pub(super) image: Option<[usize; 3]>,
    pub(super) data: &'static SetDefaults,
}

/// Sigmoid width of convolutions and of dense layers, of the paper.
const PAPER_ALPHA: [f64; 2] = [3.0, 6.0];

impl Style {
    pub(super) fn of(preset: Preset, windows: usize, data: &DataFile) -> Result<Self, ConfigError> {
        Ok(Self { preset, windows, image: image(data)?, data: SetDefaults::of(data) })
    }

    /// Whether units keep to a middle, outputs share one error and updates have one scale a layer.
    pub(super) const fn keeps_middles(self) -> bool {
        self.windows > 0 && matches!(self.preset, Preset::Own)
    }

    pub(super) const fn input(self) -> &'static str {
        match self.image {
            Some([.., 3]) if self.keeps_middles() => "white",
            _ => "raw",
        }
    }

    pub(super) const fn activation(self) -> &'static str {
        if self.keeps_middles() { "ramp" } else { "sigmoid" }
    }

    pub(super) fn hidden(self) -> Vec<usize> {
        if self.windows > 0 { vec![160] } else { self.data.hidden.to_vec() }
    }

    pub(super) const fn middles(self) -> Middles {
        let gain = if self.windows > 0 { "tracking" } else { "fixed" };
        Middles { threshold: self.keeps_middles(), gain }
    }

    /// Sigmoid width of each of so many layers.
    pub(super) fn alpha(self, layers: usize) -> PerLayer<f64> {
        let [window, dense] = PAPER_ALPHA;
        match (self.windows, self.preset) {
            (0, Preset::Own) => PerLayer::All(self.data.alpha),
            (0, Preset::Paper) => PerLayer::All(dense),
            (windows, _) => {
                let each = (0..layers).map(|at| if at < windows { window } else { dense });
                PerLayer::Each(each.collect())
            }
        }
    }

    /// Weight of the level after the greatest: of nets with convolutions the power of two nearest to `13 / sqrt(fan_in)`.
    pub(super) fn weight_max(self, fan_ins: &[usize]) -> PerLayer<f64> {
        if self.windows == 0 {
            return PerLayer::All(self.data.weight_max);
        }
        PerLayer::Each(fan_ins.iter().map(|&fan_in| nearest_weight(fan_in)).collect())
    }

    pub(super) const fn optimiser(self) -> &'static str {
        if self.keeps_middles() { "rms" } else { "plain" }
    }

    pub(super) const fn batch(self) -> i64 {
        if self.windows > 0 { 32 } else { self.data.batch }
    }

    pub(super) const fn taps(self) -> usize {
        match (self.windows, self.preset) {
            (0, Preset::Own) => self.data.taps,
            _ => 1,
        }
    }

    /// `learning.rate_multipliers` behind hidden layers of so many units.
    pub(super) fn multipliers(self, hidden: &[usize]) -> PerLayer<f64> {
        if self.windows > 0 { PerLayer::All(1.0) } else { self.data.multipliers(hidden) }
    }
}

/// The power of two nearest to `13 / sqrt(fan_in)` by ratio, of those that a weight may be: `2^(2k-1) <= 169 / fan_in < 2^(2k+1)`.
fn nearest_weight(fan_in: usize) -> f64 {
    let square = 169.0 / fan_in.max(1) as f64;
    let mut weight = 256.0;
    while weight > 1.0 / 256.0 && square < weight * weight / 2.0 {
        weight /= 2.0;
    }
    weight
}

/// The sizes of pictures that are known before they are read.
fn image(data: &DataFile) -> Result<Option<[usize; 3]>, ConfigError> {
    let whole = whole(data)?;
    let (Some(sides), Some([height, width, channels])) = (data.middle, whole) else {
        return Ok(whole);
    };
    let of = ImageShape { height, width, channels };
    let Some(ImageShape { height, width, channels }) = of.middle(sides) else {
        let allowed = format!("it is [rows, pixels of a row], at most [{height}, {width}]");
        return Err(wrong("data.middle", format!("is {sides:?}"), allowed));
    };
    Ok(Some([height, width, channels]))
}

/// The same before their middle is cut out.
fn whole(data: &DataFile) -> Result<Option<[usize; 3]>, ConfigError> {
    if let Some(shape) = data.shape {
        if shape.iter().any(|side| !(1..=4096).contains(side)) {
            let allowed = "it is [height, width, channels], each 1..=4096";
            return Err(wrong("data.shape", format!("is {shape:?}"), allowed));
        }
        return Ok(Some(shape));
    }
    let set: Option<NamedSet> = data.set.as_deref().and_then(|set| set.parse().ok());
    Ok(match set {
        Some(NamedSet::Optdigits) => Some([8, 8, 1]),
        Some(set) => CatalogEntry::of(set)
            .map(|entry| [entry.image.height, entry.image.width, entry.image.channels]),
        None => None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_range_is_the_nearest_power_of_two() {
        for (fan_in, wanted) in [
            (1, 16.0),
            (9, 4.0),
            (27, 2.0),
            (54, 2.0),
            (180, 1.0),
            (640, 0.5),
            (2560, 0.25),
            (160, 1.0),
            (usize::MAX, 1.0 / 256.0),
            // on the edge between two: 169 / fan_in = 1/2
            (338, 1.0),
            (339, 0.5),
        ] {
            assert_eq!(nearest_weight(fan_in), wanted, "{fan_in}");
        }
    }
}
