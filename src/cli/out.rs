//! Standard output: one writer for all commands; and files that the user names.
//!
//! A line that cannot be written is an error of the command, whatever else went well: who reads a table that ends early
//! must not be told that all is done. Only a reader that has gone away (`| head`) is no fault, and ends quietly.

use std::io::{self, ErrorKind, Write};
use std::path::Path;
use std::sync::{Mutex, PoisonError};

use super::{Done, Failure};

/// The first line that could not be written, and why.
static FAULT: Mutex<Option<io::Error>> = Mutex::new(None);

fn note(result: io::Result<()>) {
    if let Err(error) = result {
        FAULT.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(error);
    }
}

/// Prints a line.
pub(super) fn say(line: &str) {
    let mut out = io::stdout().lock();
    note(out.write_all(line.as_bytes()).and_then(|()| out.write_all(b"\n")));
}

/// Prints bytes as they are.
pub(super) fn print(bytes: &[u8]) {
    note(io::stdout().write_all(bytes));
}

/// What kept output from being written, at the end of a command; nothing when its reader has gone away.
pub(super) fn fault() -> Option<String> {
    note(io::stdout().flush());
    let fault = FAULT.lock().unwrap_or_else(PoisonError::into_inner).take()?;
    let gone = fault.kind() == ErrorKind::BrokenPipe;
    (!gone)
        .then(|| format!("cannot write to standard output: {fault}; what was printed is not whole"))
}

/// Writes a file that the user named.
pub(super) fn write(path: &Path, bytes: &[u8]) -> Done {
    crate::lab::store::place::write_out(path, bytes).map_err(|error| Failure {
        code: 1,
        message: format!("cannot write {}: {error}", path.display()),
    })
}
