//! Waves: one update of a training, cycle by cycle, in files that viewers open.
//!
//! ```text
//! VCD        registers of one tile over cycles (docs/TILE.md); GTKWave, Surfer
//! Perfetto   what every part of every tile did when, one track a part; ui.perfetto.dev, chrome://tracing
//! ```
//!
//! The update is found by the fast engine and played again by the cycle-by-cycle network of tiles, from what there was when it
//! began: behind the rollout of a policy, whose reads count for converters that track. The network has to reach the same
//! state in as many cycles: a trace that does not is an error of ours, and said. A run of several networks, whose layers are
//! numbered through, is played by the one that has the tile's layer.

use std::cell::RefCell;
use std::rc::Rc;

use crate::chip::engine::tick::{Network, PartSpan, Span, Tile, TileAt};
use crate::chip::engine::{Phase, Recorded};
use crate::chip::ledger::Cycles;
use crate::lab::config::Config;
use crate::lab::data::{self, DataRoot};
use crate::lab::run::{Machine, RunError, Session};

mod perfetto;
mod vcd;

/// Registers with more numbers than this are left out of a wave, unless all are asked for.
const NUMBERS_MAX: usize = 512;

/// What to look at.
#[derive(Debug, Clone, Copy)]
pub struct Look {
    /// Which update, from 1.
    pub update: u64,
    /// Which tile's registers.
    pub tile: TileAt,
    /// Whether registers of whole arrays are written too.
    pub all: bool,
}

/// One update, as it can be looked at.
#[derive(Debug)]
pub struct Wave {
    /// Registers of the tile over cycles.
    pub vcd: Vec<u8>,
    /// Operations of all tiles over time.
    pub perfetto: String,
    /// Cycles by stage, layer and part.
    pub cycles: Cycles,
}

/// Plays an update of an experiment.
///
/// # Errors
/// When the configuration has no timing, data cannot be read, there is no such update or tile.
pub fn record(
    config: &Config,
    root: &DataRoot,
    machine: Machine,
    look: Look,
) -> Result<Wave, RunError> {
    let Some(timing) = config.hardware.timing else {
        return Err(RunError::NoTiming { model: config.hardware_name.clone() });
    };
    let mut session = Session::new(config, data::load(&config.source()?, root)?, machine)?;
    session.keep_tape();
    session.updates(look.update)?;
    let counts = session.engines().into_iter().map(|engine| engine.layers().len());
    let (which, first_layer) = network_of(look.tile.layer, counts);
    let tape = session.take_tape(which);
    let engine = session.engines()[which];
    let start = engine.update_start().expect("an update was recorded");
    let samples = samples_of(&tape, engine.layers()[0].spec.sample_inputs());

    let mut network = Network::new(&config.hardware, config.seed, &start.layers, samples);
    network.set_learning(engine.mantissas(), engine.potentiation_only());
    network.set_error_unit(&start.unit);
    network.set_unlooked(start.unlooked);
    network.set_loaded(start.loaded);
    let place = TileAt { layer: look.tile.layer - first_layer, ..look.tile };
    let grid = (place.layer < engine.layers().len()).then(|| network.grid(place.layer));
    let inside = |[targets, downs, acrosses]: [usize; 3]| {
        place.target < targets && place.down < downs && place.across < acrosses
    };
    if !grid.is_some_and(inside) {
        let layers = first_layer + engine.layers().len();
        return Err(RunError::NoTile { layers, grid });
    }
    network.keep_spans();
    let writer = Rc::new(RefCell::new(vcd::Writer::new(timing.clock_khz, look.all)));
    let sink = Rc::clone(&writer);
    network.watch_tile(place, move |cycle, tile: &Tile| {
        let most = if look.all { usize::MAX } else { NUMBERS_MAX };
        sink.borrow_mut().cycle(cycle, &tile.registers_within(most));
    });
    network.play_tape(&tape);

    for (at, layer) in engine.layers().iter().enumerate() {
        let ranges = network.adc_shifts(at);
        assert!(layer.adc_shifts == ranges, "cycle by cycle, layer {at} reaches other ranges");
        for (array, cells) in layer.arrays.iter().enumerate() {
            let same = cells.levels().eq(network.levels(at, array));
            assert!(same, "cycle by cycle, layer {at} reaches other levels");
        }
    }
    let spans: Vec<Span> = network.take_spans();
    let parts: Vec<PartSpan> = network.take_parts();
    let grids: Vec<_> = (0..engine.layers().len()).map(|layer| network.grid(layer)).collect();
    let cycles = network.ledger(Phase::Training).cycles().expect("counted").clone();
    let vcd = writer.borrow_mut().finish();
    Ok(Wave { vcd, perfetto: perfetto::text(&spans, &parts, &grids, timing.clock_khz), cycles })
}

/// Which of some networks of so many layers each has a layer, and the number of its first one; the last network where none has.
fn network_of(layer: usize, counts: impl ExactSizeIterator<Item = usize>) -> (usize, usize) {
    let (mut first, last) = (0, counts.len() - 1);
    for (which, count) in counts.enumerate() {
        if which == last || layer < first + count {
            return (which, first);
        }
        first += count;
    }
    (last, first)
}

fn samples_of(tape: &[Recorded], inputs: usize) -> usize {
    let count = |recorded: &Recorded| match recorded {
        Recorded::LoadDrives { codes } => codes.len() / inputs,
        _ => 0,
    };
    tape.iter().map(count).max().unwrap_or(0)
}
