//! The kinds of curves that a device can have, each fitted to the same steps, and which of them says most with fewest numbers.
//!
//! ```text
//! weighted    v = sum w (y / f - step(x))^2 / n            the mean weight is 1
//! worth       n ln(v + e^2) + k ln n                       k numbers of the kind;  e: a hundredth of the mean step, which is no difference
//! ```
//!
//! A number more has to take its share off the squares: the least worth is best (Schwarz's criterion). Of many pulses it tells
//! differences that nobody would mind; so the kind with fewest numbers is proposed among those that come as near to the steps as
//! the best one, to 3 % of a step. A kind asks the law itself for its steps ([`Response::steps`]): what is fitted is what a chip does.

use super::cloud::{Cloud, between, least_of_many};
use super::settle::{NONE, Settled};
use super::{PulseRow, size};
use crate::num::fixed::Millionths;
use crate::num::tables::{
    ExponentialSteps, LinearSteps, NeurosimSteps, Response, SoftBoundSteps, TableSteps,
};

/// Amplitudes of an exponential part, at most: beyond, its mean step is no mean.
const AMPLITUDE_MAX: f64 = 20.0;
/// Growths of it, at most.
const GROWTH_MAX: f64 = 12.0;
/// Least growth: what grows less is a line.
const GROWTH_MIN: f64 = 0.5;
/// How near two kinds are alike, as a share of a step.
const ALIKE: f64 = 0.03;
/// Parts that a table may cut the window into.
const PARTS: [usize; 3] = [4, 8, 16];

/// A kind, fitted.
#[derive(Debug, Clone, PartialEq)]
pub struct KindFit {
    /// Its curve.
    pub response: Response,
    /// Pulses of mean length across the window.
    pub states: u32,
    /// By which share steps up are longer than the curve says, and steps down shorter.
    pub asymmetry: Millionths,
    /// Numbers that were fitted.
    pub numbers: usize,
    /// Schwarz's criterion: less is better.
    pub worth: f64,
    /// Weighted mean square of what steps differ from it by.
    pub(super) squares: f64,
    /// Whether it is as near to the steps as the kind of the least worth, to 3 % of a step.
    pub near: bool,
    /// Root mean square of what measured steps differ from it by, in windows.
    pub step_rms: f64,
    /// The same of conductances, pulse by pulse from the beginning of each row.
    pub curve_rms: f64,
}

impl KindFit {
    /// Steps up and down at a place of the window, in windows.
    pub(crate) fn steps(&self) -> impl Fn(f64) -> [f64; 2] {
        let (steps, lean) = (self.response.steps(self.states), self.asymmetry.0 as f64 / 1e6);
        move |x| {
            let [up, down] = steps(x.clamp(0.0, 1.0));
            [up * (1.0 + lean), down * (1.0 - lean)]
        }
    }
}

/// Millionths of a number, held to what a file can say.
pub(super) fn millionths(value: f64, [least, most]: [f64; 2]) -> Millionths {
    // a cast of what is no number is 0
    Millionths(libm::round(value.clamp(least, most) * 1e6) as i64)
}

fn steps_of(value: f64, states: u32) -> Millionths {
    millionths(value * f64::from(states), [0.0, 1000.0])
}

