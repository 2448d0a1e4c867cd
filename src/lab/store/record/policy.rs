//! What a policy says of an epoch and of its final test.
//!
//! ```text
//! a sum      { sum, count, bits }: sum is in units of 2^-bits, added over count; the mean is sum / (count 2^bits)
//! a mean     under the name that CleanRL's logs have for it: one division of such a sum, `null` of nothing
//! explained  1 - variance left / variance of the value targets of the last rollout, `null` where they do not vary
//! ```
//!
//! Integers are what a run gave; numbers with a point follow from them alone, so that all of it can be done again to the
//! last digit. How many steps a second were made depends on the machine and stands in `timing.json`.

use serde::{Deserialize, Serialize};

use crate::task::policy::{PolicyEpoch, PolicyEvaluation, SumOf};

/// Fraction bits of returns and rewards.
pub const RETURN_BITS: u32 = 16;
/// Fraction bits of losses and of what the networks put out.
pub const LOSS_BITS: u32 = 20;

/// A sum that nobody has divided.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SumRecord {
    /// The sum, in units of `2^-bits`.
    pub sum: i64,
    /// Over how many.
    pub count: u64,
    /// Bits behind the point.
    pub bits: u32,
}

impl SumRecord {
    const fn of(sum: SumOf, bits: u32) -> Self {
        Self { sum: sum.sum, count: sum.count, bits }
    }

    /// Its mean; nothing of nothing.
    #[must_use]
    pub fn mean(self) -> Option<f64> {
        // two whole numbers, one division: a power of two divides exactly
        (self.count > 0).then(|| scaled(self.sum, self.bits) / self.count as f64)
    }
}

/// A whole number in units of `2^-bits`.
fn scaled(sum: i64, bits: u32) -> f64 {
    sum as f64 / f64::from(bits).exp2()
}

/// What a policy says of an epoch.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PolicyOutcome {
    /// Steps of all environments since the start.
    pub steps: u64,
    /// Returns of episodes that ended in the epoch.
    pub returns: SumRecord,
    /// Their lengths.
    pub lengths: SumRecord,
    /// Minus the clipped surrogate objective, over steps learnt from.
    pub policy_loss: SumRecord,
    /// Half of the squared error of values in standard units.
    pub value_loss: SumRecord,
    /// Entropy of what the actor puts out.
    pub entropy: SumRecord,
    /// Divergence of the policy from that of the rollout, `(r - 1) - ln r`.
    pub approx_kl: SumRecord,
    /// Steps whose ratio was clipped.
    pub clipped: SumRecord,
    /// Variance of value targets of the last rollout that is left, and all of it.
    pub unexplained: [i64; 2],
    /// Continuous actions: logarithm of the spread of each number, in units of 2^-20.
    pub log_sigma: Vec<i64>,
    /// Episodes without learning after the epoch.
    pub evaluation: EpisodesRecord,
    /// Steps of all environments.
    #[serde(rename = "charts/global_step")]
    pub global_step: u64,
    /// Mean return.
    #[serde(rename = "charts/episodic_return", deserialize_with = "Option::deserialize")]
    pub episodic_return: Option<f64>,
    /// Mean length.
    #[serde(rename = "charts/episodic_length", deserialize_with = "Option::deserialize")]
    pub episodic_length: Option<f64>,
    /// Mean policy loss.
    #[serde(rename = "losses/policy_loss", deserialize_with = "Option::deserialize")]
    pub mean_policy_loss: Option<f64>,
    /// Mean value loss.
    #[serde(rename = "losses/value_loss", deserialize_with = "Option::deserialize")]
    pub mean_value_loss: Option<f64>,
    /// Mean entropy.
    #[serde(rename = "losses/entropy", deserialize_with = "Option::deserialize")]
    pub mean_entropy: Option<f64>,
    /// Mean divergence.
    #[serde(rename = "losses/approx_kl", deserialize_with = "Option::deserialize")]
    pub mean_approx_kl: Option<f64>,
    /// Share of clipped steps.
    #[serde(rename = "losses/clipfrac", deserialize_with = "Option::deserialize")]
    pub clipfrac: Option<f64>,
    /// Explained variance.
    #[serde(rename = "losses/explained_variance", deserialize_with = "Option::deserialize")]
    pub explained_variance: Option<f64>,
}

impl PolicyOutcome {
    /// What a training told of an epoch, and its evaluation.
    #[must_use]
    pub(crate) fn of(epoch: PolicyEpoch, evaluation: EpisodesRecord) -> Self {
        let PolicyEpoch {
            steps,
            returns,
            lengths,
            policy_loss,
            value_loss,
            entropy,
            approx_kl,
            clipped,
            unexplained,
            log_sigma,
        } = epoch;
        let loss = |sum| SumRecord::of(sum, LOSS_BITS);
        let (returns, lengths) = (SumRecord::of(returns, RETURN_BITS), SumRecord::of(lengths, 0));
        let (policy_loss, value_loss) = (loss(policy_loss), loss(value_loss));
        let (entropy, approx_kl) = (loss(entropy), loss(approx_kl));
        let clipped = SumRecord::of(clipped, 0);
        let [left, all] = unexplained;
        Self {
            steps,
            global_step: steps,
            episodic_return: returns.mean(),
            episodic_length: lengths.mean(),
            mean_policy_loss: policy_loss.mean(),
            mean_value_loss: value_loss.mean(),
            mean_entropy: entropy.mean(),
            mean_approx_kl: approx_kl.mean(),
            clipfrac: clipped.mean(),
            explained_variance: (all > 0).then(|| 1.0 - left as f64 / all as f64),
            returns,
            lengths,
            policy_loss,
            value_loss,
            entropy,
            approx_kl,
            clipped,
            unexplained,
            log_sigma,
            evaluation,
        }
    }
}

