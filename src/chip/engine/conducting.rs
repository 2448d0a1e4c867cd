//! Currents of cells that conduct something else than their level: what level 0 conducts, and what wires take.
//!
//! ```text
//! even       v += rsh(O X, 8),  X the sum of the drives                      where wires take nothing: the levels are read as ever
//! wires      v = rsh(sum x e, 8)                                             byte planes of e are read as those of levels are
//! reference  v -= rsh(sum x e[reference], 8)                                 of the column's own tile
//! ```
//!
//! All of it on the wide way, a tile and a slice at a time. With a reference column and no wires, currents are those of the levels and nothing
//! is done. See docs/MODEL.md, 2.8.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use std::sync::Arc;

use super::Engine;
use super::each::each;
use super::window::fold;
use crate::chip::crossbar::layout::BLOCK_ROWS;
use crate::chip::crossbar::{Crossbar, Through};
use crate::chip::device::{CONDUCTANCE_BITS, Conducting};
use crate::chip::hardware::Hardware;
use crate::chip::layer::LayerSpec;
use crate::num::fixed::rsh;

/// What the arrays of a layer let through, in their order.
pub(super) type AllThrough = Arc<[Through]>;

/// What reads of a layer have in place of its levels.
#[derive(Debug, Clone)]
pub(super) enum Letting {
    /// Each cell conducts so much beside its level.
    Even(u64),
    /// Each cell lets its own through.
    Own(AllThrough),
}

/// What is taken off currents, or comes to them, by drives of a tile: one number a driving, of each tile across or of all.
#[derive(Debug, Default)]
pub(super) struct Common {
    /// `[tile across][driving]`; one for all columns where there is one.
    sums: Vec<Vec<i64>>,
    /// Columns of a tile.
    wide: usize,
}

impl Common {
    /// Of drives `[block][driving][64]` of the rows from `first` on.
    pub(super) fn of(
        letting: &Letting,
        array: usize,
        (codes, drivings): (&[u8], usize),
        first: usize,
        wide: usize,
    ) -> Self {
        let sum = |of: &dyn Fn(usize) -> i64| -> Vec<i64> {
            let mut sums = vec![0; drivings];
            for (block, codes) in codes.chunks_exact(drivings * BLOCK_ROWS).enumerate() {
                let row = first + block * BLOCK_ROWS;
                for (sum, codes) in sums.iter_mut().zip(codes.as_chunks::<BLOCK_ROWS>().0) {
                    let part = codes.iter().enumerate().filter(|(_, code)| **code > 0);
                    *sum += part.map(|(at, &code)| i64::from(code) * of(row + at)).sum::<i64>();
                }
            }
            sums
        };
        let sums = match letting {
            Letting::Even(least) => {
                let least = i64::try_from(*least).expect("24 bits");
                let mut sums = sum(&|_| 1);
                sums.iter_mut().for_each(|sum| *sum = rsh(*sum * least, CONDUCTANCE_BITS));
                vec![sums]
            }
            Letting::Own(all) => {
                let reference = all[array].reference().iter();
                let of_tile = |rows: &Vec<u32>| {
                    // a padded row is driven with 0
                    let mut sums = sum(&|row| i64::from(rows[row]));
                    sums.iter_mut().for_each(|sum| *sum = -rsh(*sum, CONDUCTANCE_BITS));
                    sums
                };
                reference.map(of_tile).collect()
            }
        };
        Self { sums, wide }
    }

    /// What comes to the current of a column.
    pub(super) fn at(&self, driving: usize, column: usize) -> i64 {
        match &self.sums[..] {
            [] => 0,
            [all] => all[driving],
            tiles => tiles[column / self.wide][driving],
        }
    }

    /// Whether nothing does.
    pub(super) const fn is_nothing(&self) -> bool {
        self.sums.is_empty()
    }
}

impl Engine {
    /// A level of a layer has moved: what was added up of them is forgotten.
    pub(super) fn levels_moved(&mut self, layer: usize) {
        self.row_sums[layer] = None;
        self.through[layer] = None;
    }

    /// Looks at the levels of a layer again, where one has moved and reads depend on more than them.
    pub(super) fn look_through(&mut self, layer: usize) {
        let Some(law) = self.hardware.conducting().filter(|law| !law.is_even()) else { return };
        if self.through[layer].is_some() {
            return;
        }
        let tile = [self.hardware.tile.rows, self.hardware.tile.columns];
        let arrays = &self.layers[layer].arrays;
        let parts: Vec<(usize, &Crossbar)> = arrays.iter().enumerate().collect();
        let work = 64 * arrays.len() * self.layers[layer].layout.cells();
        let made = each(&mut self.team, work, arrays.len(), parts, |_, array| {
            Through::new(array, law, tile)
        });
        self.through[layer] = Some(made.into());
    }

    /// What reads of a layer have in place of its levels.
    pub(super) fn letting(&self, layer: usize) -> Option<Letting> {
        let law = self.hardware.conducting()?;
        if law.is_exact() {
            return None;
        }
        Some(match &self.through[layer] {
            _ if law.is_even() => Letting::Even(law.least()),
            Some(through) => Letting::Own(Arc::clone(through)),
            None => unreachable!("looked at before a read"),
        })
    }

    /// Columns of reference cells of a bank of a layer, all its tiles across together.
    pub(super) fn reference_columns(&self, layer: usize) -> u64 {
        let each = self.hardware.conducting().map_or(0, Conducting::reference_columns);
        let [_, across] = self.layers[layer].tiles(&self.hardware);
        each * across as u64
    }
}

/// A transposed read through wires: row sums of one read in every tile, bank, phase and slice, added to the pixels that drove the rows.
/// `gate` is the gate of a column.
pub(super) fn rows_through(
    [excites, inhibits]: [&Through; 2],
    (hardware, spec, [rows, columns]): (&Hardware, &LayerSpec, [usize; 2]),
    gate: impl Fn(usize) -> i64,
    position: usize,
    pixels: &mut [i64],
) {
    let (slices, dac_bits) = (hardware.slices(), hardware.drive.dac_bits);
    let mut sums = vec![0; rows];
    for left in (0..columns).step_by(hardware.tile.columns) {
        let right = (left + hardware.tile.columns).min(columns);
        for (phase, slice) in (0..2).flat_map(|phase| (0..slices).map(move |s| (phase, s))) {
            let part = |column: usize| {
                let driven = if phase == 0 { gate(column).max(0) } else { (-gate(column)).max(0) };
                let part = driven >> (slice * dac_bits);
                // the last slice carries all bits that are left
                if slice + 1 == slices { part } else { part & ((1 << dac_bits) - 1) }
            };
            let parts: Vec<i64> = (left..right).map(part).collect();
            for (row, sum) in sums.iter_mut().enumerate() {
                let read = |bank: &Through| {
                    let cells = (left..right).zip(&parts);
                    let cells = cells.filter(|(_, part)| **part > 0);
                    let sum = cells.map(|(column, part)| i64::from(bank.cell(row, column)) * part);
                    rsh(sum.sum::<i64>(), CONDUCTANCE_BITS)
                };
                let d: i64 = (read(excites) - read(inhibits)) << (slice * dac_bits);
                *sum += if phase == 0 { d } else { -d };
            }
        }
    }
    fold(spec, &sums, position, (0, false), pixels);
}
