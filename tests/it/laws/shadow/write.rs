//! The shadow's errors, gates, sums and writes.

use std::ops::Range;

use dalean::chip::hardware::{DitherBits, DitherPattern, FloorKind};
use dalean::chip::ledger::{During, Event};
use dalean::chip::population::{Polarity, Stream};
use dalean::num::draw::{Place, Site};

use super::{Fault, Shadow, Table, rsh, sat, sign, table, tile_sizes};

impl Shadow {
    /// Delivers words; the units of some samples latch their taps and form gates.
    pub(crate) fn error(&mut self, layer: usize, samples: Range<usize>, words: &[i16]) {
        let bits = self.net.hardware.digital.error_bits.get();
        let words = &self.layer_words(layer, &samples, words)[..];
        let taps = self.layers[layer].delivery.taps.clone();
        let wiring = self.layers[layer].spec.wiring;
        let units = self.layers[layer].spec.units;
        for &target in wiring.targets() {
            let gates = &mut self.layers[layer].gates[target.index()];
            gates.resize(self.samples, vec![]);
        }
        let (mut saturated_words, mut saturated_gates) = (0, [0; 2]);
        for (at, sample) in samples.clone().enumerate() {
            let words = &words[at * taps.width..][..taps.width];
            for unit in 0..units {
                let tapped = (0..taps.per_unit).map(|tap| {
                    let next = usize::from(self.is(Fault::TapOffByOne));
                    let word = usize::from(taps.words[unit * taps.per_unit + tap]) + next;
                    i64::from(words[word % taps.width])
                });
                let mut err: i64 = tapped.sum();
                if taps.per_unit > 1 {
                    let (bounded, saturated) = sat(rsh(err, taps.shift), bits);
                    saturated_words += u64::from(saturated);
                    let unbounded = self.is(Fault::TapSumUnbounded);
                    err = if unbounded { rsh(err, taps.shift) } else { bounded };
                }
                for &target in wiring.targets() {
                    let alike =
                        self.layers[layer].delivery.alike != self.is(Fault::StreamNotNegated);
                    let negate = target == Stream::N && !alike;
                    let own = if negate { -err } else { err };
                    let from =
                        if self.is(Fault::DerivativeOfOtherStream) { 0 } else { target.index() };
                    let product = own * self.layers[layer].derivative[from][sample][unit];
                    let exact = if self.is(Fault::GateTruncates) {
                        product >> bits
                    } else {
                        rsh(product, bits)
                    };
                    let (u, saturated) = sat(exact, 8);
                    saturated_gates[target.index()] += u64::from(saturated);
                    let gates = &mut self.layers[layer].gates[target.index()][sample];
                    gates.resize(units, 0);
                    gates[unit] = u;
                }
            }
        }
        let count = samples.len() as u64;
        for &target in wiring.targets() {
            let (code, saturated) =
                (self.unit_code(layer, target), saturated_gates[target.index()]);
            self.count(layer, code, During::Error, Event::BusWords, taps.width as u64 * count);
            self.count(layer, code, During::Error, Event::Multiplies, units as u64 * count);
            self.count(layer, code, During::Error, Event::SramBits, 8 * units as u64 * count);
            self.count(layer, code, During::Error, Event::SaturatedGates, saturated);
        }
        let code = self.unit_code(layer, Stream::P);
        self.count(layer, code, During::Error, Event::SaturatedErrors, saturated_words);
    }

    /// Reads a layer from its columns: positive gates, then negative ones.
    pub(crate) fn forward_columns(&mut self, layer: usize) {
        self.look_through(layer);
        let this = &self.layers[layer];
        let banks = this.spec.wiring.banks(Stream::P);
        let (rows, columns) = (this.rows, this.spec.units);
        let mut backward = vec![];
        for (sample, gates) in this.gates[Stream::P.index()].iter().enumerate() {
            for row in 0..this.spec.inputs {
                let phase = |positive: bool| -> i64 {
                    let driven = gates.iter().enumerate().filter(|(_, u)| (**u > 0) == positive);
                    let levels = |at: usize, c: usize| this.arrays[at].level[row][c];
                    driven.map(|(c, u)| u.abs() * (levels(banks[0], c) - levels(banks[1], c))).sum()
                };
                let negative = if self.is(Fault::BackwardPhaseAdds) { 1 } else { -1 };
                let off = self.backward_noise(layer, banks, sample, row);
                if self.conducts() {
                    backward.push(self.backward_current(layer, banks, gates, row) + off);
                    continue;
                }
                backward.push(phase(true) + negative * phase(false) + off);
            }
        }
        self.layers[layer].backward = backward;
        let hw = self.net.hardware.clone();
        let slices = u64::from(hw.drive.bits.get().div_ceil(hw.drive.dac_bits));
        let times = 2 * slices * self.samples as u64;
        let free = self.is(Fault::GateMemoryFree);
        let handed_down = (16 * self.samples * self.layers[layer].spec.inputs) as u64;
        let code = self.unit_code(layer, Stream::P);
        self.count(layer, code, During::ForwardColumns, Event::SramBits, handed_down);
        for &at in banks {
            let code = self.code(layer, at);
            for (high, wide) in tile_sizes(rows, columns, hw.tile.rows, hw.tile.columns) {
                for (event, count) in [
                    (Event::DacSlices, wide),
                    (Event::SramBits, if free { 0 } else { wide * u64::from(hw.drive.dac_bits) }),
                    (Event::CellReads, high * wide),
                    (Event::Holds, high),
                    (Event::Conversions, high),
                    (Event::ShiftAdds, high),
                ] {
                    self.count(layer, code, During::ForwardColumns, event, times * count);
                }
            }
        }
    }

