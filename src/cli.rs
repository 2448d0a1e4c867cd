//! Arguments, messages, exit codes, and the only clock.
//!
//! ```text
//! 0  done                          1  the run, file or disk refused
//! 2  arguments cannot be used      3  stopped by the user; the run can be continued
//! 4  verify found a difference
//! ```

use std::ffi::OsString;
use std::io::IsTerminal;
use std::path::PathBuf;
use std::process::ExitCode;

use clap::{Args, CommandFactory, Parser, Subcommand};

use crate::chip::crossbar::kernel::Backend;
use crate::lab::config::{self, Config, Sources};
use crate::lab::data::DataRoot;
use crate::lab::near;
use crate::lab::run::Machine;
use out::say;

/// A line on standard error, as `eprintln!`, which would end the program where nobody hears it.
macro_rules! tell {
    ($($words:tt)*) => {
        $crate::cli::note(&format!($($words)*))
    };
}

mod analyse;
mod bench;
mod data;
mod export;
mod hw;
mod keys;
mod known;
mod out;
mod price;
mod progress;
mod report;
mod run;
mod runs;
mod store;
mod sweep;
mod table;
mod trace;
mod watch;

/// What stops a command.
#[derive(Debug)]
struct Failure {
    code: u8,
    message: String,
}

impl From<crate::lab::data::DataError> for Failure {
    fn from(error: crate::lab::data::DataError) -> Self {
        Self { code: 1, message: error.to_string() }
    }
}

type Done = Result<(), Failure>;

const ABOUT: &str = "Simulates neural networks that learn on an analog or photonic chip whose synapses can only be \
non-negative: deterministic, all-integer, bit-identical on every machine.";

const AFTER: &str = "\
Start here:
  dalean train                              train the built-in digits (seconds)
  dalean data fetch mnist                   get MNIST
  dalean train examples/mnist.toml          train it
  dalean train examples/mnist.toml --set hw.cell.level_bits=4 --hw prime
                                            4-bit cells, another chip
  dalean sweep examples/sweeps/adc_tiles.toml
                                            75 runs, one page with figures
  dalean verify runs/optdigits-ed-seed1     do a run again and compare every bit
  dalean train examples/policies/cartpole.toml
                                            a policy, by what comes of acting
  dalean watch runs/cartpole-v1-ed-seed1    an episode of it
  dalean hw show isaac                      what a chip model says, with sources

Exit codes: 0 done, 1 refused, 2 bad arguments, 3 stopped and resumable, 4 verify found a difference.";

#[derive(Debug, Parser)]
#[command(name = "dalean", version, about = ABOUT, after_help = AFTER, propagate_version = true)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Train a network on the chip; without a file, the built-in digits
    Train(run::TrainArgs),
    /// Read the test set with the state of a run
    Eval(run::EvalArgs),
    /// Do a run again and compare every state hash
    Verify(run::VerifyArgs),
    /// List runs, the newest first: how far they are, what they know, what sets them apart
    Runs(runs::RunsArgs),
    /// Put runs side by side: keys that differ, results, the first epoch whose states differ
    Compare(runs::CompareArgs),
    /// Carry out many runs from one file, and keep them in a store
    Sweep(sweep::SweepArgs),
    /// Write the table of a sweep as CSV, JSON or Parquet
    Export(export::ExportArgs),
    /// List, merge and mend stores of runs
    #[command(subcommand)]
    Store(store::StoreCommand),
    /// Say what one update and one inference cost: cycles, critical parts, energy
    Profile(price::ProfileArgs),
    /// Price a finished run: joules and seconds, with its own constants or another chip's
    Price(price::PriceArgs),
    /// Draw the page of a run again, or the page and the figures of a sweep
    Report(report::ReportArgs),
    /// Show and fetch data sets
    #[command(subcommand)]
    Data(data::DataCommand),
    /// Show and check hardware models
    #[command(subcommand)]
    Hw(hw::HwCommand),
    /// Every key of every file: what it takes, its default, its meaning
    Keys(keys::KeysArgs),
    /// Say what the updates of a run's layers have to do with the gradient: how large they are, how much they agree with it
    Analyse(analyse::AnalyseArgs),
    /// Write one update as waves: registers of a tile (VCD), operations of all tiles (Perfetto)
    Trace(trace::TraceArgs),
    /// Show episodes of a policy, step by step
    Watch(watch::WatchArgs),
    /// Measure how fast this machine is: kernels, and whole updates
    Bench(bench::BenchArgs),
    /// Print completions for a shell
    Completions {
        /// Which shell
        shell: clap_complete::Shell,
        /// One JSON object on standard output
        #[arg(long)]
        json: bool,
    },
}

