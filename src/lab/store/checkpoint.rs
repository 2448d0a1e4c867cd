//! The state of a run as safetensors, written whole and read with suspicion.
//!
//! Tensors: `layer0.pp.levels` (U16, rows x columns), `.residuals` (U16), `.pruned` (U8, one byte a cell),
//! `layer0.writes`, `layer0.adc_shifts`, `means`, `ledger.training` and so on, `cycles.training` and so on where
//! cycles are counted (I64). Metadata: arithmetic version, hash of
//! the configuration, hash of the data, epoch, updates, state hash. What is read is checked against all of them.

use std::borrow::Cow;

use bitvec::prelude::*;
use safetensors::tensor::Metadata;
use safetensors::{Dtype, SafeTensors, View};

use super::{ARITHMETIC, hash};
use crate::chip::engine::Phase;
use crate::chip::ledger::{Cycles, During, Event, Ledger, PATHWAYS};
use crate::task::classify::Trainer;

/// Why a checkpoint cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum CheckpointError {
    /// Not a safetensors file.
    #[error("it is not a checkpoint: {0}; start the run again")]
    Format(#[from] safetensors::SafeTensorError),
    /// Another run's, or another version's.
    #[error(
        "its {what} is {found}, but this run has {wanted}; it belongs to another run or version"
    )]
    Other {
        /// Which entry.
        what: &'static str,
        /// What the file says.
        found: String,
        /// What this run says.
        wanted: String,
    },
    /// A tensor is missing or has another shape.
    #[error("tensor `{name}` {found}; the file is damaged: start the run again")]
    Tensor {
        /// Which tensor.
        name: String,
        /// What is wrong.
        found: String,
    },
}

/// What a checkpoint belongs to.
#[derive(Debug, Clone, Copy)]
pub struct Identity<'a> {
    /// Hash of the resolved configuration.
    pub config: &'a str,
    /// Hash of the data.
    pub data: &'a str,
}

struct Tensor {
    dtype: Dtype,
    shape: Vec<usize>,
    bytes: Vec<u8>,
}

impl View for Tensor {
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

fn halves(values: impl Iterator<Item = u16>, shape: [usize; 2]) -> Tensor {
    let bytes = values.flat_map(u16::to_le_bytes).collect();
    Tensor { dtype: Dtype::U16, shape: shape.to_vec(), bytes }
}

fn numbers(values: Vec<i64>) -> Tensor {
    let shape = vec![values.len()];
    let bytes = values.into_iter().flat_map(i64::to_le_bytes).collect();
    Tensor { dtype: Dtype::I64, shape, bytes }
}

fn count(n: u64) -> i64 {
    i64::try_from(n).expect("a run has fewer than 2^63 events")
}

/// The state as bytes.
///
/// # Panics
/// Never: names are unique and sizes small.
#[must_use]
pub fn write(trainer: &Trainer, identity: Identity<'_>) -> Vec<u8> {
    let engine = trainer.driver().engine();
    let mut tensors = Vec::new();
    for layer in engine.layers() {
        let name = |what: &str| format!("layer{}.{what}", layer.index);
        let shape = [layer.layout.rows, layer.layout.columns];
        for (array, pathway) in layer.arrays.iter().zip(layer.spec.wiring.pathways()) {
            let name = |what: &str| name(&format!("{}.{what}", pathway.name));
            tensors.push((name("levels"), halves(array.levels(), shape)));
            if let Some(residuals) = array.residuals() {
                tensors.push((name("residuals"), halves(residuals.into_iter(), shape)));
            }
            if let Some(bits) = array.pruned() {
                let bytes = bits.iter().by_vals().map(u8::from).collect();
                let tensor = Tensor { dtype: Dtype::U8, shape: shape.to_vec(), bytes };
                tensors.push((name("pruned"), tensor));
            }
        }
        let writes = layer.writes.iter().map(|&n| count(n)).collect();
        tensors.push((name("writes"), numbers(writes)));
        let shifts = layer.adc_shifts.iter().flatten().map(|&n| i64::from(n)).collect();
        tensors.push((name("adc_shifts"), numbers(shifts)));
    }
    tensors.push(("means".into(), numbers(trainer.driver().unit().means().to_vec())));
    for phase in Phase::ALL {
        let ledger = engine.ledger(phase);
        let mut counts = Vec::new();
        for layer in 0..ledger.layers() {
            for pathway in 0..PATHWAYS {
                let code = u8::try_from(pathway).expect("few pathways");
                for during in During::ALL {
                    let of = |event| count(ledger.get(layer, code, during, event));
                    counts.extend(Event::ALL.map(of));
                }
            }
        }
        tensors.push((format!("ledger.{}", phase.name()), numbers(counts)));
        if let Some(cycles) = ledger.cycles() {
            let cycles = cycles.numbers().into_iter().map(count).collect();
            tensors.push((format!("cycles.{}", phase.name()), numbers(cycles)));
        }
    }
    let entries = [
        ("arithmetic", ARITHMETIC.to_string()),
        ("config_hash", identity.config.to_owned()),
        ("data_hash", identity.data.to_owned()),
        ("epoch", trainer.epoch().to_string()),
        ("updates", trainer.driver().updates().to_string()),
        ("state_hash", hash::state(trainer.driver())),
    ];
    // the library takes a hash map and writes its names in order
    let metadata = entries.into_iter().map(|(key, value)| (key.to_owned(), value)).collect();
    safetensors::serialize(tensors, Some(metadata)).expect("names are unique and sizes small")
}

/// Puts the state in `bytes` into `trainer`, which was built from the same configuration.
///
/// # Errors
/// When the file is damaged or belongs to another run. `trainer` may then hold part of it.
pub fn read(
    bytes: &[u8],
    trainer: &mut Trainer,
    identity: Identity<'_>,
) -> Result<(), CheckpointError> {
    let (_, header) = SafeTensors::read_metadata(bytes)?;
    let file = SafeTensors::deserialize(bytes)?;
    same(&header, "arithmetic", &ARITHMETIC.to_string())?;
    same(&header, "config_hash", identity.config)?;
    same(&header, "data_hash", identity.data)?;
    let whole = |what: &'static str| -> Result<u64, CheckpointError> {
        entry(&header, what)?.parse().map_err(|_| CheckpointError::Tensor {
            name: what.into(),
            found: "is not a whole number".into(),
        })
    };
    let (epoch, updates) = (whole("epoch")?, whole("updates")?);
    let epoch = u32::try_from(epoch)
        .ok()
        .filter(|&epoch| epoch <= trainer.experiment().epochs)
        .ok_or_else(|| damaged("epoch", "is beyond the last epoch"))?;

