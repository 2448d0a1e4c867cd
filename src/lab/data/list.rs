//! What sets there are, which of them lie ready, and the hash of each.

use super::{
    builtin::OPTDIGITS_LICENCE,
    catalog::CatalogEntry,
    error::DataError,
    load::load,
    source::{DataRoot, NamedSet, Source},
};

/// Whether a set can be used.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum SetState {
    /// Part of the program.
    BuiltIn,
    /// Fetched, its hashes checked.
    Present,
    /// Not fetched.
    Missing,
    /// Fetched, but not what it should be; the words say why.
    Damaged(String),
}

/// One line of the list.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Entry {
    /// The set.
    pub set: NamedSet,
    /// Whether it can be used.
    pub state: SetState,
    /// Examples to learn from (validation included) and to test on.
    pub examples: [usize; 2],
    /// [`super::Data::hash`] of a set that can be used.
    pub hash: Option<String>,
    /// Terms of use.
    pub licence: &'static str,
    /// Commands that get it; empty for one that is built in.
    pub how_to_get: String,
}

/// All known sets, those in `root` loaded and checked.
#[must_use]
pub fn list(root: &DataRoot) -> Vec<Entry> {
    NamedSet::all().map(|set| entry(set, root)).collect()
}

fn entry(set: NamedSet, root: &DataRoot) -> Entry {
    let catalogued = CatalogEntry::of(set);
    let loaded = load(&Source::Named(set), root);
    let examples = match (&loaded, catalogued) {
        (_, Some(entry)) => entry.examples,
        (Ok(loaded), None) => {
            // The parts of a logic task are all the same, so they do not add up.
            let split = &loaded.split;
            let own = if set == NamedSet::Optdigits { split.validation.len() } else { 0 };
            [split.train.len() + own, split.test.len()]
        }
        (Err(_), None) => [0, 0],
    };
    let state = match &loaded {
        Ok(_) if catalogued.is_none() => SetState::BuiltIn,
        Ok(_) => SetState::Present,
        Err(DataError::Missing { .. }) => SetState::Missing,
        Err(other) => SetState::Damaged(other.to_string()),
    };
    let licence = match (catalogued, set) {
        (Some(entry), _) => entry.licence,
        (None, NamedSet::Optdigits) => OPTDIGITS_LICENCE,
        (None, _) => "none needed (made by rule)",
    };
    let how_to_get = catalogued.map(CatalogEntry::how_to_get).unwrap_or_default();
    Entry { set, state, examples, hash: loaded.ok().map(|l| l.hash), licence, how_to_get }
}

#[cfg(test)]
#[expect(clippy::disallowed_methods, reason = "data sets live in files")]
mod tests {
    use super::*;

    #[test]
    fn an_empty_folder_lists_the_built_in_sets_as_ready_and_the_others_as_missing() {
        let root = tempfile::tempdir().unwrap();
        let entries = list(&DataRoot::new(root.path()));
        assert_eq!(entries.len(), 12);
        for entry in &entries {
            let built_in = entry.state == SetState::BuiltIn;
            assert_eq!(built_in, entry.hash.is_some() && entry.how_to_get.is_empty());
            assert!(built_in || entry.state == SetState::Missing);
        }
        assert_eq!(entries[0].examples, [3823, 1797]);
        assert_eq!((entries[3].examples, entries[4].examples), ([50_000, 10_000], [4, 4]));
        std::fs::create_dir(root.path().join("mnist")).unwrap();
        std::fs::write(root.path().join("mnist/t10k-labels-idx1-ubyte"), "x").unwrap();
        assert!(matches!(&list(&DataRoot::new(root.path()))[1].state, SetState::Damaged(_)));
    }
}
