//! Evolution strategies: candidates are loaded, played and ranked; no error reaches a layer.
//!
//! ```text
//! candidate +-k   level +- step * d_k, clamped to the window            d_k: 1 or -1 a cell, site 9, sub = pair, count = generation
//! fitness         sum of the returns of its episodes, which begin alike for both of a pair
//! w_k             rank of +k minus rank of -k, among all
//! level          += (g + r) >> shift,  g = sum_k w_k d_k,  clamped to the window         r: `shift` bits of the cell's 16-bit word
//! ```
//!
//! The word is that of site 0, count = generation. All of it is `LOADW`, which is counted and timed: two loads of every cell a
//! pair, and one at the end. The levels that candidates differ from are a copy beside the chip. After Salimans et al. 2017.
//! See docs/MODEL.md, 5.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use super::experiment::{Evolution, PolicyExperiment};
use super::outcome::PolicyEpoch;
use super::player::{Manner, Player};
use super::rank;
use crate::chip::crossbar::layout::Layout;
use crate::chip::engine::{Engine, Operation};
use crate::chip::state::{Section, State, StateError, Visitor, visit_counts};
use crate::num::draw::{BLOCK_BYTES, Place, Site};
use crate::num::fixed::narrow;
use crate::task::environment::{EnvError, EnvSource, Observations, Purpose};

/// What distinguishes the episodes of one pair from those of another: an odd number whose multiples lie far apart.
const APART: u64 = 0x9E37_79B9_7F4A_7C15;

/// A policy that evolves.
#[derive(Debug)]
pub(super) struct Evolver {
    pub(super) player: Player,
    law: Evolution,
    source: EnvSource,
    environment: String,
    environments: usize,
    seed: u64,
    horizon: u32,
    generations: u64,
    /// Steps of all environments so far.
    pub(super) steps: u64,
}

/// Levels of all arrays, `[layer][array][row][column]`.
type Levels = Vec<Vec<Vec<u16>>>;

impl Evolver {
    pub(super) fn new(
        experiment: &PolicyExperiment,
        law: Evolution,
        player: Player,
        source: EnvSource,
    ) -> Self {
        Self {
            player,
            law,
            source,
            environment: experiment.environment.clone(),
            environments: experiment.environments as usize,
            seed: experiment.seed,
            horizon: experiment.horizon,
            generations: 0,
            steps: 0,
        }
    }

    /// One generation. `Ok(false)` when `next`, asked after every pair, said to stop.
    pub(super) fn evolve(
        &mut self,
        epoch: &mut PolicyEpoch,
        next: &mut dyn FnMut() -> bool,
    ) -> Result<bool, EnvError> {
        let base = levels(self.player.actor.driver.engine());
        let mut fitness = Vec::new();
        let mut seen = Observations::default();
        let width = self.player.coding.values();
        for pair in 0..self.law.pairs {
            let signs = self.signs(pair);
            for up in [true, false] {
                self.load_candidate(&base, &signs, up);
                let number = self.generations * u64::from(self.law.pairs) + u64::from(pair) + 1;
                let seed = self.seed.wrapping_add(number.wrapping_mul(APART));
                let (id, count) = (&self.environment, self.environments);
                let made = self.source.make(id, seed, count, Purpose::Training);
                let mut environments = made.expect("it was made before");
                let manner = Manner { drawn: None, steps_max: self.horizon };
                let played = self.player.play(&mut *environments, manner, &mut |shown, live| {
                    if width > 0 {
                        live.iter().for_each(|&which| {
                            seen.values.extend_from_slice(shown.values_of(which, width));
                        });
                    }
                })?;
                fitness.push(played.returns.iter().sum());
                for (&gained, &length) in played.returns.iter().zip(&played.lengths) {
                    epoch.returns.add(gained);
                    epoch.lengths.add(length.into());
                    self.steps += u64::from(length);
                }
            }
            if !next() {
                return Ok(false);
            }
        }
        self.write(&base, &rank::centred_ranks(&fitness));
        self.player.look(&seen);
        self.generations += 1;
        Ok(true)
    }

    /// Where the words of an array come from.
    fn place(&self, site: Site, layer: usize, array: usize, sub: u32) -> Place {
        let layer = &self.player.actor.driver.engine().layers()[layer];
        let pathway = layer.spec.wiring.pathways()[array].code;
        let (seed, count) = (self.seed, self.generations);
        Place { seed, site, layer: layer.index, pathway, sub, count }
    }

