//! What cells that are not ideal answer: side by side as one after the other.

use super::*;
use crate::chip::crossbar::CellsMade;
use crate::chip::device::{CellSpread, Device, DeviceSpec, OwnCell, PulseNoise};
use crate::num::fixed::Millionths;
use crate::num::tables::{LinearSteps, Response, SoftBoundSteps, SpreadLaw};

/// Everything a half block of cells has.
#[derive(Debug, Clone, PartialEq)]
struct Block {
    low: Half<u8>,
    high: Half<u8>,
    residual: Half<u16>,
    pruned: Half<u8>,
    moved: u64,
}

fn device(spread: [bool; 3], noise: usize, states: u32, bits: u32) -> Device {
    let share = |on: bool, of: i64| Millionths(if on { of } else { 0 });
    let most = (1 << bits) - 1;
    let spec = DeviceSpec {
        response: match states % 2 {
            0 => Response::SoftBounds(SoftBoundSteps::default()),
            _ => Response::Linear(LinearSteps::default()),
        },
        states,
        asymmetry: Millionths(100_000),
        noise: [
            PulseNoise::Off,
            PulseNoise::OfStep(Millionths(1_300_000)),
            PulseNoise::OfWindow(Millionths(40_000)),
            PulseNoise::OfStep(Millionths(90_000_000)),
        ][noise],
        write_noise: Millionths(0),
        tries: DeviceSpec::TRIES,
        spread: CellSpread {
            step_law: if spread[0] { SpreadLaw::LogNormal } else { SpreadLaw::Normal },
            step: share(spread[0], 700_000),
            asymmetry: share(spread[1], 300_000),
            ceiling: share(spread[2], 200_000),
            floor: share(spread[2], 100_000),
        },
    };
    assert_eq!(spec.check(), Ok(()));
    Device::new(&spec, [most / 8, most - most / 8], most)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(96))]

    /// Faults this is made for: a cell that moves after its last pulse, one that is gone and moves, noise below 0 rounded
    /// toward it, a stuck level outside the window, a remainder at the wrong end, words of another cell.
    #[test]
    fn cells_answer_side_by_side_as_the_law(
        spread: [bool; 3], noise in 0usize..4, states in 1u32..600, wide: bool,
        absorbs: bool, residual_bits in 0u32..5, groups: u16, share in 0u8..8, most in 1i8..40, seed: u64,
    ) {
        let bits = if wide { 12 } else { 8 };
        let device = device(spread, noise, states, bits);
        let words: Vec<u32> = bytes(seed | 1, 16 * HALF_CELLS).as_chunks().0.iter()
            .map(|word| u32::from_le_bytes(*word)).collect();
        let own: Vec<OwnCell> =
            words.as_chunks().0.iter().map(|words| device.cell(*words)).collect();
        let factors = [0, 1].map(|side| half(&own.iter().map(|own| own.factors[side]).collect::<Vec<_>>()));
        let floor = half(&own.iter().map(|own| own.floor).collect::<Vec<_>>());
        let ceiling = half(&own.iter().map(|own| own.ceiling).collect::<Vec<_>>());
        let [steps, windows] = device.differs();
        let made = CellsMade {
            device: &device,
            factors: steps.then_some([&factors[0], &factors[1]]),
            windows: windows.then_some([&floor, &ceiling]),
        };
        let levels: Vec<u16> = bytes(seed | 3, 2 * HALF_CELLS).as_chunks().0.iter().zip(0..)
            .map(|(word, at)| {
                let cell = made.cell(at);
                // some lie where no pulse could bring them, as stuck cells may
                let word = u16::from_le_bytes(*word);
                if word % 16 == 0 { return word >> (16 - bits) }
                cell.floor + word % (cell.ceiling - cell.floor + 1)
            }).collect();
        let gone: Vec<u8> = levels.iter().zip(0..).map(|(&level, at)| {
            let cell = made.cell(at);
            let outside = !(cell.floor..=cell.ceiling).contains(&level);
            if outside || level % 7 == 0 { Cells::GONE } else { 0 }
        }).collect();
        let pulses: Vec<i8> = gates(seed | 1, HALF_CELLS).iter().zip(bytes((seed / 3) | 1, HALF_CELLS))
            .map(|(&pulses, word)| if word % 8 < share { pulses % most } else { 0 }).collect();
        let pulses = half(&pulses);
        let place = Place { seed, site: Site::WriteDither, layer: 1, pathway: 2, sub: 0, count: 7 };
        let start = Block {
            low: half(&levels.iter().map(|level| level.to_le_bytes()[0]).collect::<Vec<_>>()),
            high: half(&levels.iter().map(|level| level.to_le_bytes()[1]).collect::<Vec<_>>()),
            residual: half(&levels.iter().map(|level| level % (1 << residual_bits)).collect::<Vec<_>>()),
            pruned: half(&gone),
            moved: 0,
        };
        // levels outside are those of cells that are gone
        let pruned = absorbs || gone.iter().any(|&gone| gone != 0);
        let ends = Ends { floor: 0, ceiling: (1 << bits) - 1, residual_bits };
        let run = |kernel: &Kernel| {
            let mut block = start.clone();
            let mut words = Answers::new(place, 150);
            // twice: what is kept between half blocks does not show
            for at in [(16, 1), (32, 0)] {
                let cells = Cells {
                    low: &mut block.low,
                    high: wide.then_some(&mut block.high),
                    residual: (residual_bits > 0).then_some(&mut block.residual),
                    pruned: pruned.then_some(&mut block.pruned),
                    pulses: None,
                    answering: Some(Answering { made, words: &mut words, at }),
                    remembered: None,
                };
                block.moved += kernel.levels(cells, &pulses, ends, groups);
            }
            block
        };
        let want = run(&law());
        for (name, kernel) in others() {
            prop_assert!(run(&kernel) == want, "{name}");
        }
    }
}
