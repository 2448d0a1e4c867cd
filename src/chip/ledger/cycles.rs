//! How long it took: cycles, beside the counts of what happened.
//!
//! Three views of the same time. *Elapsed*: by interval of an update, what a clock on the wall would show; intervals
//! do not overlap, so they add up. *Busy*: by layer and operation, from the acceptance of a command until it is done; layers
//! work side by side, so these do not add up to elapsed. *Used*: by layer and part of its tiles; used / elapsed is a
//! part's utilisation. See docs/MODEL.md, 4.5.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use super::{During, coded};

coded! {
    /// What the chip as a whole is doing.
    Interval {
        /// `LOADW`: levels of a fresh network, row by row.
        Load = 0, "load";
        /// `FWD(rows)`, layers in a pipeline.
        Forward = 1, "forward";
        /// The error unit takes the mean over the batch.
        Centre = 2, "centre";
        /// `ERR`: words on the bus, gates.
        Error = 3, "error";
        /// `FWD(columns)`.
        Columns = 4, "columns";
        /// `UPD(add)`.
        Accumulate = 5, "accumulate";
        /// `UPD(now)` and `UPD(write)`.
        Program = 6, "program";
    }
}

coded! {
    /// A part of a layer's tiles that can be what everything waits for.
    Part {
        /// Arrays settle.
        Arrays = 0, "arrays";
        /// Converters convert.
        Converters = 1, "converters";
        /// The adder tree adds tiles.
        Tree = 2, "tree";
        /// Look-up lanes, and the subtraction of a transposed read.
        Lanes = 3, "lanes";
        /// The error bus brings words.
        Bus = 4, "bus";
        /// Lanes multiply words with slopes.
        Multipliers = 5, "multipliers";
        /// Lanes add products to the sums of cells.
        Accumulators = 6, "accumulators";
        /// Rows are computed, pulsed, verified and turned around.
        Writers = 7, "writers";
    }
}

/// Cycles of a network.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Cycles {
    elapsed: [u64; Interval::COUNT],
    busy: Vec<[u64; During::COUNT]>,
    used: Vec<[u64; Part::COUNT]>,
}

impl Cycles {
    /// No cycle yet.
    #[must_use]
    pub fn new(layers: usize) -> Self {
        Self {
            elapsed: [0; Interval::COUNT],
            busy: vec![[0; During::COUNT]; layers],
            used: vec![[0; Part::COUNT]; layers],
        }
    }

    /// Time passes in an interval.
    pub const fn pass(&mut self, interval: Interval, cycles: u64) {
        self.elapsed[interval as usize] += cycles;
    }

    /// A layer is busy with an operation.
    pub fn occupy(&mut self, layer: usize, during: During, cycles: u64) {
        self.busy[layer][during as usize] += cycles;
    }

    /// A part of a layer works.
    pub fn engage(&mut self, layer: usize, part: Part, cycles: u64) {
        self.used[layer][part as usize] += cycles;
    }

    /// Cycles of an interval.
    #[must_use]
    pub const fn interval(&self, interval: Interval) -> u64 {
        self.elapsed[interval as usize]
    }

    /// Cycles from start to end.
    #[must_use]
    pub fn elapsed(&self) -> u64 {
        self.elapsed.iter().sum()
    }

    /// Cycles a layer was busy with an operation.
    #[must_use]
    pub fn busy(&self, layer: usize, during: During) -> u64 {
        self.busy[layer][during as usize]
    }

    /// Cycles a part of a layer worked.
    #[must_use]
    pub fn used(&self, layer: usize, part: Part) -> u64 {
        self.used[layer][part as usize]
    }

    /// Number of layers.
    #[must_use]
    pub const fn layers(&self) -> usize {
        self.busy.len()
    }

    /// All numbers with their places: view (0 elapsed, 1 busy, 2 used), layer, code of stage, operation or part.
    pub(super) fn entries(&self) -> impl Iterator<Item = ([usize; 3], u64)> + '_ {
        fn coded<const N: usize>(
            view: usize,
            layers: &[[u64; N]],
        ) -> impl Iterator<Item = ([usize; 3], u64)> + '_ {
            layers.iter().enumerate().flat_map(move |(layer, cycles)| {
                cycles.iter().enumerate().map(move |(code, &n)| ([view, layer, code], n))
            })
        }
        coded(0, std::slice::from_ref(&self.elapsed))
            .chain(coded(1, &self.busy))
            .chain(coded(2, &self.used))
    }

    /// The number at a place, if there is one.
    pub(super) fn slot(&mut self, [view, layer, code]: [usize; 3]) -> Option<&mut u64> {
        match (view, layer) {
            (0, 0) => self.elapsed.get_mut(code),
            (1, _) => self.busy.get_mut(layer)?.get_mut(code),
            (2, _) => self.used.get_mut(layer)?.get_mut(code),
            _ => None,
        }
    }

    /// What has passed since these cycles stood at `before`.
    ///
    /// # Panics
    /// When `before` has other layers or stood later.
    #[must_use]
    pub fn since(&self, before: &Self) -> Self {
        let mut passed = self.clone();
        for (place, then) in before.entries() {
            *passed.slot(place).expect("the same network") -= then;
        }
        passed
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_order_of_intervals_and_parts_is_their_number() {
        assert!(Interval::ALL.iter().enumerate().all(|(i, &s)| s as usize == i));
        assert!(Part::ALL.iter().enumerate().all(|(i, &p)| p as usize == i));
    }

    #[test]
    fn what_passed_is_the_difference() {
        let mut cycles = Cycles::new(2);
        cycles.pass(Interval::Error, 3);
        let before = cycles.clone();
        cycles.occupy(1, During::Update, 5);
        cycles.engage(0, Part::Writers, 7);
        cycles.pass(Interval::Error, 4);
        let passed = cycles.since(&before);
        assert_eq!((passed.elapsed(), passed.interval(Interval::Error)), (4, 4));
        assert_eq!((passed.busy(1, During::Update), passed.used(0, Part::Writers)), (5, 7));
        assert_eq!(passed.entries().filter(|(_, n)| *n > 0).count(), 3);
    }
}