/// Options of every command that runs.
#[derive(Debug, Clone, Args)]
struct Shared {
    /// Threads; results do not depend on it [default: all cores]
    #[arg(long, value_name = "N")]
    threads: Option<usize>,
    /// Loops to use: scalar, neon, avx2, avx512, amx; results do not depend on it [default: the fastest there is]
    #[arg(long, value_name = "NAME", value_parser = known::kernels(), hide_possible_values = true)]
    kernel: Option<String>,
    /// Folder of data sets [default: data, or DALEAN_DATA]
    #[arg(long, value_name = "DIR")]
    data_dir: Option<PathBuf>,
    /// One JSON object a line on standard output, each with an `event`
    #[arg(long)]
    json: bool,
    /// Print only the result
    #[arg(long, short)]
    quiet: bool,
}

#[expect(
    clippy::disallowed_methods,
    reason = "the command line reads the environment for the rest"
)]
fn environment(name: &str) -> Option<String> {
    std::env::var(name).ok().filter(|value| !value.is_empty())
}

impl Shared {
    fn machine(&self) -> Result<Machine, Failure> {
        let backend = match &self.kernel {
            Some(name) => kernel(name)?,
            None => Backend::best(),
        };
        let cores = || std::thread::available_parallelism().map_or(1, usize::from);
        let threads = self.threads.unwrap_or_else(cores);
        if !(1..=1024).contains(&threads) {
            return Err(usage(&format!("--threads is {threads}, but must lie in 1..=1024")));
        }
        Ok(Machine::new(backend, threads)?)
    }

    fn data_root(&self) -> DataRoot {
        data_root(self.data_dir.clone())
    }
}

/// Where the files of a run lie now.
#[derive(Debug, Clone, Args)]
struct Moved {
    /// Where the run's own data are now: its file, or the folder that holds its files under their names. What is there
    /// has to be what the run was made with
    #[arg(long, value_name = "PATH")]
    data: Option<PathBuf>,
}

impl Moved {
    fn root(&self, root: DataRoot) -> DataRoot {
        match &self.data {
            Some(place) => root.with_files(place),
            None => root,
        }
    }
}

/// The back end of a name.
fn kernel(name: &str) -> Result<Backend, Failure> {
    Backend::named(name)
        .map_err(|error| usage(&format!("{error}{}", near::hint(name, Backend::NAMES))))
}

fn data_root(given: Option<PathBuf>) -> DataRoot {
    let environment = || environment("DALEAN_DATA").map(PathBuf::from);
    DataRoot::new(given.or_else(environment).unwrap_or_else(|| PathBuf::from("data")))
}

fn usage(message: &str) -> Failure {
    Failure { code: 2, message: message.into() }
}

/// Reads the configuration a command names: without a file, what users get by saying nothing, the built-in digits.
fn configuration(
    file: Option<&PathBuf>,
    hw: Option<&str>,
    settings: &[String],
    seed: Option<u64>,
) -> Result<Config, Failure> {
    let read = match file {
        None => None,
        Some(path) => {
            #[expect(clippy::disallowed_methods, reason = "the file the user named")]
            let text = std::fs::read_to_string(path).map_err(|error| {
                let hint = "name an experiment file, such as examples/mnist.toml";
                usage(&format!("cannot read {}: {error}; {hint}", path.display()))
            })?;
            Some((path.display().to_string(), text))
        }
    };
    let experiment = read.as_ref().map(|(name, text)| (&**name, &**text));
    let sources = Sources { experiment, hardware: hw, settings, seed, ..Sources::default() };
    config::load(&sources).map_err(|error| usage(&error.to_string()))
}

