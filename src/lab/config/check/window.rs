//! `[network]`: what an example puts on rows, and convolutions before the dense layers.

use super::style::Style;
use super::{word, wrong};
use crate::chip::crossbar::kernel::ConvShape;
use crate::chip::layer::{DrivenBy, Homeostasis, InitialLevels, LayerSpec, Pool};
use crate::chip::population::Wiring;
use crate::lab::config::ConfigError;
use crate::lab::config::file::{NetworkFile, PaddingFile, PerLayer};
use crate::num::tables::Activation;
use crate::task::classify::Coding;

/// A convolution before the dense layers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Convolved {
    /// What its window moves over.
    pub(crate) shape: ConvShape,
    /// Output channels.
    pub(crate) units: usize,
    /// What is handed on.
    pub(crate) pool: Pool,
    /// How often it stands on the chip.
    pub(crate) copies: usize,
}

impl Convolved {
    /// Rows, columns and channels of what it hands on.
    pub(crate) fn pooled(self) -> [usize; 3] {
        let [height, width] = self.shape.output().map(|size| size / self.pool.side().max(1));
        [height, width, self.units]
    }

    /// The layer that it is, as far as windows and pools go.
    fn layer(self) -> LayerSpec {
        LayerSpec {
            inputs: self.shape.rows(),
            units: self.units,
            wiring: Wiring::Dual,
            driven_by: DrivenBy::Streams,
            activation: Activation::Ramp,
            weight_max_log2: 0,
            initial: InitialLevels::Uniform { gain_64ths: [64; 2] },
            constant_row: false,
            convolution: Some(self.shape),
            copies: self.copies,
            pool: self.pool,
            homeostasis: Homeostasis::OFF,
        }
    }
}

/// How values become drives.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum ImageInput {
    /// As they are.
    Raw,
    /// Above the mean of a channel, and below.
    OnOff,
    /// Whitened.
    White,
}

impl ImageInput {
    /// Whether a channel has two lines: above a middle, and below.
    pub(crate) const fn has_halves(self) -> bool {
        matches!(self, Self::OnOff | Self::White)
    }

    /// What it makes of images of this shape, for a network that begins with a convolution or without one.
    pub(crate) const fn coding(self, image: [usize; 3], convolution: bool) -> Coding {
        match self {
            Self::Raw if convolution => Coding::Pixels { image },
            Self::Raw => Coding::Values,
            Self::OnOff => Coding::OnOff { image },
            Self::White => Coding::White { image },
        }
    }
}

/// `network.input`: nothing for what policies have.
pub(super) const INPUTS: [(&str, Option<ImageInput>); 6] = [
    ("raw", Some(ImageInput::Raw)),
    ("on_off", Some(ImageInput::OnOff)),
    ("white", Some(ImageInput::White)),
    ("split", None),
    ("offset", None),
    ("signed", None),
];

/// What a square of a map hands on.
#[derive(Clone, Copy, PartialEq)]
enum Pooling {
    None,
    Average,
    Max,
}

const POOLS: [(&str, Pooling); 3] =
    [("none", Pooling::None), ("average", Pooling::Average), ("max", Pooling::Max)];

/// Checks input and convolutions and writes defaults back.
pub(super) fn resolve(
    file: &mut NetworkFile,
    style: Style,
) -> Result<(ImageInput, Vec<Convolved>), ConfigError> {
    let input = word("network.input", &mut file.input, style.input(), &INPUTS)?;
    let Some(input) = input else {
        let found = format!("is \"{}\"", file.input.as_deref().unwrap_or_default());
        let allowed = "it belongs to task = \"policy\": use raw, on_off or white";
        return Err(wrong("network.input", found, allowed));
    };
    let channels = file.channels.get_or_insert_default().clone();
    if channels.is_empty() {
        none(file)?;
        return Ok((input, vec![]));
    }
    let Some(image) = style.image else {
        let allowed = "a window moves over pictures: say their sizes with data.shape = [height, width, channels], or leave \
                       the key out";
        return Err(wrong("network.channels", "is given and the data names no pictures", allowed));
    };
    let coding = input.coding(image, true);
    let mut below = [image[0], image[1], coding.channels().unwrap_or(image[2])];
    let kernel = each("network.kernel", &mut file.kernel, 3, channels.len())?;
    let stride = each("network.stride", &mut file.stride, 1, channels.len())?;
    let same = PaddingFile::Named("same".into());
    let padding = each("network.padding", &mut file.padding, same, channels.len())?;
    let pools = pools(file, channels.len())?;
    let copies = each("network.copies", &mut file.copies, 1, channels.len())?;
    let mut all = Vec::new();
    for (at, units) in channels.into_iter().enumerate() {
        if units == 0 {
            let allowed = "give each convolution at least 1 channel";
            return Err(wrong("network.channels", format!("gives layer {at} none"), allowed));
        }
        let [height, width, channels] = below;
        let side = kernel[at];
        let pad = match &padding[at] {
            PaddingFile::Pixels(pad) => *pad,
            PaddingFile::Named(name) if name == "same" && side % 2 == 1 => side / 2,
            PaddingFile::Named(name) if name == "same" => {
                let found = format!("is \"same\" around a window of {side} x {side}");
                let allowed = "only windows of an odd side have one: use an odd network.kernel, or a number of pixels";
                return Err(wrong("network.padding", found, allowed));
            }
            PaddingFile::Named(name) => {
                let allowed =
                    "it is \"same\", a number of pixels, or a list with one a convolution";
                return Err(wrong("network.padding", format!("is \"{name}\""), allowed));
            }
        };
        let shape = ConvShape { channels, height, width, side, stride: stride[at], pad };
        let one = Convolved { shape, units, pool: pools[at], copies: copies[at] };
        if let Some((found, allowed)) = misshapen(one) {
            let found = format!("makes layer {at}, which {found}");
            return Err(wrong("network.channels", found, allowed));
        }
        below = one.pooled();
        all.push(one);
    }
    Ok((input, all))
}

