//! The door from floats to the fixed point of policies: what environments outside this program show and give, and what they are
//! told.
//!
//! ```text
//! number    floor( x 2^16 + 1/2 ) / 2^16        in binary64, halves up; from -2^15 to 2^15 - 2^-16
//! action    exact
//! ```
//!
//! NaN, infinities and greater numbers are errors, never clamped: nothing behind the door has moved then. See docs/MODEL.md, 5.

use crate::task::environment::{Actions, EnvError, EnvSpec, Observations, Outcomes, Real, Shown};

/// Takes floats of so many environments of one kind.
///
/// ```
/// use dalean::policy::{EnvSpec, FloatDoor, Shown, Taken};
///
/// let spec = EnvSpec {
///     id: "Mine-v0".into(),
///     shown: Shown::Dense(2),
///     taken: Taken::Continuous(1),
///     steps_max: 10,
///     inputs: vec![],
/// };
/// let door = FloatDoor::new(&spec, 2);
/// let shown = door.observations(&[0.25_f32, -1.0, 3.0, 0.0]).expect("numbers");
/// assert_eq!(shown.values[1], -1.0);
/// let error = door.observations(&[0.25, -1.0, f64::NAN, 0.0]).unwrap_err();
/// assert!(error.to_string().starts_with("environment 1 of `Mine-v0` shows NaN as number 0 of its observation"));
/// ```
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FloatDoor {
    spec: EnvSpec,
    count: usize,
}

/// What came of a step, in floats.
#[derive(Debug, Clone, Copy)]
pub struct FloatOutcomes<'a, F> {
    /// What each shows now, `[environment][value]`: of one whose episode ended, the beginning of its next one.
    pub next: &'a [F],
    /// What each reached, as `next`; may be left out where no episode ended.
    pub reached: Option<&'a [F]>,
    /// Rewards.
    pub rewards: &'a [F],
    /// Whose task is over.
    pub terminated: &'a [bool],
    /// Who was stopped from outside, by a limit of time. Of both at once, the task is over.
    pub truncated: &'a [bool],
}

impl FloatDoor {
    /// For `count` environments of a kind.
    #[must_use]
    pub fn new(spec: &EnvSpec, count: usize) -> Self {
        Self { spec: spec.clone(), count }
    }

    fn wrong(&self, which: usize, found: String, allowed: &str) -> EnvError {
        EnvError { id: self.spec.id.to_string(), which, found, allowed: allowed.into() }
    }

    /// What all of them show, `[environment][value]`.
    ///
    /// # Errors
    /// When there are more or fewer numbers than that, or one of them is none that fixed point holds.
    pub fn observations<F: Copy + Into<f64>>(
        &self,
        values: &[F],
    ) -> Result<Observations, EnvError> {
        let Shown::Dense(width) = self.spec.shown else {
            let allowed = "lines are no floats: hand `Observations` over with those that are on";
            return Err(self.wrong(0, "shows lines that are on or off".into(), allowed));
        };
        let values = self.reals("observation", values, width)?;
        Ok(Observations { values, ..Observations::default() })
    }

    /// What came of a step.
    ///
    /// # Errors
    /// As [`FloatDoor::observations`], and when an episode ended and nobody says what it reached.
    pub fn outcomes<F: Copy + Into<f64>>(
        &self,
        of: &FloatOutcomes<'_, F>,
    ) -> Result<Outcomes, EnvError> {
        let next = self.observations(of.next)?;
        let reached = of.reached.map(|reached| self.observations(reached)).transpose()?;
        self.came(next, reached, of.rewards, [of.terminated, of.truncated])
    }

    /// What came of a step where observations are no floats: `next` and `reached` as [`Outcomes`] has them, rewards, who was
    /// terminated and who truncated.
    ///
    /// # Errors
    /// As [`FloatDoor::outcomes`]; what is shown is checked by whoever takes it.
    pub fn came<F: Copy + Into<f64>>(
        &self,
        next: Observations,
        reached: Option<Observations>,
        rewards: &[F],
        [terminated, truncated]: [&[bool]; 2],
    ) -> Result<Outcomes, EnvError> {
        let rewards = self.reals("reward", rewards, 1)?;
        for ends in [terminated, truncated] {
            if ends.len() != self.count {
                let found = format!("is one of {}, but {} ends are given", self.count, ends.len());
                return Err(self.wrong(0, found, "say of each whether its episode ended"));
            }
        }
        let ended = terminated.iter().zip(truncated).position(|(&over, &stop)| over || stop);
        let reached = match (reached, ended) {
            (Some(reached), _) => reached,
            (None, None) => next.clone(),
            (None, Some(which)) => {
                let found = "ended its episode without saying what it reached".into();
                let allowed = "give `reached`: the last observation of the episode, beside `next`, the first of the next one";
                return Err(self.wrong(which, found, allowed));
            }
        };
        let truncated =
            truncated.iter().zip(terminated).map(|(&stop, &over)| stop && !over).collect();
        Ok(Outcomes { reached, next, rewards, terminated: terminated.to_vec(), truncated })
    }

