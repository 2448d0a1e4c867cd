//! What the cells of an array remember beside their level, kept beside them as levels lie: pulses they were sent, and what those
//! left where another level stands. See `chip::device`.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use std::sync::Arc;

use super::Crossbar;
use super::kernel::{Cells, Remembered};
use super::layout::{HALF_CELLS, Layout};
use crate::chip::device::{
    Ages, Device, Endurance, Leakage, Leaks, MemoryLaw, StuckCell, cell_words,
};
use crate::chip::state::{Piece, Section, StateError, Visitor};
use crate::num::draw::{Place, Site};

/// The planes of an array; those that a chip does not need are empty.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CellMemory {
    law: Arc<MemoryLaw>,
    /// Pulses that each cell takes.
    limits: Vec<u32>,
    /// Pulses that it was sent.
    spent: Vec<u32>,
    /// What pulses left, where something else stands in the cell.
    left: Vec<u16>,
    /// The write that left it, counted from 1; 0 of what was there before.
    stamps: Vec<u32>,
    /// Words of each cell's drift, where it drifts.
    drifts: Vec<[u16; 2]>,
    /// What it loses at a look, where cells differ in that.
    losses: Vec<u32>,
}

/// What the cells of some panels remember, to be changed by a write.
#[derive(Debug)]
pub struct CellMemoryMut<'a> {
    law: &'a MemoryLaw,
    absorbs: bool,
    limits: &'a [u32],
    spent: &'a mut [u32],
    left: &'a mut [u16],
    stamps: &'a mut [u32],
}

impl CellMemoryMut<'_> {
    /// What a half block remembers.
    pub(super) fn half(&mut self, at: usize) -> Remembered<'_> {
        const WHOLE: &str = "a half block has 1024 cells";
        let cells = at..at + HALF_CELLS;
        let limits = self.limits.get(cells.clone()).map(|of| of.try_into().expect(WHOLE));
        let spent = self.spent.get_mut(cells.clone()).map(|of| of.try_into().expect(WHOLE));
        let left = self.left.get_mut(cells.clone()).map(|of| of.try_into().expect(WHOLE));
        let stamps = self.stamps.get_mut(cells).map(|of| of.try_into().expect(WHOLE));
        Remembered { law: self.law, absorbs: self.absorbs, wear: limits.zip(spent), left, stamps }
    }
}

impl CellMemory {
    /// That of cells of an array at a place (seed, layer, pathway), none of which has been pulsed.
    fn new(law: Arc<MemoryLaw>, layout: Layout, place: Place) -> Self {
        let cells = layout.cells_padded();
        let by_word = |sub: u32, of: &dyn Fn(u32) -> u32| {
            let from = Device::place(place, sub);
            let mut plane = vec![u32::MAX; cells];
            for column in 0..layout.columns {
                for group in 0..layout.rows.div_ceil(16) {
                    let words = from.quads(layout.rows, column, group);
                    for row in group * 16..layout.rows.min(group * 16 + 16) {
                        plane[layout.index(row, column)] = of(words[row % 16]);
                    }
                }
            }
            plane
        };
        let limits = law.endurance.as_ref();
        let limits = limits.map(|(_, limits)| by_word(Endurance::SUB, &|word| limits.of(word)));
        let differs = law.leakage.as_ref().filter(|leakage| leakage.differs());
        let losses = differs.map(|leakage| by_word(Leakage::SUB, &|word| leakage.lost(word)));
        let limits = limits.unwrap_or_default();
        let mut drifts = vec![];
        if law.ageing.is_some() {
            drifts.resize(cells, [0; 2]);
            let place = Place { site: Site::Drift, ..place };
            let words = cell_words(place, [layout.rows, layout.columns]);
            for (cell, words) in words.into_iter().enumerate() {
                drifts[layout.index(cell / layout.columns, cell % layout.columns)] = words;
            }
        }
        let beside = law.write_noise.is_some() || law.ageing.is_some();
        Self {
            spent: vec![0; limits.len()],
            left: if beside { vec![0; cells] } else { vec![] },
            stamps: vec![0; drifts.len()],
            drifts,
            losses: losses.unwrap_or_default(),
            limits,
            law,
        }
    }

