//! The keys of sweep files. Every key is optional here; what they mean together is checked by `lab::sweep`.

use serde::{Deserialize, Serialize};

use super::ConfigError;
use super::file::{ExperimentFile, keys};
use super::layers::parse;

/// Seeds of a sweep.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(untagged, expecting = "a number of seeds (1, 2, ... are used), or a list of seeds")]
pub enum SeedsFile {
    /// 1 to this.
    Count(u32),
    /// These.
    List(Vec<u64>),
}

/// What an axis value is, or the name of a case.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(untagged, expecting = "a number, a word, true or false")]
pub enum ScalarFile {
    /// A whole number.
    Whole(i64),
    /// A number.
    Real(f64),
    /// True or false.
    Flag(bool),
    /// A word.
    Text(String),
}

/// Which key an axis varies.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(untagged, expecting = "a key, or a list of keys that all get the value")]
pub enum KeyFile {
    /// One.
    One(String),
    /// All of these, the same value.
    All(Vec<String>),
}

keys! {
    /// A sweep file.
    SweepFile {
        /// What it is called in its store: lower-case letters, digits, `-`.
        name: String,
        /// Heading of its page.
        title: String,
        /// What it asks and shows, in paragraphs.
        about: String,
        /// Experiment file to start from, relative to this file; default: nothing but defaults.
        experiment: String,
        /// Keys of an experiment, laid over it.
        base: ExperimentFile,
        /// Seeds; default: the experiment's own.
        seeds: SeedsFile,
        /// What is varied, the slowest first.
        axis: Vec<AxisFile>,
        /// Conditions on axes; a point must meet them all.
        filter: Vec<String>,
        /// Draws points at random; default: the full grid.
        sample: SampleFile,
        /// What the figures show at first.
        report: ReportFile,
    }
    /// `[[axis]]`: either `key` with `values` or with `from` and `to`, or cases.
    AxisFile {
        /// Name of its column; default: the last part of the first `key`.
        name: String,
        /// Words for people; default: the name.
        label: String,
        /// The key that is varied, or several that get the same value.
        key: KeyFile,
        /// Its values.
        values: Vec<ScalarFile>,
        /// The least value.
        from: ScalarFile,
        /// The greatest value.
        to: ScalarFile,
        /// `linear` or `log`.
        scale: String,
        /// Values from `from` to `to`; needed in a grid, optional in a sample.
        steps: u32,
        /// Values that set several keys each.
        case: Vec<CaseFile>,
    }
    /// `[[axis.case]]`.
    CaseFile {
        /// The value of the axis.
        name: ScalarFile,
        /// Keys of an experiment.
        set: ExperimentFile,
    }
    /// `[sample]`.
    SampleFile {
        /// `random` or `latin_hypercube`.
        method: String,
        /// How many; each is run with every seed.
        points: u32,
        /// Which points: another number, other points.
        seed: u64,
    }
    /// `[report]`: names of axes and results.
    ReportFile {
        /// Abscissa; default: the first axis of numbers.
        x: String,
        /// Ordinate; default: `test_accuracy`, of policies `return_mean`.
        y: String,
        /// One curve each.
        series: String,
        /// One panel each.
        panel: String,
        /// Axes of the heat map.
        heat: [String; 2],
        /// What is set against `y`: `joules`, `cycles`, `pulses_attempted`, ...
        cost: String,
        /// The value of the abscissa that the others are compared with, by Welch's test.
        baseline: ScalarFile,
        /// What others reported of the same settings, set beside what was found.
        published: Vec<PublishedFile>,
    }
    /// `[[report.published]]`: a figure of others, and where it belongs.
    PublishedFile {
        /// The value of the abscissa.
        x: ScalarFile,
        /// The value of the axis of the curves; default: all of them.
        series: ScalarFile,
        /// The value of the axis of the panels; default: all of them.
        panel: ScalarFile,
        /// The mean of `y`, in the unit of the table: a share of 0.967, not 96.7.
        mean: f64,
        /// The standard deviation over runs.
        deviation: f64,
        /// How many runs.
        runs: u32,
        /// Who says so.
        source: String,
    }
}

impl SweepFile {
    /// Reads a sweep file.
    ///
    /// # Errors
    /// When the text is not TOML or has unknown keys: with line and caret.
    pub fn parse(place: &str, text: &str) -> Result<Self, ConfigError> {
        parse(place, text)
    }
}
