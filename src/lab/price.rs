//! What a run cost: counts x constants, cycles / clock, watts x seconds.
//!
//! ```text
//! energy   = sum over events of count x joules an event  +  watts of what idles x seconds      low, typical, high
//! seconds  = cycles / clock
//! ```
//!
//! Nothing here feeds back into a run: a ledger can be priced again when constants change, or with another chip's
//! constants as far as that chip would have done the same things ([`changes`]). Low totals add all lows, high totals
//! all highs: bounds, not a spread. See docs/MODEL.md, 4.6.
//!
//! ```
//! use dalean::lab::{config, price};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let sources = config::Sources { hardware: Some("hermes"), ..Default::default() };
//! let chip = config::load(&sources)?;
//! // 64 tiles, one phase
//! let convention = price::Convention::PAIRS;
//! let peak = price::peak(chip.hardware(), 64, 1, convention).expect("the model has a timing");
//! assert_eq!(peak.alone.0.cycles, 133);
//! assert_eq!(price::prefixed(peak.alone.1, "op/s"), "63.1 Top/s");
//! # Ok(())
//! # }
//! ```

mod bill;
mod changes;
mod convention;
mod cost;
mod peak;
mod piece;
mod plan;
mod stage;
mod total;
mod unit;

pub use bill::{Bill, Group, Idle, Line, Missing, Share, price};
pub use changes::{Change, changes};
pub use convention::Convention;
pub use cost::Cost;
pub use peak::{Figure, Peak, areas, figures, peak};
pub use piece::{PerPiece, PieceKind, Pieces};
pub use plan::{Footprint, LayerFootprint};
pub use stage::{StageUse, stages};
pub use total::{EnergySplit, EnergyTotal, Range};
pub use unit::{bounds, prefixed};
