//! A sweep file, checked.
#![expect(clippy::disallowed_methods, reason = "the file the user named")]

use std::path::Path;

use super::axis::Value;
use super::filter::Filter;
use super::row::RESULTS;
use super::{Axis, SweepError};
use crate::lab::config::sweep::{PublishedFile, ReportFile, SampleFile, SeedsFile, SweepFile};
use crate::lab::config::{ConfigError, anchor};
use crate::lab::report::sweep::{Figures, Published};
use crate::lab::store::address;

/// Draws points in place of the full grid.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Sample {
    /// Whether each axis is cut into as many parts as there are points, and each part drawn from once.
    pub latin_hypercube: bool,
    /// Points, each run with every seed.
    pub points: u32,
    /// Which points.
    pub seed: u64,
}

/// A sweep, checked.
#[derive(Debug)]
pub struct Sweep {
    /// Name in its store.
    pub name: String,
    /// Heading.
    pub title: String,
    /// What it asks and shows.
    pub about: String,
    /// What is varied, the slowest first.
    pub axes: Vec<Axis>,
    /// Seeds; empty when the experiment's own is used.
    pub seeds: Vec<u64>,
    /// Draws points in place of the grid.
    pub sample: Option<Sample>,
    /// What the figures show at first.
    pub figures: Figures,
    /// Keys laid over the experiment.
    pub base: toml::Table,
    /// Text of the sweep file.
    pub text: String,
    /// Name and text of the experiment file; empty when there is none.
    pub experiment: [String; 2],
    pub(super) filter: Filter,
}

impl Sweep {
    /// Reads a sweep file and the experiment it starts from.
    ///
    /// # Errors
    /// When one cannot be read, or what it says makes no sweep.
    pub fn read(path: &Path) -> Result<Self, SweepError> {
        let read = |path: &Path, hint: &str| {
            std::fs::read_to_string(path).map_err(|error| ConfigError::Unreadable {
                path: path.display().to_string(),
                error,
                hint: hint.into(),
            })
        };
        let text = read(path, "name a sweep file, such as examples/sweeps/level_bits.toml")?;
        let place = path.display().to_string();
        let file = SweepFile::parse(&place, &text)?;
        let experiment = match &file.experiment {
            None => [String::new(), String::new()],
            Some(name) => {
                let path = path.parent().unwrap_or(Path::new(".")).join(name);
                let hint = "`experiment` is relative to the sweep file";
                [path.display().to_string(), read(&path, hint)?]
            }
        };
        Self::check(file, &place, text, experiment)
    }

    /// Checks a sweep's text, as a store keeps it.
    ///
    /// # Errors
    /// When what it says makes no sweep.
    pub fn parse(place: &str, text: &str, experiment: &str) -> Result<Self, SweepError> {
        let file = SweepFile::parse(place, text)?;
        let name = file.experiment.clone().unwrap_or_default();
        Self::check(file, place, text.into(), [name, experiment.into()])
    }

    fn check(
        file: SweepFile,
        place: &str,
        text: String,
        experiment: [String; 2],
    ) -> Result<Self, SweepError> {
        let stem =
            Path::new(place).file_stem().map(|s| s.to_string_lossy().replace(['_', ' '], "-"));
        let name = file.name.or(stem).unwrap_or_default();
        if !address::is_name(&name) {
            let allowed = "use 1 to 64 lower-case letters, digits and `-`";
            return Err(SweepError::key("name", &format!("is {name:?}"), allowed));
        }
        let sample = file.sample.map(sampled).transpose()?;
        let axes = file.axis.unwrap_or_default().into_iter();
        let mut axes: Vec<Axis> =
            axes.map(|axis| Axis::new(axis, sample.is_some())).collect::<Result<_, _>>()?;
        if axes.is_empty() {
            return Err(SweepError::key(
                "axis",
                "is missing",
                "give the sweep one or more [[axis]]",
            ));
        }
        for (at, axis) in axes.iter().enumerate() {
            let taken = axes[..at].iter().any(|other| other.name == axis.name);
            if taken || reserved(&axis.name) {
                let allowed = "give it another `name`";
                return Err(SweepError::axis(
                    &axis.name,
                    "has the name of another column",
                    allowed,
                ));
            }
        }
        distinct(&axes)?;
        let seeds = seeds(file.seeds)?;
        let mut names: Vec<&str> = axes.iter().map(|axis| &*axis.name).collect();
        names.push("seed");
        let filter = Filter::new(&file.filter.unwrap_or_default(), &names)?;
        let mut base = super::table(&file.base.unwrap_or_default());
        let result = result(&base, &experiment[1]);
        let figures = figures(file.report.unwrap_or_default(), &axes, result)?;
        // paths in a file are relative to that file
        let folder = Path::new(place).parent().unwrap_or(Path::new(""));
        anchor(&mut base, folder);
        axes.iter_mut().for_each(|axis| axis.anchor(folder));
        let title = file.title.unwrap_or_else(|| name.clone());
        let about = file.about.unwrap_or_default();
        Ok(Self {
            name,
            title,
            about,
            axes,
            seeds,
            sample,
            figures,
            base,
            text,
            experiment,
            filter,
        })
    }
}