    let window = trainer.experiment().hardware.cell.window;
    let residual_bits = trainer.experiment().hardware.write.residual_bits.get();
    for layer in trainer.driver_mut().engine_mut().layers_mut() {
        let shape = [layer.layout.rows, layer.layout.columns];
        let prefix = format!("layer{}", layer.index);
        for (array, pathway) in layer.arrays.iter_mut().zip(layer.spec.wiring.pathways()) {
            let name = |what: &str| format!("{prefix}.{}.{what}", pathway.name);
            let levels = read_halves(&file, &name("levels"), &shape)?;
            let inside = |level: &u16| (window.floor()..=window.ceiling()).contains(level);
            if !levels.iter().all(inside) {
                return Err(damaged(&name("levels"), "holds a level outside the window"));
            }
            for (row, levels) in levels.chunks(shape[1]).enumerate() {
                array.load_row(row, levels);
            }
            if array.residuals().is_some() {
                let residuals = read_halves(&file, &name("residuals"), &shape)?;
                if residuals.iter().any(|&r| u32::from(r) >> residual_bits != 0) {
                    return Err(damaged(&name("residuals"), "holds a remainder above its width"));
                }
                array.load_residuals(&residuals);
            }
            if array.pruned().is_some() {
                let bytes = bytes_of(&file, &name("pruned"), Dtype::U8, &shape)?;
                if bytes.iter().any(|&byte| byte > 1) {
                    return Err(damaged(&name("pruned"), "holds something other than 0 and 1"));
                }
                let bits: BitVec<u8, Lsb0> = bytes.iter().map(|&byte| byte == 1).collect();
                array.load_pruned(&bits);
            }
        }
        let name = format!("{prefix}.writes");
        for (writes, number) in
            layer.writes.iter_mut().zip(read_numbers(&file, &name, layer.arrays.len())?)
        {
            *writes = positive(&name, number)?;
        }
        let name = format!("{prefix}.adc_shifts");
        let numbers = read_numbers(&file, &name, layer.adc_shifts.iter().flatten().count())?;
        for (shift, number) in layer.adc_shifts.iter_mut().flatten().zip(numbers) {
            *shift = u32::try_from(number)
                .ok()
                .filter(|&shift| shift < 63)
                .ok_or_else(|| damaged(&name, "holds an impossible shift"))?;
        }
    }
    let means = trainer.driver().unit().means().len();
    let means = read_numbers(&file, "means", means)?;
    trainer.driver_mut().unit_mut().load_means(&means);
    for phase in Phase::ALL {
        let name = format!("ledger.{}", phase.name());
        let ledger = trainer.driver_mut().engine_mut().ledger_mut(phase);
        let layers = ledger.layers();
        let total = layers * PATHWAYS * During::ALL.len() * Event::ALL.len();
        let mut numbers = read_numbers(&file, &name, total)?.into_iter();
        let mut fresh = Ledger::new(layers);
        if let Some(cycles) = ledger.cycles() {
            let name = format!("cycles.{}", phase.name());
            let stored = read_numbers(&file, &name, cycles.numbers().len())?;
            let stored = stored.into_iter().map(|number| positive(&name, number));
            let stored = Cycles::from_numbers(layers, &stored.collect::<Result<Vec<_>, _>>()?);
            fresh = Ledger::with_cycles(layers);
            *fresh.cycles_mut().expect("made with them") = stored.expect("as many as there are");
        }
        for layer in 0..layers {
            for pathway in 0..PATHWAYS {
                let code = u8::try_from(pathway).expect("few pathways");
                for during in During::ALL {
                    for event in Event::ALL {
                        let number = numbers.next().expect("counted above");
                        fresh.add(layer, code, during, event, positive(&name, number)?);
                    }
                }
            }
        }
        *ledger = fresh;
    }
    trainer.driver_mut().set_updates(updates);
    trainer.set_epoch(epoch);
    same(&header, "state_hash", &hash::state(trainer.driver()))
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
    let (_, header) = SafeTensors::read_metadata(bytes)?;
    let file = SafeTensors::deserialize(bytes)?;
    let wanted = [
        ("config_hash", identity.config),
        ("data_hash", identity.data),
        ("state_hash", state_hash),
    ];
    for (what, wanted) in wanted {
        same(&header, what, wanted)?;
    }
    let of = |&(layer, pathway, ref shape): &(usize, &str, [usize; 2])| {
        read_halves(&file, &format!("layer{layer}.{pathway}.levels"), shape)
    };
    arrays.iter().map(of).collect()
}