    /// `UPD(add)`: adds drive x gate to every cell's accumulator.
    pub(crate) fn add(&mut self, layer: usize, samples: Range<usize>) {
        let wiring = self.layers[layer].spec.wiring;
        let alike = self.is(Fault::BelowMovesAlike);
        let only = self.net.potentiation_only && !self.is(Fault::DepressesAll);
        for (at, pathway) in wiring.pathways().iter().enumerate() {
            let wrong = self.is(Fault::WrongSource) && pathway.code == 1;
            let source = if wrong { Stream::P } else { pathway.source };
            let this = &mut self.layers[layer];
            for sample in samples.clone() {
                for (row, &x) in this.drives[source.index()][sample].iter().enumerate() {
                    let x = if alike { x.abs() } else { x };
                    let gates = &this.gates[pathway.target.index()][sample];
                    for (sum, &u) in this.arrays[at].sums[row].iter_mut().zip(gates) {
                        let u = match pathway.polarity {
                            Polarity::Excites if only => u.max(0),
                            Polarity::Inhibits if only => u.min(0),
                            _ => u,
                        };
                        *sum += x * u;
                    }
                }
            }
            let cells = (this.rows * this.spec.units * samples.len()) as u64;
            let products = cells * self.phases(layer);
            self.count(layer, pathway.code, During::Update, Event::Accumulates, products);
        }
    }

    /// Bits that sums and remainders move in memory, `times` what an array holds.
    pub(crate) fn move_bits(&mut self, layer: usize, sums: u64, remainders: u64) {
        let bits = u64::from(self.net.hardware.write.residual_bits.get());
        let this = &self.layers[layer];
        let cells = (this.rows * this.spec.units) as u64;
        let count = cells * (64 * sums + 2 * bits * remainders);
        for pathway in this.spec.wiring.pathways() {
            self.count(layer, pathway.code, During::Update, Event::SramBits, count);
        }
    }

    /// `UPD(write)`: rounds, bounds, programs and clears.
    pub(crate) fn program(&mut self, layer: usize, shift: u32, nothing: bool) {
        for at in 0..self.layers[layer].arrays.len() {
            self.program_array(layer, at, shift);
            if !(nothing && self.is(Fault::EmptyWriteNotCounted)) {
                self.layers[layer].arrays[at].writes += 1;
            }
        }
    }

