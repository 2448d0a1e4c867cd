//! What happened on the chip, as counts. Plain data: prices come later, from elsewhere.
//!
//! Counts are kept by layer, pathway, operation and event. Training, evaluation and calibration have a
//! ledger each. See docs/MODEL.md, 4.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

pub mod cycles;

pub use cycles::{Cycles, Interval, Part};

/// What can happen. The order is part of the state hash: append only.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(usize)]
pub enum Event {
    /// A row DAC applied one slice of a drive code.
    DacSlices,
    /// A cell carried a read current.
    CellReads,
    /// A column's current was sampled and held.
    Holds,
    /// A converter turned a current into a code.
    Conversions,
    /// A code was added to an accumulator.
    ShiftAdds,
    /// An accumulator was looked up (activation and derivative in one access).
    LookUps,
    /// An error word was multiplied with a derivative.
    Multiplies,
    /// A word crossed the error bus.
    BusWords,
    /// A product of drive and gate was added to a cell's digital accumulator.
    Accumulates,
    /// A cell's increment was computed (rounded and bounded).
    DeltaComputations,
    /// A cell's level was loaded.
    CellLoads,
    /// A cell's increment was not 0 before the bound.
    Requested,
    /// A cell's increment was changed by the bound.
    Bounded,
    /// A pulse was given to a cell.
    PulsesAttempted,
    /// A pulse moved a cell's level.
    PulsesEffective,
    /// A conversion hit its rail.
    SaturatedConversions,
    /// A table index hit its end.
    SaturatedLookUps,
    /// An error word hit its rail.
    SaturatedErrors,
    /// A gate hit its rail.
    SaturatedGates,
    /// A row of a tile was pulsed: its drivers and the lines of all its columns moved.
    RowPulses,
    /// A cell was read to see what a pulse had done.
    VerifyReads,
    /// A bit went into or came out of a digital memory beside the tiles.
    SramBits,
}

impl Event {
    /// All events, in order.
    pub const ALL: [Self; 22] = [
        Self::DacSlices,
        Self::CellReads,
        Self::Holds,
        Self::Conversions,
        Self::ShiftAdds,
        Self::LookUps,
        Self::Multiplies,
        Self::BusWords,
        Self::Accumulates,
        Self::DeltaComputations,
        Self::CellLoads,
        Self::Requested,
        Self::Bounded,
        Self::PulsesAttempted,
        Self::PulsesEffective,
        Self::SaturatedConversions,
        Self::SaturatedLookUps,
        Self::SaturatedErrors,
        Self::SaturatedGates,
        Self::RowPulses,
        Self::VerifyReads,
        Self::SramBits,
    ];

    /// Whether the count belongs to the state that is hashed. What depends on how arrays are cut into tiles, on
    /// timing or on memories beside them does not: re-tiling with ideal converters changes no state.
    #[must_use]
    pub const fn is_state(self) -> bool {
        !matches!(
            self,
            Self::DacSlices
                | Self::Holds
                | Self::Conversions
                | Self::ShiftAdds
                | Self::RowPulses
                | Self::VerifyReads
                | Self::SramBits
        )
    }

    /// Name in files.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::DacSlices => "dac_slices",
            Self::CellReads => "cell_reads",
            Self::Holds => "holds",
            Self::Conversions => "conversions",
            Self::ShiftAdds => "shift_adds",
            Self::LookUps => "look_ups",
            Self::Multiplies => "multiplies",
            Self::BusWords => "bus_words",
            Self::Accumulates => "accumulates",
            Self::DeltaComputations => "delta_computations",
            Self::CellLoads => "cell_loads",
            Self::Requested => "requested",
            Self::Bounded => "bounded",
            Self::PulsesAttempted => "pulses_attempted",
            Self::PulsesEffective => "pulses_effective",
            Self::SaturatedConversions => "saturated_conversions",
            Self::SaturatedLookUps => "saturated_look_ups",
            Self::SaturatedErrors => "saturated_errors",
            Self::SaturatedGates => "saturated_gates",
            Self::RowPulses => "row_pulses",
            Self::VerifyReads => "verify_reads",
            Self::SramBits => "sram_bits",
        }
    }
}

/// The operation during which something happened.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(usize)]
pub enum During {
    /// `LOADW`.
    LoadWeights,
    /// `FWD(rows)`.
    ForwardRows,
    /// `FWD(columns)`.
    ForwardColumns,
    /// `ERR`.
    Error,
    /// `UPD`.
    Update,
}

