//! `MountainCarContinuous-v0`: drive out of a valley with an engine that is too weak to climb at once.
//!
//! ```text
//! v += 0.0015 action - 0.0025 cos 3x, held to 0.07 in size
//! x += v, held to -1.2 .. 0.6;  at -1.2 a speed to the left becomes 0
//! over when x >= 0.45 and v >= 0;  reward -0.1 action^2, and 100 when it is over;  999 steps
//! begins with x uniform in -0.6 .. -0.4, v = 0
//! ```
//!
//! As Gymnasium 1.4 has it, which keeps `x` and `v` in 32 bits: to 2^-22 of a range in a step; see docs/MODEL.md, 5.4.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use super::canvas::Canvas;
use super::fine::{Fine, cos, shown, sin, taken, uniform};
use super::one::{Action, Came, Environment, StatePart};
use super::{EnvSpec, Observations, Shown, Taken};

const POWER: Fine = Fine::lit("0.0015");
const SLOPE: Fine = Fine::lit("0.0025");
const SPEED_MAX: Fine = Fine::lit("0.07");
const POSITION_MIN: Fine = Fine::lit("-1.2");
const POSITION_MAX: Fine = Fine::lit("0.6");
const GOAL: Fine = Fine::lit("0.45");
const BEGIN: [Fine; 2] = [Fine::lit("-0.6"), Fine::lit("-0.4")];
const PRIZE: Fine = Fine::lit("100");
const ACTION_COST: Fine = Fine::lit("0.1");

/// A car in a valley.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct MountainCar {
    position: Fine,
    speed: Fine,
}

impl Environment for MountainCar {
    fn spec() -> EnvSpec {
        EnvSpec {
            id: "MountainCarContinuous-v0".into(),
            shown: Shown::Dense(2),
            taken: Taken::Continuous(1),
            steps_max: 999,
            inputs: vec![("position", 1), ("speed", 1)],
        }
    }

    fn parts() -> Vec<StatePart> {
        let part = |name, most: Fine| StatePart {
            name,
            numbers: 1,
            within: -most.to_bits()..=most.to_bits(),
        };
        vec![part("position", -POSITION_MIN), part("speed", SPEED_MAX)]
    }

    fn begin(words: &mut impl Iterator<Item = u32>) -> Self {
        let word = words.next().expect("the stream has no end");
        Self { position: uniform(word, BEGIN[0], BEGIN[1]), speed: Fine::ZERO }
    }

    #[inline]
    fn act(&mut self, action: Action<'_>) -> Came {
        let force = taken(action.number());
        let faster = self.speed + force * POWER - SLOPE * cos(self.position * 3);
        let speed = faster.clamp(-SPEED_MAX, SPEED_MAX);
        self.position = (self.position + speed).clamp(POSITION_MIN, POSITION_MAX);
        self.speed = if self.position == POSITION_MIN { speed.max(Fine::ZERO) } else { speed };
        let terminated = self.position >= GOAL && self.speed >= Fine::ZERO;
        let prize = if terminated { PRIZE } else { Fine::ZERO };
        Came { reward: shown(prize - force * force * ACTION_COST), terminated }
    }

    #[inline]
    fn show(&self, to: &mut Observations) {
        to.values.extend([self.position, self.speed].map(shown));
    }

    fn numbers(&self, numbers: &mut Vec<i64>) {
        numbers.extend([self.position, self.speed].map(Fine::to_bits));
    }

    fn from_numbers(numbers: &[i64]) -> Self {
        Self { position: Fine::from_bits(numbers[0]), speed: Fine::from_bits(numbers[1]) }
    }

    fn picture(&self) -> String {
        let mut canvas = Canvas::new(55, 10);
        let column = |position: Fine| (position - POSITION_MIN) * 30;
        let row = |position: Fine| Fine::from_num(5) - sin(position * 3) * 4;
        for part in 0..55 {
            let position = POSITION_MIN + Fine::from_num(part) / 30;
            canvas.put([column(position), row(position)], '.');
        }
        canvas.put([column(GOAL), row(GOAL) - Fine::ONE], 'F');
        canvas.put([column(self.position), row(self.position)], 'o');
        canvas.to_string()
    }
}
