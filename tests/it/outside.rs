//! Policies whose environments are outside: driven turn by turn, through the door from floats.

use dalean::Backend;
use dalean::lab::config::{Sources, load};
use dalean::lab::store::hash;
use dalean::policy::{
    FloatDoor, FloatOutcomes, Observations, Outcomes, PolicyEpoch, PolicyLearner, PolicyTurn,
};
use dalean::task::environment::{self, VecEnv};

fn learner(id: &str) -> (PolicyLearner, Box<dyn VecEnv>) {
    let text = format!(
        "task = \"policy\"\nenvironment = {{ id = \"{id}\", count = 3, horizon = 12, steps = 72, rollouts = 1 }}\n\
         network.hidden = [6]\nlearning.batch = 12\nppo.passes = 2"
    );
    let sources = Sources { experiment: Some(("it", &text)), ..Sources::default() };
    let experiment = load(&sources).unwrap().policy_experiment().unwrap().unwrap();
    let environments = environment::make(id, experiment.seed, 3).unwrap();
    let spec = environments.spec().clone();
    (PolicyLearner::new(experiment, spec, Backend::best()).unwrap(), environments)
}

fn floats(shown: &Observations) -> Vec<f64> {
    shown.values.iter().map(|value| value.to_num()).collect()
}

fn given<'a>(
    next: &'a [f64],
    reached: &'a [f64],
    rewards: &'a [f64],
    Outcomes { terminated, truncated, .. }: &'a Outcomes,
) -> FloatOutcomes<'a, f64> {
    FloatOutcomes { next, reached: Some(reached), rewards, terminated, truncated }
}

/// Makes a step bad.
type Bad = fn(usize, &mut [f64], &mut [f64]);

/// Trains to the end through the door; `bad` is told every step and makes steps that are to be refused.
fn train(id: &str, bad: Option<Bad>) -> (Vec<PolicyEpoch>, String) {
    let (mut learner, mut environments) = learner(id);
    let door = FloatDoor::new(environments.spec(), 3);
    let (mut shown, mut outcomes) = (Observations::default(), Outcomes::default());
    let (mut told, mut step) = (vec![], 0);
    loop {
        match learner.turn() {
            PolicyTurn::Begin => {
                environments.reset(&mut shown);
                learner.begin(&door.observations(&floats(&shown)).unwrap()).unwrap();
            }
            PolicyTurn::Act(actions) => {
                environments.step(actions, &mut outcomes).unwrap();
                let (next, reached) = (floats(&outcomes.next), floats(&outcomes.reached));
                let rewards: Vec<f64> = outcomes.rewards.iter().map(|r| r.to_num()).collect();
                if let Some(bad) = bad {
                    let before = hash::state(&mut learner);
                    let due = format!("{:?}", learner.turn());
                    let (mut next, mut rewards) = (next.clone(), rewards.clone());
                    bad(step, &mut next, &mut rewards);
                    let refused =
                        door.outcomes(&given(&next, &reached, &rewards, &outcomes)).unwrap_err();
                    let words = refused.to_string();
                    assert!(words.contains(id) && words.contains("nothing was learnt"), "{words}");
                    assert_eq!(hash::state(&mut learner), before);
                    assert_eq!(format!("{:?}", learner.turn()), due);
                }
                learner
                    .take(&door.outcomes(&given(&next, &reached, &rewards, &outcomes)).unwrap())
                    .unwrap();
                step += 1;
            }
            PolicyTurn::Learn => told.extend(learner.learn(&mut |_| true).unwrap()),
            _ => return (told, hash::state(&mut learner)),
        }
    }
}

#[test]
fn a_bad_float_moves_nothing_and_training_goes_on_as_if_it_had_never_come() {
    for id in ["CartPole-v1", "Pendulum-v1"] {
        let wanted = train(id, None);
        assert_eq!(wanted.0.len(), 2);
        let bad: Bad = |step, next, rewards| match step % 5 {
            0 => next[step % 9] = f64::NAN,
            1 => next[step % 9] = f64::NEG_INFINITY,
            2 => rewards[step % 3] = f64::INFINITY,
            3 => rewards[step % 3] = 1e300,
            _ => next[step % 9] = -32_768.001,
        };
        assert_eq!(train(id, Some(bad)), wanted, "{id}");
    }
}
