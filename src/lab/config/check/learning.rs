//! `[learning]`: rule, batches, rates, and which state is kept.

use super::{Select, TrainOn, per_layer, positive, range, route, word, wrong};
use crate::lab::config::ConfigError;
use crate::lab::config::file::LearningFile;
use crate::learn::error::Centre;
use crate::learn::route::Route;
use crate::learn::rule::{Rule, UpdateMode};
use crate::num::fixed::{Batch, RateMantissa};
use crate::num::tables::{Decay, Positive};

/// A rule as a file names it: what it is, and what it is by default.
#[derive(Clone, Copy)]
pub(super) struct Kind {
    pub(super) rule: Rule,
    /// The paper's seed rule: width 1, raw errors, symmetric gains.
    pub(super) seeded: bool,
}

impl Kind {
    /// Whether excitatory and inhibitory arrays start alike.
    pub(super) const fn is_symmetric(self) -> bool {
        self.seeded || !self.rule.is_dalean()
    }

    /// Whether errors stay as they are; a potentiating net has no centre either.
    fn is_raw(self) -> bool {
        self.seeded || self.rule == Rule::Kaneko
    }
}

/// Checked numbers of `[learning]`.
pub(super) struct Learning {
    pub(super) kind: Kind,
    pub(super) mode: UpdateMode,
    pub(super) centre: Centre,
    pub(super) route: Option<Route>,
    pub(super) batch: Batch,
    pub(super) mantissa: RateMantissa,
    pub(super) rates: Vec<Positive>,
    pub(super) decay: Decay,
    pub(super) epochs: u32,
    pub(super) shift_pixels: u32,
    pub(super) train_on: TrainOn,
    pub(super) select: Select,
}

/// Checks how a network of so many layers learns and writes defaults back.
pub(super) fn resolve(file: &mut LearningFile, layers: usize) -> Result<Learning, ConfigError> {
    let seeded = file.rule.as_deref() == Some("ed_seed");
    let rules = [
        ("ed", Rule::Ed),
        ("ed_seed", Rule::Ed),
        ("kaneko", Rule::Kaneko),
        ("dfa", Rule::Dfa),
        ("bp", Rule::Bp),
    ];
    let kind = Kind { rule: word("learning.rule", &mut file.rule, "ed", &rules)?, seeded };
    let centres = [("none", Centre::None), ("batch", Centre::Batch), ("running", Centre::Running)];
    let default = if kind.is_raw() { "none" } else { "batch" };
    let centre = word("learning.centre", &mut file.centre, default, &centres)?;
    let modes = [
        ("accumulate", UpdateMode::Accumulate),
        ("replay", UpdateMode::Replay),
        ("online", UpdateMode::Online),
    ];
    let mode = word("learning.mode", &mut file.mode, "accumulate", &modes)?;
    let mantissa = *file.rate_mantissa.get_or_insert(1);
    let decays = [("cosine", Decay::Cosine), ("constant", Decay::Constant)];
    let (train_on, select) = selection(file)?;
    Ok(Learning {
        kind,
        mode,
        centre,
        route: route::resolve(file, kind.rule)?,
        batch: range("learning.batch", Batch::new(*file.batch.get_or_insert(32)))?,
        mantissa: range("learning.rate_mantissa", RateMantissa::new(mantissa))?,
        rates: rates(file, layers)?,
        decay: word("learning.decay", &mut file.decay, "cosine", &decays)?,
        epochs: *file.epochs.get_or_insert(20),
        shift_pixels: *file.shift_pixels.get_or_insert(0),
        train_on,
        select,
    })
}

/// Rate times multiplier, of each layer.
fn rates(file: &mut LearningFile, layers: usize) -> Result<Vec<Positive>, ConfigError> {
    const KEY: &str = "learning.rate_multipliers";
    let rate = positive("learning.rate", *file.rate.get_or_insert(20.0))?;
    let factors = per_layer(KEY, &mut file.rate_multipliers, 1.0, layers)?;
    let rates = factors.into_iter().map(|factor| {
        let product = rate.times(positive(KEY, factor)?);
        product.ok_or_else(|| wrong(KEY, "times the rate is out of range", "keep it in 1e-6..=1e6"))
    });
    rates.collect()
}

/// What is learnt from, and which epoch's state reads the test set.
fn selection(file: &mut LearningFile) -> Result<(TrainOn, Select), ConfigError> {
    let halves = [("train", TrainOn::Train), ("all", TrainOn::All)];
    let train_on = word("learning.train_on", &mut file.train_on, "train", &halves)?;
    let states = [("best_validation", Select::BestValidation), ("last", Select::Last)];
    let default = if train_on == TrainOn::All { "last" } else { "best_validation" };
    let select = word("learning.select", &mut file.select, default, &states)?;
    if train_on == TrainOn::All && select == Select::BestValidation {
        let allowed = "validation examples are learnt from (train_on = \"all\"); use \"last\"";
        return Err(wrong("learning.select", "is \"best_validation\"", allowed));
    }
    Ok((train_on, select))
}
