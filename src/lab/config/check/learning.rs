//! `[learning]`: rule, batches, rates, and which state is kept.

use std::num::NonZeroU32;

use super::style::Style;
use super::{
    Select, TrainOn, between, one_a_layer, per_layer, positive, range, route, word, wrong,
};
use crate::chip::layer::Optimiser;
use crate::lab::config::ConfigError;
use crate::lab::config::defaults::policy;
use crate::lab::config::file::{LearningFile, MantissaFile};
use crate::learn::error::{Centre, OutputError};
use crate::learn::route::Route;
use crate::learn::rule::{Control, Rule, UpdateMode};
use crate::num::fixed::{Batch, RateMantissa};
use crate::num::tables::{Decay, Positive, Rate};

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

/// What a rule is called for.
#[derive(Clone, Copy)]
pub(super) enum Named {
    /// A rule by itself.
    Rule(Rule),
    /// The paper's seed rule.
    Seeded,
    /// Evolution, of policies.
    Evolution,
}

/// `learning.rule`.
pub(super) const RULES: [(&str, Named); 7] = [
    ("ed", Named::Rule(Rule::Ed)),
    ("ed_seed", Named::Seeded),
    ("ed_non_dalean", Named::Rule(Rule::EdNonDalean)),
    ("kaneko", Named::Rule(Rule::Kaneko)),
    ("dfa", Named::Rule(Rule::Dfa)),
    ("bp", Named::Rule(Rule::Bp)),
    ("es", Named::Evolution),
];
/// `learning.mode`.
pub(super) const MODES: [(&str, UpdateMode); 3] = [
    ("accumulate", UpdateMode::Accumulate),
    ("replay", UpdateMode::Replay),
    ("online", UpdateMode::Online),
];
/// `learning.centre`.
pub(super) const CENTRES: [(&str, Centre); 3] =
    [("none", Centre::None), ("batch", Centre::Batch), ("running", Centre::Running)];
/// `learning.control`.
pub(super) const CONTROLS: [(&str, Control); 4] = [
    ("none", Control::None),
    ("frozen_hidden", Control::FrozenHidden),
    ("same_sign_hidden", Control::SameSignHidden),
    ("same_sign", Control::SameSign),
];
/// `learning.decay`.
pub(super) const DECAYS: [(&str, Decay); 3] =
    [("cosine", Decay::Cosine), ("linear", Decay::Linear), ("constant", Decay::Constant)];
/// `learning.optimiser`, but for what further keys say of it.
const OPTIMISERS: [(&str, Optimiser); 5] = [
    ("plain", Optimiser::Plain),
    ("sign", Optimiser::Sign { dead_zone: false }),
    ("rms", Optimiser::Rms),
    ("momentum", Optimiser::Momentum { decay: 3 }),
    ("adam_fx", Optimiser::AdamFx { first_decay: 3, second_decay: 8 }),
];

/// `learning.error`.
const ERRORS: [(&str, OutputError); 2] = [
    ("one_vs_all", OutputError::OneVsAll),
    ("softmax", OutputError::Softmax { temperature: Positive::ONE }),
];

/// Rate of optimisers whose rate is a step of weights, of nets that keep to middles; and of `plain`, whose rate is one of
/// slopes of 1.
const RATE_RMS: f64 = 0.1;
const RATE_OF_RAMPS: f64 = 0.3;

/// Checked numbers of `[learning]`.
pub(super) struct Learning {
    pub(super) kind: Kind,
    pub(super) mode: UpdateMode,
    pub(super) centre: Centre,
    pub(super) control: Control,
    pub(super) refresh: Option<NonZeroU32>,
    pub(super) centred: bool,
    pub(super) error: OutputError,
    pub(super) route: Option<Route>,
    pub(super) batch: Batch,
    pub(super) rates: Vec<Positive>,
    pub(super) decay: Decay,
    pub(super) optimiser: Optimiser,
    pub(super) epochs: u32,
    pub(super) shift_pixels: u32,
    pub(super) flip: bool,
    pub(super) train_on: TrainOn,
    pub(super) select: Select,
}

impl Learning {
    /// What a network says that learns from no error.
    pub(super) fn neutral() -> Self {
        Self {
            kind: Kind { rule: Rule::Ed, seeded: false },
            mode: UpdateMode::Accumulate,
            centre: Centre::None,
            control: Control::None,
            refresh: None,
            centred: false,
            error: OutputError::OneVsAll,
            route: Some(Route::Modulo { taps: 1, shift: None }),
            batch: Batch::new(1).expect("in range"),
            rates: vec![],
            decay: Decay::Constant,
            optimiser: Optimiser::Plain,
            epochs: 0,
            shift_pixels: 0,
            flip: false,
            train_on: TrainOn::Train,
            select: Select::Last,
        }
    }
}

