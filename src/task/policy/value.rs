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
