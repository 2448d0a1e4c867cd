//! Tests of the whole program, through its public faces.
#![expect(
    clippy::unwrap_used,
    clippy::disallowed_methods,
    reason = "tests fail by panicking, and look at the files of runs"
)]

mod analysis;
mod anchors;
mod bad_input;
mod bench;
mod browser;
mod damage;
mod defaults;
mod deploy;
mod devices;
mod environments;
mod examples;
mod extending;
mod facade;
mod golden_run;
mod hardware;
mod ir_drop;
mod keys;
mod laws;
mod measure;
mod memory;
mod oracle;
mod output;
mod outside;
mod own_data;
mod own_runs;
mod policies;
mod prices;
mod program;
mod report;
mod rules;
mod runs;
mod same_bits;
mod strangers;
mod sweep;
mod tile;
mod tile_program;
mod trace;
