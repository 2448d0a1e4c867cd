//! Tables against their formulas in whole numbers, written again here.

use super::*;

fn millionths(value: f64) -> Millionths {
    Millionths((value * 1e6).round() as i64)
}

/// `floor(n / d + 1/2)` of rationals, for numbers that are not below 0.
fn nearest(n: i128, d: i128) -> u32 {
    u32::try_from((2 * n + d) / (2 * d)).unwrap()
}

/// Exact halves go up, whatever doubles make of them.
fn same(got: &[u32], want: &[u32]) {
    let off = got.iter().zip(want).filter(|(a, b)| a != b).count();
    assert!(off == 0 && got.len() == want.len(), "{off} of {} differ", got.len());
}

#[test]
fn linear_steps_are_their_rational() {
    let (span, states) = (200u16, 64u32);
    let steps = LinearSteps {
        up: [millionths(1.5), millionths(0.5)],
        down: [millionths(0.25), millionths(2.0)],
    };
    let [up, down] = Response::Linear(steps).table(span, states, millionths(0.125));
    // 2^8 N / P (1 + a) (u_0 + (u_1 - u_0) i / N), all over 8 and 4
    let n = i128::from(span);
    let want_up: Vec<u32> =
        (0..=n).map(|i| nearest(256 * 9 * (3 * n - 2 * i), 8 * 2 * 64)).collect();
    let want_down: Vec<u32> = (0..=n).map(|i| nearest(256 * 7 * (n + 7 * i), 8 * 4 * 64)).collect();
    same(&up, &want_up);
    same(&down, &want_down);
}

#[test]
fn soft_bounds_are_their_rational_and_end_at_the_bounds() {
    let [up, down] = Response::SoftBounds(SoftBoundSteps::default()).table(255, 100, Millionths(0));
    let want: Vec<u32> = (0..=255i128).map(|i| nearest(256 * 2 * (255 - i), 100)).collect();
    same(&up, &want);
    assert!(down.iter().rev().eq(want.iter()));
    assert_eq!((up[255], down[0]), (0, 0));
}

#[test]
fn an_exponential_part_grows_by_its_factor() {
    // with a growth of ln 2 = 0.693147 and z from 0 to -8, steps up are 1 + 2^-(8 x), to six places
    let steps = ExponentialSteps {
        amplitude: [millionths(-1.0), millionths(2.0)],
        growth: [Millionths(693_147), Millionths(693_147)],
        z: [Millionths(0), millionths(-4.0)],
    };
    let [up, down] = Response::Exponential(steps).table(256, 16, Millionths(0));
    for (x, want) in [(0, 8192), (64, 6144), (128, 5120), (256, 4352)] {
        assert!(up[x].abs_diff(want) <= 1, "{x}: {}", up[x]);
    }
    // 1 - 2 2^(4 x) is below 0 everywhere
    assert!(down.iter().all(|&step| step == 0));
}

#[test]
fn given_points_are_met_and_joined_by_lines() {
    let row = |x: f64, up: f64, down: f64| [x, up, down].map(millionths);
    let measured = MeasuredSteps {
        points: vec![row(0.0, 0.1, 0.0), row(0.25, 0.05, 0.025), row(1.0, 0.0, 0.1)],
    };
    assert_eq!(measured.check(), Ok(()));
    let [up, down] = Response::Measured(measured).table(100, 7, Millionths(0));
    assert_eq!([up[0], up[25], up[100]], [2560, 1280, 0]);
    assert_eq!([down[0], down[25], down[100]], [0, 640, 2560]);
    // half way between the first two
    assert_eq!(up[5], nearest(256 * 9, 1));
    let short = MeasuredSteps { points: vec![row(0.0, 0.1, 0.1)] };
    let backwards = MeasuredSteps { points: vec![row(0.0, 0.1, 0.1), row(0.0, 0.1, 0.1)] };
    let below = MeasuredSteps { points: vec![row(0.0, -0.1, 0.1), row(1.0, 0.1, 0.1)] };
    for wrong in [short, backwards, below] {
        assert_eq!(wrong.check().unwrap_err().name, "points");
    }
}

#[test]
fn no_step_is_longer_than_the_window() {
    let steps = LinearSteps { up: [millionths(900.0); 2], ..LinearSteps::default() };
    let [up, _] = Response::Linear(steps).table(4095, 2, Millionths(0));
    assert!(up.iter().all(|&step| step == 4095 << 8));
    let label = NeurosimSteps { labels: [millionths(9.5), Millionths(0)] };
    assert_eq!(Response::Neurosim(label).check().unwrap_err().name, "labels");
}
