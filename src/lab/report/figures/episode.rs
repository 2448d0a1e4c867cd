//! An episode of the policy, played with the state that was tested.

use super::Figure;
use crate::lab::report::RunView;
use crate::lab::report::number::significant;

pub(super) fn draw(view: &RunView<'_>) -> Option<Figure> {
    let film = view.film?;
    let last = film.frames.last()?;
    Some(Figure {
        id: "episode",
        title: "An episode",
        caption: format!(
            "Episode {} of the evaluation, played with the state that was tested: {} steps, return {}. <code>dalean watch \
             RUN</code> shows others.",
            film.episode,
            film.steps,
            significant(last.total)
        ),
        body: film.svg(),
        wide: true,
    })
}
