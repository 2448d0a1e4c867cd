//! `eval --after`, `--samples`, `--chip`: a finished run on other chips, and after a time.

use std::path::Path;

use clap::Args;
use serde_json::json;

use super::table::columns;
use super::{Done, Failure, Shared, known, note, say, usage};
use crate::lab::data::DataRoot;
use crate::lab::run::{self, ChipResult, Deployment};

#[derive(Debug, Args)]
pub(super) struct DeployArgs {
    /// Read so long after programming, such as 1d: s, min, h, d, y; several times with commas. Levels drift as hw.device.drift says
    #[arg(long, value_name = "TIME", value_delimiter = ',')]
    after: Vec<String>,
    /// Load the levels into N other chips of the kind, numbers 1 to N, and say what they know: quantiles, the worst chip
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..), conflicts_with = "chip")]
    samples: Option<u32>,
    /// Load them into chip number N alone; 0 is the one that learnt
    #[arg(long, value_name = "N")]
    chip: Option<u64>,
    /// Make up for drift with a factor a layer
    #[arg(long)]
    compensate: bool,
    /// Cells and reads of a hardware model: its table [device]
    #[arg(long, value_name = "FILE", value_parser = known::models(), hide_possible_values = true)]
    hw: Option<String>,
    /// Change a key of hw.device, such as hw.device.faults.stuck_any=0.01 (repeatable)
    #[arg(long = "set", value_name = "KEY=VALUE")]
    settings: Vec<String>,
}

impl DeployArgs {
    /// Whether anything is asked for but the run as it is.
    pub(super) fn is_asked(&self) -> bool {
        let Self { after, samples, chip, compensate, hw, settings } = self;
        !after.is_empty()
            || samples.is_some()
            || chip.is_some()
            || *compensate
            || hw.is_some()
            || !settings.is_empty()
    }

    fn deployment(&self) -> Result<Deployment, Failure> {
        let seconds = |span: &String| {
            run::seconds_of(span).ok_or_else(|| {
                usage(&format!("--after {span} is no time; write 25s, 10min, 1h, 1d or 1y"))
            })
        };
        let after = self.after.iter().map(seconds).collect::<Result<Vec<_>, _>>()?;
        let chips = match (self.samples, self.chip) {
            (Some(samples), _) => (1..=u64::from(samples)).collect(),
            (None, Some(chip)) => vec![chip],
            (None, None) => vec![0],
        };
        let (device, settings) = (self.hw.clone(), self.settings.clone());
        Ok(Deployment { after, chips, compensated: self.compensate, device, settings })
    }
}

/// Reads a run on the chips that are asked for.
pub(super) fn deploy(
    args: &DeployArgs,
    path: &Path,
    root: &DataRoot,
    (shared, stopped): (&Shared, &dyn Fn() -> bool),
) -> Done {
    let deployment = args.deployment()?;
    let policy = run::configuration(path)?.0.policy.is_some();
    let name = if policy { "return_mean" } else { "test_accuracy" };
    let mut each = |result: &ChipResult| {
        if shared.json {
            let (chip, after) = (result.chip, result.after_s);
            say(&json!({"event": "chip", "chip": chip, "after_s": after, name: result.score})
                .to_string());
        }
        !stopped()
    };
    if let Some(unread) = run::unread(&deployment)? {
        if shared.json {
            say(&json!({"event": "note", "text": unread}).to_string());
        } else {
            note(&format!("note: {unread}"));
        }
    }
    let results = run::deploy(path, root, shared.machine()?, &deployment, &mut each)?;
    let shown = |score: f64| {
        if policy { format!("{score:.2}") } else { format!("{:.2} %", 100.0 * score) }
    };
    let mut lines = vec![
        ["after", "chips", "mean", "sd", "5 %", "median", "95 %", "worst", "chip"]
            .map(str::to_owned)
            .to_vec(),
    ];
    let mut rows = Vec::new();
    for summary in run::summed_up(&results) {
        let [low, lower, median, upper, high] = summary.quantiles;
        lines.push(vec![
            summary.after_s.map_or("-".into(), |seconds| format!("{seconds} s")),
            summary.chips.to_string(),
            shown(summary.mean),
            summary.sd.map_or("-".into(), shown),
            shown(low),
            shown(median),
            shown(high),
            shown(summary.least),
            summary.worst_chip.to_string(),
        ]);
        rows.push(json!({
            "after_s": summary.after_s,
            "chips": summary.chips,
            "mean": summary.mean,
            "sd": summary.sd,
            "quantiles": {"0.05": low, "0.25": lower, "0.5": median, "0.75": upper, "0.95": high},
            "least": summary.least,
            "greatest": summary.greatest,
            "worst_chip": summary.worst_chip,
        }));
    }
    if shared.json {
        let last = results.last().map(|result| result.score);
        say(&json!({
            "event": "done",
            "run": path.display().to_string(),
            "of": name,
            "compensated": deployment.compensated,
            "results": rows,
            name: last,
        })
        .to_string());
        return Ok(());
    }
    say(&columns(&lines, &[1, 2, 3, 4, 5, 6, 7, 8]));
    if !shared.quiet {
        let made_up = if deployment.compensated {
            "a factor a layer makes up for drift"
        } else {
            "nothing makes up for drift"
        };
        let drift =
            if deployment.after.is_empty() { String::new() } else { format!("; {made_up}") };
        say(&format!(
            "chip N again: the same command with --chip N in place of --samples; chip 0 is the one that learnt{drift}"
        ));
    }
    Ok(())
}
