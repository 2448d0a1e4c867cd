//! Recorded streams: what environments showed, kept and given again, so that a run can be done again without them.
//!
//! ```text
//! entry     a reset or a step of so many environments: what each shows next; of a step also rewards, ends, and what was
//!           reached where an episode ended
//! record    entries in the order in which they happened, of environments that were learnt in and of others apart; and
//!           the state of the former as it was at the end
//! ```
//!
//! Everything is in the integers that the policy was shown, so the same record gives the same bits. See docs/MODEL.md, 5.4.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use std::ops::RangeInclusive;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use super::{
    Actions, EnvError, EnvSpec, Observations, Outcomes, Real, Shown, UnknownEnvironment, VecEnv,
    make,
};
use crate::chip::state::{Piece, Section, Seen, State, StateError, Visitor};

/// What some environments showed, entry after entry.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct ShownStream {
    /// Environments of each entry; negative where it is a reset.
    pub entries: Vec<i32>,
    /// What each shows next, `[entry][environment][value]`, 16 fractional bits; of dense ones.
    pub values: Vec<i32>,
    /// Lines that are on next, of sparse ones, and how many of each environment.
    pub lines: Vec<u32>,
    /// How many lines are on, `[entry][environment]`.
    pub line_counts: Vec<u32>,
    /// Rewards, `[step][environment]`, 16 fractional bits.
    pub rewards: Vec<i32>,
    /// `[step][environment]`: 0 goes on, 1 terminated, 2 truncated.
    pub ended: Vec<u8>,
    /// What was reached by those that ended, as `values`.
    pub reached_values: Vec<i32>,
    /// As `lines`.
    pub reached_lines: Vec<u32>,
    /// As `line_counts`.
    pub reached_line_counts: Vec<u32>,
}

/// A piece of state, as a record keeps it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct KeptPiece {
    /// Its name.
    pub name: String,
    /// What its numbers lie in.
    pub within: RangeInclusive<i64>,
    /// Its numbers.
    pub numbers: Vec<i64>,
}

/// What happened since a record was begun.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Record {
    /// In environments that were learnt in.
    pub training: ShownStream,
    /// In others.
    pub evaluation: ShownStream,
    /// State of the former at the end.
    pub state: Vec<KeptPiece>,
}

/// Where environments come from.
#[derive(Debug, Clone, Default)]
pub enum EnvSource {
    /// This program.
    #[default]
    Native,
    /// This program, and what they show is kept.
    Recorded(Arc<Mutex<Record>>),
    /// A record.
    Replayed(Arc<Mutex<Replaying>>),
}

/// A record that is given again.
#[derive(Debug, Default)]
pub struct Replaying {
    record: Record,
    training: Cursor,
    evaluation: Cursor,
}

impl Replaying {
    /// Gives another record from its beginning.
    pub fn begin(&mut self, record: Record) {
        *self = Self { record, ..Self::default() };
    }
}

/// How far a stream was read.
#[derive(Debug, Clone, Copy, Default)]
struct Cursor {
    entry: usize,
    values: usize,
    lines: usize,
    environments: usize,
    steps: usize,
    reached: usize,
    reached_values: usize,
    reached_lines: usize,
}

/// What environments are for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Purpose {
    /// Learning.
    Training,
    /// Looking.
    Evaluation,
}

fn lock<T>(shared: &Mutex<T>) -> MutexGuard<'_, T> {
    shared.lock().unwrap_or_else(PoisonError::into_inner)
}

impl EnvSource {
    /// `count` environments called `id`.
    ///
    /// # Errors
    /// When there is none of that name.
    pub fn make(
        &self,
        id: &str,
        seed: u64,
        count: usize,
        purpose: Purpose,
    ) -> Result<Box<dyn VecEnv>, UnknownEnvironment> {
        let inner = make(id, seed, count)?;
        Ok(match self {
            Self::Native => inner,
            Self::Recorded(record) => {
                Box::new(RecordedEnv { inner, record: Arc::clone(record), purpose })
            }
            Self::Replayed(replaying) => {
                let (spec, replaying) = (inner.spec().clone(), Arc::clone(replaying));
                let shown = Observations::default();
                Box::new(ReplayedEnv { spec, count, replaying, purpose, shown })
            }
        })
    }
}

