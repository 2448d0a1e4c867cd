//! The page around the figures: what was asked, the best setting, choices, empty frames that the script fills, notes.

use super::measure::Measure;
use super::settings::Settings;
use super::statistics::Summary;
use super::{SweepView, against, json, library, meaning, paper};
use crate::lab::price::prefixed;
use crate::lab::report::number::{count, escape, percent, significant};
use crate::lab::table::ColumnUnit;

const STYLE: &str = include_str!("../page.css");
const SWEEP_STYLE: &str = include_str!("page.css");
const SCRIPT: &str = include_str!("../page.js");
/// Parts of the page's own script, in order; they share one scope.
const PARTS: [&str; 10] = [
    include_str!("data.js"),
    include_str!("look.js"),
    include_str!("curves.js"),
    include_str!("heat.js"),
    include_str!("pareto.js"),
    include_str!("learning.js"),
    include_str!("importance.js"),
    include_str!("parallel.js"),
    include_str!("rows.js"),
    include_str!("page.js"),
];

/// One figure's empty frame: anchor, heading, names of its choices, whether it can be exported.
struct Frame {
    id: &'static str,
    title: &'static str,
    choices: &'static [(&'static str, &'static str)],
}

const FRAMES: [Frame; 6] = [
    Frame {
        id: "curves",
        title: "Curves",
        choices: &[
            ("x", "across"),
            ("series", "one curve for each"),
            ("panel", "one panel for each"),
        ],
    },
    Frame { id: "heat", title: "Heat map", choices: &[("hx", "across"), ("hy", "down")] },
    Frame { id: "pareto", title: "What it costs", choices: &[("cost", "cost")] },
    Frame { id: "learning", title: "Learning", choices: &[("learner", "one curve for each")] },
    Frame { id: "importance", title: "What matters", choices: &[] },
    Frame { id: "parallel", title: "All settings at once", choices: &[] },
];

/// The page, complete.
#[must_use]
pub fn html(view: &SweepView<'_>) -> String {
    let settings = Settings::new(view);
    let mut body = String::new();
    let mut contents = String::new();
    for (number, frame) in (1..).zip(&FRAMES) {
        contents += &format!("<a href=\"#{}\" data-jump>{}</a>", frame.id, frame.title);
        body += &card(number, frame);
    }
    let compared = against::card(&settings, FRAMES.len() + 1);
    if !compared.is_empty() {
        contents += "<a href=\"#against\" data-jump>Compared</a>";
    }
    let last = FRAMES.len() + if compared.is_empty() { 1 } else { 2 };
    contents += "<a href=\"#rows\" data-jump>Table</a><a href=\"#reading\" data-jump>How to read, check and cite</a>";
    format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n<meta name=\"viewport\" \
         content=\"width=device-width, initial-scale=1\">\n<title>{title}</title>\n\
         <style>\n{STYLE}{SWEEP_STYLE}</style>\n</head>\n<body>\n<div class=\"stripe\"><i></i><i></i><i></i><i></i>\
         </div>\n<main>\n{header}{notices}<nav>{contents}</nav>\n{choices}<div class=\"figures\">\n{body}{compared}{rows}\
         {reading}</div>\n{fixed}<footer>dalean {version}. All numbers come from the table of runs on this page; \
         nothing is loaded from elsewhere.</footer>\n</main>\n\
         <script type=\"application/json\" id=\"sweep\">{data}</script>\n<script>{library}</script>\n\
         <script>\n\"use strict\";\n{{\n{parts}}}\n</script>\n<script>\n{SCRIPT}</script>\n</body>\n</html>\n",
        title = escape(view.title),
        header = header(&settings),
        notices = notices(view),
        choices = choices(),
        rows = rows(last, view),
        reading = reading(view, last + 1),
        fixed = fixed(view),
        version = escape(view.version),
        data = json::data(&settings),
        library = library::plotly(),
        parts = PARTS.concat(),
    )
}

