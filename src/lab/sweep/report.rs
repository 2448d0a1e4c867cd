//! The page of a sweep and its figures, beside the runs they link to.

use std::io::Write;
use std::path::{Path, PathBuf};

use super::{Results, SweepError, results};
use crate::lab::report::sweep::{Learning, SweepView, compared, figures, html, png, text, wanted};
use crate::lab::store::folder::{names, read_text};
use crate::lab::store::index::{Store, StoreError, SweepRecord};
use crate::lab::store::place::{clear_parts, make_folder, write_whole};
use crate::lab::store::record::Outcome;

/// Files that were written.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SweepPage {
    /// The page.
    pub page: PathBuf,
    /// Figures for papers.
    pub figures: Vec<PathBuf>,
    /// The curves as a table for the terminal, where there is something to show.
    pub text: Option<String>,
    /// Points.
    pub points: usize,
    /// Of these, finished.
    pub finished: usize,
    /// Of these, finished once, but their folders are gone.
    pub lost: usize,
    /// What real chips do and its runs did not: `key = text`.
    pub not_simulated: Vec<String>,
}

/// Draws `STORE/NAME.html` and, if `pictures` are wanted, `STORE/figures/NAME-*.svg` and `.png`.
///
/// # Errors
/// When the index or the system refuses.
pub fn report(
    store: &Store,
    record: &SweepRecord,
    pictures: bool,
) -> Result<SweepPage, SweepError> {
    let found = results(store, record)?;
    let none = Learning::default();
    let learning = learning(store, &found, &wanted(&view(&found, &none)));
    let view = view(&found, &learning);
    let page = store.path().join(format!("{}.html", record.name));
    write(&page, html(&view).as_bytes())?;
    let mut made = Vec::new();
    if pictures {
        let folder = store.path().join("figures");
        let fail = |error| StoreError::Io { doing: "make folder", path: folder.clone(), error };
        make_folder(&folder).map_err(fail)?;
        clear_parts(&folder);
        for figure in figures(&view) {
            let base = format!("{}-{}", record.name, figure.name);
            for (ending, bytes) in
                [("svg", figure.svg.clone().into_bytes()), ("png", png(&figure.svg))]
            {
                let path = folder.join(format!("{base}.{ending}"));
                write(&path, &bytes)?;
                made.push(path);
            }
        }
    }
    Ok(SweepPage {
        page,
        text: match (text(&view), compared(&view)) {
            (Some(curves), Some(compared)) => Some(format!("{curves}\n\n{compared}")),
            (curves, compared) => curves.or(compared),
        },
        figures: made,
        points: found.table.len(),
        finished: found.finished,
        lost: found.lost,
        not_simulated: found.not_simulated.clone(),
    })
}

/// The line of a record that says what a run knew; all the rest is passed over unread.
#[derive(Debug, serde::Deserialize)]
struct Known {
    epoch: u32,
    outcome: Outcome,
}

/// What the runs of some rows knew after each epoch. A run whose records cannot be read is one without: its row says by
/// itself what came out of it.
fn learning(store: &Store, found: &Results, rows: &[usize]) -> Learning {
    let rows_of = vec![Vec::new(); found.table.len()];
    let mut learning = Learning { label: String::new(), shares: true, rows: rows_of };
    let (Some(keys), Some(status)) = (found.table.column("key"), found.table.column("status"))
    else {
        return learning;
    };
    let (mut validated, mut acted) = (false, false);
    for &row in rows {
        let finished = status.values.text(row).as_deref() == Some("finished");
        let Some(key) = keys.values.text(row).filter(|_| finished) else { continue };
        let text = read_text(&store.folder(&key), names::METRICS).unwrap_or_default();
        let known = text.lines().map_while(|line| serde_json::from_str::<Known>(line).ok());
        learning.rows[row] = known
            .filter_map(|known| {
                let of = match &known.outcome {
                    Outcome::Classify(outcome) => {
                        validated |= outcome.validation.is_some_and(|score| score.total > 0);
                        let score = known.outcome.answers().filter(|score| score.total > 0)?;
                        score.fraction()
                    }
                    Outcome::Policy(outcome) => {
                        acted = true;
                        outcome.evaluation.mean()?
                    }
                };
                Some((known.epoch, of))
            })
            .collect();
    }
    let label = match (acted, validated) {
        (true, _) => "return without learning",
        (false, true) => "validation accuracy",
        (false, false) => "accuracy while learning",
    };
    (learning.label, learning.shares) = (label.into(), !acted);
    learning
}

fn view<'a>(found: &'a Results, learning: &'a Learning) -> SweepView<'a> {
    SweepView {
        name: &found.sweep.name,
        title: &found.sweep.title,
        about: &found.sweep.about,
        table: &found.table,
        axes: &found.axes,
        figures: found.figures.clone(),
        learning,
        refused: &found.refused,
        not_simulated: &found.not_simulated,
        version: env!("CARGO_PKG_VERSION"),
    }
}

fn write(path: &Path, bytes: &[u8]) -> Result<(), SweepError> {
    let fail = |error| StoreError::Io { doing: "write", path: path.into(), error };
    write_whole(path, |file| file.write_all(bytes)).map_err(fail)?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use crate::lab::report::sweep::meaning;
    use crate::lab::sweep::RESULTS;
    use crate::lab::table::{Column, Role, Values};

    #[test]
    fn every_result_says_what_it_means() {
        let silent = RESULTS.iter().filter(|column| column.name != "grown").filter(|column| {
            let values = Values::Whole(vec![]);
            let (name, label, unit) = (column.name.into(), column.label.into(), column.unit);
            meaning(&Column { name, label, unit, role: Role::Result, values }).is_empty()
        });
        let silent: Vec<_> = silent.map(|column| column.name).collect();
        assert_eq!(silent, Vec::<&str>::new(), "add a line to src/lab/report/words.rs");
    }
}
