//! Cells of any kind.

use dalean::HardwareSpec;
use dalean::hardware::{
    Ageing, CellSpread, Chance, Conductance, DeviceSpec, DriftRates, Endurance, ExponentialSteps,
    FaultMap, Faults, Leakage, LinearSteps, ListedCell, MeasuredSteps, Millionths, NeurosimSteps,
    Programming, PulseNoise, ReadNoise, Reference, Response, SoftBoundSteps, SpreadLaw, StuckAt,
    TableSteps, Wires, Worn,
};

use super::Choices;

/// Most often below 4, or any number at all.
fn part(c: &mut Choices<'_>) -> Millionths {
    Millionths(c.near(-500_000, 4_000_000))
}

fn parts<const N: usize>(c: &mut Choices<'_>) -> [Millionths; N] {
    std::array::from_fn(|_| part(c))
}

fn response(c: &mut Choices<'_>) -> Response {
    match c.byte() % 6 {
        0 => Response::Linear(LinearSteps { up: parts(c), down: parts(c) }),
        1 => Response::SoftBounds(SoftBoundSteps { up: part(c), down: part(c) }),
        2 => Response::Exponential(ExponentialSteps {
            amplitude: parts(c),
            growth: parts(c),
            z: parts(c),
        }),
        3 => Response::Neurosim(NeurosimSteps { labels: parts(c) }),
        4 => {
            let row = |c: &mut Choices<'_>| (0..c.byte() % 5).map(|_| part(c)).collect();
            Response::Table(TableSteps { up: row(c), down: row(c) })
        }
        _ => {
            let points = (0..c.byte() % 5).map(|_| parts(c)).collect();
            Response::Measured(MeasuredSteps { points })
        }
    }
}

fn spread(c: &mut Choices<'_>) -> CellSpread {
    let small = |c: &mut Choices<'_>| match c.byte() % 3 {
        0 => Millionths(0),
        _ => Millionths(c.near(0, 1_000_000)),
    };
    CellSpread {
        step_law: c.of(&[SpreadLaw::Normal, SpreadLaw::LogNormal]),
        step: small(c),
        asymmetry: small(c),
        ceiling: small(c),
        floor: small(c),
    }
}

fn chance(c: &mut Choices<'_>) -> Chance {
    let some = c.near(0, 1 << 32).unsigned_abs() >> (c.byte() % 33);
    Chance::new(some).unwrap_or(Chance::NEVER)
}

/// Some cells, some of which no network has.
fn listed(c: &mut Choices<'_>) -> FaultMap {
    let cell = |c: &mut Choices<'_>| ListedCell {
        layer: u16::from(c.byte() % 3),
        pathway: c.byte() % 8,
        row: c.near(0, 70).unsigned_abs() as u32,
        column: c.near(0, 40).unsigned_abs() as u32,
        at: match c.byte() % 3 {
            0 => StuckAt::Floor,
            1 => StuckAt::Ceiling,
            _ => StuckAt::Level(c.near(0, 255) as u16),
        },
    };
    let cells = (0..c.byte() % 5).map(|_| cell(c)).collect();
    FaultMap::new(cells).unwrap_or_default()
}

/// Gives a chip cells that are not ideal.
pub(super) fn devices(c: &mut Choices<'_>, spec: &mut HardwareSpec) {
    spec.device = c.one_in(2).then(|| DeviceSpec {
        response: response(c),
        states: c.near(1, 1 << 16) as u32,
        asymmetry: part(c),
        noise: match c.byte() % 3 {
            0 => PulseNoise::Off,
            1 => PulseNoise::OfStep(part(c)),
            _ => PulseNoise::OfWindow(part(c)),
        },
        write_noise: part(c),
        tries: c.near(0, 17) as u32,
        spread: spread(c),
    });
    if c.one_in(2) {
        spec.faults = Faults { floor: chance(c), ceiling: chance(c), any: chance(c) };
    }
    spec.fault_map = if c.one_in(3) { listed(c) } else { FaultMap::default() };
    spec.conductance = c.one_in(3).then(|| Conductance {
        least: c.near(0, 10 * (4095 << 8)) as u32,
        reference: c.of(&[Reference::None, Reference::Column]),
    });
    spec.wires = c.one_in(3).then(|| {
        let segment = c.near(0, 1 << 48).unsigned_abs();
        Wires { segment: segment >> (c.byte() % 49) }
    });
    spec.read_noise = c.one_in(3).then(|| ReadNoise { sigma: c.near(0, 16 << 16) as u32 });
    let coefficient = |c: &mut Choices<'_>| c.near(-(4 << 24), 4 << 24);
    spec.programming =
        c.one_in(3).then(|| Programming { coefficients: std::array::from_fn(|_| coefficient(c)) });
    spec.endurance = c.one_in(3).then(|| Endurance {
        pulses: (c.near(0, 1 << 32).unsigned_abs() >> (c.byte() % 33)) as u32,
        spread: part(c),
        worn: c.of(&[Worn::Level, Worn::Floor, Worn::Ceiling]),
    });
    spec.ageing = c.one_in(4).then(|| Ageing {
        rates: match c.byte() % 2 {
            0 => DriftRates::Power([parts(c), parts(c)]),
            _ => DriftRates::Log(parts(c)),
        },
        since: c.near(-(100 << 16), 100 << 16),
        every: c.near(0, 1 << 20) as u32,
    });
    spec.leakage = c.one_in(3).then(|| Leakage {
        lost: (c.near(0, 1 << 32).unsigned_abs() >> (c.byte() % 33)) as u32,
        every: c.near(0, 1 << 20) as u32,
        rest: part(c),
        spread: part(c),
    });
}
