//! Tests of the whole program, through its public faces.

mod bad_input;
mod laws;
mod oracle;
mod program;
mod rules;
mod same_bits;
