//! What real chips do and the run did without: the whole list, with what the model says of its own chip.

use std::fmt::Write as _;

use super::Figure;
use crate::lab::report::RunView;
use crate::lab::report::number::escape;

pub(super) fn draw(view: &RunView<'_>) -> Option<Figure> {
    if view.absent.is_empty() {
        return None;
    }
    let mut rows = String::new();
    for one in view.absent {
        let cell = |text: Option<&str>| text.map_or_else(|| "–".into(), escape);
        let _ = write!(
            rows,
            "<tr><th scope=\"row\">{}</th><td>{}</td><td>{}</td><td>{}</td></tr>",
            escape(&one.name()),
            cell(one.real),
            cell(one.instead),
            cell(one.chip.as_deref())
        );
    }
    Some(Figure {
        id: "absent",
        title: "Not simulated",
        caption: "The program's own list: what real chips have, what was simulated in its place, and what the model says of \
                  its chip. An accuracy above is that of the levels, window, converters and writes, not of these."
            .into(),
        body: format!(
            "<div class=\"scroll\"><table class=\"stack one wordy\"><thead><tr><th scope=\"col\">Effect</th><th scope=\"col\">real \
             chips have</th><th scope=\"col\">simulated</th><th scope=\"col\">this chip</th></tr></thead><tbody>{rows}\
             </tbody></table></div>"
        ),
        wide: true,
    })
}
