//! A visitor that gives the pieces of a second network names of their own.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use bitvec::prelude::*;

use crate::chip::state::{Piece, Section, Seen, Visitor};

/// Shows pieces under other names. Those of layers keep theirs: layers are numbered through.
pub(super) struct Prefixed<'a> {
    /// What stands before a name.
    pub(super) prefix: &'static str,
    /// Who looks.
    pub(super) visitor: &'a mut dyn Visitor,
}

impl Prefixed<'_> {
    fn renamed<T>(
        &mut self,
        piece: &Piece<'_>,
        look: impl FnOnce(&mut dyn Visitor, &Piece<'_>) -> Seen<T>,
    ) -> Seen<T> {
        if piece.name.starts_with("layer") {
            return look(self.visitor, piece);
        }
        let name = format!("{}.{}", self.prefix, piece.name);
        look(self.visitor, &Piece { name: &name, ..piece.clone() })
    }
}

impl Visitor for Prefixed<'_> {
    fn halves(
        &mut self,
        piece: &Piece<'_>,
        shape: [usize; 2],
        values: &dyn Fn() -> Vec<u16>,
    ) -> Seen<Vec<u16>> {
        self.renamed(piece, |visitor, piece| visitor.halves(piece, shape, values))
    }

    fn bits(
        &mut self,
        piece: &Piece<'_>,
        shape: [usize; 2],
        values: &dyn Fn() -> BitVec<u8, Lsb0>,
    ) -> Seen<BitVec<u8, Lsb0>> {
        self.renamed(piece, |visitor, piece| visitor.bits(piece, shape, values))
    }

    fn numbers(&mut self, piece: &Piece<'_>, values: &[i64]) -> Seen<Vec<i64>> {
        self.renamed(piece, |visitor, piece| visitor.numbers(piece, values))
    }

    fn rows(
        &mut self,
        piece: &Piece<'_>,
        width: usize,
        values: &dyn Fn() -> Vec<i64>,
    ) -> Seen<Vec<i64>> {
        self.renamed(piece, |visitor, piece| visitor.rows(piece, width, values))
    }

    fn derived(&mut self, section: Section, bytes: &dyn Fn() -> Vec<u8>) {
        self.visitor.derived(section, bytes);
    }
}