/// Names of columns that are not axes.
fn reserved(name: &str) -> bool {
    super::table::NAMES.contains(&name) || RESULTS.iter().any(|result| result.name == name)
}

/// Whether no two axes set one key: the later one would win at every point, and the other be a name for nothing.
fn distinct(axes: &[Axis]) -> Result<(), SweepError> {
    let covers = |a: &str, b: &str| a == b || b.strip_prefix(a).is_some_and(|b| b.starts_with('.'));
    let keys: Vec<_> = axes.iter().map(Axis::keys).collect();
    for (at, axis) in axes.iter().enumerate() {
        for (other, theirs) in axes.iter().zip(&keys).take(at) {
            let both = keys[at]
                .iter()
                .find(|key| theirs.iter().any(|other| covers(key, other) || covers(other, key)));
            if let Some(key) = both {
                let found = format!("sets `{key}`, and so does axis `{}`", other.name);
                let allowed =
                    "one key has one axis: take one out, or join the two with [[axis.case]]";
                return Err(SweepError::axis(&axis.name, &found, allowed));
            }
        }
    }
    Ok(())
}

fn sampled(file: SampleFile) -> Result<Sample, SweepError> {
    let latin_hypercube = match file.method.as_deref() {
        Some("latin_hypercube") => true,
        Some("random") => false,
        other => {
            let found = other.map_or("is missing".into(), |name| format!("is {name:?}"));
            return Err(SweepError::key("sample.method", &found, "use random or latin_hypercube"));
        }
    };
    let points = file.points.unwrap_or(0);
    if !(1..=1_000_000).contains(&points) {
        let found = format!("is {points}");
        return Err(SweepError::key("sample.points", &found, "it must lie in 1..=1000000"));
    }
    Ok(Sample { latin_hypercube, points, seed: file.seed.unwrap_or(1) })
}

/// Most seeds of a sweep.
const SEEDS_MAX: u32 = 100_000;

fn seeds(file: Option<SeedsFile>) -> Result<Vec<u64>, SweepError> {
    let allowed = "give 1 to 100000 different ones";
    let wrong = |count: u64| SweepError::key("seeds", &format!("are {count}"), allowed);
    let list = match file {
        None => return Ok(vec![]),
        // counted before they are made
        Some(SeedsFile::Count(count)) if (1..=SEEDS_MAX).contains(&count) => {
            (1..=u64::from(count)).collect()
        }
        Some(SeedsFile::Count(count)) => return Err(wrong(u64::from(count))),
        Some(SeedsFile::List(list)) => list,
    };
    if list.is_empty() || list.len() > SEEDS_MAX as usize {
        return Err(wrong(list.len() as u64));
    }
    let mut sorted = list.clone();
    sorted.sort_unstable();
    sorted.dedup();
    if sorted.len() < list.len() {
        return Err(SweepError::key("seeds", "name one twice", allowed));
    }
    Ok(list)
}

/// What a sweep asks for unless it says so: what comes of the final test of its task.
fn result(base: &toml::Table, experiment: &str) -> &'static str {
    let own = toml::from_str::<toml::Table>(experiment).unwrap_or_default();
    let task = base.get("task").or_else(|| own.get("task")).and_then(toml::Value::as_str);
    if task == Some("policy") { "return_mean" } else { "test_accuracy" }
}

