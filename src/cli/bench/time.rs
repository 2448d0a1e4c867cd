//! Times of arms that run in turn.
//!
//! ```text
//! slot    one run untimed, then as many runs as make 0.2 ms, timed together
//! turn    an arm takes a slot while its share of the time spent so far is not used up
//! best    of all slots; the median beside it says how disturbed the machine was
//! ```
//!
//! Arms of one race see the same machine in the same minute, so their ratios hold where their times do not.
#![expect(clippy::disallowed_types, reason = "a bench is about wall-clock time")]

use std::time::Instant;

/// Seconds of a slot, at least.
const SLOT_SECONDS: f64 = 2e-4;
/// Slots every arm gets, however slow it is.
const SLOTS_MIN: usize = 3;

/// Something to time.
pub(super) struct Arm<'a> {
    /// Runs some times; gives the seconds of one. The flag asks for an untimed run before.
    slot: Box<dyn FnMut(bool, usize) -> f64 + 'a>,
    runs: usize,
    spent: f64,
    seconds: Vec<f64>,
}

/// Seconds of one run of an arm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Time {
    /// Of the fastest slot.
    pub(super) best: f64,
    /// Of the middle slot.
    pub(super) median: f64,
}

/// Times `runs` runs, after one untimed run if `warm`.
fn timed(warm: bool, runs: usize, run: &mut dyn FnMut()) -> f64 {
    if warm {
        run();
    }
    let start = Instant::now();
    for _ in 0..runs {
        run();
    }
    start.elapsed().as_secs_f64() / runs as f64
}

impl<'a> Arm<'a> {
    /// An arm that has run no slot yet.
    pub(super) fn new(mut run: impl FnMut() + 'a) -> Self {
        let slot = move |warm, runs| timed(warm, runs, &mut run);
        Self { slot: Box::new(slot), runs: 1, spent: 0.0, seconds: Vec::new() }
    }

    /// Finds how many runs make a slot.
    fn prepare(&mut self) {
        let mut once = (self.slot)(false, 1);
        if once < SLOT_SECONDS {
            once = (self.slot)(true, 1);
        }
        self.runs = (SLOT_SECONDS / once.max(1e-9)).ceil().max(1.0) as usize;
    }

    fn take_slot(&mut self) -> f64 {
        let warm = self.runs > 1;
        let once = (self.slot)(warm, self.runs);
        self.seconds.push(once);
        let spent = once * (self.runs + usize::from(warm)) as f64;
        self.spent += spent;
        spent
    }

    fn time(mut self) -> Time {
        self.seconds.sort_by(f64::total_cmp);
        Time { best: self.seconds[0], median: self.seconds[self.seconds.len() / 2] }
    }
}

/// Runs arms in turn for about `seconds`, and gives their times in order.
pub(super) fn race(mut arms: Vec<Arm<'_>>, seconds: f64) -> Vec<Time> {
    arms.iter_mut().for_each(Arm::prepare);
    let share = 1.0 / arms.len() as f64;
    let mut spent = 0.0;
    loop {
        let before = spent;
        for arm in &mut arms {
            if has_turn(arm.seconds.len(), arm.spent, spent * share, spent < seconds) {
                spent += arm.take_slot();
            }
        }
        if spent == before {
            return arms.into_iter().map(Arm::time).collect();
        }
    }
}

/// Whether an arm takes a slot: always for its first few, then while there is time and its share is not used up.
fn has_turn(slots: usize, spent: f64, share: f64, time_left: bool) -> bool {
    slots < SLOTS_MIN || time_left && spent <= share
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::cell::Cell;

    #[test]
    fn a_slow_arm_gets_its_least_and_then_waits_for_its_share() {
        assert!(has_turn(SLOTS_MIN - 1, 9.0, 1.0, false));
        assert!(!has_turn(SLOTS_MIN, 9.0, 1.0, true) && !has_turn(SLOTS_MIN, 0.5, 1.0, false));
        assert!(has_turn(SLOTS_MIN, 1.0, 1.0, true));
    }

    #[test]
    fn a_race_ends_and_times_every_arm() {
        let [few, many] = [Cell::new(0), Cell::new(0)];
        let count = |cell: &Cell<usize>, loops: u64| {
            cell.set(cell.get() + 1);
            std::hint::black_box((0..loops).fold(1u64, |a, i| std::hint::black_box(a ^ i)));
        };
        let arms = vec![Arm::new(|| count(&few, 400_000)), Arm::new(|| count(&many, 100))];
        let times = race(arms, 0.01);
        assert!(few.get() >= SLOTS_MIN && many.get() > few.get());
        assert!(times[0].best > times[1].best);
        assert!(times.iter().all(|time| time.best > 0.0 && time.best <= time.median));
    }
}
