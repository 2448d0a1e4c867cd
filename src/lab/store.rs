//! A run on disk: folder, records, checkpoint, state hash, resume, verify.

pub mod record;
