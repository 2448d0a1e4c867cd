//! The page around the figures: key figures on top, then everything in [`figures::ALL`].

use super::figures::Figure;
use super::number::{
    count, escape, hash_head, percent, percent_of, place, quotient, ratio, seconds, short,
    significant,
};
use super::{RunView, figures, words};
use crate::lab::config::absent_words;
use crate::lab::price::{Cost, prefixed};
use crate::lab::store::record::{EpochRecord, TestOutcome};

const STYLE: &str = include_str!("page.css");
/// In an element of its own, because drawings that are saved take it along.
const CHART_STYLE: &str = include_str!("chart.css");
const SCRIPTS: [&str; 3] =
    [include_str!("page.js"), include_str!("page/save.js"), include_str!("page/maps.js")];

/// A page around figures: what all pages without a sweep share.
pub(super) struct Sheet<'a, F> {
    /// Heading of the window; with it, saved figures get their names.
    pub title: String,
    /// What kind of page it is.
    pub eyebrow: &'a str,
    /// Heading and key numbers; markup.
    pub header: String,
    /// The figures, in order.
    pub figures: F,
    /// Where all numbers come from.
    pub source: &'a str,
    /// Version of the program that made them.
    pub version: &'a str,
}

impl<F: Iterator<Item = Figure>> Sheet<'_, F> {
    /// The page, complete.
    pub(super) fn html(self) -> String {
        let mut contents = String::new();
        let mut body = String::new();
        for (number, figure) in (1..).zip(self.figures) {
            let wide = if figure.wide { " wide" } else { "" };
            contents += &format!("<a href=\"#{}\">{}</a>", figure.id, figure.title);
            body += &format!(
                "<section class=\"card{wide}\" id=\"{}\"><div class=\"top\"><h2><span>{number}</span>{}</h2>{}</div>\
                 <p class=\"caption\">{}</p>{}</section>\n",
                figure.id,
                figure.title,
                save(figure.title),
                figure.caption,
                words::linked(&figure.body)
            );
        }
        let listed = words::list(&body);
        if !listed.is_empty() {
            contents += "<a href=\"#words\">Words</a>";
            body += &format!(
                "<section class=\"card wide\" id=\"words\"><h2>Words</h2><p class=\"caption\">What the heads of the \
                 tables mean.</p><dl class=\"lexicon\">{listed}</dl></section>\n"
            );
        }
        format!(
            "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n<meta name=\"viewport\" \
             content=\"width=device-width, initial-scale=1\">\n<title>{title}</title>\n\
             <style>\n{STYLE}</style>\n<style id=\"charts\">\n{CHART_STYLE}</style>\n</head>\n<body>\n<div \
             class=\"stripe\"><i></i><i></i><i></i><i></i></div>\n<main>\n<header><div class=\"eyebrow\">{eyebrow}<button \
             type=\"button\" id=\"theme\" hidden>light / dark</button></div>{header}<nav>{contents}</nav>\n<div \
             class=\"figures\">\n{body}</div>\n<footer>dalean {version}. All numbers come from {source}; nothing on this \
             page is loaded from elsewhere.</footer>\n</main>\n<script>\n{scripts}</script>\n</body>\n</html>\n",
            title = escape(&self.title),
            eyebrow = self.eyebrow,
            header = self.header,
            version = escape(self.version),
            source = self.source,
            scripts = SCRIPTS.concat(),
        )
    }
}

/// The page of a run.
pub(super) fn render(view: &RunView<'_>) -> String {
    Sheet {
        title: view.title.clone(),
        eyebrow: "dalean run report",
        header: [header(view), notices(view)].concat(),
        figures: figures::of(view),
        source: "the run's records",
        version: &view.timing.version,
    }
    .html()
}

/// Buttons that save a figure; the script shows them.
fn save(title: &str) -> String {
    let button = |format: &str| {
        format!(
            "<button type=\"button\" data-save=\"{}\" aria-label=\"{title} as {format}\">{format}</button>",
            format.to_lowercase()
        )
    };
    format!("<div class=\"save\" hidden>{}{}</div>", button("SVG"), button("PNG"))
}

