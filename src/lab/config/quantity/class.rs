//! What takes a joule, a watt or a square metre: device, converter or digital logic, or what is always on.
//!
//! One digital constant can outweigh the whole array, so every total is split into these four.

use super::{CostTable, Per, Quantity};
use crate::chip::ledger::Event;

/// Into what every total is split.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum CostClass {
    /// Cells and the lines they hang on: reads, loads, pulses, and the light or heat that holds them.
    Device,
    /// What stands between cells and codes: row drivers, sample and hold, converters, receivers of light.
    Converter,
    /// Adders, tables, multipliers, buses, and memories beside the tiles.
    Digital,
    /// Leakage, clocks and references: what flows whatever happens.
    Static,
}

impl CostClass {
    /// Each of them, in the order of tables.
    pub const EACH: &'static [Self] = &[Self::Device, Self::Converter, Self::Digital, Self::Static];

    /// Name in tables and files.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Device => "device",
            Self::Converter => "converter",
            Self::Digital => "digital",
            Self::Static => "static",
        }
    }

    /// What an event is of. Without a wildcard: a new event says it or does not compile.
    const fn of_event(event: Event) -> Self {
        match event {
            Event::CellReads
            | Event::CellLoads
            | Event::Requested
            | Event::Bounded
            | Event::PulsesAttempted
            | Event::PulsesEffective
            | Event::PulsesCopied
            | Event::LoadsCopied
            | Event::RowPulses => Self::Device,
            // a verify read is one cell's current and a whole conversion
            Event::DacSlices
            | Event::Holds
            | Event::Conversions
            | Event::SaturatedConversions
            | Event::VerifyReads => Self::Converter,
            Event::ShiftAdds
            | Event::LookUps
            | Event::Multiplies
            | Event::BusWords
            | Event::Accumulates
            | Event::DeltaComputations
            | Event::Squares
            | Event::Roots
            | Event::Scalings
            | Event::RowMeans
            | Event::SumSquares
            | Event::OptimiserSteps
            | Event::Pooled
            | Event::ThresholdSubtractions
            | Event::StatisticAdds
            | Event::SoftmaxLookUps
            | Event::SaturatedLookUps
            | Event::SaturatedErrors
            | Event::SaturatedGates
            | Event::SramBits => Self::Digital,
            #[cfg(feature = "grown")]
            Event::Grown => Self::Digital,
        }
    }
}

impl Quantity {
    /// What takes it.
    #[must_use]
    pub fn class(&self) -> CostClass {
        match (self.per, self.table) {
            (Per::Event(event), _) => CostClass::of_event(event),
            // light for cells and heat in them
            (Per::Cell, _) => CostClass::Device,
            (Per::Tile, CostTable::Power) if self.name == "laser" => CostClass::Device,
            (Per::Column | Per::Row | Per::Converter, _) => CostClass::Converter,
            // what a tile has beside cells and converters
            (Per::Tile | Per::Chip, CostTable::Area) => CostClass::Digital,
            (Per::Tile | Per::Chip, _) => CostClass::Static,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lab::config::QUANTITIES;

    #[test]
    fn every_quantity_is_of_one_class() {
        let of = |class| {
            let of_class = QUANTITIES.iter().filter(|q| q.class() == class);
            of_class.map(|q| format!("{}.{}", q.table.name(), q.name)).collect::<Vec<_>>().join(" ")
        };
        let found: Vec<_> = CostClass::EACH.iter().map(|&class| of(class)).collect();
        assert_eq!(
            found,
            [
                "energy.cell_read energy.cell_load energy.cell_pulse energy.row_pulse power.laser power.heater area.cell",
                "energy.dac_slice energy.hold energy.conversion energy.verify_read power.receiver area.adc area.dac",
                "energy.shift_add energy.look_up energy.multiply energy.bus_word energy.accumulate energy.delta \
                 energy.sram_bit energy.square energy.root energy.scaling energy.row_mean energy.sum_square \
                 energy.optimiser_step energy.pooling energy.threshold_subtraction energy.statistic_add \
                 energy.softmax_look_up area.tile",
                "power.static power.tile_static",
            ]
        );
    }
}
