//! Trainings of a few updates: what must not change them, and what they must not do.

use std::sync::{Arc, Mutex};

use bitvec::prelude::*;

use super::*;
use crate::chip::crossbar::kernel::Backend;
use crate::chip::engine::{Phase, Recorded};
use crate::chip::hardware::Hardware;
use crate::chip::layer::{DrivenBy, Homeostasis, InitialLevels, LayerSpec, Optimiser, Pool};
use crate::chip::ledger::Event;
use crate::chip::population::Wiring;
use crate::chip::state::{Piece, Seen, State, Visitor};
use crate::learn::error::{Centre, OutputError};
use crate::learn::network::{NetworkPlace, NetworkSpec};
use crate::learn::route::Route;
use crate::learn::rule::{Control, Rule, UpdateMode};
use crate::num::fixed::{Batch, RateMantissa};
use crate::num::tables::{Activation, Decay, Positive};
use crate::task::environment::{self, EnvSource, EnvSpec, Replaying};

mod middles;
mod outside;

/// Everything that a state shows, as text; and, where it is told to, what a state is to be replaced by.
#[derive(Default)]
struct Book {
    lines: Vec<String>,
    numbers: Vec<Vec<i64>>,
    halves: Vec<Vec<u16>>,
    give: bool,
}

impl Visitor for Book {
    fn halves(
        &mut self,
        piece: &Piece<'_>,
        _: [usize; 2],
        values: &dyn Fn() -> Vec<u16>,
    ) -> Seen<Vec<u16>> {
        if self.give {
            return Ok(Some(self.halves.remove(0)));
        }
        self.lines.push(format!("{} {:?}", piece.name, values()));
        self.halves.push(values());
        Ok(None)
    }

    fn bits(
        &mut self,
        _: &Piece<'_>,
        _: [usize; 2],
        _: &dyn Fn() -> BitVec<u8, Lsb0>,
    ) -> Seen<BitVec<u8, Lsb0>> {
        unreachable!("these floors do not absorb")
    }

    fn numbers(&mut self, piece: &Piece<'_>, values: &[i64]) -> Seen<Vec<i64>> {
        if self.give {
            return Ok(Some(self.numbers.remove(0)));
        }
        self.lines.push(format!("{} {values:?}", piece.name));
        self.numbers.push(values.to_vec());
        Ok(None)
    }

    fn rows(
        &mut self,
        piece: &Piece<'_>,
        _: usize,
        values: &dyn Fn() -> Vec<i64>,
    ) -> Seen<Vec<i64>> {
        if self.give {
            return Ok(Some(self.numbers.remove(0)));
        }
        self.lines.push(format!("{} {:?}", piece.name, values()));
        self.numbers.push(values());
        Ok(None)
    }
}

fn book(trainer: &mut dyn State) -> Book {
    let mut book = Book::default();
    trainer.visit(&mut book).expect("nothing is replaced");
    book
}

fn network(inputs: usize, outputs: usize, rule: Rule) -> NetworkSpec {
    let wiring = if rule == Rule::Ed { Wiring::Dual } else { Wiring::Single };
    let gain = |last| InitialLevels::AbsGaussian { gain: if last { [1, 10] } else { [1, 1] } };
    let layer = |inputs, units, first: bool, last: bool| LayerSpec {
        inputs,
        units,
        wiring,
        driven_by: if first { DrivenBy::Shared } else { DrivenBy::Normalised },
        activation: if last { Activation::Accumulator } else { Activation::Rms },
        weight_max_log2: -1,
        initial: gain(last),
        constant_row: first,
        convolution: None,
        copies: 1,
        pool: Pool::None,
        homeostasis: Homeostasis::OFF,
    };
    NetworkSpec {
        layers: vec![layer(inputs, 10, true, false), layer(10, outputs, false, true)],
        rule,
        mode: UpdateMode::Accumulate,
        error: OutputError::OneVsAll,
        centre: Centre::None,
        route: match rule {
            Rule::Bp => None,
            Rule::Dfa => Some(Route::RandomDense { shift: None }),
            _ => Some(Route::Modulo { taps: 1, shift: None }),
        },
        batch: Batch::new(16).unwrap(),
        mantissas: vec![RateMantissa::new(1).unwrap(); 2],
        rates: vec![Positive::new(0.25).unwrap(); 2],
        decay: Decay::Linear,
        optimisers: vec![Optimiser::Sign { dead_zone: true }; 2],
        centred: vec![outputs > 1, false],
        control: Control::None,
        refresh: None,
    }
}

