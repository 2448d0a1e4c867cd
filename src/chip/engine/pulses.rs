//! Which pulses the last write of a layer gave, for schedules whose time depends on them.
//!
//! ```text
//! P+, P-        most positive and most negative pulses of a row over the columns of both banks of a physical tile
//! active(q)     cells of a row, over the same columns, that still take a pulse of one direction at pulse number q
//! ```
//!
//! A tile holds the two banks of one target. See docs/MODEL.md, 4.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use super::Engine;
use crate::chip::crossbar::{Collect, Collected, RowPeaks};
use crate::chip::layer::Layer;
use crate::chip::population::Stream;

/// Pulses of one write of a layer.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Pulses {
    /// Peaks of each column of tiles, pair after pair (`Wiring::planes`) and then from the left.
    Peaks(Vec<TilePeaks>),
    /// Every pulse, `[row][column]`, by array.
    Every(Vec<Vec<i8>>),
}

/// Peaks of one column of tiles, over both banks of its target.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TilePeaks {
    /// Whose units the columns are.
    pub target: Stream,
    /// Column tile and peaks of all rows of the logical array.
    pub peaks: RowPeaks,
}

impl Pulses {
    /// No pulses, as `collect` tells them.
    pub(super) fn none(collect: Collect, layer: &Layer) -> Option<Self> {
        let layout = layer.layout;
        match collect {
            Collect::Nothing => None,
            Collect::Peaks { tile_columns } => {
                let tiles = 0..layout.columns.div_ceil(tile_columns);
                let peaks = |tile| RowPeaks::new(tile, layout.rows);
                let of = |(target, _)| {
                    tiles.clone().map(move |tile| TilePeaks { target, peaks: peaks(tile) })
                };
                Some(Self::Peaks(layer.spec.wiring.planes().flat_map(of).collect()))
            }
            Collect::Pulses => Some(Self::Every(vec![vec![0; layout.cells()]; layer.arrays.len()])),
        }
    }

    /// Takes along what a write of some columns of an array, from `first` on, collected.
    pub(super) fn merge(&mut self, layer: &Layer, array: usize, first: usize, part: &Collected) {
        let columns = layer.layout.columns;
        match (self, part) {
            (Self::Peaks(all), Collected::Peaks(part)) => {
                let mut planes = layer.spec.wiring.planes();
                let plane = planes.position(|(_, pair)| pair.contains(&array));
                let across = all.len() / layer.spec.wiring.planes().count();
                let at = plane.expect("every array is one of a pair") * across;
                part.iter().for_each(|part| all[at + part.tile].peaks.merge(part));
            }
            (Self::Every(all), Collected::Pulses(part)) => {
                let rows = all[array].chunks_exact_mut(columns);
                let width = part.len() / layer.layout.rows;
                for (to, from) in rows.zip(part.chunks_exact(width)) {
                    to[first..first + width].copy_from_slice(from);
                }
            }
            _ => unreachable!("a write collects what was asked for"),
        }
    }
}

/// Cells of some columns of a row that still take a pulse at pulse number `q`, `[positive, negative]` by `q` below
/// `bound`. `pulses` are those of the row, of every bank that counts.
#[must_use]
pub fn active<'a>(pulses: impl IntoIterator<Item = &'a i8>, bound: u8) -> Vec<[u32; 2]> {
    let mut active = vec![[0; 2]; bound.into()];
    for &pulses in pulses {
        let takes = usize::from(pulses.unsigned_abs());
        active[..takes].iter_mut().for_each(|count| count[usize::from(pulses < 0)] += 1);
    }
    active
}

impl Engine {
    /// What is told of the pulses of each write that follows.
    #[cfg(test)]
    const fn set_collect(&mut self, collect: Collect) {
        self.collect = collect;
    }

