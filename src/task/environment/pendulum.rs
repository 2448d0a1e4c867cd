//! `Pendulum-v1`: swing a pendulum up and keep it there with a torque that is too weak to lift it at once.
//!
//! ```text
//! u = 2 action        reward = -(n(a)^2 + 0.1 w^2 + 0.001 u^2), of the values before; n(a) = a in -pi .. pi
//! w += 0.05 (15 sin a + 3 u), held to 8 in size;  a += 0.05 w, with the new w         g = 10, mass and length 1
//! never over;  200 steps;  shows cos a, sin a, w
//! begins with a uniform in -pi .. pi, w in -1 .. 1
//! ```
//!
//! `a` is in radians, upwards 0, and counts turns: it is at most `pi + 200 x 0.05 x 8` in size. As Gymnasium 1.4 has it, to
//! 2^-28 of a range in a step; see docs/MODEL.md, 5.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use super::canvas::Canvas;
use super::fine::{Fine, shown, sin, sin_cos, taken, uniform};
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

/// The same direction, from -pi up to below pi.
fn normal(angle: Fine) -> Fine {
    (angle + Fine::PI).rem_euclid(Fine::TAU) - Fine::PI
}

impl Environment for Pendulum {
    fn spec() -> EnvSpec {
        EnvSpec {
            id: "Pendulum-v1",
            shown: Shown::Dense(3),
            taken: Taken::Continuous(1),
            steps_max: 200,
            inputs: vec![("cosine", 1), ("sine", 1), ("speed", 1)],
        }
    }

    fn parts() -> Vec<StatePart> {
        let part =
            |name, most: i64| StatePart { name, numbers: 1, within: -most << 32..=most << 32 };
        vec![part("angle", 128), part("speed", 8)]
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
        let turn = normal(angle);
        let cost = turn * turn + SPEED_COST * (speed * speed) + TORQUE_COST * (torque * torque);
        let faster = speed + (PULL * sin(angle) + TORQUE_SHARE * torque) * TAU;
        self.speed = faster.clamp(-SPEED_MAX, SPEED_MAX);
        self.angle = angle + self.speed * TAU;
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
