//! Unsigned arrays of cells: storage, read, transposed read, outer-product sums, programming.
//!
//! A [`Crossbar`] is one logical array, rows x columns, of levels in a window. It is stored as the
//! physical tile is read: see [`layout`]. The loops that touch every cell live in [`kernel`].

pub mod kernel;
pub mod layout;