fn experiment(id: &str, rule: Rule, method: Option<Method>) -> PolicyExperiment {
    let spec = environment::make(id, 1, 1).unwrap().spec().clone();
    let ppo = Ppo {
        passes: 2,
        discount: Share::from_num(0.98),
        lambda: Share::from_num(0.9),
        clip: Share::from_num(0.2),
        entropy: Share::from_num(0.01),
        log_sigma_start: 0,
        log_sigma_rate: Share::from_num(0.01),
        noise_steps: 1,
    };
    let hardware = Hardware::reference().with(|chip| chip.tile.transposed_read = true).unwrap();
    let outputs = PolicyExperiment::outputs(&spec);
    let mut experiment = PolicyExperiment {
        seed: 3,
        hardware,
        environment: id.into(),
        environments: 3,
        input: InputCoding::Split,
        actor: network(1, outputs, rule),
        critic: network(1, 1, rule),
        method: method.unwrap_or(Method::Ppo(ppo)),
        steps: 3 * 20 * 2 * 3,
        horizon: 20,
        rollouts: 2,
        evaluation: Evaluating { episodes: 2, episodes_final: 3, deterministic: true },
    };
    let rows = experiment.rows(&spec);
    experiment.actor.layers[0].inputs = rows;
    experiment.critic.layers[0].inputs = rows;
    experiment
}

fn trainer(experiment: &PolicyExperiment) -> PolicyTrainer {
    PolicyTrainer::new(experiment.clone(), Backend::best(), EnvSource::Native).unwrap()
}

fn train(trainer: &mut PolicyTrainer, epochs: u32) -> Vec<PolicyEpoch> {
    let mut told = vec![];
    for _ in 0..epochs {
        told.push(trainer.learn(&mut |_| true).unwrap());
        let _ = trainer.evaluate(2).unwrap();
    }
    told
}

const IDS: [&str; 2] = ["CartPole-v1", "Pendulum-v1"];

#[test]
fn back_ends_and_threads_give_one_state() {
    for id in IDS {
        let experiment = experiment(id, Rule::Ed, None);
        let mut wanted = trainer(&experiment);
        let told = train(&mut wanted, 2);
        let wanted = book(&mut wanted).lines;
        for backend in [Backend::Scalar, Backend::best()] {
            for threads in [1, 2] {
                let mut other =
                    PolicyTrainer::new(experiment.clone(), backend, EnvSource::Native).unwrap();
                for driver in other.networks_mut() {
                    driver.engine_mut().set_threads(threads).unwrap();
                }
                assert_eq!(train(&mut other, 2), told);
                assert_eq!(book(&mut other).lines, wanted);
            }
        }
    }
}

#[test]
fn what_is_continued_is_what_never_stopped() {
    for id in IDS {
        for method in [None, Some(EVOLUTION)] {
            let experiment = experiment(id, Rule::Ed, method);
            let mut first = trainer(&experiment);
            let _ = train(&mut first, 1);
            let mut kept = book(&mut first);
            kept.give = true;
            let mut second = trainer(&experiment);
            second.visit(&mut kept).unwrap();
            assert_eq!((kept.numbers.len(), kept.halves.len()), (0, 0));
            assert_eq!(train(&mut second, 2), train(&mut first, 2));
            assert_eq!(book(&mut second).lines, book(&mut first).lines);
        }
    }
}

