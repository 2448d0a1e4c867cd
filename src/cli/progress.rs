//! Progress with rate and time to go: a bar on a terminal, plain lines elsewhere.
#![expect(clippy::disallowed_types, reason = "progress is about wall-clock time")]

use std::io::IsTerminal;
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressStyle};

use crate::lab::run::Progress;
use crate::lab::store::record::{EpochRecord, PolicyOutcome, Score, SumRecord};

/// Seconds between plain lines within an epoch.
const LINE_SECONDS: u64 = 10;

/// Shows how far a run is.
#[derive(Debug)]
pub(super) struct Meter {
    bar: Option<ProgressBar>,
    quiet: bool,
    epochs: u32,
    started: Instant,
    last_line: Instant,
    samples: u64,
}

impl Meter {
    /// A meter for `epochs` epochs; silent when `quiet`.
    pub(super) fn new(quiet: bool, epochs: u32) -> Self {
        let now = Instant::now();
        let bar = (!quiet && std::io::stderr().is_terminal()).then(|| {
            let bar = ProgressBar::new(0);
            let template = "{prefix} {bar:30} {pos}/{len}  {msg}";
            bar.set_style(ProgressStyle::with_template(template).expect("a valid template"));
            bar
        });
        Self { bar, quiet, epochs, started: now, last_line: now, samples: 0 }
    }

    /// Notes a batch.
    pub(super) fn batch(&mut self, progress: Progress) {
        let Progress { epoch, epochs, done: samples, total: samples_total, answers, returns } =
            progress;
        self.epochs = epochs;
        let done = u64::from(epoch) * samples_total as u64 + samples as u64;
        if self.samples == 0 {
            // a continued run has a past that this process did not spend time on
            self.samples = done;
            self.started = Instant::now();
        }
        if self.quiet {
            return;
        }
        let seconds = self.started.elapsed().as_secs_f64();
        let rate = (done - self.samples) as f64 / seconds.max(1e-3);
        let total = u64::from(self.epochs) * samples_total as u64;
        let left =
            Duration::from_secs_f64(((total - done.min(total)) as f64 / rate.max(1.0)).min(1e9));
        let right = answers.map(|score| format!("train {:.2} %  ", 100.0 * score.fraction()));
        let mean = returns.and_then(SumRecord::mean);
        let mean = mean.map(|mean| format!("return {mean:.1}  ")).unwrap_or_default();
        let right = right.unwrap_or(mean);
        let what = if returns.is_some() { "steps" } else { "samples" };
        let message = format!("{right}{rate:.0} {what}/s  {} to go", clock(left));
        if let Some(bar) = &self.bar {
            bar.set_length(samples_total as u64);
            bar.set_prefix(format!("epoch {:>3}/{}", epoch + 1, self.epochs));
            bar.set_position(samples as u64);
            bar.set_message(message);
        } else if self.last_line.elapsed() >= Duration::from_secs(LINE_SECONDS) {
            self.last_line = Instant::now();
            tell!(
                "epoch {}/{}: {samples}/{samples_total} {what}, {message}",
                epoch + 1,
                self.epochs
            );
        }
    }

    /// Notes a finished epoch.
    pub(super) fn epoch(&mut self, record: &EpochRecord, seconds: f64) {
        if self.quiet {
            return;
        }
        self.last_line = Instant::now();
        let what = match record.policy() {
            Some(policy) => of_policy(policy),
            None => of_scores(record),
        };
        let (floor, cells) = record
            .pathways
            .iter()
            .fold((0, 0), |(floor, cells), p| (floor + p.floor, cells + p.cells));
        let line = format!(
            "epoch {:>3}/{}  {what}  floor {:>5.1} %  {:>7.2} s  {}",
            record.epoch,
            self.epochs,
            100.0 * floor as f64 / cells.max(1) as f64,
            seconds,
            &record.state_hash[..12],
        );
        self.line(&line);
    }

    /// Prints a line above the bar.
    pub(super) fn line(&self, line: &str) {
        match &self.bar {
            Some(bar) => bar.println(line),
            None => tell!("{line}"),
        }
    }

    /// Takes the bar away.
    pub(super) fn finish(&self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }
}

/// Right answers while learning and of the validation set.
fn of_scores(record: &EpochRecord) -> String {
    let percent = |score: Option<Score>| {
        score.map_or_else(|| "-".into(), |s| format!("{:.2} %", 100.0 * s.fraction()))
    };
    format!("train {:>8}  validation {:>8}", percent(record.train()), percent(record.validation()))
}

