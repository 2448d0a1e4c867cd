//! The page of a comparison: curves of the runs over one another, what they have differently, what came out.
//!
//! A run is its number and colour wherever it is drawn. All numbers are those of the records; this page divides.

use super::{ComparedRun, Comparison};
use crate::lab::price::prefixed;
use crate::lab::report::chart::{Chart, Series};
use crate::lab::report::colour::hue;
use crate::lab::report::figures::Figure;
use crate::lab::report::number::{
    count, escape, float, hash_head, percent, quotient, ratio, short, significant, size,
};
use crate::lab::report::page::Sheet;
use crate::lab::report::scale::Axis;
use crate::lab::store::record::{EpochRecord, PolicyTest, Score, TestOutcome, TestRecord};
use crate::lab::table::ColumnUnit;

/// Runs drawn at most: more colours are not told apart.
const DRAWN: usize = 8;

/// The page, complete.
#[must_use]
pub fn html(comparison: &Comparison, version: &str) -> String {
    let figures = [
        accuracy(comparison),
        returns(comparison),
        results(comparison),
        keys(comparison),
        balance(comparison),
        writes(comparison),
        energy(comparison),
        states(comparison),
    ];
    let names: Vec<&str> = comparison.runs.iter().map(|run| run.name.as_str()).collect();
    Sheet {
        title: names.join(" and "),
        eyebrow: "dalean comparison",
        header: header(comparison),
        figures: figures.into_iter().flatten(),
        source: "the records of these runs",
        version,
    }
    .html()
}

/// `(1)`, in the colour of the run.
fn number(at: usize) -> String {
    format!("<b class=\"swatch\" style=\"--hue:{}\">{}</b>", colour(at), at + 1)
}

fn colour(at: usize) -> &'static str {
    if at < DRAWN { hue(at) } else { "var(--c)" }
}

fn share(score: Option<Score>) -> Option<f64> {
    score.filter(|score| score.total > 0).map(Score::fraction)
}

fn header(comparison: &Comparison) -> String {
    let card = |(at, run): (usize, &ComparedRun)| {
        let last = run.records.last();
        let big = match &run.test {
            Some(TestOutcome::Classify(TestRecord { score, epoch, .. })) => format!(
                "<div class=\"value\">{}</div><div class=\"note\">test accuracy, {} of {} right, state after epoch {epoch}</div>",
                share(Some(*score)).map_or("–".into(), |share| percent(share, 2)),
                count(score.correct),
                count(score.total)
            ),
            Some(TestOutcome::Policy(PolicyTest { episodes, epoch, .. })) => format!(
                "<div class=\"value\">{}</div><div class=\"note\">mean return of {} {} episodes, state after epoch \
                 {epoch}</div>",
                episodes.mean().map_or("–".into(), significant),
                count(episodes.episodes()),
                episodes.played()
            ),
            None => format!(
                "<div class=\"value\">–</div><div class=\"note\">not tested: {} after epoch {} of {}</div>",
                escape(&run.status),
                last.map_or(0, |record| record.epoch),
                run.epochs
            ),
        };
        let notes = run.notes.iter().map(|note| format!("<li>{}</li>", escape(note)));
        let notes: String = notes.collect();
        let notes = if notes.is_empty() { notes } else { format!("<ul>{notes}</ul>") };
        format!(
            "<div class=\"key run\"><div class=\"name\">{} {}</div>{big}<p>{}</p>{notes}<p class=\"note\">{}</p></div>",
            number(at),
            escape(&run.name),
            escape(&run.title),
            parted(comparison, at)
        )
    };
    let cards: String = comparison.runs.iter().enumerate().map(card).collect();
    let count = comparison.runs.len();
    let left = if count > DRAWN {
        format!(" The first {DRAWN} have colours and are drawn; the tables have all.")
    } else {
        String::new()
    };
    let data = if comparison.same_data() {
        "All learnt from the same data."
    } else {
        "They did <b>not</b> learn from the same data: accuracies are not comparable."
    };
    format!(
        "<h1>{count} runs, side by side</h1><p class=\"facts\">{data}{left}</p><div class=\"runs\">{cards}</div></header>\n"
    )
}

