//! `trace`: one update, cycle by cycle, as files for viewers.

use std::path::PathBuf;

use clap::Args;
use serde_json::json;

use super::{Done, Failure, Shared, configuration, known, say, usage};
use crate::chip::engine::tick::TileAt;
use crate::chip::ledger::Interval;
use crate::lab::wave::{self, Look};

#[derive(Debug, Args)]
pub(super) struct TraceArgs {
    /// Experiment file [default: the built-in digits]
    file: Option<PathBuf>,
    /// Hardware model: a built-in name or a file
    #[arg(long, value_name = "FILE", value_parser = known::models(), hide_possible_values = true)]
    hw: Option<String>,
    /// Change a key, such as learning.batch=4 for a short trace (repeatable)
    #[arg(long = "set", value_name = "KEY=VALUE")]
    settings: Vec<String>,
    /// Seed of all draws
    #[arg(long, value_name = "N")]
    seed: Option<u64>,
    /// Which update of the first epoch, from 1
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u64).range(1..))]
    update: u64,
    /// Which tile's registers: layer,stream,row,column of tiles; stream is p or n. The layers of a critic follow those of its actor,
    /// and the network that has the layer is shown
    #[arg(long, value_name = "L,S,R,C", default_value = "0,p,0,0")]
    tile: String,
    /// Write registers of that tile over cycles (GTKWave, Surfer)
    #[arg(long, value_name = "FILE")]
    vcd: Option<PathBuf>,
    /// Put registers of whole arrays into the wave too
    #[arg(long)]
    all: bool,
    /// Write operations of all tiles over time (ui.perfetto.dev, chrome://tracing)
    #[arg(long, value_name = "FILE")]
    perfetto: Option<PathBuf>,
    #[command(flatten)]
    shared: Shared,
}

pub(super) fn execute(args: &TraceArgs) -> Done {
    if args.vcd.is_none() && args.perfetto.is_none() {
        return Err(usage("name a file to write: --vcd FILE, --perfetto FILE, or both"));
    }
    let tile = tile(&args.tile)?;
    let config = configuration(args.file.as_ref(), args.hw.as_deref(), &args.settings, args.seed)?;
    let look = Look { update: args.update, tile, all: args.all };
    let wave = wave::record(&config, &args.shared.data_root(), args.shared.machine()?, look)?;
    let mut written = Vec::new();
    for (path, bytes) in [(&args.vcd, &wave.vcd[..]), (&args.perfetto, wave.perfetto.as_bytes())] {
        if let Some(path) = path {
            super::out::write(path, bytes)?;
            written.push(path.display().to_string());
        }
    }
    let stages = Interval::ALL.map(|interval| (interval.name(), wave.cycles.interval(interval)));
    if args.shared.json {
        let stages: serde_json::Map<_, _> =
            stages.into_iter().map(|(name, cycles)| (name.to_owned(), json!(cycles))).collect();
        let cycles = wave.cycles.elapsed();
        say(&json!({"event": "trace", "update": args.update, "cycles": cycles, "stages": stages, "files": written})
            .to_string());
    } else {
        let used = stages.iter().filter(|(_, cycles)| *cycles > 0);
        let used: Vec<_> = used.map(|(name, cycles)| format!("{name} {cycles}")).collect();
        say(&format!(
            "update {}: {} cycles ({}); wrote {}",
            args.update,
            wave.cycles.elapsed(),
            used.join(", "),
            written.join(" and ")
        ));
    }
    Ok(())
}

/// `0,p,0,0`.
fn tile(text: &str) -> Result<TileAt, Failure> {
    let wrong = || {
        usage(&format!(
            "--tile is {text:?}; it is layer,stream,row,column of tiles, such as 0,p,0,0: stream is p or n, the rest \
             count from 0"
        ))
    };
    let parts: Vec<&str> = text.split(',').map(str::trim).collect();
    let [layer, stream, down, across] = parts[..] else { return Err(wrong()) };
    let number = |text: &str| text.parse::<usize>().map_err(|_| wrong());
    let target = match stream {
        "p" => 0,
        "n" => 1,
        _ => return Err(wrong()),
    };
    Ok(TileAt { layer: number(layer)?, target, down: number(down)?, across: number(across)? })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tile_is_named_by_four_parts() {
        let at = tile("1, n,2,3").unwrap();
        assert_eq!(at, TileAt { layer: 1, target: 1, down: 2, across: 3 });
        for wrong in ["", "1,n,2", "1,x,2,3", "1,n,-2,3", "1,n,2,3,4"] {
            assert_eq!(tile(wrong).unwrap_err().code, 2, "{wrong}");
        }
    }
}
