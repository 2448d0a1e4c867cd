//! The state of a run as safetensors, written whole and read with suspicion.
//!
//! One tensor a piece of state, by its name (`layer0.pp.levels`, `epoch`, `ledger.training`, ...), and one entry of
//! metadata, `dalean`, that holds as JSON:
//!
//! ```text
//! arithmetic   version        run, data   address of the run, hash of its data
//! state_hash   of the state   content     BLAKE3 over names, kinds, shapes and bytes of all tensors, then the metadata
//! ```
//!
//! Nothing in it depends on machine or time, so a run that is done again gives the same bytes. What is read is checked
//! against all of it.

use std::borrow::Cow;
use std::collections::BTreeMap;

use bitvec::prelude::*;
use safetensors::{Dtype, SafeTensors, View};

use super::{ARITHMETIC, hash};
use crate::chip::layer::Layer;
use crate::chip::state::{Piece, Seen, State, StateError, Visitor};

/// Why a checkpoint cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum CheckpointError {
    /// Not a safetensors file.
    #[error("it is not a checkpoint: {0}; start the run again")]
    Format(#[from] safetensors::SafeTensorError),
    /// Another run's, or another version's.
    #[error(
        "its {what} is {found}, but this run has {wanted}; it belongs to another run or version, or was changed"
    )]
    Other {
        /// Which entry.
        what: &'static str,
        /// What the file says.
        found: String,
        /// What this run says.
        wanted: String,
    },
    /// A tensor is missing, has another shape or holds what no run has.
    #[error("tensor {0}; the file is damaged: start the run again")]
    Tensor(#[from] StateError),
}

/// What a checkpoint belongs to.
#[derive(Debug, Clone, Copy)]
pub struct Identity<'a> {
    /// Address of the run.
    pub run: &'a str,
    /// Hash of the data.
    pub data: &'a str,
}

struct Tensor {
    dtype: Dtype,
    shape: Vec<usize>,
    bytes: Vec<u8>,
}

impl View for &Tensor {
    fn dtype(&self) -> Dtype {
        self.dtype
    }
    fn shape(&self) -> &[usize] {
        &self.shape
    }
    fn data(&self) -> Cow<'_, [u8]> {
        Cow::Borrowed(&self.bytes)
    }
    fn data_len(&self) -> usize {
        self.bytes.len()
    }
}

/// Gathers the pieces of a state as tensors.
#[derive(Default)]
struct Writer(BTreeMap<String, Tensor>);

impl Writer {
    fn put<T>(
        &mut self,
        piece: &Piece<'_>,
        dtype: Dtype,
        shape: &[usize],
        bytes: Vec<u8>,
    ) -> Seen<T> {
        let tensor = Tensor { dtype, shape: shape.to_vec(), bytes };
        let before = self.0.insert(piece.name.to_owned(), tensor);
        assert!(before.is_none(), "two pieces of state are called {}", piece.name);
        Ok(None)
    }
}

fn bytes_of_numbers(numbers: &[i64]) -> Vec<u8> {
    numbers.iter().flat_map(|number| number.to_le_bytes()).collect()
}

impl Visitor for Writer {
    fn halves(
        &mut self,
        piece: &Piece<'_>,
        shape: [usize; 2],
        values: &dyn Fn() -> Vec<u16>,
    ) -> Seen<Vec<u16>> {
        let bytes = values().into_iter().flat_map(u16::to_le_bytes).collect();
        self.put(piece, Dtype::U16, &shape, bytes)
    }

    fn bits(
        &mut self,
        piece: &Piece<'_>,
        shape: [usize; 2],
        values: &dyn Fn() -> BitVec<u8, Lsb0>,
    ) -> Seen<BitVec<u8, Lsb0>> {
        let bytes = values().iter().by_vals().map(u8::from).collect();
        self.put(piece, Dtype::U8, &shape, bytes)
    }

    fn numbers(&mut self, piece: &Piece<'_>, values: &[i64]) -> Seen<Vec<i64>> {
        self.put(piece, Dtype::I64, &[values.len()], bytes_of_numbers(values))
    }

    fn rows(
        &mut self,
        piece: &Piece<'_>,
        width: usize,
        values: &dyn Fn() -> Vec<i64>,
    ) -> Seen<Vec<i64>> {
        let values = values();
        self.put(piece, Dtype::I64, &[values.len() / width, width], bytes_of_numbers(&values))
    }
}

/// The entry of the metadata that says what the checkpoint is.
const ABOUT: &str = "dalean";
/// Names in it, `content` aside.
const ENTRIES: [&str; 4] = ["arithmetic", "run", "data", "state_hash"];

/// Hash of everything a checkpoint says.
fn content<'a>(
    tensors: impl Iterator<Item = (&'a str, Dtype, &'a [usize], &'a [u8])>,
    entries: &[String; ENTRIES.len()],
) -> String {
    let mut hash = blake3::Hasher::new();
    for (name, dtype, shape, bytes) in tensors {
        let head = format!("{name}\n{dtype:?} {shape:?}\n");
        hash.update(head.as_bytes()).update(bytes);
    }
    for (name, value) in ENTRIES.iter().zip(entries) {
        hash.update(format!("{name} {value}\n").as_bytes());
    }
    hash.finalize().to_hex().to_string()
}

