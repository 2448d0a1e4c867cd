//! The way of a read: front end, converters, adder tree, lanes. See docs/TILE.md, 4.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use std::ops::Range;

use super::{Lane, Launch, Tile, TileAdc, TileUnits, Way};
use crate::chip::device::NoisePlace;
use crate::chip::hardware::Subtract;
use crate::chip::periphery::{self, Converter};
use crate::num::fixed::AdcBits;

impl Tile {
    /// Lines in use that a read comes out of.
    const fn read_lines(&self, way: Way) -> usize {
        match way {
            Way::Rows => self.config.columns,
            Way::Columns => self.config.rows,
        }
    }

    /// Slices of a read: both phases, from the columns and of drives with a sign.
    pub(super) const fn read_slices(&self, way: Way) -> u32 {
        match way {
            Way::Rows => self.config.more.phases as u32 * self.config.slices,
            Way::Columns => 2 * self.config.slices,
        }
    }

    /// Cycles the front end stays busy after its last slice, so that the lanes keep up.
    fn slack(&self, way: Way) -> u64 {
        let lanes = self.config.more.beat * self.groups(self.read_lines(way)) as u64;
        let periods = (0..self.read_slices(way)).map(|slice| self.config.period(slice));
        lanes.saturating_sub(periods.sum())
    }

    pub(super) fn front_end(&mut self) {
        if !self.front.busy {
            return;
        }
        let (way, slices) = (self.front.way, self.read_slices(self.front.way));
        let slack = self.slack(way);
        let free = if self.front.slice < slices {
            if self.front.phase == 0 {
                self.drive_lines(way);
            }
            if self.front.phase == self.config.settle_of(self.front.slice) - 1 {
                self.sample(way);
            }
            self.front.phase += 1;
            if self.front.phase == self.config.period(self.front.slice) {
                self.front.phase = 0;
                self.front.slice += 1;
            }
            self.front.slice == slices && slack == 0
        } else {
            self.front.phase += 1;
            self.front.phase == slack
        };
        if free {
            self.front.busy = false;
            self.front.slice = 0;
            self.front.phase = 0;
        }
    }

    fn drive_lines(&mut self, way: Way) {
        let driven = match way {
            Way::Rows => self.config.rows,
            Way::Columns => self.config.columns,
        };
        for events in &mut self.bank_events {
            events.dac_slices += driven as u64;
        }
    }

    /// Samples the currents of all lines in use; the converters start on them.
    fn sample(&mut self, way: Way) {
        let (rows, columns) = (self.config.rows, self.config.columns);
        let lines = self.read_lines(way);
        for bank in 0..2 {
            for line in 0..lines {
                let current = match (self.config.more.conducting, way) {
                    (Some(law), _) => self.current(law, bank, way, line),
                    (None, Way::Rows) => (0..rows)
                        .map(|row| self.product(bank, row, line, self.row_part(bank, row)))
                        .sum(),
                    (None, Way::Columns) => (0..columns)
                        .map(|column| self.product(bank, line, column, self.column_part(column)))
                        .sum::<i64>(),
                };
                self.lines[way as usize].hold[bank][line] = current;
            }
            let beside = match (self.config.more.conducting, way) {
                (Some(law), Way::Rows) => law.reference_columns() * rows as u64,
                _ => 0,
            };
            self.bank_events[bank].cell_reads += (rows * columns) as u64 + beside;
            self.bank_events[bank].holds += lines as u64;
        }
        assert!(!self.conv.busy, "a slice is sampled when the one before is converted");
        self.conv.busy = true;
        self.conv.slice = self.front.slice;
        self.conv.slot = self.front.slot;
        self.conv.way = way;
        self.conv.step = 0;
        self.conv.count = 0;
    }

    fn product(&self, bank: usize, row: usize, column: usize, part: i64) -> i64 {
        i64::from(self.level[bank][row * self.size.columns + column]) * part
    }

