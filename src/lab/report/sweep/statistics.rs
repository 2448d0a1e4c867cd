//! What figures say about several runs: mean, its confidence interval, the Pareto front. For terminal, paper and page:
//! the page's script gets them ready made.
//!
//! ```text
//! mean = sum(x) / n      s^2 = sum((x - mean)^2) / (n - 1)      half = t(n - 1) * s / sqrt(n)
//! ```
//!
//! `t(d)` is the 97.5 % point of Student's distribution with `d` degrees of freedom, so `mean - half ..= mean + half`
//! holds the true mean in 95 % of repetitions, if runs are independent and about normal. One run has no interval.

use std::sync::LazyLock;

use statrs::distribution::{ContinuousCDF, StudentsT};

use crate::lab::report::number::size;

/// Some numbers in short.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Summary {
    /// How many.
    pub n: usize,
    /// Their mean.
    pub mean: f64,
    /// Their standard deviation, `s`; none for one number.
    pub deviation: Option<f64>,
    /// Half the width of the 95 % confidence interval of the mean; none for one number.
    pub half: Option<f64>,
    /// The least.
    pub low: f64,
    /// The greatest.
    pub high: f64,
}

/// Mean and interval; none of no numbers.
pub(super) fn summary(values: &[f64]) -> Option<Summary> {
    let n = values.len();
    if n == 0 {
        return None;
    }
    let mean = values.iter().sum::<f64>() / size(n);
    let low = values.iter().copied().fold(f64::INFINITY, f64::min);
    let high = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let squares: f64 = values.iter().map(|value| (value - mean).powi(2)).sum();
    let variance = (n > 1).then(|| squares / size(n - 1));
    let half = variance.map(|variance| student(n - 1) * (variance / size(n)).sqrt());
    Some(Summary { n, mean, deviation: variance.map(f64::sqrt), half, low, high })
}

/// How far two means lie apart, by Welch's test: variances need not be equal.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Welch {
    /// The difference in standard errors.
    pub t: f64,
    /// Degrees of freedom, as Welch and Satterthwaite have them.
    pub degrees: f64,
    /// Chance of a difference so great, or greater, between equal means: two-sided.
    pub p: f64,
}

/// What Welch's test takes of one side: mean, standard deviation, number of runs.
pub(super) type Side = (f64, f64, usize);

/// Compares two means; nothing where a side has one run, or neither varies.
///
/// ```text
/// e = s^2 / n      t = (mean_a - mean_b) / sqrt(e_a + e_b)      d = (e_a + e_b)^2 / (e_a^2 / (n_a - 1) + e_b^2 / (n_b - 1))
/// ```
///
/// B. L. Welch, Biometrika 34 (1947) 28-35.
pub(super) fn welch(a: Side, b: Side) -> Option<Welch> {
    let error = |(_, deviation, n): Side| deviation * deviation / size(n);
    let (a_error, b_error) = (error(a), error(b));
    let both = a_error + b_error;
    if a.2 < 2 || b.2 < 2 || both <= 0.0 {
        return None;
    }
    let t = (a.0 - b.0) / both.sqrt();
    let degrees =
        both * both / (a_error * a_error / size(a.2 - 1) + b_error * b_error / size(b.2 - 1));
    let distribution = StudentsT::new(0.0, 1.0, degrees).ok()?;
    Some(Welch { t, degrees, p: (2.0 * distribution.sf(t.abs())).min(1.0) })
}

/// The 97.5 % point of Student's distribution, for 1 degree of freedom and more.
fn student(degrees: usize) -> f64 {
    /// Those that a sweep asks for once a setting and result.
    static USUAL: LazyLock<[f64; 64]> = LazyLock::new(|| std::array::from_fn(|at| solve(at + 1)));
    USUAL.get(degrees - 1).copied().unwrap_or_else(|| solve(degrees))
}

fn solve(degrees: usize) -> f64 {
    let distribution = StudentsT::new(0.0, 1.0, size(degrees));
    distribution.expect("one number has no interval").inverse_cdf(0.975)
}