/// Checks how a network of such dense hidden layers learns and writes defaults back.
pub(super) fn resolve(
    file: &mut LearningFile,
    hidden: &[usize],
    style: Style,
) -> Result<Learning, ConfigError> {
    let kind = match word("learning.rule", &mut file.rule, "ed", &RULES)? {
        Named::Rule(rule) => Kind { rule, seeded: false },
        Named::Seeded => Kind { rule: Rule::Ed, seeded: true },
        Named::Evolution => {
            let allowed = "evolution belongs to task = \"policy\": say that, or use ed, ed_seed, ed_non_dalean, kaneko, dfa or bp";
            return Err(wrong("learning.rule", "is \"es\"", allowed));
        }
    };
    let mode = word("learning.mode", &mut file.mode, "accumulate", &MODES)?;
    let (train_on, select) = selection(file, style.data.select)?;
    let batch = range("learning.batch", Batch::new(*file.batch.get_or_insert(style.batch())))?;
    let optimiser = optimiser(file, style.optimiser(), false)?;
    file.rate.get_or_insert_with(|| match optimiser {
        Optimiser::Plain | Optimiser::Momentum { .. } if style.keeps_middles() => RATE_OF_RAMPS,
        Optimiser::Plain | Optimiser::Momentum { .. } => style.data.rate_of(batch),
        Optimiser::Rms if style.keeps_middles() => RATE_RMS,
        // a chance, or a step of weights, is one whatever is learnt
        other => policy::rate(other),
    });
    // one sample has no mean but that of those before it
    let alone = batch.get() == 1 || mode == UpdateMode::Online;
    let default = match (kind.is_raw(), alone) {
        (true, _) => "none",
        (false, true) => "running",
        (false, false) => "batch",
    };
    let centre = word("learning.centre", &mut file.centre, default, &CENTRES)?;
    let error = output_error(file, if style.keeps_middles() { "softmax" } else { "one_vs_all" })?;
    Ok(Learning {
        kind,
        mode,
        centre,
        control: word("learning.control", &mut file.control, "none", &CONTROLS)?,
        refresh: refresh(file)?,
        centred: *file.centred.get_or_insert(style.keeps_middles()),
        error,
        route: route::resolve(file, kind.rule, style.taps())?,
        batch,
        rates: rates(file, hidden, style)?,
        decay: word("learning.decay", &mut file.decay, "cosine", &DECAYS)?,
        optimiser,
        epochs: *file.epochs.get_or_insert(style.data.epochs),
        shift_pixels: *file.shift_pixels.get_or_insert(0),
        flip: *file.flip.get_or_insert(false),
        train_on,
        select,
    })
}

/// Updates from a refresh to the next.
pub(super) fn refresh(file: &LearningFile) -> Result<Option<NonZeroU32>, ConfigError> {
    let Some(every) = file.refresh else { return Ok(None) };
    let allowed = "it is a number of updates from 1 on; leave it out for none";
    let every = NonZeroU32::new(every);
    every.map(Some).ok_or_else(|| wrong("learning.refresh", "is 0", allowed))
}

/// What the error of an output is, with a key that belongs to one of them.
fn output_error(file: &mut LearningFile, default: &str) -> Result<OutputError, ConfigError> {
    const KEY: &str = "learning.temperature";
    match word("learning.error", &mut file.error, default, &ERRORS)? {
        OutputError::Softmax { .. } => {
            let temperature = positive(KEY, *file.temperature.get_or_insert(1.0))?;
            Ok(OutputError::Softmax { temperature })
        }
        other => match file.temperature {
            None => Ok(other),
            Some(found) => {
                let allowed =
                    "it belongs to learning.error = \"softmax\": say that, or take it out";
                Err(wrong(KEY, format!("is {found}"), allowed))
            }
        },
    }
}

