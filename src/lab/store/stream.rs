//! What environments showed, as a file: one an epoch, safetensors, written whole and read with suspicion.
//!
//! ```text
//! training.*, evaluation.*   the lists of a stream by their names: entries, values, lines, line_counts, rewards, ended, reached_*
//! state.N                    numbers of the N-th piece of the state of the environments at the end
//! dalean                     metadata, JSON: name and range of each piece
//! ```
//!
//! A policy that is given these in place of its environments reaches the same state after every epoch, and so proves them:
//! no other hash is kept of them.

use std::borrow::Cow;

use safetensors::{Dtype, SafeTensors, View};
use serde::{Deserialize, Serialize};

use crate::task::environment::{KeptPiece, Record, ShownStream};

/// Name of the file of an epoch; of epoch 0, what was shown before the first update.
#[must_use]
pub fn stream_name(epoch: u32) -> String {
    format!("stream-{epoch:05}.safetensors")
}

/// Name of the file of the final test.
pub const STREAM_TEST: &str = "stream-test.safetensors";

/// Name and range of a piece of state.
#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct PieceAbout {
    name: String,
    least: i64,
    most: i64,
}

/// A list as the file holds it.
#[derive(Debug)]
struct Listed {
    dtype: Dtype,
    shape: [usize; 1],
    bytes: Vec<u8>,
}

