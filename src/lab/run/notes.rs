//! What a run shows that its user should know, seen in its records: nothing is guessed from the configuration.
//!
//! ```text
//! clipped   of a layer and an epoch, more than 1 in 20 conversions saturated, or more than half of its table indices or
//!           gates lay at an end, or more than half of its requests were cut by the bound of a write; of the outputs,
//!           which lie at an end where they are sure, more than three quarters of the table indices
//! still     a layer received no pulse in an epoch, at whose start the schedule had left 1/16 of its rate at least
//! mute      the units of a layer put out the same whatever was shown
//! forgot    an epoch knows less than half of the right answers of an earlier one
//! worn      cells that were sent as many pulses as they take, and the first epoch with one
//! chance    (correct - constant)^2 <= 9 constant (total - constant) / total, of the test, else of the last epoch;
//!           constant: right answers of always naming the most frequent class. Of fewer than 50 answers, and where all
//!           are right, correct <= constant
//! ```
//!
//! [`notes`] is what terminal, pages and tables show. The notes in a receipt are the older law of totals over a whole
//! training, and what calibration found; they stay as they are, so that receipts of earlier programs are still true.

use crate::chip::ledger::Event;
use crate::lab::store::record::{EpochRecord, Note, Receipt, Score, TestRecord};
use crate::learn::driver::Driver;

/// What ends at a rail or a bound: its name, the event, of what, and what share is too much of hidden layers and of the
/// outputs.
const CLIPS: [(&str, Event, Event, [[u64; 2]; 2]); 4] = [
    ("conversions", Event::SaturatedConversions, Event::Conversions, [[1, 20]; 2]),
    ("tables", Event::SaturatedLookUps, Event::LookUps, [[1, 2], [3, 4]]),
    ("gates", Event::SaturatedGates, Event::Multiplies, [[1, 2]; 2]),
    ("requests", Event::Bounded, Event::Requested, [[1, 2]; 2]),
];
/// Steps of the shift after which a schedule has left so little that no pulse is no wonder.
const LATE: u32 = 4;
/// Answers of fewer examples than this are counted as they are.
const FEW: u64 = 50;

/// The worst epoch of something, and how many were too bad.
#[derive(Debug, Clone, Copy, Default)]
struct Worst {
    epoch: u32,
    some: u64,
    all: u64,
    epochs: u32,
}

impl Worst {
    fn see(&mut self, epoch: u32, some: u64, all: u64) {
        self.epochs += 1;
        // some / all > self.some / self.all
        let worse =
            u128::from(some) * u128::from(self.all) > u128::from(self.some) * u128::from(all);
        if self.epochs == 1 || worse {
            (self.epoch, self.some, self.all) = (epoch, some, all);
        }
    }
}

/// What the records of a layer showed.
#[derive(Debug, Clone, Default)]
struct LayerSeen {
    /// Counts of [`CLIPS`] so far.
    counts: [[u64; 2]; CLIPS.len()],
    pulses: u64,
    /// Shift of the rate at first, and after the last record.
    shifts: [u32; 2],
    clips: [Worst; CLIPS.len()],
    still: Worst,
    mute: Worst,
}

/// Looks at the records of a run, one after the other.
#[derive(Debug, Clone, Default)]
pub(super) struct Watcher {
    layers: Vec<LayerSeen>,
    best: u64,
    worn: Option<Note>,
    forgot: Option<Note>,
    answers: Option<Score>,
}

impl Watcher {
    /// Takes the next record, in the order of epochs; notes of what it shows for the first time.
    pub(super) fn look(&mut self, record: &EpochRecord) -> Vec<Note> {
        let epoch = record.epoch;
        let mut new = Vec::new();
        self.layers.resize_with(record.layers.len(), LayerSeen::default);
        let outputs = record.layers.last().map(|layer| layer.layer);
        for (seen, layer) in self.layers.iter_mut().zip(&record.layers) {
            let pathways = || record.pathways.iter().filter(|one| one.layer == layer.layer);
            let total = |event: Event| -> u64 {
                pathways().filter_map(|one| one.training.get(event.name())).sum()
            };
            let before = (seen.counts, seen.pulses);
            let all_of = |event: Event| match event {
                // what is normalised is scaled in place of looked up
                Event::LookUps => total(event) + total(Event::Scalings),
                _ => total(event),
            };
            seen.counts = CLIPS.map(|(_, some, all, _)| [total(some), all_of(all)]);
            seen.pulses = total(Event::PulsesAttempted);
            if epoch == 0 {
                seen.shifts = [layer.rate_shift; 2];
                continue;
            }
            let [first, before_it] = seen.shifts;
            let late = before_it.saturating_sub(first) > LATE;
            seen.shifts[1] = layer.rate_shift;
            for (at, (of, _, _, most)) in CLIPS.into_iter().enumerate() {
                let [some, all] =
                    [0, 1].map(|n| seen.counts[at][n].saturating_sub(before.0[at][n]));
                let [part, whole] = most[usize::from(outputs == Some(layer.layer))];
                if some.saturating_mul(whole) > all.saturating_mul(part) {
                    seen.clips[at].see(epoch, some, all);
                    new.extend(
                        clipped(layer.layer, of, seen.clips[at])
                            .filter(|_| seen.clips[at].epochs == 1),
                    );
                }
            }
            if seen.pulses == before.1 && !late {
                seen.still.see(epoch, 1, 1);
                new.extend(still(layer.layer, seen.still).filter(|_| seen.still.epochs == 1));
            }
            if layer.mute == Some(true) {
                seen.mute.see(epoch, 1, 1);
                new.extend(mute(layer.layer, seen.mute).filter(|_| seen.mute.epochs == 1));
            }
        }
        new.extend(self.wear(record));
        self.answers = record.outcome.answers().filter(|_| epoch > 0);
        if let Some(Score { correct, .. }) = record.outcome.answers() {
            if correct.saturating_mul(2) < self.best && self.forgot.is_none() {
                self.forgot = Some(Note::Forgot { epoch, correct, best: self.best });
                new.extend(self.forgot.clone());
            }
            self.best = self.best.max(correct);
        }
        new
    }

