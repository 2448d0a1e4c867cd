//! What all environments have in common, on one that counts; and that each keeps to what it says of itself.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use proptest::prelude::*;

use super::*;
use crate::chip::state::Seen;
use crate::task::environment::{ENVIRONMENTS, make};

/// Begins at a drawn number below 1000, adds its action, and is over when a sum of actions reaches 5.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Adder {
    first: i64,
    sum: i64,
}

impl Environment for Adder {
    fn spec() -> EnvSpec {
        EnvSpec {
            id: "Adder".into(),
            shown: Shown::Dense(2),
            taken: Taken::Discrete(4),
            steps_max: 3,
            inputs: vec![("first", 1), ("sum", 1)],
        }
    }

    fn parts() -> Vec<StatePart> {
        let part = |name, most| StatePart { name, numbers: 1, within: 0..=most };
        vec![part("first", 999), part("sum", 8)]
    }

    fn begin(words: &mut impl Iterator<Item = u32>) -> Self {
        Self { first: i64::from(words.next().unwrap() % 1000), sum: 0 }
    }

    fn act(&mut self, action: Action<'_>) -> Came {
        self.sum += i64::from(action.choice());
        Came { reward: Real::from_num(self.sum), terminated: self.sum >= 5 }
    }

    fn show(&self, shown: &mut Observations) {
        shown.values.extend([self.first, self.sum].map(Real::from_num));
    }

    fn numbers(&self, numbers: &mut Vec<i64>) {
        numbers.extend([self.first, self.sum]);
    }

    fn from_numbers(numbers: &[i64]) -> Self {
        Self { first: numbers[0], sum: numbers[1] }
    }

    fn picture(&self) -> String {
        format!("{self:?}\n")
    }
}

fn first(which: u32, episode: u64) -> i64 {
    let place = Place { sub: which, ..Place::global(9, Site::Environment, episode) };
    i64::from(place.words().next().unwrap() % 1000)
}

fn values(numbers: &[i64]) -> Vec<Real> {
    numbers.iter().copied().map(Real::from_num).collect()
}

#[test]
fn an_end_shows_what_was_reached_and_the_next_beginning() {
    let mut many = SideBySide::<Adder>::new(9, 3);
    let mut shown = Observations::default();
    many.show(&mut shown);
    assert_eq!(shown.values, values(&[first(0, 0), 0, first(1, 0), 0, first(2, 0), 0]));
    many.reset(&mut shown);
    assert_eq!(shown.values, values(&[first(0, 1), 0, first(1, 1), 0, first(2, 1), 0]));
    let mut outcomes = Outcomes::default();
    many.step(Actions::Discrete(&[0, 3, 1]), &mut outcomes).unwrap();
    assert_eq!(outcomes.reached, outcomes.next);
    assert_eq!(outcomes.rewards, values(&[0, 3, 1]));
    // environment 1 is over after two steps
    many.step(Actions::Discrete(&[0, 2, 1]), &mut outcomes).unwrap();
    assert_eq!(
        (&outcomes.terminated, &outcomes.truncated),
        (&vec![false, true, false], &vec![false; 3])
    );
    assert_eq!(outcomes.reached.values, values(&[first(0, 1), 0, first(1, 1), 5, first(2, 1), 2]));
    assert_eq!(outcomes.next.values, values(&[first(0, 1), 0, first(1, 2), 0, first(2, 1), 2]));
    // 0 is stopped at its third step; 2 is over at its third step, and therefore not stopped
    many.step(Actions::Discrete(&[0, 1, 3]), &mut outcomes).unwrap();
    assert_eq!(outcomes.terminated, [false, false, true]);
    assert_eq!(outcomes.truncated, [true, false, false]);
    assert_eq!(outcomes.reached.values, values(&[first(0, 1), 0, first(1, 2), 1, first(2, 1), 5]));
    assert_eq!(outcomes.next.values, values(&[first(0, 2), 0, first(1, 2), 1, first(2, 2), 0]));
    let mut again = Observations::default();
    many.show(&mut again);
    assert_eq!(again, outcomes.next);
}

