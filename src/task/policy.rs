//! Policies: an actor and a critic on crossbars learn by proximal policy optimisation, in fixed point.
//!
//! See docs/MODEL.md, 5.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]