/// Where the states of a run part from those of the first.
fn parted(comparison: &Comparison, at: usize) -> String {
    let (first, run) = (&comparison.runs[0], &comparison.runs[at]);
    let both = first.records.len().min(run.records.len());
    match (at, run.differs_from) {
        (0, _) => "The others are compared with this one.".into(),
        (_, Some(0)) => "Another state than that of run 1 before the first update.".into(),
        (_, Some(epoch)) => format!(
            "The same state as run 1 up to epoch {}, another after epoch {epoch}.",
            epoch - 1
        ),
        (_, None) if both == 0 => "No epoch in common with run 1.".into(),
        (_, None) => {
            format!("The same state as run 1, bit for bit, after each of {} epochs.", both - 1)
        }
    }
}

/// A line a run: a number an epoch.
fn lines(comparison: &Comparison, of: impl Fn(&EpochRecord) -> Option<f64>) -> Vec<Series> {
    let line = |(at, run): (usize, &ComparedRun)| {
        let points = run.records.iter().filter_map(|record| {
            Some((f64::from(record.epoch), of(record).filter(|value| value.is_finite())?))
        });
        Series::new(&format!("({})", at + 1), colour(at), points.collect()).numbered(at)
    };
    let all = comparison.runs.iter().enumerate().take(DRAWN).map(line);
    all.filter(|series| !series.points.is_empty()).collect()
}

/// A chart of such lines, from their first epoch to their last.
fn chart(all: &[Series], y: Axis, alt: &str, show: impl Fn(f64) -> String) -> Option<String> {
    let epochs = || all.iter().flat_map(|one| &one.points).map(|point| point.0 as u32);
    let (first, last) = (epochs().min()?, epochs().max()?);
    let mut chart = Chart::new(480.0, 330.0, 104.0, Axis::epochs(first, last), y);
    chart.series(all, show);
    Some(chart.finish(alt))
}

fn multiple(heading: &str, chart: Option<String>) -> String {
    chart.map_or_else(String::new, |chart| {
        format!("<div class=\"multiple\"><h4>{heading}</h4>{chart}</div>")
    })
}

/// A chart of percentages.
fn percents(all: &[Series], label: &str, alt: &str) -> Option<String> {
    let values = || all.iter().flat_map(|one| &one.points).map(|point| point.1);
    let (low, high) = (values().reduce(f64::min)?, values().reduce(f64::max)?);
    let room = ((high - low) * 0.08).max(0.2);
    let y = Axis::percent((low - room).max(0.0), (high + room).min(100.0), label);
    chart(all, y, alt, |value| format!("{value:.2}\u{202f}%"))
}

fn accuracy(comparison: &Comparison) -> Option<Figure> {
    // chance level before learning would squeeze everything else
    let learnt = |record: &EpochRecord, score: Option<Score>| {
        (record.epoch > 0).then(|| share(score).map(|share| 100.0 * share)).flatten()
    };
    let validation = lines(comparison, |record| learnt(record, record.validation()));
    let train = lines(comparison, |record| learnt(record, record.train()));
    let body = [
        multiple(
            "On the validation set",
            percents(&validation, "accuracy", "Validation accuracy over epochs, a line a run"),
        ),
        multiple(
            "While learning",
            percents(&train, "accuracy", "Accuracy while learning over epochs, a line a run"),
        ),
    ]
    .concat();
    (!body.is_empty()).then(|| Figure {
        wide: true,
        id: "accuracy",
        title: "Accuracy over epochs",
        caption: "After each epoch, a line a run; epoch 0, before the first update, is left out. While learning: \
                  answers given before their example was learnt from."
            .into(),
        body: format!("<div class=\"multiples\">{body}</div>"),
    })
}