    /// Whether cells wear out.
    pub(super) const fn wears(&self) -> bool {
        !self.limits.is_empty()
    }

    /// Whether a cell is worn out.
    fn is_worn(&self, at: usize) -> bool {
        self.wears() && self.spent[at] >= self.limits[at]
    }

    /// Cut as levels are cut into strips of so many cells.
    pub(super) fn strips(
        &mut self,
        cells: usize,
        absorbs: bool,
    ) -> impl Iterator<Item = CellMemoryMut<'_>> {
        let Self { law, limits, spent, left, stamps, drifts: _, losses: _ } = self;
        let (law, mut limits) = (&**law, limits.chunks(cells));
        let (mut spent, mut left) = (spent.chunks_mut(cells), left.chunks_mut(cells));
        let mut stamps = stamps.chunks_mut(cells);
        std::iter::repeat_with(move || CellMemoryMut {
            law,
            absorbs,
            limits: limits.next().unwrap_or_default(),
            spent: spent.next().unwrap_or_default(),
            left: left.next().unwrap_or_default(),
            stamps: stamps.next().unwrap_or_default(),
        })
    }
}

impl Crossbar {
    /// Cells of this array remember from now on what a law says; nothing so far. Of `place` seed, layer and pathway count.
    pub fn remember(&mut self, law: &Arc<MemoryLaw>, place: Place) {
        let gone = self.pruned();
        let memory = CellMemory::new(Arc::clone(law), self.layout, place);
        if memory.wears() && self.pruned.is_none() {
            self.pruned = Some(vec![0; self.layout.cells_padded()]);
        }
        self.memory = Some(Box::new(memory));
        self.leave_all();
        if let Some(gone) = gone {
            self.load_pruned(&gone);
        }
        self.end_write();
    }

    /// What stands in the cells is what pulses left.
    fn leave_all(&mut self) {
        let levels = self.levels();
        let (layout, Some(memory)) = (self.layout, &mut self.memory) else { return };
        if !memory.left.is_empty() {
            for (cell, level) in levels.enumerate() {
                memory.left[layout.index(cell / layout.columns, cell % layout.columns)] = level;
            }
        }
    }

    /// A level was put into a cell: noise stands beside it no longer.
    pub(super) fn leave(&mut self, at: usize, level: u16) {
        if let Some(left) = self.memory.as_mut().and_then(|memory| memory.left.get_mut(at)) {
            *left = level;
        }
    }

    /// Whether cells of this array wear out.
    pub(super) fn wears(&self) -> bool {
        self.memory.as_ref().is_some_and(|memory| memory.wears())
    }

    /// Marks cells that are worn out so that no write moves them.
    pub(super) fn mark_worn(&mut self) {
        let (Some(memory), Some(pruned)) = (&self.memory, &mut self.pruned) else { return };
        let worn = memory.spent.iter().zip(&memory.limits).map(|(spent, limit)| spent >= limit);
        pruned.iter_mut().zip(worn).filter(|(_, worn)| *worn).for_each(|(of, _)| *of = Cells::GONE);
    }

    /// Loads a row of levels as an operation of the chip does, after so many writes of the array: that is a pulse of each cell, and those
    /// that are worn out keep theirs.
    ///
    /// # Panics
    /// As [`Crossbar::load_row`].
    pub fn program_row(&mut self, row: usize, levels: &[u16], writes: u64) {
        let layout = self.layout;
        let worn = |this: &Self, column: usize| {
            let memory = this.memory.as_ref();
            memory.is_some_and(|memory| memory.is_worn(layout.index(row, column)))
        };
        let before: Vec<_> = (0..layout.columns)
            .map(|column| worn(self, column).then(|| self.level(row, column)))
            .collect();
        self.load_row(row, levels);
        if self.memory.is_none() {
            return;
        }
        for (column, before) in before.into_iter().enumerate() {
            let at = layout.index(row, column);
            if let Some(level) = before {
                self.put(row, column, level);
            }
            let memory = self.memory.as_mut().expect("just seen");
            if let Some(stamp) = memory.stamps.get_mut(at) {
                *stamp = stamp_of(writes);
            }
            if let Some(spent) = memory.spent.get_mut(at) {
                *spent = spent.saturating_add(1);
            }
            if memory.is_worn(at) && before.is_none() {
                self.wear_out(row, column);
            }
        }
        self.mark_worn();
    }