fn select(name: &str, label: &str) -> String {
    format!(
        "<label class=\"choice\"><span>{label}</span><select id=\"choose-{name}\"></select></label>"
    )
}

fn card(number: usize, frame: &Frame) -> String {
    let choices: String = frame.choices.iter().map(|(name, label)| select(name, label)).collect();
    let id = frame.id;
    format!(
        "<section class=\"card wide figure\" id=\"{id}\"><div class=\"top\"><h2><span>{number}</span>{}</h2>\
         <div class=\"save\"><button type=\"button\" data-save=\"svg\" aria-label=\"{} as SVG\">SVG</button>\
         <button type=\"button\" data-save=\"png\" aria-label=\"{} as PNG\">PNG</button></div></div>\
         <div class=\"choices\">{choices}</div><div class=\"plot\" id=\"plot-{id}\" role=\"img\"></div>\
         <p class=\"caption\"></p><div class=\"more\"></div></section>\n",
        frame.title, frame.title, frame.title
    )
}

/// What all figures share: the result, and where the axes that a figure does not show are held.
fn choices() -> String {
    format!(
        "<section class=\"card shared\" id=\"shared\" hidden aria-label=\"Choices for all figures\"><div \
         class=\"choices\">{}<div class=\"holds\" id=\"holds\"></div></div></section>\n",
        select("y", "result")
    )
}

fn rows(number: usize, view: &SweepView<'_>) -> String {
    let meanings = view.table.columns.iter().map(|column| {
        format!(
            "<div id=\"column-{}\"><dt>{} <code>{0}</code></dt><dd>{}</dd></div>",
            escape(&column.name),
            escape(&column.label),
            escape(&meaning(column))
        )
    });
    format!(
        "<section class=\"card wide\" id=\"rows\"><div class=\"top\"><h2><span>{number}</span>Table</h2>\
         <div class=\"save\"><button type=\"button\" id=\"csv-copy\">copy CSV</button><button type=\"button\" \
         id=\"csv-save\">download CSV</button></div></div><div class=\"choices\"><label class=\"choice \
         find\"><span>find</span><input id=\"find\" type=\"search\" placeholder=\"words, or level_bits=4\" \
         autocomplete=\"off\" spellcheck=\"false\"></label><label class=\"tick\"><input type=\"checkbox\" id=\"every\"> \
         all columns</label><span id=\"found\" class=\"note\" \
         role=\"status\"></span></div><div class=\"scroll\"><table id=\"table\"><thead></thead><tbody></tbody></table>\
         </div><div class=\"pager\" id=\"pager\"></div><details id=\"meanings\"><summary>What the columns mean\
         </summary><dl class=\"lexicon\">{}</dl></details></section>\n",
        meanings.collect::<String>()
    )
}

/// Paragraphs of plain text, an empty line between them.
fn paragraphs(text: &str) -> String {
    let parts = text.split("\n\n").map(str::trim).filter(|part| !part.is_empty());
    parts.map(|part| format!("<p>{}</p>", escape(part))).collect()
}

