//! `Acrobot-v1`: two links hang from a hinge; a torque at the joint between them swings the tip above a line.
//!
//! ```text
//! d1 = 3.5 + cos b      d2 = 1.25 + 0.5 cos b      p2 = 4.9 sin(a + b)
//! p1 = 14.7 sin a + p2 - (0.5 w + v) w sin b
//! w' = (torque + d2 p1 / d1 - 0.5 v^2 sin b - p2) / (1.25 - d2^2 / d1)         torque = action - 1
//! v' = -(d2 w' + p1) / d1                                                     of the book
//! a, b, v, w: a step of 0.2 seconds by Runge and Kutta's fourth order; then a, b are turned into -pi .. pi,
//!             v held to 4 pi and w to 9 pi in size
//! over when -cos a - cos(a + b) > 1, reward then 0, else -1;  500 steps;  shows cos a, sin a, cos b, sin b, v, w
//! begins with a, b, v, w uniform in -0.1 .. 0.1
//! ```
//!
//! Angle `a` of the upper link is from straight down, `b` of the lower from the upper, in radians; `v` and `w` are their
//! speeds. Masses, lengths and moments are 1, centres of mass at half a length, g = 9.8. Between the four stages speeds
//! are held to 2048 in size, so that nothing overflows: from two million states drawn from the whole box none went beyond
//! 900. As Gymnasium 1.4 has it, to 2^-24 of a range in a step; see docs/MODEL.md, 5.4.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use super::canvas::Canvas;
use super::fine::{Fine, cos, reciprocal, shown, sin_cos, turned, uniform};
use super::one::{Action, Came, Environment, StatePart};
use super::{EnvSpec, Observations, Real, Shown, Taken};

/// `g m l / 2`.
const LOWER: Fine = Fine::lit("4.9");
/// `g (m l / 2 + m l)`.
const UPPER: Fine = Fine::lit("14.7");
const HALF: Fine = Fine::lit("0.5");
/// Half of the time of a step, and a sixth of it.
const TAU_HALF: Fine = Fine::lit("0.1");
const TAU: Fine = Fine::lit("0.2");
const TAU_SIXTH: Fine = Fine::lit("0.033333333333333");
const BEGIN: Fine = Fine::lit("0.1");
const STAGE_SPEED_MAX: Fine = Fine::lit("2048");
/// `4 pi` and `9 pi`.
const SPEED_MAX: [Fine; 2] = [Fine::lit("12.566370614359173"), Fine::lit("28.274333882308138")];

/// Angles of the upper and the lower link, and their speeds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Acrobot([Fine; 4]);

/// What changes in a second.
#[inline]
fn change([a, b, v, w]: [Fine; 4], torque: Fine) -> [Fine; 4] {
    let ((sin_a, cos_a), (sin_b, cos_b)) = (sin_cos(a), sin_cos(b));
    let d1 = Fine::lit("3.5") + cos_b;
    let d2 = Fine::lit("1.25") + HALF * cos_b;
    let d1_inverse = reciprocal(d1);
    let p2 = LOWER * (sin_a * cos_b + cos_a * sin_b);
    let p1 = UPPER * sin_a + p2 - (HALF * w + v) * (w * sin_b);
    let share = d2 * d1_inverse;
    let pull = torque + share * p1 - HALF * (v * v) * sin_b - p2;
    let w_change = pull * reciprocal(Fine::lit("1.25") - d2 * share);
    let v_change = -(d2 * w_change + p1) * d1_inverse;
    [v, w, v_change, w_change]
}

/// `from + time x change`, with its speeds held.
#[inline]
fn moved(from: [Fine; 4], time: Fine, change: [Fine; 4]) -> [Fine; 4] {
    let held = |speed: Fine| speed.clamp(-STAGE_SPEED_MAX, STAGE_SPEED_MAX);
    let [a, b, v, w] = std::array::from_fn(|i| from[i] + time * change[i]);
    [a, b, held(v), held(w)]
}

impl Environment for Acrobot {
    fn spec() -> EnvSpec {
        EnvSpec {
            id: "Acrobot-v1".into(),
            shown: Shown::Dense(6),
            taken: Taken::Discrete(3),
            steps_max: 500,
            inputs: vec![
                ("upper cosine", 1),
                ("upper sine", 1),
                ("lower cosine", 1),
                ("lower sine", 1),
                ("upper speed", 1),
                ("lower speed", 1),
            ],
        }
    }

    fn parts() -> Vec<StatePart> {
        let part = |name, most: Fine| StatePart {
            name,
            numbers: 1,
            within: -most.to_bits()..=most.to_bits(),
        };
        vec![
            part("upper_angle", Fine::PI),
            part("lower_angle", Fine::PI),
            part("upper_speed", SPEED_MAX[0]),
            part("lower_speed", SPEED_MAX[1]),
        ]
    }

    fn begin(words: &mut impl Iterator<Item = u32>) -> Self {
        let mut draw = || uniform(words.next().expect("the stream has no end"), -BEGIN, BEGIN);
        Self(std::array::from_fn(|_| draw()))
    }

    #[inline]
    fn act(&mut self, action: Action<'_>) -> Came {
        let torque = Fine::from_num(action.choice()) - Fine::ONE;
        let from = self.0;
        let k1 = change(from, torque);
        let k2 = change(moved(from, TAU_HALF, k1), torque);
        let k3 = change(moved(from, TAU_HALF, k2), torque);
        let k4 = change(moved(from, TAU, k3), torque);
        let sum = |i: usize| k1[i] + (k2[i] + k3[i]) * 2 + k4[i];
        let [a, b, v, w] = std::array::from_fn(|i| from[i] + TAU_SIXTH * sum(i));
        let [v_max, w_max] = SPEED_MAX;
        self.0 = [turned(a), turned(b), v.clamp(-v_max, v_max), w.clamp(-w_max, w_max)];
        let [a, b, ..] = self.0;
        let terminated = -cos(a) - cos(a + b) > Fine::ONE;
        Came { reward: if terminated { Real::ZERO } else { Real::NEG_ONE }, terminated }
    }

    #[inline]
    fn show(&self, to: &mut Observations) {
        let [a, b, v, w] = self.0;
        let ((sin_a, cos_a), (sin_b, cos_b)) = (sin_cos(a), sin_cos(b));
        to.values.extend([cos_a, sin_a, cos_b, sin_b, v, w].map(shown));
    }

    fn numbers(&self, numbers: &mut Vec<i64>) {
        numbers.extend(self.0.map(Fine::to_bits));
    }

    fn from_numbers(numbers: &[i64]) -> Self {
        Self(std::array::from_fn(|part| Fine::from_bits(numbers[part])))
    }

    fn picture(&self) -> String {
        let mut canvas = Canvas::new(33, 17);
        let [a, b, ..] = self.0;
        let hinge = [16, 8].map(Fine::from_num);
        let hang = |[column, row]: [Fine; 2], angle: Fine| {
            let (sin, cos) = sin_cos(angle);
            [column + sin * 8, row + cos * 4]
        };
        let joint = hang(hinge, a);
        canvas.line([0, 4].map(Fine::from_num), [32, 4].map(Fine::from_num), '-');
        canvas.line(hinge, joint, 'o');
        canvas.line(joint, hang(joint, a + b), 'o');
        canvas.put(hinge, '+');
        canvas.to_string()
    }
}
