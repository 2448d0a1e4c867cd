//! Where the joules go: training by component, epoch by epoch, and the whole run cut in five ways, with bounds.

use std::fmt::Write as _;

use super::{Figure, per_epoch, span};
use crate::lab::config::Kind;
use crate::lab::price::{Cost, EnergySplit, EnergyTotal, Group, PieceKind, prefixed};
use crate::lab::report::RunView;
use crate::lab::report::chart::{Chart, Series};
use crate::lab::report::number::{count, escape, float, percent, place, share, size};
use crate::lab::report::scale::{Axis, Curve, Scale, round};

/// Components drawn as lines, each with its own colour and dashes.
const LINES: [(&str, bool); 4] =
    [("var(--a)", false), ("var(--b)", true), ("var(--d)", false), ("var(--e)", true)];
/// Constants listed.
const CONSTANTS: usize = 6;
/// Most decades of the scale of bounds; what lies below is drawn at its end.
const DECADES: f64 = 9.0;

pub(super) fn draw(view: &RunView<'_>) -> Option<Figure> {
    let cost = view.cost?;
    let energy = cost.energy?;
    let joules = energy.joules;
    if cost.components.is_empty() {
        return None;
    }
    let split: Vec<Group> = cost.split.iter().map(of_class).collect();
    let cuts = [
        ("Split", &split),
        ("Component", &cost.components),
        ("Phase", &cost.phases),
        ("Operation", &cost.operations),
        ("Layer", &cost.layers),
        ("Pathway", &cost.pathways),
    ];
    let scale = Decades::of(cuts.iter().flat_map(|(_, groups)| groups.iter()));
    let table =
        |&(name, groups): &(&str, &Vec<Group>)| groups_table(name, groups, joules[1], &scale);
    // the two halves of the figure come out about as long as one another
    let (left, right) = (cuts[..2].iter().map(table), cuts[2..].iter().map(table));
    let (left, right) = (left.collect::<String>(), right.collect::<String>());
    let [low, typical, high] = joules.map(|joules| prefixed(joules, "J"));
    let missing = cost.missing.iter().filter(|one| one.class.is_some());
    let missing: Vec<_> = missing.map(|one| one.what.replace('_', " ")).collect();
    let missing = match missing.is_empty() {
        true => String::new(),
        false => format!(" Without a price: {}.", escape(&missing.join(", "))),
    };
    let (least, parts) = match energy.priced_words() {
        Some(parts) => ("at least ", format!(" ({parts})")),
        None => ("", String::new()),
    };
    let sums = cost.sums_share.map_or_else(String::new, |share| {
        format!(
            " <b>{}</b> is memory of the digital sums: with <code>learning.mode = \"accumulate\"</code> a product is \
             added to a sum of 32 bits, 64 bits out and in; <code>online</code> and <code>replay</code> do without in dense layers.",
            percent(share, 0)
        )
    });
    Some(Figure {
        id: "energy",
        title: "Energy",
        caption: format!(
            "Counts of the ledger times constants of the hardware model: {least}<b>{typical}</b>{parts} for the whole run, the final \
             test aside, bounds {low} to {high}; <b>{}</b> leans on assumed constants. Each bound adds all low or all high \
             constants: the line spans them, the dot is the typical value. Static power belongs to no layer, pathway or \
             operation; what a target does for both of its banks is charged to its excitatory pathway.{sums}{missing}",
            percent(cost.assumed_share, 0)
        ),
        body: format!(
            "{}<div class=\"halves\"><div>{}{left}</div><div>{}{right}</div></div>",
            pieces(cost),
            lines(view, cost),
            constants(cost)
        ),
        wide: true,
    })
}

/// A class as a group like others.
fn of_class(split: &EnergySplit) -> Group {
    let least = if split.total.whole().is_none() { ", at least" } else { "" };
    Group { name: format!("{}{least}", split.class.name()), joules: split.total.joules }
}

/// What an image takes, or an update and a decision.
fn pieces(cost: &Cost) -> String {
    let mut rows = String::new();
    let classes: Vec<_> = cost.split.iter().map(|split| split.class).collect();
    let joules = |total: &EnergyTotal| match (total.priced, total.whole()) {
        (0, _) => "–".into(),
        (_, Some(joules)) => prefixed(joules[1], "J"),
        (_, None) => format!("≥ {}", prefixed(total.joules[1], "J")),
    };
    for one in &cost.per_piece {
        let _ = write!(
            rows,
            "<tr><th scope=\"row\">to {}</th><td>{}</td><td>{}</td><td><b>{}</b></td>",
            one.doing(),
            count(one.count),
            one.seconds.map_or("–".into(), |seconds| prefixed(seconds, "s")),
            joules(&one.total)
        );
        for class in &classes {
            let of_class = one.split.iter().find(|split| split.class == *class);
            let text = of_class.map_or("–".into(), |split| joules(&split.total));
            let _ = write!(rows, "<td>{text}</td>");
        }
        rows += "</tr>";
    }
    if rows.is_empty() {
        return rows;
    }
    let heads = classes.iter().map(|class| format!("<th scope=\"col\">{}</th>", class.name()));
    let of_images = cost.per_piece.iter().all(|one| one.kind == PieceKind::Image);
    let [takes, pieces] =
        if of_images { ["An image takes", "images"] } else { ["It takes", "how often"] };
    format!(
        "<div class=\"scroll\"><table class=\"stack\"><thead><tr><th scope=\"col\">{takes}</th>\
         <th scope=\"col\">{pieces}</th><th scope=\"col\">time</th><th scope=\"col\">energy</th>{}</tr></thead>\
         <tbody>{rows}</tbody></table></div>",
        heads.collect::<String>()
    )
}

