//! The file: a device on the periphery of the ideal chip, as the published ones are (hw_models/devices).

use std::fmt::Write as _;

use super::{LEAST, MeasuredDevice};
use crate::chip::device::{CellSpread, PulseNoise};
use crate::lab::config::builtin_models;
use crate::num::fixed::Millionths;
use crate::num::tables::{Response, SpreadLaw};

/// Standard deviations that levels leave room for, above a ceiling that differs.
const ROOM: f64 = 3.3;
/// States that levels of 8 bits resolve.
const STATES_8: u32 = 200;

impl MeasuredDevice {
    /// Bits of the levels it is simulated with, and the levels of floor and ceiling.
    #[must_use]
    pub fn levels(&self) -> (u32, [u16; 2]) {
        let bits = if self.device.states <= STATES_8 { 8 } else { 12 };
        let most = f64::from((1u32 << bits) - 1);
        let share = |millionths: Millionths| millionths.0 as f64 / 1e6;
        let spread = &self.device.spread;
        let ceiling = libm::floor(most / (1.0 + ROOM * share(spread.ceiling)));
        let floor = self.on_off().map_or(0.0, |ratio| libm::round(ceiling / ratio));
        let floor = floor.clamp(0.0, ceiling - 1.0);
        (bits, [floor, ceiling].map(|level| level as u16))
    }

    /// The hardware model of that name.
    ///
    /// # Panics
    /// Never: the ideal chip is built in.
    #[must_use]
    pub fn hardware_toml(&self, name: &str) -> String {
        let ideal = builtin_models().into_iter().find(|model| model.name == "ideal");
        let ideal = ideal.expect("the ideal chip is built in").text;
        let periphery = ideal.find("[tile]").expect("its tables begin with the cell and the tile");
        let (bits, [floor, ceiling]) = self.levels();
        let source = self.source();
        let quoted = |text: &str| toml::Value::String(text.to_owned()).to_string();
        let ratio = match self.on_off() {
            Some(ratio) => format!("on/off ratio {}", short(ratio)),
            None => "the least conductance is 0".into(),
        };
        let mut text = format!(
            "# Made by `dalean hw import` from {}: what is not in that table is the ideal chip's.\n\
             # {}.\n\
             name = {}\n\
             summary = {}\n\
             node_nm = 32   # of the periphery\n\
             adc = \"ideal\"\n\n",
            self.file,
            self.reason(),
            quoted(name),
            quoted(&self.summary()),
        );
        let _ = write!(
            text,
            "[cell]\n\
             level_bits = {bits}            # the resolution it is simulated with\n\
             floor = {floor}\n\
             ceiling = {ceiling}\n\
             floor_kind = \"recoverable\"\n\
             source = {}\n\
             kind = \"measured\"\n\n",
            quoted(&format!(
                "{source}: {ratio}; levels that resolve a step, and room for ceilings that differ"
            )),
        );
        text += &self.response_toml(&quoted(&source));
        text += &self.spread_toml(&quoted(&source));
        text += ideal[periphery..].trim_end();
        text +=
            "\n\n# What the table does not say, or what is not simulated of it.\n[not_simulated]\n";
        for (effect, words) in self.absent() {
            let _ = writeln!(text, "{effect} = {}", quoted(&words));
        }
        text
    }

    /// Where numbers come from.
    #[must_use]
    pub fn source(&self) -> String {
        let devices = match self.devices.len() {
            1 => "one device".to_owned(),
            count => format!("{count} devices"),
        };
        let [up, down] = self.pulses;
        format!(
            "{} (blake3 {}): {up} pulses up and {down} down of {devices}",
            self.file, self.digest
        )
    }

    fn summary(&self) -> String {
        let noise = match self.device.noise {
            PulseNoise::OfStep(share) => format!(", noise {} % of a step", percent(share)),
            PulseNoise::OfWindow(share) => format!(", noise {} % of the window", percent(share)),
            _ => String::new(),
        };
        let differ =
            if self.device.spread == CellSpread::default() { "" } else { ", cells differ" };
        let (name, states) = (self.device.response.name(), self.device.states);
        format!("a measured device: {states} states, curve {name}{noise}{differ}")
    }