    /// A cell has taken its last pulse.
    fn wear_out(&mut self, row: usize, column: usize) {
        let memory = self.memory.as_ref().expect("cells wear out");
        let (worn, _) = memory.law.endurance.as_ref().expect("they wear out by a law");
        let at = |cell: &StuckCell| (cell.row as usize, cell.column as usize);
        let stuck = self.stuck.binary_search_by_key(&(row, column), at).is_ok();
        let level = worn.level(self.level(row, column), self.ends(row, column));
        if !stuck {
            self.put(row, column, level);
        }
    }

    /// Floor and ceiling of a cell.
    fn ends(&self, row: usize, column: usize) -> [u16; 2] {
        let window = [self.window.floor(), self.window.ceiling()];
        self.own(row, column).map_or(window, |own| [own.floor, own.ceiling])
    }

    /// After the write whose number, counted from 1, is `count`: cells forget or drift, if it is time.
    pub fn forget(&mut self, place: Place) {
        let Some(memory) = &self.memory else { return };
        let law = Arc::clone(&memory.law);
        let is_time = |every: u32| place.count.is_multiple_of(every.into());
        if let Some(leaks) = law.leakage.as_ref().filter(|law| is_time(law.every)) {
            self.leak(leaks, place);
        }
        if let Some(ages) = law.ageing.as_ref().filter(|law| is_time(law.every)) {
            self.drift(ages, place.count);
        }
    }

    /// Free cells of the array, with their places in it and in the planes.
    fn free(&self) -> Vec<([usize; 2], usize)> {
        let Layout { rows, columns } = self.layout;
        let cells = (0..columns).flat_map(|column| (0..rows).map(move |row| [row, column]));
        let at = cells.map(|[row, column]| ([row, column], self.layout.index(row, column)));
        let pruned = self.pruned.as_ref();
        at.filter(|(_, at)| pruned.is_none_or(|pruned| pruned[*at] == 0)).collect()
    }

    fn leak(&mut self, law: &Leaks, place: Place) {
        let rows = self.layout.rows;
        let mut words = ([usize::MAX; 2], [0; 16]);
        for ([row, column], at) in self.free() {
            if words.0 != [row / 16, column] {
                words = ([row / 16, column], place.quads(rows, column, row / 16));
            }
            let memory = self.memory.as_ref().expect("it leaks");
            let lost = memory.losses.get(at).copied().unwrap_or_else(|| law.lost(0));
            let (ends, word) = (self.ends(row, column), words.1[row % 16]);
            let left = memory.left.get(at).copied();
            self.put(row, column, law.after(self.level(row, column), ends, lost, word));
            if let Some(left) = left {
                self.leave(at, law.after(left, ends, lost, word));
            }
        }
    }

    fn drift(&mut self, law: &Ages, writes: u64) {
        for ([row, column], at) in self.free() {
            let memory = self.memory.as_ref().expect("it drifts");
            let since = writes - u64::from(memory.stamps[at]);
            if since == 0 {
                continue;
            }
            let left = memory.left[at];
            let aged = law.after((left, since), memory.drifts[at], self.ends(row, column));
            self.put(row, column, aged);
            self.leave(at, left);
        }
    }

    /// Pulses that a cell was sent and how many it takes, row by row; `None` where any number is taken.
    #[must_use]
    pub fn wear(&self) -> Option<Vec<[u32; 2]>> {
        let memory = self.memory.as_ref().filter(|memory| memory.wears())?;
        let Layout { rows, columns } = self.layout;
        let cells = (0..rows).flat_map(|row| (0..columns).map(move |column| (row, column)));
        let at = cells.map(|(row, column)| self.layout.index(row, column));
        Some(at.map(|at| [memory.spent[at], memory.limits[at]]).collect())
    }

