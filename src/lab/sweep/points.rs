//! Points of a sweep: the full grid, or a sample.
//!
//! ```text
//! grid               every combination, the last axis fastest
//! random             point n lies at u(axis, n) of the way along each axis
//! latin hypercube    point n lies at (r(axis, n) + u(axis, n)) / points; r ranks the words w(axis, 0 ..)
//! u, w               64-bit words of BLAKE3("dalean sample 1\n" | seed | axis | n | what), u over 2^64
//! ```
//!
//! Seeds are the fastest of all. Points are numbered from 1 after the filters.

use std::sync::Arc;

use super::{Choice, Sweep, SweepError, Value};
use crate::lab::run::Memory;

/// Most points of a sweep, before filters.
const POINTS_MAX: u128 = 2_000_000;
/// Bytes that a planned point takes, its run and its line in the index included: an estimate on the high side.
const POINT_BYTES: u64 = 2_048;

/// One point.
#[derive(Debug, Clone, PartialEq)]
pub struct Point {
    /// Number, from 1.
    pub number: u32,
    /// Values, in the order of the axes.
    pub values: Vec<Value>,
    /// Seed, when the sweep has seeds.
    pub seed: Option<u64>,
    /// Keys that the axes set, weakest first.
    pub keys: Vec<Arc<toml::Table>>,
}

fn word(seed: u64, axis: usize, point: u32, what: &[u8]) -> u64 {
    let mut hash = blake3::Hasher::new();
    hash.update(b"dalean sample 1\n").update(&seed.to_le_bytes());
    hash.update(&(axis as u64).to_le_bytes()).update(&point.to_le_bytes()).update(what);
    let bytes = hash.finalize();
    u64::from_le_bytes(bytes.as_bytes()[..8].try_into().expect("8 bytes"))
}

/// A part of the way: 53 bits, below 1.
fn part(seed: u64, axis: usize, point: u32) -> f64 {
    (word(seed, axis, point, b"place") >> 11) as f64 / (1u64 << 53) as f64
}

impl Sweep {
    /// Names that filters may use, and values of a point in that order.
    fn passes(&self, choices: &[Choice], seed: Option<u64>) -> Result<bool, SweepError> {
        let mut names: Vec<&str> = self.axes.iter().map(|axis| &*axis.name).collect();
        let mut values: Vec<Value> = choices.iter().map(|choice| choice.value.clone()).collect();
        names.push("seed");
        values.push(Value::Whole(seed.unwrap_or(0).cast_signed()));
        self.filter.passes(&names, &values)
    }

    /// Points before the filters.
    #[must_use]
    pub fn size(&self) -> u128 {
        let draws = match self.sample {
            Some(sample) => u128::from(sample.points),
            None => self
                .axes
                .iter()
                .fold(1, |all: u128, axis| all.saturating_mul(axis.list().len() as u128)),
        };
        draws.saturating_mul(self.seeds.len().max(1) as u128)
    }

    /// Weighs the points before any is made.
    fn weigh(&self) -> Result<(), SweepError> {
        let all = self.size();
        let sizes: Vec<_> =
            self.axes.iter().map(|axis| format!("{} {}", axis.list().len(), axis.name)).collect();
        let seeds = format!("{} seeds", self.seeds.len().max(1));
        let wrong = |most: String| {
            let found = format!("and seeds make {all} points ({}, {seeds})", sizes.join(" x "));
            let allowed = format!(
                "{most}: take fewer values or seeds, draw some points with [sample], or make several sweeps"
            );
            Err(SweepError::key("axis", &found, &allowed))
        };
        if all > POINTS_MAX {
            return wrong(format!("at most {POINTS_MAX} can be planned"));
        }
        let wanted = u64::try_from(all).unwrap_or(u64::MAX).saturating_mul(POINT_BYTES);
        match Memory::left() {
            Some(left) if wanted > left.bytes() => {
                let wanted = Memory::of(wanted);
                wrong(format!("to plan them takes about {wanted} of memory, and {left} are left"))
            }
            _ => Ok(()),
        }
    }

    /// The points, and how many there were before the filters.
    ///
    /// # Errors
    /// When a filter fails, or there are none or too many.
    pub fn points(&self) -> Result<(Vec<Point>, usize), SweepError> {
        self.weigh()?;
        let seeds: Vec<Option<u64>> = match &*self.seeds {
            [] => vec![None],
            seeds => seeds.iter().copied().map(Some).collect(),
        };
        let mut before = 0;
        let mut points: Vec<Point> = Vec::new();
        let mut add = |choices: &[Choice]| -> Result<(), SweepError> {
            for &seed in &seeds {
                before += 1;
                if self.passes(choices, seed)? {
                    let number = u32::try_from(points.len() + 1).expect("checked: few points");
                    let (values, keys) =
                        choices.iter().cloned().map(|choice| (choice.value, choice.keys)).unzip();
                    points.push(Point { number, values, seed, keys });
                }
            }
            Ok(())
        };
        match self.sample {
            None => self.grid(&mut add)?,
            Some(_) => self.sampled().iter().try_for_each(|choices| add(choices))?,
        }
        if points.is_empty() {
            Err(SweepError::Empty { points: before })
        } else {
            Ok((points, before))
        }
    }

