//! Weighted least squares on steps over places of the window: sums by 256 parts, and small systems solved by elimination.
//!
//! Only `+ - * /`, so that a table gives the same numbers on every machine.

/// Parts of the window that steps are summed by.
const PARTS: usize = 256;
/// How much a row of steps resists a bend, as a share of what data say: enough to lay a line where there are none.
const STIFF: f64 = 1e-9;

/// Steps of one polarity, summed by parts of the window.
#[derive(Debug, Clone, Default)]
pub(super) struct Cloud {
    /// Mean place, mean step and weight of each part that has steps.
    pub(super) sums: Vec<[f64; 3]>,
    /// Weighted squares about the means.
    rest: f64,
}

impl Cloud {
    /// Of places (0 to 1), steps and weights.
    pub(super) fn new(points: impl Iterator<Item = [f64; 3]>) -> Self {
        let mut all = vec![[0.0; 4]; PARTS];
        for [x, y, weight] in points {
            // a cast saturates
            let at = ((x * PARTS as f64) as usize).min(PARTS - 1);
            let sums = &mut all[at];
            for (sum, term) in sums.iter_mut().zip([weight, weight * x, weight * y, weight * y * y])
            {
                *sum += term;
            }
        }
        let mut cloud = Self::default();
        for [weight, x, y, squares] in all.into_iter().filter(|sums| sums[0] > 0.0) {
            cloud.sums.push([x / weight, y / weight, weight]);
            cloud.rest += (squares - y * y / weight).max(0.0);
        }
        cloud
    }

    /// Weighted squares about a curve.
    pub(super) fn squares(&self, curve: impl Fn(f64) -> f64) -> f64 {
        let about = |&[x, y, weight]: &[f64; 3]| {
            let off = y - curve(x);
            weight * off * off
        };
        self.rest + self.sums.iter().map(about).sum::<f64>()
    }

    /// What `y = sum of c_k basis_k(x)` fits best, and its squares.
    pub(super) fn fit<const N: usize>(&self, basis: impl Fn(f64) -> [f64; N]) -> [f64; N] {
        let (mut matrix, mut right) = (vec![vec![0.0; N]; N], vec![0.0; N]);
        for &[x, y, weight] in &self.sums {
            let row = basis(x);
            for i in 0..N {
                right[i] += weight * row[i] * y;
                for j in 0..N {
                    matrix[i][j] += weight * row[i] * row[j];
                }
            }
        }
        let found = solve(matrix, right);
        std::array::from_fn(|i| found[i])
    }

    /// Steps at `parts + 1` equally spaced places whose lines fit best, none below 0.
    pub(super) fn knots(&self, parts: usize) -> Vec<f64> {
        let (mut matrix, mut right) = (vec![vec![0.0; parts + 1]; parts + 1], vec![0.0; parts + 1]);
        for &[x, y, weight] in &self.sums {
            let (at, part) = place(x, parts);
            for (i, share) in [(at, 1.0 - part), (at + 1, part)] {
                right[i] += weight * share * y;
                for (j, other) in [(at, 1.0 - part), (at + 1, part)] {
                    matrix[i][j] += weight * share * other;
                }
            }
        }
        let most = (0..=parts).map(|i| matrix[i][i]).fold(0.0, f64::max);
        for bend in 1..parts {
            let weights = [(bend - 1, 1.0), (bend, -2.0), (bend + 1, 1.0)];
            for (i, a) in weights {
                for (j, b) in weights {
                    matrix[i][j] += STIFF * most * a * b;
                }
            }
        }
        solve(matrix, right).into_iter().map(|step| step.max(0.0)).collect()
    }
}

/// The place of `x` in a row: the one before it, and how far behind that.
fn place(x: f64, parts: usize) -> (usize, f64) {
    let along = x.clamp(0.0, 1.0) * parts as f64;
    let at = (along as usize).min(parts - 1);
    (at, along - at as f64)
}

/// The step of a row at `x`.
pub(super) fn between(row: &[f64], x: f64) -> f64 {
    let (at, part) = place(x, row.len() - 1);
    row[at] + (row[at + 1] - row[at]) * part
}