    /// The slice of a row's drive code: of what is above 0 first, then of what is below.
    pub(super) fn row_part(&self, bank: usize, row: usize) -> i64 {
        let (phase, slice) =
            (self.front.slice / self.config.slices, self.front.slice % self.config.slices);
        let driving = self.front.slot * self.config.more.phases + phase as usize;
        let code = self.drive[bank][driving * self.size.rows + row];
        i64::from(periphery::slice(code, slice, self.config.dac_bits))
    }

    /// The slice of a gate that its phase drives: positive gates first, then negative ones. The last slice of a
    /// phase carries all bits that are left.
    pub(super) fn column_part(&self, column: usize) -> i64 {
        let (phase, slice) =
            (self.front.slice / self.config.slices, self.front.slice % self.config.slices);
        let gate = self.gate[self.front.slot * self.size.columns + column];
        let driven = if phase == 0 { gate.max(0) } else { (-gate).max(0) };
        let part = driven >> (slice * self.config.dac_bits);
        if slice + 1 == self.config.slices {
            part
        } else {
            part & ((1 << self.config.dac_bits) - 1)
        }
    }

    pub(super) fn converters(&mut self) {
        if !self.conv.busy {
            return;
        }
        self.conv.count += 1;
        if self.conv.count < self.config.convert_of(self.conv.slice) {
            return;
        }
        self.conv.count = 0;
        let way = self.conv.way;
        let lines = self.read_lines(way);
        for line in (self.conv.step..lines).step_by(self.config.share) {
            self.convert(way, line);
        }
        self.conv.step += 1;
        if self.conv.step == self.config.share {
            self.conv.step = 0;
            self.conv.busy = false;
            if self.conv.slice + 1 == self.read_slices(way) {
                let launch =
                    Launch { slot: self.conv.slot, sums: self.lines[way as usize].acc.clone() };
                self.launch(launch, way);
            }
        }
    }

    /// Converts one line of both banks and adds it up.
    fn convert(&mut self, way: Way, line: usize) {
        let slice = self.conv.slice % self.config.slices;
        let lines = &mut self.lines[way as usize];
        let [mut e, mut i] = [0, 1].map(|bank| lines.hold[bank][line]);
        if let Some(noise) = &self.config.more.noise {
            // what is converted once is off once
            let once = way == Way::Rows && matches!(self.config.adc, TileAdc::Current { .. });
            let off = |bank: usize| {
                let at = NoisePlace {
                    pathway: noise.codes[bank],
                    slice,
                    phase: self.conv.slice / self.config.slices,
                    read: self.conv.slot as u64,
                    tile: noise.at[way as usize],
                };
                noise.ways[way as usize].one(at, noise.first[way as usize] + line)
            };
            e += off(0);
            i += if once { 0 } else { off(1) };
        }
        let weight = slice * self.config.dac_bits;
        let adc = match way {
            Way::Rows => self.config.adc,
            Way::Columns => TileAdc::Ideal,
        };
        let shift_of = |own: u32| {
            let shifts = &self.config.more.adc_shifts;
            shifts.get(slice as usize).copied().unwrap_or(own)
        };
        let converter = |bits: u32, subtract, shift| {
            let bits = AdcBits::new(i64::from(bits)).expect("2..=16 bits");
            Converter::new(bits, subtract, shift)
        };
        let mut rails = [0; 2];
        let mut note = |converter: Converter, code| {
            rails[0] += u64::from(converter.is_rail(code));
            rails[1] += 1;
        };
        let (d, shift, saturated, each) = match adc {
            TileAdc::Ideal => (e - i, weight, [false; 2], true),
            TileAdc::Digital { bits, shift } => {
                let ash = shift_of(shift);
                let converter = converter(bits, Subtract::Digital, ash);
                let (e, i) = (converter.convert(e), converter.convert(i));
                [e, i].into_iter().for_each(|(code, _)| note(converter, code));
                (e.0 - i.0, ash + weight, [e.1, i.1], true)
            }
            TileAdc::Current { bits, shift } => {
                let ash = shift_of(shift);
                let converter = converter(bits, Subtract::Current, ash);
                let (d, saturated) = converter.convert(e - i);
                note(converter, d);
                (d, ash + weight, [saturated, false], false)
            }
        };
        let counted = self.rails[slice as usize].iter_mut().zip(rails);
        counted.for_each(|(count, more)| *count += more);
        let before = if self.conv.slice == 0 { 0 } else { lines.acc[line] };
        // the second phase
        let negative = self.conv.slice >= self.config.slices;
        let d = if negative { -d } else { d };
        lines.acc[line] = before + (d << shift);
        for (bank, events) in self.bank_events.iter_mut().enumerate() {
            let counted = u64::from(bank == 0 || each);
            events.conversions += counted;
            events.shift_adds += counted;
            events.saturated_conversions += u64::from(saturated[bank]);
        }
    }

