//! The shadow's currents of cells that conduct something else than their level: sums over shared segments, term by term.

use std::ops::Range;

use dalean::chip::device::{Conductance, Reference};

use super::{Fault, Shadow, Table, rsh};

/// What the cells of an array let through in 2^-8 levels, and its reference columns, `[tile across][row]`.
#[derive(Debug, Clone, Default)]
pub(crate) struct Through {
    cells: Table,
    reference: Table,
}

/// Whole tiles of so many lines.
fn tiles(all: usize, part: usize) -> Vec<Range<usize>> {
    (0..all).step_by(part).map(|from| from..(from + part).min(all)).collect()
}

impl Shadow {
    /// Whether a current is something else than the product of drives and levels.
    pub(super) fn conducts(&self) -> bool {
        self.net.hardware.conductance.is_some() || self.net.hardware.wires.is_some()
    }

    /// Looks at the levels of a layer.
    pub(super) fn look_through(&mut self, layer: usize) {
        if !self.conducts() {
            return;
        }
        let arrays = 0..self.layers[layer].arrays.len();
        self.layers[layer].through = arrays.map(|array| self.through(layer, array)).collect();
    }

    fn through(&self, layer: usize, array: usize) -> Through {
        let hw = &self.net.hardware;
        let level = &self.layers[layer].arrays[array].level;
        let (rows, columns) = (self.layers[layer].rows, self.layers[layer].spec.units);
        let off = hw.conductance.unwrap_or(Conductance { least: 0, reference: Reference::None });
        let least = i128::from(off.least);
        let beside = usize::from(off.reference == Reference::Column);
        let whole = (i128::from(hw.cell.window.ceiling()) << 8) + least;
        let drop = hw.wires.map_or(0, |of| ((i128::from(of.segment) << 16) + whole / 2) / whole);
        let mut through = Through {
            cells: super::table(rows, columns, 0),
            reference: super::table(beside * columns.div_ceil(hw.tile.columns), rows, 0),
        };
        let cross = self.is(Fault::WiresCrossTiles);
        let (high, wide) = if cross { (rows, columns) } else { (hw.tile.rows, hw.tile.columns) };
        for down in tiles(rows, high) {
            for (at, across) in tiles(columns, wide).into_iter().enumerate() {
                let last = across.end + beside;
                let g = |row: usize, column: usize| match column {
                    column if column < across.end => i128::from(level[row][column]) * 256 + least,
                    _ => least,
                };
                for (row, column) in
                    down.clone().flat_map(|row| (across.start..last).map(move |c| (row, c)))
                {
                    let mut along = 0;
                    if drop > 0 {
                        for other in across.start..last {
                            let shared = other.min(column) - across.start + 1;
                            along += g(row, other) * shared as i128;
                        }
                        for other in down.clone().filter(|_| !self.is(Fault::ColumnsHaveNoWires)) {
                            let shared = other.min(row) - down.start + 1;
                            along += g(other, column) * shared as i128;
                        }
                    }
                    let part = (1 << 24) + ((along * drop) >> 40);
                    let e = (g(row, column) * (1 << 24) + part / 2) / part;
                    let e = i64::try_from(e).unwrap();
                    if column < across.end {
                        through.cells[row][column] = e;
                    } else if let Some(of) = through.reference.get_mut(at) {
                        of[row] = e;
                    }
                }
            }
        }
        through
    }

    /// The current in a column of a bank while `part` says what is on a row.
    pub(super) fn let_through(
        &self,
        (layer, bank): (usize, usize),
        column: usize,
        rows: Range<usize>,
        part: impl Fn(usize) -> i64,
    ) -> i64 {
        let Through { cells, reference } = &self.layers[layer].through[bank];
        let sum = rows.clone().map(|row| cells[row][column] * part(row)).sum();
        let reference = reference.get(column / self.net.hardware.tile.columns);
        let taken = reference.filter(|_| !self.is(Fault::ReferenceStays));
        let off = taken.map_or(0, |of| rows.map(|row| of[row] * part(row)).sum());
        rsh(sum, 8) - rsh(off, 8)
    }

    /// Sum of a row while a layer is read from its columns: all slices of both phases, in every tile beside one another.
    pub(super) fn backward_current(
        &self,
        layer: usize,
        banks: &[usize],
        gates: &[i64],
        row: usize,
    ) -> i64 {
        let hw = &self.net.hardware;
        let (bits, slices) = (hw.drive.dac_bits, hw.drive.bits.get().div_ceil(hw.drive.dac_bits));
        let mut total = 0;
        for across in tiles(gates.len(), hw.tile.columns) {
            for (positive, slice) in
                [true, false].into_iter().flat_map(|phase| (0..slices).map(move |s| (phase, s)))
            {
                let part = |u: i64| {
                    let driven = if positive { u.max(0) } else { (-u).max(0) };
                    let part = driven >> (slice * bits);
                    if slice + 1 == slices { part } else { part % (1 << bits) }
                };
                let d = [0, 1].map(|bank| {
                    let cells = &self.layers[layer].through[banks[bank]].cells[row];
                    rsh(across.clone().map(|c| cells[c] * part(gates[c])).sum(), 8)
                });
                let d = (d[0] - d[1]) << (slice * bits);
                let adds = positive || self.is(Fault::BackwardPhaseAdds);
                total += if adds { d } else { -d };
            }
        }
        total
    }
}