/// The same, its observations driven with their sign.
fn signed(mut experiment: PolicyExperiment) -> PolicyExperiment {
    experiment.input = InputCoding::Signed;
    let rows = experiment.rows(environment::make(&experiment.environment, 1, 1).unwrap().spec());
    for network in [&mut experiment.actor, &mut experiment.critic] {
        network.layers[0].driven_by = DrivenBy::Signed;
        network.layers[0].inputs = rows;
    }
    experiment
}

#[test]
fn numbers_with_a_sign_take_half_of_the_rows_and_twice_the_reads() {
    for (id, rule) in [(IDS[0], Rule::Ed), (IDS[1], Rule::Ed), (IDS[1], Rule::Bp)] {
        let split = experiment(id, rule, None);
        let experiment = signed(split.clone());
        assert_eq!(2 * experiment.actor.layers[0].inputs, split.actor.layers[0].inputs);
        let mut wanted = trainer(&experiment);
        let told = train(&mut wanted, 2);
        let mut other =
            PolicyTrainer::new(experiment.clone(), Backend::Scalar, EnvSource::Native).unwrap();
        assert_eq!(train(&mut other, 2), told);
        assert_eq!(book(&mut other).lines, book(&mut wanted).lines);

        let mut two = trainer(&split);
        let _ = train(&mut two, 2);
        let reads = |trainer: &mut PolicyTrainer| {
            let engine = trainer.networks_mut().remove(0).engine_mut();
            let (ledger, layer) = (engine.ledger(Phase::Training), &engine.layers()[0]);
            let codes = layer.spec.wiring.pathways().iter().map(|pathway| pathway.code);
            let of = |event| codes.clone().map(|code| ledger.of_pathway(0, code, event)).sum();
            (layer.layout.rows as u64, [Event::DacSlices, Event::Accumulates].map(of))
        };
        let ((rows, [driven, added]), (rows_split, [driven_split, added_split])): (
            (u64, [u64; 2]),
            (u64, [u64; 2]),
        ) = (reads(&mut wanted), reads(&mut two));
        assert_eq!(driven * rows_split, 2 * driven_split * rows);
        assert_eq!(added * rows_split, 2 * added_split * rows);
    }
}

#[test]
fn a_sign_stands_where_numbers_have_one_and_nowhere_else() {
    let refused = |experiment: &PolicyExperiment, words: &str| {
        let source = EnvSource::Native;
        let error = PolicyTrainer::new(experiment.clone(), Backend::best(), source).err();
        let error = error.expect("it is refused").to_string();
        assert!(error.contains(words), "{error}");
    };
    let good = signed(experiment(IDS[1], Rule::Ed, None));
    let mut unsigned = good.clone();
    unsigned.actor.layers[0].driven_by = DrivenBy::Shared;
    refused(&unsigned, "`network.input` gives Pendulum-v1 no sign");
    let mut split = experiment(IDS[1], Rule::Ed, None);
    split.critic.layers[0].driven_by = DrivenBy::Signed;
    refused(&split, "`network.input` gives Pendulum-v1 a sign");
    let mut large = good.clone();
    for network in [&mut large.actor, &mut large.critic] {
        network.batch = Batch::new(2049).unwrap();
    }
    refused(&large, "use a batch of 2048 or fewer");
    let mut above = good.clone();
    above.actor.layers[1].driven_by = DrivenBy::Signed;
    refused(&above, "gives layer");
    let gridworld = environment::make("Foray-v0", 1, 1).unwrap().spec().clone();
    let _ = trainer(&good.facing(&gridworld));
}