fn header(view: &RunView<'_>) -> String {
    let shape: Vec<String> = shape(view).iter().map(ToString::to_string).collect();
    let mut facts = vec![escape(&view.data)];
    if !shape.is_empty() {
        facts.push(format!("<span class=\"nowrap\">{}</span>", shape.join("\u{202f}–\u{202f}")));
    }
    facts.push(format!("kernel {}", escape(&view.timing.kernel)));
    facts.push(match view.timing.threads {
        1 => "1 thread".into(),
        threads => format!("{threads} threads"),
    });
    format!(
        "<h1>{}</h1><p class=\"facts\">{}</p>\
         <div class=\"hero\"><div class=\"headline\">{}</div><div class=\"keys\">{}</div></div>{}</header>\n",
        escape(&view.title),
        facts.join(" · "),
        headline(view),
        keys(view),
        hash(view)
    )
}

/// Neurons of a stream, input first.
fn shape(view: &RunView<'_>) -> Vec<usize> {
    let Some(last) = view.last() else { return Vec::new() };
    let mut shape = Vec::new();
    for layer in view.layers() {
        if let Some(one) = last.pathways.iter().find(|one| one.layer == layer) {
            if shape.is_empty() {
                shape.push(one.shape[0]);
            }
            shape.push(one.shape[1]);
        }
    }
    shape
}

/// The mean return of the final test.
fn headline_of_policy(view: &RunView<'_>) -> String {
    let Some(test) = view.receipt.played() else {
        let status = escape(&view.receipt.status);
        return format!(
            "<div class=\"big none\">–</div><div class=\"what\">mean return</div><p>The final test has not been \
             played: the run is {status}.</p>"
        );
    };
    let episodes = &test.episodes;
    let [mean, least, most] = match episodes.return_range {
        Some(range) => range.map(significant),
        None => ["–"; 3].map(str::to_owned),
    };
    let how = if episodes.deterministic { "the likeliest action taken" } else { "actions drawn" };
    format!(
        "<div class=\"big\">{mean}</div><div class=\"what\">mean return</div><p>{} episodes from {least} to {most}, \
         {how}. State after epoch {}, the {} one, and {} steps.</p>",
        count(episodes.episodes()),
        test.epoch,
        escape(&test.select),
        count(test.steps)
    )
}

fn headline(view: &RunView<'_>) -> String {
    if view.last().is_some_and(|last| last.policy().is_some()) {
        return headline_of_policy(view);
    }
    let Some(test) = view.receipt.classified() else {
        let status = escape(&view.receipt.status);
        return format!(
            "<div class=\"big none\">–</div><div class=\"what\">test accuracy</div><p>The test set has not \
             been read: the run is {status}.</p>"
        );
    };
    let accuracy = match quotient(test.score.correct, test.score.total) {
        Some(fraction) => format!("{:.2}<small>\u{202f}%</small>", 100.0 * fraction),
        None => "–".into(),
    };
    let why = match test.select.as_str() {
        "last" => "the last one".into(),
        "best_validation" => "chosen by its validation score".into(),
        other => format!("chosen by {}", escape(&other.replace('_', " "))),
    };
    format!(
        "<div class=\"big\">{accuracy}</div><div class=\"what\">test accuracy</div><p>{} of {} right. State \
         after epoch {}, {why}; the test set is read once.</p>",
        count(test.score.correct),
        count(test.score.total),
        test.epoch
    )
}

