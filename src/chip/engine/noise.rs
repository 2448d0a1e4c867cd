//! What an engine adds to ideal cells and converters: stuck cells, and noise of reads. The laws are those of `chip::device`.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use std::ops::Range;
use std::sync::Arc;

use super::Engine;
use super::conducting::Letting;
use super::window::fold;
use crate::chip::crossbar::layout::PANEL_COLUMNS;
use crate::chip::device::{Device, Direction, Noise, NoisePlace};
use crate::chip::hardware::{Adc, Hardware, Subtract};
use crate::chip::layer::{Layer, LayerSpec};
use crate::chip::population::Wiring;
use crate::num::draw::{Place, Site};
use crate::num::tables::Gaussian;

/// Gaussian numbers for a chip that needs some.
pub(super) fn gaussian_of(hardware: &Hardware) -> Option<Arc<Gaussian>> {
    let needed = hardware.read_noise.is_some() || hardware.programming.is_some();
    needed.then(|| Arc::new(Gaussian::new()))
}

/// Makes cells of a device, which remember what those of the chip do.
pub(super) fn make_cells(device: Option<Device>, of: &Hardware, layers: &mut [Layer], seed: u64) {
    if let Some(device) = device {
        let device = Arc::new(device);
        layers.iter_mut().for_each(|layer| layer.fit(&device, seed));
    }
    if let Some(law) = of.memory() {
        let law = Arc::new(law);
        layers.iter_mut().for_each(|layer| layer.remember(&law, seed));
    }
}

/// What a reader does beside the ideal.
#[derive(Debug, Clone, Default)]
pub(super) struct Beside {
    /// What conversions are off by.
    pub(super) noise: Option<Noise>,
    /// What cells let through, if not their level.
    pub(super) letting: Option<Letting>,
    /// What accumulators are multiplied by, 12 fractional bits.
    pub(super) factor: Option<i64>,
}

impl Beside {
    /// The same for reads of which the first is number `read` of these.
    pub(super) fn starting_at(&self, read: usize) -> Self {
        let noise = self.noise.as_ref().map(|noise| noise.starting_at(read));
        Self { noise, ..self.clone() }
    }

    /// Whether there is nothing.
    pub(super) const fn is_nothing(&self) -> bool {
        self.noise.is_none() && self.letting.is_none() && self.factor.is_none()
    }
}

/// Standard deviation of a conversion's noise in units of current, 8 fractional bits; `None` where there is none.
fn sd(hardware: &Hardware) -> Option<i64> {
    let bits = hardware.drive.dac_bits.min(hardware.drive.bits.get());
    let slice_max = u8::MAX >> (8 - bits);
    Some(hardware.read_noise?.sd(hardware.cell.window.ceiling(), slice_max))
}

impl Engine {
    /// Makes it another chip of the same kind: which cells are stuck, how their steps and windows differ, what loads leave and what reads
    /// are off by are drawn with this seed; none of its cells has been pulsed. Levels of cells that were stuck before stay until they are loaded. An engine starts with the
    /// seed of its run.
    pub fn set_chip_seed(&mut self, seed: u64) {
        self.chip_seed = seed;
        self.load_words.iter_mut().for_each(Vec::clear);
        let differs = |device: &Device| device.differs() != [false; 2];
        let device = self.hardware.device().filter(differs);
        make_cells(device, &self.hardware, &mut self.layers, seed);
        (0..self.layers.len()).for_each(|layer| self.levels_moved(layer));
        self.draw_faults();
    }

    pub(super) fn draw_faults(&mut self) {
        let any = |layer: &Layer| layer.arrays.iter().any(|array| !array.stuck().is_empty());
        if !self.hardware.has_stuck_cells() && !self.layers.iter().any(any) {
            return;
        }
        let seed = self.chip_seed;
        let window = self.hardware.cell.window;
        let ends = [window.floor(), window.ceiling()];
        for layer in &mut self.layers {
            let size = [layer.layout.rows, layer.layout.columns];
            for (array, pathway) in layer.arrays.iter_mut().zip(layer.spec.wiring.pathways()) {
                let place = Place {
                    seed,
                    site: Site::StuckCell,
                    layer: layer.index,
                    pathway: pathway.code,
                    sub: 0,
                    count: 0,
                };
                let drawn = self.hardware.faults.stuck(place, ends, size);
                let of = (layer.index, pathway.code);
                array.set_stuck(self.hardware.fault_map.over(drawn, of, ends));
            }
        }
    }