/// Solves a symmetric system; what nothing decides is 0.
fn solve(mut matrix: Vec<Vec<f64>>, mut right: Vec<f64>) -> Vec<f64> {
    let size = right.len();
    let least = 1e-13 * (0..size).map(|i| matrix[i][i]).fold(0.0, f64::max);
    for at in 0..size {
        if matrix[at][at] <= least {
            continue;
        }
        for below in at + 1..size {
            let share = matrix[below][at] / matrix[at][at];
            let (above, rows) = matrix.split_at_mut(below);
            for (to, from) in rows[0][at..].iter_mut().zip(&above[at][at..]) {
                *to -= share * from;
            }
            right[below] -= share * right[at];
        }
    }
    let mut found = vec![0.0; size];
    for at in (0..size).rev() {
        if matrix[at][at] > least {
            let known: f64 = (at + 1..size).map(|i| matrix[at][i] * found[i]).sum();
            found[at] = (right[at] - known) / matrix[at][at];
        }
    }
    found
}

/// Where a function of one hump downward is least between two ends, by golden sections.
pub(super) fn least(of: impl Fn(f64) -> f64, [mut from, mut to]: [f64; 2]) -> f64 {
    const GOLDEN: f64 = 0.618_033_988_749_895;
    let inner = |from: f64, to: f64| [to - GOLDEN * (to - from), from + GOLDEN * (to - from)];
    let [mut a, mut b] = inner(from, to);
    let (mut of_a, mut of_b) = (of(a), of(b));
    for _ in 0..48 {
        if of_a <= of_b {
            to = b;
            (b, of_b) = (a, of_a);
            a = inner(from, to)[0];
            of_a = of(a);
        } else {
            from = a;
            (a, of_a) = (b, of_b);
            b = inner(from, to)[1];
            of_b = of(b);
        }
    }
    0.5 * (from + to)
}

/// The same of any function, first tried at evenly spaced places.
pub(super) fn least_of_many(of: impl Fn(f64) -> f64, [from, to]: [f64; 2], tries: usize) -> f64 {
    let step = (to - from) / (tries - 1) as f64;
    let place = |at: usize| from + step * at as f64;
    let values: Vec<f64> = (0..tries).map(|at| of(place(at))).collect();
    let best = (0..tries).reduce(|a, b| if values[b] < values[a] { b } else { a }).unwrap_or(0);
    let at = place(best);
    least(of, [(at - step).max(from), (at + step).min(to)])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(points: impl Iterator<Item = f64>, curve: impl Fn(f64) -> f64) -> Cloud {
        Cloud::new(points.map(|x| [x, curve(x), 1.0 + x]))
    }

    fn all() -> impl Iterator<Item = f64> {
        (0..1000).map(|i| f64::from(i) / 1000.0)
    }

    #[test]
    fn lines_are_found_again() {
        let cloud = of(all(), |x| 3.0 - 2.0 * x);
        let [at_0, slope] = cloud.fit(|x| [1.0, x]);
        assert!((at_0 - 3.0).abs() < 1e-9 && (slope + 2.0).abs() < 1e-9);
        let row = [1.0, 0.5, 0.75, 0.0, 0.25];
        let cloud = of(all(), |x| between(&row, x));
        for (found, wanted) in cloud.knots(4).iter().zip(row) {
            assert!((found - wanted).abs() < 1e-6, "{found} for {wanted}");
        }
        // what is left is the slope inside a part
        assert!(cloud.squares(|x| between(&row, x)) < 1e-4 * cloud.squares(|_| 0.0));
    }

    #[test]
    fn where_nothing_is_measured_a_line_is_laid() {
        let cloud = of(all().filter(|x| !(0.3..0.7).contains(x)), |x| 1.0 - x);
        for (at, found) in cloud.knots(16).iter().enumerate() {
            assert!((found - (1.0 - at as f64 / 16.0)).abs() < 1e-5, "{at}: {found}");
        }
    }

    #[test]
    fn the_least_is_found_in_one_of_two_valleys() {
        let two = |x: f64| (x * x - 1.0) * (x * x - 1.0) + 0.1 * x;
        assert!((least_of_many(two, [-2.0, 2.0], 21) + 1.012).abs() < 1e-2);
        assert!((least(|x| (x - 0.3) * (x - 0.3), [0.0, 1.0]) - 0.3).abs() < 1e-7);
    }
}