fn header(settings: &Settings<'_>) -> String {
    let view = settings.view;
    let key = |name: &str, value: &str, note: &str| {
        format!(
            "<div class=\"key\"><div class=\"name\">{name}</div><div class=\"value\">{value}</div>\
             <div class=\"note\">{note}</div></div>"
        )
    };
    let (planned, finished) = (view.table.len(), settings.finished());
    let open = match planned - finished {
        0 => "all of them".into(),
        rest => format!("{} without a result", tally(rest)),
    };
    let mut keys =
        key("planned", &tally(planned), &format!("{} settings", tally(settings.groups.len())));
    keys += &key("finished", &tally(finished), &open);
    keys += &key("refused", &tally(view.refused.len()), "cannot be run");
    let axes: String = settings
        .axes
        .iter()
        .map(|axis| {
            let (first, last) = (axis.texts.first(), axis.texts.last());
            let what = match (first, last) {
                (Some(first), Some(last)) if axis.drawn() => {
                    format!("{} to {}, drawn", brief(first), brief(last))
                }
                (Some(first), Some(last)) if axis.numbers.is_some() && axis.texts.len() > 4 => {
                    format!("{} to {}, {} values", escape(first), escape(last), axis.texts.len())
                }
                _ if axis.texts.len() > 8 => format!("{} values", axis.texts.len()),
                _ => escape(&axis.texts.join(", ")),
            };
            format!("<div><dt>{}</dt><dd>{what}</dd></div>", escape(&axis.axis.label))
        })
        .collect();
    format!(
        "<header><div class=\"eyebrow\">dalean sweep report<button type=\"button\" id=\"theme\" hidden>light / \
         dark</button></div><h1>{}</h1><p class=\"facts\">{}</p><div class=\"about\">{}</div><div \
         class=\"hero\"><div class=\"headline\">{}</div><div class=\"keys three\">{keys}<div class=\"key \
         wide\"><div class=\"name\">axes</div><dl class=\"axes\">{axes}</dl></div></div></div></header>\n",
        escape(view.title),
        escape(view.name),
        paragraphs(view.about),
        headline(settings)
    )
}

/// A drawn number, with the digits that matter.
fn brief(text: &str) -> String {
    text.parse().map_or_else(|_| escape(text), significant)
}

fn tally(number: usize) -> String {
    count(number as u64)
}

/// A result in its unit.
fn print(value: f64, unit: ColumnUnit) -> String {
    match unit {
        ColumnUnit::Fraction => percent(value, 2),
        ColumnUnit::Cycles | ColumnUnit::Seconds | ColumnUnit::Joules => {
            prefixed(value, unit.sign())
        }
        ColumnUnit::SquareMillimetres => format!("{} {}", significant(value), unit.sign()),
        ColumnUnit::Plain | ColumnUnit::Count => significant(value),
    }
}

fn headline(settings: &Settings<'_>) -> String {
    let none = "<div class=\"big none\">–</div><div class=\"what\">no result yet</div>";
    let Some(wanted) = settings.measure(&settings.view.figures.y) else { return none.into() };
    let Some((rows, best)) = settings.best(wanted) else { return none.into() };
    let measure = settings.chooser(wanted);
    let number = match measure.column.unit {
        ColumnUnit::Fraction => format!("{:.2}<small>\u{202f}%</small>", 100.0 * best.mean),
        unit => escape(&print(best.mean, unit)),
    };
    // 100.00 % is too wide for the largest letters
    let short = measure.column.unit == ColumnUnit::Fraction && (0.0..0.999_95).contains(&best.mean);
    let small = if short { "" } else { " long" };
    let way = if measure.less { "lowest" } else { "highest" };
    let where_: Vec<String> = settings
        .axes
        .iter()
        .filter(|axis| axis.varies())
        .filter_map(|axis| {
            let text = axis.texts.get(axis.codes[*rows.first()?]?)?;
            let text = if axis.drawn() { brief(text) } else { escape(text) };
            Some(format!("{} <b>{text}</b>", escape(&axis.axis.label)))
        })
        .collect();
    let at = if where_.is_empty() { String::new() } else { format!("{}.", where_.join(", ")) };
    let mut out = format!(
        "<div class=\"big{small}\">{number}</div><div class=\"what\">{way} {}</div>",
        escape(&measure.column.label),
    );
    let beside = (measure.column.name != wanted.column.name)
        .then(|| settings.summary(wanted, rows))
        .flatten();
    if let Some(test) = beside {
        out += &format!(
            "<div class=\"beside\">{} there <b>{}</b>{}</div>",
            escape(&wanted.column.label),
            print(test.mean, wanted.column.unit),
            test.half.map_or_else(String::new, |half| format!(
                " ±\u{202f}{}",
                print(half, wanted.column.unit)
            ))
        );
    }
    let chosen = chosen(settings, measure, best, beside.is_some());
    format!("{out}<p>{at}</p><p>{chosen}</p>")
}