    fn program_array(&mut self, layer: usize, at: usize, shift: u32) {
        let hw = self.net.hardware.clone();
        let wiring = self.layers[layer].spec.wiring;
        let pathway = wiring.pathways()[at];
        let (rows, columns) = (self.layers[layer].rows, self.layers[layer].spec.units);
        let sums =
            std::mem::replace(&mut self.layers[layer].arrays[at].sums, table(rows, columns, 0));
        let pair = wiring.pathways().iter().any(|pathway| pathway.code >= 4);
        let shift = shift + u32::from(pair && !self.is(Fault::PairShiftMissing));
        let fraction = hw.write.residual_bits.get();
        let k = i64::from(shift) - i64::from(fraction);
        let words = self.dither(layer, at);
        let (floor, ceiling) =
            (i64::from(hw.cell.window.floor()), i64::from(hw.cell.window.ceiling()));
        let floor_bound = floor - i64::from(self.is(Fault::FloorOffByOne));
        let bound = i64::from(hw.write.increment_max.get());
        let (mut requested, mut bounded, mut attempted, mut effective) = (0, 0, 0, 0);
        for (row, column) in (0..rows).flat_map(|row| (0..columns).map(move |c| (row, c))) {
            let (mantissa, word) = (i64::from(self.net.mantissa_of(layer)), words[row][column]);
            let (inside, outside) =
                if self.is(Fault::MantissaAfterRounding) { (1, mantissa) } else { (mantissa, 1) };
            let rounded = if self.is(Fault::SignAfterRounding) {
                sign(pathway.polarity) * self.round(sums[row][column] * inside, k, word)
            } else {
                self.round(sign(pathway.polarity) * sums[row][column] * inside, k, word)
            };
            let array = &self.layers[layer].arrays[at];
            let gone = array.pruned[row][column] && !self.is(Fault::PrunedCellLives);
            let total = array.residual[row][column] + rounded * outside;
            let wanted = total.div_euclid(1 << fraction);
            let pulses =
                if self.is(Fault::MissingBound) { wanted } else { wanted.clamp(-bound, bound) };
            let before = array.level[row][column];
            let mut after = (before + pulses).clamp(floor_bound, ceiling);
            if self.is(Fault::WrapAtCeiling) && before + pulses > ceiling {
                after = floor;
            }
            if self.is(Fault::CeilingOffByOne) {
                after = (before + pulses).clamp(floor_bound, ceiling + 1);
            }
            let stuck = array.stuck[row][column].is_some() && !self.is(Fault::StuckCellMoves);
            if gone || stuck {
                after = before;
            }
            let pruned = self.is(Fault::StuckCellIsPruned);
            let prunes = array.stuck[row][column].is_none() || pruned;
            let left = total - (pulses << fraction);
            let reached = before + pulses;
            let held = match reached {
                _ if self.is(Fault::ResidualWindsUp) => left.clamp(0, (1 << fraction) - 1),
                _ if reached < floor => 0,
                _ if reached > ceiling => (1 << fraction) - 1,
                _ => left.clamp(0, (1 << fraction) - 1),
            };
            let kept = if self.is(Fault::ResidualNotKept) { 0 } else { held };
            let pulsed = pulses != 0 || self.is(Fault::PrunedWithoutPulse);
            let array = &mut self.layers[layer].arrays[at];
            array.level[row][column] = after;
            array.residual[row][column] = kept;
            array.pruned[row][column] |=
                prunes && hw.cell.floor_kind == FloorKind::Absorbing && pulsed && after == floor;
            requested += u64::from(wanted != 0);
            bounded += u64::from(wanted != pulses);
            attempted += pulses.unsigned_abs();
            let clamped = self.is(Fault::ClampedPulseCounts);
            effective += (if clamped { pulses } else { after - before }).unsigned_abs();
        }
        for (event, count) in [
            (Event::DeltaComputations, (rows * columns) as u64),
            (Event::Requested, requested),
            (Event::Bounded, bounded),
            (Event::PulsesAttempted, attempted),
            (Event::PulsesEffective, effective),
        ] {
            self.count(layer, pathway.code, During::Update, event, count);
        }
    }

    /// `SR(sum, k)`: `q = rsh(sum, k - D)` or `sum << (D - k)`, then `(q + r) >> D`.
    fn round(&self, sum: i64, k: i64, word: i64) -> i64 {
        let bits = match self.net.hardware.write.dither_bits {
            DitherBits::Zero => 0,
            DitherBits::Eight => 8,
            DitherBits::Sixteen => 16,
        };
        let q = if k >= bits { rsh(sum, (k - bits) as u32) } else { sum * (1 << (bits - k)) };
        (q + word).div_euclid(1 << bits)
    }

    /// The word of every cell of an array for its next write.
    fn dither(&self, layer: usize, at: usize) -> Table {
        let hw = self.net.hardware.clone();
        let (rows, columns) = (self.layers[layer].rows, self.layers[layer].spec.units);
        let code = self.code(layer, if self.is(Fault::DitherOfOnePathway) { 0 } else { at });
        let writes = self.layers[layer].arrays[at].writes;
        let place = Place {
            seed: self.net.seed,
            site: Site::WriteDither,
            layer: u16::try_from(layer).unwrap(),
            pathway: code,
            sub: 0,
            count: writes - u64::from(self.is(Fault::StaleWriteCount) && writes > 0),
        };
        let numbered = if self.is(Fault::DitherOfPaddedArray) { rows + 64 } else { rows };
        let next = usize::from(self.is(Fault::DitherOfNeighbour));
        // the words of a column, of an array numbered as if it had `numbered` rows
        let column_words = |place: Place, numbered: usize, column: usize, len: usize| -> Vec<i64> {
            let words = (0..len + next).step_by(32).flat_map(|row| match hw.write.dither_bits {
                DitherBits::Zero => [0; 32],
                DitherBits::Eight => {
                    let mut words = [0; 64];
                    place.bytes(numbered, column, row / 64, &mut words);
                    std::array::from_fn(|i| i64::from(words[row % 64 + i]))
                }
                DitherBits::Sixteen => place.halves(numbered, column, row / 32).map(i64::from),
            });
            words.skip(next).take(len).collect()
        };
        match hw.write.dither_pattern {
            DitherPattern::PerCell => {
                let all: Table =
                    (0..columns).map(|c| column_words(place, numbered, c, rows)).collect();
                (0..rows).map(|row| all.iter().map(|column| column[row]).collect()).collect()
            }
            DitherPattern::Separable => {
                let [down, across] = if self.is(Fault::SeparableSwapped) { [2, 1] } else { [1, 2] };
                let of = |sub: u32, len: usize| column_words(Place { sub, ..place }, len, 0, len);
                let (down, across) = (of(down, rows), of(across, columns));
                down.iter().map(|d| across.iter().map(|a| d ^ a).collect()).collect()
            }
        }
    }
}
