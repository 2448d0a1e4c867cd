//! `hw list`, `hw show`, `hw check`.

use clap::Subcommand;

use super::{Done, say, usage};
use crate::chip::hardware::{Adc, AdcRange, Hardware, Subtract};
use crate::lab::config::{builtin_models, load_model};

#[derive(Debug, Subcommand)]
pub(super) enum HwCommand {
    /// Show the built-in models
    List,
    /// Show a model: its numbers, then its text with sources
    Show {
        /// A built-in name or a file
        model: String,
    },
    /// Check a model file: keys, ranges, a source beside every table
    Check {
        /// A built-in name or a file
        model: String,
    },
}

pub(super) fn execute(command: &HwCommand) -> Done {
    match command {
        HwCommand::List => {
            for model in builtin_models() {
                say(&format!("{:8} {}", model.name, model.summary));
            }
        }
        HwCommand::Show { model } => {
            let model = load_model(model).map_err(|e| usage(&e.to_string()))?;
            say(&format!("{}: {}\n", model.name, model.summary));
            for (name, value) in numbers(&model.hardware) {
                say(&format!("  {name:16} {value}"));
            }
            for (what, how) in &model.not_simulated {
                say(&format!("  {:16} {what}: {how}", "not simulated"));
            }
            say(&format!("\n{}", model.text.trim_end()));
        }
        HwCommand::Check { model } => {
            let model = load_model(model).map_err(|e| usage(&e.to_string()))?;
            say(&format!("{}: valid; every table has a source", model.name));
        }
    }
    Ok(())
}

fn numbers(hardware: &Hardware) -> Vec<(&'static str, String)> {
    let h = hardware;
    let converter = match h.adc {
        Adc::Ideal => "lossless".into(),
        Adc::Finite { bits, subtract, range } => {
            let range = match range {
                AdcRange::Shift(shift) => format!("step 2^{shift}"),
                AdcRange::Full => "full range".into(),
                AdcRange::Calibrated { headroom, .. } => format!("calibrated + {headroom}"),
            };
            let each = match subtract {
                Subtract::Digital => "each bank",
                Subtract::Current => "the difference of the banks",
            };
            format!("{} bits, {range}, {each}", bits.get())
        }
    };
    let window = (h.window.floor(), h.window.ceiling());
    vec![
        ("cell", format!("{} bits, levels {}..={}", h.level_bits.get(), window.0, window.1)),
        ("tile", format!("{} x {} cells a bank", h.tile_rows, h.tile_columns)),
        ("drive", format!("{} bits, {} slices of {}", h.drive_bits.get(), h.slices(), h.dac_bits)),
        ("converter", converter),
        ("activation table", format!("{} entries", 1u32 << h.lut_bits.get())),
        ("error word", format!("{} bits", h.error_bits.get())),
        ("write", format!("at most {} pulses a cell", h.increment_max.get())),
        ("remainder", format!("{} bits", h.residual_bits.get())),
    ]
}