    /// Every combination, the last axis fastest.
    fn grid(
        &self,
        add: &mut dyn FnMut(&[Choice]) -> Result<(), SweepError>,
    ) -> Result<(), SweepError> {
        let mut at = vec![0; self.axes.len()];
        if self.axes.iter().any(|axis| axis.list().is_empty()) {
            return Ok(());
        }
        loop {
            let choices = self.axes.iter().zip(&at).map(|(axis, &at)| axis.list()[at].clone());
            add(&choices.collect::<Vec<_>>())?;
            // as a clock counts
            let turns = |(axis, at): (&super::Axis, &usize)| at + 1 < axis.list().len();
            let Some(turned) = self.axes.iter().zip(&at).rposition(turns) else { return Ok(()) };
            at[turned] += 1;
            at[turned + 1..].fill(0);
        }
    }

    fn sampled(&self) -> Vec<Vec<Choice>> {
        let Some(sample) = self.sample else { return vec![] };
        let count = sample.points;
        let ranks: Vec<Vec<u32>> = (0..self.axes.len())
            .map(|axis| {
                let mut order: Vec<u32> = (0..count).collect();
                order.sort_by_cached_key(|&point| (word(sample.seed, axis, point, b"rank"), point));
                let mut ranks = vec![0; order.len()];
                for (rank, &point) in (0u32..).zip(&order) {
                    ranks[point as usize] = rank;
                }
                ranks
            })
            .collect();
        let place = |axis: usize, point: u32| {
            let part = part(sample.seed, axis, point);
            if sample.latin_hypercube {
                (f64::from(ranks[axis][point as usize]) + part) / f64::from(count)
            } else {
                part
            }
        };
        let choices =
            |point| self.axes.iter().enumerate().map(move |(at, axis)| axis.at(place(at, point)));
        (0..count).map(|point| choices(point).collect()).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn points(text: &str) -> (Vec<Point>, usize) {
        Sweep::parse("s.toml", text, "").unwrap().points().unwrap()
    }

    fn show(points: &[Point]) -> Vec<String> {
        let one = |point: &Point| {
            let values: Vec<_> = point.values.iter().map(ToString::to_string).collect();
            format!("{} {} {:?}", point.number, values.join(","), point.seed)
        };
        points.iter().map(one).collect()
    }

    const TWO: &str = "[[axis]]\nname = 'a'\nkey = 'x'\nvalues = [1, 2]\n[[axis]]\nname = 'b'\nkey = 'y'\nvalues = ['u', 'v']\n";

    #[test]
    fn a_grid_counts_like_a_clock_and_filters_take_points_away() {
        let (all, before) = points(&format!(
            "seeds = [7, 8]\nfilter = ['a == 1 || b == \"v\"', 'seed == 7']\n{TWO}"
        ));
        assert_eq!(before, 8);
        assert_eq!(show(&all), ["1 1,u Some(7)", "2 1,v Some(7)", "3 2,v Some(7)"]);
        assert_eq!(all[2].keys[1].to_string(), "y = \"v\"\n");
        assert_eq!(show(&points(TWO).0)[3], "4 2,v None");
        let none = Sweep::parse("s", &format!("filter = ['a > 2']\n{TWO}"), "").unwrap().points();
        assert!(none.unwrap_err().to_string().contains("all 4"));
    }

    #[test]
    fn points_without_number_are_refused_at_once_with_their_number() {
        let axis = |name: &str, count: u32| {
            format!("[[axis]]\nname = '{name}'\nkey = '{name}.k'\nfrom = 1\nto = {count}\n")
        };
        let all = ["a", "b", "c", "d"].map(|name| axis(name, 1000)).concat();
        let error = Sweep::parse("s.toml", &all, "").unwrap().points().unwrap_err().to_string();
        assert!(error.contains("make 1000000000000 points (1000 a x 1000 b"), "{error}");
        assert!(error.contains("[sample]") && error.contains("at most 2000000"), "{error}");
        for (seeds, found) in [("4000000000", "are 4000000000"), ("0", "are 0")] {
            let text = format!("seeds = {seeds}\n{TWO}");
            let error = Sweep::parse("s.toml", &text, "").unwrap_err().to_string();
            assert!(error.contains(found) && error.contains("1 to 100000"), "{error}");
        }
    }

    #[test]
    fn a_latin_hypercube_draws_once_from_each_part_of_each_axis() {
        let text = "[[axis]]\nname = 'a'\nkey = 'x'\nfrom = 0\nto = 9\n[[axis]]\nname = 'b'\nkey = 'y'\nfrom = 0.0\nto = 1.0\n\
                    [sample]\nmethod = 'latin_hypercube'\npoints = 10\n";
        let (all, _) = points(text);
        let mut first: Vec<_> = all.iter().map(|point| point.values[0].number().unwrap()).collect();
        first.sort_by(f64::total_cmp);
        assert_eq!(first, (0..10).map(f64::from).collect::<Vec<_>>());
        let mut second: Vec<_> =
            all.iter().map(|point| (point.values[1].number().unwrap() * 10.0).floor()).collect();
        second.sort_by(f64::total_cmp);
        assert_eq!(second, first);
        assert_eq!(points(text), points(text));
        let other = text.replace("points = 10", "points = 10\nseed = 2");
        assert_ne!(points(text), points(&other));
        // pinned: every machine draws these
        assert_eq!(show(&all)[..2], ["1 9,0.815444 None", "2 7,0.780663 None"]);
    }
}
