//! What users get by saying nothing, where it depends on what is learnt: one set of defaults a data set, whoever asks,
//! `train`, `sweep` or a file.
//!
//! A default is written into the resolved configuration, so that a later change of it changes no run that was made. It is
//! no *frozen* default of an address ([`super::given`]): those never change.

use super::file::{DataFile, PerLayer};
use crate::num::fixed::Batch;

pub(super) mod policy;

/// Defaults of network and learning for one data set.
///
/// Those of the built-in digits were chosen on their validation examples (docs/results/defaults.md). 318 of them are too
/// few to pick an epoch by, so the last one reads the test set. The output layer learns four times more slowly than the
/// hidden ones, which keeps the net well away from the rate at which it diverges.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SetDefaults {
    /// The set; `None`: every other one, and files of one's own.
    pub set: Option<&'static str>,
    /// `network.hidden`.
    pub hidden: &'static [usize],
    /// `network.alpha`, but of rules that say it themselves.
    pub alpha: f64,
    /// `network.weight_max`.
    pub weight_max: f64,
    /// `learning.epochs`.
    pub epochs: u32,
    /// `learning.batch`.
    pub batch: i64,
    /// `learning.rate`, of batches of this size and above; below, in proportion.
    pub rate: f64,
    /// The last of `learning.rate_multipliers` behind hidden layers of no more units than [`Self::hidden`]; the others
    /// are 1.
    pub output_multiplier: f64,
    /// `learning.taps`, where the route has any.
    pub taps: usize,
    /// `learning.select`, unless validation examples are learnt from.
    pub select: &'static str,
}

/// Keys whose default follows from other keys of an experiment than data and rule.
pub(super) const FOLLOWING: [&str; 17] = [
    "learning.rate",
    "learning.rate_multipliers",
    "learning.centre",
    "environment.rollouts",
    "network.critic_hidden",
    "network.weight_max",
    "network.hidden",
    "network.input",
    "network.activation",
    "network.alpha",
    "network.threshold",
    "network.gain",
    "learning.error",
    "learning.optimiser",
    "learning.centred",
    "learning.batch",
    "learning.taps",
];

/// One entry a data set that has defaults of its own, then the entry of all others.
pub const SET_DEFAULTS: [SetDefaults; 3] = [
    SetDefaults {
        set: Some("optdigits"),
        hidden: &[256],
        alpha: 4.0,
        weight_max: 2.0,
        epochs: 40,
        batch: 16,
        rate: 18.0,
        output_multiplier: 0.25,
        taps: 3,
        select: "last",
    },
    SetDefaults {
        set: Some("fashion-mnist"),
        hidden: &[256],
        alpha: 6.0,
        weight_max: 4.0,
        epochs: 20,
        batch: 32,
        // at 20, that of the others, it diverges from three epochs on
        rate: 7.5,
        output_multiplier: 1.0,
        taps: 1,
        select: "best_validation",
    },
    SetDefaults {
        set: None,
        hidden: &[256],
        alpha: 6.0,
        weight_max: 4.0,
        epochs: 20,
        batch: 32,
        rate: 20.0,
        output_multiplier: 1.0,
        taps: 1,
        select: "best_validation",
    },
];