/// An entry of the metadata.
fn entry(header: &Metadata, what: &'static str) -> Result<String, CheckpointError> {
    let found = header.metadata().as_ref().and_then(|map| map.get(what)).cloned();
    found.ok_or_else(|| damaged(what, "is missing from the metadata"))
}

fn same(header: &Metadata, what: &'static str, wanted: &str) -> Result<(), CheckpointError> {
    match entry(header, what)? {
        found if found == wanted => Ok(()),
        found => Err(CheckpointError::Other { what, found, wanted: wanted.into() }),
    }
}

fn damaged(name: &str, found: &str) -> CheckpointError {
    CheckpointError::Tensor { name: name.into(), found: found.into() }
}

fn positive(name: &str, number: i64) -> Result<u64, CheckpointError> {
    u64::try_from(number).map_err(|_| damaged(name, "holds a negative count"))
}

fn bytes_of<'a>(
    file: &SafeTensors<'a>,
    name: &str,
    dtype: Dtype,
    shape: &[usize],
) -> Result<&'a [u8], CheckpointError> {
    let tensor = file.tensor(name).map_err(|_| damaged(name, "is missing"))?;
    if tensor.dtype() != dtype || tensor.shape() != shape {
        let found = format!(
            "is {:?} {:?}, but should be {dtype:?} {shape:?}",
            tensor.dtype(),
            tensor.shape()
        );
        return Err(damaged(name, &found));
    }
    Ok(tensor.data())
}

fn read_halves(
    file: &SafeTensors<'_>,
    name: &str,
    shape: &[usize],
) -> Result<Vec<u16>, CheckpointError> {
    let bytes = bytes_of(file, name, Dtype::U16, shape)?;
    Ok(bytes.chunks_exact(2).map(|pair| u16::from_le_bytes([pair[0], pair[1]])).collect())
}

fn read_numbers(
    file: &SafeTensors<'_>,
    name: &str,
    len: usize,
) -> Result<Vec<i64>, CheckpointError> {
    let bytes = bytes_of(file, name, Dtype::I64, &[len])?;
    let number = |b: &[u8]| i64::from_le_bytes(b.try_into().expect("eight bytes"));
    Ok(bytes.chunks_exact(8).map(number).collect())
}