    /// Accumulators leave: outside, into the tree, or straight to the lanes.
    fn launch(&mut self, launch: Launch, way: Way) {
        if self.config.more.tree_outside {
            self.launched = Some((launch, way));
        } else if self.config.tree > 0 {
            let stage = &mut self.tree[0];
            stage.valid = true;
            stage.slot = launch.slot;
            stage.sums = launch.sums;
        } else {
            self.start_lanes(launch, way);
        }
    }

    fn start_lanes(&mut self, launch: Launch, way: Way) {
        assert!(!self.lane.busy, "slack keeps samples apart");
        self.lines[way as usize].out = launch.sums;
        self.lane = Lane { busy: true, group: 0, slot: launch.slot, way, beat: 0 };
    }

    /// What left for the tree outside in this cycle; true when it was read from the columns.
    pub(in super::super) fn take_launch(&mut self) -> Option<(Launch, bool)> {
        self.launched.take().map(|(launch, way)| (launch, way == Way::Columns))
    }

    /// What the tree outside brings back at the end of this cycle.
    pub(in super::super) fn arrive(&mut self, launch: Launch, columns: bool) {
        self.start_lanes(launch, if columns { Way::Columns } else { Way::Rows });
    }

    pub(super) fn tree(&mut self) {
        let stages = self.config.tree;
        for at in (0..stages).rev() {
            if !self.tree[at].valid {
                continue;
            }
            self.tree[at].valid = false;
            let (slot, sums) = (self.tree[at].slot, self.tree[at].sums.clone());
            if at + 1 < stages {
                let next = &mut self.tree[at + 1];
                next.valid = true;
                next.slot = slot;
                next.sums = sums;
            } else {
                self.start_lanes(Launch { slot, sums }, Way::Rows);
            }
        }
    }

    /// Lines in use of a group of the lanes.
    pub(super) fn group(&self, group: usize, lines: usize) -> Range<usize> {
        let start = group * self.config.lanes;
        start..(start + self.config.lanes).min(lines)
    }

    pub(super) fn lanes(&mut self) {
        if !self.lane.busy {
            return;
        }
        self.lane.beat += 1;
        if self.lane.beat < self.config.more.beat {
            return;
        }
        self.lane.beat = 0;
        let lines = self.read_lines(self.lane.way);
        for line in self.group(self.lane.group, lines) {
            match self.lane.way {
                Way::Rows => self.look_up(line),
                Way::Columns => self.backward[line] = self.lines[Way::Columns as usize].out[line],
            }
        }
        self.lane.group += 1;
        if self.lane.group == self.groups(lines) {
            self.lane.busy = false;
            self.lane.group = 0;
            self.looked_up = true;
        }
    }

    fn look_up(&mut self, column: usize) {
        let at = self.lane.slot * self.size.columns + column;
        match self.config.more.units {
            TileUnits::Table => {}
            TileUnits::Kept => return (self.value[at], self.slope[at]) = (0, 255),
            TileUnits::Normalised => return,
        }
        let half = 1 << (self.config.lut_bits - 1);
        let out = self.lines[Way::Rows as usize].out[column];
        let (index, saturated) = match self.config.more.balance {
            Some(_) => self.balanced(column, out, half),
            None => periphery::index(out, self.config.lut_shift, half),
        };
        [self.value[at], self.slope[at]] = self.table[index];
        self.events.look_ups += 1;
        self.events.saturated_look_ups += u64::from(saturated);
    }
}
