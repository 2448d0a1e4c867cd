//! A measured device beside its model: conductance pulse by pulse, and steps over the window.

use super::chart::Chart;
use super::colour::hue;
use super::number::size;
use super::scale::Axis;
use super::sweep::sheet;
use crate::lab::measure::MeasuredDevice;

/// Reads of the first device that are drawn.
const READS_MAX: usize = 400;
/// Width and height of a chart.
const CHART: [f64; 2] = [520.0, 330.0];
/// Room for the key.
const KEY: f64 = 150.0;

/// The figure as a stand-alone picture on white.
#[must_use]
pub fn device_figure(of: &MeasuredDevice) -> String {
    let [wide, high] = CHART;
    let body = conductances(of).part(0.0, 0.0) + &steps(of).part(wide + 20.0, 0.0);
    let says = format!(
        "Conductance pulse by pulse and steps over the window, measured ({}) and by the proposed curve, {}",
        of.file,
        of.best().response.name()
    );
    sheet([2.0 * wide + 20.0, high], &says, &body)
}

/// Of the first device, what was read and what its model does from the beginning of each row.
fn conductances(of: &MeasuredDevice) -> Chart {
    let steps = of.best().steps();
    let [floor, ceiling] = of.ends[0];
    let own = ceiling - floor;
    let mut rows = vec![];
    let mut read = 0;
    for row in of.rows.iter().filter(|row| row.device == 0) {
        if read >= READS_MAX {
            break;
        }
        let mut x = (row.start - floor) / own;
        let (mut seen, mut walked) = (vec![(size(read), row.start)], vec![(size(read), row.start)]);
        for pulse in row.pulses.iter().take(READS_MAX - read) {
            read += 1;
            let side = usize::from(!pulse.rises);
            let step = steps(x)[side] * of.factors[0][side] * f64::from(pulse.count) / own;
            x = (if pulse.rises { x + step } else { x - step }).clamp(0.0, 1.0);
            seen.push((size(read), pulse.to));
            walked.push((size(read), floor + x * own));
        }
        read += 1;
        rows.push((seen, walked));
    }
    let name = &of.devices[0];
    let name = if name.is_empty() { String::new() } else { format!(" of device {name}") };
    let x = Axis::round(0.0, size(read.max(2) - 1), &format!("reads{name}"));
    let values = rows.iter().flat_map(|(seen, walked)| seen.iter().chain(walked)).map(|at| at.1);
    let (low, high) =
        values.fold((0.0, 1.0), |(low, high), g| (f64::min(low, g), f64::max(high, g)));
    let y = Axis::round(low, high, "conductance, windows");
    let mut chart = Chart::framed(CHART, [24.0, KEY], x, y);
    chart.heading("Pulse by pulse");
    for (seen, walked) in &rows {
        chart.line(walked, hue(0), "line", 0);
        for &at in seen {
            chart.marker(at, 0, 1.6, hue(6), "dot");
        }
    }
    let entries =
        [(0, hue(6), "measured".to_owned()), (0, hue(0), of.best().response.name().into())];
    chart.key("conductance", entries.into_iter(), false);
    chart
}

/// Mean steps up and down over the window.
fn steps(of: &MeasuredDevice) -> Chart {
    let steps = of.best().steps();
    let model = |side: usize| {
        let at = |i: u32| (f64::from(i) / 100.0, 100.0 * steps(f64::from(i) / 100.0)[side]);
        (0..=100).map(at).collect::<Vec<_>>()
    };
    let measured = |side: usize| {
        let last = size(of.steps[side].len() - 1);
        let knots = of.steps[side].iter().enumerate();
        knots.map(move |(at, step)| (size(at) / last, 100.0 * step)).collect::<Vec<_>>()
    };
    let all = [0, 1].map(|side| (model(side), measured(side)));
    let values = all.iter().flat_map(|(model, measured)| model.iter().chain(measured));
    let high = values.map(|at| at.1).fold(0.0, f64::max);
    let x = Axis::round(0.0, 1.0, "place in the window");
    let y = Axis::round(0.0, 1.05 * high, "step, % of the window");
    let mut chart = Chart::framed(CHART, [24.0, KEY], x, y);
    chart.heading("Steps over the window");
    let names = ["up", "down"];
    for (side, (model, measured)) in all.iter().enumerate() {
        chart.line(model, hue(side), "line", side);
        for &at in measured {
            chart.marker(at, side, 3.2, hue(side), "mark");
        }
    }
    let entries = [0, 1].map(|side| (side, hue(side), names[side].to_owned()));
    chart.key("marks measured", entries.into_iter(), true);
    chart
}