/// Prints a line to standard error; that nobody hears it, or that its disk is full, is no reason to end.
fn note(line: &str) {
    use std::io::Write;
    let _ = writeln!(std::io::stderr(), "{line}");
}

/// Turns the end of a file's allowed size into an error of the write that met it, which says where and what to do.
fn hear_file_limits() {
    #[cfg(unix)]
    {
        let heard = std::sync::Arc::default();
        let _ = signal_hook::flag::register(signal_hook::consts::SIGXFSZ, heard);
    }
}

/// Runs the program and gives its exit code.
#[must_use]
pub fn main() -> ExitCode {
    ExitCode::from(run_with(std::env::args_os().collect()))
}

/// Runs the program with these arguments, its own name first, and gives its exit code.
#[must_use]
pub fn run_with(arguments: Vec<OsString>) -> u8 {
    hear_file_limits();
    let json = arguments.iter().any(|argument| argument == "--json");
    let cli = match Cli::try_parse_from(arguments) {
        Ok(cli) => cli,
        Err(error) => return unparsed(&error),
    };
    let done = match cli.command {
        Command::Train(args) => run::train(&args),
        Command::Eval(args) => run::eval(&args),
        Command::Verify(args) => run::verify(&args),
        Command::Runs(args) => runs::list(&args),
        Command::Compare(args) => runs::compare(&args),
        Command::Keys(args) => keys::execute(&args),
        Command::Sweep(args) => sweep::execute(&args),
        Command::Export(args) => export::execute(&args),
        Command::Store(command) => store::execute(&command),
        Command::Profile(args) => price::profile(&args),
        Command::Price(args) => price::price(&args),
        Command::Report(args) => report::execute(&args),
        Command::Data(command) => data::execute(&command),
        Command::Hw(command) => hw::execute(&command),
        Command::Analyse(args) => analyse::execute(&args),
        Command::Trace(args) => trace::execute(&args),
        Command::Watch(args) => watch::execute(&args),
        Command::Bench(args) => bench::execute(&args),
        Command::Completions { shell, json } => {
            let mut script = Vec::new();
            clap_complete::generate(shell, &mut Cli::command(), "dalean", &mut script);
            let script = String::from_utf8_lossy(&script);
            if json {
                let shell = shell.to_string();
                let script =
                    serde_json::json!({"event": "completions", "shell": shell, "script": script});
                say(&script.to_string());
            } else {
                say(script.trim_end());
            }
            Ok(())
        }
    };
    let whole = || out::fault().map_or(Ok(()), |message| Err(Failure { code: 1, message }));
    match done.and_then(|()| whole()) {
        Ok(()) => 0,
        Err(Failure { code, message }) => {
            if json {
                say(&serde_json::json!({"event": "error", "code": code, "message": message})
                    .to_string());
            }
            let red = std::io::stderr().is_terminal();
            let word = if red { "\u{1b}[31merror\u{1b}[0m" } else { "error" };
            note(&format!("{word}: {message}"));
            code
        }
    }
}

/// Arguments that name no command: help and version go to standard output, mistakes to the other one.
fn unparsed(error: &clap::Error) -> u8 {
    if error.use_stderr() {
        let _ = error.print();
        return 2;
    }
    let text = error.render();
    let live = std::io::stdout().is_terminal();
    let text = if live { text.ansi().to_string() } else { text.to_string() };
    say(text.trim_end());
    match out::fault() {
        None => 0,
        Some(message) => {
            note(&format!("error: {message}"));
            1
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn arguments_are_well_formed() {
        Cli::command().debug_assert();
    }

    #[test]
    fn saying_nothing_is_valid() {
        configuration(None, None, &[], None).unwrap();
    }
}