    /// Which cells a pair raises in its first candidate, `[layer][array][row][column]`.
    fn signs(&self, pair: u32) -> Vec<Vec<Vec<bool>>> {
        let layers = self.player.actor.driver.engine().layers().iter().enumerate();
        let of_layer = layers.map(|(at, layer)| {
            let arrays = 0..layer.arrays.len();
            let of = |array| bits(self.place(Site::Perturbation, at, array, pair), layer.layout);
            arrays.map(of).collect()
        });
        of_layer.collect()
    }

    fn load_candidate(&mut self, base: &Levels, signs: &[Vec<Vec<bool>>], up: bool) {
        let step = i32::try_from(self.law.step).expect("checked");
        let window = self.player.actor.driver.engine().hardware().cell.window;
        let ends = [window.floor(), window.ceiling()].map(i32::from);
        let of = |layer: usize, array: usize, cell: usize| {
            let by = if signs[layer][array][cell] == up { step } else { -step };
            let level = i32::from(base[layer][array][cell]) + by;
            narrow::<u16>(level.clamp(ends[0], ends[1]), "inside the window")
        };
        self.load(base, &of);
    }

    /// Loads the levels that `of` gives for (layer, array, cell).
    fn load(&mut self, base: &Levels, of: &dyn Fn(usize, usize, usize) -> u16) {
        let engine = self.player.actor.driver.engine_mut();
        for (layer, arrays) in base.iter().enumerate() {
            let columns = engine.layers()[layer].layout.columns;
            for (array, cells) in arrays.iter().enumerate() {
                for row in 0..cells.len() / columns {
                    let cells = row * columns..(row + 1) * columns;
                    let levels: Vec<u16> = cells.map(|cell| of(layer, array, cell)).collect();
                    let levels = &levels;
                    engine.execute(&Operation::LoadWeights { layer, array, row, levels });
                }
            }
        }
        engine.settle();
    }

    /// Loads what the ranks of candidates, in pairs, ask for.
    fn write(&mut self, base: &Levels, ranks: &[i32]) {
        let mut asked: Vec<Vec<Vec<i32>>> = base
            .iter()
            .map(|arrays| arrays.iter().map(|cells| vec![0; cells.len()]).collect())
            .collect();
        for (pair, ranks) in (0..).zip(ranks.as_chunks::<2>().0) {
            let weight = ranks[0] - ranks[1];
            let signs = self.signs(pair);
            let cells = asked.iter_mut().flatten().flatten();
            for (asked, up) in cells.zip(signs.into_iter().flatten().flatten()) {
                *asked += if up { weight } else { -weight };
            }
        }
        let engine = self.player.actor.driver.engine();
        let window = engine.hardware().cell.window;
        let ends = [window.floor(), window.ceiling()].map(i32::from);
        let shift = self.law.shift;
        let mut wanted = base.clone();
        for (layer, arrays) in wanted.iter_mut().enumerate() {
            for (array, cells) in arrays.iter_mut().enumerate() {
                let layout = self.player.actor.driver.engine().layers()[layer].layout;
                let place = self.place(Site::WriteDither, layer, array, 0);
                for column in 0..layout.columns {
                    for group in 0..layout.rows.div_ceil(32) {
                        let words = place.halves(layout.rows, column, group);
                        for (row, word) in (group * 32..layout.rows).zip(words) {
                            let cell = row * layout.columns + column;
                            let random = i32::from(word) & ((1 << shift) - 1);
                            let by = (asked[layer][array][cell] + random) >> shift;
                            let level = i32::from(cells[cell]) + by;
                            cells[cell] = narrow(level.clamp(ends[0], ends[1]), "in the window");
                        }
                    }
                }
            }
        }
        self.load(base, &|layer, array, cell| wanted[layer][array][cell]);
    }
}

fn levels(engine: &Engine) -> Levels {
    let of_layer = engine
        .layers()
        .iter()
        .map(|layer| layer.arrays.iter().map(|array| array.levels().collect()).collect());
    of_layer.collect()
}

/// The lowest bit of each cell's byte, row-major.
fn bits(place: Place, layout: Layout) -> Vec<bool> {
    let mut bits = vec![false; layout.cells()];
    let mut words = [0; BLOCK_BYTES];
    for column in 0..layout.columns {
        for group in 0..layout.rows.div_ceil(BLOCK_BYTES) {
            place.bytes(layout.rows, column, group, &mut words);
            for (row, word) in (group * BLOCK_BYTES..layout.rows).zip(words) {
                bits[row * layout.columns + column] = word & 1 == 1;
            }
        }
    }
    bits
}

impl State for Evolver {
    fn visit(&mut self, visitor: &mut dyn Visitor) -> Result<(), StateError> {
        self.player.visit(visitor)?;
        let counts = [&mut self.generations, &mut self.steps];
        visit_counts(visitor, "policy.counts", Section::Task, counts.into_iter())
    }
}