fn keys(view: &RunView<'_>) -> String {
    let key = |name: &str, value: &str, note: &str| {
        format!(
            "<div class=\"key\"><div class=\"name\">{name}</div><div class=\"value\">{value}</div>\
             <div class=\"note\">{note}</div></div>"
        )
    };
    let Some(last) = view.last() else {
        return key("epochs", "–", "no record yet");
    };
    // Validation of the state that was tested, or else of the last.
    let tested = view.receipt.test.as_ref().map(TestOutcome::epoch);
    let read = view.epochs.iter().find(|record| Some(record.epoch) == tested).unwrap_or(last);
    let validation =
        read.validation().and_then(|score| Some((quotient(score.correct, score.total)?, score)));
    let mut out = match validation {
        _ if last.policy().is_some() => key_of_policy(last, &key),
        Some((fraction, score)) => key(
            "validation",
            &percent(fraction, 2),
            &format!("{} of {}, epoch {}", count(score.correct), count(score.total), read.epoch),
        ),
        None => key("validation", "–", "no validation split"),
    };
    let floor = last.pathways.iter().map(|one| one.floor).sum();
    let cells = last.pathways.iter().map(|one| one.cells).sum();
    out +=
        &key("floor fraction", &percent_of(floor, cells, 1), &format!("of {} cells", count(cells)));
    out += &key("epochs", &last.epoch.to_string(), &format!("{} updates", count(last.updates)));
    out += &key("learning took", &seconds(view.timing.train_seconds()), "wall clock");
    out += &view.cost.map_or_else(String::new, |cost| chip(cost, &key));
    let balance = last.layers.iter().map(|layer| {
        let [excite, inhibit] = layer.levels;
        let share = quotient(excite, excite.saturating_add(inhibit)).unwrap_or(0.5);
        format!(
            "<div class=\"balance\" data-tip=\"excitatory levels {}&#10;inhibitory levels {}\">\
             <span>layer {}</span><div class=\"scale\"><i style=\"width:{}%\"></i></div><b>{}</b></div>",
            count(excite),
            count(inhibit),
            layer.layer,
            place(100.0 * share),
            ratio(quotient(excite, inhibit))
        )
    });
    let balance: String = balance.collect();
    if !balance.is_empty() {
        out += &format!(
            "<div class=\"key wide\"><div class=\"name\">E/I by layer <span>stored levels, excitation over \
             inhibition</span></div>{balance}</div>"
        );
    }
    out
}

/// Returns after the last epoch.
fn key_of_policy(last: &EpochRecord, key: &dyn Fn(&str, &str, &str) -> String) -> String {
    let Some(outcome) = last.policy() else { return String::new() };
    let number = |value: Option<f64>| value.map_or_else(|| "–".into(), significant);
    let evaluated = format!("{} episodes, epoch {}", outcome.evaluation.episodes(), last.epoch);
    let learning = format!("{} episodes of the last epoch", count(outcome.returns.count));
    [
        key("evaluated", &number(outcome.evaluation.mean()), &evaluated),
        key("while learning", &number(outcome.episodic_return), &learning),
    ]
    .concat()
}

/// Time and energy of the run on its chip.
fn chip(cost: &Cost, key: &dyn Fn(&str, &str, &str) -> String) -> String {
    let mut out = String::new();
    let key = |name: &str, value: &str, note: &str| {
        key(name, value, note).replacen("class=\"key\"", "class=\"key half\"", 1)
    };
    if let (Some(cycles), Some(seconds)) = (cost.cycles, cost.seconds) {
        let note = format!("{} cycles", short(cycles));
        out += &key("time on the chip", &prefixed(seconds, "s"), &note);
    }
    if let Some(energy) = cost.energy.filter(|energy| energy.priced > 0) {
        let [low, typical, high] = energy.joules.map(|joules| prefixed(joules, "J"));
        let share = 100.0 * cost.assumed_share;
        let (name, parts) = match energy.priced_words() {
            Some(parts) => ("energy on the chip, at least", format!("{parts}; ")),
            None => ("energy on the chip", String::new()),
        };
        let note =
            format!("{parts}{low} to {high}; {share:.0}\u{202f}% leans on assumed constants");
        out += &key(name, &typical, &note);
    }
    out
}

fn hash(view: &RunView<'_>) -> String {
    let Some(last) = view.last() else { return String::new() };
    let hash = escape(&last.state_hash);
    format!(
        "<div class=\"hash\"><div><div class=\"name\">state hash after epoch {}</div><code class=\"head\">{}</code></div>\
         <input readonly value=\"{hash}\" aria-label=\"State hash after the last epoch\" size=\"64\">\
         <button type=\"button\" id=\"copy\" hidden>copy</button><p>Same bits on any machine. \
         <code>dalean verify RUN</code> runs it again and compares.</p></div>",
        last.epoch,
        hash_head(&hash)
    )
}

/// Warnings, and the effects that the engine does not simulate.
fn notices(view: &RunView<'_>) -> String {
    let mut out = String::new();
    if view.receipt.status != "finished" {
        out +=
            &format!("<li>The run is <b>{}</b>, not finished.</li>", escape(&view.receipt.status));
    }
    for warning in view.warnings {
        out += &format!("<li>{}</li>", escape(warning));
    }
    if !view.absent.is_empty() {
        let words = escape(&absent_words(view.absent));
        out += &format!("<li><a href=\"#absent\">{words}</a></li>");
    }
    if out.is_empty() { out } else { format!("<ul class=\"notices\">{out}</ul>\n") }
}
