//! Where numbers hit a rail: converters, tables, error words, gates.

use super::{Figure, per_epoch, total};
use crate::lab::report::RunView;
use crate::lab::report::chart::spark;
use crate::lab::report::number::{count, escape, float, percent, quotient};

/// Event, what it is called, and the event it is a part of.
const KINDS: [(&str, &str, &str); 4] = [
    ("saturated_conversions", "Conversions", "conversions"),
    ("saturated_look_ups", "Table look-ups", "look_ups"),
    ("saturated_errors", "Error words", "bus_words"),
    ("saturated_gates", "Gates", "multiplies"),
];

pub(super) fn draw(view: &RunView<'_>) -> Option<Figure> {
    let end = view.last()?;
    let mut body = String::new();
    for phase in end.events.keys() {
        let rows: String = KINDS
            .iter()
            .filter(|(.., whole)| total(end, phase, whole) > 0)
            .map(|(event, name, whole)| {
                let counts = per_epoch(view, phase, event);
                let values: Vec<f64> = counts.iter().map(|&(_, count)| float(count)).collect();
                let (some, all) = (total(end, phase, event), total(end, phase, whole));
                let share = match quotient(some, all) {
                    // Few per million still deserve digits.
                    Some(0.0) => "0".into(),
                    Some(share) if share < 5e-8 => "&lt; 0.1 ppm".into(),
                    Some(share) if share < 1e-4 => format!("{:.1} ppm", share * 1e6),
                    Some(share) => percent(share, 2),
                    None => "–".into(),
                };
                let last = counts.last().map_or("–".into(), |&(_, last)| count(last));
                format!(
                    "<tr><th scope=\"row\">{name}</th><td>{}</td><td>{share}</td><td>{last}</td>\
                 <td>{}</td></tr>",
                    count(some),
                    spark(&values, "var(--d)")
                )
            })
            .collect();
        if rows.is_empty() {
            continue;
        }
        body += &format!(
            "<tr class=\"group\"><th colspan=\"5\" scope=\"rowgroup\">{}</th></tr>{}",
            escape(phase),
            rows
        );
    }
    if body.is_empty() {
        return None;
    }
    Some(Figure {
        id: "saturation",
        title: "Saturations",
        caption: "Values that a clamp changed, by kind and phase; the share is of all such events \
                  (conversions, look-ups, words on the error bus, multiplications)."
            .into(),
        body: format!(
            "<div class=\"scroll\"><table><thead><tr><th>Kind</th><th>total</th><th>share</th>\
             <th>last epoch</th><th>over epochs</th></tr></thead><tbody>{body}</tbody></table></div>"
        ),
        wide: false,
    })
}
