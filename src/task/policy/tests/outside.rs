//! Policies that are driven from outside: the same bits as from inside, and nothing bad that stays.

use super::*;
use crate::task::environment::{Actions, Observations, Outcomes, Real, VecEnv};

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

/// Carts that begin their next episode in the step after the one that ended, as Gymnasium's vector environments do by default.
/// What they show at an end is `end`, where it is given.
struct Later {
    carts: Vec<Box<dyn VecEnv>>,
    ended: Vec<bool>,
    begins: Vec<Vec<Real>>,
    end: Option<Real>,
    /// Lengths of the episodes that ended.
    lengths: Vec<u64>,
    going: Vec<u64>,
}

impl Later {
    fn new(count: u64, end: Option<Real>) -> Self {
        let carts = (0..count).map(|seed| environment::make(IDS[0], seed, 1).unwrap()).collect();
        let (ended, going) = (vec![false; count as usize], vec![0; count as usize]);
        Self { carts, ended, begins: vec![vec![]; count as usize], end, lengths: vec![], going }
    }

    fn reset(&mut self) -> Observations {
        let mut shown = Observations::default();
        let mut all = Observations::default();
        for cart in &mut self.carts {
            cart.reset(&mut shown);
            all.append(&shown);
        }
        self.ended.fill(false);
        self.going.fill(0);
        all
    }

    /// What came of it, and who was idle.
    fn step(&mut self, actions: &[u16]) -> (Outcomes, Vec<bool>) {
        let (mut all, mut one) = (Outcomes::default(), Outcomes::default());
        let idle = self.ended.clone();
        for (at, cart) in self.carts.iter_mut().enumerate() {
            if idle[at] {
                all.next.values.extend(&self.begins[at]);
                all.rewards.push(Real::ZERO);
                (self.ended[at], self.going[at]) = (false, 0);
            } else {
                cart.step(Actions::Discrete(&actions[at..=at]), &mut one).unwrap();
                self.going[at] += 1;
                self.ended[at] = one.terminated[0] || one.truncated[0];
                all.rewards.push(one.rewards[0]);
                let mut reached = one.reached.values.clone();
                if self.ended[at] {
                    self.begins[at].clone_from(&one.next.values);
                    self.lengths.push(self.going[at]);
                    // what a task ended with is worth nothing, so nothing may depend on it
                    reached.iter_mut().for_each(|value| *value = self.end.unwrap_or(*value));
                }
                all.next.values.extend(reached);
            }
            all.terminated.push(self.ended[at]);
            all.truncated.push(false);
        }
        all.reached = all.next.clone();
        (all, idle)
    }
}

#[test]
fn nothing_is_learnt_from_a_step_in_which_nobody_acted() {
    let experiment = experiment(IDS[0], Rule::Ed, None);
    let train = |end: Option<i32>, say: bool| {
        let mut own = Later::new(experiment.environments.into(), end.map(Real::from_num));
        let mut learner = learner(&experiment);
        let mut told = vec![];
        loop {
            match learner.turn() {
                PolicyTurn::Begin => {
                    let shown = own.reset();
                    own.lengths.clear();
                    learner.begin(&shown).unwrap();
                }
                PolicyTurn::Act(Actions::Discrete(actions)) => {
                    let actions = actions.to_vec();
                    let (outcomes, idle) = own.step(&actions);
                    learner.take_idle(&outcomes, if say { &idle } else { &[] }).unwrap();
                }
                PolicyTurn::Learn => told.extend(learner.learn(&mut |_| true).unwrap()),
                _ => break,
            }
        }
        assert!(own.lengths.len() > 10, "{}", own.lengths.len());
        let lengths = |told: &[PolicyEpoch]| {
            let all = told.iter().map(|told| (told.lengths.count, told.lengths.sum));
            all.fold((0, 0), |(a, b), (c, d)| (a + c, b + d))
        };
        let wanted = (own.lengths.len() as u64, own.lengths.iter().sum::<u64>() as i64);
        (told.clone(), lines(&mut learner), lengths(&told) == wanted)
    };
    let wanted = train(None, true);
    assert!(wanted.2, "episodes are as long as they were");
    // faults that this catches: an idle step in the order of a pass, in the moments of advantages, in the scale of values, in
    // the statistics of observations, or in what is calibrated on
    assert_eq!(train(Some(1000), true), wanted);
    assert_eq!(train(Some(-7), true), wanted);
    // it has teeth: unsaid, what was shown there is learnt from
    let unsaid = train(None, false);
    assert!(!unsaid.2 && unsaid.1 != wanted.1);
    assert_ne!(train(Some(1000), false).1, unsaid.1);
}

#[test]
fn an_idle_environment_neither_ends_nor_earns() {
    let experiment = experiment(IDS[0], Rule::Ed, None);
    let (mut learner, mut own) = (learner(&experiment), environments(&experiment));
    let (mut shown, mut outcomes) = (Observations::default(), Outcomes::default());
    own.reset(&mut shown);
    learner.begin(&shown).unwrap();
    let PolicyTurn::Act(actions) = learner.turn() else { panic!("actions are due") };
    own.step(actions, &mut outcomes).unwrap();
    let mut idle = vec![false; experiment.environments as usize];
    idle[1] = true;
    let error = learner.take_idle(&outcomes, &idle).unwrap_err().to_string();
    assert!(error.contains("environment 1") && error.contains("earns 1 in the step"), "{error}");
    outcomes.rewards[1] = Real::ZERO;
    outcomes.terminated[1] = true;
    let error = learner.take_idle(&outcomes, &idle).unwrap_err().to_string();
    assert!(error.contains("ends an episode in the step that begins it"), "{error}");
    outcomes.terminated[1] = false;
    let error = learner.take_idle(&outcomes, &idle[1..]).unwrap_err().to_string();
    assert!(error.contains("are said to be idle or not"), "{error}");
    learner.take_idle(&outcomes, &idle).unwrap();
}
