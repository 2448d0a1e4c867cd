//! What drives the substrate to learn: errors, routes, rules, and the numbers one watches.
//!
//! [`error`] turns outputs and targets into bounded words, [`route`] decides which word a unit hears, a
//! [`rule`] is a maker of operation lists, and [`driver`] carries a list out. A [`network`] checks that all of these fit
//! together and is the one way to build them; [`outside`] is a network that a caller drives. [`statistics`] looks at the cells.

pub mod driver;
pub mod error;
pub mod network;
pub mod outside;
pub mod route;
pub mod rule;
pub mod statistics;