impl SetDefaults {
    /// Those of some data.
    #[must_use]
    pub fn of(data: &DataFile) -> &'static Self {
        let [.., others] = &SET_DEFAULTS;
        let set = data.set.as_deref();
        SET_DEFAULTS.iter().find(|one| one.set.is_some() && one.set == set).unwrap_or(others)
    }

    /// `learning.rate` of updates of so many samples. Below the batch that the rate was chosen for it falls with the
    /// batch, so that a sample weighs what it weighed: at 18 whatever the batch, those of 1 to 4 digits diverge.
    pub(super) fn rate_of(&self, batch: Batch) -> f64 {
        let batch = i64::from(batch.get()).min(self.batch);
        self.rate * batch as f64 / self.batch as f64
    }

    /// `learning.rate_multipliers` behind hidden layers of so many units: that of the output layer is the set's, all others
    /// are 1. A layer that reads more units than the rates were chosen for learns more slowly in proportion: its sums move
    /// by what all its inputs move together. Nets of 1,024 and 2,048 hidden units diverge otherwise.
    pub(super) fn multipliers(&self, hidden: &[usize]) -> PerLayer<f64> {
        let chosen_for = self.hidden.iter().copied().max().unwrap_or(1);
        let behind = |units: usize| chosen_for as f64 / units.max(chosen_for) as f64;
        let mut each: Vec<f64> =
            std::iter::once(1.0).chain(hidden.iter().map(|&units| behind(units))).collect();
        if let Some(output) = each.last_mut() {
            *output *= self.output_multiplier;
        }
        if each.iter().all(|one| *one == 1.0) { PerLayer::All(1.0) } else { PerLayer::Each(each) }
    }

    /// Every key and its value in the words of a file, for a network of one hidden layer.
    #[must_use]
    pub fn keys(&self) -> Vec<(&'static str, String)> {
        let multipliers = match self.multipliers(self.hidden) {
            PerLayer::All(one) => format!("{one:?}"),
            PerLayer::Each(list) => format!("{list:?}"),
        };
        vec![
            ("network.hidden", format!("{:?}", self.hidden)),
            ("network.alpha", format!("{:?}", self.alpha)),
            ("network.weight_max", format!("{:?}", self.weight_max)),
            ("learning.epochs", self.epochs.to_string()),
            ("learning.batch", self.batch.to_string()),
            ("learning.rate", format!("{:?}", self.rate)),
            ("learning.rate_multipliers", multipliers),
            ("learning.taps", self.taps.to_string()),
            ("learning.select", format!("{:?}", self.select)),
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lab::config::{Config, Overlay, Sources, load, setting_table};
    use crate::learn::error::Centre;

    fn resolved(text: &str, settings: &[&str]) -> Config {
        let settings: Vec<String> = settings.iter().map(ToString::to_string).collect();
        let experiment = Some(("it", text));
        load(&Sources { experiment, settings: &settings, ..Sources::default() }).unwrap()
    }

    /// A sweep on the digits once reached 93.9 % where `dalean train` reached 96.6 %.
    #[test]
    fn a_sweep_a_file_and_no_file_at_all_have_the_same_defaults() {
        let example = include_str!("../../../examples/digits.toml");
        let file = resolved(example, &[]).to_toml();
        assert_eq!(load(&Sources::default()).unwrap().to_toml(), file);
        assert_eq!(resolved("data.set = 'optdigits'", &[]).to_toml(), file);
        let table = setting_table("data.set=optdigits").unwrap();
        let overlays = [Overlay { place: "base", table: &table }];
        let sweep = load(&Sources { overlays: &overlays, ..Sources::default() }).unwrap();
        assert_eq!(sweep.to_toml(), file);
    }

    #[test]
    fn every_listed_default_is_what_saying_nothing_gives() {
        for one in &SET_DEFAULTS {
            let set = format!("data.set={}", one.set.unwrap_or("mnist"));
            let silent = resolved("", &[&set]);
            let said: Vec<String> =
                one.keys().iter().map(|(key, v)| format!("{key}={v}")).collect();
            let all: Vec<&str> = std::iter::once(&*set).chain(said.iter().map(|s| &**s)).collect();
            assert_eq!(resolved("", &all).to_toml(), silent.to_toml(), "{set}");
            for (key, value) in one.keys() {
                let (table, name) = key.split_once('.').unwrap();
                let all: toml::Table = toml::from_str(&silent.to_toml()).unwrap();
                let found = all[table][name].to_string();
                assert_eq!(found.replace(".0", ""), value.replace(".0", ""), "{set}: {key}");
            }
        }
    }

    /// `learning.batch = 1` once was refused, and 2 to 4 diverged at the rate of 16.
    #[test]
    fn one_key_of_the_batch_alone_gives_what_trains() {
        let of = |setting: &str| {
            let config = resolved("", &[setting]);
            (config.centre, config.rates[0].get())
        };
        assert_eq!(of("learning.batch=1"), (Centre::Running, 1.125));
        assert_eq!(of("learning.batch=4"), (Centre::Batch, 4.5));
        assert_eq!(of("learning.batch=64"), (Centre::Batch, 18.0));
        assert_eq!(of("learning.mode=online"), (Centre::Running, 18.0));
        assert_eq!(of("learning.rule=ed_seed").0, Centre::None);
        // said is said
        let said = resolved("", &["learning.batch=1", "learning.centre=batch", "learning.rate=3"]);
        assert_eq!((said.centre, said.rates[0].get()), (Centre::Batch, 3.0));
        assert!(said.experiment(64, 10, None).is_err());
    }

    #[test]
    fn the_list_of_keys_says_the_defaults_of_all() {
        let [digits, more @ ..] = &SET_DEFAULTS;
        for others in more {
            for ((name, digits), (_, others)) in digits.keys().into_iter().zip(others.keys()) {
                let key = crate::lab::config::keys::matching(name);
                let entry = key.iter().find(|key| key.full() == name).unwrap().entry;
                assert_eq!(entry.default, digits, "{name}");
                let said = digits == others || entry.otherwise.contains(&*others);
                assert!(said, "{name}: {others}");
            }
        }
    }

    #[test]
    fn defaults_fit_rules_without_taps_and_nets_of_other_depths() {
        let bp = resolved("", &["learning.rule=bp"]);
        assert_eq!(bp.route, None);
        let deep = resolved("", &["network.hidden=[64, 32]"]);
        let rates: Vec<f64> = deep.rates.iter().map(|rate| rate.get()).collect();
        assert_eq!(rates, [18.0, 18.0, 4.5]);
        let wide = resolved("", &["network.hidden=[1024, 512]"]);
        let rates: Vec<f64> = wide.rates.iter().map(|rate| rate.get()).collect();
        assert_eq!(rates, [18.0, 4.5, 2.25]);
        let none = resolved("", &["network.hidden=[]"]);
        assert_eq!(none.rates.iter().map(|rate| rate.get()).collect::<Vec<_>>(), [4.5]);
        let seeded = resolved("", &["learning.rule=ed_seed"]);
        assert!(seeded.to_toml().contains("alpha = 1.0"));
        let all = resolved("", &["learning.train_on=all"]);
        assert_eq!(all.select, crate::lab::config::Select::Last);
    }
}
