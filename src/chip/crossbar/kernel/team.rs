//! Threads that share the parts of one operation.
//!
//! ```text
//! caller    publishes a task, works on it too, closes it, waits for who is still inside
//! helper    spins a while for a task, yields a while, then sleeps; enters a task only while it is open
//! gate      turn << 32 | open << 31 | helpers inside
//! ```
//!
//! Threads live as long as their team, so an operation costs no start of a thread, and each has its back end ready.
//! A task is closed once all its parts are taken: nobody waits for a helper that the system has not let in, only for
//! one that holds a part. That, and sleeping after a short while, keeps a busy machine from standing still.
//! Each part has a home, the thread whose cache knows its cells; a thread takes the parts at home first, then those
//! that are left. Which thread works on a part changes no bit: parts are independent, and results lie in their order.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use std::any::Any;
use std::cell::UnsafeCell;
use std::hint::spin_loop;
use std::io;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::atomic::Ordering::{Acquire, Relaxed, SeqCst};
use std::sync::atomic::{AtomicBool, AtomicU64};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::{self, Builder, JoinHandle, Thread};

use super::{Backend, Kernel};

/// Looks at the gate before a thread yields: some microseconds, as the serial parts between two operations take.
const SPINS: u32 = 400;
/// Yields before a thread sleeps.
const YIELDS: u32 = 40;

const TURN: u64 = 1 << 32;
const OPEN: u64 = 1 << 31;
const INSIDE: u64 = OPEN - 1;

/// What a thread of a team does for one operation, given its place in the team; borrowed from the caller's stack.
type Work<'a> = dyn Fn(&Kernel, usize) + Sync + 'a;

/// A published task.
struct Task {
    /// Lives until the caller has seen the gate closed and empty.
    work: *const Work<'static>,
    caller: Thread,
}

/// What a team shares.
struct Shared {
    gate: AtomicU64,
    /// Written by the caller while the gate is closed and empty; read by helpers that are inside.
    task: UnsafeCell<Option<Task>>,
    /// Whether each helper sleeps, or is about to.
    asleep: Vec<AtomicBool>,
    /// Whether the caller sleeps, or is about to.
    waiting: AtomicBool,
    /// Helpers end when the next turn begins.
    over: AtomicBool,
    /// The first panic of a helper.
    panic: Mutex<Option<Box<dyn Any + Send>>>,
}

// SAFETY: `task` is the only field that is not shared by itself. It is written only by the thread that holds the team
// exclusively, while the gate is closed and nobody is inside, and read only by helpers inside; entering and leaving
// are atomic steps of the gate that order those accesses. `Work` may be called from any thread as it is `Sync`.
unsafe impl Sync for Shared {}
// SAFETY: the pointer in `task` is used only as above, wherever the value lives; everything else can be sent.
unsafe impl Send for Shared {}

/// Some threads, of which the caller is one.
pub struct Team {
    backend: Backend,
    shared: Arc<Shared>,
    helpers: Vec<JoinHandle<()>>,
}

impl std::fmt::Debug for Team {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Team").field("threads", &self.threads()).finish_non_exhaustive()
    }
}

impl Team {
    /// The caller alone.
    #[must_use]
    pub fn of_one(backend: Backend) -> Self {
        Self { backend, shared: Arc::new(Shared::new(0)), helpers: vec![] }
    }

    /// A team of so many threads, the caller among them, with a back end that is ready on each.
    ///
    /// # Errors
    /// When the system gives no threads; those it gave have ended by then.
    pub fn new(backend: Backend, threads: usize) -> io::Result<Self> {
        Self::with(backend, threads, thread::Builder::new)
    }

    fn with(backend: Backend, threads: usize, builder: fn() -> Builder) -> io::Result<Self> {
        let helpers = threads.saturating_sub(1);
        let shared = Arc::new(Shared::new(helpers));
        // a team that stays incomplete ends those who came
        let mut team = Self { backend, shared, helpers: Vec::with_capacity(helpers) };
        for index in 0..helpers {
            let shared = Arc::clone(&team.shared);
            let named = builder().name(format!("helper {}", index + 1));
            team.helpers.push(named.spawn(move || help(&shared, backend, index))?);
        }
        Ok(team)
    }

    /// Threads, the caller among them.
    #[must_use]
    pub fn threads(&self) -> usize {
        self.helpers.len() + 1
    }

    /// The thread at home in a place, such as a column, of `places`: neighbours have the same home.
    #[must_use]
    pub fn home(&self, place: usize, places: usize) -> usize {
        place * self.threads() / places.max(1)
    }

