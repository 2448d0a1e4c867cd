//! Reports: pages and tables made from records. Nothing here changes a result, opens a file or reads a clock.
//!
//! ```text
//! html(view)            one self-contained page: inline SVG, PNG data URIs, no external resource
//! text::summary(view)   the table at the end of `dalean train`
//! sweep::html(view)     the page of many runs, with the script that draws it; figures for papers beside it
//! ```
//!
//! Counts come as the records give them; all division happens here (docs/GLOSSARY.md, docs/MODEL.md, 4).
//! A figure is one file under `report/figures/` and one line in `figures::ALL`.

mod analysis;
mod chart;
mod colour;
pub mod compare;
mod device;
mod figures;
mod film;
mod image;
mod number;
mod page;
mod scale;
pub mod sweep;
pub mod text;
mod words;

#[cfg(test)]
mod sample;

pub use analysis::analysis_page;
pub use device::device_figure;
pub use film::{Film, Frame};

use super::config::Absent;
use super::price::Cost;
use super::store::ledger::LedgerRecord;
use super::store::record::{EpochRecord, Receipt, TimingRecord};

/// Levels of one pathway of one layer in the final state.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Heat {
    /// Layer, from 0 at the input.
    pub layer: usize,
    /// Name as in the records: `pp`, `np`, `nn`, `pn`, `e`, `i`.
    pub pathway: String,
    /// Input side.
    pub rows: usize,
    /// Output side.
    pub columns: usize,
    /// Row-major.
    pub levels: Vec<u16>,
}

/// One example that was answered wrongly, with its pixels.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Picture {
    /// Number in the test set.
    pub example: u64,
    /// True class.
    pub truth: u64,
    /// Predicted class.
    pub guess: u64,
    /// Pixels down.
    pub height: usize,
    /// Pixels across.
    pub width: usize,
    /// 1 for grey, 3 for red, green, blue.
    pub channels: usize,
    /// The value that means full brightness.
    pub full_scale: u8,
    /// Row-major, one plane a channel.
    pub values: Vec<u8>,
}

/// An input of a policy.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PolicyInput {
    /// What it is called.
    pub name: String,
    /// Rows of the first layer that it drives.
    pub rows: usize,
}

/// Everything a report shows, borrowed from the run.
#[derive(Debug, Clone)]
pub struct RunView<'a> {
    /// Heading of the page.
    pub title: String,
    /// Resolved configuration, TOML.
    pub config: &'a str,
    /// What went in and came out.
    pub receipt: &'a Receipt,
    /// What was learnt from, in one line.
    pub data: String,
    /// What it took on the machine that ran it.
    pub timing: &'a TimingRecord,
    /// What the user should know.
    pub warnings: &'a [String],
    /// What real chips do and the run did not.
    pub absent: &'a [Absent],
    /// One record an epoch, in order; epoch 0 is the state before the first update.
    pub epochs: &'a [EpochRecord],
    /// Highest level a cell can hold.
    pub level_max: u16,
    /// Final levels, any subset of the pathways.
    pub heats: &'a [Heat],
    /// Wrong answers.
    pub pictures: &'a [Picture],
    /// Inputs of a policy, in the order of the rows of the first layer.
    pub inputs: &'a [PolicyInput],
    /// The window of the first layer, where that is a convolution.
    pub window: Option<Sight>,
    /// An episode of a policy.
    pub film: Option<&'a Film>,
    /// Names of the classes; numbers stand in for missing ones.
    pub class_names: &'a [String],
    /// What was counted on the chip; only a finished run has it.
    pub ledger: Option<&'a LedgerRecord>,
    /// What the run cost on its chip.
    pub cost: Option<&'a Cost>,
}

impl RunView<'_> {
    /// The last record.
    fn last(&self) -> Option<&EpochRecord> {
        self.epochs.last()
    }

    /// Name of a class, or its number.
    fn class(&self, class: u64) -> String {
        let known = usize::try_from(class).ok().and_then(|class| self.class_names.get(class));
        known.cloned().unwrap_or_else(|| class.to_string())
    }

    /// Layers that have cells, in order.
    fn layers(&self) -> Vec<usize> {
        let mut layers: Vec<usize> = match self.last() {
            Some(last) => last.pathways.iter().map(|pathway| pathway.layer).collect(),
            None => Vec::new(),
        };
        layers.dedup();
        layers
    }
}

/// What one unit of a convolution sees at a position: rows in the order y, x, channel.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Sight {
    /// Rows and columns of pixels.
    pub side: usize,
    /// Channels of a pixel.
    pub channels: usize,
    /// Whether the second half of the channels carries what lies below the middle of the first.
    pub halves: bool,
}

/// The page, complete.
#[must_use]
pub fn html(view: &RunView<'_>) -> String {
    page::render(view)
}

#[cfg(test)]
mod tests;
