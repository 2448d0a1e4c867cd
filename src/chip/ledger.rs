//! What happened on the chip, as counts. Plain data: prices come later, from elsewhere.
//!
//! Counts are kept by layer, pathway, operation and event. Training, evaluation and calibration have a
//! ledger each. See docs/MODEL.md, 4.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

pub mod cycles;
mod state;

pub use cycles::{Cycles, Interval, Part};

/// Enums whose variants have a code that files and hashes use, and a name: said once, in one table. Codes are never
/// reused.
macro_rules! coded {
    ($(#[$doc:meta])* $name:ident {
        $($(#[doc = $of:literal])* $(#[cfg($cfg:meta)])? $variant:ident = $code:literal, $word:literal;)*
    }) => {
        $(#[$doc])*
        #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
        #[repr(usize)]
        pub enum $name {
            $($(#[doc = $of])* $(#[cfg($cfg)])? $variant = $code,)*
        }

        impl $name {
            /// How many there are.
            pub const COUNT: usize = [$($(#[cfg($cfg)])? $code,)*].len();

            /// All of them, in the order of their codes.
            pub const ALL: [Self; Self::COUNT] = [$($(#[cfg($cfg)])? Self::$variant,)*];

            /// Code in hashes and checkpoints.
            #[must_use]
            pub const fn code(self) -> u32 {
                self as u32
            }

            /// The one with a code.
            #[must_use]
            pub fn of_code(code: u64) -> Option<Self> {
                Self::ALL.into_iter().find(|one| u64::from(one.code()) == code)
            }

            /// Name in files.
            #[must_use]
            pub const fn name(self) -> &'static str {
                match self {
                    $($(#[cfg($cfg)])? Self::$variant => $word,)*
                }
            }
        }
    };
}

pub(crate) use coded;

coded! {
    /// What can happen.
    Event {
        /// A row DAC applied one slice of a drive code.
        DacSlices = 0, "dac_slices";
        /// A cell carried a read current.
        CellReads = 1, "cell_reads";
        /// A column's current was sampled and held.
        Holds = 2, "holds";
        /// A converter turned a current into a code.
        Conversions = 3, "conversions";
        /// A code was added to an accumulator.
        ShiftAdds = 4, "shift_adds";
        /// An accumulator was looked up (activation and derivative in one access).
        LookUps = 5, "look_ups";
        /// An error word was multiplied with a derivative.
        Multiplies = 6, "multiplies";
        /// A word crossed the error bus.
        BusWords = 7, "bus_words";
        /// A product of drive and gate was added to a cell's digital accumulator.
        Accumulates = 8, "accumulates";
        /// A cell's increment was computed (rounded and bounded).
        DeltaComputations = 9, "delta_computations";
        /// A cell's level was loaded.
        CellLoads = 10, "cell_loads";
        /// A cell's increment was not 0 before the bound.
        Requested = 11, "requested";
        /// A cell's increment was changed by the bound.
        Bounded = 12, "bounded";
        /// A pulse was given to a cell.
        PulsesAttempted = 13, "pulses_attempted";
        /// A pulse moved a cell's level.
        PulsesEffective = 14, "pulses_effective";
        /// A conversion hit its rail.
        SaturatedConversions = 15, "saturated_conversions";
        /// A table index hit its end.
        SaturatedLookUps = 16, "saturated_look_ups";
        /// An error word hit its rail.
        SaturatedErrors = 17, "saturated_errors";
        /// A gate hit its rail.
        SaturatedGates = 18, "saturated_gates";
        /// A row of a tile was pulsed: its drivers and the lines of all its columns moved.
        RowPulses = 19, "row_pulses";
        /// A cell was read to see what a pulse had done.
        VerifyReads = 20, "verify_reads";
        /// A bit went into or came out of a digital memory beside the tiles.
        SramBits = 21, "sram_bits";
        /// An accumulator was squared and added to the sum that a layer is normalised by.
        Squares = 22, "squares";
        /// The root of a sum of squares was taken, and its reciprocal.
        Roots = 23, "roots";
        /// An accumulator was multiplied with such a reciprocal.
        Scalings = 24, "scalings";
        /// The mean of a row's drives was kept or used, of centred updates.
        RowMeans = 25, "row_means";
        /// A sum of a cell was squared and added, for an optimiser that looks at a whole layer.
        SumSquares = 26, "sum_squares";
        /// An optimiser looked at a cell: what is asked of it was computed, and a word of its own renewed if it has one.
        OptimiserSteps = 27, "optimiser_steps";
        /// A code of a unit went into a pool.
        Pooled = 28, "pooled";
        /// A unit took its threshold off an accumulator.
        ThresholdSubtractions = 29, "threshold_subtractions";
        /// An accumulator, or the square of its table index, was added to a statistic of thresholds or gains.
        StatisticAdds = 30, "statistic_adds";
        /// A table of the softmax of outputs was looked up.
        SoftmaxLookUps = 31, "softmax_look_ups";
        /// A pulse was given to a cell of a further copy of its array: one that the cell of the first was given too.
        PulsesCopied = 32, "pulses_copied";
        /// A level was loaded into a cell of a further copy of its array.
        LoadsCopied = 33, "loads_copied";
        /// What a later program counts and no run of this one ever does.
        #[cfg(feature = "grown")]
        Grown = 34, "grown";
    }
}

impl Event {
    /// Whether the count follows from how arrays are cut into tiles, from how many copies there are of them, from timing or
    /// from memories beside them. Such counts are no part of the state hash: re-tiling with ideal converters changes no state.
    #[must_use]
    pub const fn moves_with_tiling(self) -> bool {
        matches!(
            self,
            Self::DacSlices
                | Self::Holds
                | Self::Conversions
                | Self::ShiftAdds
                | Self::RowPulses
                | Self::VerifyReads
                | Self::SramBits
                | Self::PulsesCopied
                | Self::LoadsCopied
        )
    }
}

coded! {
    /// The operation during which something happened.
    During {
        /// `LOADW`.
        LoadWeights = 0, "load_weights";
        /// `FWD(rows)`.
        ForwardRows = 1, "forward_rows";
        /// `FWD(columns)`.
        ForwardColumns = 2, "forward_columns";
        /// `ERR`.
        Error = 3, "error";
        /// `UPD`.
        Update = 4, "update";
    }
}

/// Pathway codes a layer can have.
pub const PATHWAYS: usize = 8;
const EVENTS: usize = Event::COUNT;
const OPERATIONS: usize = During::COUNT;

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

    /// Sets every count to 0.
    fn forget_counts(&mut self) {
        self.counts.fill([[[0; EVENTS]; OPERATIONS]; PATHWAYS]);
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
    fn codes_are_places_and_come_back() {
        assert!(Event::ALL.iter().enumerate().all(|(i, &e)| e.code() as usize == i));
        assert!(During::ALL.iter().enumerate().all(|(i, &d)| d.code() as usize == i));
        assert_eq!(Event::of_code(21), Some(Event::SramBits));
        assert_eq!((Event::of_code(99), During::of_code(5)), (None, None));
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