fn chosen(settings: &Settings<'_>, measure: Measure<'_>, best: Summary, tested: bool) -> String {
    let runs = match (best.n, best.half) {
        (n, Some(half)) => {
            let half = print(half, measure.column.unit);
            format!("Mean of n = {n} runs ±\u{202f}{half} (95\u{202f}% confidence)")
        }
        _ => "One run (n = 1)".into(),
    };
    let among = tally(settings.with_mean(measure));
    if tested {
        return format!(
            "{runs}, chosen among {among} settings by validation, which flatters this number; the test set took no part."
        );
    }
    format!(
        "{runs}, picked afterwards among {among} settings: the best of many is flattered by chance."
    )
}

/// What the chips leave out, and points that cannot be run.
fn notices(view: &SweepView<'_>) -> String {
    let mut out = String::new();
    if !view.not_simulated.is_empty() {
        let list = view.not_simulated.iter();
        let name = |text: &String| {
            let name = text.split(" = ").next().unwrap_or_default();
            escape(&name.replace('_', " "))
        };
        let mut names: Vec<String> = list.clone().map(name).collect();
        names.dedup();
        let list: String =
            list.map(|text| format!("<li><code>{}</code></li>", escape(text))).collect();
        out += &format!(
            "<ul class=\"notices\"><li class=\"fold\"><details><summary>{} effects of real chips are not simulated: {}</summary><ul>{list}</ul></details>\
             </li></ul>\n",
            names.len(),
            names.join(", ")
        );
    }
    if !view.refused.is_empty() {
        let list = view.refused.iter().map(|one| {
            format!(
                "<tr><th>{}</th><td>{}</td><td>{}</td></tr>",
                one.point,
                escape(&one.what),
                escape(&one.why)
            )
        });
        out += &format!(
            "<details class=\"refused\" id=\"refused\"><summary>{} points cannot be run</summary><div \
             class=\"scroll\"><table><thead><tr><th>point</th><th>setting</th><th>why</th></tr></thead><tbody>{}\
             </tbody></table></div></details>\n",
            tally(view.refused.len()),
            list.collect::<String>()
        );
    }
    out
}

fn reading(view: &SweepView<'_>, number: usize) -> String {
    format!(
        "<section class=\"card wide\" id=\"reading\"><h2><span>{number}</span>How to read, check and cite</h2>\
         <div class=\"columns\"><p><b>Read.</b> A point is the mean of the runs of one setting, which differ in the seed \
         alone. Bands and bars are 95\u{202f}% confidence intervals of that mean by Student's t; they suppose about \
         normal, independent runs and say nothing of other data or other chips. One run has no band. Each caption \
         says n, and what was held or pooled.</p><p><b>Check.</b> <code>dalean verify STORE --sample N</code> runs N \
         of these points again, from their resolved configurations, and compares the state bit by bit. The same \
         configuration and seed give the same bits on any machine.</p><p><b>Cite.</b> Name the program and its \
         version, dalean {}, this sweep, <code>{}</code>, and the n of each figure. The link to this page keeps the \
         choices made above; SVG and PNG are saved on white, for print.</p></div></section>\n",
        escape(view.version),
        escape(view.name)
    )
}

/// For readers without scripts: the figures as they would be at first.
fn fixed(view: &SweepView<'_>) -> String {
    let figures = figures_or_none(view);
    format!(
        "<noscript><p class=\"notices\">Scripts are off: these are the figures in their first state. The choices, the \
         table and the parallel coordinates need scripts.</p>{figures}</noscript>\n"
    )
}

fn figures_or_none(view: &SweepView<'_>) -> String {
    let figures = paper::figures(view);
    figures
        .iter()
        .map(|figure| format!("<figure class=\"paper\">{}</figure>", figure.svg))
        .collect()
}
