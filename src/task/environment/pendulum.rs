//! `Pendulum-v1`: swing a pendulum up and keep it there with a torque that is too weak to lift it at once.
//!
//! ```text
//! u = 2 action        reward = -(a^2 + 0.1 w^2 + 0.001 u^2), of the values before
//! w += 0.05 (15 sin a + 3 u), held to 8 in size       g = 10, mass and length 1
//! a += 0.05 w, with the new w, turned into -pi .. pi
//! never over;  200 steps;  shows cos a, sin a, w
//! begins with a uniform in -pi .. pi, w in -1 .. 1
//! ```
//!
//! `a` is in radians, upwards 0. As Gymnasium 1.4 has it, which counts whole turns in `a` and takes them out where it matters:
//! to 2^-28 of a range in a step; see docs/MODEL.md, 5.4.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use super::canvas::Canvas;
use super::fine::{Fine, shown, sin, sin_cos, taken, turned, uniform};
use super::one::{Action, Came, Environment, StatePart};
use super::{EnvSpec, Observations, Shown, Taken};

const TORQUE_MAX: Fine = Fine::lit("2");
const SPEED_MAX: Fine = Fine::lit("8");
const SPEED_BEGIN: Fine = Fine::lit("1");
/// Seconds a step.
const TAU: Fine = Fine::lit("0.05");
/// `3 g / 2 l`.
const PULL: Fine = Fine::lit("15");
/// `3 / m l^2`.
const TORQUE_SHARE: Fine = Fine::lit("3");
const SPEED_COST: Fine = Fine::lit("0.1");
const TORQUE_COST: Fine = Fine::lit("0.001");

/// A pendulum.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Pendulum {
    angle: Fine,
    speed: Fine,
}

impl Environment for Pendulum {
    fn spec() -> EnvSpec {
        EnvSpec {
            id: "Pendulum-v1".into(),
            shown: Shown::Dense(3),
            taken: Taken::Continuous(1),
            steps_max: 200,
            inputs: vec![("cosine", 1), ("sine", 1), ("speed", 1)],
        }
    }

    fn parts() -> Vec<StatePart> {
        let part = |name, most: Fine| StatePart {
            name,
            numbers: 1,
            within: -most.to_bits()..=most.to_bits(),
        };
        vec![part("angle", Fine::PI), part("speed", SPEED_MAX)]
    }

    fn begin(words: &mut impl Iterator<Item = u32>) -> Self {
        let mut draw =
            |most: Fine| uniform(words.next().expect("the stream has no end"), -most, most);
        Self { angle: draw(Fine::PI), speed: draw(SPEED_BEGIN) }
    }

    #[inline]
    fn act(&mut self, action: Action<'_>) -> Came {
        let Self { angle, speed } = *self;
        let torque = TORQUE_MAX * taken(action.number());
        let cost = angle * angle + SPEED_COST * (speed * speed) + TORQUE_COST * (torque * torque);
        let faster = speed + (PULL * sin(angle) + TORQUE_SHARE * torque) * TAU;
        self.speed = faster.clamp(-SPEED_MAX, SPEED_MAX);
        self.angle = turned(angle + self.speed * TAU);
        Came { reward: shown(-cost), terminated: false }
    }

    #[inline]
    fn show(&self, to: &mut Observations) {
        let (sin, cos) = sin_cos(self.angle);
        to.values.extend([cos, sin, self.speed].map(shown));
    }

    fn numbers(&self, numbers: &mut Vec<i64>) {
        numbers.extend([self.angle, self.speed].map(Fine::to_bits));
    }

    fn from_numbers(numbers: &[i64]) -> Self {
        Self { angle: Fine::from_bits(numbers[0]), speed: Fine::from_bits(numbers[1]) }
    }

    fn picture(&self) -> String {
        let mut canvas = Canvas::new(25, 13);
        let hinge = [12, 6].map(Fine::from_num);
        let (sin, cos) = sin_cos(self.angle);
        // what turns to the left as the angle grows
        let tip = [hinge[0] - sin * 12, hinge[1] - cos * 6];
        canvas.line(hinge, tip, 'o');
        canvas.put(hinge, '+');
        canvas.to_string()
    }
}
