//! Policies: an actor and a critic on crossbars learn by proximal policy optimisation, in fixed point.
//!
//! See docs/MODEL.md, 5.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

pub mod advantage;
pub mod function;
pub mod head;
pub mod moments;
pub mod number;
pub mod observe;
pub mod rank;
pub mod ratio;
pub mod sample;
pub mod value;
