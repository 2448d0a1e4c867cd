//! The scale on which a critic learns, and its errors.
//!
//! ```text
//! said      = (value - mean) / deviation, clamped to +-4           value = mean + deviation said
//! mean     += (mean of targets   - mean)    / min(update, window)          in 2^-36, halves up
//! squares  += (mean of targets^2 - squares) / min(update, window)          in 2^-72, halves up
//! deviation = sqrt(squares - mean^2)                                       as in `Spread`
//! error     = clamp(target - said, -4, 4)
//! ```
//!
//! All targets count alike until `window` rollouts were seen; older ones fade after that. The cells of the critic are not
//! rescaled when the scale moves. See docs/MODEL.md, 5.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use super::moments::{Moments, Spread, pieces, whole};
use super::number::{OutputError, Value, bounded, saturated};
use crate::chip::state::{Piece, Section, State, StateError, Visitor};
use crate::num::fixed::narrow;

/// The scale on which a critic learns what states are worth.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ValueScale {
    window: u32,
    updates: u32,
    /// In 2^-36.
    mean: i64,
    /// Mean of squares, in 2^-72.
    squares: i128,
    spread: Spread,
}

impl ValueScale {
    /// Mean 0 and deviation 1. Once updated, it looks back about `window` rollouts, at least 1.
    #[must_use]
    pub const fn new(window: u32) -> Self {
        assert!(window > 0, "a scale looks back one rollout at least");
        let spread = Spread { mean: 0, deviation: 1 << 44, reciprocal: 1 << 36 };
        Self { window, updates: 0, mean: 0, squares: 0, spread }
    }

    /// Takes the value targets of a rollout.
    pub fn update(&mut self, targets: &[Value]) {
        if targets.is_empty() {
            return;
        }
        let moments = Moments::of(targets.iter().map(|target| target.to_bits()));
        let squares = (moments.squares << 32) / u128::from(moments.count);
        self.updates = self.updates.saturating_add(1);
        let part = i128::from(self.updates.min(self.window));
        let towards = |from: i128, to: i128| from + (2 * (to - from) + part).div_euclid(2 * part);
        self.mean = narrow(towards(self.mean.into(), moments.mean().into()), "between two means");
        self.squares = towards(self.squares, narrow(squares, "squares have room"));
        self.spread = Self::spread_of(self.mean, self.squares);
    }

    fn spread_of(mean: i64, squares: i128) -> Spread {
        let apart = (squares - i128::from(mean).pow(2)).max(0);
        Spread::new(mean, apart.unsigned_abs(), 1 << 16)
    }

    /// What the critic should say of a state that is worth `value`, clamped to +-4.
    #[must_use]
    pub fn to_standard(&self, value: Value) -> Value {
        bounded(self.spread.standard(value.to_bits(), 20))
    }

    /// What a state is worth of which the critic says `standard`, saturating.
    #[must_use]
    pub fn to_value(&self, standard: Value) -> Value {
        saturated(self.spread.number(standard.to_bits()))
    }

    /// What a checkpoint holds; `None` of what no values have.
    fn from_numbers(window: u32, numbers: &[i64]) -> Option<Self> {
        let &[updates, mean, high, low] = numbers else { return None };
        let updates = u32::try_from(updates).ok()?;
        let squares = whole([high, low])?;
        // means lie between the least and the greatest number, their squares too
        let possible = mean.unsigned_abs() <= 1 << 47 && (0..=1 << 94).contains(&squares);
        let new = Self::new(window);
        match updates {
            0 => (mean == 0 && squares == 0).then_some(new),
            _ if !possible => None,
            _ => {
                Some(Self { updates, mean, squares, spread: Self::spread_of(mean, squares), ..new })
            }
        }
    }
}

impl State for ValueScale {
    fn visit(&mut self, visitor: &mut dyn Visitor) -> Result<(), StateError> {
        let [high, low] = pieces(self.squares);
        let numbers = [i64::from(self.updates), self.mean, high, low];
        let (name, within) = ("policy.value_scale", i64::MIN..=i64::MAX);
        let piece = Piece { name, section: Some(Section::Task), within };
        if let Some(numbers) = visitor.numbers(&piece, &numbers)? {
            let found = "holds what no values have".into();
            *self = Self::from_numbers(self.window, &numbers)
                .ok_or_else(|| StateError { name: name.into(), found })?;
        }
        Ok(())
    }
}

