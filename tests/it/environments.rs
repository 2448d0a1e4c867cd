//! Classic environments step as Gymnasium does: from each recorded state, one step (`tests/golden/gymnasium_env.py`).
//!
//! ```text
//! |state - recorded| <= 2^-14 of the variable's range, and at most the bound that the environment's file states
//! over as recorded, but where what decides lies within that distance of its limit
//! ```

use std::f64::consts::PI;

use dalean::num::draw::{Place, Site};
use dalean::task::environment::acrobot::Acrobot;
use dalean::task::environment::cart_pole::CartPole;
use dalean::task::environment::fine::{Fine, sin_cos};
use dalean::task::environment::mountain_car::MountainCar;
use dalean::task::environment::one::{Action, Environment};
use dalean::task::environment::pendulum::Pendulum;
use dalean::task::environment::{Observations, Real, Taken};

/// Of a variable's range.
const BOUND: f64 = 1.0 / 16384.0;

/// A recorded step.
struct Step {
    before: Vec<f64>,
    action: f64,
    after: Vec<f64>,
    reward: f64,
    over: bool,
}

/// The steps that were recorded of `E`.
fn recorded<E: Environment>(file: &str) -> Vec<Step> {
    let spec = E::spec();
    let mut lines = file.lines();
    assert!(lines.next().unwrap().starts_with("gymnasium 1."));
    assert_eq!(lines.next().unwrap(), format!("{} {}", spec.id, spec.steps_max));
    let variables = E::parts().len();
    let steps: Vec<Step> = lines
        .map(|line| {
            let values: Vec<f64> = line.split(',').map(|value| value.parse().unwrap()).collect();
            assert_eq!(values.len(), 2 * variables + 3, "{line}");
            let (before, rest) = values.split_at(variables);
            let (after, last) = rest[1..].split_at(variables);
            Step {
                before: before.into(),
                action: rest[0],
                after: after.into(),
                reward: last[0],
                over: last[1] == 1.0,
            }
        })
        .collect();
    assert!(steps.len() >= 300);
    steps
}

fn fine(value: f64) -> i64 {
    (value * 2_f64.powi(32)).round() as i64
}

fn float(bits: i64) -> f64 {
    bits as f64 / 2_f64.powi(32)
}

/// Takes every recorded step. `ranges` are those of the variables, `bits` how near the file says it comes, as `2^-bits` of a
/// range; `circles` the variables that are angles; `limit` how far a state is from where the task is over, over the range.
fn steps_as_recorded<E: Environment>(
    file: &str,
    ranges: &[f64],
    bits: i32,
    circles: &[usize],
    limit: impl Fn(&[f64]) -> f64,
    shown: impl Fn(&[f64]) -> Vec<f64>,
) {
    let mut worst = 0.0_f64;
    let mut decided = [0; 2];
    let steps = recorded::<E>(file);
    for Step { before, action, after, reward, over } in &steps {
        let within = |(at, value): (usize, &f64)| {
            let turns = if circles.contains(&at) { (value / (2.0 * PI)).round() } else { 0.0 };
            fine(value - 2.0 * PI * turns)
        };
        let numbers: Vec<i64> = before.iter().enumerate().map(within).collect();
        let mut one = E::from_numbers(&numbers);
        let number = [Real::from_num(*action)];
        let came = one.act(match E::spec().taken {
            Taken::Discrete(_) => Action::Discrete(*action as u16),
            Taken::Continuous(_) => Action::Continuous(&number),
        });
        let mut reached = vec![];
        one.numbers(&mut reached);
        for (at, range) in ranges.iter().enumerate() {
            let mut error = (float(reached[at]) - after[at]).abs();
            if circles.contains(&at) {
                error = (error - 2.0 * PI * (error / (2.0 * PI)).round()).abs();
            }
            worst = worst.max(error / range);
            assert!(error <= BOUND * range, "{before:?} {action}: {at} {error:e}");
        }
        if limit(after).abs() > BOUND {
            decided[usize::from(*over)] += 1;
            assert_eq!(came.terminated, *over, "{before:?} {action} {after:?}");
        }
        if came.terminated == *over {
            let error = (came.reward.to_num::<f64>() - reward).abs();
            assert!(error <= 2_f64.powi(-16), "{before:?} {action}: reward {error:e}");
        }
        let mut observations = Observations::default();
        one.show(&mut observations);
        let wanted = shown(&reached.iter().copied().map(float).collect::<Vec<_>>());
        assert_eq!(observations.values.len(), wanted.len());
        for (value, wanted) in observations.values.iter().zip(wanted) {
            assert!((value.to_num::<f64>() - wanted).abs() <= 2_f64.powi(-16), "{value} {wanted}");
        }
    }
    println!("{}: within 2^{:.1}, {decided:?}", E::spec().id, worst.log2());
    assert!(worst <= 2_f64.powi(-bits), "2^{:.1} of a range", worst.log2());
    assert!(
        decided[0] >= 100 && (decided[1] >= 20 || E::spec().id == "Pendulum-v1"),
        "{decided:?}"
    );
}

