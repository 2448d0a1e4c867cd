//! Reports: pages and tables made from records. Nothing here changes a result.
use crate::lab::store::record::{EpochRecord, Receipt};

/// h
#[derive(Debug)]
pub struct Heat { #[allow(missing_docs)] pub layer: usize, #[allow(missing_docs)] pub pathway: String, #[allow(missing_docs)] pub rows: usize, #[allow(missing_docs)] pub columns: usize, #[allow(missing_docs)] pub level_max: u16, #[allow(missing_docs)] pub levels: Vec<u16> }
/// p
#[derive(Debug)]
#[allow(missing_docs)]
pub struct Picture { pub example: u64, pub truth: u64, pub guess: u64, pub height: usize, pub width: usize, pub channels: usize, pub full_scale: u8, pub values: Vec<u8> }
/// v
#[derive(Debug)]
#[allow(missing_docs)]
pub struct RunView<'a> { pub title: String, pub config: &'a str, pub receipt: &'a Receipt, pub epochs: &'a [EpochRecord], pub heats: &'a [Heat], pub pictures: &'a [Picture], pub class_names: &'a [String] }
/// h
#[must_use]
pub fn html(_: &RunView<'_>) -> String { String::new() }
/// t
pub mod text {
    /// s
    #[must_use]
    pub fn summary(_: &super::RunView<'_>) -> String { String::new() }
}