/// Training, epoch by epoch.
fn lines(view: &RunView<'_>, cost: &Cost) -> String {
    let events = cost.components.iter().filter_map(|group| {
        let each = cost.each.iter().find(|(_, component, _)| *component == group.name)?;
        let counts = per_epoch(view, "training", each.0);
        // what only happens before the first update is no line
        let some = counts.iter().any(|&(_, count)| count > 0);
        some.then(|| (group.name.replace('_', " "), counts, each.2))
    });
    let series: Vec<Series> = events
        .zip(LINES)
        .map(|((name, counts, joules), (hue, dashed))| {
            let points =
                counts.into_iter().map(|(epoch, count)| (epoch, 1e12 * joules * float(count)));
            Series::new(&name, hue, points.collect()).dashed(dashed)
        })
        .collect();
    let Some((first, last)) = span(view) else { return String::new() };
    if series.iter().all(|one| one.points.is_empty()) {
        return String::new();
    }
    let values = series.iter().flat_map(|one| &one.points).map(|point| point.1);
    let y = Axis::picojoules(values, "energy per epoch (log scale)");
    let start = series.iter().find_map(|one| one.points.first()).map_or(first, |p| p.0 as u32);
    let mut chart = Chart::new(540.0, 270.0, 168.0, Axis::epochs(start, last), y);
    chart.series(&series, |value| prefixed(1e-12 * value, "J"));
    format!(
        "<h4>Training, at typical constants, without static power</h4>{}",
        chart.finish("Energy of training per epoch, by component")
    )
}

/// A log scale of joules, the same for all bounds.
struct Decades {
    from: f64,
    to: f64,
}

impl Decades {
    fn of<'a>(groups: impl Iterator<Item = &'a Group>) -> Self {
        let (mut low, mut high) = (f64::INFINITY, f64::MIN_POSITIVE);
        for value in groups.flat_map(|group| group.joules).filter(|&value| value > 0.0) {
            (low, high) = (low.min(value), high.max(value));
        }
        let to = high.log10().ceil();
        Self { from: low.log10().floor().clamp(to - DECADES, to - 1.0), to }
    }

    fn place(&self, joules: f64) -> f64 {
        let [from, to] = [self.from, self.to].map(|power| 10f64.powf(power));
        WIDTH * Scale { curve: Curve::Log, from, to }.fraction(joules)
    }

    /// Grid lines at the decades.
    fn grid(&self) -> String {
        let decades = self.to - self.from;
        let lines = (0..=decades as usize).map(|at| {
            let x = place(WIDTH * size(at) / decades);
            format!("M{x} 0V{HEIGHT}")
        });
        format!("<path class=\"grid\" d=\"{}\"/>", lines.collect::<String>())
    }

    /// The ends in words.
    fn ends(&self) -> String {
        let [from, to] = [self.from, self.to].map(|power| round(10f64.powf(power)));
        format!("<span class=\"ends\"><span>{from}</span><span>log</span><span>{to}</span></span>")
    }
}

const WIDTH: f64 = 128.0;
const HEIGHT: f64 = 16.0;

fn groups_table(name: &str, groups: &[Group], total: f64, scale: &Decades) -> String {
    let mut rows = String::new();
    for group in groups {
        let [low, typical, high] = group.joules;
        let part = if total > 0.0 { share(typical / total) } else { "–".into() };
        let [a, b, c] = group.joules.map(|joules| place(scale.place(joules)));
        let bounds = format!(
            "<svg class=\"bounds\" viewBox=\"0 0 {WIDTH} {HEIGHT}\" width=\"{WIDTH}\" height=\"{HEIGHT}\" aria-hidden=\"true\">\
             {}<path class=\"span\" d=\"M{a} 8H{c}\"/><circle class=\"typical\" cx=\"{b}\" cy=\"8\" r=\"4\"/></svg>",
            scale.grid()
        );
        let [low, typical, high] = [low, typical, high].map(|joules| prefixed(joules, "J"));
        let _ = write!(
            rows,
            "<tr><th scope=\"row\">{}</th><td>{bounds}</td><td>{low}</td><td><b>{typical}</b></td><td>{high}</td>\
             <td>{part}</td></tr>",
            escape(&group.name.replace('_', " "))
        );
    }
    if rows.is_empty() {
        return rows;
    }
    format!(
        "<div class=\"scroll\"><table class=\"joules\"><thead><tr><th scope=\"col\">{name}</th><th scope=\"col\">{}</th>\
         <th scope=\"col\">low</th><th scope=\"col\">typical</th><th scope=\"col\">high</th><th scope=\"col\">share</th></tr>\
         </thead><tbody>{rows}</tbody></table></div>",
        scale.ends()
    )
}

/// The constants that the typical total leans on most, and how far to trust them.
fn constants(cost: &Cost) -> String {
    let mut rows = String::new();
    for one in cost.constants.iter().take(CONSTANTS).filter(|one| one.share > 0.0) {
        let kind = match one.kind {
            Kind::Measured => "measured",
            Kind::Fitted => "fitted",
            Kind::Assumed => "<b>assumed</b>",
        };
        let _ = write!(
            rows,
            "<tr><th scope=\"row\"><code>{}</code></th><td class=\"meter\"><i style=\"width:{}%\"></i></td><td>{}</td>\
             <td>{kind}</td></tr>",
            escape(&one.key),
            place(100.0 * one.share),
            share(one.share)
        );
    }
    if rows.is_empty() {
        return rows;
    }
    format!(
        "<div class=\"scroll\"><table class=\"meters\"><thead><tr><th scope=\"col\">Leans on</th><th scope=\"col\" colspan=\"2\">\
         of the typical total</th><th scope=\"col\">is</th></tr></thead><tbody>{rows}</tbody></table></div>"
    )
}
