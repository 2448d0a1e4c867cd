//! Law 4: the engine and a network of tiles carry out the same stretches of operations.
//!
//! A stretch is what the chip does without a pause: its operations may overlap in time. Some have one operation, so
//! that every operation is also compared alone.

use dalean::chip::crossbar::kernel::Backend;
use dalean::chip::engine::tick::Network;
use dalean::chip::engine::{Engine, Operation, Phase, WritesDone};

use super::choose::{Choice, Net, Numbers};
use super::play::{self, Op};

pub(crate) fn law(net: &Net, choices: &[Choice], seed: u64) -> Result<(), String> {
    let ops = play::script_of(net, choices, false);
    let samples = ops.iter().map(|op| match op {
        Op::Drives(codes) => codes.len() / net.specs[0].sample_inputs(),
        _ => 0,
    });
    let slots = samples.max().unwrap_or(0).max(1);
    let mut engine = play::engine(net, Backend::best());
    let mut tick = Network::new(&net.hardware, net.seed, engine.layers(), slots);
    tick.set_learning(engine.mantissas(), net.potentiation_only);
    tick.set_error_unit(engine.error_unit());
    let mut numbers = Numbers(seed);
    let mut rest = &ops[..];
    while !rest.is_empty() {
        let longest = if numbers.within(0, 1) == 0 { 1 } else { 24 };
        let most = numbers.within(1, longest) as usize;
        let alone = |op: &Op| matches!(op, Op::Charge(_) | Op::Words(_) | Op::Written(_));
        let until = rest.iter().position(alone).unwrap_or(rest.len());
        let (stretch, after) = rest.split_at(most.min(until).min(rest.len()));
        if let Some(Op::Charge(phase)) = rest.first() {
            engine.set_phase(*phase);
            tick.set_phase(*phase);
            rest = &rest[1..];
            continue;
        }
        if let Some(Op::Words(errors)) = rest.first() {
            let (got, want) = (engine.output_words(errors), tick.output_words(errors));
            if got != want || engine.error_unit().means() != tick.means() {
                return Err(format!("{errors:?} became {got:?}, not {want:?}"));
            }
            rest = &rest[1..];
            continue;
        }
        if let Some(op @ Op::Written(samples)) = rest.first() {
            play::execute(&mut engine, op);
            match samples {
                None => tick.written(WritesDone::Batch),
                Some(samples) => (0..*samples).for_each(|_| tick.written(WritesDone::Sample)),
            }
            rest = &rest[1..];
            continue;
        }
        rest = after;
        let operations: Vec<Operation<'_>> = stretch.iter().filter_map(play::operation).collect();
        operations.iter().for_each(|operation| engine.execute(operation));
        engine.settle();
        tick.run(&operations);
        let last = |op: &&Op| matches!(op, Op::Forward(layer) if *layer + 1 == net.specs.len());
        let loaded = |op: &&Op| matches!(op, Op::Drives(_));
        let outputs = stretch.iter().rev().take_while(|op| !loaded(op)).any(|op| last(&op));
        compare(&engine, &tick, outputs).map_err(|what| format!("after {stretch:?}: {what}"))?;
    }
    Ok(())
}

fn compare(engine: &Engine, tick: &Network, outputs: bool) -> Result<(), String> {
    for phase in Phase::ALL {
        play::compare_ledgers(engine.ledger(phase), tick.ledger(phase))
            .map_err(|what| format!("{phase:?}: {what}"))?;
    }
    for (at, layer) in engine.layers().iter().enumerate() {
        for (array, cells) in layer.arrays.iter().enumerate() {
            let place = format!("layer {at} array {array}");
            if !cells.levels().eq(tick.levels(at, array)) {
                return Err(format!("{place}: levels differ"));
            }
            let gone = cells.pruned().map(|bits| bits.iter().by_vals().collect::<Vec<_>>());
            if gone.is_some_and(|gone| gone != tick.pruned(at, array)) {
                return Err(format!("{place}: pruned cells differ"));
            }
            let left = cells.residuals();
            let left = left.map(|left| left.into_iter().map(i64::from).collect::<Vec<_>>());
            if left.is_some_and(|left| left != tick.residuals(at, array)) {
                return Err(format!("{place}: remainders differ"));
            }
        }
        if layer.adc_shifts != tick.adc_shifts(at) {
            return Err(format!("layer {at}: converter shifts differ"));
        }
        if !engine.backward(at).is_empty() && engine.backward(at) != tick.backward(at) {
            return Err(format!("layer {at}: row sums differ"));
        }
    }
    if outputs {
        let spec = &engine.layers().last().unwrap().spec;
        for &stream in spec.wiring.targets() {
            let places = (0..engine.samples()).flat_map(|s| (0..spec.units).map(move |u| (s, u)));
            for (sample, unit) in places {
                if engine.output(stream, sample, unit) != tick.output(stream, sample, unit) {
                    return Err(format!("output {unit} of {stream:?}, sample {sample} differs"));
                }
            }
        }
    }
    Ok(())
}