/// Episodes without learning, and how they were played.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct EpisodesRecord {
    /// Whether the likeliest action was taken, and not one that was drawn.
    pub deterministic: bool,
    /// Return of each, in units of 2^-16.
    pub returns: Vec<i64>,
    /// Steps of each.
    pub lengths: Vec<u32>,
    /// Mean, least and greatest return; `null` of no episodes.
    #[serde(deserialize_with = "Option::deserialize")]
    pub return_range: Option<[f64; 3]>,
    /// Mean steps.
    #[serde(deserialize_with = "Option::deserialize")]
    pub length_mean: Option<f64>,
}

impl EpisodesRecord {
    /// What came of some episodes.
    #[must_use]
    pub(crate) fn of(found: &PolicyEvaluation, deterministic: bool) -> Self {
        let PolicyEvaluation { returns, lengths, .. } = found;
        let sum = |all: &mut dyn Iterator<Item = i64>| SumOf {
            sum: all.fold(0, i64::saturating_add),
            count: returns.len() as u64,
        };
        let mean = SumRecord::of(sum(&mut returns.iter().copied()), RETURN_BITS).mean();
        let steps = sum(&mut lengths.iter().map(|&steps| steps.into()));
        let ends = returns.iter().min().zip(returns.iter().max());
        let [least, most] = ends.map_or([None; 2], |(least, most)| {
            [Some(scaled(*least, RETURN_BITS)), Some(scaled(*most, RETURN_BITS))]
        });
        let return_range = match [mean, least, most] {
            [Some(mean), Some(least), Some(most)] => Some([mean, least, most]),
            _ => None,
        };
        Self {
            deterministic,
            returns: returns.clone(),
            lengths: lengths.clone(),
            return_range,
            length_mean: SumRecord::of(steps, 0).mean(),
        }
    }

    /// Mean return.
    #[must_use]
    pub fn mean(&self) -> Option<f64> {
        self.return_range.map(|[mean, ..]| mean)
    }

    /// How many.
    #[must_use]
    pub fn episodes(&self) -> u64 {
        self.returns.len() as u64
    }

    /// How they were played.
    #[must_use]
    pub const fn played(&self) -> &'static str {
        if self.deterministic { "deterministic" } else { "drawn" }
    }
}

/// The final test of a policy: episodes with the chosen state.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PolicyTest {
    /// Which epoch's state was read.
    pub epoch: u32,
    /// Why that one: `last`.
    pub select: String,
    /// Steps that it had learnt from, of all environments.
    pub steps: u64,
    /// The episodes.
    pub episodes: EpisodesRecord,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mean_is_one_division_and_of_nothing_there_is_none() {
        let of = |sum, count, bits| SumRecord { sum, count, bits }.mean();
        assert_eq!(of(3 << 16, 4, 16), Some(0.75));
        assert_eq!(of(-1, 3, 0), Some(-1.0 / 3.0));
        assert_eq!(of(5, 0, 16), None);
    }

    #[test]
    fn episodes_tell_mean_least_and_greatest() {
        let returns = vec![65_536, -131_072, 65_536 * 4];
        let found = PolicyEvaluation { returns, lengths: vec![1, 2, 6], ..Default::default() };
        let record = EpisodesRecord::of(&found, true);
        assert_eq!(record.return_range, Some([1.0, -2.0, 4.0]));
        assert_eq!(
            (record.length_mean, record.episodes(), record.played()),
            (Some(3.0), 3, "deterministic")
        );
        let none = EpisodesRecord::of(&PolicyEvaluation::default(), false);
        assert_eq!((none.return_range, none.length_mean), (None, None));
    }

    #[test]
    fn a_record_comes_back_from_its_text_under_the_names_that_logs_have() {
        let epoch = PolicyEpoch {
            steps: 2048,
            returns: SumOf { sum: 100 << 16, count: 8 },
            clipped: SumOf { sum: 1, count: 3 },
            unexplained: [1, 4],
            ..PolicyEpoch::default()
        };
        let record =
            PolicyOutcome::of(epoch, EpisodesRecord::of(&PolicyEvaluation::default(), true));
        let text = serde_json::to_string(&record).unwrap();
        for word in [
            "\"charts/episodic_return\":12.5",
            "\"charts/global_step\":2048",
            "\"losses/explained_variance\":0.75",
            "\"losses/policy_loss\":null",
            "\"losses/clipfrac\":0.3333333333333333",
        ] {
            assert!(text.contains(word), "{word} in {text}");
        }
        assert_eq!(serde_json::from_str::<PolicyOutcome>(&text).unwrap(), record);
    }
}
