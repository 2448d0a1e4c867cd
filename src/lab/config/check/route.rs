//! `learning.route`, `taps`, `tap_shift`: how errors reach hidden layers.

use super::{word, wrong};
use crate::lab::config::ConfigError;
use crate::lab::config::file::LearningFile;
use crate::learn::route::Route;
use crate::learn::rule::Rule;

/// Checks the keys of the route and writes defaults back. A route that a rule does not have is refused by the network.
pub(super) fn resolve(
    file: &mut LearningFile,
    rule: Rule,
    taps: usize,
) -> Result<Option<Route>, ConfigError> {
    if rule == Rule::Bp && file.route.is_none() {
        no_taps(file, "rule = \"bp\" has no route")?;
        return Ok(None);
    }
    let default = if rule == Rule::Dfa { "random_dense" } else { "modulo" };
    let names = [
        ("modulo", Route::Modulo { taps: 1, shift: None }),
        ("random_sparse", Route::RandomSparse),
        ("scalar_broadcast", Route::ScalarBroadcast),
        ("random_dense", Route::RandomDense { shift: None }),
    ];
    let route = word("learning.route", &mut file.route, default, &names)?;
    if let Route::Modulo { .. } = route {
        let taps = *file.taps.get_or_insert(taps);
        return Ok(Some(Route::Modulo { taps, shift: file.tap_shift }));
    }
    let name = file.route.as_deref().unwrap_or(default);
    no_taps(file, &format!("route = \"{name}\" has none"))?;
    Ok(Some(route))
}

/// Refuses keys of taps where there are none.
fn no_taps(file: &LearningFile, why: &str) -> Result<(), ConfigError> {
    let given = [
        ("learning.taps", file.taps.map(|taps| taps.to_string())),
        ("learning.tap_shift", file.tap_shift.map(|shift| shift.to_string())),
    ];
    match given.into_iter().find_map(|(key, value)| Some((key, value?))) {
        None => Ok(()),
        Some((key, value)) => {
            let allowed = format!(
                "taps belong to route = \"modulo\", and {why}: take the key out (--set {key}=default), or choose that route"
            );
            Err(wrong(key, format!("is {value}"), allowed))
        }
    }
}