/// Returns while learning and without, and what became of the update.
fn of_policy(policy: &PolicyOutcome) -> String {
    let number = |number: Option<f64>, digits: usize| {
        number.map_or_else(|| "-".into(), |n| format!("{n:.digits$}"))
    };
    format!(
        "steps {:>9}  return {:>9}  evaluated {:>9}  entropy {:>6}  kl {:>7}  clipped {:>5}  explained {:>6}",
        policy.steps,
        number(policy.episodic_return, 2),
        number(policy.evaluation.mean(), 2),
        number(policy.mean_entropy, 3),
        number(policy.mean_approx_kl, 4),
        number(policy.clipfrac, 3),
        number(policy.explained_variance, 3),
    )
}

/// Shows how far a sweep is.
#[derive(Debug)]
pub(super) struct SweepMeter {
    bar: Option<ProgressBar>,
    quiet: bool,
    started: Instant,
    last_line: Instant,
    done: f64,
    total: f64,
    finished: usize,
    runs: usize,
}

impl SweepMeter {
    /// A meter; silent when `quiet`.
    pub(super) fn new(quiet: bool) -> Self {
        let now = Instant::now();
        let bar = (!quiet && std::io::stderr().is_terminal()).then(|| {
            let bar = ProgressBar::new(0);
            let style = ProgressStyle::with_template("{bar:30} {pos}/{len} runs  {msg}");
            bar.set_style(style.expect("a valid template"));
            bar
        });
        Self {
            bar,
            quiet,
            started: now,
            last_line: now,
            done: 0.0,
            total: 0.0,
            finished: 0,
            runs: 0,
        }
    }

    /// Notes what there is to do.
    pub(super) fn start(&mut self, finished: usize, todo: usize, work: f64) {
        (self.finished, self.runs, self.total) = (finished, finished + todo, work);
        self.started = Instant::now();
        if let Some(bar) = &self.bar {
            bar.set_length(self.runs as u64);
            bar.set_position(finished as u64);
        }
        if finished > 0 {
            self.line(&format!("{finished} of {} runs are finished already", self.runs));
        }
    }

    fn to_go(&self) -> String {
        let seconds = self.started.elapsed().as_secs_f64();
        if self.done <= 0.0 || seconds < 1.0 {
            return "...".into();
        }
        let left = (self.total - self.done).max(0.0) / self.done * seconds;
        clock(Duration::from_secs_f64(left.min(1e9)))
    }

    /// Notes work done.
    pub(super) fn work(&mut self, work: f64) {
        self.done += work;
        if let Some(bar) = &self.bar {
            bar.set_message(format!("{} to go", self.to_go()));
        } else if !self.quiet && self.last_line.elapsed() >= Duration::from_secs(LINE_SECONDS) {
            self.last_line = Instant::now();
            tell!("{}/{} runs, {} to go", self.finished, self.runs, self.to_go());
        }
    }

    /// Notes a finished run.
    pub(super) fn finished(&mut self, what: &str) {
        self.finished += 1;
        if let Some(bar) = &self.bar {
            bar.set_position(self.finished as u64);
        }
        self.line(&format!("{:>5}/{}  {what}", self.finished, self.runs));
    }

    /// Prints a line above the bar.
    pub(super) fn line(&mut self, line: &str) {
        self.last_line = Instant::now();
        match &self.bar {
            _ if self.quiet => {}
            Some(bar) => bar.println(line),
            None => tell!("{line}"),
        }
    }

    /// Takes the bar away and gives the seconds since the start.
    pub(super) fn finish(&self) -> f64 {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
        self.started.elapsed().as_secs_f64()
    }
}

/// A number that nobody could have known before.
pub(super) fn moment() -> u64 {
    let since = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH);
    since.map_or(0, |since| since.subsec_nanos().into())
}

/// `1:02:03`, `2:03` or `3 s`.
pub(super) fn clock(time: Duration) -> String {
    let seconds = time.as_secs();
    match (seconds / 3600, seconds / 60 % 60, seconds % 60) {
        (0, 0, s) => format!("{s} s"),
        (0, m, s) => format!("{m}:{s:02}"),
        (h, m, s) => format!("{h}:{m:02}:{s:02}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_are_short() {
        let show = |s| clock(Duration::from_secs(s));
        assert_eq!([show(3), show(123), show(3723)], ["3 s", "2:03", "1:02:03"]);
    }
}
