//! The page of an analysis: how large updates are by layer and epoch, and how much they agree with the gradient.

use super::chart::{Chart, Series};
use super::colour::hue;
use super::figures::Figure;
use super::number::escape;
use super::page::Sheet;
use super::scale::Axis;
use crate::lab::analysis::{Analysed, LayerAnalysis};

/// The page, complete: of so many examples.
#[must_use]
pub fn analysis_page(name: &str, examples: u16, states: &[Analysed], version: &str) -> String {
    let header = format!(
        "<h1>Updates and the gradient</h1><p class=\"facts\">{}: {examples} examples, {} states.</p></header>\n",
        escape(name),
        states.len()
    );
    Sheet {
        title: format!("Updates of {name}"),
        eyebrow: "dalean analysis",
        header,
        figures: [sizes(states), agreements(states)].into_iter().flatten(),
        source: "states of this run, learnt again where they are not kept",
        version,
    }
    .html()
}

/// Epochs of the first and the last state.
fn span(states: &[Analysed]) -> Option<(u32, u32)> {
    Some((states.first()?.epoch, states.last()?.epoch))
}

/// What a layer has over the states.
fn points(
    states: &[Analysed],
    layer: usize,
    of: impl Fn(&LayerAnalysis) -> Option<f64>,
) -> Vec<(f64, f64)> {
    let at = |state: &Analysed| {
        let one = state.layers.iter().find(|one| one.layer == layer)?;
        Some((f64::from(state.epoch), of(one)?))
    };
    states.iter().filter_map(at).collect()
}

fn sizes(states: &[Analysed]) -> Option<Figure> {
    let (first, last) = span(states)?;
    let layers = states.first()?.layers.iter().map(|one| one.layer);
    let gate = |one: &LayerAnalysis| one.gate.filter(|&gate| gate > 0.0);
    let lines = layers.map(|layer| {
        Series::new(&format!("layer {layer}"), hue(layer), points(states, layer, gate))
    });
    let lines: Vec<_> = lines.filter(|line| !line.points.is_empty()).collect();
    let values = || lines.iter().flat_map(|line| &line.points).map(|point| point.1);
    let (low, high) = (values().fold(f64::MAX, f64::min), values().fold(0.0, f64::max));
    if lines.is_empty() {
        return None;
    }
    let y = Axis::powers(0.8 * low, 1.25 * high, "gate (log scale)");
    let mut chart = Chart::new(560.0, 320.0, 130.0, Axis::epochs(first, last), y);
    chart.series(&lines, |gate| format!("{gate:.3}"));
    Some(Figure {
        id: "sizes",
        title: "How large updates are",
        caption: "Root mean square of the gates by layer: what an update multiplies drives by, error word times slope; 1 is a \
                  full word and the steepest slope. What falls from layer to layer is the slope: words are the same."
            .into(),
        body: chart.finish("Root mean square of gates by layer over epochs"),
        wide: false,
    })
}

fn agreements(states: &[Analysed]) -> Option<Figure> {
    let (first, last) = span(states)?;
    let mut body = String::new();
    for one in &states.first()?.layers {
        let own = Series::new("own", hue(0), points(states, one.layer, |one| one.agreement));
        let routes = one.routes.iter().enumerate().map(|(at, (name, _))| {
            let of = |one: &LayerAnalysis| one.routes.get(at).and_then(|(_, value)| *value);
            Series::new(name, hue(at + 1), points(states, one.layer, of)).numbered(at + 1)
        });
        let lines: Vec<_> =
            std::iter::once(own).chain(routes).filter(|line| !line.points.is_empty()).collect();
        if lines.is_empty() || one.routes.is_empty() {
            continue;
        }
        let values = lines.iter().flat_map(|line| &line.points).map(|point| point.1);
        let low = values.fold(0.0, f64::min);
        let y = Axis::round(low.min(-0.1) - 0.05, 1.0, "agreement");
        let mut chart = Chart::new(480.0, 300.0, 170.0, Axis::epochs(first, last), y);
        chart.rule(0.0, "none");
        chart.series(&lines, |cos| format!("{cos:.2}"));
        let alt =
            format!("Agreement with the gradient in layer {} by route over epochs", one.layer);
        body += &format!("<div><h3>layer {}</h3>{}</div>", one.layer, chart.finish(&alt));
    }
    (!body.is_empty()).then(|| Figure {
        id: "agreement",
        title: "Agreement with the gradient",
        caption: "Cosine of the angle between the sums of an update and the gradient of the same errors through the same \
                  levels, over all cells of a layer: on the run's own route, and had its units heard errors otherwise. Outputs \
                  agree by construction and are left out."
            .into(),
        body: format!("<div class=\"halves\">{body}</div>"),
        wide: true,
    })
}