fn returns(comparison: &Comparison) -> Option<Figure> {
    let evaluated = lines(comparison, |record| record.policy()?.evaluation.mean());
    let learning = lines(comparison, |record| record.policy()?.episodic_return);
    let drawn = |all: &[Series], alt: &str| {
        let values = || all.iter().flat_map(|one| &one.points).map(|point| point.1);
        let (low, high) = (values().reduce(f64::min)?, values().reduce(f64::max)?);
        let room = (0.06 * (high - low)).max(0.5);
        chart(all, Axis::round(low - room, high + room, "return"), alt, significant)
    };
    let body = [
        multiple("Without learning", drawn(&evaluated, "Return without learning over epochs")),
        multiple("While learning", drawn(&learning, "Return while learning over epochs")),
    ]
    .concat();
    (!body.is_empty()).then(|| Figure {
        wide: true,
        id: "returns",
        title: "Returns over epochs",
        caption: "Mean return of episodes, a line a run: of those played after an epoch without learning, and of those that \
                  ended in it while learning."
            .into(),
        body: format!("<div class=\"multiples\">{body}</div>"),
    })
}

/// The head of a table with a column a run.
fn heads(comparison: &Comparison, what: &str) -> String {
    let runs = comparison.runs.iter().enumerate();
    let runs = runs.map(|(at, run)| {
        format!("<th scope=\"col\" title=\"{}\">{}</th>", escape(&run.name), number(at))
    });
    format!("<thead><tr><th scope=\"col\">{what}</th>{}</tr></thead>", runs.collect::<String>())
}

/// A value in its unit.
fn print(value: f64, unit: ColumnUnit) -> String {
    match unit {
        ColumnUnit::Fraction => percent(value, 2),
        ColumnUnit::Seconds | ColumnUnit::Joules => prefixed(value, unit.sign()),
        ColumnUnit::SquareMillimetres => format!("{} {}", significant(value), unit.sign()),
        ColumnUnit::Cycles | ColumnUnit::Count if value >= 0.0 => short(value.round() as u64),
        _ => significant(value),
    }
}

/// How far a value lies from that of the first run: points of a share, percent of another number.
fn apart(value: f64, first: f64, unit: ColumnUnit) -> String {
    let signed = |number: f64, digits: usize, unit: &str| {
        let text = format!("{number:+.digits$}\u{202f}{unit}").replace('-', "\u{2212}");
        format!("<small>{text}</small>")
    };
    if value == first {
        return "<small>=</small>".into();
    }
    match unit {
        ColumnUnit::Fraction => signed(100.0 * (value - first), 2, "points"),
        _ if first != 0.0 => signed(100.0 * (value / first - 1.0), 1, "%"),
        _ => String::new(),
    }
}

fn results(comparison: &Comparison) -> Option<Figure> {
    let rows = comparison.results.iter().map(|result| {
        let first = result.values.first().copied().flatten();
        let cell = |(at, value): (usize, &Option<f64>)| {
            let Some(value) = *value else { return "<td>–</td>".to_owned() };
            let apart = first.filter(|_| at > 0).map(|first| apart(value, first, result.unit));
            format!("<td>{} {}</td>", print(value, result.unit), apart.unwrap_or_default())
        };
        let cells: String = result.values.iter().enumerate().map(cell).collect();
        let meaning = crate::lab::report::words::of_column(result.name).unwrap_or_default();
        format!(
            "<tr><th scope=\"row\"><span class=\"term\" data-tip=\"{}\">{}</span></th>{cells}</tr>",
            escape(meaning),
            escape(result.label)
        )
    });
    let rows: String = rows.collect();
    (!rows.is_empty()).then(|| Figure {
        wide: true,
        id: "results",
        title: "Results",
        caption: "What came out, and how far from run 1. Of one run each: seeds alone move an accuracy, and nothing here \
                  says how far; <code>dalean sweep</code> with <code>seeds</code> does."
            .into(),
        body: format!(
            "<div class=\"scroll\"><table class=\"stack one sides\">{}<tbody>{rows}</tbody></table></div>",
            heads(comparison, "result")
        ),
    })
}

fn keys(comparison: &Comparison) -> Option<Figure> {
    let rows = comparison.keys.iter().map(|key| {
        let cell = |value: &Option<String>| match value {
            Some(value) => format!("<td><code>{}</code></td>", escape(value)),
            None => "<td>–</td>".into(),
        };
        let cells: String = key.values.iter().map(cell).collect();
        format!("<tr><th scope=\"row\"><code>{}</code></th>{cells}</tr>", escape(&key.key))
    });
    let rows: String = rows.collect();
    let body = if rows.is_empty() {
        "<p>No key differs: the runs have one configuration.</p>".into()
    } else {
        format!(
            "<div class=\"scroll\"><table class=\"stack one sides\">{}<tbody>{rows}</tbody></table></div>",
            heads(comparison, "key")
        )
    };
    Some(Figure {
        wide: true,
        id: "keys",
        title: "What they have differently",
        caption: "Keys of the resolved configurations; all others are alike. <code>dalean keys</code> says what each means."
            .into(),
        body,
    })
}

