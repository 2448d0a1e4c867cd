//! The list of what can be priced: names, what they are counted by, where they can lie, and why.

use super::{CostTable, Per, Quantity};
use crate::chip::ledger::Event;
use crate::lab::config::law::Setting;

const fn energy(name: &'static str, event: Event, sane: [f64; 2], why: &'static str) -> Quantity {
    Quantity { table: CostTable::Energy, name, per: Per::Event(event), sane, why, belongs: &[] }
}

const fn power(name: &'static str, per: Per, sane: [f64; 2], why: &'static str) -> Quantity {
    Quantity { table: CostTable::Power, name, per, sane, why, belongs: &[] }
}

const fn area(name: &'static str, per: Per, sane: [f64; 2], why: &'static str) -> Quantity {
    Quantity { table: CostTable::Area, name, per, sane, why, belongs: &[] }
}

impl Quantity {
    /// The same, of these settings.
    const fn of(self, belongs: &'static [Setting]) -> Self {
        Self { belongs, ..self }
    }
}

/// Every quantity a model can give. An event without a line here costs nothing by itself: it says what came of
/// another one (a saturation, a pulse that was effective).
pub const QUANTITIES: [Quantity; 34] = [
    energy(
        "dac_slice",
        Event::DacSlices,
        [1e-17, 1e-10],
        "a 1-bit driver takes 0.4 pJ in 100 ns, an 8-bit one at 14 GS/s 3.6 pJ; a public table has 0.5 nJ by a missing 1e-3",
    )
    .of(&[Setting::DacBits, Setting::ReadNs, Setting::Columns]),
    energy(
        "cell_read",
        Event::CellReads,
        [1e-18, 1e-10],
        "V^2 G t lies between 0.1 V, 10 nS, 1 ns and 0.5 V, 0.2 mS, 1 us",
    )
    .of(&[Setting::ReadNs, Setting::DacBits]),
    energy("hold", Event::Holds, [1e-18, 1e-12], "C V^2 of some femtofarads"),
    energy(
        "conversion",
        Event::Conversions,
        [1e-14, 1e-10],
        "published converters of 4 to 9 bits lie between 0.05 and 20 pJ",
    )
    .of(&[Setting::AdcBits, Setting::Converter]),
    energy(
        "shift_add",
        Event::ShiftAdds,
        [1e-16, 1e-11],
        "an adder of 8 to 32 bits takes 1 fJ to 1 pJ",
    ),
    energy("look_up", Event::LookUps, [1e-16, 1e-10], "a read of a small memory")
    .of(&[Setting::LutBits]),
    energy("multiply", Event::Multiplies, [1e-16, 1e-11], "8 x 8 bits take 10 fJ to 0.4 pJ")
    .of(&[Setting::ErrorBits]),
    energy(
        "bus_word",
        Event::BusWords,
        [1e-16, 1e-10],
        "8 wires over up to centimetres, 0.1 pJ a bit and millimetre",
    )
    .of(&[Setting::ErrorBits]),
    energy(
        "accumulate",
        Event::Accumulates,
        [1e-16, 1e-11],
        "a multiplication and an addition, without the memory",
    )
    .of(&[Setting::DriveBits]),
    energy(
        "delta",
        Event::DeltaComputations,
        [1e-16, 1e-11],
        "a shift, an addition of a random word and a clamp",
    )
    .of(&[Setting::DitherBits]),
    energy(
        "cell_load",
        Event::CellLoads,
        [1e-18, 1e-6],
        "one gate charge, or a hundred verified pulses of phase change",
    )
    .of(&[Setting::PulseNs, Setting::Levels]),
    energy(
        "cell_pulse",
        Event::PulsesAttempted,
        [1e-18, 1e-7],
        "from a FeFET's gate charge (35 aJ) to a phase-change pulse (29 nJ)",
    )
    .of(&[Setting::PulseNs, Setting::Levels]),
    energy(
        "row_pulse",
        Event::RowPulses,
        [1e-16, 1e-8],
        "C V^2 of a row line and of the columns it crosses",
    )
    .of(&[Setting::Rows, Setting::Columns]),
    energy(
        "verify_read",
        Event::VerifyReads,
        [1e-18, 1e-9],
        "a read of one cell with its conversion",
    )
    .of(&[Setting::AdcBits, Setting::Converter, Setting::ReadNs]),
    energy(
        "sram_bit",
        Event::SramBits,
        [1e-17, 1e-11],
        "7 fJ (2 Mb at 7 nm) to 160 fJ (8 KB at 45 nm) a bit",
    ),
    energy("square", Event::Squares, [1e-14, 1e-10], "a product of 32 bits and an addition of 64"),
    energy("root", Event::Roots, [1e-14, 1e-9], "a root and a division, bit by bit"),
    energy("scaling", Event::Scalings, [1e-14, 1e-10], "a product of 32 and 46 bits, and a shift"),
    energy("row_mean", Event::RowMeans, [1e-16, 1e-11], "a product, a shift and an addition"),
    energy(
        "sum_square",
        Event::SumSquares,
        [1e-14, 1e-10],
        "a product of 32 bits and an addition of more than 64",
    ),
    energy(
        "optimiser_step",
        Event::OptimiserSteps,
        [1e-16, 1e-11],
        "a comparison, a random word and a pulse or none; more with words of its own",
    ),
    energy("pooling", Event::Pooled, [1e-16, 1e-11], "an addition or a comparison of 8 to 16 bits"),
    energy(
        "threshold_subtraction",
        Event::ThresholdSubtractions,
        [1e-16, 1e-11],
        "a register of 32 bits is read, and a subtraction of 32 bits",
    ),
    energy(
        "statistic_add",
        Event::StatisticAdds,
        [1e-16, 1e-11],
        "an addition to a register of 64 bits, and a square of 10 bits for a gain",
    ),
    energy(
        "softmax_look_up",
        Event::SoftmaxLookUps,
        [1e-16, 1e-11],
        "an entry of 8 to 16 bits out of a table of 1,024",
    ),
    power("static", Per::Chip, [1e-9, 1e3], "leakage, clocks and references of a chip"),
    power("tile_static", Per::Tile, [1e-12, 1e2], "leakage and bias of a tile")
    .of(&[Setting::Rows, Setting::Columns]),
    power("laser", Per::Tile, [1e-6, 1e2], "light for a tile, at the wall plug")
    .of(&[Setting::Rows, Setting::Columns]),
    power(
        "heater",
        Per::Cell,
        [1e-12, 1e-1],
        "a micro-mechanical shifter holds with nanowatts, a thermal one with 30 mW",
    ),
    power(
        "receiver",
        Per::Column,
        [1e-9, 1e-1],
        "a photodiode and its amplifier take some milliwatts",
    ),
    area("cell", Per::Cell, [1e-16, 1e-7], "from 10 nm squared to an interferometer"),
    area("adc", Per::Converter, [1e-12, 1e-6], "published converters take 500 to 10000 um2")
    .of(&[Setting::AdcBits, Setting::Converter]),
    area("dac", Per::Row, [1e-13, 1e-6], "a driver of one bit up to a fast 8-bit converter")
    .of(&[Setting::DacBits]),
    area("tile", Per::Tile, [1e-12, 1e-4], "what a tile has beside cells and converters")
    .of(&[Setting::Rows, Setting::Columns]),
];
