//! What the user of a run should know: numbers, put into words where they are shown.

use std::fmt;

use serde::{Deserialize, Serialize};

/// Something a run showed that its user should know: numbers, put into words where they are shown.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(tag = "note", rename_all = "snake_case", deny_unknown_fields)]
#[non_exhaustive]
pub enum Note {
    /// Converters of a layer use few codes on the first training examples.
    LowCodes {
        /// Which layer.
        layer: usize,
        /// Greatest code.
        code_max: i64,
    },
    /// Cells of the chip hold one level.
    Stuck {
        /// Such cells.
        stuck: u64,
        /// Of so many.
        cells: u64,
    },
    /// Many conversions saturated while learning.
    Saturated {
        /// Epochs by then.
        epoch: u32,
        /// Conversions that did.
        saturated: u64,
        /// Of so many.
        conversions: u64,
    },
    /// An epoch knows less than half of what an earlier one knew.
    Forgot {
        /// Which epoch.
        epoch: u32,
        /// Right answers after it.
        correct: u64,
        /// Right answers after the best before it.
        best: u64,
    },
    /// Most indices of tables, or most gates, lie at their ends.
    Ends {
        /// Epochs by then.
        epoch: u32,
        /// `tables` or `gates`.
        of: String,
        /// Those at an end.
        saturated: u64,
        /// Of so many.
        all: u64,
    },
    /// Much of what a layer did in an epoch ended at a rail or a bound. Seen in records, not kept in receipts; so are
    /// those below.
    Clipped {
        /// Which layer.
        layer: usize,
        /// `conversions`, `tables`, `gates` or `requests`.
        of: String,
        /// The worst epoch.
        epoch: u32,
        /// Those at an end in it.
        clipped: u64,
        /// Of so many.
        all: u64,
        /// Epochs with too many.
        epochs: u32,
    },
    /// A layer received no pulse in an epoch.
    Still {
        /// Which layer.
        layer: usize,
        /// The first such epoch.
        epoch: u32,
        /// Such epochs.
        epochs: u32,
    },
    /// The units of a layer put out the same whatever was shown.
    Mute {
        /// Which layer.
        layer: usize,
        /// The first such epoch.
        epoch: u32,
        /// Such epochs.
        epochs: u32,
    },
    /// Cells are worn out.
    Worn {
        /// Such cells at the end.
        worn: u64,
        /// Of so many.
        cells: u64,
        /// The first epoch after which there was one.
        epoch: u32,
    },
    /// Answers that are no better than always giving the same one.
    Chance {
        /// Right answers.
        correct: u64,
        /// Of so many.
        total: u64,
        /// Right answers of always naming the most frequent class.
        constant: u64,
    },
}

fn percent(some: u64, all: u64) -> u128 {
    u128::from(some) * 100 / u128::from(all).max(1)
}

impl fmt::Display for Note {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::LowCodes { layer, code_max } => write!(
                f,
                "layer {layer}: on the first training examples the converters use codes 0 to {code_max} only; currents \
                 grow while learning, but if accuracy stays low, give them more hw.adc.bits or a smaller range"
            ),
            Self::Stuck { stuck, cells } => write!(
                f,
                "{stuck} of {cells} cells are stuck (hw.device.faults): they hold one level, whatever is loaded or written"
            ),
            Self::Saturated { epoch, saturated, conversions } => write!(
                f,
                "{} % of the conversions up to epoch {epoch} saturated: the range of the converters is too small for \
                 the currents of a net that learns. hw.adc.range = \"tracking\" widens it meanwhile; of a \
                 \"calibrated\" one, raise hw.adc.headroom",
                percent(*saturated, *conversions)
            ),
            Self::Forgot { epoch, correct, best } => write!(
                f,
                "epoch {epoch} knows {correct} right answers, an earlier one knew {best}: the network diverges; lower \
                 learning.rate or raise network.alpha"
            ),
            Self::Ends { epoch, of, saturated, all } => write!(
                f,
                "{} % of the {of} up to epoch {epoch} lie at an end of their range, where nothing is learnt; lower \
                 learning.rate, or raise network.alpha or network.weight_max",
                percent(*saturated, *all)
            ),
            Self::Clipped { layer, of, epoch, clipped, all, epochs } => {
                let (happened, cure) = match &**of {
                    "conversions" => (
                        "of the conversions saturated",
                        "the range of the converters is too small; hw.adc.range = \"tracking\" widens it while the \
                         net learns, of a \"calibrated\" one raise hw.adc.headroom",
                    ),
                    "tables" => (
                        "of the table indices lay at an end, where nothing is learnt",
                        "lower learning.rate, or raise network.alpha or network.weight_max",
                    ),
                    "gates" => (
                        "of the gates lay at an end",
                        "lower learning.rate, or raise network.alpha",
                    ),
                    _ => (
                        "of the requests were cut to the most pulses a write gives",
                        "raise hw.write.increment_max or lower learning.rate",
                    ),
                };
                let percent = percent(*clipped, *all);
                write!(f, "layer {layer}, epoch {epoch}: {percent} % {happened}")?;
                also(f, *epochs)?;
                write!(f, ": {cure}")
            }
            Self::Still { layer, epoch, epochs } => {
                write!(f, "layer {layer}: no cell received a pulse in epoch {epoch}")?;
                also(f, *epochs)?;
                f.write_str(
                    ": every request was rounded to none; raise learning.rate or the layer's multiplier, and keep \
                     hw.write.dither_bits above 0",
                )
            }
            Self::Mute { layer, epoch, epochs } => {
                write!(
                    f,
                    "layer {layer}: its units put out the same for every example after epoch {epoch}"
                )?;
                also(f, *epochs)?;
                f.write_str(
                    ": what it reads lies below a step of its converters or its table, or beyond their ends; use more \
                     hw.adc.bits or hw.lut.bits, or another learning.rate",
                )
            }
            Self::Worn { worn, cells, epoch } => write!(
                f,
                "{worn} of {cells} cells are worn out (hw.device.endurance), the first in epoch {epoch}: no pulse moves them \
                 any more; larger batches, lower rates and learning.optimiser = \"sign\" take fewer pulses"
            ),
            Self::Chance { correct, total, constant } => write!(
                f,
                "{correct} of {total} right answers are no better than chance: always naming the most frequent class \
                 gives {constant}; try another learning.rate, more learning.epochs, or see the other notes"
            ),
        }
    }
}

/// In how many epochs besides.
fn also(f: &mut fmt::Formatter<'_>, epochs: u32) -> fmt::Result {
    match epochs {
        0 | 1 => Ok(()),
        _ => write!(f, " ({epochs} such epochs)"),
    }
}
