//! Mean steps, factors of devices and noise, found in turns: each of them needs the others.
//!
//! ```text
//! place    x = (G - floor of the device) / (its ceiling - its floor)           step  y = +-dG / ((ceiling - floor) pulses), both mean ends
//! mean     rows of steps at equally spaced places, least squares of y / f with weights pulses f^2 / sd^2
//! factor   f = sum(w y m) / sum(w m^2) of each device and polarity, 1 on the mean of the devices
//! noise    r = (y - f m) sqrt(pulses):  sd = c f m (of the step)  or  b (of the window), whichever is more likely
//! left out pulses that reached the end they led to, or might have with two sd: the window held them
//! reads    a read that misses by e moves the step before it by e and the one behind it by -e:  sd^2 = -mean(r_n r_(n+1))
//! ```

use super::cloud::{Cloud, between};
use super::{PulseRow, size};

/// How often all of them are found.
const ROUNDS: usize = 6;
/// Least mean step that tells a kind of noise from the other, as a share of the mean one.
const TELLING: f64 = 0.2;
/// What noise is counted as none, as a share of the mean step.
pub(super) const NONE: f64 = 0.01;
/// Spread of steps from which on factors are taken for log-normal: a normal law would have some below 0.
const WIDE: f64 = 0.3;

/// A pulse, or as many as lie between two reads.
#[derive(Debug, Clone, Copy)]
pub(super) struct Point {
    pub(super) device: usize,
    /// 0 up, 1 down.
    pub(super) side: usize,
    row: usize,
    /// Where the cell lay, in its own window.
    pub(super) x: f64,
    /// How far a pulse moved it the way it led, in windows.
    pub(super) y: f64,
    pub(super) count: f64,
    /// Whether the window had no say.
    pub(super) free: bool,
}

/// Noise from pulse to pulse.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Scatter {
    /// Whether it goes with the step.
    pub(super) of_step: bool,
    /// Its standard deviation, in steps or windows.
    pub(super) share: f64,
    /// Of a read, in windows.
    pub(super) read: f64,
}

impl Scatter {
    /// Of a step of that length, which is held above a share of the mean one.
    fn deviation(&self, step: f64, mean: f64) -> f64 {
        if self.of_step { self.share * step.max(TELLING * mean) } else { self.share }
    }
}

/// What is known of pulses.
#[derive(Debug)]
pub(super) struct Settled {
    pub(super) points: Vec<Point>,
    /// Of devices, of steps up and down.
    pub(super) factors: Vec<[f64; 2]>,
    /// Steps at equally spaced places, in windows.
    pub(super) rows: [Vec<f64>; 2],
    /// The mean of both over the window.
    pub(super) mean: f64,
    pub(super) scatter: Scatter,
}

/// Points of rows whose conductances are in windows; `ends` are those of each device.
pub(super) fn points(rows: &[PulseRow], ends: &[[f64; 2]]) -> Vec<Point> {
    let mut points = vec![];
    for (row, of) in rows.iter().enumerate() {
        let [floor, ceiling] = ends[of.device];
        let own = |g: f64| (g - floor) / (ceiling - floor);
        let mut from = of.start;
        for pulse in &of.pulses {
            let count = f64::from(pulse.count);
            let way = if pulse.rises { 1.0 } else { -1.0 };
            let x = if pulse.count == 1 { own(from) } else { own(0.5 * (from + pulse.to)) };
            points.push(Point {
                device: of.device,
                side: usize::from(!pulse.rises),
                row,
                x,
                y: way * (pulse.to - from) / count,
                count,
                free: if pulse.rises { pulse.to < ceiling } else { pulse.to > floor },
            });
            from = pulse.to;
        }
    }
    points
}

impl Settled {
    /// Finds all of them; `parts` of the window have steps of their own.
    pub(super) fn new(points: Vec<Point>, ends: &[[f64; 2]], parts: usize) -> Self {
        let scatter = Scatter { of_step: false, share: 1.0, read: 0.0 };
        let factors = vec![[1.0; 2]; ends.len()];
        let held = points.iter().map(|point| point.free).collect::<Vec<_>>();
        let mut all =
            Self { points, factors, rows: [vec![0.0; 2], vec![0.0; 2]], mean: 1.0, scatter };
        for round in 0..ROUNDS {
            all.find_rows(parts);
            all.find_factors();
            let rows = all.rows.clone();
            all.scatter =
                all.scatter_about(|side, x| between(&rows[side], x), 2.0 * size(parts + 1));
            if round + 1 < ROUNDS {
                all.leave_out(&held, ends);
            }
        }
        all
    }

