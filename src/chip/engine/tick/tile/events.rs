//! Counters of a tile: docs/TILE.md, 6.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

/// Counters of one bank, in the order of docs/TILE.md, 6.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct BankEvents {
    /// Levels loaded.
    pub cell_loads: u64,
    /// Rows driven with a slice.
    pub dac_slices: u64,
    /// Cells that carried a read.
    pub cell_reads: u64,
    /// Columns sampled.
    pub holds: u64,
    /// Conversions.
    pub conversions: u64,
    /// Codes added up.
    pub shift_adds: u64,
    /// Products added to sums.
    pub accumulates: u64,
    /// Increments computed.
    pub delta_computations: u64,
    /// Increments that were not 0 before the bound.
    pub requested: u64,
    /// Increments that the bound changed.
    pub bounded: u64,
    /// Pulses given.
    pub pulses_attempted: u64,
    /// Levels moved.
    pub pulses_effective: u64,
    /// Conversions on the rail.
    pub saturated_conversions: u64,
    /// Only in networks.
    pub verify_reads: u64,
    /// Only in networks: sums squared.
    pub sum_squares: u64,
    /// Only in networks: sums that an optimiser asked for something by.
    pub optimiser_steps: u64,
    /// Only in networks: pulses given to a further copy of an array.
    pub pulses_copied: u64,
}

/// Counters of a tile, in the order of docs/TILE.md, 6.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct TileEvents {
    /// Columns looked up.
    pub look_ups: u64,
    /// Indices on the rail.
    pub saturated_look_ups: u64,
    /// Words heard.
    pub bus_words: u64,
    /// Words multiplied with slopes.
    pub multiplies: u64,
    /// Gates on the rail.
    pub saturated_gates: u64,
    /// Pulses of a row.
    pub row_pulses: u64,
    /// Only in networks: sums of taps that hit their rail.
    pub saturated_errors: u64,
    /// Only in networks: thresholds taken off sums.
    pub threshold_subtractions: u64,
    /// Only in networks: sums and squares added up beside the table.
    pub statistic_adds: u64,
}

impl BankEvents {
    /// What of it a copy of an array beside the first counts: its reads and its pulses, not what is formed for all of them.
    #[must_use]
    pub(in super::super) const fn of_copy(self) -> Self {
        Self {
            accumulates: 0,
            delta_computations: 0,
            requested: 0,
            bounded: 0,
            pulses_attempted: 0,
            pulses_effective: 0,
            sum_squares: 0,
            optimiser_steps: 0,
            pulses_copied: self.pulses_attempted,
            ..self
        }
    }

    pub(in super::super) const fn merge(&mut self, more: &Self) {
        self.cell_loads += more.cell_loads;
        self.dac_slices += more.dac_slices;
        self.cell_reads += more.cell_reads;
        self.holds += more.holds;
        self.conversions += more.conversions;
        self.shift_adds += more.shift_adds;
        self.accumulates += more.accumulates;
        self.delta_computations += more.delta_computations;
        self.requested += more.requested;
        self.bounded += more.bounded;
        self.pulses_attempted += more.pulses_attempted;
        self.pulses_effective += more.pulses_effective;
        self.saturated_conversions += more.saturated_conversions;
        self.verify_reads += more.verify_reads;
        self.sum_squares += more.sum_squares;
        self.optimiser_steps += more.optimiser_steps;
        self.pulses_copied += more.pulses_copied;
    }
}

impl TileEvents {
    /// Adds another tile's; words on the bus are heard by all, and counted where `bus` says so.
    pub(in super::super) const fn merge(&mut self, more: &Self, bus: bool) {
        self.look_ups += more.look_ups;
        self.saturated_look_ups += more.saturated_look_ups;
        self.bus_words += if bus { more.bus_words } else { 0 };
        self.multiplies += more.multiplies;
        self.saturated_gates += more.saturated_gates;
        self.row_pulses += more.row_pulses;
        self.saturated_errors += more.saturated_errors;
        self.threshold_subtractions += more.threshold_subtractions;
        self.statistic_adds += more.statistic_adds;
    }
}