/// All kinds, the proposed one first, then by worth.
pub(super) fn all(settled: &Settled, rows: &[PulseRow], ends: &[[f64; 2]]) -> Vec<KindFit> {
    let clouds = settled.clouds();
    let states = libm::round(1.0 / settled.mean).clamp(1.0, 65_536.0) as u32;
    let pulses = size(settled.points.iter().filter(|point| point.free).count());
    let worth = |response: &Response, states: u32, asymmetry: Millionths, numbers: usize| {
        let lean = asymmetry.0 as f64 / 1e6;
        let steps = response.steps(states);
        let squares = clouds[0].squares(|x| steps(x)[0] * (1.0 + lean))
            + clouds[1].squares(|x| steps(x)[1] * (1.0 - lean));
        let (none, squares) = (NONE * settled.mean, squares / pulses);
        let worth = pulses * libm::log(squares + none * none) + size(numbers) * libm::log(pulses);
        (worth, squares)
    };
    let kind = |(response, states, asymmetry, numbers): (Response, u32, Millionths, usize)| {
        let (worth, squares) = worth(&response, states, asymmetry, numbers);
        let (near, step_rms, curve_rms) = (false, 0.0, 0.0);
        let fit = KindFit {
            response,
            states,
            asymmetry,
            numbers,
            worth,
            squares,
            near,
            step_rms,
            curve_rms,
        };
        let [step_rms, curve_rms] = residuals(&fit, settled, rows, ends);
        KindFit { step_rms, curve_rms, ..fit }
    };
    let none = Millionths(0);
    let tables = PARTS.into_iter().filter(|parts| 16.0 * size(*parts) <= pulses);
    let tables =
        tables.map(|parts| kind((table(&clouds, states, parts), states, none, 2 * parts + 2)));
    let table = tables.reduce(|a, b| if b.worth < a.worth { b } else { a });
    let (neurosim, own_states) = neurosim(&clouds, states);
    let (exponential, other_states, lean) = exponential(&clouds, states);
    let named = [
        (soft_bounds(&clouds, states), states, none, 2),
        (linear(&clouds, states), states, none, 4),
        (neurosim, own_states, none, 3),
        (exponential, other_states, lean, 6),
    ];
    let mut all: Vec<KindFit> = named.map(kind).into_iter().chain(table).collect();
    all.sort_by(|a, b| a.worth.total_cmp(&b.worth));
    let least = all[0].squares;
    let whole = (clouds[0].squares(|_| 0.0) + clouds[1].squares(|_| 0.0)) / pulses - least;
    for kind in &mut all {
        kind.near = kind.squares - least <= ALIKE * ALIKE * whole;
    }
    let fewest = (0..all.len()).filter(|&at| all[at].near).min_by_key(|&at| all[at].numbers);
    let proposed = all.remove(fewest.unwrap_or(0));
    all.insert(0, proposed);
    all
}

fn linear(clouds: &[Cloud; 2], states: u32) -> Response {
    let ends = [0, 1].map(|side| {
        let [floor, ceiling] = clouds[side].fit(|x| [1.0 - x, x]);
        // an end below 0 is 0, and the other what is left
        let ends = match (floor < 0.0, ceiling < 0.0) {
            (true, _) => [0.0, clouds[side].fit(|x| [x])[0]],
            (_, true) => [clouds[side].fit(|x| [1.0 - x])[0], 0.0],
            _ => [floor, ceiling],
        };
        ends.map(|step| steps_of(step, states))
    });
    Response::Linear(LinearSteps { up: ends[0], down: ends[1] })
}

fn soft_bounds(clouds: &[Cloud; 2], states: u32) -> Response {
    let [up] = clouds[0].fit(|x| [1.0 - x]);
    let [down] = clouds[1].fit(|x| [x]);
    Response::SoftBounds(SoftBoundSteps { up: steps_of(up, states), down: steps_of(down, states) })
}

fn table(clouds: &[Cloud; 2], states: u32, parts: usize) -> Response {
    let row = |side: usize| {
        let knots = clouds[side].knots(parts);
        knots.into_iter().map(|step| steps_of(step, states)).collect()
    };
    Response::Table(TableSteps { up: row(0), down: row(1) })
}