/// The error of a critic: how much more it should have said, clamped to +-4.
#[inline]
#[must_use]
pub fn value_error(target: Value, said: Value) -> OutputError {
    bounded(i64::from(target.to_bits()) - i64::from(said.to_bits()))
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::super::observe::tests::Numbers;
    use super::*;

    fn values(bits: &[i32]) -> Vec<Value> {
        bits.iter().map(|&bits| Value::from_bits(bits)).collect()
    }

    #[test]
    fn before_the_first_update_a_value_is_what_the_critic_says() {
        let scale = ValueScale::new(16);
        for bits in [-(4 << 20), -1, 0, 1, 4 << 20] {
            let value = Value::from_bits(bits);
            assert_eq!((scale.to_standard(value), scale.to_value(value)), (value, value));
        }
        let mut same = scale;
        same.update(&[]);
        assert_eq!(same, scale);
    }

    #[test]
    fn the_scale_is_that_of_the_targets() {
        let mut scale = ValueScale::new(16);
        // mean 10, deviation 2
        scale.update(&values(&[8 << 20, 12 << 20]));
        let at = |x: i32| scale.to_standard(Value::from_num(x)).to_bits();
        assert_eq!(
            [1, 2, 9, 10, 18, 19].map(at),
            [-4 << 20, -4 << 20, -1 << 19, 0, 4 << 20, 4 << 20]
        );
        let back = |x: i32| scale.to_value(Value::from_bits(x)).to_bits();
        assert_eq!([-1 << 20, 0, 3 << 19].map(back), [8 << 20, 10 << 20, 13 << 20]);
        assert_eq!(
            (scale.to_value(Value::MAX), scale.to_value(Value::MIN)),
            (Value::MAX, Value::MIN)
        );
    }

    #[test]
    fn targets_that_are_alike_ask_for_nothing() {
        let mut scale = ValueScale::new(2);
        for _ in 0..5 {
            scale.update(&values(&[-77; 3]));
        }
        assert_eq!(scale.to_standard(Value::MAX), Value::ZERO);
        assert_eq!(scale.to_value(Value::MAX), Value::from_bits(-77));
    }

    #[test]
    fn older_targets_fade_once_the_window_is_full() {
        let mut scale = ValueScale::new(2);
        let means = [8, 16, 4, 0].map(|x: i32| {
            scale.update(&values(&[x << 20]));
            scale.mean >> 36
        });
        // 8;  (8 + 16) / 2;  (12 + 4) / 2;  (8 + 0) / 2
        assert_eq!(means, [8, 12, 8, 4]);
        // squares: 64, (64 + 256) / 2, (160 + 16) / 2, 88 / 2
        assert_eq!(scale.squares, 44 << 72);
        assert_eq!(scale.spread, Spread::new(4 << 36, 28 << 72, 1 << 16));
    }

    #[test]
    fn what_no_values_have_is_refused() {
        let mut scale = ValueScale::new(3);
        scale.update(&values(&[1, i32::MIN, 5 << 20]));
        let [high, low] = pieces(scale.squares);
        let own = [1, scale.mean, high, low];
        assert_eq!(ValueScale::from_numbers(3, &own), Some(scale));
        assert_eq!(ValueScale::from_numbers(3, &[0; 4]), Some(ValueScale::new(3)));
        let most = [1, i64::from(i32::MIN) << 16, 1 << 31, 0];
        assert!(ValueScale::from_numbers(3, &most).is_some());
        for wrong in [
            [-1, 0, 0, 0],
            [0, 1, 0, 0],
            [0, 0, 0, 1],
            [1 << 32, 0, 0, 0],
            [1, most[1] - 1, 0, 0],
            [1, -most[1] + 1, 0, 0],
            [1, 0, 1 << 31, 1],
            [1, 0, -1, 0],
            [1, 0, 0, -1],
        ] {
            assert_eq!(ValueScale::from_numbers(3, &wrong), None, "{wrong:?}");
        }
        assert_eq!(ValueScale::from_numbers(3, &own[..3]), None);
    }

    #[test]
    fn what_a_checkpoint_holds_is_what_was_there_or_an_error() {
        let mut scale = ValueScale::new(4);
        (0..3).for_each(|x| scale.update(&values(&[x << 20, i32::MIN, 7])));
        let name = "policy.value_scale";
        let mut writer = Numbers { name, ..Numbers::default() };
        scale.visit(&mut writer).unwrap();
        let back = |numbers: &[i64]| Numbers { name, back: Some(numbers.to_vec()), shown: vec![] };
        let mut again = ValueScale::new(4);
        again.visit(&mut back(&writer.shown)).unwrap();
        assert_eq!(again, scale);
        let error = again.visit(&mut back(&[-1, 0, 0, 0])).unwrap_err();
        assert_eq!(error.to_string(), "`policy.value_scale` holds what no values have");
        assert_eq!(again, scale);
    }

    #[test]
    fn the_error_of_a_critic_is_bounded() {
        let error =
            |target, said| value_error(Value::from_bits(target), Value::from_bits(said)).to_bits();
        assert_eq!(
            [error(5, 3), error(3, 5), error(i32::MAX, i32::MIN), error(i32::MIN, i32::MAX)],
            [2, -2, 4 << 20, -4 << 20]
        );
    }

    proptest! {
        #[test]
        fn mean_and_squares_follow_their_equations(
            rollouts in prop::collection::vec(prop::collection::vec(any::<i32>(), 1..5), 1..12), window in 1u32..6,
        ) {
            let mut scale = ValueScale::new(window);
            let (mut mean, mut squares) = (0i128, 0i128); // 2^-40 and 2^-32 steps
            for (update, rollout) in (1..).zip(&rollouts) {
                scale.update(&values(rollout));
                let (n, part) = (rollout.len() as i128, i128::from(window).min(update));
                let sum: i128 = rollout.iter().map(|&x| i128::from(x)).sum();
                let sum_squares: i128 = rollout.iter().map(|&x| i128::from(x).pow(2)).sum();
                mean += ((sum << 40) / n - mean) / part;
                squares += ((sum_squares << 32) / n - squares) / part;
            }
            // every update rounds by half a step, a rollout's mean by half, its squares by one, and all of them fade
            let rounds = 2 * rollouts.len() as i128;
            prop_assert!(((i128::from(scale.mean) << 24) - mean).abs() <= rounds << 24);
            prop_assert!((scale.squares - squares).abs() <= 2 * rounds);
            let apart = (scale.squares - i128::from(scale.mean).pow(2)).max(0).unsigned_abs();
            prop_assert_eq!(scale.spread, Spread::new(scale.mean, apart, 1 << 16));
        }
    }
}