#[test]
fn actions_of_another_kind_number_or_size_are_refused_and_move_nothing() {
    let mut many = SideBySide::<Adder>::new(9, 2);
    let mut outcomes = Outcomes::default();
    let mut refused =
        |actions: Actions<'_>| many.step(actions, &mut outcomes).unwrap_err().to_string();
    let texts = [
        refused(Actions::Discrete(&[0, 4])),
        refused(Actions::Discrete(&[0])),
        refused(Actions::Discrete(&[0, 0, 0])),
        refused(Actions::Continuous(&[Real::ONE, Real::ONE])),
    ];
    assert_eq!(
        texts,
        [
            "environment 1 of `Adder` is given action 4; its actions are 0 to 3",
            "environment 1 of `Adder` is one of 2 that are given 1 values; 2 are needed",
            "environment 1 of `Adder` is one of 2 that are given 3 values; 2 are needed",
            "environment 0 of `Adder` is given numbers; it takes choices",
        ]
    );
    assert_eq!(many.state(1), [first(1, 0), 0]);
    let text = make("Pendulum-v1", 0, 1).unwrap().step(Actions::Discrete(&[0]), &mut outcomes);
    assert!(text.unwrap_err().to_string().ends_with("is given choices; it takes numbers"));
    assert_eq!(many.put(0, &[1]).unwrap_err().found, "is given a state of 1 numbers");
    assert_eq!(many.put(0, &[1, 9]).unwrap_err().found, "is given 9 as `sum`");
    assert_eq!(many.put(0, &[999, 8]), Ok(()));
    assert_eq!(many.state(0), [999, 8]);
    let unknown = make("CartPole-v0", 0, 1).unwrap_err().to_string();
    assert!(ENVIRONMENTS.iter().all(|(id, _)| unknown.contains(id)), "{unknown}");
}

/// Keeps every piece, or puts back what another kept, in the same order.
#[derive(Debug, Default)]
struct Kept {
    pieces: Vec<(String, Vec<i64>)>,
    put_back: bool,
    at: usize,
}

impl Visitor for Kept {
    fn halves(&mut self, _: &Piece<'_>, _: [usize; 2], _: &dyn Fn() -> Vec<u16>) -> Seen<Vec<u16>> {
        unreachable!("an environment is numbers")
    }

    fn bits(
        &mut self,
        _: &Piece<'_>,
        _: [usize; 2],
        _: &dyn Fn() -> bitvec::prelude::BitVec<u8, bitvec::prelude::Lsb0>,
    ) -> Seen<bitvec::prelude::BitVec<u8, bitvec::prelude::Lsb0>> {
        unreachable!("an environment is numbers")
    }

    fn numbers(&mut self, piece: &Piece<'_>, values: &[i64]) -> Seen<Vec<i64>> {
        assert!(values.iter().all(|value| piece.within.contains(value)), "{piece:?} {values:?}");
        assert_eq!(piece.section, Some(Section::Task));
        if !self.put_back {
            self.pieces.push((piece.name.into(), values.into()));
            return Ok(None);
        }
        let (name, kept) = &self.pieces[self.at];
        assert_eq!((name.as_str(), kept.len()), (piece.name, values.len()));
        self.at += 1;
        Ok(Some(kept.clone()))
    }

    fn rows(&mut self, _: &Piece<'_>, _: usize, _: &dyn Fn() -> Vec<i64>) -> Seen<Vec<i64>> {
        unreachable!("an environment is numbers")
    }
}

