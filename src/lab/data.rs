//! Data sets, and the door from files to [`crate::task::classify::Examples`].
//!
//! [`load`] takes a [`Source`], a known set by name or files of one's own, and gives the three parts of a
//! split with a hash over their content. [`fetch`] gets a known set and puts it below a [`DataRoot`] as
//! the authors' own files, nothing half-written; [`list`] says what is there. The readers [`idx`],
//! [`npy`], [`npz`] and [`csv`] are functions on bytes that allocate no more than they are given; [`numbers`] and [`labels`]
//! say what numbers and labels become. [`FloatDoor`] takes what environments outside show a policy.

mod acting;
pub mod arrays;
mod builtin;
mod catalog;
pub mod csv;
mod error;
mod fetch;
mod floats;
pub mod idx;
mod inflate;
pub mod labels;
mod list;
mod load;
mod md5;
pub mod npy;
pub mod npz;
pub mod numbers;
mod own;
mod source;

pub use catalog::{CATALOG, CatalogEntry, CatalogFile, MirrorForm, NpmForm};
pub use error::DataError;
pub use fetch::{FetchError, FetchEvent, Origin, fetch};
pub use floats::{FloatDoor, FloatOutcomes};
pub use list::{Entry, SetState, list};
pub use load::{Data, content_hash, load};
pub use own::{TableKeys, Told};
pub use source::{DataRoot, FileSet, ImageShape, NamedSet, ParityBits, PartFile, Source};