impl During {
    /// All operations, in order.
    pub const ALL: [Self; 5] =
        [Self::LoadWeights, Self::ForwardRows, Self::ForwardColumns, Self::Error, Self::Update];

    /// Name in files.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::LoadWeights => "load_weights",
            Self::ForwardRows => "forward_rows",
            Self::ForwardColumns => "forward_columns",
            Self::Error => "error",
            Self::Update => "update",
        }
    }
}

/// Pathway codes a layer can have.
pub const PATHWAYS: usize = 8;
const EVENTS: usize = Event::ALL.len();
const OPERATIONS: usize = During::ALL.len();

/// Counts by layer, pathway code, operation and event.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Ledger {
    counts: Vec<[[[u64; EVENTS]; OPERATIONS]; PATHWAYS]>,
    cycles: Option<Cycles>,
}

impl Ledger {
    /// A ledger of zeros.
    #[must_use]
    pub fn new(layers: usize) -> Self {
        Self { counts: vec![[[[0; EVENTS]; OPERATIONS]; PATHWAYS]; layers], cycles: None }
    }

    /// A ledger of zeros that counts cycles too.
    #[must_use]
    pub fn with_cycles(layers: usize) -> Self {
        Self { cycles: Some(Cycles::new(layers)), ..Self::new(layers) }
    }

    /// Cycles, on hardware that has a timing.
    #[must_use]
    pub const fn cycles(&self) -> Option<&Cycles> {
        self.cycles.as_ref()
    }

    /// Cycles, to count them or to restore a state.
    pub const fn cycles_mut(&mut self) -> Option<&mut Cycles> {
        self.cycles.as_mut()
    }

    /// Adds `count` events.
    pub fn add(&mut self, layer: usize, pathway: u8, during: During, event: Event, count: u64) {
        self.counts[layer][usize::from(pathway)][during as usize][event as usize] += count;
    }

    /// Events of one layer, pathway and operation.
    #[must_use]
    pub fn get(&self, layer: usize, pathway: u8, during: During, event: Event) -> u64 {
        self.counts[layer][usize::from(pathway)][during as usize][event as usize]
    }

    /// Number of layers.
    #[must_use]
    pub fn layers(&self) -> usize {
        self.counts.len()
    }

    /// Events over all layers, pathways and operations.
    #[must_use]
    pub fn total(&self, event: Event) -> u64 {
        self.counts.iter().flatten().flatten().map(|events| events[event as usize]).sum()
    }

    /// Events of one layer and pathway over all operations.
    #[must_use]
    pub fn of_pathway(&self, layer: usize, pathway: u8, event: Event) -> u64 {
        self.counts[layer][usize::from(pathway)].iter().map(|events| events[event as usize]).sum()
    }

    /// The non-zero counts, in order.
    pub fn entries(&self) -> impl Iterator<Item = (usize, u8, During, Event, u64)> + '_ {
        self.counts.iter().enumerate().flat_map(|(layer, pathways)| {
            pathways.iter().zip(0u8..).flat_map(move |(operations, pathway)| {
                During::ALL.into_iter().zip(operations).flat_map(move |(during, events)| {
                    Event::ALL
                        .into_iter()
                        .zip(events)
                        .filter(|(_, count)| **count != 0)
                        .map(move |(event, &count)| (layer, pathway, during, event, count))
                })
            })
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_order_of_events_and_operations_is_their_number() {
        assert!(Event::ALL.iter().enumerate().all(|(i, &e)| e as usize == i));
        assert!(During::ALL.iter().enumerate().all(|(i, &d)| d as usize == i));
    }

    #[test]
    fn totals_add_over_layers_pathways_and_operations() {
        let mut ledger = Ledger::new(2);
        ledger.add(0, 1, During::Update, Event::Requested, 3);
        ledger.add(1, 4, During::Error, Event::Requested, 4);
        assert_eq!((ledger.total(Event::Requested), ledger.total(Event::Bounded)), (7, 0));
        assert_eq!(ledger.of_pathway(1, 4, Event::Requested), 4);
        let entries: Vec<_> = ledger.entries().collect();
        assert_eq!(
            entries,
            [
                (0, 1, During::Update, Event::Requested, 3),
                (1, 4, During::Error, Event::Requested, 4)
            ]
        );
    }
}