    /// Steps of a polarity over places, as one device would have them, and their weights: 1 on the mean.
    pub(super) fn clouds(&self) -> [Cloud; 2] {
        let weight = |point: &Point| {
            let [_, deviation] = self.known(point);
            point.count / (deviation * deviation)
        };
        let free = || self.points.iter().filter(|point| point.free);
        let whole = free().map(weight).sum::<f64>() / size(free().count().max(1));
        [0, 1].map(|side| {
            Cloud::new(free().filter(|point| point.side == side).map(|point| {
                let factor = self.factors[point.device][side];
                let share = if self.scatter.of_step { 1.0 } else { factor * factor };
                [point.x, point.y / factor, share * weight(point) / whole]
            }))
        })
    }

    fn find_rows(&mut self, parts: usize) {
        self.rows = self.clouds().map(|cloud| cloud.knots(parts));
        let area = |row: &Vec<f64>| {
            (row.iter().sum::<f64>() - 0.5 * (row[0] + row[row.len() - 1])) / size(row.len() - 1)
        };
        self.mean = 0.5 * (area(&self.rows[0]) + area(&self.rows[1]));
    }

    fn find_factors(&mut self) {
        let mut sums = vec![[[0.0; 2]; 2]; self.factors.len()];
        for point in self.points.iter().filter(|point| point.free) {
            let [step, deviation] = self.known(point);
            let weight = point.count / (deviation * deviation);
            let sums = &mut sums[point.device][point.side];
            sums[0] += weight * point.y * step;
            sums[1] += weight * step * step;
        }
        let factor = |[with, of]: [f64; 2]| if of > 0.0 { (with / of).max(0.05) } else { 1.0 };
        let all: Vec<[f64; 2]> = sums.into_iter().map(|sides| sides.map(factor)).collect();
        let [step, _] = deviations(&all);
        // of a log-normal law the median is 1
        let middle = |side: usize| match step > WIDE {
            true => {
                let sum = all.iter().map(|of| libm::log(of[side])).sum::<f64>();
                libm::exp(sum / size(all.len()))
            }
            false => all.iter().map(|of| of[side]).sum::<f64>() / size(all.len()),
        };
        let middle = [middle(0), middle(1)];
        self.factors = all.iter().map(|of| [of[0] / middle[0], of[1] / middle[1]]).collect();
    }

    /// What steps scatter by about a curve of so many numbers.
    pub(super) fn scatter_about(&self, curve: impl Fn(usize, f64) -> f64, numbers: f64) -> Scatter {
        // [pulses, squares, squares in steps, logarithms of steps] of pulses that tell, then of all
        let (mut telling, mut all) = ([0.0; 4], [0.0; 2]);
        let (mut pairs, mut products, mut before) = (0.0, 0.0, None);
        for point in &self.points {
            if !point.free {
                before = None;
                continue;
            }
            let step = self.factors[point.device][point.side] * curve(point.side, point.x);
            let off = (point.y - step) * libm::sqrt(point.count);
            all = [all[0] + 1.0, all[1] + off * off];
            if step >= TELLING * self.mean {
                let share = off / step;
                let terms = [1.0, off * off, share * share, libm::log(step)];
                telling.iter_mut().zip(terms).for_each(|(sum, term)| *sum += term);
            }
            let signed = if point.side == 0 { off } else { -off };
            if let Some((_, last)) =
                before.filter(|(row, _)| *row == point.row && point.count == 1.0)
            {
                pairs += 1.0;
                products += last * signed;
            }
            before = (point.count == 1.0).then_some((point.row, signed));
        }
        let left = (all[0] - numbers).max(1.0);
        let variance = all[1] / left;
        // a read that misses shows in two steps, one after the other
        let product = products / f64::max(pairs, 1.0);
        let missed = if product < -3.0 * variance / libm::sqrt(f64::max(pairs, 1.0)) {
            (-product).min(0.5 * variance)
        } else {
            0.0
        };
        let kept = libm::sqrt((1.0 - 2.0 * missed / variance.max(f64::MIN_POSITIVE)).max(0.0));
        let [count, squares, shares, logarithms] = telling;
        let likely = |squares: f64| libm::log((squares / count).max(f64::MIN_POSITIVE));
        let of_step = count > 0.0
            && 0.5 * count * likely(shares) + logarithms < 0.5 * count * likely(squares);
        let share =
            if of_step { libm::sqrt(shares / count * all[0] / left) } else { libm::sqrt(variance) };
        let of_mean = if of_step { share } else { share / self.mean.max(f64::MIN_POSITIVE) };
        let share = if of_mean * kept < NONE { 0.0 } else { share * kept };
        Scatter { of_step, share, read: libm::sqrt(missed) }
    }