    /// Takes what is worn out; a note of the first cell.
    fn wear(&mut self, record: &EpochRecord) -> Option<Note> {
        let wear = record.pathways.iter().filter_map(|one| one.wear.as_ref());
        let worn: u64 = wear.map(|wear| wear.worn).sum();
        if worn == 0 {
            return None;
        }
        let epoch = match self.worn {
            Some(Note::Worn { epoch, .. }) => epoch,
            _ => record.epoch,
        };
        let cells = record.pathways.iter().map(|one| one.cells).sum();
        let before = self.worn.replace(Note::Worn { worn, cells, epoch });
        self.worn.clone().filter(|_| before.is_none())
    }

    /// Everything so far, layer by layer; the test set was read with the given result.
    pub(super) fn notes(&self, classes: usize, test: Option<&TestRecord>) -> Vec<Note> {
        let layers = self.layers.iter().enumerate().flat_map(|(layer, seen)| {
            let clips = CLIPS.iter().zip(seen.clips);
            let clips = clips.filter_map(move |((of, ..), worst)| clipped(layer, of, worst));
            clips.chain(still(layer, seen.still)).chain(mute(layer, seen.mute))
        });
        let answers = match test {
            Some(test) => {
                let of_class = test.confusion.iter().map(|row| row.iter().sum::<u64>());
                Some((test.score, of_class.max().unwrap_or(0)))
            }
            None => self.answers.map(|score| (score, score.total.div_ceil(classes.max(1) as u64))),
        };
        let worn = self.worn.clone();
        layers.chain(worn).chain(self.forgot.clone()).chain(answers.and_then(chance)).collect()
    }
}

fn clipped(layer: usize, of: &str, worst: Worst) -> Option<Note> {
    let Worst { epoch, some: clipped, all, epochs } = worst;
    (epochs > 0).then(|| Note::Clipped { layer, of: of.into(), epoch, clipped, all, epochs })
}

fn still(layer: usize, worst: Worst) -> Option<Note> {
    (worst.epochs > 0).then_some(Note::Still { layer, epoch: worst.epoch, epochs: worst.epochs })
}

fn mute(layer: usize, worst: Worst) -> Option<Note> {
    (worst.epochs > 0).then_some(Note::Mute { layer, epoch: worst.epoch, epochs: worst.epochs })
}

fn chance((Score { correct, total }, constant): (Score, u64)) -> Option<Note> {
    let [more, some, others, all] =
        [correct.saturating_sub(constant), constant, total.saturating_sub(constant), total]
            .map(u128::from);
    let within = more * more * all <= 9 * some * others;
    let doubtful = total >= FEW && correct < total && within;
    let note = Note::Chance { correct, total, constant };
    (total > 0 && (correct <= constant || doubtful)).then_some(note)
}

/// How many cells of these networks are stuck, if any are.
pub(super) fn stuck<'a>(drivers: impl IntoIterator<Item = &'a Driver>) -> Option<Note> {
    let counts = drivers.into_iter().map(|driver| driver.engine().stuck_cells());
    let [stuck, cells] = counts.fold([0; 2], |[a, b], [stuck, cells]| [a + stuck, b + cells]);
    (stuck > 0).then_some(Note::Stuck { stuck, cells })
}

/// What the user of a run should know beside its result, from its receipt and its records: what calibration found, then
/// what was seen layer by layer, then what came of it.
///
/// See [`train`](crate::train()).
#[must_use]
pub fn notes(receipt: &Receipt, records: &[EpochRecord]) -> Vec<Note> {
    let mut watcher = Watcher::default();
    for record in records {
        let _ = watcher.look(record);
    }
    with_calibration(receipt, &watcher)
}

/// As [`notes`], of records that were looked at.
pub(super) fn with_calibration(receipt: &Receipt, watcher: &Watcher) -> Vec<Note> {
    let kept = |note: &&Note| matches!(note, Note::LowCodes { .. } | Note::Stuck { .. });
    let found = receipt.notes.iter().filter(kept).cloned();
    found.chain(watcher.notes(receipt.data.classes, receipt.classified())).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn chance_is_what_the_most_frequent_class_gives() {
        let of = |correct, total, constant| chance((Score { correct, total }, constant)).is_some();
        // 10 % of 1,797: three standard deviations are 38
        assert!(of(180, 1797, 180) && of(218, 1797, 180) && !of(219, 1797, 180));
        // one class in ten examples is nine times as frequent; a perfect answer is none of chance
        assert!(of(900, 1000, 900) && of(920, 1000, 900) && !of(1000, 1000, 900));
        assert!(of(2, 4, 2) && !of(3, 4, 2) && !of(4, 4, 2) && !of(0, 0, 0));
    }

    #[test]
    fn the_worst_epoch_is_kept_and_the_others_are_counted() {
        let mut worst = Worst::default();
        for (epoch, some, all) in [(1, 6, 10), (2, 9, 10), (3, 70, 100)] {
            worst.see(epoch, some, all);
        }
        assert_eq!((worst.epoch, worst.some, worst.all, worst.epochs), (2, 9, 10, 3));
    }
}
