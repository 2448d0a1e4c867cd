//! A pulse against its equations in whole numbers.

use proptest::prelude::*;

use super::*;
use crate::chip::device::CellSpread;
use crate::num::tables::{LinearSteps, Response, SoftBoundSteps};

fn chip(bits: u32, ends: [u16; 2], device: &DeviceSpec) -> Device {
    assert_eq!(device.check(), Ok(()));
    Device::new(device, ends, (1 << bits) - 1)
}

/// `floor(v / 2^by + 1/2)`.
fn round(v: i128, by: u32) -> i128 {
    (2 * v + (1 << by)).div_euclid(2 << by)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    /// Faults this is made for: a place rounded down, a deviation of the step before its factor, a sign after the
    /// rounding, factors of up and down exchanged.
    #[test]
    fn a_pulse_is_its_equations(
        floor in 0u16..40, span in 2u16..200, states in 1u32..300,
        words: [u32; 4], at: u16, rises: bool, rounding: u8, noise: u16,
        [step, asymmetry, own]: [u8; 3], kind in 0usize..3, soft: bool,
    ) {
        let share = |of: u8| Millionths(i64::from(of % 4) * 150_000);
        let spread = CellSpread {
            step: share(step), asymmetry: share(asymmetry), ceiling: share(own), floor: share(own / 4),
            step_law: if step & 64 > 0 { SpreadLaw::LogNormal } else { SpreadLaw::Normal },
        };
        let noises = [PulseNoise::Off, PulseNoise::OfStep(Millionths(1_700_000)), PulseNoise::OfWindow(Millionths(30_000))];
        let response = match soft {
            true => Response::SoftBounds(SoftBoundSteps::default()),
            false => Response::Linear(LinearSteps::default()),
        };
        let spec = DeviceSpec { response, noise: noises[kind], spread, ..DeviceSpec::even(states) };
        let device = chip(8, [floor, floor + span], &spec);
        let cell = device.cell(words);
        prop_assert!(cell.floor < cell.ceiling && cell.ceiling <= 255);
        if !spread.moves_window() {
            prop_assert_eq!([cell.floor, cell.ceiling], [floor, floor + span]);
        }
        let width = cell.ceiling - cell.floor;
        let level = cell.floor + at % (width + 1);

        let table = spec.response.table(span, states, Millionths(0));
        let (span, width) = (i128::from(span), i128::from(width));
        let reach = (2 * (span << 16) + width) / (2 * width);
        let place = round(i128::from(level - cell.floor) * reach, 16);
        prop_assert!((0..=span).contains(&place));
        let side = usize::from(!rises);
        let mean = round(i128::from(table[side][place as usize]) * i128::from(cell.factors[side]), 24);
        let half = half_gaussian()[usize::from(noise >> 4)];
        let gaussian = if noise & 1 == 1 { -i128::from(half) } else { half.into() };
        let deviation = match kind {
            0 => 0,
            // 1.7 and 0.03 windows, as the chip has them: 16 and 8 fractional bits
            1 => round(mean * ((2 * 17 * (1 << 16) + 10) / 20), 16),
            _ => (2 * 3 * span * 256 + 100) / 200,
        };
        let step = mean + round(gaussian * deviation, 12);
        let want = if rises { step + i128::from(rounding) } else { i128::from(rounding) - step };
        let got = device.moves(&cell, level, rises, PulseWords { rounding, noise });
        prop_assert_eq!(i128::from(got), want.div_euclid(256));
    }
}
