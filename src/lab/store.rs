//! A run on disk: folder, records, checkpoint, state hash, receipt.
//!
//! ```text
//! config.toml             the resolved configuration, self-contained
//! metrics.jsonl           one record an epoch
//! ledger.json             every count by phase, layer, pathway, operation, event
//! checkpoint.safetensors  the state after the last finished epoch
//! best-NNNNN.safetensors  the state with the best validation score
//! receipt.json            hashes that let anyone do it again
//! stream-NNNNN.safetensors  what the environments of a policy showed in an epoch, where that is kept
//! report.html             for people
//! ```
//!
//! Many runs make a store: folders named by what decides their result ([`address`]), and an index ([`index`]).
//!
//! Every file is written beside its place and moved into it ([`place`]), records, which grow at their end, before the
//! checkpoint, so that a run that is killed is loadable up to its last finished epoch.

pub mod address;
pub mod checkpoint;
pub mod folder;
pub mod hash;
pub mod index;
pub mod kept;
pub mod ledger;
pub mod place;
pub mod record;
pub mod stream;

/// Version of the arithmetic. It rises when an equation moves; `verify` refuses another.
pub const ARITHMETIC: u32 = 2;