/// Actions for `count` environments, from words.
fn drawn(
    taken: Taken,
    count: usize,
    words: &mut impl Iterator<Item = u32>,
) -> (Vec<u16>, Vec<Real>) {
    let mut bits = || words.next().unwrap();
    match taken {
        Taken::Discrete(choices) => {
            ((0..count).map(|_| (bits() as usize % choices) as u16).collect(), vec![])
        }
        Taken::Continuous(each) => {
            // a little beyond both ends: it is held
            let number = |word: u32| Real::from_bits((word % 140_000) as i32 - 70_000);
            (vec![], (0..count * each).map(|_| number(bits())).collect())
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(12))]

    #[test]
    fn every_environment_goes_on_from_its_pieces_and_keeps_to_its_spec(seed: u64, steps in 0_usize..700) {
        for (id, make) in ENVIRONMENTS {
            let mut many = make(seed, 3);
            let spec = many.spec().clone();
            prop_assert_eq!(spec.id, id);
            let mut words = Place::global(seed, Site::Exploration, 0).words();
            let mut outcomes = Outcomes::default();
            let mut lengths = [0; 3];
            let mut step = |many: &mut dyn VecEnv, outcomes: &mut Outcomes| {
                let (choices, numbers) = drawn(spec.taken, 3, &mut words);
                let actions = match spec.taken {
                    Taken::Discrete(_) => Actions::Discrete(&choices),
                    Taken::Continuous(_) => Actions::Continuous(&numbers),
                };
                many.step(actions, outcomes).unwrap();
                (choices, numbers)
            };
            for _ in 0..steps {
                step(&mut *many, &mut outcomes);
                for (which, length) in lengths.iter_mut().enumerate() {
                    *length += 1;
                    let (over, stopped) = (outcomes.terminated[which], outcomes.truncated[which]);
                    prop_assert!(!(over && stopped));
                    prop_assert_eq!(stopped || over && *length == spec.steps_max, *length == spec.steps_max);
                    if over || stopped {
                        *length = 0;
                    }
                }
                for shown in [&outcomes.reached, &outcomes.next] {
                    match spec.shown {
                        Shown::Dense(values) => prop_assert_eq!(shown.values.len(), 3 * values),
                        Shown::Sparse { lines, active } => for which in 0..3 {
                            let on = shown.lines_of(which);
                            prop_assert!(on.len() <= active && on.is_sorted_by(|a, b| a < b));
                            prop_assert!(on.iter().all(|line| (*line as usize) < lines));
                        },
                    }
                }
            }
            let inputs: usize = spec.inputs.iter().map(|(_, many)| many).sum();
            let shown = match spec.shown { Shown::Dense(n) => n, Shown::Sparse { lines, .. } => lines };
            prop_assert_eq!(inputs, shown);
            prop_assert!(!many.picture(2).is_empty());
            let mut kept = Kept::default();
            many.visit(&mut kept).unwrap();
            kept.put_back = true;
            let mut other = make(seed, 3);
            other.visit(&mut kept).unwrap();
            let (mut here, mut there) = (Observations::default(), Observations::default());
            many.show(&mut here);
            other.show(&mut there);
            prop_assert_eq!(here, there);
            let mut outcomes_there = Outcomes::default();
            for _ in 0..100 {
                let (choices, numbers) = step(&mut *many, &mut outcomes);
                let actions = match spec.taken {
                    Taken::Discrete(_) => Actions::Discrete(&choices),
                    Taken::Continuous(_) => Actions::Continuous(&numbers),
                };
                other.step(actions, &mut outcomes_there).unwrap();
                prop_assert_eq!(&outcomes, &outcomes_there);
            }
        }
    }
}

/// From any state within its parts, an environment that is not over stays within them.
fn stays_within<E: Environment>(words: &mut impl Iterator<Item = u32>) {
    let parts: Vec<StatePart> = E::parts().into_iter().flat_map(singles).collect();
    let numbers: Vec<i64> = parts
        .iter()
        .map(|part| {
            let (least, most) = (*part.within.start(), *part.within.end());
            let [word, share] = [words.next().unwrap(), words.next().unwrap()];
            // an end now and then
            match word % 8 {
                0 => least,
                1 => most,
                _ => least + ((i128::from(most - least) * i128::from(share)) >> 32) as i64,
            }
        })
        .collect();
    let mut one = E::from_numbers(&numbers);
    for _ in 0..20 {
        let (choices, reals) = drawn(E::spec().taken, 1, words);
        let came = one.act(match E::spec().taken {
            Taken::Discrete(_) => Action::Discrete(choices[0]),
            Taken::Continuous(_) => Action::Continuous(&reals),
        });
        one.show(&mut Observations::default());
        assert!(!one.picture().is_empty());
        if came.terminated {
            return;
        }
        let mut after = vec![];
        one.numbers(&mut after);
        for (part, number) in parts.iter().zip(&after) {
            assert!(part.within.contains(number), "{} {number} from {numbers:?}", part.name);
        }
    }
}

proptest! {
    #[test]
    fn no_state_leads_out_of_its_parts(seed: u64) {
        let mut words = Place::global(seed, Site::Environment, 0).words();
        stays_within::<crate::task::environment::cart_pole::CartPole>(&mut words);
        stays_within::<crate::task::environment::acrobot::Acrobot>(&mut words);
        stays_within::<crate::task::environment::pendulum::Pendulum>(&mut words);
        stays_within::<crate::task::environment::mountain_car::MountainCar>(&mut words);
        stays_within::<crate::task::environment::foray::Foray>(&mut words);
    }
}