/// Which points `(cost, value)` no other beats in both: less cost, and more value (less, where `less`). In order of
/// cost; of equal points the first.
pub(super) fn front(points: &[(f64, f64)], less: bool) -> Vec<usize> {
    let worth = |at: usize| if less { -points[at].1 } else { points[at].1 };
    let mut order: Vec<usize> = (0..points.len()).collect();
    order.sort_by(|&a, &b| {
        points[a].0.total_cmp(&points[b].0).then(worth(b).total_cmp(&worth(a))).then(a.cmp(&b))
    });
    let mut best = f64::NEG_INFINITY;
    order.retain(|&at| {
        let better = worth(at) > best;
        best = best.max(worth(at));
        better
    });
    order
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_of_students_distribution_are_those_of_the_tables() {
        let table = [
            (1, 12.706_204_736),
            (2, 4.302_652_730),
            (3, 3.182_446_305),
            (4, 2.776_445_105),
            (5, 2.570_581_836),
            (9, 2.262_157_163),
            (10, 2.228_138_852),
            (30, 2.042_272_456),
            (40, 2.021_075_390),
            (41, 2.019_540_970),
            (60, 2.000_297_822),
            (120, 1.979_930_405),
        ];
        for (degrees, wanted) in table {
            let found = student(degrees);
            assert!((found - wanted).abs() < 2e-6, "{degrees}: {found} is not {wanted}");
        }
        assert!((1..100).all(|degrees| student(degrees) > student(degrees + 1)));
    }

    #[test]
    fn the_point_is_where_the_distribution_reaches_97_5_percent() {
        for degrees in (1..300).chain([1000, 9999]) {
            let distribution = StudentsT::new(0.0, 1.0, size(degrees)).unwrap();
            let reached = distribution.cdf(student(degrees));
            assert!((reached - 0.975).abs() < 1e-9, "{degrees}: {reached}");
        }
    }

    #[test]
    fn one_number_has_no_interval_and_none_has_no_mean() {
        assert_eq!(summary(&[]), None);
        let one = summary(&[0.5]).unwrap();
        assert_eq!((one.n, one.mean, one.half), (1, 0.5, None));
        let same = summary(&[0.25; 4]).unwrap();
        assert_eq!((same.n, same.mean, same.half), (4, 0.25, Some(0.0)));
        let three = summary(&[1.0, 2.0, 3.0]).unwrap();
        assert_eq!((three.mean, three.low, three.high), (2.0, 1.0, 3.0));
        assert!((three.half.unwrap() - 2.484_137_712).abs() < 1e-6);
    }

    #[test]
    fn the_front_holds_what_no_point_beats() {
        let points = [(3.0, 0.9), (1.0, 0.5), (2.0, 0.5), (2.0, 0.8), (3.0, 0.9), (4.0, 0.85)];
        assert_eq!(front(&points, false), [1, 3, 0]);
        assert_eq!(front(&points, true), [1]);
        assert_eq!(front(&[], false), Vec::<usize>::new());
    }

    #[test]
    fn welchs_test_gives_what_is_worked_out_by_hand() {
        // e = 4/8 and 1/5: t = 2 / sqrt(0.7), d = 0.49 / (0.25/7 + 0.04/4)
        let found = welch((10.0, 2.0, 8), (8.0, 1.0, 5)).unwrap();
        assert!((found.t - 2.390_457_218_668_788).abs() < 1e-12);
        assert!((found.degrees - 10.71875).abs() < 1e-10);
        // equal sides of ten: the classic test, 18 degrees; 2.100922 is its 5 % point
        let half = (0.2f64).sqrt() * 2.100_922_040 / 2.0;
        let even = welch((half, 1.0, 10), (-half, 1.0, 10)).unwrap();
        assert!((even.degrees - 18.0).abs() < 1e-9 && (even.p - 0.05).abs() < 1e-6);
        let back = welch((8.0, 1.0, 5), (10.0, 2.0, 8)).unwrap();
        assert_eq!((back.t, back.p), (-found.t, found.p));
        assert_eq!(welch((1.0, 0.0, 3), (2.0, 0.0, 3)), None, "nothing varies");
        assert_eq!(welch((1.0, 0.1, 1), (2.0, 0.1, 3)), None, "one run says nothing");
    }

    proptest::proptest! {
        #[test]
        fn every_point_is_on_the_front_or_beaten(points in proptest::collection::vec((0u8..9, 0u8..9), 0..30)) {
            let points: Vec<(f64, f64)> =
                points.into_iter().map(|(cost, value)| (cost.into(), value.into())).collect();
            let front = front(&points, false);
            for (at, one) in points.iter().enumerate() {
                let covered = points.iter().enumerate().any(|(other, two)| {
                    two.0 <= one.0 && two.1 >= one.1 && (two != one || other < at)
                });
                proptest::prop_assert_eq!(front.contains(&at), !covered);
            }
        }
    }
}