    /// Maps every part, on all threads, with the home of each; results lie in the order of parts.
    ///
    /// # Panics
    /// When `map` does; the other parts may then be done or not.
    pub fn each<T: Send, R: Send>(
        &mut self,
        parts: Vec<(usize, T)>,
        map: impl Fn(&Kernel, T) -> R + Sync,
    ) -> Vec<R> {
        if self.helpers.is_empty() || parts.len() < 2 {
            return self.alone(parts.into_iter().map(|(_, part)| part).collect(), map);
        }
        let slots: Vec<_> =
            parts.into_iter().map(|(home, part)| (home, Mutex::new((Some(part), None)))).collect();
        self.run(&|kernel: &Kernel, place: usize| {
            let home = slots.iter().filter(|slot| slot.0 == place);
            // from the end, where their own thread comes last
            let away = slots.iter().filter(|slot| slot.0 != place).rev();
            for (_, slot) in home.chain(away) {
                let part = lock(slot).0.take();
                if let Some(part) = part {
                    let result = map(kernel, part);
                    lock(slot).1 = Some(result);
                }
            }
        });
        let results = slots.into_iter().map(|(_, slot)| {
            let (_, result) = slot.into_inner().unwrap_or_else(PoisonError::into_inner);
            result.expect("nobody panicked, so every part was done")
        });
        results.collect()
    }

    /// [`Self::each`] on the caller's thread.
    pub fn alone<T, R>(&self, parts: Vec<T>, map: impl Fn(&Kernel, T) -> R) -> Vec<R> {
        let kernel = Kernel::start(self.backend);
        parts.into_iter().map(|part| map(&kernel, part)).collect()
    }

    /// Does `work` on this thread and on every helper that comes before it is done here.
    fn run(&mut self, work: &Work<'_>) {
        let shared = &*self.shared;
        // SAFETY: only the lifetime is forgotten. The pointer is used by helpers inside the gate alone, and this
        // function returns, or unwinds, only after it has closed the gate and seen it empty.
        let forgotten = unsafe { std::mem::transmute::<&Work<'_>, &'static Work<'static>>(work) };
        let task = Task { work: forgotten, caller: thread::current() };
        // SAFETY: the team is held exclusively, and the last `run` left the gate closed and empty.
        unsafe { *shared.task.get() = Some(task) };
        let turn = shared.gate.load(Relaxed) & !(TURN - 1);
        shared.gate.store(turn.wrapping_add(TURN) | OPEN, SeqCst);
        self.wake();
        let own = catch_unwind(AssertUnwindSafe(|| work(&Kernel::start(self.backend), 0)));
        shared.gate.fetch_and(!OPEN, SeqCst);
        shared.wait_until_empty();
        let theirs = lock(&shared.panic).take();
        if let Some(panic) = own.err().or(theirs) {
            resume_unwind(panic);
        }
    }

    /// Wakes helpers that sleep. The gate has been set before.
    fn wake(&self) {
        for (asleep, helper) in self.shared.asleep.iter().zip(&self.helpers) {
            if asleep.swap(false, SeqCst) {
                helper.thread().unpark();
            }
        }
    }
}

impl Drop for Team {
    fn drop(&mut self) {
        self.shared.over.store(true, SeqCst);
        self.shared.gate.fetch_add(TURN, SeqCst);
        self.wake();
        for helper in self.helpers.drain(..) {
            // a helper catches what panics in it
            let _ = helper.join();
        }
    }
}

impl Shared {
    fn new(helpers: usize) -> Self {
        Self {
            gate: AtomicU64::new(0),
            task: UnsafeCell::new(None),
            asleep: (0..helpers).map(|_| AtomicBool::new(false)).collect(),
            waiting: AtomicBool::new(false),
            over: AtomicBool::new(false),
            panic: Mutex::new(None),
        }
    }

    /// Waits for helpers that are inside; the gate is closed.
    fn wait_until_empty(&self) {
        let empty = || self.gate.load(SeqCst) & INSIDE == 0;
        while !patient(empty) {
            self.waiting.store(true, SeqCst);
            if !empty() {
                thread::park();
            }
            self.waiting.store(false, SeqCst);
        }
    }

