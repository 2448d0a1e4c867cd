//! Policies that are driven from outside: the same bits as from inside, and nothing bad that stays.

use super::*;
use crate::task::environment::{Observations, Outcomes, Real, VecEnv};

fn learner(experiment: &PolicyExperiment) -> PolicyLearner {
    let spec = environment::make(&experiment.environment, 1, 1).unwrap().spec().clone();
    PolicyLearner::new(experiment.clone(), spec, Backend::best()).unwrap()
}

fn environments(experiment: &PolicyExperiment) -> Box<dyn VecEnv> {
    let count = experiment.environments as usize;
    environment::make(&experiment.environment, experiment.seed, count).unwrap()
}

/// Takes turns until an epoch is over. `meddle` is asked before every step with the outcomes that are about to be taken.
fn epoch(
    learner: &mut PolicyLearner,
    environments: &mut dyn VecEnv,
    meddle: &mut dyn FnMut(&mut PolicyLearner, &Outcomes),
) -> PolicyEpoch {
    let (mut shown, mut outcomes) = (Observations::default(), Outcomes::default());
    loop {
        match learner.turn() {
            PolicyTurn::Begin => {
                environments.reset(&mut shown);
                learner.begin(&shown).unwrap();
            }
            PolicyTurn::Act(actions) => {
                environments.step(actions, &mut outcomes).unwrap();
                meddle(learner, &outcomes);
                learner.take(&outcomes).unwrap();
            }
            PolicyTurn::Learn => {
                if let Some(told) = learner.learn(&mut |_| true).unwrap() {
                    return told;
                }
            }
            PolicyTurn::Done => panic!("an epoch was left"),
        }
    }
}

/// The state but for environments, which are one's own or the program's.
fn lines(state: &mut dyn State) -> Vec<String> {
    let mut lines = book(state).lines;
    lines.retain(|line| !line.starts_with("environment"));
    lines
}

#[test]
fn a_caller_with_the_same_environments_gets_the_same_bits() {
    for id in IDS {
        let experiment = experiment(id, Rule::Ed, None);
        let mut inside = trainer(&experiment);
        let (mut outside, mut own) = (learner(&experiment), environments(&experiment));
        for at in 1..=3 {
            let told = inside.learn(&mut |_| true).unwrap();
            assert_eq!(epoch(&mut outside, &mut *own, &mut |_, _| {}), told, "{id}");
            assert_eq!((outside.epoch(), outside.steps()), (at, inside.steps()));
            assert_eq!(lines(&mut outside), lines(&mut inside), "{id}");
        }
        assert_eq!(outside.turn(), PolicyTurn::Done);
        let error = outside.learn(&mut |_| true).unwrap_err().to_string();
        assert!(error.contains("out of turn") && error.contains("no epoch is left"), "{error}");
    }
}

#[test]
fn a_bad_step_is_as_if_it_had_never_come() {
    let experiment = experiment(IDS[0], Rule::Ed, None);
    let (mut plain, mut own) = (learner(&experiment), environments(&experiment));
    let wanted: Vec<_> = (0..2).map(|_| epoch(&mut plain, &mut *own, &mut |_, _| {})).collect();

    let (mut vexed, mut own) = (learner(&experiment), environments(&experiment));
    let mut steps = 0;
    let mut vex = |learner: &mut PolicyLearner, good: &Outcomes| {
        steps += 1;
        let before = book(learner).lines;
        let mut bad = good.clone();
        match steps % 4 {
            0 => bad.next.values.truncate(1),
            1 => bad.rewards.push(Real::ONE),
            2 => (bad.terminated[0], bad.truncated[0]) = (true, true),
            _ => bad.reached.active.push(0),
        }
        assert!(matches!(learner.take(&bad), Err(PolicyError::Environment(_))));
        for error in [learner.begin(&good.next), learner.learn(&mut |_| true).map(|_| ())] {
            assert!(matches!(error, Err(PolicyError::Turn { .. })), "{error:?}");
        }
        assert_eq!(book(learner).lines, before, "step {steps}");
    };
    for wanted in wanted {
        assert_eq!(epoch(&mut vexed, &mut *own, &mut vex), wanted);
    }
    assert_eq!(book(&mut vexed).lines, book(&mut plain).lines);
}

#[test]
fn what_is_put_back_goes_on_where_its_environments_are() {
    let experiment = experiment(IDS[1], Rule::Ed, None);
    let (mut first, mut own) = (learner(&experiment), environments(&experiment));
    let _ = epoch(&mut first, &mut *own, &mut |_, _| {});
    let mut kept = book(&mut first);
    kept.give = true;
    let mut here = Book::default();
    own.visit(&mut here).unwrap();
    here.give = true;

    let mut second = learner(&experiment);
    second.visit(&mut kept).unwrap();
    let mut again = environments(&experiment);
    again.visit(&mut here).unwrap();
    let mut shown = Observations::default();
    again.show(&mut shown);
    assert_eq!(second.turn(), PolicyTurn::Begin);
    assert_eq!(second.epoch(), 1);
    second.begin(&shown).unwrap();
    for _ in 0..2 {
        let told = epoch(&mut first, &mut *own, &mut |_, _| {});
        assert_eq!(epoch(&mut second, &mut *again, &mut |_, _| {}), told);
    }
    assert_eq!(book(&mut second).lines, book(&mut first).lines);
}

#[test]
fn who_is_asked_meanwhile_learns_the_same() {
    let experiment = experiment(IDS[1], Rule::Ed, None);
    let (mut plain, mut own) = (learner(&experiment), environments(&experiment));
    let wanted = epoch(&mut plain, &mut *own, &mut |_, _| {});
    let (mut asked, mut own) = (learner(&experiment), environments(&experiment));
    let mut ask = |learner: &mut PolicyLearner, good: &Outcomes| {
        let first = format!("{:?}", learner.answer(&good.next, 0).unwrap());
        assert_eq!(format!("{:?}", learner.answer(&good.next, 9).unwrap()), first);
    };
    assert_eq!(epoch(&mut asked, &mut *own, &mut ask), wanted);
    let levels = |learner: &mut PolicyLearner| book(learner).halves;
    assert_eq!(levels(&mut asked), levels(&mut plain));
}

#[test]
fn evolution_is_refused_and_other_environments_are_fitted() {
    let experiment = experiment(IDS[0], Rule::Ed, None);
    let evolution = PolicyExperiment { method: EVOLUTION, ..experiment.clone() };
    let spec = environment::make(IDS[0], 1, 1).unwrap().spec().clone();
    let error = PolicyLearner::new(evolution, spec.clone(), Backend::best()).unwrap_err();
    assert!(error.to_string().contains("evolution begins the episodes"), "{error}");
    let other = EnvSpec {
        id: "Mine-v0".into(),
        shown: environment::Shown::Sparse { lines: 9, active: 2 },
        taken: environment::Taken::Continuous(3),
        ..spec
    };
    assert!(PolicyLearner::new(experiment.clone(), other.clone(), Backend::best()).is_err());
    let fitted = experiment.facing(&other);
    assert_eq!(fitted.environment, "Mine-v0");
    assert!(PolicyLearner::new(fitted, other, Backend::best()).is_ok());
}
