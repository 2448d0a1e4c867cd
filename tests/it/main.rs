//! Tests of the whole program, through its public faces.

mod laws;
mod oracle;
