//! `watch`: episodes of a policy, step by step.
#![expect(clippy::disallowed_types, reason = "frames follow one another in wall-clock time")]

use std::io::IsTerminal;
use std::path::PathBuf;
use std::thread;
use std::time::{Duration, Instant};

use clap::Args;
use serde_json::json;

use super::run::Stop;
use super::{Done, Failure, Shared, out, say};
use crate::lab::report::Film;
use crate::lab::run;
use crate::task::environment::{EnvSpec, Shown, Taken};
use crate::task::policy::WatchedStep;

#[derive(Debug, Args)]
pub(super) struct WatchArgs {
    /// Folder of a run of a policy
    #[arg(value_hint = clap::ValueHint::DirPath)]
    run: PathBuf,
    /// Which episode of the evaluation, from 0
    #[arg(long, value_name = "N", default_value_t = 0)]
    episode: u32,
    /// Steps at most [default: until the episode ends]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    steps: Option<u32>,
    /// Pictures a second
    #[arg(long, value_name = "N", default_value_t = 25, value_parser = clap::value_parser!(u32).range(1..=1000))]
    fps: u32,
    /// Write an animated picture
    #[arg(long, value_name = "FILE", value_hint = clap::ValueHint::FilePath)]
    svg: Option<PathBuf>,
    #[command(flatten)]
    shared: Shared,
}

/// A number with 16 bits behind the point.
fn real(number: i64) -> f64 {
    number as f64 / 65_536.0
}

/// A number with 20 bits behind the point.
fn fine(number: i64) -> f64 {
    number as f64 / 1_048_576.0
}

/// What is shown of the steps so far.
#[derive(Debug, Default)]
struct Screen {
    /// Lines of the picture that stands there now.
    lines: usize,
    total: i64,
}

impl Screen {
    /// A line of numbers beside a picture.
    fn line(&self, spec: &EnvSpec, step: &WatchedStep) -> String {
        let actor = step.actor.iter().map(|&number| format!("{:.2}", fine(number)));
        let action = step.action.iter().map(|&number| match spec.taken {
            Taken::Discrete(_) => number.to_string(),
            Taken::Continuous(_) => format!("{:.2}", real(number)),
        });
        let action: Vec<String> = action.collect();
        format!(
            "step {:>4}  return {:>9.2}  action {}  of {}  worth {:.2}",
            step.step,
            real(self.total),
            action.join(" "),
            actor.collect::<Vec<_>>().join(" "),
            fine(step.value)
        )
    }

    /// Draws a picture over the one before.
    fn draw(&mut self, spec: &EnvSpec, step: &WatchedStep) {
        let text = format!("{}\n{}", step.picture.trim_end_matches('\n'), self.line(spec, step));
        let mut whole = String::new();
        if self.lines > 0 {
            whole += &format!("\u{1b}[{}A", self.lines);
        }
        for line in text.lines() {
            whole += &format!("\u{1b}[2K{line}\n");
        }
        self.lines = text.lines().count();
        say(whole.trim_end_matches('\n'));
    }
}

fn step_json(spec: &EnvSpec, step: &WatchedStep, total: i64) -> serde_json::Value {
    let reals = |numbers: &[i64]| numbers.iter().map(|&number| real(number)).collect::<Vec<_>>();
    let action = match spec.taken {
        Taken::Discrete(_) => json!(step.action.first()),
        Taken::Continuous(_) => json!(reals(&step.action)),
    };
    let shown = match spec.shown {
        Shown::Dense(_) => json!(reals(&step.shown)),
        Shown::Sparse { .. } => json!(step.shown),
    };
    let actor: Vec<f64> = step.actor.iter().map(|&number| fine(number)).collect();
    json!({"event": "step", "step": step.step, "shown": shown, "action": action, "actor": actor,
        "value": fine(step.value), "reward": real(step.reward), "return": real(total),
        "picture": step.picture})
}

pub(super) fn execute(args: &WatchArgs) -> Done {
    let shared = &args.shared;
    let stop = Stop::default();
    let animated = !shared.json && !shared.quiet && std::io::stdout().is_terminal();
    let pause = Duration::from_secs_f64(1.0 / f64::from(args.fps));
    let mut screen = Screen::default();
    let mut steps: Vec<WatchedStep> = Vec::new();
    let mut next = Instant::now();
    let mut last = String::new();
    let mut look = |spec: &EnvSpec, step: &WatchedStep| {
        screen.total = screen.total.saturating_add(step.reward);
        if shared.json {
            say(&step_json(spec, step, screen.total).to_string());
        } else if animated {
            screen.draw(spec, step);
            next += pause;
            thread::sleep(next.saturating_duration_since(Instant::now()));
        }
        if !animated {
            // what an animation would end with
            last = format!("{}\n{}", step.picture.trim_end_matches('\n'), screen.line(spec, step));
        }
        steps.push(step.clone());
        !stop.asked() && args.steps.is_none_or(|most| (steps.len() as u64) < u64::from(most))
    };
    let watched =
        run::watch(&args.run, &shared.data_root(), shared.machine()?, args.episode, &mut look)?;
    let film = Film::new(args.episode, &steps);
    if let Some(path) = &args.svg {
        out::write(path, film.svg().as_bytes())?;
    }
    let svg = args.svg.as_ref().map(|path| path.display().to_string());
    let total = real(screen.total);
    if shared.json {
        say(&json!({"event": "done", "run": args.run.display().to_string(), "episode": args.episode,
            "steps": film.steps, "return": total, "epochs": watched.epoch,
            "state_hash": watched.state_hash, "svg": svg})
        .to_string());
        return Ok(());
    }
    if !animated && !shared.quiet {
        say(&last);
    }
    say(&format!(
        "episode {}: {} steps, return {total:.2}, state after epoch {}",
        args.episode, film.steps, watched.epoch
    ));
    if let Some(svg) = svg {
        say(&format!("picture  {svg}"));
    }
    match steps.is_empty() {
        true => Err(Failure { code: 1, message: "the episode has no step".into() }),
        false => Ok(()),
    }
}