impl ShownStream {
    fn push_shown(&mut self, shown: &Observations) {
        self.values.extend(shown.values.iter().map(|value| value.to_bits()));
        self.lines.extend_from_slice(&shown.active);
        for which in 0..shown.ends.len() {
            self.line_counts.push(shown.lines_of(which).len() as u32);
        }
    }

    fn push_reset(&mut self, count: usize, shown: &Observations) {
        self.entries.push(-(count as i32));
        self.push_shown(shown);
    }

    fn push_step(&mut self, spec: &EnvSpec, outcomes: &Outcomes) {
        self.entries.push(outcomes.rewards.len() as i32);
        self.push_shown(&outcomes.next);
        self.rewards.extend(outcomes.rewards.iter().map(|reward| reward.to_bits()));
        let ends = outcomes.terminated.iter().zip(&outcomes.truncated);
        for (which, (&over, &stopped)) in ends.enumerate() {
            self.ended.push(if over { 1 } else { u8::from(stopped) * 2 });
            if !(over || stopped) {
                continue;
            }
            match spec.shown {
                Shown::Dense(values) => {
                    let reached = outcomes.reached.values_of(which, values);
                    self.reached_values.extend(reached.iter().map(|value| value.to_bits()));
                }
                Shown::Sparse { .. } => {
                    let lines = outcomes.reached.lines_of(which);
                    self.reached_lines.extend_from_slice(lines);
                    self.reached_line_counts.push(lines.len() as u32);
                }
            }
        }
    }

    /// The next entry, if it is there and is what is asked for.
    fn next(
        &self,
        at: &mut Cursor,
        spec: &EnvSpec,
        (count, reset): (usize, bool),
        outcomes: &mut Outcomes,
    ) -> Option<()> {
        let signed = i32::try_from(count).ok()?;
        let wanted = if reset { -signed } else { signed };
        (*self.entries.get(at.entry)? == wanted).then_some(())?;
        at.entry += 1;
        outcomes.next.clear();
        match spec.shown {
            Shown::Dense(values) => {
                let shown = self.values.get(at.values..)?.get(..count * values)?;
                at.values += shown.len();
                outcomes.next.values.extend(shown.iter().map(|&value| Real::from_bits(value)));
            }
            Shown::Sparse { lines: all, .. } => {
                let counts = self.line_counts.get(at.environments..)?.get(..count)?;
                at.environments += count;
                for &on in counts {
                    let lines = taken(&self.lines, at.lines, on, all)?;
                    at.lines += lines.len();
                    outcomes.next.active.extend_from_slice(lines);
                    outcomes.next.ends.push(outcomes.next.active.len());
                }
            }
        }
        if reset {
            return Some(());
        }
        let rewards = self.rewards.get(at.steps..)?.get(..count)?;
        let ended = self.ended.get(at.steps..)?.get(..count)?;
        at.steps += count;
        outcomes.rewards.clear();
        outcomes.rewards.extend(rewards.iter().map(|&reward| Real::from_bits(reward)));
        outcomes.terminated.clear();
        outcomes.terminated.extend(ended.iter().map(|&end| end == 1));
        outcomes.truncated.clear();
        outcomes.truncated.extend(ended.iter().map(|&end| end == 2));
        outcomes.reached.clear();
        for (which, &end) in ended.iter().enumerate() {
            match (spec.shown, end) {
                (_, 3..) => return None,
                (Shown::Dense(values), 0) => {
                    let next = outcomes.next.values_of(which, values);
                    outcomes.reached.values.extend_from_slice(next);
                }
                (Shown::Dense(values), _) => {
                    let reached = self.reached_values.get(at.reached_values..)?.get(..values)?;
                    at.reached_values += values;
                    let reached = reached.iter().map(|&value| Real::from_bits(value));
                    outcomes.reached.values.extend(reached);
                }
                (Shown::Sparse { .. }, 0) => {
                    let lines = outcomes.next.lines_of(which);
                    outcomes.reached.active.extend_from_slice(lines);
                    outcomes.reached.ends.push(outcomes.reached.active.len());
                }
                (Shown::Sparse { lines: all, .. }, _) => {
                    let on = *self.reached_line_counts.get(at.reached)?;
                    at.reached += 1;
                    let lines = taken(&self.reached_lines, at.reached_lines, on, all)?;
                    at.reached_lines += lines.len();
                    outcomes.reached.active.extend_from_slice(lines);
                    outcomes.reached.ends.push(outcomes.reached.active.len());
                }
            }
        }
        Some(())
    }
}

