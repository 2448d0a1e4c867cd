//! From hardware and a layer's plan to the configuration of each of its tiles.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use std::ops::Range;

use super::super::super::tile::{More, Squares, TileAdc, TileConfig, TileUnits};
use super::super::balance;
use crate::chip::crossbar::kernel::MEAN_BITS;
use crate::chip::hardware::{Adc, FloorKind, Hardware, Subtract, Timing, WriteScheme};
use crate::chip::layer::{Layer, Optimiser, Pool, WordSource};
use crate::chip::population::Stream;
use crate::num::tables::Activation;

/// Configuration of one tile of a layer.
pub(super) fn config(
    hardware: &Hardware,
    timing: Timing,
    layer: &Layer,
    target: Stream,
    rows: &Range<usize>,
    columns: &Range<usize>,
) -> TileConfig {
    let small = |number: u64| usize::try_from(number).expect("configured sizes are small");
    let shifts = layer.adc_shifts.get(target.index()).cloned().unwrap_or_default();
    let first = shifts.first().copied().unwrap_or(0);
    let adc = match hardware.adc {
        Adc::Ideal => TileAdc::Ideal,
        Adc::Finite { bits, subtract: Subtract::Digital, .. } => {
            TileAdc::Digital { bits: bits.get(), shift: first }
        }
        Adc::Finite { bits, subtract: Subtract::Current, .. } => {
            TileAdc::Current { bits: bits.get(), shift: first }
        }
    };
    let taps = &layer.delivery.taps;
    let own = taps.words.chunks_exact(taps.per_unit).skip(columns.start).take(columns.len());
    let own = own.map(|words| words.iter().map(|&word| usize::from(word)).collect());
    TileConfig {
        rows: rows.len(),
        columns: columns.len(),
        settle: timing.settle,
        convert: timing.convert,
        share: small(timing.share),
        overlap: timing.overlapped,
        slices: hardware.slices(),
        dac_bits: hardware.drive.dac_bits,
        tree: 0,
        lanes: small(timing.lanes),
        hops: small(timing.hops),
        words: taps.width,
        tap_base: 0,
        pulse: timing.pulse,
        adc,
        lut_bits: hardware.digital.lut_bits.get(),
        lut_shift: layer.lut.shift,
        error_bits: hardware.digital.error_bits.get(),
        negate: target == Stream::N && !layer.delivery.alike,
        mantissa: 1,
        dither_bits: hardware.write.dither_bits.get(),
        increment_max: hardware.write.increment_max.get().into(),
        floor: hardware.cell.window.floor(),
        ceiling: hardware.cell.window.ceiling(),
        absorbing: hardware.cell.floor_kind == FloorKind::Absorbing,
        more: More {
            adc_shifts: shifts,
            slice_times: timing.slices.iter().flat_map(|own| own.iter()).collect(),
            tree_outside: true,
            units: match layer.spec.activation {
                Activation::Rms => TileUnits::Normalised,
                Activation::Accumulator => TileUnits::Kept,
                _ => TileUnits::Table,
            },
            balance: balance::registers(layer, target, columns.clone()),
            taps: own.collect(),
            tap_shift: taps.shift,
            beat: timing.beat,
            potentiation_only: false,
            shift_extra: layer.spec.wiring.shift_extra(),
            residual_bits: hardware.write.residual_bits.get(),
            verify: timing.verify,
            active_max: timing.active_max.map(small),
            pulse_code: timing.pulse_code,
            sign: layer.requests.optimiser.is_sign(),
            looks: match layer.requests.optimiser {
                Optimiser::Sign { dead_zone: true } => Some([true; 2]),
                Optimiser::Rms => Some([true, false]),
                _ => None,
            },
            beats: if let Optimiser::AdamFx { .. } = layer.requests.optimiser { 32 } else { 0 },
            momentum: match layer.requests.optimiser {
                Optimiser::Momentum { decay } => Some(decay),
                _ => None,
            },
            adam: match layer.requests.optimiser {
                Optimiser::AdamFx { first_decay, second_decay } => {
                    Some([first_decay, second_decay])
                }
                _ => None,
            },
            centred: layer.requests.window_log2.map(|_| MEAN_BITS),
            train_slots: match hardware.write.scheme {
                WriteScheme::Rounded => None,
                WriteScheme::Trains { slots_log2 } => Some(1 << slots_log2),
            },
            positions: layer.spec.positions(),
            phases: layer.spec.driven_by.phases(),
            squares: (layer.delivery.source == WordSource::Above).then(|| Squares {
                side: layer.spec.pool.side(),
                pixels: layer.spec.pooled(),
                greatest: matches!(layer.spec.pool, Pool::Max { .. })
                    .then_some(hardware.drive.bits),
            }),
            // where samples are loaded
            noise: None,
            conducting: hardware.conducting(),
        },
    }
}