/// The state as bytes.
///
/// # Panics
/// Never: names are unique and sizes small.
#[must_use]
pub fn write(state: &mut dyn State, identity: Identity<'_>) -> Vec<u8> {
    let mut writer = Writer::default();
    state.visit(&mut writer).expect("nothing is replaced");
    let tensors = writer.0;
    let Identity { run, data } = identity;
    let entries = [ARITHMETIC.to_string(), run.into(), data.into(), hash::state(state)];
    let views = tensors.iter().map(|(name, t)| (&**name, t.dtype, &*t.shape, &*t.bytes));
    let content = content(views, &entries);
    let named = ENTRIES.map(str::to_owned).into_iter().zip(entries);
    let about: BTreeMap<_, _> = named.chain([("content".to_owned(), content)]).collect();
    let about = serde_json::to_string(&about).expect("words have a JSON form");
    // the library takes a hash map and writes its entries in any order: so there is one
    let metadata = [(ABOUT.to_owned(), about)].into();
    safetensors::serialize(&tensors, Some(metadata)).expect("names are unique and sizes small")
}

/// A checkpoint whose content is what it says.
struct Checked<'a> {
    file: SafeTensors<'a>,
    about: BTreeMap<String, String>,
}

impl<'a> Checked<'a> {
    fn new(bytes: &'a [u8], identity: Identity<'_>) -> Result<Self, CheckpointError> {
        let (_, header) = SafeTensors::read_metadata(bytes)?;
        let file = SafeTensors::deserialize(bytes)?;
        let about = header.metadata().as_ref().and_then(|entries| entries.get(ABOUT));
        let about = about.ok_or_else(|| damaged(ABOUT, "is missing from the metadata"))?;
        let about = serde_json::from_str(about);
        let about = about.map_err(|error| damaged(ABOUT, &format!("is no JSON: {error}")))?;
        let checked = Self { file, about };
        checked.same("arithmetic", &ARITHMETIC.to_string())?;
        checked.same("run", identity.run)?;
        checked.same("data", identity.data)?;
        let mut entries = ENTRIES.map(str::to_owned);
        for (name, entry) in ENTRIES.into_iter().zip(&mut entries) {
            *entry = checked.entry(name)?;
        }
        let tensors: BTreeMap<_, _> = checked.file.tensors().into_iter().collect();
        let views = tensors.iter().map(|(name, t)| (&**name, t.dtype(), t.shape(), t.data()));
        checked.same("content", &content(views, &entries))?;
        Ok(checked)
    }

    /// An entry of the metadata.
    fn entry(&self, what: &'static str) -> Result<String, CheckpointError> {
        let found = self.about.get(what).cloned();
        Ok(found.ok_or_else(|| damaged(what, "is missing from the metadata"))?)
    }

    fn same(&self, what: &'static str, wanted: &str) -> Result<(), CheckpointError> {
        match self.entry(what)? {
            found if found == wanted => Ok(()),
            found => Err(CheckpointError::Other { what, found, wanted: wanted.into() }),
        }
    }

    fn bytes(&self, name: &str, dtype: Dtype, shape: &[usize]) -> Result<&[u8], StateError> {
        let tensor = self.file.tensor(name).map_err(|_| damaged(name, "is missing"))?;
        if tensor.dtype() != dtype || tensor.shape() != shape {
            let (kind, found) = (tensor.dtype(), tensor.shape());
            let (found, wanted) = (kind_and_shape(kind, found), kind_and_shape(dtype, shape));
            let found = format!("holds {found}, but should hold {wanted}");
            return Err(damaged(name, &found));
        }
        Ok(tensor.data())
    }

    fn halves(&self, name: &str, shape: &[usize]) -> Result<Vec<u16>, StateError> {
        let bytes = self.bytes(name, Dtype::U16, shape)?;
        Ok(bytes.as_chunks::<2>().0.iter().map(|pair| u16::from_le_bytes(*pair)).collect())
    }

    fn numbers(&self, name: &str, shape: &[usize]) -> Result<Vec<i64>, StateError> {
        let bytes = self.bytes(name, Dtype::I64, shape)?;
        Ok(bytes.as_chunks::<8>().0.iter().map(|number| i64::from_le_bytes(*number)).collect())
    }
}

/// `3 x 4 numbers of 16 bits`.
fn kind_and_shape(kind: Dtype, shape: &[usize]) -> String {
    let sides: Vec<_> = shape.iter().map(ToString::to_string).collect();
    format!("{} numbers of {} bits", sides.join(" x "), kind.bitsize())
}

fn damaged(name: &str, found: &str) -> StateError {
    StateError { name: name.into(), found: found.into() }
}

/// Hands back what a checkpoint holds.
struct Reader<'a> {
    file: &'a Checked<'a>,
    read: Vec<String>,
}

