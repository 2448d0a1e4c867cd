//! `CartPole-v1`: keep a pole upright on a cart that is pushed left or right.
//!
//! ```text
//! t   = (force + m_p l w^2 sin a) / m        force = -10 or 10, m_p = 0.1, m = m_p + 1, l = 0.5, g = 9.8
//! w'  = (g sin a - cos a t) / (l (4/3 - m_p cos^2 a / m))
//! v'  = t - m_p l w' cos a / m
//! x += 0.02 v;  v += 0.02 v';  a += 0.02 w;  w += 0.02 w'          Euler, all from the values before
//! over when |x| > 2.4 or |a| > 12 degrees;  reward 1 a step, the last one too;  500 steps
//! begins with x, v, a, w uniform in -0.05 .. 0.05
//! ```
//!
//! `x` is in metres, `a` in radians, upwards 0. Speeds `v` and `w` are held to 256 in size, twenty times what an episode
//! reaches, so that nothing overflows. As Gymnasium 1.4 has it, to 2^-28 of a range in a step; see docs/MODEL.md, 5.4.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use super::canvas::Canvas;
use super::fine::{Fine, reciprocal, shown, sin_cos, uniform};
use super::one::{Action, Came, Environment, StatePart};
use super::{EnvSpec, Observations, Real, Shown, Taken};

const FORCE: Fine = Fine::lit("10");
const GRAVITY: Fine = Fine::lit("9.8");
/// `m_p l`.
const POLE_MOMENT: Fine = Fine::lit("0.05");
/// `1 / m = 1 / 1.1`.
const MASS_INVERSE: Fine = Fine::lit("0.909090909090909");
/// `m_p l / m = 0.05 / 1.1`.
const POLE_MOMENT_SHARE: Fine = Fine::lit("0.045454545454545");
/// `4 l / 3`.
const INERTIA: Fine = Fine::lit("0.666666666666667");
/// Seconds a step.
const TAU: Fine = Fine::lit("0.02");
const POSITION_MAX: Fine = Fine::lit("2.4");
/// 12 degrees, `12 pi / 180`.
const ANGLE_MAX: Fine = Fine::lit("0.209439510239320");
const BEGIN: Fine = Fine::lit("0.05");
const SPEED_MAX: Fine = Fine::lit("256");

/// A cart with a pole.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct CartPole {
    position: Fine,
    speed: Fine,
    angle: Fine,
    angular_speed: Fine,
}

fn held(speed: Fine) -> Fine {
    speed.clamp(-SPEED_MAX, SPEED_MAX)
}

impl Environment for CartPole {
    fn spec() -> EnvSpec {
        EnvSpec {
            id: "CartPole-v1".into(),
            shown: Shown::Dense(4),
            taken: Taken::Discrete(2),
            steps_max: 500,
            inputs: vec![
                ("cart position", 1),
                ("cart speed", 1),
                ("pole angle", 1),
                ("pole speed", 1),
            ],
        }
    }

    fn parts() -> Vec<StatePart> {
        let part =
            |name, most: i64| StatePart { name, numbers: 1, within: -most << 32..=most << 32 };
        vec![
            part("cart_position", 8),
            part("cart_speed", 256),
            part("pole_angle", 8),
            part("pole_speed", 256),
        ]
    }

    fn begin(words: &mut impl Iterator<Item = u32>) -> Self {
        let mut draw = || uniform(words.next().expect("the stream has no end"), -BEGIN, BEGIN);
        Self { position: draw(), speed: draw(), angle: draw(), angular_speed: draw() }
    }

    #[inline]
    fn act(&mut self, action: Action<'_>) -> Came {
        let force = if action.choice() == 1 { FORCE } else { -FORCE };
        let Self { position, speed, angle, angular_speed } = *self;
        let (sin, cos) = sin_cos(angle);
        let push = (force + POLE_MOMENT * (angular_speed * angular_speed) * sin) * MASS_INVERSE;
        let turn =
            (GRAVITY * sin - cos * push) * reciprocal(INERTIA - POLE_MOMENT_SHARE * (cos * cos));
        let pull = push - POLE_MOMENT_SHARE * (turn * cos);
        self.position = position + TAU * speed;
        self.speed = held(speed + TAU * pull);
        self.angle = angle + TAU * angular_speed;
        self.angular_speed = held(angular_speed + TAU * turn);
        let terminated = self.position.abs() > POSITION_MAX || self.angle.abs() > ANGLE_MAX;
        Came { reward: Real::ONE, terminated }
    }

    #[inline]
    fn show(&self, to: &mut Observations) {
        let Self { position, speed, angle, angular_speed } = *self;
        to.values.extend([position, speed, angle, angular_speed].map(shown));
    }

    fn numbers(&self, numbers: &mut Vec<i64>) {
        let Self { position, speed, angle, angular_speed } = *self;
        numbers.extend([position, speed, angle, angular_speed].map(Fine::to_bits));
    }

    fn from_numbers(numbers: &[i64]) -> Self {
        let fine = |part: usize| Fine::from_bits(numbers[part]);
        Self { position: fine(0), speed: fine(1), angle: fine(2), angular_speed: fine(3) }
    }

    fn picture(&self) -> String {
        let mut canvas = Canvas::new(53, 7);
        let fine = |number: i32| Fine::from_num(number);
        let middle = fine(26) + self.position * 10;
        let (sin, cos) = sin_cos(self.angle);
        let tip = [middle + sin * 10, fine(5) - cos * 5];
        canvas.line([fine(2), fine(6)], [fine(50), fine(6)], '-');
        canvas.line([middle, fine(5)], tip, 'o');
        canvas.line([middle - fine(2), fine(5)], [middle + fine(2), fine(5)], '=');
        canvas.to_string()
    }
}