    fn response_toml(&self, source: &str) -> String {
        let device = &self.device;
        let list = |numbers: &[Millionths]| {
            let numbers: Vec<_> = numbers.iter().map(ToString::to_string).collect();
            format!("[{}]", numbers.join(", "))
        };
        let mut text = format!("[device.response]\ncurve = \"{}\"\n", device.response.name());
        let numbers: Vec<(&str, String)> = match &device.response {
            Response::Linear(of) => vec![("up", list(&of.up)), ("down", list(&of.down))],
            Response::SoftBounds(of) => vec![("up", list(&[of.up])), ("down", list(&[of.down]))],
            Response::Neurosim(of) => vec![("labels", list(&of.labels))],
            Response::Exponential(of) => vec![
                ("amplitude", list(&of.amplitude)),
                ("growth", list(&of.growth)),
                ("z", list(&of.z)),
            ],
            Response::Table(of) => vec![("up", list(&of.up)), ("down", list(&of.down))],
            Response::Measured(of) => {
                let rows: Vec<_> = of.points.iter().map(|point| list(point)).collect();
                vec![("points", format!("[{}]", rows.join(", ")))]
            }
        };
        for (key, value) in numbers {
            let _ = writeln!(text, "{key} = {value}");
        }
        let _ = writeln!(text, "states = {}", device.states);
        if device.asymmetry.0 != 0 {
            let _ = writeln!(text, "asymmetry = {}", device.asymmetry);
        }
        match device.noise {
            PulseNoise::OfStep(share) => {
                let _ = writeln!(text, "noise = {share}\nnoise_of = \"step\"");
            }
            PulseNoise::OfWindow(share) => {
                let _ = writeln!(text, "noise = {share}\nnoise_of = \"window\"");
            }
            _ => {}
        }
        let kind = match device.response {
            Response::Table(_) | Response::Measured(_) => "measured",
            _ => "fitted",
        };
        let _ = write!(text, "source = {source}\nkind = \"{kind}\"\n\n");
        text
    }

    fn spread_toml(&self, source: &str) -> String {
        let CellSpread { step_law, step, asymmetry, ceiling, floor } = self.device.spread;
        let mut lines = String::new();
        let named =
            [("step", step), ("asymmetry", asymmetry), ("ceiling", ceiling), ("floor", floor)];
        for (key, share) in named.into_iter().filter(|(_, share)| share.0 != 0) {
            let _ = writeln!(lines, "{key} = {share}");
            if key == "step" {
                let law = if step_law == SpreadLaw::LogNormal { "log_normal" } else { "normal" };
                let _ = writeln!(lines, "step_law = \"{law}\"");
            }
        }
        if lines.is_empty() {
            return lines;
        }
        format!("[device.spread]\n{lines}source = {source}\nkind = \"measured\"\n\n")
    }

    /// What the file says that is not simulated.
    fn absent(&self) -> Vec<(&'static str, String)> {
        let mut all = vec![
            (
                "pulse_time",
                "a pulse takes the time and the energy that it takes on the ideal chip: its length and voltage are \
                 not in the table"
                    .to_owned(),
            ),
            (
                "beyond_window",
                "nothing is known of conductances beyond the measured ones: the window ends there"
                    .to_owned(),
            ),
        ];
        if self.read_noise >= LEAST {
            let percent = short(100.0 * self.read_noise);
            let words = format!(
                "a read of the table seems to miss by {percent} % of the window; it is taken off the noise of pulses"
            );
            all.push(("read_noise", words));
        }
        if self.device.noise == PulseNoise::Off {
            all.push(("cycle_to_cycle", "the table shows no noise from pulse to pulse".to_owned()));
        }
        if self.device.spread == CellSpread::default() {
            all.push(("device_to_device", "the table does not say how cells differ".to_owned()));
        }
        all
    }
}

/// A share in per cent.
fn percent(share: Millionths) -> String {
    short(share.0 as f64 / 1e4)
}

/// Three digits behind the point at most.
fn short(number: f64) -> String {
    let text = format!("{number:.3}");
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}