    /// Pulses of the last write of a layer, if they were collected and not taken before. A write of nothing gave none.
    pub fn take_pulses(&mut self, layer: usize) -> Option<Pulses> {
        self.registers[layer].pulses.take()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::chip::crossbar::kernel::Backend;
    use crate::chip::engine::{Operation, Side, Write};
    use crate::chip::hardware::Hardware;
    use crate::chip::layer::{DrivenBy, Homeostasis, InitialLevels, LayerSpec, Pool, Taps};

    use crate::chip::population::Wiring;
    use crate::num::tables::Activation;

    #[test]
    fn a_cell_is_active_until_its_last_pulse() {
        let row = [3, -1, 0, 1, -3, 2];
        assert_eq!(active(&row, 3), [[3, 2], [2, 1], [1, 1]]);
        assert_eq!(active(&row[2..3], 2), [[0, 0], [0, 0]]);
        assert!(active(&[], 0).is_empty());
    }

    /// A layer of 70 inputs and 150 units.
    fn engine(backend: Backend, potentiation_only: bool, collect: Collect) -> Engine {
        let hardware = Hardware::reference()
            .with(|h| {
                h.tile.rows = 64;
                h.tile.columns = 40;
                h.tile.transposed_read = false;
            })
            .unwrap();
        let spec = LayerSpec {
            inputs: 70,
            units: 150,
            wiring: Wiring::Dual,
            driven_by: DrivenBy::Shared,
            activation: Activation::Identity,
            weight_max_log2: 2,
            initial: InitialLevels::Uniform { gain_64ths: [64, 64] },
            constant_row: false,
            convolution: None,
            copies: 1,
            pool: Pool::None,
            homeostasis: Homeostasis::OFF,
        };
        let words = (0..150).map(|unit| unit % 10).collect();
        let taps = Taps { width: 10, per_unit: 1, words, shift: 0 };
        let layer = Layer::new(0, spec, taps, &hardware);
        let mut engine = Engine::new(hardware, backend, 1, vec![layer]);
        engine.set_potentiation_only(potentiation_only);
        engine.set_collect(collect);
        engine
    }

    /// Pulses of a write of some samples.
    fn pulses(mut engine: Engine, samples: usize) -> Option<Pulses> {
        let codes: Vec<_> = (0..samples * 70).map(|at| (at * 37 % 251) as u8).collect();
        let words: Vec<_> = (0..samples * 10).map(|at| (at * 53 % 255) as i16 - 127).collect();
        engine.execute(&Operation::LoadDrives { codes: &codes });
        engine.execute(&Operation::Forward { layer: 0, side: Side::Rows });
        engine.execute(&Operation::Error {
            layer: 0,
            samples: 0..samples,
            words: &words,
            shared: false,
        });
        let update = |write, samples| Operation::Update { layer: 0, write, samples, shift: 12 };
        engine.execute(&update(Write::Add, 0..samples));
        engine.execute(&update(Write::Program, 0..0));
        let pulses = engine.take_pulses(0);
        assert_eq!(engine.take_pulses(0), None, "taken once");
        pulses
    }

    #[test]
    fn peaks_of_a_tile_are_those_of_both_banks_of_its_target() {
        for backend in Backend::available() {
            for (samples, only) in [(1, false), (40, false), (3, true), (0, false)] {
                let of = |collect| pulses(engine(backend, only, collect), samples);
                assert_eq!(of(Collect::Nothing), None);
                let Some(Pulses::Every(every)) = of(Collect::Pulses) else { panic!("pulses") };
                let Some(Pulses::Peaks(peaks)) = of(Collect::Peaks { tile_columns: 40 }) else {
                    panic!("peaks")
                };
                let names: Vec<_> = peaks.iter().map(|p| (p.target, p.peaks.tile)).collect();
                let tiles = |target| (0..4).map(move |tile| (target, tile));
                assert_eq!(names, tiles(Stream::P).chain(tiles(Stream::N)).collect::<Vec<_>>());
                let banks = [&every[..2], &every[2..]];
                for TilePeaks { target, peaks } in &peaks {
                    for (row, &peak) in peaks.rows.iter().enumerate() {
                        let columns = peaks.tile * 40..(peaks.tile * 40 + 40).min(150);
                        let cells = banks[target.index()].iter().flat_map(|bank| {
                            &bank[row * 150 + columns.start..row * 150 + columns.end]
                        });
                        let active = active(cells, 7);
                        let most = [0, 1].map(|way| active.iter().filter(|q| q[way] > 0).count());
                        assert_eq!(peak.map(usize::from), most, "{target:?} {row}");
                    }
                }
                let any = every.iter().flatten().any(|&pulses| pulses != 0);
                assert_eq!(any, samples > 0);
            }
        }
    }
}