    /// Enters the task of a turn, unless it is closed.
    fn enter(&self, turn: u64) -> bool {
        let enter = |word: u64| (word & !INSIDE == turn | OPEN).then_some(word + 1);
        self.gate.fetch_update(Acquire, Relaxed, enter).is_ok()
    }
}

/// Nobody holds a lock while it could panic.
fn lock<T>(slot: &Mutex<T>) -> MutexGuard<'_, T> {
    slot.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Looks often, then less often, whether something holds. Gives up after a while.
fn patient(holds: impl Fn() -> bool) -> bool {
    for _ in 0..SPINS {
        if holds() {
            return true;
        }
        spin_loop();
    }
    for _ in 0..YIELDS {
        if holds() {
            return true;
        }
        thread::yield_now();
    }
    false
}

/// What a helper does until its team is over.
fn help(shared: &Shared, backend: Backend, index: usize) {
    let kernel = Kernel::start(backend);
    let mut seen = 0;
    loop {
        let turn = || shared.gate.load(SeqCst) & !(TURN - 1);
        let begun = || turn() != seen;
        while !patient(begun) {
            shared.asleep[index].store(true, SeqCst);
            if !begun() {
                thread::park();
            }
            shared.asleep[index].store(false, SeqCst);
        }
        if shared.over.load(SeqCst) {
            return;
        }
        seen = turn();
        if !shared.enter(seen) {
            continue;
        }
        // SAFETY: this helper is inside: the caller wrote the task before it opened the gate, and waits with the next
        // one until this helper has left.
        let task = unsafe { (*shared.task.get()).as_ref() }.expect("an open gate has a task");
        let caller = task.caller.clone();
        // SAFETY: the caller keeps what the pointer leads to until this helper has left.
        let work = unsafe { &*task.work };
        if let Err(panic) = catch_unwind(AssertUnwindSafe(|| work(&kernel, index + 1))) {
            lock(&shared.panic).get_or_insert(panic);
        }
        shared.gate.fetch_sub(1, SeqCst);
        if shared.waiting.load(SeqCst) {
            caller.unpark();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn team(threads: usize) -> Team {
        Team::new(Backend::best(), threads).unwrap()
    }

    #[test]
    fn results_lie_in_the_order_of_parts_however_many_threads_there_are() {
        for threads in 1..=4 {
            let mut team = team(threads);
            assert_eq!(team.threads(), threads);
            for parts in [0, 1, 2, 3, 50] {
                let some = (0..parts).map(|part| (team.home(part, parts), part as u64)).collect();
                let squares = team.each(some, |_, part| part * part);
                assert_eq!(squares, (0..parts as u64).map(|part| part * part).collect::<Vec<_>>());
            }
        }
    }

    #[test]
    fn threads_that_the_system_refuses_are_an_error() {
        let huge = || Builder::new().stack_size(1 << 60);
        assert!(Team::with(Backend::best(), 3, huge).is_err());
        assert_eq!(Team::with(Backend::best(), 1, huge).unwrap().threads(), 1);
    }

    #[test]
    fn parts_may_borrow_from_the_caller() {
        let mut numbers = vec![0u32; 64];
        let base = 7;
        let mut team = team(3);
        for _ in 0..2000 {
            let parts: Vec<_> = (0..).zip(numbers.chunks_mut(5)).collect();
            team.each(parts, |_, part| part.iter_mut().for_each(|number| *number += base));
        }
        assert!(numbers.iter().all(|&number| number == 14_000));
    }

    #[test]
    fn helpers_do_take_parts_and_wake_up_for_them() {
        let mut team = team(2);
        for _ in 0..3 {
            while !team.shared.asleep[0].load(SeqCst) {
                thread::yield_now();
            }
            let here = thread::current().id();
            let both = std::sync::Barrier::new(2);
            let others = team.each(vec![(0, ()), (0, ())], |_, ()| {
                both.wait();
                thread::current().id() != here
            });
            assert_eq!(others.iter().filter(|&&other| other).count(), 1);
        }
    }

    #[test]
    fn parts_are_done_at_home_where_their_thread_comes() {
        let mut team = team(2);
        let here = thread::current().id();
        let both = std::sync::Barrier::new(2);
        // both threads are inside before either takes a second part
        let parts = vec![(0, true), (1, true), (0, false), (1, false)];
        let at_caller = team.each(parts, |_, wait| {
            if wait {
                both.wait();
            }
            thread::current().id() == here
        });
        assert_eq!(at_caller[..2], [true, false]);
        assert_eq!([0, 1, 2, 3].map(|place| team.home(place, 4)), [0, 0, 1, 1]);
    }

    #[test]
    fn a_panic_reaches_the_caller_and_the_team_goes_on() {
        let mut team = team(2);
        for parts in [2, 40] {
            let panicked = catch_unwind(AssertUnwindSafe(|| {
                let some = (0..parts).map(|part| (part % 2, part)).collect();
                team.each(some, |_, part: usize| assert!(part != 1, "part one"))
            }));
            assert!(panicked.is_err());
            assert_eq!(team.each(vec![(0, 1), (1, 2)], |_, part: usize| part + 1), [2, 3]);
        }
    }
}
