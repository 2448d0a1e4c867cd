//! What a policy acts on, in the place of data: nothing to learn from, but a description and a hash.
//!
//! ```text
//! hash = BLAKE3( "dalean environment 1\n", id, what it shows and takes, steps of an episode at most )
//! ```
//!
//! What an environment does is part of this program, as its arithmetic is: a change of its law raises that version.

use super::error::DataError;
use super::load::Data;
use crate::task::classify::{Examples, Split};
use crate::task::environment::{self, EnvSpec, Shown, Taken};

/// Describes an environment.
///
/// # Errors
/// When there is none of that name.
pub(super) fn describe(id: &str) -> Result<Data, DataError> {
    let env = environment::make(id, 0, 1).map_err(|error| DataError::Keys(error.to_string()))?;
    Ok(of(env.spec()))
}

fn of(spec: &EnvSpec) -> Data {
    // names of inputs are words for people
    let EnvSpec { id, shown, taken, steps_max, inputs: _ } = spec;
    let (features, shows, shown) = match *shown {
        Shown::Dense(values) => (values, format!("{values} numbers"), format!("dense {values}")),
        Shown::Sparse { lines, active } => {
            let shows = format!("{lines} lines, {active} on at most");
            (lines, shows, format!("sparse {lines} {active}"))
        }
    };
    let (classes, takes, taken) = match *taken {
        Taken::Discrete(n) => (n, format!("one of {n} actions"), format!("discrete {n}")),
        Taken::Continuous(n) => (n, format!("{n} numbers from -1 to 1"), format!("continuous {n}")),
    };
    let description =
        format!("{id}: shows {shows}, takes {takes}, episodes of {steps_max} steps at most");
    let content = format!("dalean environment 1\n{id}\n{shown}\n{taken}\n{steps_max}\n");
    let none = Examples::new(vec![], vec![], features.max(1), 255, classes.clamp(1, 256));
    let none = none.expect("no examples break no rule");
    let split = Split { train: none.clone(), validation: none.clone(), test: none };
    let (names, said, told) = Default::default();
    let hash = blake3::hash(content.as_bytes()).to_hex().to_string();
    Data { description, hash, image: None, split, names, said, told }
}