/// Labels, and the pulses from end to end that they belong to: other than those of mean length, as places where steps are
/// short take most of them.
fn neurosim(clouds: &[Cloud; 2], states: u32) -> (Response, u32) {
    let response = |labels: [f64; 2]| {
        let labels = labels.map(|label| millionths(label, [-9.0, 9.0]));
        Response::Neurosim(NeurosimSteps { labels })
    };
    let squares = |side: usize, label: f64, states: u32| {
        let response = response([label; 2]);
        let steps = response.steps(states);
        clouds[side].squares(|x| steps(x)[side])
    };
    let labels = |states: u32| {
        [0, 1].map(|side| {
            let of = |label: f64| squares(side, label, states);
            least_of_many(of, [-9.0, 9.0], 37)
        })
    };
    let of = |states: u32| {
        let labels = labels(states);
        squares(0, labels[0], states) + squares(1, labels[1], states)
    };
    // first by tenths, then closer
    let whole = |states: f64| libm::round(states.clamp(1.0, 65_536.0)) as u32;
    let mut best = (f64::MAX, states);
    let mut tried = 0.75 * f64::from(states);
    while tried <= 12.0 * f64::from(states) {
        let states = whole(tried);
        let found = of(states);
        best = if found < best.0 { (found, states) } else { best };
        tried *= 1.1;
    }
    let mut step = whole(0.05 * f64::from(best.1));
    while step > 0 {
        for states in [best.1.saturating_sub(step).max(1), (best.1 + step).min(65_536)] {
            let found = of(states);
            best = if found < best.0 { (found, states) } else { best };
        }
        step /= 2;
    }
    (response(labels(best.1)), best.1)
}

/// Amplitudes, growths, states and asymmetry.
fn exponential(clouds: &[Cloud; 2], states: u32) -> (Response, u32, Millionths) {
    // a side is `step (1 - amplitude exp(growth x))`
    let side = |cloud: &Cloud, growth: f64| -> [f64; 2] {
        let [step, part] = cloud.fit(|x| [1.0, libm::exp(growth * x)]);
        let amplitude = -part / step;
        if step > 0.0 && (-AMPLITUDE_MAX..=AMPLITUDE_MAX).contains(&amplitude) {
            return [step, amplitude];
        }
        let [step] = cloud.fit(|x| [1.0 + AMPLITUDE_MAX * libm::exp(growth * x)]);
        [step.max(0.0), -AMPLITUDE_MAX]
    };
    let of = |[step, amplitude]: [f64; 2], growth: f64, x: f64| {
        step * (1.0 - amplitude * libm::exp(growth * x)).max(0.0)
    };
    let sides = [&clouds[0], &clouds[1]].map(|cloud| {
        let squares = |growth: f64| {
            let found = side(cloud, growth);
            cloud.squares(|x| of(found, growth, x))
        };
        // falling and rising parts, each for itself
        let ends = [[-GROWTH_MAX, -GROWTH_MIN], [GROWTH_MIN, GROWTH_MAX]];
        let [falls, rises] = ends.map(|ends| least_of_many(squares, ends, 24));
        let growth = if squares(falls) <= squares(rises) { falls } else { rises };
        (side(cloud, growth), growth)
    });
    let [([up, up_amplitude], up_growth), ([down, down_amplitude], down_growth)] = sides;
    let mean = 0.5 * (up + down);
    let own = if mean > 0.0 { libm::round(1.0 / mean).clamp(1.0, 65_536.0) as u32 } else { states };
    let lean = if mean > 0.0 { 0.5 * (up - down) / mean } else { 0.0 };
    let amplitude = |value: f64| millionths(value, [-AMPLITUDE_MAX, AMPLITUDE_MAX]);
    let growth = |value: f64| millionths(value, [-GROWTH_MAX, GROWTH_MAX]);
    let response = Response::Exponential(ExponentialSteps {
        amplitude: [amplitude(up_amplitude), amplitude(down_amplitude)],
        // down it is exp(-growth z)
        growth: [growth(up_growth), growth(-down_growth)],
        z: [Millionths(0), Millionths::ONE],
    });
    (response, own, millionths(lean, [-1.0, 1.0]))
}