impl View for &Listed {
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

/// A number in a list, little end first.
trait Element: Sized {
    const DTYPE: Dtype;
    const BYTES: usize;
    fn put(&self, bytes: &mut Vec<u8>);
    fn take(bytes: &[u8]) -> Self;
}

macro_rules! elements {
    ($($kind:ident $dtype:ident,)*) => {$(
        impl Element for $kind {
            const DTYPE: Dtype = Dtype::$dtype;
            const BYTES: usize = size_of::<$kind>();

            fn put(&self, bytes: &mut Vec<u8>) {
                bytes.extend(self.to_le_bytes());
            }

            fn take(bytes: &[u8]) -> Self {
                Self::from_le_bytes(bytes.try_into().expect("a chunk is that long"))
            }
        }
    )*};
}

elements!(i64 I64, i32 I32, u32 U32, u8 U8,);

fn listed<T: Element>(list: &[T]) -> Listed {
    let mut bytes = Vec::with_capacity(list.len() * T::BYTES);
    list.iter().for_each(|one| one.put(&mut bytes));
    Listed { dtype: T::DTYPE, shape: [list.len()], bytes }
}

fn list<T: Element>(file: &SafeTensors<'_>, name: &str) -> Result<Vec<T>, String> {
    let tensor = file.tensor(name).map_err(|error| format!("`{name}`: {error}"))?;
    let fits = tensor.shape() == [tensor.data().len() / T::BYTES];
    if tensor.dtype() != T::DTYPE || !fits {
        let (dtype, shape) = (tensor.dtype(), tensor.shape());
        return Err(format!("`{name}` is {dtype:?} {shape:?}, not one row of {:?}", T::DTYPE));
    }
    Ok(tensor.data().chunks_exact(T::BYTES).map(T::take).collect())
}

/// The lists of a stream, each with its name.
fn lists(prefix: &str, stream: &ShownStream) -> Vec<(String, Listed)> {
    // without `..`: what a stream is made of is listed or does not compile
    let ShownStream {
        entries,
        values,
        lines,
        line_counts,
        rewards,
        ended,
        reached_values,
        reached_lines,
        reached_line_counts,
    } = stream;
    [
        ("entries", listed(entries)),
        ("values", listed(values)),
        ("lines", listed(lines)),
        ("line_counts", listed(line_counts)),
        ("rewards", listed(rewards)),
        ("ended", listed(ended)),
        ("reached_values", listed(reached_values)),
        ("reached_lines", listed(reached_lines)),
        ("reached_line_counts", listed(reached_line_counts)),
    ]
    .map(|(name, list)| (format!("{prefix}.{name}"), list))
    .into()
}

fn stream(prefix: &str, file: &SafeTensors<'_>) -> Result<ShownStream, String> {
    let name = |name: &str| format!("{prefix}.{name}");
    Ok(ShownStream {
        entries: list(file, &name("entries"))?,
        values: list(file, &name("values"))?,
        lines: list(file, &name("lines"))?,
        line_counts: list(file, &name("line_counts"))?,
        rewards: list(file, &name("rewards"))?,
        ended: list(file, &name("ended"))?,
        reached_values: list(file, &name("reached_values"))?,
        reached_lines: list(file, &name("reached_lines"))?,
        reached_line_counts: list(file, &name("reached_line_counts"))?,
    })
}

/// The file of a record.
///
/// # Panics
/// Never: lists have a form in the file.
#[must_use]
pub fn write(record: &Record) -> Vec<u8> {
    let Record { training, evaluation, state } = record;
    let mut all = lists("training", training);
    all.extend(lists("evaluation", evaluation));
    let mut about = Vec::new();
    for (number, KeptPiece { name, within, numbers }) in state.iter().enumerate() {
        all.push((format!("state.{number}"), listed(numbers)));
        about.push(PieceAbout { name: name.clone(), least: *within.start(), most: *within.end() });
    }
    let about = serde_json::to_string(&about).expect("names have a JSON form");
    let views = all.iter().map(|(name, list)| (name.clone(), list));
    safetensors::serialize(views, Some([("dalean".to_owned(), about)].into()))
        .expect("lists have a form in the file")
}

/// What a file holds.
///
/// # Errors
/// What is wrong with it.
pub fn read(bytes: &[u8]) -> Result<Record, String> {
    let damaged = |error: safetensors::SafeTensorError| format!("is no stream: {error}");
    let (_, header) = SafeTensors::read_metadata(bytes).map_err(damaged)?;
    let file = SafeTensors::deserialize(bytes).map_err(damaged)?;
    let about = header.metadata().as_ref().and_then(|all| all.get("dalean"));
    let about = about.ok_or("does not say what the state is made of")?;
    let about: Vec<PieceAbout> = serde_json::from_str(about).map_err(|error| error.to_string())?;
    let piece = |(number, PieceAbout { name, least, most }): (usize, PieceAbout)| {
        let numbers = list(&file, &format!("state.{number}"))?;
        Ok(KeptPiece { name, within: least..=most, numbers })
    };
    let state = about.into_iter().enumerate().map(piece).collect::<Result<_, String>>()?;
    Ok(Record {
        training: stream("training", &file)?,
        evaluation: stream("evaluation", &file)?,
        state,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn record() -> Record {
        let training = ShownStream {
            entries: vec![-2, 2],
            values: vec![1, -2, 3, -4],
            lines: vec![7],
            line_counts: vec![1, 0],
            rewards: vec![65_536, -1],
            ended: vec![0, 2],
            reached_values: vec![5],
            reached_lines: vec![9],
            reached_line_counts: vec![1],
        };
        let piece =
            KeptPiece { name: "environment.x".into(), within: -3..=i64::MAX, numbers: vec![-3, 8] };
        Record { training, evaluation: ShownStream::default(), state: vec![piece] }
    }

    #[test]
    fn a_record_comes_back_from_its_file_and_is_written_alike() {
        let bytes = write(&record());
        assert_eq!(read(&bytes), Ok(record()));
        assert_eq!(write(&read(&bytes).unwrap()), bytes);
        assert_eq!(read(&write(&Record::default())), Ok(Record::default()));
    }

    #[test]
    fn a_damaged_file_is_refused_or_says_something_else_and_nobody_panics() {
        let bytes = write(&record());
        for at in 0..bytes.len() {
            for flip in [1, 0x80] {
                let mut other = bytes.clone();
                other[at] ^= flip;
                assert_ne!(read(&other), Ok(record()), "byte {at}");
            }
            assert!(read(&bytes[..at]).is_err(), "{at} bytes of {}", bytes.len());
        }
    }
}
