//! Every pathway at the end, in numbers.

use super::{Figure, swatch};
use crate::lab::report::RunView;
use crate::lab::report::number::{count, percent_of, quotient, ratio, short};
use crate::learn::statistics::PathwayRecord;

pub(super) fn draw(view: &RunView<'_>) -> Option<Figure> {
    let last = view.last()?;
    if last.pathways.is_empty() {
        return None;
    }
    let rows: String = last.pathways.iter().map(row).collect();
    let heads = [
        "pathway",
        "shape",
        "cells",
        "on floor",
        "level 0",
        "pruned",
        "mean level",
        "births",
        "deaths",
        "idle rows",
        "columns",
        "tiles",
        "pulses",
        "effective",
        "bounded",
    ];
    let heads = heads.map(|head| format!("<th scope=\"col\">{head}</th>")).concat();
    Some(Figure {
        id: "pathways",
        title: "Pathways in numbers",
        caption: format!(
            "State after epoch {}, pulses over the whole training. Idle: all cells on the floor.",
            last.epoch
        ),
        body: format!(
            "<div class=\"scroll\"><table class=\"stack\"><thead><tr>{heads}</tr></thead><tbody>{rows}</tbody></table></div>"
        ),
        wide: true,
    })
}

fn row(one: &PathwayRecord) -> String {
    let event = |name: &str| one.training.get(name).copied().unwrap_or(0);
    let idle = |[idle, all]: [u64; 2]| format!("{}/{}", count(idle), count(all));
    let cells = [
        format!("{}×{}", one.shape[0], one.shape[1]),
        count(one.cells),
        percent_of(one.floor, one.cells, 1),
        percent_of(one.zero, one.cells, 1),
        percent_of(one.pruned, one.cells, 1),
        ratio(quotient(one.levels, one.cells)),
        count(one.births),
        count(one.deaths),
        idle(one.idle[0]),
        idle(one.idle[1]),
        idle(one.idle[2]),
        short(event("pulses_attempted")),
        percent_of(event("pulses_effective"), event("pulses_attempted"), 1),
        percent_of(event("bounded"), event("requested"), 1),
    ];
    let cells = cells.map(|cell| format!("<td>{cell}</td>")).concat();
    format!("<tr><th scope=\"row\">{} {}</th>{cells}</tr>", one.layer, swatch(one))
}
