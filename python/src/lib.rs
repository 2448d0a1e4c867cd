//! dalean from Python, the part in Rust: calls into the library, arrays in and out, errors as exceptions.
//!
//! The package `dalean` (folder `dalean`) stands on it and holds what users see. Long work is done without the interpreter's
//! lock, and asks every few milliseconds whether the user wants to stop. Nothing here decides a result.

mod arrays;
mod classifier;
mod errors;
mod network;
mod policy;
mod runs;
mod waits;

#[pyo3::pymodule]
mod _dalean {
    use pyo3::prelude::*;

    #[pymodule_export]
    use crate::classifier::Classifier;
    #[pymodule_export]
    use crate::network::Network;
    #[pymodule_export]
    use crate::policy::PolicyLearner;
    #[pymodule_export]
    use crate::runs::{
        chip_summaries, chips, configuration, evaluate, price, report, resume, seconds, sweep,
        sweep_part, sweep_runs, train, verify,
    };

    /// The command line: the program with these arguments, its own name first. Gives its exit code.
    #[pyfunction]
    fn main(py: Python<'_>, arguments: Vec<std::ffi::OsString>) -> u8 {
        py.detach(|| dalean::cli::run_with(arguments))
    }

    /// Version of the arithmetic: runs of one version give the same bits.
    #[pymodule_export]
    const ARITHMETIC: u32 = dalean::ARITHMETIC;

    /// Version of the program.
    #[pymodule_export]
    const VERSION: &str = env!("CARGO_PKG_VERSION");
}
