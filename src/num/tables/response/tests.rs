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

/// Steps of a table as fractions of whole numbers: by each part of the window alone, rounded by hand.
fn table_by_hand(row: &[Millionths], span: u16, states: u32, share: i128) -> Vec<u32> {
    let (n, parts) = (i128::from(span), row.len() as i128 - 1);
    let of = |i: i128| {
        // the first part whose end is not below i / N
        let part = (0..parts).find(|part| i * parts <= (part + 1) * n).unwrap();
        let [from, to] = [part, part + 1].map(|at| i128::from(row[at as usize].0));
        // from + (to - from) (i parts - part N) / N, times 2^8 N (1 + a) / P, in millionths twice
        let above = from * n + (to - from) * (i * parts - part * n);
        let (above, below) = (256 * share * above, i128::from(states) * 1_000_000_000_000);
        nearest(above, below).min(u32::from(span) << 8)
    };
    (0..=n).map(of).collect()
}

proptest::proptest! {
    /// Faults this is made for: a part too far, a window that does not cancel, a lean to the wrong side, a half rounded down.
    #[test]
    fn a_table_is_its_rational(
        rows in proptest::collection::vec([0i64..=5_000_000, 0i64..=5_000_000], 2..=64),
        span in 1u16..=4095,
        states in 1u32..=2000,
        lean in -1_000_000i64..=1_000_000,
    ) {
        let row = |of: usize| rows.iter().map(|both| Millionths(both[of])).collect::<Vec<_>>();
        let steps = TableSteps { up: row(0), down: row(1) };
        proptest::prop_assert_eq!(steps.check(), Ok(()));
        let wanted = [(&steps.up, lean), (&steps.down, -lean)].map(|(row, lean)| {
            table_by_hand(row, span, states, 1_000_000 + i128::from(lean))
        });
        let response = Response::Table(steps);
        let found = response.table(span, states, Millionths(lean));
        proptest::prop_assert_eq!(&found, &wanted);
        // and as doubles, which fits and figures take
        let steps = response.steps(states);
        for i in 0..=span {
            let doubles = steps(f64::from(i) / f64::from(span));
            for (of, share) in [(0, 1e6 + lean as f64), (1, 1e6 - lean as f64)] {
                let fine = doubles[of].min(1e3) * share / 1e6 * 256.0 * f64::from(span);
                let whole = f64::from(found[of][usize::from(i)]);
                let held = fine.min(256.0 * f64::from(span));
                proptest::prop_assert!((held - whole).abs() <= 0.5 + 1e-6 * held.max(1.0));
            }
        }
    }

    /// Of two steps it is a straight line, which doubles know too: they may miss a half.
    #[test]
    fn a_table_of_two_steps_is_a_line(
        ends in [0i64..=3_000_000, 0i64..=3_000_000, 0i64..=3_000_000, 0i64..=3_000_000],
        span in 1u16..=4095,
        states in 1u32..=2000,
    ) {
        let [a, b, c, d] = ends.map(Millionths);
        let table = Response::Table(TableSteps { up: vec![a, b], down: vec![c, d] });
        let line = Response::Linear(LinearSteps { up: [a, b], down: [c, d] });
        let [table, line] = [table, line].map(|of| of.table(span, states, Millionths(0)));
        for (table, line) in table.iter().flatten().zip(line.iter().flatten()) {
            proptest::prop_assert!(table.abs_diff(*line) <= 1);
        }
    }
}

#[test]
fn rows_of_a_table_are_as_long_as_one_another_and_no_step_is_below_0() {
    let row = |steps: &[f64]| steps.iter().map(|&step| millionths(step)).collect::<Vec<_>>();
    for (up, down, name) in [
        (row(&[1.0]), row(&[1.0]), "up"),
        (row(&[1.0, 1.0]), row(&[1.0, 1.0, 1.0]), "up"),
        (row(&[1.0; 65]), row(&[1.0; 65]), "up"),
        (row(&[1.0, -0.1]), row(&[1.0, 1.0]), "up"),
        (row(&[1.0, 1.0]), row(&[1.0, 1000.1]), "down"),
    ] {
        assert_eq!(TableSteps { up, down }.check().unwrap_err().name, name);
    }
    let most = TableSteps { up: row(&[0.0; 64]), down: row(&[1000.0; 64]) };
    assert_eq!(most.check(), Ok(()));
    let [up, down] = Response::Table(most).table(4095, 1, Millionths(-1_000_000));
    assert!(up.iter().all(|&step| step == 0) && down.iter().all(|&step| step == 4095 << 8));
}
