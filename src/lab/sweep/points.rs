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

use super::{Choice, Sweep, SweepError, Value};

/// Most points of a sweep, before filters.
const POINTS_MAX: usize = 2_000_000;

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
    pub keys: Vec<toml::Table>,
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

    /// The points, and how many there were before the filters.
    ///
    /// # Errors
    /// When a filter fails, or there are none or too many.
    pub fn points(&self) -> Result<(Vec<Point>, usize), SweepError> {
        let all = match self.sample {
            None => self.grid()?,
            Some(_) => self.sampled(),
        };
        let seeds: Vec<Option<u64>> = match &*self.seeds {
            [] => vec![None],
            seeds => seeds.iter().copied().map(Some).collect(),
        };
        let before = all.len() * seeds.len();
        if before > POINTS_MAX {
            let allowed =
                format!("at most {POINTS_MAX}: take fewer values, or draw them with [sample]");
            return Err(SweepError::key("axis", &format!("make {before} points"), &allowed));
        }
        let mut points = Vec::new();
        for choices in all {
            for &seed in &seeds {
                if self.passes(&choices, seed)? {
                    let number = u32::try_from(points.len() + 1).expect("checked: few points");
                    let (values, keys) =
                        choices.iter().cloned().map(|choice| (choice.value, choice.keys)).unzip();
                    points.push(Point { number, values, seed, keys });
                }
            }
        }
        if points.is_empty() {
            Err(SweepError::Empty { points: before })
        } else {
            Ok((points, before))
        }
    }

    fn grid(&self) -> Result<Vec<Vec<Choice>>, SweepError> {
        let mut all = vec![vec![]];
        for axis in &self.axes {
            if all.len().saturating_mul(axis.list().len()) > POINTS_MAX {
                let allowed =
                    format!("at most {POINTS_MAX}: take fewer values, or draw them with [sample]");
                return Err(SweepError::key("axis", "make too many points", &allowed));
            }
            let with = |choices: &Vec<Choice>| {
                let choices = choices.clone();
                axis.list()
                    .iter()
                    .map(move |choice| [&choices[..], std::slice::from_ref(choice)].concat())
            };
            all = all.iter().flat_map(with).collect();
        }
        Ok(all)
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