    /// Actions as floats: choices by their number, values from -1 to 1, `[environment][value]`.
    #[must_use]
    pub fn actions(actions: Actions<'_>) -> Vec<f64> {
        match actions {
            Actions::Discrete(choices) => choices.iter().map(|&choice| choice.into()).collect(),
            Actions::Continuous(values) => values.iter().map(|value| value.to_num()).collect(),
        }
    }

    fn reals<F: Copy + Into<f64>>(
        &self,
        what: &str,
        values: &[F],
        width: usize,
    ) -> Result<Vec<Real>, EnvError> {
        let wanted = self.count.saturating_mul(width);
        if values.len() != wanted {
            let found =
                format!("has {width} numbers as its {what}, but {} are given", values.len());
            let allowed = format!("give {wanted}: those of {} environments", self.count);
            return Err(self.wrong(0, found, &allowed));
        }
        let real = |(at, &value): (usize, &F)| {
            let value = value.into();
            real(value).ok_or_else(|| {
                let found = format!("shows {value:?} as number {} of its {what}", at % width);
                let allowed = "numbers are finite, from -32768 to 32767.99998: scale them, or give the step again; nothing was \
                               learnt from this one";
                self.wrong(at / width, found, allowed)
            })
        };
        values.iter().enumerate().map(real).collect()
    }
}

/// The nearest number of fixed point, halves up, if there is one.
fn real(value: f64) -> Option<Real> {
    let steps = (value * 65536.0 + 0.5).floor();
    let holds = (f64::from(i32::MIN)..=f64::from(i32::MAX)).contains(&steps);
    // whole and inside the range
    holds.then_some(Real::from_bits(steps as i32))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::task::environment;

    #[test]
    fn floats_become_the_nearest_step_and_the_ends_are_where_they_are() {
        let step = 1.0 / 65536.0;
        for (value, bits) in [
            (0.0, Some(0)),
            (-0.0, Some(0)),
            (step / 2.0, Some(1)),
            (-step / 2.0, Some(0)),
            (-step * 0.51, Some(-1)),
            (1.5, Some(98_304)),
            (f64::MIN_POSITIVE, Some(0)),
            (32_768.0 - step, Some(i32::MAX)),
            (32_768.0 - step * 0.51, Some(i32::MAX)),
            (32_768.0 - step / 2.0, None),
            (32_768.0, None),
            (-32_768.0, Some(i32::MIN)),
            (-32_768.0 - step / 2.0, Some(i32::MIN)),
            (-32_768.0 - step, None),
            (f64::MAX, None),
            (f64::INFINITY, None),
            (f64::NEG_INFINITY, None),
            (f64::NAN, None),
        ] {
            assert_eq!(real(value).map(Real::to_bits), bits, "{value}");
        }
    }

    #[test]
    fn what_does_not_fit_is_said_with_where_it_is() {
        let cart = environment::make("CartPole-v1", 1, 1).unwrap();
        let door = FloatDoor::new(cart.spec(), 3);
        let zeros = [0.0_f32; 12];
        let of = |next, reached, rewards, terminated, truncated| {
            let outcomes = FloatOutcomes { next, reached, rewards, terminated, truncated };
            door.outcomes(&outcomes).map_err(|error| error.to_string())
        };
        let go = [false; 3];
        let end = [false, true, false];
        assert!(of(&zeros, None, &[0.0; 3], &go, &go).is_ok());
        // Gymnasium may say both
        let both = of(&zeros, Some(&zeros), &[0.0; 3], &end, &end).unwrap();
        assert_eq!((both.terminated[1], both.truncated[1]), (true, false));
        for (refused, words) in [
            (of(&zeros[..11], None, &[0.0; 3], &go, &go), "but 11 are given; give 12"),
            (of(&zeros, None, &[0.0; 2], &go, &go), "has 1 numbers as its reward, but 2"),
            (of(&zeros, None, &[0.0; 3], &go[..2], &go), "2 ends are given"),
            (of(&zeros, None, &[0.0; 3], &go, &end), "environment 1 of `CartPole-v1` ended"),
        ] {
            let error = refused.unwrap_err();
            assert!(error.contains(words), "{error}");
        }
        let foray = environment::make("Foray-v0", 1, 1).unwrap();
        let error = FloatDoor::new(foray.spec(), 1).observations(&[0.0]).unwrap_err().to_string();
        assert!(error.contains("lines are no floats"), "{error}");
    }
}
