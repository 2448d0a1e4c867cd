//! The substrate: unsigned crossbars, their periphery, and the engine that drives them.

pub mod crossbar;
pub mod device;
pub mod engine;
pub mod hardware;
pub mod layer;
pub mod ledger;
pub mod periphery;
pub mod population;
pub mod state;
