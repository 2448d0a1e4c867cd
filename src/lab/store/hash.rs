//! The state hash: one number for everything that decides what comes next; and hashes of bytes.
//!
//! What is hashed is what [`State::visit`] shows, section by section ([`crate::chip::state`]). Order is logical and
//! unpadded; what a run does not have is no section, and never written as 0.

use std::collections::BTreeMap;

use bitvec::prelude::*;

use super::ARITHMETIC;
use crate::chip::state::{Piece, Section, Seen, State, Visitor};
use crate::learn::driver::Driver;

/// Content by section.
#[derive(Debug, Default)]
struct Sections(BTreeMap<Section, Vec<u8>>);

impl Sections {
    fn extend(&mut self, piece: &Piece<'_>, bytes: impl Iterator<Item = u8>) {
        if let Some(section) = piece.section {
            self.0.entry(section).or_default().extend(bytes);
        }
    }
}

impl Visitor for Sections {
    fn halves(
        &mut self,
        piece: &Piece<'_>,
        _: [usize; 2],
        values: &dyn Fn() -> Vec<u16>,
    ) -> Seen<Vec<u16>> {
        self.extend(piece, values().into_iter().flat_map(u16::to_le_bytes));
        Ok(None)
    }

    fn bits(
        &mut self,
        piece: &Piece<'_>,
        _: [usize; 2],
        values: &dyn Fn() -> BitVec<u8, Lsb0>,
    ) -> Seen<BitVec<u8, Lsb0>> {
        let mut bits = values();
        bits.set_uninitialized(false);
        self.extend(piece, bits.as_raw_slice().iter().copied());
        Ok(None)
    }

    fn numbers(&mut self, piece: &Piece<'_>, values: &[i64]) -> Seen<Vec<i64>> {
        self.extend(piece, values.iter().flat_map(|number| number.to_le_bytes()));
        Ok(None)
    }

    fn rows(
        &mut self,
        piece: &Piece<'_>,
        _: usize,
        values: &dyn Fn() -> Vec<i64>,
    ) -> Seen<Vec<i64>> {
        if piece.section.is_some() {
            self.extend(piece, values().into_iter().flat_map(i64::to_le_bytes));
        }
        Ok(None)
    }

    fn derived(&mut self, section: Section, bytes: &dyn Fn() -> Vec<u8>) {
        self.0.entry(section).or_default().extend(bytes());
    }
}

/// Hash of a state, in hexadecimal.
///
/// # Panics
/// Never: looking at a state replaces nothing.
#[must_use]
pub fn state(state: &mut dyn State) -> String {
    let mut sections = Sections::default();
    state.visit(&mut sections).expect("nothing is replaced");
    let mut hash = blake3::Hasher::new();
    hash.update(&ARITHMETIC.to_le_bytes());
    for (section, content) in sections.0.iter().filter(|(_, content)| !content.is_empty()) {
        hash.update(&(*section as u32).to_le_bytes());
        hash.update(&(content.len() as u64).to_le_bytes()).update(content);
    }
    hash.finalize().to_hex().to_string()
}

/// Hash of all activation tables, layer by layer through all networks.
#[must_use]
pub fn tables(networks: &[&Driver]) -> String {
    let mut hash = blake3::Hasher::new();
    for layer in networks.iter().flat_map(|driver| driver.engine().layers()) {
        hash.update(&layer.lut.shift.to_le_bytes());
        hash.update(&layer.lut.activity).update(&layer.lut.derivative);
    }
    for tables in networks.iter().filter_map(|driver| driver.unit().softmax()) {
        hash.update(&tables.shift().to_le_bytes());
        tables.entries().for_each(|entry| _ = hash.update(&entry.to_le_bytes()));
    }
    hash.finalize().to_hex().to_string()
}

/// Hash of the bytes of a file.
#[must_use]
pub fn bytes(bytes: impl AsRef<[u8]>) -> String {
    blake3::hash(bytes.as_ref()).to_hex().to_string()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::chip::state::StateError;

    struct Some;

    impl State for Some {
        fn visit(&mut self, visitor: &mut dyn Visitor) -> Result<(), StateError> {
            let piece = |name, section| Piece { name, section, within: 0..=9 };
            visitor.numbers(&piece("late", Option::Some(Section::Progress)), &[7])?;
            visitor.halves(&piece("first", Option::Some(Section::Arrays)), [1, 2], &|| {
                vec![1, 0x203]
            })?;
            visitor.rows(&piece("kept", None), 1, &|| vec![9])?;
            visitor.derived(Section::Ledger, &Vec::new);
            Ok(())
        }
    }

    #[test]
    fn sections_rise_and_empty_ones_do_not_exist() {
        let mut wanted = ARITHMETIC.to_le_bytes().to_vec();
        wanted.extend([1, 0, 0, 0, 4, 0, 0, 0, 0, 0, 0, 0, 1, 0, 3, 2]);
        wanted.extend([9, 0, 0, 0, 8, 0, 0, 0, 0, 0, 0, 0, 7, 0, 0, 0, 0, 0, 0, 0]);
        assert_eq!(state(&mut Some), blake3::hash(&wanted).to_hex().to_string());
    }
}
