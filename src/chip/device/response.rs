//! What cells are made of: how they answer to a pulse, and how they differ.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use crate::num::fixed::Millionths;
use crate::num::tables::{LinearSteps, Response, SpreadLaw};

/// A device that is not ideal: a pulse moves a cell by more or less than a level.
///
/// ```
/// use dalean::Hardware;
/// use dalean::hardware::{CellSpread, DeviceSpec, Millionths, PulseNoise, Response, SoftBoundSteps};
///
/// let device = DeviceSpec {
///     response: Response::SoftBounds(SoftBoundSteps::default()),
///     states: 64,
///     asymmetry: Millionths(0),
///     noise: PulseNoise::OfStep(Millionths(300_000)),
///     write_noise: Millionths(0),
///     tries: DeviceSpec::TRIES,
///     spread: CellSpread::default(),
/// };
/// let chip = Hardware::reference().with(|parts| parts.device = Some(device)).expect("a chip");
/// assert_eq!(chip.pulses_of_window(), Some([64, 255]));
/// ```
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct DeviceSpec {
    /// How far a pulse moves a cell.
    pub response: Response,
    /// Pulses of mean length across the window.
    pub states: u32,
    /// By which share steps up are longer than the response says, and steps down shorter.
    pub asymmetry: Millionths,
    /// Noise from pulse to pulse.
    pub noise: PulseNoise,
    /// Standard deviation of what a write leaves beside the level that its pulses reached, in windows.
    pub write_noise: Millionths,
    /// Where pulses are verified: pulses that a cell is given at most for each that is asked for.
    pub tries: u32,
    /// Differences from cell to cell.
    pub spread: CellSpread,
}

/// Standard deviation of a step about its mean, from pulse to pulse.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum PulseNoise {
    /// None.
    Off,
    /// A share of the step itself.
    OfStep(Millionths),
    /// A share of the window, whatever the step.
    OfWindow(Millionths),
}

/// Standard deviations from cell to cell; 0 is none.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct CellSpread {
    /// The law of the step's factor.
    pub step_law: SpreadLaw,
    /// Of the step's factor, or of its logarithm.
    pub step: Millionths,
    /// Of the share by which steps up are longer, and steps down shorter.
    pub asymmetry: Millionths,
    /// Of the ceiling, in windows.
    pub ceiling: Millionths,
    /// Of the floor, in windows.
    pub floor: Millionths,
}

impl Default for CellSpread {
    /// No differences.
    fn default() -> Self {
        let none = Millionths(0);
        let step_law = SpreadLaw::Normal;
        Self { step_law, step: none, asymmetry: none, ceiling: none, floor: none }
    }
}

impl CellSpread {
    /// Whether cells differ in how far a pulse moves them.
    #[must_use]
    pub const fn differs_in_steps(&self) -> bool {
        self.step.0 != 0 || self.asymmetry.0 != 0
    }

    /// Whether the ends of the window differ from cell to cell.
    #[must_use]
    pub const fn moves_window(&self) -> bool {
        self.ceiling.0 != 0 || self.floor.0 != 0
    }
}

impl DeviceSpec {
    /// States, at most.
    pub const STATES_MAX: u32 = 1 << 16;
    /// Pulses for each that is asked for, unless they are given.
    pub const TRIES: u32 = 4;
    /// The same, at most.
    pub const TRIES_MAX: u32 = 16;

    /// A device of which every pulse is as long as the others, and every cell like the others.
    #[must_use]
    pub fn even(states: u32) -> Self {
        Self {
            response: Response::Linear(LinearSteps::default()),
            states,
            asymmetry: Millionths(0),
            noise: PulseNoise::Off,
            write_noise: Millionths(0),
            tries: Self::TRIES,
            spread: CellSpread::default(),
        }
    }

    /// Checks its numbers.
    ///
    /// # Errors
    /// When one lies outside what it can be.
    pub fn check(&self) -> Result<(), DeviceError> {
        let Self { response, states, asymmetry, noise, write_noise, tries, spread } = self;
        if !(1..=Self::STATES_MAX).contains(states) {
            let allowed = format!("it must lie in 1..={}", Self::STATES_MAX);
            let found = format!("is {states}");
            return Err(DeviceError { key: "device.response.states", found, allowed });
        }
        if let Err(error) = response.check() {
            let found = format!("has `{}` that {}", error.name, error.found);
            let allowed = error.allowed.to_owned();
            return Err(DeviceError { key: "device.response", found, allowed });
        }
        let share = |key, of: Millionths, [least, most]: [i64; 2]| {
            if (least * 1_000_000..=most * 1_000_000).contains(&of.0) {
                return Ok(());
            }
            let allowed = format!("it must lie in {least}..={most}");
            Err(DeviceError { key, found: format!("is {of}"), allowed })
        };
        share("device.response.asymmetry", *asymmetry, [-1, 1])?;
        match *noise {
            PulseNoise::Off => {}
            PulseNoise::OfStep(noise) => share("device.response.noise", noise, [0, 100])?,
            PulseNoise::OfWindow(noise) => share("device.response.noise", noise, [0, 1])?,
        }
        share("device.response.write_noise", *write_noise, [0, 1])?;
        if !(1..=Self::TRIES_MAX).contains(tries) {
            let allowed = format!("it must lie in 1..={}", Self::TRIES_MAX);
            let found = format!("is {tries}");
            return Err(DeviceError { key: "device.response.tries", found, allowed });
        }
        let CellSpread { step_law: _, step, asymmetry, ceiling, floor } = *spread;
        share("device.spread.step", step, [0, 2])?;
        share("device.spread.asymmetry", asymmetry, [0, 1])?;
        share("device.spread.ceiling", ceiling, [0, 1])?;
        share("device.spread.floor", floor, [0, 1])
    }
}

/// A number that no device has.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct DeviceError {
    /// The key of a hardware model.
    pub key: &'static str,
    /// What was found.
    pub found: String,
    /// What is allowed.
    pub allowed: String,
}
