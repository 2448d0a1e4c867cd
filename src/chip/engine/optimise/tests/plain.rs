//! A write as its equations say it, cell by cell, in wide numbers.

use super::*;

/// A layer before a write, as plain numbers.
pub(super) struct Plain {
    /// By array, `[row][column]`.
    sums: Vec<Vec<i64>>,
    levels: Vec<Vec<u16>>,
    gone: Vec<Vec<bool>>,
    residuals: Vec<Vec<u16>>,
    /// By array: sums of the codes of rows, and of the gates of columns.
    codes: Vec<Vec<i64>>,
    totals: Vec<Vec<i64>>,
}

impl Plain {
    pub(super) fn of(engine: &Engine, layer: usize) -> Self {
        let this = &engine.layers[layer];
        let (rows, columns, samples) = (this.layout.rows, this.layout.columns, engine.samples);
        let mut plain = Self {
            sums: vec![],
            levels: vec![],
            gone: vec![],
            residuals: vec![],
            codes: vec![],
            totals: vec![],
        };
        for (array, pathway) in this.arrays.iter().zip(this.spec.wiring.pathways()) {
            let drives = engine.drives(layer, pathway.source);
            let phases = this.spec.driven_by.phases();
            let driven = |row: usize, sample: usize, phase: usize| {
                let at = row / 64 * phases * samples + phases * sample + phase;
                i64::from(drives[at * 64 + row % 64])
            };
            let drive = |row, sample| match phases {
                1 => driven(row, sample, 0),
                _ => driven(row, sample, 0) - driven(row, sample, 1),
            };
            let gates = &engine.registers[layer].gates[pathway.target.index()];
            let gate =
                |column, sample| i64::from(gates[packed_at(stride_of(samples), sample, column)]);
            let sum = |cell: usize| {
                let (row, column) = (cell / columns, cell % columns);
                (0..samples).map(|b| drive(row, b) * gate(column, b)).sum()
            };
            plain.sums.push((0..rows * columns).map(sum).collect());
            plain.levels.push(array.levels().collect());
            let gone = array.pruned().map(|bits| bits.iter().by_vals().collect());
            plain.gone.push(gone.unwrap_or_else(|| vec![false; rows * columns]));
            plain.residuals.push(array.residuals().unwrap_or_else(|| vec![0; rows * columns]));
            let over =
                |of: &dyn Fn(usize, usize) -> i64, line| (0..samples).map(|b| of(line, b)).sum();
            plain.codes.push((0..rows).map(|row| over(&drive, row)).collect());
            plain.totals.push((0..columns).map(|column| over(&gate, column)).collect());
        }
        plain
    }