/// What the figures show: what the file says, and else the first axes that suit.
fn figures(file: ReportFile, axes: &[Axis], result: &str) -> Result<Figures, SweepError> {
    let known = || axes.iter().map(|axis| &*axis.name).collect::<Vec<_>>().join(", ");
    let is_axis = |key: &str, name: &String| {
        if axes.iter().any(|axis| axis.name == *name) {
            return Ok(());
        }
        let found = format!("is {name:?}");
        Err(SweepError::key(&format!("report.{key}"), &found, &format!("axes are {}", known())))
    };
    let is_result = |key: &str, name: &String| {
        if RESULTS.iter().any(|result| result.name == name) {
            return Ok(());
        }
        let all: Vec<_> = RESULTS.iter().map(|result| result.name).collect();
        let allowed = format!("results are {}", all.join(", "));
        Err(SweepError::key(&format!("report.{key}"), &format!("is {name:?}"), &allowed))
    };
    for (key, name) in [("x", &file.x), ("series", &file.series), ("panel", &file.panel)] {
        name.iter().try_for_each(|name| is_axis(key, name))?;
    }
    for name in file.heat.iter().flatten() {
        is_axis("heat", name)?;
    }
    for (key, name) in [("y", &file.y), ("cost", &file.cost)] {
        name.iter().try_for_each(|name| is_result(key, name))?;
    }
    let number = || axes.iter().find(|axis| axis.is_number()).unwrap_or(&axes[0]).name.clone();
    let x = file.x.unwrap_or_else(number);
    let named = [Some(&x), file.series.as_ref(), file.panel.as_ref()];
    // a range has no end of values: no curves, no panels
    let few =
        |axis: &&Axis| (1..=8).contains(&axis.list().len()) && !named.contains(&Some(&axis.name));
    let mut free: Vec<String> = axes.iter().filter(few).map(|axis| axis.name.clone()).collect();
    free.reverse();
    let series = file.series.or_else(|| free.pop());
    let panel = file.panel.or_else(|| free.pop());
    let other = axes.iter().map(|axis| axis.name.clone()).find(|name| *name != x);
    let heat = file.heat.or_else(|| Some([x.clone(), series.clone().or(other)?]));
    let y = file.y.unwrap_or_else(|| result.into());
    let baseline = file.baseline.map(|value| Value::from(value).to_string());
    let mut figures =
        Figures { x, y, series, panel, heat, cost: file.cost, baseline, published: vec![] };
    if let Some(value) = &figures.baseline {
        has_value("baseline", axes, Some(&figures.x), value)?;
    }
    let published =
        file.published.unwrap_or_default().into_iter().map(|one| told(one, axes, &figures));
    figures.published = published.collect::<Result<_, _>>()?;
    Ok(figures)
}

/// Whether an axis has a value; what a key of the report names has to be there.
fn has_value(
    key: &str,
    axes: &[Axis],
    name: Option<&String>,
    value: &str,
) -> Result<(), SweepError> {
    let axis = name.and_then(|name| axes.iter().find(|axis| axis.name == *name));
    let wrong = |allowed: &str| {
        SweepError::key(&format!("report.{key}"), &format!("is {value:?}"), allowed)
    };
    let Some(axis) = axis else { return Err(wrong("the report has no such axis: name it first")) };
    let all: Vec<String> = axis.list().iter().map(|choice| choice.value.to_string()).collect();
    if all.iter().any(|one| one == value) {
        return Ok(());
    }
    Err(wrong(&format!("values of axis `{}` are {}", axis.name, all.join(", "))))
}

/// A figure of others, checked.
fn told(file: PublishedFile, axes: &[Axis], figures: &Figures) -> Result<Published, SweepError> {
    let missing = |key: &str, allowed: &str| {
        SweepError::key(&format!("report.published.{key}"), "is missing", allowed)
    };
    let x = file.x.ok_or_else(|| missing("x", "name the value of the abscissa"))?;
    let mean = file.mean.ok_or_else(|| missing("mean", "give the mean of the ordinate"))?;
    let names = [Some(&figures.x), figures.series.as_ref(), figures.panel.as_ref()];
    let mut at = [None, None, None];
    let keys = ["published.x", "published.series", "published.panel"];
    for (place, value) in [Some(x), file.series, file.panel].into_iter().enumerate() {
        let Some(value) = value else { continue };
        let value = Value::from(value).to_string();
        has_value(keys[place], axes, names[place], &value)?;
        at[place] = Some(value);
    }
    let finite = |key: &str, value: f64, least: f64| {
        if value.is_finite() && value >= least {
            return Ok(());
        }
        let allowed = "it must be a number, a deviation none below 0";
        Err(SweepError::key(&format!("report.published.{key}"), &format!("is {value}"), allowed))
    };
    finite("mean", mean, f64::MIN)?;
    file.deviation.iter().try_for_each(|&value| finite("deviation", value, 0.0))?;
    let source = file.source.unwrap_or_default();
    Ok(Published { at, mean, deviation: file.deviation, runs: file.runs, source })
}

