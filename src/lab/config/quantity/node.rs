//! Of which technology the numbers of a model are: a total that adds numbers of several nodes says so.

use std::cmp::Reverse;

use super::Constants;

impl Constants {
    /// Nodes, in nanometres, and how many numbers are of each, the most first; `None`: of no node that is said.
    #[must_use]
    pub fn nodes(&self) -> Vec<(Option<f64>, usize)> {
        let mut nodes: Vec<(Option<f64>, usize)> = Vec::new();
        for constant in self.iter() {
            match nodes.iter_mut().find(|(node, _)| *node == constant.node_nm) {
                Some((_, numbers)) => *numbers += 1,
                None => nodes.push((constant.node_nm, 1)),
            }
        }
        nodes.sort_by_key(|&(_, numbers)| Reverse(numbers));
        nodes
    }

    /// `14 nm (12 numbers), 45 nm (3)`; nothing where a model says no node or has no number.
    #[must_use]
    pub fn node_words(&self) -> Option<String> {
        let nodes = self.nodes();
        if nodes.iter().all(|(node, _)| node.is_none()) {
            return None;
        }
        let word = |(at, (node, numbers)): (usize, &(Option<f64>, usize))| {
            let node = node.map_or_else(|| "no node said".into(), |node| format!("{node} nm"));
            let noun = if at == 0 { " numbers" } else { "" };
            format!("{node} ({numbers}{noun})")
        };
        Some(nodes.iter().enumerate().map(word).collect::<Vec<_>>().join(", "))
    }
}

#[cfg(test)]
mod tests {
    use crate::lab::config::{Sources, load};

    #[test]
    fn every_model_says_of_which_nodes_its_numbers_are() {
        for model in crate::lab::config::model_names() {
            let sources = Sources { hardware: Some(model), ..Sources::default() };
            let constants = load(&sources).unwrap().constants;
            let nodes = constants.nodes();
            let numbers: usize = nodes.iter().map(|(_, numbers)| numbers).sum();
            assert_eq!(numbers, constants.iter().count(), "{model}");
            assert!(constants.node_words().unwrap().contains(" nm ("), "{model}");
        }
        let bare =
            "hw = { name = 'x', cell = {}, tile = {}, drive = {}, adc = 'ideal', write = {} }";
        let sources = Sources { experiment: Some(("x", bare)), ..Sources::default() };
        assert_eq!(load(&sources).unwrap().constants.node_words(), None);
    }
}