/// So many lines from a place on, if there are as many and each is one of `all`.
fn taken(lines: &[u32], from: usize, count: u32, all: usize) -> Option<&[u32]> {
    let lines = lines.get(from..)?.get(..count as usize)?;
    lines.iter().all(|&line| (line as usize) < all).then_some(lines)
}

impl Record {
    const fn stream(&mut self, purpose: Purpose) -> &mut ShownStream {
        match purpose {
            Purpose::Training => &mut self.training,
            Purpose::Evaluation => &mut self.evaluation,
        }
    }

    /// Takes what was recorded, with the state of the environments, and begins anew.
    pub fn take(record: &Mutex<Self>, environments: &mut dyn VecEnv) -> Self {
        let mut keeper = Keeper(vec![]);
        let _ = environments.visit(&mut keeper);
        Self { state: keeper.0, ..std::mem::take(&mut *lock(record)) }
    }
}

/// Keeps pieces of numbers, which is what environments are made of.
struct Keeper(Vec<KeptPiece>);

impl Visitor for Keeper {
    fn halves(&mut self, _: &Piece<'_>, _: [usize; 2], _: &dyn Fn() -> Vec<u16>) -> Seen<Vec<u16>> {
        Ok(None)
    }

    fn bits(
        &mut self,
        _: &Piece<'_>,
        _: [usize; 2],
        _: &dyn Fn() -> bitvec::vec::BitVec<u8, bitvec::order::Lsb0>,
    ) -> Seen<bitvec::vec::BitVec<u8, bitvec::order::Lsb0>> {
        Ok(None)
    }

    fn numbers(&mut self, piece: &Piece<'_>, values: &[i64]) -> Seen<Vec<i64>> {
        let (name, within) = (piece.name.into(), piece.within.clone());
        self.0.push(KeptPiece { name, within, numbers: values.to_vec() });
        Ok(None)
    }

    fn rows(&mut self, _: &Piece<'_>, _: usize, _: &dyn Fn() -> Vec<i64>) -> Seen<Vec<i64>> {
        Ok(None)
    }
}

/// Environments whose showing is kept.
#[derive(Debug)]
struct RecordedEnv {
    inner: Box<dyn VecEnv>,
    record: Arc<Mutex<Record>>,
    purpose: Purpose,
}

impl VecEnv for RecordedEnv {
    fn spec(&self) -> &EnvSpec {
        self.inner.spec()
    }

    fn count(&self) -> usize {
        self.inner.count()
    }

    fn reset(&mut self, shown: &mut Observations) {
        self.inner.reset(shown);
        lock(&self.record).stream(self.purpose).push_reset(self.inner.count(), shown);
    }

    fn show(&self, shown: &mut Observations) {
        self.inner.show(shown);
    }

    fn step(&mut self, actions: Actions<'_>, outcomes: &mut Outcomes) -> Result<(), EnvError> {
        self.inner.step(actions, outcomes)?;
        lock(&self.record).stream(self.purpose).push_step(self.inner.spec(), outcomes);
        Ok(())
    }

    fn picture(&self, which: usize) -> String {
        self.inner.picture(which)
    }
}

impl State for RecordedEnv {
    fn visit(&mut self, visitor: &mut dyn Visitor) -> Result<(), StateError> {
        self.inner.visit(visitor)
    }
}