/// Excitation over inhibition, and cells on the floor, all layers together.
fn balance(comparison: &Comparison) -> Option<Figure> {
    let stored = lines(comparison, |record| {
        let sum = |bank: usize| record.layers.iter().map(|layer| layer.levels[bank]).sum::<u64>();
        quotient(sum(0), sum(1)).filter(|ratio| *ratio > 0.0)
    });
    let floor = lines(comparison, |record| {
        let sum = |of: fn(&crate::learn::statistics::PathwayRecord) -> u64| {
            record.pathways.iter().map(of).sum::<u64>()
        };
        quotient(sum(|one| one.floor), sum(|one| one.cells)).map(|share| 100.0 * share)
    });
    let values = || stored.iter().flat_map(|one| &one.points).map(|point| point.1);
    let ratios = chart(
        &stored,
        Axis::ratio(values(), "E/I (log scale)"),
        "Excitation over inhibition over epochs, a line a run",
        |value| ratio(Some(value)),
    );
    let body = [
        multiple("Excitation over inhibition, stored levels", ratios),
        multiple(
            "Cells on the floor",
            percents(&floor, "of the cells", "Cells on the floor over epochs, a line a run"),
        ),
    ]
    .concat();
    (!body.is_empty()).then(|| Figure {
        wide: true,
        id: "balance",
        title: "Balance and sparsity",
        caption: "All layers together. <b>E/I</b>: sum of excitatory over sum of inhibitory levels. <b>Floor</b>: cells that \
                  rest at the lower end of the programming window."
            .into(),
        body: format!("<div class=\"multiples\">{body}</div>"),
    })
}

fn writes(comparison: &Comparison) -> Option<Figure> {
    let total = |record: &EpochRecord, event: &str| {
        record.events.get("training").and_then(|events| events.get(event)).copied().unwrap_or(0)
    };
    let per_epoch = |event: &'static str| -> Vec<Series> {
        let line = |(at, run): (usize, &ComparedRun)| {
            let points = run.records.windows(2).map(|pair| {
                let more = total(&pair[1], event).saturating_sub(total(&pair[0], event));
                (f64::from(pair[1].epoch), float(more))
            });
            Series::new(&format!("({})", at + 1), colour(at), points.collect()).numbered(at)
        };
        let all = comparison.runs.iter().enumerate().take(DRAWN).map(line);
        all.filter(|series| !series.points.is_empty()).collect()
    };
    let drawn = |event: &'static str, alt: &str| {
        let all = per_epoch(event);
        let values = all.iter().flat_map(|one| &one.points).map(|point| point.1);
        let y = Axis::counts(values, "per epoch (log scale)");
        chart(&all, y, alt, |value| short(value as u64))
    };
    let body = [
        multiple("Pulses given", drawn("pulses_attempted", "Pulses per epoch, a line a run")),
        multiple(
            "Conversions that saturated while learning",
            drawn("saturated_conversions", "Saturated conversions per epoch, a line a run"),
        ),
    ]
    .concat();
    (!body.is_empty()).then(|| Figure {
        wide: true,
        id: "writes",
        title: "Writes and saturations",
        caption: "Counts of the ledger, epoch by epoch.".into(),
        body: format!("<div class=\"multiples\">{body}</div>"),
    })
}

