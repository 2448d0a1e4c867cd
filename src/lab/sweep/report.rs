//! The page of a sweep and its figures, beside the runs they link to.

use std::io::Write;
use std::path::{Path, PathBuf};

use super::{Results, SweepError, results};
use crate::lab::report::sweep::{SweepView, figures, html, png, text};
use crate::lab::store::index::{Store, StoreError, SweepRecord};
use crate::lab::store::place::{clear_parts, make_folder, write_whole};

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
    let view = view(&found);
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
        text: text(&view),
        figures: made,
        points: found.table.len(),
        finished: found.finished,
        lost: found.lost,
    })
}

fn view(found: &Results) -> SweepView<'_> {
    SweepView {
        name: &found.sweep.name,
        title: &found.sweep.title,
        about: &found.sweep.about,
        table: &found.table,
        axes: &found.axes,
        figures: found.figures.clone(),
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