    /// Executes the write by its equations and holds the engine against it.
    pub(super) fn check(
        self,
        engine: &mut Engine,
        case: &Case,
        layer: usize,
    ) -> Result<(), TestCaseError> {
        let before = engine.layers[layer].clone();
        let (rows, columns, samples) = (before.layout.rows, before.layout.columns, engine.samples);
        let wiring = before.spec.wiring;
        let window = case.windows[layer];
        let first = before.writes[0] == 0;
        let centred = |array: usize, cell: usize| {
            let sum = self.sums[array][cell];
            if window.is_none() {
                return (i128::from(sum), 1i128);
            }
            let (row, column) = (cell / columns, cell % columns);
            let set = before.spec.drives_of(wiring.pathways()[array].source);
            let n = samples as i64;
            let mean = match first {
                true => (32 * self.codes[array][row] + n).div_euclid(2 * n),
                false => before.requests.means(set)[row].into(),
            };
            (i128::from(16 * sum - mean * self.totals[array][column]), 16)
        };
        let cells: Vec<(usize, usize)> = (0..self.sums.len())
            .flat_map(|array| (0..rows * columns).map(move |cell| (array, cell)))
            .collect();
        let counts_in = |array: usize| match case.optimisers[layer] {
            Optimiser::Rms => wiring.pathways()[array].polarity == Polarity::Excites,
            _ => true,
        };
        let squared = cells.iter().filter(|(array, _)| counts_in(*array));
        let squares: i128 = squared.map(|&(a, c)| centred(a, c).0.pow(2)).sum();
        // what is asked of a cell, in units of a power of two of a pulse, and words that are kept
        let memory = &before.requests;
        let all_words = |requests: &Requests| -> Vec<[Vec<i64>; 2]> {
            let of = |array| [0, 1].map(|word| requests.words(array, word, before.layout));
            (0..self.sums.len()).map(of).collect()
        };
        let words = all_words(memory);
        let word_of = |array: usize, word: usize, cell: usize| {
            i128::from(words[array][word].get(cell).copied().unwrap_or(0))
        };
        let scales = Scales::new();
        let halves_up = |top: i128, bottom: i128| (2 * top + bottom).div_euclid(2 * bottom);
        let mut power = i128::from(memory.followed().power);
        if case.optimisers[layer] == Optimiser::Rms && squares > 0 {
            let now = (0..126).find(|place| squares >> place == 1).unwrap() * 256;
            power = if power < 0 { now } else { power + halves_up(now - power, 16) };
        }
        let least = match case.optimisers[layer] {
            Optimiser::Sign { dead_zone: true } => {
                let n = cells.len() as i128;
                let t = (0..).find(|t| squares < n * (1 << (2 * t + 1))).unwrap();
                1i128 << t
            }
            _ => 1,
        };
        let ledger = |engine: &Engine, event| engine.ledger(Phase::Training).total(event);
        let counted = [
            Event::Requested,
            Event::Bounded,
            Event::PulsesAttempted,
            Event::PulsesEffective,
            Event::SumSquares,
            Event::OptimiserSteps,
            Event::RowMeans,
        ];
        let counts = counted.map(|event| ledger(engine, event));
        engine.execute(&case.write(layer));
        let words_after = all_words(&engine.layers[layer].requests);
        let mut want = [0u64; 7];
        let shift = case.shift(layer) + wiring.shift_extra();
        for &(array, cell) in &cells {
            let pathway = wiring.pathways()[array];
            let (row, column) = (cell / columns, cell % columns);
            let place = Place {
                seed: case.seed,
                site: Site::WriteDither,
                layer: before.index,
                pathway: pathway.code,
                sub: 0,
                count: before.writes[array],
            };
            let sign = case.optimisers[layer].is_sign();
            let bits = if sign { 16 } else { case.dither.0.get() };
            let word = |place: Place, rows, row: usize, column| match bits {
                8 => {
                    let mut bytes = [0; 64];
                    place.bytes(rows, column, row / 64, &mut bytes);
                    u16::from(bytes[row % 64])
                }
                _ => place.half(rows, row, column),
            };
            let word = i128::from(match case.dither.1 {
                DitherPattern::PerCell => word(place, rows, row, column),
                DitherPattern::Separable => {
                    let across = word(Place { sub: 2, ..place }, columns, column, 0);
                    word(Place { sub: 1, ..place }, rows, row, 0) ^ across
                }
            });
            let (sum, unit) = centred(array, cell);
            let polarity = if pathway.polarity == Polarity::Inhibits { -1 } else { 1 };
            let mut kept = vec![];
            // request, mantissa and units in a pulse
            let scaled = |sum, unit: i128| (sum, i128::from(case.mantissa), unit << shift);
            let (request, mantissa, pulse) = match case.optimisers[layer] {
                Optimiser::Momentum { decay } => {
                    let was = word_of(array, 0, cell);
                    kept = vec![was - halves_up(was, 1 << decay) + sum];
                    scaled(kept[0], unit << decay)
                }
                Optimiser::AdamFx { first_decay: a, second_decay: b } => {
                    let s = halves_up(sum, unit);
                    let (m, v) = (word_of(array, 0, cell), word_of(array, 1, cell));
                    kept = match first {
                        true => vec![s << a, (s * s) << b],
                        false => vec![m + s - halves_up(m, 1 << a), v + s * s - (v >> b)],
                    };
                    let root = ((kept[1] >> b) as u128).isqrt() as i128;
                    let request = halves_up(kept[0] << 12, root.max(1) << a);
                    scaled(request.clamp(-32767, 32767), 1)
                }
                Optimiser::Rms => {
                    let x = ((power + 128) >> 1) + i128::from(case.shift(layer)) - 16_384;
                    let factor = scales.at(x as i64);
                    (sum, factor.mantissa.into(), 1 << (factor.shift + wiring.shift_extra()))
                }
                _ => scaled(sum, unit),
            };
            let request = polarity * request;
            let rest = (1 << case.residual) - 1;
            let mut left = i128::from(self.residuals[array][cell]);
            let (wanted, pulses) = if sign {
                let lucky = shift <= 16 && word < 1 << (16 - shift);
                let pulse = if lucky && request.abs() >= least { request.signum() } else { 0 };
                (pulse, pulse)
            } else if case.optimisers[layer] == Optimiser::Rms && squares == 0 {
                (0, 0)
            } else {
                // rounded to units of 2^-D of a step of the remainder, half up; then a word on top
                let q = halves_up((request * mantissa) << (bits + case.residual), pulse);
                let steps = (q + if bits == 0 { 0 } else { word }) >> bits;
                let total = steps + i128::from(self.residuals[array][cell]);
                let wanted = total >> case.residual;
                left = (total - (wanted.clamp(-7, 7) << case.residual)).clamp(0, rest);
                (wanted, wanted.clamp(-7, 7))
            };
            for (word, kept) in kept.into_iter().enumerate() {
                let now = &words_after[array][word];
                prop_assert_eq!(i128::from(now[cell]), kept, "word {} of {}", word, cell);
            }
            let level = i128::from(self.levels[array][cell]);
            let gone = self.gone[array][cell];
            let held = if gone { level } else { (level + pulses).clamp(3, 50) };
            let now = engine.layers[layer].arrays[array].level(row, column);
            prop_assert_eq!(i128::from(now), held, "{} {} {}", array, row, column);
            if case.residual > 0 {
                let after = engine.layers[layer].arrays[array].residuals().unwrap();
                let held = match level + pulses {
                    reached if reached < 3 => 0,
                    reached if reached > 50 => rest,
                    _ => left,
                };
                prop_assert_eq!(i128::from(after[cell]), held, "remainder of {}", cell);
            }
            want[0] += u64::from(wanted != 0);
            want[1] += u64::from(wanted != pulses);
            want[2] += pulses.unsigned_abs() as u64;
            want[3] += (held - level).unsigned_abs() as u64;
            let looks = case.optimisers[layer].looks_at_layer() && counts_in(array);
            want[4] += u64::from(looks);
            want[5] += u64::from(case.optimisers[layer] != Optimiser::Plain);
        }
        if window.is_some() {
            let looks =
                |array: &usize| case.optimisers[layer].looks_at_layer() && counts_in(*array);
            let passes = self.sums.len() + (0..self.sums.len()).filter(looks).count();
            want[6] = (rows * (passes + before.spec.drive_sets().len())) as u64;
        }
        for ((event, before), want) in counted.into_iter().zip(counts).zip(want) {
            prop_assert_eq!(ledger(engine, event) - before, want, "{}", event.name());
        }
        let now = &engine.layers[layer].requests;
        prop_assert_eq!(i128::from(now.followed().power), power);
        for (array, pathway) in wiring.pathways().iter().enumerate() {
            let set = before.spec.drives_of(pathway.source);
            let Some(window) = window else {
                prop_assert!(now.means(set).is_empty());
                continue;
            };
            for (row, &codes) in self.codes[array].iter().enumerate() {
                let (n, was) = (samples as i64, i64::from(before.requests.means(set)[row]));
                let want = match first {
                    true => (32 * codes + n).div_euclid(2 * n),
                    false => was + ((16 * codes - n * was + (1 << (window - 1))) >> window),
                };
                prop_assert_eq!(i64::from(now.means(set)[row]), want, "mean of {}", row);
            }
        }
        Ok(())
    }
}
