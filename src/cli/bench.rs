//! `bench`: how fast this machine is at what the simulator does, as figures and as ratios.
//!
//! Times of one machine say little about another; ratios say more. Everything that a ratio is made of runs in turn in
//! one race ([`time`]), on random data. Sections: `peak`, `read`, `conv`, `convert`, `update`, `step`.

use std::ops::Range;
use std::path::PathBuf;

use clap::{Args, ValueEnum};
use serde_json::json;

use super::{Done, data_root, kernel, known, say, usage};
use crate::chip::crossbar::kernel::{Backend, Kernel, TOGETHER};
use crate::chip::crossbar::layout::Layout;
use crate::lab::data::DataRoot;

mod chance;
mod conv;
mod convert;
mod float;
mod machine;
mod net;
mod peak;
mod read;
mod step;
mod table;
mod time;
mod update;

#[derive(Debug, Args)]
pub(super) struct BenchArgs {
    /// Loops to time, and the scalar ones beside them [default: all for peak and read, the fastest for the rest]
    #[arg(long, value_name = "NAME", value_parser = known::kernels(), hide_possible_values = true)]
    kernel: Option<String>,
    /// Measure only these sections, such as peak,read
    #[arg(long, value_name = "SECTIONS", value_delimiter = ',')]
    only: Vec<Section>,
    /// A second or so for each section: rough figures
    #[arg(long)]
    quick: bool,
    /// Also time a step with N threads; everything else takes one
    #[arg(long, value_name = "N", default_value_t = 1)]
    threads: usize,
    /// Folder of data sets [default: data, or DALEAN_DATA]
    #[arg(long, value_name = "DIR")]
    data_dir: Option<PathBuf>,
    /// One JSON object a line on standard output, each with an `event`
    #[arg(long)]
    json: bool,
    /// Print only tables
    #[arg(long, short)]
    quiet: bool,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Section {
    /// Products in registers
    Peak,
    /// Reads of arrays
    Read,
    /// Reads and sums of convolutions
    Conv,
    /// Reads with converters
    Convert,
    /// Writes of arrays
    Update,
    /// Updates of whole networks
    Step,
}

impl Section {
    const fn name(self) -> &'static str {
        match self {
            Self::Peak => "peak",
            Self::Read => "read",
            Self::Conv => "conv",
            Self::Convert => "convert",
            Self::Update => "update",
            Self::Step => "step",
        }
    }

    fn measure(self, plan: &BenchPlan) -> Vec<table::BenchTable> {
        match self {
            Self::Peak => peak::measure(plan),
            Self::Read => read::measure(plan),
            Self::Conv => conv::measure(plan),
            Self::Convert => convert::measure(plan),
            Self::Update => update::measure(plan),
            Self::Step => step::measure(plan),
        }
    }
}

/// What to measure, and how long.
struct BenchPlan {
    /// Back ends of `peak` and `read`, slowest first.
    backends: Vec<Backend>,
    /// Back end of everything else.
    best: Backend,
    quick: bool,
    threads: usize,
    data: DataRoot,
}

impl BenchPlan {
    /// Seconds of a race that would take `seconds` in a full bench.
    fn seconds(&self, seconds: f64) -> f64 {
        if self.quick { seconds / 15.0 } else { seconds }
    }
}

pub(super) fn execute(args: &BenchArgs) -> Done {
    if !(1..=1024).contains(&args.threads) {
        return Err(usage(&format!("--threads is {}, but must lie in 1..=1024", args.threads)));
    }
    let (backends, best) = match &args.kernel {
        None => (Backend::available(), Backend::best()),
        Some(name) => {
            let named = kernel(name)?;
            let mut both = vec![Backend::Scalar, named];
            both.dedup();
            (both, named)
        }
    };
    let data = data_root(args.data_dir.clone());
    let plan = BenchPlan { backends, best, quick: args.quick, threads: args.threads, data };
    let (brand, features) = (machine::brand(), machine::features());
    let names: Vec<&str> = Backend::available().into_iter().map(Backend::name).collect();
    if args.json {
        say(&json!({"event": "machine", "processor": brand, "features": features,
            "kernels": names, "quick": args.quick})
        .to_string());
    } else if !args.quiet {
        say(&format!("processor  {brand}"));
        say(&format!("features   {}", features.join(" ")));
        say(&format!("kernels    {}", names.join(" ")));
    }
    let sections = Section::value_variants();
    let wanted = |section: &&Section| args.only.is_empty() || args.only.contains(section);
    for section in sections.iter().filter(wanted) {
        if !args.json && !args.quiet {
            tell!("measuring {} ...", section.name());
        }
        for table in section.measure(&plan) {
            if args.json {
                table.json().iter().for_each(|row| say(&row.to_string()));
            } else {
                say(&format!("\n{}", table.text().trim_end()));
            }
        }
    }
    if args.json {
        say(&json!({"event": "done"}).to_string());
    }
    Ok(())
}

/// Back ends made ready on this thread.
fn kernels(backends: &[Backend]) -> Vec<(Backend, Kernel)> {
    backends.iter().map(|&backend| (backend, Kernel::start(backend))).collect()
}

/// What a reader of scalar times must know.
const SCALAR_NOTE: &str = "scalar: times are those of one panel of 32 columns";

/// Panels of an array that a back end is timed on: the law is slow, and one tells its rate.
fn panels_timed(backend: Backend, layout: Layout) -> usize {
    if backend == Backend::Scalar { 1 } else { layout.panels() }
}

/// Samples that are read together.
fn groups(samples: usize) -> impl Iterator<Item = Range<usize>> {
    (0..samples).step_by(TOGETHER).map(move |start| start..(start + TOGETHER).min(samples))
}

/// Billions of products a second.
fn giga(products: f64, seconds: f64) -> f64 {
    1e-9 * products / seconds
}
