//! Work without the interpreter's lock, the user's wish to stop, and threads that a fork took away.

use std::ops::{Deref, DerefMut};
use std::time::{Duration, Instant};

use dalean::{Backend, Machine};
use pyo3::prelude::*;

use crate::errors::Raised;

/// Time between two questions whether the user wants to stop.
const ASKED: Duration = Duration::from_millis(20);
/// Time between two calls that tell how far work is.
const TOLD: Duration = Duration::from_millis(100);

/// Asks the interpreter, now and then, whether to go on, and tells it how far work is.
pub(crate) struct Watch {
    asked: Instant,
    told: Option<Instant>,
    callback: Option<Py<PyAny>>,
    /// Why to stop.
    pub(crate) error: Option<PyErr>,
}

impl Watch {
    pub(crate) fn new(callback: Option<Py<PyAny>>) -> Self {
        Self { asked: Instant::now(), told: None, callback, error: None }
    }

    /// Whether to go on. `told` is made into arguments of the callback when it is time to.
    pub(crate) fn go_on<'t>(
        &mut self,
        kind: &str,
        told: impl FnOnce() -> Vec<(&'t str, f64)>,
    ) -> bool {
        if self.error.is_some() {
            return false;
        }
        let now = Instant::now();
        if now.duration_since(self.asked) < ASKED {
            return true;
        }
        self.asked = now;
        let due = self.callback.is_some()
            && self.told.is_none_or(|last| now.duration_since(last) >= TOLD);
        let told = due.then(told);
        if due {
            self.told = Some(now);
        }
        self.error = Python::attach(|py| {
            py.check_signals()?;
            if let (Some(callback), Some(told)) = (&self.callback, told) {
                let dict = pyo3::types::PyDict::new(py);
                for (name, value) in told {
                    dict.set_item(name, value)?;
                }
                callback.call1(py, (kind, dict))?;
            }
            Ok(())
        })
        .err();
        self.error.is_none()
    }

    /// Tells something at once.
    pub(crate) fn tell(&mut self, kind: &str, text: &str) -> bool {
        if self.error.is_none()
            && let Some(callback) = &self.callback
        {
            self.error = Python::attach(|py| callback.call1(py, (kind, text)).err());
        }
        self.error.is_none()
    }
}

/// Loops by name, else the fastest.
pub(crate) fn backend(kernel: Option<&str>) -> Result<Backend, Raised> {
    Ok(match kernel {
        Some(name) => Backend::named(name)?,
        None => Backend::best(),
    })
}

/// What a run is carried out with.
pub(crate) fn machine(kernel: Option<&str>, threads: usize) -> Result<Machine, Raised> {
    Ok(Machine::new(backend(kernel)?, threads)?)
}

/// What has threads of its own, which a fork takes away: a child makes it anew, and neither waits for them nor ends them.
#[derive(Debug)]
pub(crate) struct Held<T> {
    /// There until it is dropped.
    inner: Option<T>,
    process: u32,
    threads: usize,
}

impl<T> Held<T> {
    pub(crate) fn new(inner: T, threads: usize) -> Self {
        Self { inner: Some(inner), process: std::process::id(), threads }
    }

    fn lost_threads(&self) -> bool {
        self.threads > 1 && std::process::id() != self.process
    }

    /// The thing itself; in a child of a fork the one that `again` makes of it, with so many threads.
    pub(crate) fn mended(
        &mut self,
        again: impl FnOnce(&mut T, usize) -> Result<T, Raised>,
    ) -> Result<&mut T, Raised> {
        if self.lost_threads() {
            let threads = self.threads;
            let made = again(self, threads)?;
            std::mem::forget(self.inner.replace(made));
            self.process = std::process::id();
        }
        Ok(self)
    }

    /// Puts another in its place, made with as many threads.
    pub(crate) fn renew(
        &mut self,
        again: impl FnOnce(usize) -> Result<T, Raised>,
    ) -> Result<&mut T, Raised> {
        let made = again(self.threads)?;
        let old = self.inner.replace(made);
        if self.lost_threads() {
            std::mem::forget(old);
        }
        self.process = std::process::id();
        Ok(self)
    }
}

impl<T> Deref for Held<T> {
    type Target = T;

    fn deref(&self) -> &T {
        self.inner.as_ref().expect("there until it is dropped")
    }
}

impl<T> DerefMut for Held<T> {
    fn deref_mut(&mut self) -> &mut T {
        self.inner.as_mut().expect("there until it is dropped")
    }
}

impl<T> Drop for Held<T> {
    fn drop(&mut self) {
        let inner = self.inner.take();
        if self.lost_threads() {
            std::mem::forget(inner);
        }
    }
}