/// What is wrong with its sizes. A layer is asked only of sizes whose products cannot overflow.
fn misshapen(one: Convolved) -> Option<(String, String)> {
    const MOST: usize = 65_535;
    let ConvShape { channels, height, width, side, stride, pad } = one.shape;
    let sizes = [channels, height, width, side, stride, pad, one.units, one.pool.side()];
    if sizes.iter().any(|&size| size > MOST) {
        let found = format!("is a convolution of {:?}", one.shape);
        return Some((found, format!("every size is at most {MOST}")));
    }
    one.layer().misshapen()
}

/// Refuses keys of convolutions where there are none.
fn none(file: &NetworkFile) -> Result<(), ConfigError> {
    let given = [
        ("network.kernel", file.kernel.is_some()),
        ("network.stride", file.stride.is_some()),
        ("network.padding", file.padding.is_some()),
        ("network.pool", file.pool.is_some()),
        ("network.pool_side", file.pool_side.is_some()),
        ("network.copies", file.copies.is_some()),
    ];
    match given.into_iter().find(|(_, given)| *given) {
        Some((key, _)) => {
            let allowed = "it belongs to convolutions: say network.channels, or take it out";
            Err(wrong(key, "is given and there is no convolution", allowed))
        }
        None => Ok(()),
    }
}

/// One value for all convolutions, or one for each.
fn each<T: Clone>(
    key: &str,
    value: &mut Option<PerLayer<T>>,
    default: T,
    windows: usize,
) -> Result<Vec<T>, ConfigError> {
    match value.get_or_insert(PerLayer::All(default)) {
        PerLayer::All(one) => Ok(vec![one.clone(); windows]),
        PerLayer::Each(list) if list.len() == windows => Ok(list.clone()),
        PerLayer::Each(list) => {
            let allowed = format!("there are {windows} convolutions; give {windows}, or one");
            Err(wrong(key, format!("has {} values", list.len()), allowed))
        }
    }
}

fn pools(file: &mut NetworkFile, windows: usize) -> Result<Vec<Pool>, ConfigError> {
    let names = each("network.pool", &mut file.pool, "average".to_owned(), windows)?;
    let kinds = names.into_iter().map(|name| word("network.pool", &mut Some(name), "", &POOLS));
    let kinds = kinds.collect::<Result<Vec<_>, _>>()?;
    if kinds.iter().all(|kind| *kind == Pooling::None) {
        return match file.pool_side {
            None => Ok(vec![Pool::None; windows]),
            Some(_) => {
                let allowed =
                    "nothing is pooled: take it out, or use network.pool = \"average\" or \"max\"";
                Err(wrong("network.pool_side", "is given beside network.pool = \"none\"", allowed))
            }
        };
    }
    let sides = each("network.pool_side", &mut file.pool_side, 2, windows)?;
    let pools = kinds.into_iter().zip(sides).map(|(kind, side)| match kind {
        Pooling::None => Pool::None,
        Pooling::Average => Pool::Average { side },
        Pooling::Max => Pool::Max { side },
    });
    Ok(pools.collect())
}

#[cfg(test)]
#[path = "window_tests.rs"]
mod tests;