#[test]
fn a_record_gives_the_same_state_without_the_environment() {
    for (id, method) in [(IDS[0], None), (IDS[1], None), (IDS[0], Some(EVOLUTION))] {
        let experiment = experiment(id, Rule::Ed, method);
        let source = EnvSource::Recorded(Arc::default());
        let mut recorded = PolicyTrainer::new(experiment.clone(), Backend::best(), source).unwrap();
        let mut records = vec![recorded.take_record().unwrap()];
        let mut books = vec![book(&mut recorded).lines];
        for _ in 0..3 {
            let _ = train(&mut recorded, 1);
            records.push(recorded.take_record().unwrap());
            books.push(book(&mut recorded).lines);
        }
        assert!(recorded.learn(&mut |_| true).is_err(), "no epoch is left");

        let replaying = Arc::new(Mutex::new(Replaying::default()));
        let begin = |record: &environment::Record| {
            replaying.lock().unwrap().begin(record.clone());
        };
        begin(&records[0]);
        let source = EnvSource::Replayed(Arc::clone(&replaying));
        let mut replayed = PolicyTrainer::new(experiment, Backend::best(), source).unwrap();
        for (at, (record, wanted)) in records.iter().zip(&books).enumerate() {
            if at > 0 {
                begin(record);
                let _ = train(&mut replayed, 1);
            }
            assert_eq!(book(&mut replayed).lines, *wanted, "{id}, epoch {at}");
        }
        // what no record has is an error and no made-up step
        begin(&environment::Record::default());
        let mut again = trainer_of(&replayed, &replaying);
        assert!(again.is_err(), "{:?}", again.as_mut().map(|t| t.epoch()));
    }
}

fn trainer_of(
    like: &PolicyTrainer,
    replaying: &Arc<Mutex<Replaying>>,
) -> Result<PolicyTrainer, PolicyError> {
    let source = EnvSource::Replayed(Arc::clone(replaying));
    PolicyTrainer::new(like.experiment().clone(), Backend::best(), source)
}

const EVOLUTION: Method = Method::Evolution(Evolution { pairs: 2, step: 4, shift: 3 });

#[test]
fn evolution_moves_cells_by_loading_them_alone() {
    // whose candidates differ from the first step on
    let experiment = experiment(IDS[1], Rule::Ed, Some(EVOLUTION));
    let mut evolved = trainer(&experiment);
    let cells: u64 = experiment.actor.layers.iter().map(cells_of).sum();
    let before = book(&mut evolved).halves;
    let told = train(&mut evolved, 1);
    let ledger = evolved.networks()[0].engine().ledger(Phase::Training);
    // initial levels; then in each of two generations four candidates and what is kept
    assert_eq!(ledger.total(Event::CellLoads), cells * (1 + 2 * (4 + 1)));
    assert_eq!([Event::BusWords, Event::Accumulates].map(|event| ledger.total(event)), [0, 0]);
    assert_eq!(told[0].returns.count, 2 * 4 * 3);
    assert!(told[0].steps > 0 && book(&mut evolved).halves != before);
}

fn cells_of(layer: &LayerSpec) -> u64 {
    let rows = layer.inputs + usize::from(layer.constant_row);
    (rows * layer.units * layer.wiring.pathways().len()) as u64
}

#[test]
fn every_rule_learns_something_on_the_same_crossbars() {
    for rule in [Rule::Ed, Rule::Dfa, Rule::Bp] {
        let mut other = trainer(&experiment(IDS[0], rule, None));
        let before = book(&mut other).halves;
        let _ = train(&mut other, 1);
        assert_ne!(book(&mut other).halves, before, "{rule:?}");
    }
}

#[test]
fn an_epoch_that_is_stopped_says_so() {
    let mut stopped = trainer(&experiment(IDS[0], Rule::Ed, None));
    let mut asked = 0;
    let end = stopped.learn(&mut |_| {
        asked += 1;
        asked < 3
    });
    assert_eq!((end, asked), (Err(PolicyError::Stopped), 3));
    assert_eq!(stopped.networks()[0].updates(), 3);
}