/// What makes requests of sums, with keys that belong to one of them.
pub(super) fn optimiser(
    file: &mut LearningFile,
    default: &str,
    dead_zone: bool,
) -> Result<Optimiser, ConfigError> {
    let chosen = word("learning.optimiser", &mut file.optimiser, default, &OPTIMISERS)?;
    let refused = |key: &str, optimiser: &str, found: Option<String>| match found {
        None => Ok(()),
        Some(found) => {
            let allowed = format!(
                "it belongs to optimiser = \"{optimiser}\": take the key out (--set {key}=default), or choose that optimiser"
            );
            Err(wrong(key, format!("is {found}"), allowed))
        }
    };
    if !matches!(chosen, Optimiser::Sign { .. }) {
        refused("learning.dead_zone", "sign", file.dead_zone.map(|found| found.to_string()))?;
    }
    if !matches!(chosen, Optimiser::Momentum { .. }) {
        let found = file.momentum_shift.map(|found| found.to_string());
        refused("learning.momentum_shift", "momentum", found)?;
    }
    if !matches!(chosen, Optimiser::AdamFx { .. }) {
        let found = file.adam_shifts.map(|found| format!("{found:?}"));
        refused("learning.adam_shifts", "adam_fx", found)?;
    }
    let shift = |key, found| {
        let shift = between(key, found, 1, 8)?;
        Ok::<_, ConfigError>(u32::try_from(shift).expect("its range was checked"))
    };
    Ok(match chosen {
        Optimiser::Sign { .. } => {
            Optimiser::Sign { dead_zone: *file.dead_zone.get_or_insert(dead_zone) }
        }
        Optimiser::Momentum { decay } => {
            let found = *file.momentum_shift.get_or_insert(decay.into());
            Optimiser::Momentum { decay: shift("learning.momentum_shift", found)? }
        }
        Optimiser::AdamFx { first_decay, second_decay } => {
            let [first, second] =
                *file.adam_shifts.get_or_insert([first_decay, second_decay].map(i64::from));
            let first_decay = shift("learning.adam_shifts", first)?;
            Optimiser::AdamFx { first_decay, second_decay: shift("learning.adam_shifts", second)? }
        }
        other => other,
    })
}

/// Rate times multiplier, of each layer.
fn rates(
    file: &mut LearningFile,
    hidden: &[usize],
    style: Style,
) -> Result<Vec<Positive>, ConfigError> {
    const KEY: &str = "learning.rate_multipliers";
    let rate = positive("learning.rate", *file.rate.get_or_insert(style.data.rate))?;
    file.rate_multipliers.get_or_insert_with(|| style.multipliers(hidden));
    let layers = style.windows + hidden.len() + 1;
    let factors = per_layer(KEY, &mut file.rate_multipliers, 1.0, layers)?;
    products(rate, factors)
}

/// Rate times multiplier.
pub(super) fn products(rate: Positive, factors: Vec<f64>) -> Result<Vec<Positive>, ConfigError> {
    const KEY: &str = "learning.rate_multipliers";
    let rates = factors.into_iter().map(|factor| {
        let product = rate.times(positive(KEY, factor)?);
        product.ok_or_else(|| wrong(KEY, "times the rate is out of range", "keep it in 1e-6..=1e6"))
    });
    rates.collect()
}

/// The small factor of the rate of each layer, written back as numbers: what `auto` finds is what runs again.
pub(super) fn mantissas(
    file: &mut LearningFile,
    rates: &[Rate],
) -> Result<Vec<RateMantissa>, ConfigError> {
    const KEY: &str = "learning.rate_mantissa";
    let list = match file.rate_mantissa.get_or_insert(MantissaFile::All(1)) {
        MantissaFile::All(one) => vec![*one; rates.len()],
        MantissaFile::Each(list) if list.len() == rates.len() => list.clone(),
        MantissaFile::Each(list) => return Err(one_a_layer(KEY, list.len(), rates.len())),
        MantissaFile::Named(name) if name == "auto" => {
            rates.iter().map(|rate| rate.with_nearest_mantissa().mantissa.get().into()).collect()
        }
        MantissaFile::Named(name) => {
            let allowed = "it is \"auto\", a whole number in 1..=15, or a list with one a layer";
            return Err(wrong(KEY, format!("is \"{name}\""), allowed));
        }
    };
    let mantissas: Result<Vec<_>, _> =
        list.iter().map(|&found| range(KEY, RateMantissa::new(found))).collect();
    let same = list.iter().all(|one| *one == list[0]);
    file.rate_mantissa =
        Some(if same { MantissaFile::All(list[0]) } else { MantissaFile::Each(list) });
    mantissas
}

/// What is learnt from, and which epoch's state reads the test set.
fn selection(file: &mut LearningFile, chosen: &str) -> Result<(TrainOn, Select), ConfigError> {
    let halves = [("train", TrainOn::Train), ("all", TrainOn::All)];
    let train_on = word("learning.train_on", &mut file.train_on, "train", &halves)?;
    let states = [("best_validation", Select::BestValidation), ("last", Select::Last)];
    let default = if train_on == TrainOn::All { "last" } else { chosen };
    let select = word("learning.select", &mut file.select, default, &states)?;
    if train_on == TrainOn::All && select == Select::BestValidation {
        let allowed = "validation examples are learnt from (train_on = \"all\"); use \"last\"";
        return Err(wrong("learning.select", "is \"best_validation\"", allowed));
    }
    Ok((train_on, select))
}