/// Environments that show what others showed, whatever they are told.
#[derive(Debug)]
struct ReplayedEnv {
    spec: EnvSpec,
    count: usize,
    replaying: Arc<Mutex<Replaying>>,
    purpose: Purpose,
    shown: Observations,
}

impl ReplayedEnv {
    fn next(&self, reset: bool, outcomes: &mut Outcomes) -> Option<()> {
        let mut replaying = lock(&self.replaying);
        let Replaying { record, training, evaluation } = &mut *replaying;
        let (stream, at) = match self.purpose {
            Purpose::Training => (&record.training, training),
            Purpose::Evaluation => (&record.evaluation, evaluation),
        };
        stream.next(at, &self.spec, (self.count, reset), outcomes)
    }
}

impl VecEnv for ReplayedEnv {
    fn spec(&self) -> &EnvSpec {
        &self.spec
    }

    fn count(&self) -> usize {
        self.count
    }

    fn reset(&mut self, shown: &mut Observations) {
        let mut outcomes = Outcomes::default();
        if self.next(true, &mut outcomes).is_none() {
            // the step that follows says so: a record that ended has none
            lock(&self.replaying).begin(Record::default());
            outcomes.next.clear();
            match self.spec.shown {
                Shown::Dense(values) => {
                    outcomes.next.values.resize(self.count * values, Real::ZERO);
                }
                Shown::Sparse { .. } => outcomes.next.ends.resize(self.count, 0),
            }
        }
        shown.clone_from(&outcomes.next);
        self.shown = outcomes.next;
    }

    fn show(&self, shown: &mut Observations) {
        shown.clone_from(&self.shown);
    }

    fn step(&mut self, _: Actions<'_>, outcomes: &mut Outcomes) -> Result<(), EnvError> {
        self.next(false, outcomes).ok_or_else(|| EnvError {
            id: self.spec.id.to_string(),
            which: 0,
            found: "is replayed from a record that has no such step".into(),
            allowed: "a record can be replayed by the configuration alone that it was made with"
                .into(),
        })?;
        self.shown.clone_from(&outcomes.next);
        Ok(())
    }
}

impl State for ReplayedEnv {
    fn visit(&mut self, visitor: &mut dyn Visitor) -> Result<(), StateError> {
        let kept = lock(&self.replaying).record.state.clone();
        for KeptPiece { name, within, numbers } in kept {
            let piece = Piece { name: &name, section: Some(Section::Task), within };
            let _ = visitor.numbers(&piece, &numbers)?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What a record of two environments that are shown as lines gives, after a change of it: whether it begins, and whether it
    /// has a step.
    fn replayed(change: fn(&mut ShownStream)) -> (bool, bool) {
        let (id, count) = ("Foray-v0", 2);
        let record = Arc::default();
        let source = EnvSource::Recorded(Arc::clone(&record));
        let mut environments = source.make(id, 1, count, Purpose::Training).unwrap();
        let (mut shown, mut outcomes) = (Observations::default(), Outcomes::default());
        environments.reset(&mut shown);
        environments.step(Actions::Discrete(&[0, 1]), &mut outcomes).unwrap();
        let mut kept = Record::take(&record, &mut *environments);
        change(&mut kept.training);
        let replaying = Arc::<Mutex<Replaying>>::default();
        lock(&replaying).begin(kept);
        let source = EnvSource::Replayed(replaying);
        let mut again = source.make(id, 1, count, Purpose::Training).unwrap();
        let mut same = Observations::default();
        again.reset(&mut same);
        let stepped = again.step(Actions::Discrete(&[0, 1]), &mut outcomes);
        (same == shown, stepped.is_ok())
    }

    #[test]
    fn a_line_that_does_not_exist_is_no_line_of_a_record() {
        assert_eq!(replayed(|_| {}), (true, true));
        assert_eq!(replayed(|stream| stream.lines[0] = 190), (false, false));
        assert_eq!(replayed(|stream| *stream.lines.last_mut().unwrap() = u32::MAX), (true, false));
    }
}