impl Reader<'_> {
    fn within(
        &mut self,
        piece: &Piece<'_>,
        mut values: impl Iterator<Item = i64>,
    ) -> Result<(), StateError> {
        self.read.push(piece.name.to_owned());
        match values.find(|value| !piece.within.contains(value)) {
            None => Ok(()),
            Some(value) => {
                let (least, most) = (piece.within.start(), piece.within.end());
                let found = format!("holds {value}, but should lie in {least}..={most}");
                Err(damaged(piece.name, &found))
            }
        }
    }
}

impl Visitor for Reader<'_> {
    fn halves(
        &mut self,
        piece: &Piece<'_>,
        shape: [usize; 2],
        _: &dyn Fn() -> Vec<u16>,
    ) -> Seen<Vec<u16>> {
        let values = self.file.halves(piece.name, &shape)?;
        self.within(piece, values.iter().map(|&value| i64::from(value)))?;
        Ok(Some(values))
    }

    fn bits(
        &mut self,
        piece: &Piece<'_>,
        shape: [usize; 2],
        _: &dyn Fn() -> BitVec<u8, Lsb0>,
    ) -> Seen<BitVec<u8, Lsb0>> {
        let bytes = self.file.bytes(piece.name, Dtype::U8, &shape)?;
        self.within(piece, bytes.iter().map(|&byte| i64::from(byte)))?;
        Ok(Some(bytes.iter().map(|&byte| byte == 1).collect()))
    }

    fn numbers(&mut self, piece: &Piece<'_>, values: &[i64]) -> Seen<Vec<i64>> {
        let values = self.file.numbers(piece.name, &[values.len()])?;
        self.within(piece, values.iter().copied())?;
        Ok(Some(values))
    }

    fn rows(
        &mut self,
        piece: &Piece<'_>,
        width: usize,
        _: &dyn Fn() -> Vec<i64>,
    ) -> Seen<Vec<i64>> {
        let tensor = self.file.file.tensor(piece.name);
        let tensor = tensor.map_err(|_| damaged(piece.name, "is missing"))?;
        let rows = tensor.shape().first().copied().unwrap_or(0);
        let values = self.file.numbers(piece.name, &[rows, width])?;
        self.within(piece, values.iter().copied())?;
        Ok(Some(values))
    }
}

/// Puts the state in `bytes` into `state`, which was built from the same configuration.
///
/// # Errors
/// When the file is damaged or belongs to another run. `state` may then hold part of it.
pub fn read(
    bytes: &[u8],
    state: &mut dyn State,
    identity: Identity<'_>,
) -> Result<(), CheckpointError> {
    let checked = Checked::new(bytes, identity)?;
    let mut reader = Reader { file: &checked, read: vec![] };
    state.visit(&mut reader)?;
    let known = reader.read;
    if let Some(name) =
        checked.file.names().into_iter().find(|name| !known.iter().any(|k| k == name))
    {
        return Err(damaged(name, "is no part of this run's state").into());
    }
    checked.same("state_hash", &hash::state(state))
}

/// Levels of arrays in a checkpoint, without building the network; an array is a layer, the name of its pathway and
/// its shape.
///
/// # Errors
/// When the file is damaged, belongs to another run, or does not hold the state that `state_hash` names.
pub fn levels(
    bytes: &[u8],
    identity: Identity<'_>,
    state_hash: &str,
    arrays: &[(usize, &str, [usize; 2])],
) -> Result<Vec<Vec<u16>>, CheckpointError> {
    let checked = Checked::new(bytes, identity)?;
    checked.same("state_hash", state_hash)?;
    let of = |&(layer, pathway, ref shape): &(usize, &str, [usize; 2])| {
        Ok(checked.halves(&Layer::levels_name(layer, pathway), shape)?)
    };
    arrays.iter().map(of).collect()
}

/// The first place where two checkpoints hold different state: tensor, number of the value, both values.
#[must_use]
pub fn first_difference(kept: &[u8], found: &[u8]) -> Option<String> {
    let [kept, found] = [kept, found].map(|bytes| SafeTensors::deserialize(bytes).ok());
    let (kept, found) = (kept?, found?);
    let tensors: BTreeMap<_, _> = kept.tensors().into_iter().collect();
    for (name, kept) in &tensors {
        let Ok(found) = found.tensor(name) else {
            return Some(format!("tensor `{name}` belongs to no such run"));
        };
        if (kept.dtype(), kept.shape()) != (found.dtype(), found.shape()) {
            return Some(format!("tensor `{name}` has another shape"));
        }
        let width = kept.dtype().bitsize() / 8;
        let pairs = kept.data().chunks(width).zip(found.data().chunks(width));
        if let Some((at, (kept, found))) = pairs.enumerate().find(|(_, (a, b))| a != b) {
            let number = |bytes: &[u8]| {
                bytes.iter().rev().fold(0u64, |number, &byte| number << 8 | u64::from(byte))
            };
            let (kept, found) = (number(kept).cast_signed(), number(found).cast_signed());
            return Some(format!("tensor `{name}`, value {at}: {kept} there, {found} here"));
        }
    }
    let missing = found.names().into_iter().find(|name| !tensors.contains_key(*name));
    missing.map(|name| format!("tensor `{name}` is missing"))
}