/// Root mean squares of steps and, pulse by pulse, of conductances, in windows.
fn residuals(fit: &KindFit, settled: &Settled, rows: &[PulseRow], ends: &[[f64; 2]]) -> [f64; 2] {
    /// What lies between two reads is walked in so many parts.
    const WALK_MAX: u32 = 32;
    let steps = fit.steps();
    let (mut count, mut squares) = (0.0, 0.0);
    for point in settled.points.iter().filter(|point| point.free) {
        let off = point.y - settled.factors[point.device][point.side] * steps(point.x)[point.side];
        count += point.count;
        squares += point.count * off * off;
    }
    let of_steps = libm::sqrt(squares / f64::max(count, 1.0));
    let (mut count, mut squares) = (0.0, 0.0);
    // the law many times over would be slow: its steps at 1,024 places
    let many = [0, 1]
        .map(|side| (0..=1024).map(|i| steps(f64::from(i) / 1024.0)[side]).collect::<Vec<_>>());
    for row in rows {
        let [floor, ceiling] = ends[row.device];
        let own = ceiling - floor;
        let mut x = (row.start - floor) / own;
        for pulse in &row.pulses {
            let side = usize::from(!pulse.rises);
            let parts = pulse.count.min(WALK_MAX);
            let factor = settled.factors[row.device][side] / own;
            let each = factor * f64::from(pulse.count) / f64::from(parts);
            for _ in 0..parts {
                let step = each * between(&many[side], x);
                x = (if pulse.rises { x + step } else { x - step }).clamp(0.0, 1.0);
            }
            let off = floor + x * own - pulse.to;
            count += 1.0;
            squares += off * off;
        }
    }
    [of_steps, libm::sqrt(squares / f64::max(count, 1.0))]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Steps of a response at every place.
    fn clouds(response: &Response, states: u32) -> [Cloud; 2] {
        let steps = response.steps(states);
        [0, 1].map(|side| {
            Cloud::new((0..2000).map(|i| {
                let x = f64::from(i) / 2000.0;
                [x, steps(x)[side], 1.0]
            }))
        })
    }

    #[test]
    fn every_kind_finds_its_own_numbers_again() {
        let m = |value: f64| Millionths((value * 1e6).round() as i64);
        let near = |a: &Response, b: &Response, by: i64| {
            let pairs = a.numbers().into_iter().zip(b.numbers());
            pairs.map(|(a, b)| (a.0 - b.0).abs()).max().unwrap() <= by
        };
        let line = Response::Linear(LinearSteps { up: [m(1.5), m(0.5)], down: [m(0.75), m(1.25)] });
        assert!(near(&linear(&clouds(&line, 50), 50), &line, 20));
        let soft = Response::SoftBounds(SoftBoundSteps { up: m(1.6), down: m(2.4) });
        assert!(near(&soft_bounds(&clouds(&soft, 50), 50), &soft, 20));
        let steps = Response::Neurosim(NeurosimSteps { labels: [m(1.75), m(-1.46)] });
        let (found, states) = neurosim(&clouds(&steps, 32), 29);
        assert!(near(&found, &steps, 20_000) && states == 32, "{found:?} {states}");
        let steps = Response::Exponential(ExponentialSteps {
            amplitude: [m(-1.2), m(0.6)],
            growth: [m(-3.0), m(2.0)],
            z: [m(0.0), m(1.0)],
        });
        let (found, states, lean) = exponential(&clouds(&steps, 100), 80);
        assert!(near(&found, &steps, 20_000) && states == 100 && lean.0.abs() < 5000, "{found:?}");
        let row = [0.5, 1.5, 1.0, 1.0, 2.0, 0.25, 0.75, 0.0, 1.0].map(m).to_vec();
        let steps = Response::Table(TableSteps { up: row.clone(), down: row });
        assert!(near(&table(&clouds(&steps, 40), 40, 8), &steps, 20));
    }
}