    /// Cells that are stuck, and all cells.
    #[must_use]
    pub fn stuck_cells(&self) -> [u64; 2] {
        let arrays = || self.layers.iter().flat_map(|layer| &layer.arrays);
        let stuck = arrays().map(|array| array.stuck().len() as u64).sum();
        [stuck, arrays().map(|array| array.layout().cells() as u64).sum()]
    }

    /// What reads of the columns of a layer have beside the ideal.
    pub(super) fn beside(&self, layer: usize) -> Beside {
        Beside {
            noise: self.noise(layer, Direction::Columns),
            letting: self.letting(layer),
            factor: self.factors[layer],
        }
    }

    /// Noise of the reads of a layer of the loaded samples, if conversions have any.
    pub(super) fn noise(&self, layer: usize, direction: Direction) -> Option<Noise> {
        let sd = sd(&self.hardware)?;
        let table = Arc::clone(self.gaussian.as_ref()?);
        let this = &self.layers[layer];
        let [down, across] = this.tiles(&self.hardware);
        let tiles = match direction {
            Direction::Columns => down,
            Direction::Rows => across,
        };
        let (phase, before) = self.came;
        let first = before * this.spec.positions() as u64;
        let of = (phase as u32, first);
        Some(Noise::new(table, sd, (self.chip_seed, this.index), of, (direction, tiles)))
    }
}

/// Noise of the banks of one target stream.
pub(super) struct Noisy {
    noise: Noise,
    /// Pathway codes of both banks, by pair.
    codes: Vec<[u8; 2]>,
    /// Times that rows are driven for a read.
    phases: usize,
    /// Whether the difference of the banks is converted.
    at_difference: bool,
}

impl Noisy {
    pub(super) fn new(
        noise: Noise,
        wiring: Wiring,
        pairs: &[[usize; 2]],
        (phases, hardware): (usize, &Hardware),
    ) -> Self {
        let code = |&at: &usize| wiring.pathways()[at].code;
        Self {
            noise,
            codes: pairs.iter().map(|pair| pair.each_ref().map(code)).collect(),
            phases,
            at_difference: matches!(hardware.adc, Adc::Finite { subtract: Subtract::Current, .. }),
        }
    }

    /// Adds to the currents of pair number `pair` in the columns of a panel, `[driving][32]`, what their conversions are off by.
    pub(super) fn disturb(
        &self,
        pair: usize,
        (slice, tile): (usize, usize),
        (panel, live): (usize, usize),
        drivings: &Range<usize>,
        [e, i]: [&mut [i64]; 2],
    ) {
        let first = panel * PANEL_COLUMNS;
        for (bank, currents) in [e, i].into_iter().enumerate() {
            if self.at_difference && bank == 1 {
                continue;
            }
            for (driving, currents) in
                drivings.clone().zip(currents.chunks_exact_mut(PANEL_COLUMNS))
            {
                let at = NoisePlace {
                    pathway: self.codes[pair][bank],
                    slice: u32::try_from(slice).expect("at most 8 slices"),
                    phase: u32::try_from(driving % self.phases).expect("two phases"),
                    read: (driving / self.phases) as u64,
                    tile,
                };
                self.noise.each(at, first..first + live, |line, more| currents[line] += more);
            }
        }
    }
}

/// Adds to the row sums of a transposed read what its conversions are off by: banks of codes `codes`, each slice with its
/// weight, the second phase taken off. `read` counts from the first of all reads; `pixels` take what their rows do.
pub(super) fn disturb_rows(
    noise: &Noise,
    codes: [u8; 2],
    (hardware, spec, rows): (&Hardware, &LayerSpec, usize),
    (read, tiles): (usize, usize),
    pixels: &mut [i64],
) {
    let slices = hardware.slices();
    let mut sums = vec![0; rows];
    for tile in 0..tiles {
        sums.fill(0);
        for (pathway, inhibits) in codes.into_iter().zip([false, true]) {
            for (phase, slice) in (0..2).flat_map(|phase| (0..slices).map(move |s| (phase, s))) {
                let at = NoisePlace { pathway, slice, phase, read: read as u64, tile };
                let negative = inhibits != (phase == 1);
                noise.each(at, 0..rows, |row, more| {
                    let more = more << (slice * hardware.drive.dac_bits);
                    let more = i32::try_from(more).expect("at most 62 cells, 2^20 each");
                    sums[row] += if negative { -more } else { more };
                });
            }
        }
        fold(spec, &sums, read % spec.positions(), (0, false), pixels);
    }
}
