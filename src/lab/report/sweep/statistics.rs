//! What figures say about several runs: mean, its confidence interval, the Pareto front.
//!
//! ```text
//! mean = sum(x) / n      s^2 = sum((x - mean)^2) / (n - 1)      half = t(n - 1) * s / sqrt(n)
//! ```
//!
//! `t(d)` is the 97.5 % point of Student's distribution with `d` degrees of freedom, so `mean - half ..= mean + half`
//! holds the true mean in 95 % of repetitions, if runs are independent and about normal. One run has no interval.

use crate::lab::report::number::size;

/// Degrees of freedom up to which [`student`] solves for its value; beyond, a series is as exact as a float shows.
pub(super) const SOLVED: usize = 40;

/// Some numbers in short.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Summary {
    /// How many.
    pub n: usize,
    /// Their mean.
    pub mean: f64,
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
    let half = (n > 1).then(|| {
        let squares: f64 = values.iter().map(|value| (value - mean).powi(2)).sum();
        student(n - 1) * (squares / size(n - 1) / size(n)).sqrt()
    });
    Some(Summary { n, mean, half, low, high })
}

/// The 97.5 % point of Student's distribution, for 1 degree of freedom and more.
pub(super) fn student(degrees: usize) -> f64 {
    assert!(degrees > 0, "one number has no interval");
    if degrees > SOLVED {
        // Cornish and Fisher's expansion around the normal distribution's 97.5 % point.
        let (z, d) = (1.959_963_984_540_054_f64, size(degrees));
        let first = (z.powi(3) + z) / (4.0 * d);
        let second = (5.0 * z.powi(5) + 16.0 * z.powi(3) + 3.0 * z) / (96.0 * d * d);
        let third = (3.0 * z.powi(7) + 19.0 * z.powi(5) + 17.0 * z.powi(3) - 15.0 * z)
            / (384.0 * d.powi(3));
        return z + first + second + third;
    }
    let (mut low, mut high) = (1.0, 13.0);
    for _ in 0..80 {
        let middle = 0.5 * (low + high);
        if inside(middle, degrees) < 0.95 { low = middle } else { high = middle }
    }
    0.5 * (low + high)
}

/// The chance of `-t ..= t`: finite sums of powers of cosines (Abramowitz and Stegun, 26.7.3 and 26.7.4).
fn inside(t: f64, degrees: usize) -> f64 {
    let angle = (t / size(degrees).sqrt()).atan();
    let square = angle.cos().powi(2);
    let odd = degrees % 2;
    let mut term = if odd == 1 { angle.cos() } else { 1.0 };
    let mut sum = if degrees > 1 { term } else { 0.0 };
    for power in (2 + odd..degrees.saturating_sub(1)).step_by(2) {
        term *= square * size(power - 1) / size(power);
        sum += term;
    }
    if odd == 1 {
        2.0 / std::f64::consts::PI * (angle + angle.sin() * sum)
    } else {
        angle.sin() * sum
    }
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
