//! How error words reach a layer: what the error unit puts on its bus, and which words of the bus a unit latches.
//!
//! ```text
//! output   S[c]                                                   the words of the output layer, as they are
//! sum      sat_eb( rsh( sum_c S[c], shift ) )                     one word
//! signed   sat_eb( rsh( sum_c +-S[c], shift ) )                   a word a unit, by fixed signs
//! above    sat_eb( rsh( d, back shift of the layer above ) )                         d: its row sums
//! taps     err_j = S[w_j],  or  sat_eb( rsh( sum_t S[w_jt], shift ) );  stream n takes -err_j, or err_j where streams are alike
//! ```
//!
//! Plain data: the engine forms words by it, and counts and times that. See docs/MODEL.md, 3.2 and 3.8.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

/// Which error words a unit latches: a static tap, no matrix.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Taps {
    /// Words on the bus.
    pub width: usize,
    /// Words a unit adds.
    pub per_unit: usize,
    /// `[unit][tap]` word numbers.
    pub words: Vec<u16>,
    /// Shift of the sum of more than one word.
    pub shift: u32,
}

impl Taps {
    /// Unit c takes word c.
    #[must_use]
    pub fn identity(units: usize) -> Self {
        let words = (0..units).map(|unit| u16::try_from(unit).expect("checked by the plan"));
        Self { width: units, per_unit: 1, words: words.collect(), shift: 0 }
    }
}

/// Where the words on a layer's bus come from.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum WordSource {
    /// The output words as they are: one bus brings them to all such layers at once.
    Output,
    /// One word, the sum of the output words.
    Sum {
        /// Output words.
        outputs: usize,
        /// Shift of their sum.
        shift: u32,
    },
    /// A word a unit, each a sum of the output words with signs of its own.
    Signed {
        /// 1 or -1, `[output][unit]`.
        signs: Vec<i16>,
        /// Shift of the sum.
        shift: u32,
    },
    /// A word a unit, of a convolution one a unit and pixel behind its pool, from the rows of the layer above: its last
    /// transposed read.
    Above,
}

/// How error words reach a layer.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Delivery {
    /// What comes over the bus.
    pub source: WordSource,
    /// What units latch of it.
    pub taps: Taps,
    /// Whether stream n latches what stream p does, where it should be the negative: a control that has to fail.
    pub alike: bool,
}

impl From<Taps> for Delivery {
    /// Taps on the output words.
    fn from(taps: Taps) -> Self {
        Self { source: WordSource::Output, taps, alike: false }
    }
}

impl Delivery {
    /// The output layer: unit c takes word c.
    #[must_use]
    pub fn output(outputs: usize) -> Self {
        Taps::identity(outputs).into()
    }

    /// A layer whose units get what the layer above read from its columns.
    #[must_use]
    pub fn above(units: usize) -> Self {
        Self { source: WordSource::Above, taps: Taps::identity(units), alike: false }
    }

    /// Output words that an `ERR` of the layer carries for a sample: `CE`, or none where the layer above has them.
    #[must_use]
    pub fn output_words(&self) -> usize {
        match &self.source {
            WordSource::Output => self.taps.width,
            WordSource::Sum { outputs, .. } => *outputs,
            WordSource::Signed { signs, .. } => signs.len() / self.taps.width,
            WordSource::Above => 0,
        }
    }

    /// Whether its words are those of the output: then one bus can bring them to several layers at once.
    #[must_use]
    pub const fn is_direct(&self) -> bool {
        matches!(self.source, WordSource::Output)
    }

    /// What the error unit adds up to form the words of a sample: `CE N` for N formed words.
    #[must_use]
    pub fn terms(&self) -> usize {
        match self.source {
            WordSource::Sum { .. } | WordSource::Signed { .. } => {
                self.output_words() * self.taps.width
            }
            WordSource::Output | WordSource::Above => 0,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn formed_words_take_a_term_an_output_and_word() {
        let signed = WordSource::Signed { signs: vec![1; 3 * 7], shift: 1 };
        let dense = Delivery { source: signed, taps: Taps::identity(7), alike: false };
        assert_eq!((dense.output_words(), dense.terms(), dense.is_direct()), (3, 21, false));
        let one = Taps { width: 1, per_unit: 1, words: vec![0; 7], shift: 0 };
        let source = WordSource::Sum { outputs: 3, shift: 2 };
        let sum = Delivery { source, taps: one, alike: false };
        assert_eq!((sum.output_words(), sum.terms()), (3, 3));
        let (output, above) = (Delivery::output(3), Delivery::above(7));
        assert_eq!((output.output_words(), output.terms(), output.is_direct()), (3, 0, true));
        assert_eq!((above.output_words(), above.terms(), above.is_direct()), (0, 0, false));
    }
}
