//! Keys of sweep files.

use super::KeyFileKind::Sweep;
use super::{KeyEntry, KeyTable, other, real, whole, words};
use crate::lab::config::sweep::{
    AxisFile, CaseFile, PublishedFile, ReportFile, SampleFile, SweepFile,
};

const fn table(
    path: &'static str,
    about: &'static str,
    meanings: &'static [(&'static str, &'static str)],
    entries: &'static [KeyEntry],
) -> KeyTable {
    KeyTable { path, file: Sweep, about, meanings, entries }
}

pub(super) const TABLES: &[KeyTable] = &[
    table("", "The file itself.", SweepFile::MEANINGS, ROOT),
    table(
        "axis",
        "`[[axis]]`, one or more: `key` with `values`, or with `from` and `to`, or cases.",
        AxisFile::MEANINGS,
        AXIS,
    ),
    table(
        "axis.case",
        "`[[axis.case]]`: values that set several keys each.",
        CaseFile::MEANINGS,
        CASE,
    ),
    table(
        "sample",
        "Points drawn at random in place of the full grid.",
        SampleFile::MEANINGS,
        SAMPLE,
    ),
    table("report", "What the figures show at first.", ReportFile::MEANINGS, REPORT),
    table(
        "report.published",
        "`[[report.published]]`: figures of others, set beside what was found.",
        PublishedFile::MEANINGS,
        PUBLISHED,
    ),
];

const ROOT: &[KeyEntry] = &[
    other("name", "1 to 64 lower-case letters, digits and `-`")
        .otherwise("the file's name without its ending"),
    other("title", "text").otherwise("the name"),
    other("about", "text"),
    other("experiment", "a path").otherwise("defaults alone"),
    other("base", "tables of an experiment file"),
    other("seeds", "a number of seeds, or a list of seeds").otherwise("the experiment's own"),
    other("axis", "tables"),
    other("filter", "a list of texts, such as \"bits > 3 && rule != 'bp'\""),
    other("sample", "a table").otherwise("the full grid"),
    other("report", "a table"),
];

const AXIS: &[KeyEntry] = &[
    other("name", "lower-case letters, digits and `_`").otherwise("the last part of the first key"),
    other("label", "text").otherwise("the name"),
    other("key", "a key of an experiment, or a list of keys that all get the value"),
    other("values", "a list of numbers, words, true or false"),
    other("from", "a number"),
    other("to", "a number"),
    words("scale", &[("linear", "equal steps"), ("log", "equal ratios")]).otherwise("\"linear\""),
    whole("steps", 1, 100_000).otherwise("a grid needs it"),
    other("case", "tables"),
];

const CASE: &[KeyEntry] = &[
    other("name", "a number, a word, true or false"),
    other("set", "tables of an experiment file"),
];

const SAMPLE: &[KeyEntry] = &[
    words(
        "method",
        &[
            ("random", "each point by itself"),
            ("latin_hypercube", "each axis is cut into as many parts as points, each used once"),
        ],
    )
    .otherwise("the table needs it"),
    whole("points", 1, 1_000_000).otherwise("the table needs it"),
    whole("seed", 0, i64::MAX).otherwise("1"),
];

const REPORT: &[KeyEntry] = &[
    other("x", "an axis").otherwise("the first axis of numbers"),
    other("y", "a result").otherwise("`test_accuracy`; `return_mean` of policies"),
    other("series", "an axis").otherwise("the first other axis of few values"),
    other("panel", "an axis").otherwise("the next one"),
    other("heat", "two axes").otherwise("abscissa and series"),
    other("cost", "a result").otherwise("none"),
    other("baseline", "a value of the abscissa").otherwise("none: nothing is tested"),
    other("published", "tables"),
];

const PUBLISHED: &[KeyEntry] = &[
    other("x", "a value of the abscissa").otherwise("the table needs it"),
    other("series", "a value of the axis of the curves").otherwise("all of them"),
    other("panel", "a value of the axis of the panels").otherwise("all of them"),
    real("mean", -1e18, 1e18).otherwise("the table needs it"),
    real("deviation", 0.0, 1e18).otherwise("unknown: nothing is tested"),
    whole("runs", 1, 1_000_000).otherwise("unknown: nothing is tested"),
    other("source", "text"),
];
