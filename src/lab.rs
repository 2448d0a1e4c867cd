//! Everything around a run: files in, files out.

pub mod analysis;
pub mod config;
pub mod data;
pub mod measure;
pub mod near;
pub mod price;
pub mod report;
pub mod run;
pub mod runs;
pub mod store;
pub mod sweep;
pub mod table;
pub mod wave;
