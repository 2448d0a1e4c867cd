//! What the shadow can be told to get wrong. A law that does not notice each of these is no law.

/// One wrong equation.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Fault {
    /// A pulse beyond the ceiling comes out at the floor.
    WrapAtCeiling,
    /// The floor is one level lower.
    FloorOffByOne,
    /// The ceiling is one level higher.
    CeilingOffByOne,
    /// Inhibitory increments are negated after they are rounded.
    SignAfterRounding,
    /// Increments are not bounded.
    MissingBound,
    /// Pulses clamped at the window count as effective.
    ClampedPulseCounts,
    /// A cell draws the word of the cell below.
    DitherOfNeighbour,
    /// Dither is numbered on an array padded to whole blocks.
    DitherOfPaddedArray,
    /// Dither of the write before.
    StaleWriteCount,
    /// Rows and columns of separable dither trade places.
    SeparableSwapped,
    /// Every array draws the first pathway's dither.
    DitherOfOnePathway,
    /// The remainder is dropped.
    ResidualNotKept,
    /// The remainder may grow by what the bound held back.
    ResidualWindsUp,
    /// The small factor of the rate is applied after rounding.
    MantissaAfterRounding,
    /// A differential pair moves at the rate of one cell.
    PairShiftMissing,
    /// Pruned cells are lifted.
    PrunedCellLives,
    /// Cells on the floor are pruned without a pulse.
    PrunedWithoutPulse,
    /// A unit taps the next word.
    TapOffByOne,
    /// Sums of taps are not bounded.
    TapSumUnbounded,
    /// Stream n hears the error as it is.
    StreamNotNegated,
    /// Stream n multiplies with the derivative of p.
    DerivativeOfOtherStream,
    /// Gates truncate.
    GateTruncates,
    /// `np` accumulates the activity of p.
    WrongSource,
    /// Potentiation lets every gate through.
    DepressesAll,
    /// Converters truncate.
    ConverterTruncates,
    /// The converter's rail is one code lower.
    RailOffByOne,
    /// Reaching the rail counts as saturation.
    RailCounts,
    /// The excitatory bank is subtracted from the inhibitory one.
    SubtractSwapped,
    /// What is read below 0 is added.
    BelowAdds,
    /// What lies below 0 moves cells as what lies above.
    BelowMovesAlike,
    /// Slices are added without their weight.
    SliceShiftMissing,
    /// The last row of a tile is not read.
    TileEdgeLost,
    /// Calibration forgets its headroom.
    HeadroomForgotten,
    /// Calibration ends one shift early.
    CalibrationOneLower,
    /// The table index truncates.
    IndexTruncates,
    /// The next layer's drive truncates.
    DriveTruncates,
    /// The constant row is not driven.
    ConstantRowDark,
    /// The negative phase of a transposed read adds.
    BackwardPhaseAdds,
    /// A write of nothing is not counted.
    EmptyWriteNotCounted,
    /// Errors are not centred on the mean of their batch.
    MeanForgotten,
    /// All output words are added, whatever their sign.
    SignsIgnored,
    /// Row sums of the layer above are halved once too often.
    WordsAboveOffByOne,
    /// A transposed read takes its gates from no memory.
    GateMemoryFree,
    /// Converters that track never take a greater step.
    ShiftStays,
    /// What was on the rail before the last look counts again.
    RailsAreKept,
    /// Reads without learning are tracked too.
    EvaluationIsTracked,
    /// The least code of a difference is not on the rail.
    LeastCodeIsNoRail,
    /// A load moves stuck cells.
    StuckCellIsLoaded,
    /// Pulses move stuck cells.
    StuckCellMoves,
    /// An absorbing floor prunes cells that are stuck on it.
    StuckCellIsPruned,
    /// A noisy load leaves what it was asked for.
    LoadIsExact,
    /// A conversion has the noise of the line beside it.
    NoiseOfNeighbour,
    /// All samples of a batch have the noise of the first.
    NoiseOfFirstSample,
    /// Reads from the columns have no noise.
    BackwardIsQuiet,
    /// What level 0 conducts is not taken off by the reference column.
    ReferenceStays,
    /// Wires run through all tiles of an array.
    WiresCrossTiles,
    /// Only the wires along rows have a resistance.
    ColumnsHaveNoWires,
}

impl Fault {
    /// All of them.
    pub(crate) const ALL: [Self; 57] = [
        Self::WrapAtCeiling,
        Self::FloorOffByOne,
        Self::CeilingOffByOne,
        Self::SignAfterRounding,
        Self::MissingBound,
        Self::ClampedPulseCounts,
        Self::DitherOfNeighbour,
        Self::DitherOfPaddedArray,
        Self::StaleWriteCount,
        Self::SeparableSwapped,
        Self::DitherOfOnePathway,
        Self::ResidualNotKept,
        Self::ResidualWindsUp,
        Self::MantissaAfterRounding,
        Self::PairShiftMissing,
        Self::PrunedCellLives,
        Self::PrunedWithoutPulse,
        Self::TapOffByOne,
        Self::TapSumUnbounded,
        Self::StreamNotNegated,
        Self::DerivativeOfOtherStream,
        Self::GateTruncates,
        Self::WrongSource,
        Self::DepressesAll,
        Self::ConverterTruncates,
        Self::RailOffByOne,
        Self::RailCounts,
        Self::SubtractSwapped,
        Self::BelowAdds,
        Self::BelowMovesAlike,
        Self::SliceShiftMissing,
        Self::TileEdgeLost,
        Self::HeadroomForgotten,
        Self::CalibrationOneLower,
        Self::IndexTruncates,
        Self::DriveTruncates,
        Self::ConstantRowDark,
        Self::BackwardPhaseAdds,
        Self::EmptyWriteNotCounted,
        Self::MeanForgotten,
        Self::SignsIgnored,
        Self::WordsAboveOffByOne,
        Self::GateMemoryFree,
        Self::ShiftStays,
        Self::RailsAreKept,
        Self::EvaluationIsTracked,
        Self::LeastCodeIsNoRail,
        Self::StuckCellIsLoaded,
        Self::StuckCellMoves,
        Self::StuckCellIsPruned,
        Self::LoadIsExact,
        Self::NoiseOfNeighbour,
        Self::NoiseOfFirstSample,
        Self::BackwardIsQuiet,
        Self::ReferenceStays,
        Self::WiresCrossTiles,
        Self::ColumnsHaveNoWires,
    ];
}