/// Joules of each run, cut into components, on one axis.
fn energy(comparison: &Comparison) -> Option<Figure> {
    let runs: Vec<_> = comparison
        .runs
        .iter()
        .enumerate()
        .filter_map(|(at, run)| Some((at, super::energy::parts(run.cost.as_ref()?)?)))
        .collect();
    let most = runs.iter().map(|(_, parts)| parts.total()).reduce(f64::max)?;
    if most <= 0.0 {
        return None;
    }
    let mut names: Vec<&str> = Vec::new();
    for (name, _) in runs.iter().flat_map(|(_, parts)| &parts.parts) {
        if !names.contains(&name.as_str()) {
            names.push(name);
        }
    }
    let lane = |at: usize| size(runs.len() - 1 - at);
    let ticks = runs.iter().enumerate().map(|(at, (run, _))| (lane(at), format!("({})", run + 1)));
    // in the unit of the greatest
    let thousands = (most.log10() / 3.0).floor();
    let by = 1000f64.powf(-thousands);
    let unit = prefixed(1000f64.powf(thousands), "J");
    let unit = unit.split(' ').next_back().unwrap_or("J").to_owned();
    let x = Axis::round(0.0, most * by, &format!("energy of the run ({unit})"));
    let height = 66.0 + 46.0 * size(runs.len());
    let y = Axis::cells(runs.len(), ticks.collect(), "run");
    let mut chart = Chart::framed([820.0, height], [10.0, 110.0], x, y);
    for (at, (_, parts)) in runs.iter().enumerate() {
        let mut from = 0.0;
        for (name, joules) in &parts.parts {
            let kind = names.iter().position(|known| known == name).unwrap_or_default();
            let tip = format!(
                "{name}\n{}, {}",
                prefixed(*joules, "J"),
                percent(joules / parts.total(), 1)
            );
            let ends = (from * by, (from + joules) * by);
            chart.bar(ends, (lane(at) - 0.32, lane(at) + 0.32), (hue(kind), 0.9), &tip);
            from += joules;
        }
    }
    let labels = runs.iter().enumerate().map(|(at, (_, parts))| (lane(at), parts.words()));
    chart.beside("", labels);
    let legend = names.iter().enumerate().map(|(kind, name)| {
        format!("<b class=\"swatch\" style=\"--hue:{}\">{}</b>", hue(kind), escape(name))
    });
    Some(Figure {
        wide: true,
        id: "energy",
        title: "Energy",
        caption: "Counts of the ledger times typical constants of each run's own chip, the final test aside. Bounds, and \
                  what has no price, are on the page of each run."
            .into(),
        body: format!(
            "<p class=\"legend\">{}</p>{}",
            legend.collect::<String>(),
            chart.finish("Energy of each run, cut into parts")
        ),
    })
}

/// State hashes, and where they part.
fn states(comparison: &Comparison) -> Option<Figure> {
    let longest = comparison.runs.iter().map(|run| run.records.len()).max()?;
    fn hash(run: &ComparedRun, at: usize) -> Option<&str> {
        Some(&run.records.get(at)?.state_hash)
    }
    let epochs = (0..longest).map(|at| {
        let of = |run: &ComparedRun| hash(run, at).map(str::to_owned);
        let first = comparison.runs.first().and_then(of);
        let cell = |(number, run): (usize, &ComparedRun)| match of(run) {
            None => "<td>–</td>".to_owned(),
            Some(hash) => {
                let class = if number > 0 && Some(&hash) != first.as_ref() {
                    " class=\"wrong\""
                } else {
                    ""
                };
                format!("<td><code{class}>{}</code></td>", escape(&hash_head(&hash)))
            }
        };
        let cells: String = comparison.runs.iter().enumerate().map(cell).collect();
        let epoch = comparison.runs.iter().find_map(|run| run.records.get(at)).map(|one| one.epoch);
        format!("<tr><th scope=\"row\">{}</th>{cells}</tr>", epoch.unwrap_or_default())
    });
    let rows: String = epochs.collect();
    (longest > 0).then(|| Figure {
        wide: true,
        id: "states",
        title: "States",
        caption: "The first digits of the state hash after each epoch; <span class=\"wrong\">orange</span> where it is \
                  another than that of run 1."
            .into(),
        body: format!(
            "<details{}><summary>State hashes of {} epochs</summary><div class=\"scroll\"><table class=\"stack one sides\">{}\
             <tbody>{rows}</tbody></table></div></details>",
            if longest <= 12 { " open" } else { "" },
            longest,
            heads(comparison, "epoch")
        ),
    })
}