    /// Leaves out pulses that the window may have held.
    fn leave_out(&mut self, held: &[bool], ends: &[[f64; 2]]) {
        let free: Vec<bool> = self
            .points
            .iter()
            .zip(held)
            .map(|(point, held)| {
                let [floor, ceiling] = ends[point.device];
                let step = self.factors[point.device][point.side]
                    * between(&self.rows[point.side], point.x);
                let own = ceiling - floor;
                let room = 2.0 * self.scatter.deviation(step, self.mean) * libm::sqrt(point.count);
                let (step, room) = (step * point.count / own, room / own);
                // along the way that it leads
                let along = if point.side == 0 { point.x } else { 1.0 - point.x };
                let to = if point.count == 1.0 { along + step } else { along + 0.5 * step };
                *held && to + room <= 1.0 && to - room >= 0.0
            })
            .collect();
        // where that leaves too little, what was seen has to do
        for side in [0, 1] {
            let of = |which: &[bool]| {
                let both = self.points.iter().zip(which);
                both.filter(|(point, free)| point.side == side && **free).count()
            };
            let enough = of(&free) >= 16 && 2 * of(&free) >= of(held);
            let which = if enough { &free[..] } else { held };
            let points = self.points.iter_mut().zip(which);
            points
                .filter(|(point, _)| point.side == side)
                .for_each(|(point, free)| point.free = *free);
        }
    }

    /// The variance of a device's factor that noise alone makes, on the mean.
    pub(super) fn unknown(&self) -> f64 {
        let mut sums = vec![[0.0; 2]; self.factors.len()];
        for point in self.points.iter().filter(|point| point.free) {
            let [step, deviation] = self.known(point);
            sums[point.device][point.side] += point.count * step * step / (deviation * deviation);
        }
        if self.scatter.share == 0.0 {
            return 0.0;
        }
        let of = |known: &f64| if *known > 0.0 { 1.0 / known } else { 0.0 };
        // steps are the mean of both polarities, asymmetry half their difference
        sums.iter().flatten().map(of).sum::<f64>() / (4.0 * size(sums.len()))
    }

    /// The mean step of a pulse, and its deviation where it has one.
    fn known(&self, point: &Point) -> [f64; 2] {
        let step = between(&self.rows[point.side], point.x);
        [step, self.scatter.deviation(step, self.mean).max(NONE * self.mean)]
    }

    /// Whether devices differ so much that their factors are log-normal.
    pub(super) fn is_wide(&self) -> bool {
        deviations(&self.factors)[0] > WIDE
    }
}

/// Standard deviations of the factors of steps and of their asymmetry.
pub(super) fn deviations(factors: &[[f64; 2]]) -> [f64; 2] {
    let step = factors.iter().map(|of| 0.5 * (of[0] + of[1]));
    let lean = factors.iter().map(|of| (of[0] - of[1]) / (of[0] + of[1]));
    [deviation(step), deviation(lean)]
}

/// Standard deviation of a sample; of one number it is 0.
pub(super) fn deviation(values: impl Iterator<Item = f64> + Clone) -> f64 {
    let count = size(values.clone().count());
    let mean = values.clone().sum::<f64>() / count;
    let squares: f64 = values.map(|value| (value - mean) * (value - mean)).sum();
    if count < 2.0 { 0.0 } else { libm::sqrt(squares / (count - 1.0)) }
}