#[test]
fn outcomes_that_do_not_fit_are_errors_and_move_nothing() {
    use crate::task::environment::{Observations, Outcomes, Real};
    let spec = environment::make(IDS[0], 1, 1).unwrap().spec().clone();
    let good = Outcomes {
        reached: Observations { values: vec![Real::ZERO; 8], ..Observations::default() },
        next: Observations { values: vec![Real::ZERO; 8], ..Observations::default() },
        rewards: vec![Real::ONE; 2],
        terminated: vec![false; 2],
        truncated: vec![false; 2],
    };
    let check = |change: &dyn Fn(&mut Outcomes), spec: &EnvSpec| {
        let mut outcomes = good.clone();
        change(&mut outcomes);
        outcomes.check(spec, 2).map_err(|error| error.to_string())
    };
    assert_eq!(check(&|_| {}, &spec), Ok(()));
    type Change<'a> = &'a dyn Fn(&mut Outcomes);
    let wrong: [(Change<'_>, &str); 4] = [
        (&|o| o.rewards.push(Real::ONE), "a list of their outcomes has 3"),
        (&|o| o.next.values.truncate(7), "shows more or less than it has"),
        (&|o| o.next.ends.push(0), "shows more or less than it has"),
        (&|o| (o.terminated[1], o.truncated[1]) = (true, true), "is terminated and truncated"),
    ];
    for (change, found) in wrong {
        let error = check(change, &spec).unwrap_err();
        assert!(error.contains(found), "{error}");
    }
}

/// (operation, field) pairs of what was recorded.
fn operations(tape: &[Recorded]) -> Vec<&'static str> {
    tape.iter().filter_map(Recorded::operation).map(|operation| operation.name()).collect()
}

#[test]
fn a_policy_and_a_classifier_learn_by_lists_of_the_same_five_operations() {
    let mut policy = trainer(&experiment(IDS[0], Rule::Ed, None));
    for driver in policy.networks_mut() {
        let _ = driver.engine_mut().record(true);
    }
    let _ = policy.learn(&mut |_| true).unwrap();
    let of_policy: Vec<_> = policy
        .networks_mut()
        .into_iter()
        .map(|driver| operations(&driver.engine_mut().record(false)))
        .collect();

    let layer = |inputs, units, wiring, driven_by| LayerSpec {
        inputs,
        units,
        wiring,
        driven_by,
        activation: Activation::Sigmoid(Positive::new(4.0).unwrap()),
        weight_max_log2: 2,
        initial: InitialLevels::Uniform { gain_64ths: [96, 32] },
        constant_row: false,
        convolution: None,
        copies: 1,
        pool: Pool::None,
        homeostasis: Homeostasis::OFF,
    };
    let network = NetworkSpec {
        layers: vec![
            layer(4, 10, Wiring::Dual, DrivenBy::Shared),
            layer(10, 2, Wiring::DualReadout, DrivenBy::Streams),
        ],
        error: OutputError::OneVsAll,
        centre: Centre::Batch,
        optimisers: vec![Optimiser::Plain; 2],
        centred: vec![false; 2],
        ..network(4, 2, Rule::Ed)
    };
    let place = NetworkPlace { seed: 1, first_layer: 0, updates: 1 };
    let mut classifier = network.build(&Hardware::reference(), Backend::best(), place).unwrap();
    let _ = classifier.engine_mut().record(true);
    classifier.learn(&[9; 4 * 16], |_, _, errors| errors.extend([100, -100].repeat(16)));
    let of_classifier = operations(&classifier.engine_mut().record(false));

    let wanted = [
        "LOADX(row)",
        "FWD(rows)",
        "FWD(rows)",
        "ERR(words)",
        "ERR(words)",
        "UPD(add)",
        "UPD(add)",
        "UPD(write)",
        "UPD(write)",
    ];
    assert_eq!(of_classifier, wanted);
    assert_eq!(of_policy, [wanted; 2], "actor and critic");
}