    /// What pulses left, row by row; `None` where nothing else stands in the cells.
    #[must_use]
    pub fn left(&self) -> Option<Vec<u16>> {
        let memory = self.memory.as_ref().filter(|memory| !memory.left.is_empty())?;
        let Layout { rows, columns } = self.layout;
        let cells = (0..rows).flat_map(|row| (0..columns).map(move |column| (row, column)));
        Some(cells.map(|(row, column)| memory.left[self.layout.index(row, column)]).collect())
    }

    /// The writes that left what pulses left, row by row; `None` where cells do not drift.
    #[must_use]
    pub fn stamps(&self) -> Option<Vec<u32>> {
        let memory = self.memory.as_ref().filter(|memory| !memory.stamps.is_empty())?;
        let Layout { rows, columns } = self.layout;
        let cells = (0..rows).flat_map(|row| (0..columns).map(move |column| (row, column)));
        Some(cells.map(|(row, column)| memory.stamps[self.layout.index(row, column)]).collect())
    }

    /// Shows how often cells were pulsed.
    pub(super) fn visit_wear(
        &mut self,
        name: &str,
        visitor: &mut dyn Visitor,
    ) -> Result<(), StateError> {
        let Some(wear) = self.wear() else { return Ok(()) };
        let name = format!("{name}.pulses");
        let within = 0..=u32::MAX.into();
        let piece = Piece { name: &name, section: Some(Section::Device), within };
        let spent: Vec<i64> = wear.iter().map(|[spent, _]| i64::from(*spent)).collect();
        let Some(spent) = visitor.numbers(&piece, &spent)? else { return Ok(()) };
        let (layout, memory) = (self.layout, self.memory.as_mut().expect("it was shown"));
        for (cell, spent) in spent.into_iter().enumerate() {
            let at = layout.index(cell / layout.columns, cell % layout.columns);
            memory.spent[at] = u32::try_from(spent).expect("a visitor keeps to the range");
        }
        self.end_write();
        Ok(())
    }

    /// Shows what pulses left.
    pub(super) fn visit_left(
        &mut self,
        name: &str,
        visitor: &mut dyn Visitor,
    ) -> Result<(), StateError> {
        if self.left().is_none() {
            return Ok(());
        }
        let [least, greatest] = self.reachable().map(i64::from);
        let name = format!("{name}.left");
        let piece = Piece { name: &name, section: Some(Section::Device), within: least..=greatest };
        let shape = [self.layout.rows, self.layout.columns];
        let values = || self.left().expect("just seen");
        let Some(left) = visitor.halves(&piece, shape, &values)? else { return Ok(()) };
        for (cell, left) in left.into_iter().enumerate() {
            self.leave(self.layout.index(cell / shape[1], cell % shape[1]), left);
        }
        Ok(())
    }

    /// Shows when pulses left it.
    pub(super) fn visit_stamps(
        &mut self,
        name: &str,
        visitor: &mut dyn Visitor,
    ) -> Result<(), StateError> {
        let Some(stamps) = self.stamps() else { return Ok(()) };
        let name = format!("{name}.stamps");
        let within = 0..=u32::MAX.into();
        let piece = Piece { name: &name, section: Some(Section::Device), within };
        let stamps: Vec<i64> = stamps.into_iter().map(i64::from).collect();
        let Some(stamps) = visitor.numbers(&piece, &stamps)? else { return Ok(()) };
        let (layout, memory) = (self.layout, self.memory.as_mut().expect("it was shown"));
        for (cell, stamp) in stamps.into_iter().enumerate() {
            let at = layout.index(cell / layout.columns, cell % layout.columns);
            memory.stamps[at] = u32::try_from(stamp).expect("a visitor keeps to the range");
        }
        Ok(())
    }
}

/// A number of writes as cells remember it.
pub(super) fn stamp_of(writes: u64) -> u32 {
    u32::try_from(writes).expect("an array is written fewer than 2^32 times")
}