#[test]
fn cart_pole_steps_as_gymnasium_does() {
    let limit = |state: &[f64]| {
        let angle = 12.0 * PI / 180.0;
        ((state[0].abs() - 2.4) / 4.8).abs().min(((state[2].abs() - angle) / (2.0 * angle)).abs())
    };
    let file = include_str!("../golden/environments/cart_pole.csv");
    steps_as_recorded::<CartPole>(file, &[4.8, 20.0, 0.42, 20.0], 28, &[], limit, <[f64]>::to_vec);
}

#[test]
fn acrobot_steps_as_gymnasium_does() {
    let limit = |state: &[f64]| (-state[0].cos() - (state[0] + state[1]).cos() - 1.0) / 4.0;
    let shown = |s: &[f64]| vec![s[0].cos(), s[0].sin(), s[1].cos(), s[1].sin(), s[2], s[3]];
    let file = include_str!("../golden/environments/acrobot.csv");
    let ranges = [2.0 * PI, 2.0 * PI, 8.0 * PI, 18.0 * PI];
    steps_as_recorded::<Acrobot>(file, &ranges, 24, &[0, 1], limit, shown);
}

#[test]
fn pendulum_steps_as_gymnasium_does() {
    let shown = |s: &[f64]| vec![s[0].cos(), s[0].sin(), s[1]];
    let file = include_str!("../golden/environments/pendulum.csv");
    steps_as_recorded::<Pendulum>(file, &[2.0 * PI, 16.0], 28, &[0], |_| 1.0, shown);
}

#[test]
fn mountain_car_steps_as_gymnasium_does() {
    let limit = |state: &[f64]| {
        let [position, speed] = [(state[0] - 0.45) / 1.8, state[1] / 0.14];
        if position.abs() < speed.abs() { position } else { speed }
    };
    let file = include_str!("../golden/environments/mountain_car.csv");
    steps_as_recorded::<MountainCar>(file, &[1.8, 0.14], 22, &[], limit, <[f64]>::to_vec);
}

#[test]
fn sine_and_cosine_are_as_near_as_they_say() {
    let mut worst = [0.0_f64; 2];
    for step in 0..400_000_i64 {
        // every angle to 64 by a step that no symmetry divides, then farther ones
        let bits = if step < 200_000 { step * 1_374_389 } else { (step - 200_000) * 21_990_233 };
        for angle in [bits, -bits].map(Fine::from_bits) {
            let (sin, cos) = sin_cos(angle);
            let (wanted_sin, wanted_cos) = float(angle.to_bits()).sin_cos();
            let error = (sin.to_num::<f64>() - wanted_sin)
                .abs()
                .max((cos.to_num::<f64>() - wanted_cos).abs());
            let far = usize::from(step >= 200_000);
            worst[far] = worst[far].max(error);
        }
    }
    println!("2^{:.1} and 2^{:.1}", worst[0].log2(), worst[1].log2());
    assert!(worst[0] <= 2_f64.powi(-26) && worst[1] <= 2_f64.powi(-22), "{worst:?}");
}

/// Least, mean, greatest and variance of a variable over beginnings.
fn beginnings<E: Environment>(variable: usize) -> [f64; 4] {
    let values: Vec<f64> = (0..4000)
        .map(|episode| {
            let one = E::begin(&mut Place::global(1, Site::Environment, episode).words());
            let mut numbers = vec![];
            one.numbers(&mut numbers);
            float(numbers[variable])
        })
        .collect();
    let mean = values.iter().sum::<f64>() / 4000.0;
    let variance = values.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / 4000.0;
    let least = values.iter().copied().fold(f64::MAX, f64::min);
    [least, mean, values.iter().copied().fold(f64::MIN, f64::max), variance]
}

#[test]
fn episodes_begin_as_gymnasium_s_do() {
    let uniform = |[least, mean, greatest, variance]: [f64; 4], low: f64, high: f64| {
        let width = high - low;
        assert!((0.0..0.002 * width).contains(&(least - low)), "{least} {low}");
        assert!((0.0..0.002 * width).contains(&(high - greatest)), "{greatest} {high}");
        assert!((mean - (low + high) / 2.0).abs() < 0.02 * width, "{mean}");
        assert!((variance / (width * width / 12.0) - 1.0).abs() < 0.06, "{variance}");
    };
    for variable in 0..4 {
        uniform(beginnings::<CartPole>(variable), -0.05, 0.05);
        uniform(beginnings::<Acrobot>(variable), -0.1, 0.1);
    }
    uniform(beginnings::<Pendulum>(0), -PI, PI);
    uniform(beginnings::<Pendulum>(1), -1.0, 1.0);
    uniform(beginnings::<MountainCar>(0), -0.6, -0.4);
    assert_eq!(beginnings::<MountainCar>(1), [0.0; 4]);
}
