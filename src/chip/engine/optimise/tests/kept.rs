//! A state as numbers by name, and told again.

use std::collections::BTreeMap;

use bitvec::prelude::*;

use crate::chip::state::{Piece, Seen, Visitor};

/// Everything that a state says, by name, and to be told again.
#[derive(Default)]
pub(super) struct Copy {
    pub(super) numbers: BTreeMap<String, Vec<i64>>,
    pub(super) given: bool,
}

impl Copy {
    fn seen(&mut self, piece: &Piece<'_>, now: Vec<i64>) -> Option<Vec<i64>> {
        if self.given {
            return Some(self.numbers[piece.name].clone());
        }
        assert!(now.iter().all(|number| piece.within.contains(number)), "{}", piece.name);
        assert!(self.numbers.insert(piece.name.to_owned(), now).is_none(), "{}", piece.name);
        None
    }
}

impl Visitor for Copy {
    fn halves(
        &mut self,
        piece: &Piece<'_>,
        _shape: [usize; 2],
        values: &dyn Fn() -> Vec<u16>,
    ) -> Seen<Vec<u16>> {
        let seen = self.seen(piece, values().into_iter().map(i64::from).collect());
        Ok(seen.map(|seen| seen.into_iter().map(|number| number as u16).collect()))
    }

    fn bits(
        &mut self,
        piece: &Piece<'_>,
        _shape: [usize; 2],
        values: &dyn Fn() -> BitVec<u8, Lsb0>,
    ) -> Seen<BitVec<u8, Lsb0>> {
        let seen = self.seen(piece, values().into_iter().map(i64::from).collect());
        Ok(seen.map(|seen| seen.into_iter().map(|number| number != 0).collect()))
    }

    fn numbers(&mut self, piece: &Piece<'_>, values: &[i64]) -> Seen<Vec<i64>> {
        Ok(self.seen(piece, values.to_vec()))
    }

    fn rows(
        &mut self,
        piece: &Piece<'_>,
        _width: usize,
        values: &dyn Fn() -> Vec<i64>,
    ) -> Seen<Vec<i64>> {
        Ok(self.seen(piece, values()))
    }
}