#[cfg(test)]
mod tests {
    use super::*;

    const GRID: &str = "[[axis]]\nkey = 'hw.cell.level_bits'\nvalues = [1, 2]\n[[axis]]\nkey = 'learning.rule'\n\
                        values = ['ed', 'bp']\n";

    fn sweep(text: &str) -> Result<Sweep, String> {
        Sweep::parse("a_b.toml", text, "").map_err(|e| e.to_string())
    }

    #[test]
    fn what_is_not_said_follows() {
        let sweep = sweep(GRID).unwrap();
        assert_eq!((sweep.name.as_str(), sweep.title.as_str()), ("a-b", "a-b"));
        assert!(sweep.seeds.is_empty());
        let Figures { x, y, series, panel, heat, cost, .. } = sweep.figures;
        assert_eq!((x.as_str(), y.as_str()), ("level_bits", "test_accuracy"));
        assert_eq!((series.as_deref(), panel, cost), (Some("rule"), None, None));
        assert_eq!(heat, Some(["level_bits".into(), "rule".into()]));
    }

    #[test]
    fn mistakes_say_what_is_allowed() {
        for (text, wanted) in [
            ("", "[[axis]]"),
            ("axes = 1", "unknown field `axes`"),
            (&format!("name = 'A b'\n{GRID}"), "lower-case"),
            (&format!("seeds = [1, 1]\n{GRID}"), "twice"),
            (&format!("seeds = 0\n{GRID}"), "different"),
            (&format!("{GRID}[sample]\nmethod = 'sobol'\npoints = 3"), "latin_hypercube"),
            (&format!("{GRID}[sample]\nmethod = 'random'"), "sample.points"),
            (&format!("{GRID}[report]\nx = 'bits'"), "axes are level_bits, rule"),
            (&format!("{GRID}[report]\ny = 'accuracy'"), "results are test_accuracy"),
            (&format!("{GRID}[report]\nbaseline = 3"), "values of axis `level_bits` are 1, 2"),
            (&format!("{GRID}[[report.published]]\nx = 2"), "report.published.mean"),
            (&format!("{GRID}[[report.published]]\nmean = 2"), "report.published.x"),
            (
                &format!("{GRID}[[report.published]]\nx = 2\nmean = 0.5\nseries = 'dfa'"),
                "values of axis `rule` are ed, bp",
            ),
            (
                &format!("{GRID}[[report.published]]\nx = 2\nmean = 0.5\ndeviation = -1"),
                "none below 0",
            ),
            (
                &format!("{GRID}[[axis]]\nname = 'cycles'\nkey = 'a'\nvalues = [1]"),
                "another column",
            ),
            (
                &format!("{GRID}[[axis]]\nname = 'hardware'\nkey = 'a'\nvalues = [1]"),
                "another column",
            ),
            (
                &format!("{GRID}[[axis]]\nname = 'b'\nkey = 'hw.cell.level_bits'\nvalues = [3]"),
                "sets `hw.cell.level_bits`, and so does axis `level_bits`",
            ),
            (
                &format!(
                    "{GRID}[[axis]]\nname = 'b'\n[[axis.case]]\nname = 'x'\nset.hw.cell.level_bits = 3"
                ),
                "sets `hw.cell.level_bits`, and so does axis `level_bits`",
            ),
            (&format!("{GRID}[base.learning]\nepoch = 3"), "unknown field `epoch`"),
            (&format!("filter = ['bits > 3']\n{GRID}"), "level_bits, rule, seed"),
        ] {
            let error = sweep(text).unwrap_err();
            assert!(error.contains(wanted), "{text}: {error}");
        }
    }
}
