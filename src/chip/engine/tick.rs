//! The plain reference of time: tiles and networks of tiles, cycle by cycle.
//!
//! [`Tile`] is the page docs/TILE.md, and equals its RTL twin on every register in every cycle. A network of such tiles
//! executes the operations of the engine; the engine's own counts, in closed form, equal it after every operation.
//! Slow on purpose: nothing here is clever.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

mod network;
mod tile;

pub use network::{Network, PartSpan, Span, TileAt};
pub use tile::{
    BankEvents, Command, Launch, More, Squares, Tile, TileAdc, TileBalance, TileConfig, TileEvents,
    TileSize, TileUnits,
};
